# SPDX-License-Identifier: BSD-3-Clause
"""``section.key=value``: single keys of a configuration, set from the command line or from Python."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping, Sequence
from typing import Any

from swarmevo.config import yaml as config_yaml
from swarmevo.config.messages import PLUGINS, shown
from swarmevo.config.models import Config, named
from swarmevo.errors import ConfigError


def as_overrides(settings: Mapping[str, Any]) -> list[str]:
    """Return ``{"section.key": value}`` as overrides.

    Raises:
        ConfigError: A value is none that YAML has.
    """
    return [f"{key}={_as_yaml(str(key), value)}" for key, value in settings.items()]


def _as_yaml(key: str, value: Any) -> str:
    try:
        return json.dumps(value, default=lambda array: array.tolist())  # of NumPy
    except (TypeError, ValueError, AttributeError, RecursionError) as error:
        got = f"{type(value).__name__}{' nested too deeply' if isinstance(error, RecursionError) else ''}"
        raise ConfigError(f"{key}: expected a number, text, list or mapping, got {got}") from None


def apply(raw: dict[str, Any], overrides: Sequence[str], errors: list[str]) -> None:
    """Set the keys of ``raw`` that overrides name; say of those that undo an earlier one that a key is set twice."""
    earlier: list[tuple[str, list[str], Any]] = []
    for override in overrides:
        path, equals, text = override.partition("=")
        keys = path.strip().split(".")
        if keys[0] == "vary" and len(keys) > 1:  # its keys are keys of the world: vary.box.mass
            keys = ["vary", ".".join(keys[1:])]
        if not equals or not all(keys):
            errors.append(f"--set {override}: expected section.key=value")
            continue
        value, found = config_yaml.parse(text)
        if found:
            errors += [f"--set {override}: {line}" for line in found]
            continue
        wanted = named(value) if keys[0] in PLUGINS and len(keys) == 1 else copy.deepcopy(value)
        if wrong := _set(raw, keys, value):
            errors.append(f"--set {override}: {wrong}")
            continue
        errors += [
            f"{'.'.join(before)}: set twice, by {other} and by {override}; give it once"
            for other, before, kept in earlier
            if before == keys or not _holds(raw, before, kept)
        ][:1]
        earlier.append((override, keys, wanted))


def _set(raw: dict[str, Any], keys: list[str], value: Any) -> str:
    """Set one key of ``raw``; return what is wrong with that, or nothing."""
    # A plugin's options are set beside those it has; its bare name keeps them.
    *sections, key = keys
    top = keys[0]
    if top in PLUGINS:
        raw[top] = named(raw.get(top, copy.deepcopy(Config.model_fields[top].default)))
        if not sections and isinstance(value, str) and isinstance(raw[top], Mapping):
            value = {value: raw[top].get(value, {})}
        if not sections:
            value = named(value)

    section = raw
    for name in sections:
        section = section.setdefault(name, {})
        if not isinstance(section, dict):
            return f"{name} is not a section, but {shown(config_yaml.plain(section))}"
    section[key] = value
    return ""


def _holds(now: Any, path: Sequence[str], wanted: Any) -> bool:
    """Whether there is at ``path`` what was wanted, or that and more."""
    for key in path:
        if not isinstance(now, Mapping) or key not in now:
            return False
        now = now[key]
    if isinstance(wanted, Mapping):
        return isinstance(now, Mapping) and all(_holds(now, [key], entry) for key, entry in wanted.items())
    return bool(now == wanted)

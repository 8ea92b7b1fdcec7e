# SPDX-License-Identifier: BSD-3-Clause
"""``section.key=value``: single keys of a configuration, set from the command line or from Python."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping, Sequence
from typing import Any

from swarmevo.config import paths, presets
from swarmevo.config import yaml as config_yaml
from swarmevo.config.messages import PLUGINS, default_list, shown
from swarmevo.config.models import Config, named
from swarmevo.errors import ConfigError


def as_overrides(settings: Mapping[str, Any]) -> list[str]:
    """Return ``{"section.key": value}`` as overrides.

    Raises:
        ConfigError: There are no keys with values, or a value is none that YAML has.
    """
    if not isinstance(settings, Mapping):
        raise ConfigError(f'set: expected {{"section.key": value}}, got {shown(settings)}')
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
        keys = _split(path.strip())
        if not equals or not all(keys):
            errors.append(f"--set {override}: expected section.key=value")
            continue
        if (written := paths.without_brackets(path)) != path:
            errors.append(f"--set {override}: expected section.key=value; write an entry of a list as {written}")
            continue
        value, found = config_yaml.parse(text)
        if found:
            errors += [f"--set {override}: {line}" for line in found]
            continue
        wanted = named(value) if keys[0] in PLUGINS and len(keys) == 1 else copy.deepcopy(value)
        if wrong := _set(raw, keys, value):
            errors.append(f"--set {override}: {wrong}")
            continue
        undone = [one for one in earlier if one[1] == keys or not _holds(raw, one[1], one[2])]
        errors += [
            f"{'.'.join(before)}: set twice, by {other} and by {override}; give it once" for other, before, _ in undone
        ][:1]
        earlier = [*(one for one in earlier if one not in undone), (override, keys, wanted)]


def sets(overrides: Sequence[str], section: str, key: str) -> bool:
    """Tell whether one of the overrides sets this key, alone or with its section."""
    raw: dict[str, Any] = {}
    apply(raw, overrides, [])
    found = raw.get(section)
    return isinstance(found, Mapping) and key in found


def _split(path: str) -> list[str]:
    """Return the steps of a path. The keys of ``vary`` and of each of ``worlds`` are keys of the world, undivided."""
    keys = path.split(".")
    whole = {"vary": 1, "worlds": 2}.get(keys[0], len(keys))
    return [*keys[:whole], ".".join(keys[whole:])] if len(keys) > whole else keys


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

    within: Any = raw
    for i, step in enumerate(sections):
        name: Any = step
        if isinstance(within, list):
            if wrong := paths.no_entry(".".join(keys[:i]), within, step):
                return wrong
            name = int(step)
        elif within.get(name) is None and paths.is_entry(keys[i + 1]):
            within[name] = _default(raw, keys[: i + 1])
        else:
            within.setdefault(name, {})
        if not isinstance(within[name], dict | list):
            return f"{name} is not a section, but {shown(config_yaml.plain(within[name]))}"
        within[name] = copy.copy(within[name])  # what an alias stands for elsewhere stays
        within = within[name]
    if isinstance(within, list):
        if wrong := paths.no_entry(".".join(sections), within, key):
            return wrong
        within[int(key)] = value
    else:
        within[key] = value
    return ""


def _default(raw: Mapping[str, Any], path: Sequence[str]) -> list[Any] | dict[str, Any]:
    """Return the list that stands at a path where nothing is named; a section without keys if none belongs there."""
    section = presets.filled(config_yaml.plain(raw)).get(path[0])
    of_preset = section.get(path[1]) if len(path) == 2 and isinstance(section, Mapping) else None
    found = of_preset or default_list(tuple(int(step) if paths.is_entry(step) else step for step in path))
    default: list[Any] | dict[str, Any] = {} if found is None else json.loads(json.dumps(found))
    return default


def _holds(now: Any, path: Sequence[str], wanted: Any) -> bool:
    """Whether there is at ``path`` what was wanted, or that and more."""
    for key in path:
        if isinstance(now, list) and not paths.no_entry("", now, key):
            now = now[int(key)]
        elif isinstance(now, Mapping) and key in now:
            now = now[key]
        else:
            return False
    if isinstance(wanted, list):
        return isinstance(now, list) and len(now) == len(wanted) and all(map(_holds, now, [()] * len(now), wanted))
    if isinstance(wanted, Mapping):
        return isinstance(now, Mapping) and all(_holds(now, [key], entry) for key, entry in wanted.items())
    return bool(now == wanted)

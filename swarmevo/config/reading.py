# SPDX-License-Identifier: BSD-3-Clause
"""The configuration of a run: read from YAML and ``--set`` overrides, written back with every key.

The keys themselves, with unit, range and default, are in ``models.py``.
"""

from __future__ import annotations

import copy
import importlib.resources
import re
import secrets
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from swarmevo.config import yaml as config_yaml
from swarmevo.config.messages import PLUGINS, did_you_mean, explain, keys_of, nearest, shown
from swarmevo.config.models import Config, named
from swarmevo.config.overrides import apply
from swarmevo.config.presets import stripped
from swarmevo.errors import ConfigError

TakeOptions = Callable[[str, str, Mapping[str, Any]], dict[str, Any]]


def _as_yaml_reads_them(kind: str, name: str, options: Mapping[str, Any]) -> dict[str, Any]:
    taken: dict[str, Any] = config_yaml.plain(options)
    return taken


def load(
    source: str | Path | None,
    overrides: Sequence[str] = (),
    check: Callable[[Config], list[str]] | None = None,
    options: TakeOptions = _as_yaml_reads_them,
) -> Config:
    """Read a configuration.

    Args:
        source: A YAML file, or the bare name of a packaged configuration, such as ``paper``; None is ``quick``.
        overrides: ``section.key=value``, the value in YAML; they win over the file, and set each key once. A plugin's
            bare name (``optimiser=pde``) keeps the options that the file gives it.
        check: Further errors of a configuration whose keys are all right one by one, one line each.
        options: Told a plugin's kind, its name and its options, in which numbers, true and false are ``Written``;
            returns them as plain data. Without it they are what YAML says.

    Raises:
        ConfigError: With everything that is wrong, ``check`` included.
    """
    errors: list[str] = []
    return _finished(_parse(*_text(source or "quick"), errors), overrides, check, errors, options)


def changed(config: Config, overrides: Sequence[str], check: Callable[[Config], list[str]] | None = None) -> Config:
    """Return a configuration with some other values; arguments and errors are those of :func:`load`."""
    return _finished(config.model_dump(mode="json"), overrides, check, [])


def _finished(
    raw: dict[str, Any],
    overrides: Sequence[str],
    check: Callable[[Config], list[str]] | None,
    errors: list[str],
    options: TakeOptions = _as_yaml_reads_them,
) -> Config:
    """Return the configuration that data as it is written and overrides make; ``errors`` were found before."""
    if any(override.partition("=")[0].strip() in ("robot", "robot.preset") for override in overrides):
        raw = stripped(raw, Config().model_dump(mode="json"), config_yaml.plain)
    apply(raw, overrides, errors)
    config, missing = _build(_settled(raw, options), errors)
    if check is not None:
        errors += [line for line in check(config) if not _stems_from(line, missing)]
    if errors:
        raise ConfigError(*dict.fromkeys(errors))
    return config


def dump(config: Config) -> str:
    """Return the configuration as YAML, every key spelled out; :func:`load` reads an equal one from it."""
    return config_yaml.dump(config.model_dump())


def seeded(config: Config) -> Config:
    """Return the configuration with a seed, drawn if it has none."""
    if config.evolution.seed is not None:
        return config
    evolution = config.evolution.model_copy(update={"seed": secrets.randbelow(2**31)})
    return config.model_copy(update={"evolution": evolution})


def packaged() -> list[str]:
    """Return the names of the configurations that come with swarmevo."""
    return sorted(_packaged())


# ---- from a file to plain data ---------------------------------------------------------------------------------------

_LARGEST_FILE = 1_000_000  # [bytes]: what is larger is no configuration


def _packaged() -> dict[str, Traversable]:
    """Return the configurations that come with swarmevo, by name."""
    folder = importlib.resources.files("swarmevo") / "configs"
    if not folder.is_dir():  # in a checkout
        folder = Path(__file__).parents[2] / "configs"
    return {entry.name.removesuffix(".yaml"): entry for entry in folder.iterdir() if entry.name.endswith(".yaml")}


def _text(source: str | Path) -> tuple[str, str]:
    """Return what to call a source in messages, and its text."""
    packaged = _packaged()
    file = packaged.get(str(source)) or Path(source)
    try:
        with file.open("rb") as stream:
            data = stream.read(_LARGEST_FILE + 1)
        if len(data) > _LARGEST_FILE:
            raise ConfigError(f"{source}: expected a configuration of at most {_LARGEST_FILE} bytes")
        return str(source), data.decode("utf-8-sig")
    except FileNotFoundError:
        names = ", ".join(sorted(packaged))
        hint = did_you_mean(str(source), packaged) or f"; packaged configurations: {names}"
        raise ConfigError(f"{source}: no such file{hint}") from None
    except IsADirectoryError:
        raise ConfigError(f"{source}: expected a YAML file, got a directory") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{source}: expected YAML text in UTF-8, got binary data") from None
    except (OSError, ValueError) as error:
        raise ConfigError(f"{source!s:.200}: cannot be read: {error}".replace("\0", "\\0")) from None


def _parse(name: str, text: str, errors: list[str]) -> dict[str, Any]:
    """Return what a text has of each section; nothing of one without keys, which has its defaults."""
    raw, found = config_yaml.parse(text)
    lines = [f"{name}: {line}" for line in found]
    if isinstance(raw, dict):
        errors += lines
        return {key: value for key, value in raw.items() if value is not None or key not in Config.model_fields}
    if not lines:
        got = "an empty file" if raw is None else shown(config_yaml.plain(raw))
        lines = [f"{name}: expected sections ({', '.join(Config.model_fields)}), got {got}"]
    raise ConfigError(*lines)


def _settled(raw: Mapping[str, Any], options: TakeOptions) -> dict[str, Any]:
    """Return plain data of what is written: the names of plugins are text, their options what they take."""
    settled: dict[str, Any] = {}
    for key, value in raw.items():
        chosen = named(value) if key in PLUGINS else value
        if key in PLUGINS and isinstance(chosen, Mapping):
            settled[key] = {
                str(name): options(key, str(name), given) if isinstance(given, Mapping) else config_yaml.plain(given)
                for name, given in chosen.items()
            }
        else:
            settled[key] = config_yaml.plain(chosen)
    return settled


# ---- from plain data to a Config -------------------------------------------------------------------------------------

_CAUSES = {
    "arena": ("arena",),
    "box": ("arena", "box.size", "box.pose", "scene", "physics.box_friction"),
    "emitter": ("emitter",),
    "scene": ("arena", "scene", "box", "physics.box_friction"),
    "team": ("arena", "box.size", "box.pose", "scene", "robot.radius", "team"),
    "robot": ("robot", "arena", "physics.drive", "physics.wheel_friction"),
    "sensors": ("sensors",),
    "episode": ("physics.time_step", "episode"),
}
"""For an error of ``check`` that begins with a section: the keys it may come from."""


def _build(raw: dict[str, Any], errors: list[str]) -> tuple[Config, set[str]]:
    """Return the configuration and the paths of the keys whose default stands in, because they are wrong."""
    sound = copy.deepcopy(raw)
    missing: set[str] = set()
    while True:  # what is wrong about a whole shows only when its parts are sound
        try:
            return Config.model_validate(sound), missing
        except ValidationError as error:
            problems = [problem for problem in error.errors() if not _follows(problem)] or error.errors()
        errors += map(explain, problems)
        missing |= {_drop(sound, problem["loc"]) for problem in problems}


def _follows(problem: ErrorDetails) -> bool:
    """Whether it says that a list is too short only because pydantic does not count the wrong entries."""
    return problem["type"] == "too_short" and len(problem["input"]) >= problem["ctx"]["min_length"]


def _drop(raw: dict[str, Any], path: tuple[int | str, ...]) -> str:
    """Take the wrong entry out of ``raw``; return the path of the key that is missed."""
    section, *rest = map(str, path)
    if not rest:
        raw.pop(section, None)
        return section
    key = rest[0]
    raw[section].pop(key, None)
    if section in PLUGINS:
        raw[section][key] = {}
    return ".".join((section, *nearest(key, keys_of(section))[:1])) or key


def _stems_from(line: str, missing: Iterable[str]) -> bool:
    """Whether an error of ``check`` may be there only because a default stands in for a wrong key."""
    section = re.split(r"\W", line)[0]
    return any(
        f"{cause}.".startswith(f"{path}.") or path.startswith(f"{cause}.")
        for cause in _CAUSES.get(section, ())
        for path in missing
    )

# SPDX-License-Identifier: BSD-3-Clause
"""The worlds that an individual is tried in: ``worlds``, which differ for good, and ``vary``, anew in each episode.

>>> from swarmevo.config import load
>>> worlds = Worlds(load("paper", ["worlds=[{team.robots: 3}, {team.robots: 5, weight: 2}]"]))
>>> [(world.config.team.robots, world.weight) for world in worlds]
[(3, 1.0), (5, 2.0)]
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from swarmevo.config import paths, reading
from swarmevo.config.messages import did_you_mean, shown
from swarmevo.config.models import WORLD, Config
from swarmevo.config.overrides import as_overrides
from swarmevo.errors import ConfigError

DRAWS: Final = ("uniform", "normal", "choice")
"""How a key of ``vary`` is drawn."""
FIXED: Final = {
    "team.genomes": "a genome is of one kind of team",
    "robot.preset": "other keys follow it; name those that differ",
    "robot.sensors": "a controller observes the same in all worlds",
    "episode.control_period": "a controller has one control period",
}
"""Keys of the world that cannot differ within an evaluation, and why."""
NORMAL_ENDS: Final = 3.0
"""A normal variate is cut off so many standard deviations from the mean."""
MOST_DRAWS: Final = 1000
"""How often an episode's world is drawn at most, until one can be."""
WORLD_STREAM: Final = 0x30F1D
"""Sets the random numbers of ``vary`` apart from all others."""


@dataclass(frozen=True)
class World:
    """One of the worlds that an individual is tried in."""

    config: Config
    """Without ``worlds`` and ``vary``."""
    weight: float
    """In the mean over the worlds; below 0 the opposite is wanted."""


class Worlds(Sequence[World]):
    """The worlds of a configuration, from 0; one if it names none.

    Raises:
        ConfigError: A world is refused.
    """

    def __init__(self, config: Config) -> None:
        self.vary = config.vary
        alone = config.model_copy(update={"worlds": (), "vary": {}})
        self._worlds = [
            World(_with(alone, _settings(entry)), float(entry.get("weight", 1.0))) for entry in config.worlds or ({},)
        ]

    def __getitem__(self, i: Any) -> Any:
        """Return a world, or some."""
        return self._worlds[i]

    def __len__(self) -> int:
        return len(self._worlds)

    def number_of(self, repeat: int) -> int:
        """Return which world an episode is in. An individual's episodes go round the worlds."""
        return repeat % len(self._worlds)

    def of_episode(
        self,
        seed: int,
        trial: int,
        generation: int,
        repeat: int,
        errors: Callable[[Config], Sequence[str]] = lambda _config: (),
    ) -> Config:
        """Return the world of an episode, what varies drawn from the episode's own stream until there are no errors.

        Args:
            seed: Of the episode's key, as the other three.
            trial: Likewise.
            generation: Likewise.
            repeat: Likewise.
            errors: What is wrong with a world that was drawn, as where two things overlap.

        Raises:
            ConfigError: None of ``MOST_DRAWS`` was without errors.
        """
        config: Config = self._worlds[self.number_of(repeat)].config
        if not self.vary:
            return config
        stream = np.random.default_rng([seed, trial, generation, repeat, WORLD_STREAM])
        found: Sequence[str] = ()
        for _ in range(MOST_DRAWS):
            drawn = {key: _draw(draw, paths.value_at(config, key), stream) for key, draw in self.vary.items()}
            try:
                world = _updated(config, drawn)
            except ConfigError as error:
                found = error.errors
                continue
            if not (found := errors(world)):
                return world
        raise ConfigError(
            f"vary: expected a world that can be among {MOST_DRAWS} draws for trial {trial}, generation {generation}, "
            f"repeat {repeat}, got none; the last: {found[0]}"
        )


def world_errors(config: Config) -> list[str]:
    """Return all that is wrong with ``worlds`` and ``vary``, one line each."""
    errors: list[str] = []
    for i, entry in enumerate(config.worlds):
        errors += [f"worlds[{i}].{line}" for line in _entry_errors(config, entry)]
    for key, draw in config.vary.items():
        errors += [f"vary.{line}" for line in _varying_errors(config, key) or _draw_errors(config, key, draw)]
    return errors or [
        f"worlds[{i}]: vary.{key}: {wrong}"
        for i, world in enumerate(Worlds(config))
        for key in config.vary
        if (wrong := paths.problem(world.config, key))
    ]


def each_world(config: Config) -> Iterator[tuple[str, Config]]:
    """Yield every world in which a run's episodes may be, with where it is from; of what varies only the ends."""
    for i, world in enumerate(Worlds(config)):
        where = f"worlds[{i}]" if config.worlds else ""
        if where:
            yield where, world.config
        for key, draw in config.vary.items():
            ((kind, given),) = draw.items()
            for extreme in _extremes(kind, given):
                value = _plain(extreme, paths.value_at(world.config, key))
                yield f"{where and where + ', '}vary.{key} at {shown(value)}", _updated(world.config, {key: value})


# ---- worlds ----------------------------------------------------------------------------------------------------------


def _settings(entry: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in entry.items() if key != "weight"}


def _with(config: Config, settings: Mapping[str, Any]) -> Config:
    return reading.changed(config, as_overrides(settings)) if settings else config


def _entry_errors(config: Config, entry: Mapping[str, Any]) -> list[str]:
    settings, weight = _settings(entry), entry.get("weight", 1.0)
    errors = [line for key in settings for line in _key_errors(config, key)]
    errors += [f"{key}: expected it here or in vary, got both" for key in settings if _leads_into(key, config.vary)]
    if type(weight) not in (int, float) or not 0 < abs(weight) <= 1e6:
        errors.append(f"weight: expected a number other than 0, from -1e6 to 1e6, got {shown(weight)}")
    return errors or _value_errors(config, settings)


def _key_errors(config: Config, key: str) -> list[str]:
    """Return what is wrong with a key of the world that is to differ."""
    known = [f"{one}.{each}" for one in WORLD for each in type(getattr(config, one)).model_fields]
    whole = ".".join(key.split(".")[:2])
    if (written := paths.without_brackets(key)) != key:
        return [f"{key}: expected a key of the world; write an entry of a list as {written}"]
    if whole not in known:
        hint = did_you_mean(key, known) or f"; it is section.key, of the sections {', '.join(WORLD)}"
        return [f"{key}: expected a key of the world{hint}"]
    if reason := FIXED.get(whole):
        return [f"{key}: expected another key; {reason}"]
    if key == "team.robots" and config.team.has_own_genomes:
        return [f"{key}: expected another key; each robot has a genome of its own (team.genomes: individual)"]
    return []


def _value_errors(config: Config, settings: Mapping[str, Any]) -> list[str]:
    try:
        _with(config.model_copy(update={"worlds": (), "vary": {}}), settings)
    except ConfigError as error:
        return list(error.errors)
    return []


def _leads_into(key: str, others: Iterable[str]) -> bool:
    """Whether a key is one of the others, or is in what one of them names."""
    return any(f"{key}.".startswith(f"{other}.") for other in others)


# ---- vary ------------------------------------------------------------------------------------------------------------


def _varying_errors(config: Config, key: str) -> list[str]:
    """Return what is wrong with a key that is to be drawn, but for how it is drawn."""
    if errors := _key_errors(config, key):
        return errors
    if _leads_into(key, (other for other in config.vary if other != key)):
        return [f"{key}: expected it alone or in what is drawn whole, got both"]
    wrong = paths.problem(config, key)
    return [f"{key}: {wrong}"] if wrong else []


def _draw_errors(config: Config, key: str, draw: Mapping[str, Any]) -> list[str]:
    """Return what is wrong with how a key is drawn."""
    kinds = ", ".join(f"{{{kind}: [...]}}" for kind in DRAWS)
    if len(draw) != 1 or not draw.keys() <= set(DRAWS):
        return [f"{key}: expected one of {kinds}, got {shown(dict(draw))}"]
    ((kind, given),) = draw.items()
    if not isinstance(given, list) or (len(given) != 2 if kind != "choice" else not given):
        wanted = {"uniform": "[low, high]", "normal": "[mean, standard deviation]", "choice": "a list of values"}[kind]
        return [f"{key}.{kind}: expected {wanted}, got {shown(given)}"]
    value = paths.value_at(config, key)
    if kind != "choice" and not (_is_number(value) or isinstance(value, tuple)):
        return [f"{key}.{kind}: expected a key with numbers; draw it by choice"]
    if kind != "choice" and not all(_is_numeric(end) and np.shape(end) == np.shape(value) for end in given):
        size = "a number" if _is_number(value) else f"a list of {len(value)} numbers"
        return [f"{key}.{kind}: expected {size} for each of the two, got {shown(given)}"]
    if kind == "uniform" and np.any(np.asarray(given[0]) > np.asarray(given[1])):
        return [f"{key}.{kind}: expected the low end first, got {shown(given)}"]
    if kind == "normal" and np.any(np.asarray(given[1]) < 0):
        return [f"{key}.{kind}: expected a standard deviation of at least 0, got {shown(given[1])}"]
    extremes = [_plain(extreme, value) for extreme in _extremes(kind, given)]
    lines = itertools.chain.from_iterable(_value_errors(config, {key: extreme}) for extreme in extremes)
    return [f"{line} (drawn by {kind})" for line in dict.fromkeys(lines)]


def _extremes(kind: str, given: list[Any]) -> list[Any]:
    if kind == "choice":
        return given
    if kind == "uniform":
        return given
    mean, spread = np.asarray(given[0], dtype=np.float64), NORMAL_ENDS * np.asarray(given[1], dtype=np.float64)
    return [mean - spread, mean + spread]


def _draw(draw: Mapping[str, Any], value: Any, stream: np.random.Generator) -> Any:
    """Return a value for a key that has ``value`` else."""
    ((kind, given),) = draw.items()
    if kind == "choice":
        return _plain(given[int(stream.integers(len(given)))], value)
    low, high = (np.asarray(end, dtype=np.float64) for end in given)
    if kind == "normal":
        drawn = low + high * np.clip(stream.standard_normal(low.shape), -NORMAL_ENDS, NORMAL_ENDS)
    elif type(value) is int:
        drawn = np.asarray(stream.integers(int(low), int(high), endpoint=True), dtype=np.float64)
    else:
        drawn = low + (high - low) * stream.random(low.shape)
    return _plain(drawn, value)


def _plain(drawn: Any, value: Any) -> Any:
    """Return what was drawn as the type that ``value`` has."""
    if not _is_numeric(drawn):
        return drawn
    if isinstance(value, tuple) and np.ndim(drawn):
        return tuple(np.asarray(drawn, dtype=np.float64).tolist())
    if type(value) is int and not np.ndim(drawn):
        return math.floor(float(drawn) + 0.5)
    return float(drawn) if type(value) is float and not np.ndim(drawn) else drawn


def _updated(config: Config, values: Mapping[str, Any]) -> Config:
    """Return a configuration with other values, which are in their range."""
    updated = _with(config, {key: value for key, value in values.items() if isinstance(value, list | dict)})
    for key, value in values.items():
        if not isinstance(value, list | dict):
            updated = paths.with_value(updated, key, value)
    return updated


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)


def _is_numeric(value: Any) -> bool:
    try:
        array = np.asarray(value)
    except ValueError:  # of lists that are not of one length
        return False
    return array.dtype.kind in "iuf" and bool(np.isfinite(array).all())

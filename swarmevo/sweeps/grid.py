# SPDX-License-Identifier: BSD-3-Clause
"""What is swept: a grid of settings, ``KEY=VALUE,VALUE,...`` for each key, and seeds."""

from __future__ import annotations

import itertools
import json
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from swarmevo import config as configuration
from swarmevo.config import Config
from swarmevo.config import yaml as config_yaml
from swarmevo.errors import ConfigError

MOST_RUNS: Final = 10_000
"""Of a sweep: more are a slip of the finger."""
_SEED: Final = "evolution.seed"
_LARGEST_SEED: Final = 2**63 - 1
_LONGEST_NAME: Final = 80
"""[characters] of a setting's folder."""


@dataclass(frozen=True)
class Setting:
    """A place in the grid."""

    name: str
    """Of its folder, no other's: ``mutation_rate=0.1,population=60``."""
    values: Mapping[str, str]
    """Of each key of the grid, as it was given."""
    config: Config
    """Without a seed."""

    def seeded(self, seed: int) -> Config:
        """Return the configuration of a run."""
        return with_seed(self.config, seed)


@dataclass(frozen=True)
class Value:
    """Of a key of the grid."""

    label: str
    """As people read it."""
    text: str
    """As ``--set`` takes it."""


def parse(texts: Sequence[str]) -> dict[str, list[Value]]:
    """Return the values of each key in ``KEY=VALUE,VALUE,...``, the values in YAML.

    Raises:
        ConfigError: With everything that is wrong.
    """
    grid: dict[str, list[Value]] = {}
    errors: list[str] = []
    for text in texts:
        key, equals, listed = (part.strip() for part in text.partition("="))
        values, found = config_yaml.parse(f"[{listed}]") if equals and key else (None, [])
        if not isinstance(values, list) or not values:
            errors.append(
                f"--grid {text}: expected KEY=VALUE,VALUE,..., the values in YAML{''.join(map('; {}'.format, found))}"
            )
        elif key == _SEED:
            errors.append(f"--grid {text}: expected seeds in --seeds, as 1-10")
        elif key in grid:
            errors.append(f"--grid {text}: {key} is given twice; give all its values at once")
        else:
            grid[key] = [_value(one) for one in values]
            labels = [value.label for value in grid[key]]
            twice = sorted({label for label in labels if labels.count(label) > 1})
            errors += [f"--grid {text}: {label} is given twice; leave one out" for label in twice]
    if errors:
        raise ConfigError(*errors)
    return grid


def of_values(grid: Mapping[str, Sequence[Any]]) -> dict[str, list[Value]]:
    """Return the grid of ``{key: values}``, as :func:`parse` does.

    Raises:
        ConfigError: As :func:`parse`; or a value is none that YAML has, or no list of values was given.
    """
    texts = []
    for key, values in grid.items():
        if isinstance(values, str) or not hasattr(values, "__iter__"):
            raise ConfigError(f"{key}: expected a list of values, got {values!r}")
        (text,) = configuration.as_overrides({key: list(values)})
        texts.append(f"{key}={text.partition('=')[2][1:-1]}")
    return parse(texts)


def _value(value: Any) -> Value:
    if isinstance(value, config_yaml.Written):  # a number as it was written, which a plugin's option may take as text
        return Value(str(value), str(value))
    text = json.dumps(config_yaml.plain(value))
    return Value(value if isinstance(value, str) else text, text)


def parse_seeds(text: str) -> list[int]:
    """Return the seeds in ``1-10`` or ``1,4,7-9``.

    Raises:
        ConfigError: It names none, one twice, or too many.
    """
    seeds: list[int] = []
    for part in text.split(","):
        match = re.fullmatch(r"\s*([0-9]{1,19})(?:-([0-9]{1,19}))?\s*", part)
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (1, 0)
        if not first <= last <= _LARGEST_SEED:
            raise ConfigError(f"--seeds: expected seeds as in 1-10 or 1,4,9, got {text!r}")
        if last - first >= MOST_RUNS - len(seeds):
            raise ConfigError(f"--seeds: expected at most {MOST_RUNS} seeds, got more")
        seeds += range(first, last + 1)
    return checked_seeds(seeds)


def checked_seeds(seeds: Sequence[int]) -> list[int]:
    """Return seeds that are different and in their range.

    Raises:
        ConfigError: They are not; or there is none.
    """
    if wrong := [seed for seed in seeds if not (isinstance(seed, int) and 0 <= seed <= _LARGEST_SEED)][:1]:
        raise ConfigError(f"--seeds: expected whole numbers from 0, got {wrong[0]!r}")
    if not seeds:
        raise ConfigError("--seeds: expected at least one seed, got none")
    if twice := sorted({seed for seed in seeds if seeds.count(seed) > 1})[:1]:
        raise ConfigError(f"--seeds: {twice[0]} is given twice; leave one out")
    return list(seeds)


def settings(
    grid: Mapping[str, Sequence[Value]], seeds: Sequence[int], load: Callable[[list[str]], Config], name: str
) -> list[Setting]:
    """Return every combination of the grid's values, the last key's values beside each other.

    Args:
        grid: As :func:`parse` returns it; without keys there is one setting.
        seeds: Of the runs with each.
        load: Returns the configuration with these overrides, ``section.key=value``.
        name: Of the one setting of a grid without keys.

    Raises:
        ConfigError: With everything that is wrong, and in which setting; two are the same; there are too many.
    """
    count = math.prod(len(values) for values in grid.values())
    if count * len(seeds) > MOST_RUNS:
        raise ConfigError(f"--grid: expected at most {MOST_RUNS} runs, got {count} settings times {len(seeds)} seeds")
    short = short_names(list(grid))
    found: list[Setting] = []
    wrong: dict[str, list[str]] = {}  # a line, and in which settings
    names = Names()
    for values in itertools.product(*grid.values()):
        labels = {key: value.label for key, value in zip(grid, values, strict=True)}
        called = ", ".join(f"{short[key]}={label}" for key, label in labels.items())
        try:
            loaded = load([f"{key}={value.text}" for key, value in zip(grid, values, strict=True)])
        except ConfigError as error:
            for line in error.errors:
                wrong.setdefault(line, []).append(called)
            continue
        found.append(Setting(names.of(called.replace(", ", ",") or name), labels, loaded))
    if wrong:
        raise ConfigError(*_told(wrong, count))
    _require_different(found)
    return found


def with_seed(config: Config, seed: int | None) -> Config:
    """Return a configuration with a seed, or without one."""
    return config.model_copy(update={"evolution": config.evolution.model_copy(update={"seed": seed})})


def _told(wrong: Mapping[str, Sequence[str]], count: int) -> Iterator[str]:
    """Yield each line once; one that does not hold everywhere says where."""
    for line, where in wrong.items():
        more = f" and {len(where) - 1} more" if len(where) > 1 else ""
        yield line if len(where) == count else f"{where[0]}{more}: {line}"


def _require_different(found: Sequence[Setting]) -> None:
    seen: dict[str, Setting] = {}
    for setting in found:
        if (other := seen.setdefault(setting.config.model_dump_json(), setting)) is not setting:
            raise ConfigError(f"--grid: {setting.name} and {other.name} are the same configuration; leave one out")


def short_names(keys: Sequence[str]) -> dict[str, str]:
    """Return what to call each key: its last step, if no other's is that."""
    last = [key.rpartition(".")[2] for key in keys]
    return {key: name if last.count(name) == 1 else key for key, name in zip(keys, last, strict=True)}


class Names:
    """Makes names of folders, each once, that no shell and no ``RUN:ID`` takes for something else."""

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._taken = {name.lower() for name in taken}

    def of(self, text: str) -> str:
        """Return a name that was not taken, much like a text."""
        plain = re.sub(r"[^A-Za-z0-9.+=,-]+", "_", text)
        plain = re.sub(r"(?<=[=,])_+|_+(?=,|$)", "", plain)[:_LONGEST_NAME].strip(".")
        numbered = (f"{plain}-{number}" for number in itertools.count(2))
        name = next(one for one in itertools.chain([plain], numbered) if one.lower() not in self._taken)
        self._taken.add(name.lower())
        return name

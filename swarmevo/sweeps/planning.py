# SPDX-License-Identifier: BSD-3-Clause
"""Before a sweep: its settings, tried once each, and what it will cost."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from swarmevo.analysis import fronts
from swarmevo.config import Config
from swarmevo.errors import ConfigError, Interrupted
from swarmevo.evolution import loop
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.plugins.team import load_config, never
from swarmevo.runs import driver
from swarmevo.sweeps import grid as grids
from swarmevo.sweeps.grid import Setting, Value, with_seed


@dataclass(frozen=True)
class Forecast:
    """What a sweep will cost; see :class:`swarmevo.analysis.fronts.Forecast`."""

    runs: int
    settings: list[tuple[str, fronts.Forecast]]
    """For each its name, and what all its runs cost."""
    episodes: int
    simulated_seconds: float
    wall_seconds: float
    workers: int


def settings(
    source: str | None, overrides: Sequence[str], grid: Mapping[str, Sequence[Value]], seeds: Sequence[int]
) -> list[Setting]:
    """Return the settings of a sweep, all checked as far as a configuration alone can be.

    Args:
        source: A YAML file, or the name of a packaged configuration; None is ``quick``.
        overrides: ``section.key=value``, of all settings.
        grid: The values of each key.
        seeds: Of the runs with each setting.

    Raises:
        ConfigError: With everything that is wrong.
    """
    if any(one.partition("=")[0].strip() == "evolution.seed" for one in overrides):
        raise ConfigError("--set evolution.seed: expected seeds in --seeds, as 1-10")

    def load(more: list[str]) -> Config:
        return with_seed(load_config(source, [*overrides, *more]), None)

    return grids.settings(grid, seeds, load, Path(source or "quick").stem)


def rehearsed(
    found: Sequence[Setting], seed: int, stop: Callable[[], bool] = never, tried: Collection[Setting] = ()
) -> list[Setting]:
    """Try each setting once, as a run does before it begins; return them with what they begin from made sure of.

    Args:
        found: All settings.
        seed: To try them with.
        stop: Asked now and then.
        tried: Those that are returned as they are.

    Raises:
        ConfigError, EvaluationError, PluginError, SimulatorError: A setting cannot be run.
        Interrupted: ``stop`` said so.
    """
    done = {setting.name for setting in tried}
    return [setting if setting.name in done else _rehearsed(setting, seed, stop) for setting in found]


def _rehearsed(setting: Setting, seed: int, stop: Callable[[], bool]) -> Setting:
    config = setting.seeded(seed)
    try:
        loop.rehearse(config, stop)
        if stop():
            raise Interrupted
        with Evaluator(config, workers=1) as evaluator:
            driver.check_names(evaluator)
            config, _ = driver.resolved_start(config, evaluator)
    except ConfigError as error:
        raise ConfigError(*(f"{setting.name}: {line}" for line in error.errors)) from error
    return dataclasses.replace(setting, config=with_seed(config, None))


def forecast(found: Sequence[Setting], seeds: Sequence[int], workers: int) -> Forecast:
    """Measure some episodes of each setting and return what the sweep will cost.

    Raises:
        EvaluationError, PluginError, SimulatorError: Something failed.
    """
    costs = []
    for setting in found:
        config = setting.seeded(seeds[0])
        with Evaluator(config, workers) as evaluator:
            one = fronts.forecast(config, evaluator, workers)
        costs.append((setting.name, _times(one, len(seeds))))
    episodes, simulated, wall = (
        sum(getattr(cost, name) for _, cost in costs) for name in ("episodes", "simulated_seconds", "wall_seconds")
    )
    return Forecast(len(found) * len(seeds), costs, episodes, simulated, wall, workers)


def _times(one: fronts.Forecast, runs: int) -> fronts.Forecast:
    return dataclasses.replace(
        one,
        episodes=one.episodes * runs,
        simulated_seconds=one.simulated_seconds * runs,
        wall_seconds=one.wall_seconds * runs,
    )

# SPDX-License-Identifier: BSD-3-Clause
"""Real runs of a second or less, for tests of what looks at runs."""

from __future__ import annotations

from pathlib import Path

from swarmevo import config, plugins
from swarmevo.runs import driver
from swarmevo.runs.store import Store

SMALL = (
    "episode.horizon=2",
    "team.robots=3",
    "evolution.population=4",
    "evolution.generations=2",
    "evolution.trials=2",
    "evolution.repeats=1",
    "evolution.seed=5",
)


def make(folder: Path, *overrides: str) -> Path:
    """Evolve a small run in a new folder and return it."""
    settings = config.changed(config.load("quick", SMALL), overrides, plugins.option_errors)
    driver.begin(folder, settings)
    with Store.open(folder, readonly=False) as store:
        driver.evolve(store, 1, lambda now: None, lambda: False)
    return folder

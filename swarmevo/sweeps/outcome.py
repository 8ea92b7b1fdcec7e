# SPDX-License-Identifier: BSD-3-Clause
"""What a sweep found: of each run, and of each setting over its runs.

A trial counts by the episodes of evolution: that is what is stored, at no cost, and too good, for good luck helped to
select it. ``swarmevo compare`` tests again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

from swarmevo.analysis import fronts
from swarmevo.analysis.measures import DELIVERED, HOMING, PUSH, measures_of
from swarmevo.protocols import Objective
from swarmevo.runs.store import Store
from swarmevo.sweeps.folder import Cell, Sweep

FORMAT: Final = 1
"""Of the JSON."""


@dataclass(frozen=True)
class Trial:
    """Of a run."""

    trial: int
    """From 0."""
    episodes: int
    """That it has spent."""
    hypervolume: float
    """Of its front, as a share of the product of the objectives' ranges."""
    best: dict[str, float]
    """The best mean of each objective, on the front."""
    success: float | None
    """Best rate of success on its front; None: the task has none."""
    course: list[tuple[int, float]]
    """Episodes spent after each generation, and the hypervolume then, likewise a share."""


@dataclass(frozen=True)
class Outcome:
    """Of a run: what is stored."""

    run: str
    complete: bool
    objectives: list[Objective]
    rate: str
    """Name of the rate of success; "": the task has none."""
    seconds: float
    """That its generations took."""
    trials: list[Trial]


@dataclass(frozen=True)
class Row:
    """A setting."""

    name: str
    values: dict[str, str]
    """Of each key of the grid, as it was given."""
    state: Literal["complete", "not complete", "not begun"]
    runs: list[Outcome]
    """Those that are begun, by seed."""
    failed: dict[int, str]
    """Why a run failed in this session, by its seed."""

    @property
    def trials(self) -> list[Trial]:
        """Of all its runs."""
        return [trial for run in self.runs for trial in run.trials]


@dataclass(frozen=True)
class Findings:
    """A sweep and what was found."""

    format: int
    sweep: str
    grid: dict[str, list[str]]
    """The values of each key, as they were given."""
    seeds: list[int]
    rows: list[Row]
    """In the order of the grid."""
    objectives: list[Objective] = field(default_factory=list)
    """Of all settings, each once."""


def outcome(store: Store) -> Outcome:
    """Return what a run has found.

    Raises:
        StoreError: It cannot be read.
    """
    objectives = list(store.objectives)
    rates = measures_of(store.config, objectives).rates
    volume = fronts.volume(objectives)
    trials = []
    for number in store.trials():
        history, front = fronts.history(store, number), fronts.front(store, number)
        trials.append(
            Trial(
                trial=number,
                episodes=history[-1].episodes,
                hypervolume=history[-1].hypervolume / volume,
                best=history[-1].best,
                success=max(_rate(point, rates[0]) for point in front) if rates else None,
                course=[(step.episodes, step.hypervolume / volume) for step in history],
            )
        )
    seconds = store.totals().seconds
    return Outcome(str(store.folder), fronts.is_complete(store), objectives, rates[0] if rates else "", seconds, trials)


def _rate(point: fronts.FrontPoint, name: str) -> float:
    return {PUSH: point.push_rate, DELIVERED: point.push_rate, HOMING: point.homing_rate}.get(
        name, point.success_rates.get(name, 0.0)
    )


def read(sweep: Sweep) -> Findings:
    """Return what is stored of a sweep.

    Raises:
        StoreError: A run cannot be read.
    """
    found = {}
    for cell in sweep.cells:
        if cell.folder.exists():
            with Store.open(cell.folder) as store:
                found[cell.name] = outcome(store)
    return findings(sweep, found, {})


def findings(sweep: Sweep, outcomes: Mapping[str, Outcome], failed: Mapping[str, str]) -> Findings:
    """Return what a sweep found.

    Args:
        sweep: It.
        outcomes: Of its runs, by their names; those that are missing are not begun or failed.
        failed: Why a run failed, by its name.
    """
    rows = []
    cells_of: dict[str, list[Cell]] = {}
    for cell in sweep.cells:
        cells_of.setdefault(cell.setting.name, []).append(cell)
    for setting in sweep.settings:
        cells = cells_of[setting.name]
        runs = [outcomes[cell.name] for cell in cells if cell.name in outcomes]
        complete = len(runs) == len(cells) and all(run.complete for run in runs)
        rows.append(
            Row(
                name=setting.name,
                values=dict(setting.values),
                state="complete" if complete else "not complete" if runs else "not begun",
                runs=runs,
                failed={cell.seed: failed[cell.name] for cell in cells if cell.name in failed},
            )
        )
    every = [objective for row in rows for run in row.runs for objective in run.objectives]
    named = {objective.name: objective for objective in every}
    return Findings(FORMAT, str(sweep.folder), sweep.grid, sweep.seeds, rows, list(named.values()))

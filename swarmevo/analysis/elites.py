# SPDX-License-Identifier: BSD-3-Clause
"""The map of behaviours that a run's optimiser keeps (Mouret & Clune 2015): the best that it knows of each kind."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from swarmevo.analysis import fronts
from swarmevo.analysis.fronts import FrontPoint
from swarmevo.errors import PluginError, StoreError
from swarmevo.evolution.costs import to_costs
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.evolution.optimiser import CheckedOptimiser
from swarmevo.protocols import BehaviourMap, FloatArray, IntArray, Objective
from swarmevo.runs import checksums, driver
from swarmevo.runs.records import Individuals
from swarmevo.runs.store import Store


@dataclass(frozen=True)
class Elites:
    """A map of behaviours: k elites on a grid over the ranges of the d descriptors."""

    cells: tuple[int, ...]
    """Along each descriptor."""
    objective: Objective
    """That they are the best in."""
    points: list[FrontPoint]
    """In the order of their cells; each judged by all its episodes in its trial."""
    places: IntArray
    """``(k, d)``: their cells, from 0."""

    @property
    def values(self) -> FloatArray:
        """``(k,)``: of the objective."""
        return np.array([point.objectives[self.objective.name] for point in self.points])

    @property
    def coverage(self) -> float:
        """Share of the cells that have an elite."""
        return len(self.points) / int(np.prod(self.cells))

    @property
    def qd_score(self) -> float:
        """Sum over the elites of how much better each is than the worst end of the objective's range."""
        return float(np.abs(self.values - self.objective.worst).sum())


def elites(store: Store, trial: int | None = None) -> Elites | None:
    """Return the map that the optimiser of a trial had after its last generation; None: it keeps none.

    Args:
        store: Of the run.
        trial: None: the better elite of each cell, of all trials.

    Raises:
        EvaluationError, SimulatorError: The run's scene or its plugins cannot be made here.
        PluginError: The optimiser does not take the stored state, or its map is not one of this run.
        StoreError: The trial has no generation yet, or the plugins now measure something else.
    """
    trials = store.trials() if trial is None else [trial]
    if not set(trials) & set(store.trials()):
        raise StoreError(
            f"{store.folder}: expected a trial with a generation, got {'none' if trial is None else trial}"
        )
    kept = _kept(store, trials)
    if not kept:
        return None
    cells, judged = next((one.cells, one.objective) for one in kept.values())
    if any((one.cells, one.objective) != (cells, judged) for one in kept.values()):
        raise _wrong(store, "expected the same cells and objective in all trials, got others")
    column = [one.name for one in store.objectives].index(judged)
    found = store.individuals(trial)
    costs = to_costs(list(store.objectives), found.objectives)[:, column]
    best: dict[tuple[int, ...], int] = {}
    for place, row in _placed(store, kept, found):
        if costs[row] < costs[best.setdefault(place, row)]:
            best[place] = row
    places = sorted(best)
    points = fronts.points(store, found, np.array([best[place] for place in places], dtype=np.intp))
    return Elites(cells, store.objectives[column], points, np.array(places, dtype=np.intp).reshape(-1, len(cells)))


def _kept(store: Store, trials: Sequence[int]) -> dict[int, BehaviourMap]:
    """Return the maps of the trials whose optimiser keeps one."""
    kept = {}
    with Evaluator(store.config, workers=1) as evaluator:
        driver.check_objectives(store, evaluator)
        for trial in trials:
            optimiser = CheckedOptimiser(store.config, evaluator, trial)
            optimiser.restore(store.state(trial), store.generations(trial) - 1)
            if (found := optimiser.behaviour_map()) is not None:
                kept[trial] = found
    return kept


def _placed(
    store: Store, kept: Mapping[int, BehaviourMap], found: Individuals
) -> Iterator[tuple[tuple[int, ...], int]]:
    """Yield each elite's cell, and its row among the individuals."""
    ids = store.genome_ids_by_digest()
    rows = {(int(t), int(genome)): row for row, (t, genome) in enumerate(zip(found.trial, found.genome, strict=True))}
    for trial, one in kept.items():
        for place, genome in zip(one.places.tolist(), one.genomes, strict=True):
            row = rows.get((trial, ids.get(checksums.of_genes(genome), 0)))
            if row is None:
                raise _wrong(store, f"trial {trial}: expected genomes that the trial evaluated, got another")
            yield tuple(place), row


def _wrong(store: Store, reason: str) -> PluginError:
    (name,) = store.config.optimiser
    return PluginError(f"optimiser.{name}: behaviour_map: {reason}; repair the plugin")

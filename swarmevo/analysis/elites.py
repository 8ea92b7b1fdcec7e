# SPDX-License-Identifier: BSD-3-Clause
"""The map of behaviours that a run's optimiser keeps (Mouret & Clune 2015): the best that it knows of each kind."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swarmevo.analysis import fronts
from swarmevo.analysis.fronts import FrontPoint
from swarmevo.errors import PluginError
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.evolution.optimiser import CheckedOptimiser
from swarmevo.protocols import BehaviourMap, FloatArray, IntArray, Objective
from swarmevo.runs import checksums
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
        PluginError: The optimiser cannot be made, or does not take the stored state.
    """
    trials = store.trials() if trial is None else [trial]
    config = store.config
    with Evaluator(config, workers=1) as evaluator:
        maps = {one: _map(store, CheckedOptimiser(config, evaluator, one), one) for one in trials}
    kept = {one: found for one, found in maps.items() if found is not None}
    if not kept:
        return None
    ids, found = store.genome_ids_by_digest(), store.individuals(trial)
    rows = {(int(t), int(genome)): row for row, (t, genome) in enumerate(zip(found.trial, found.genome, strict=True))}
    some = next(iter(kept.values()))
    objective = next(one for one in store.objectives if one.name == some.objective)
    column = store.objectives.index(objective)
    best: dict[tuple[int, ...], int] = {}
    for one, on_map in kept.items():
        for place, genome in zip(on_map.places.tolist(), on_map.genomes, strict=True):
            row = rows.get((one, ids.get(checksums.of_genes(genome), 0)))
            if row is None:
                raise PluginError(f"behaviour_map, trial {one}: expected genomes that the trial evaluated, got another")
            cell = tuple(place)
            held = best.get(cell)
            if held is None or _is_better(objective, found.objectives[row, column], found.objectives[held, column]):
                best[cell] = row
    places = sorted(best)
    points = fronts.points(store, found, np.array([best[place] for place in places], dtype=np.intp))
    return Elites(some.cells, objective, points, np.array(places, dtype=np.intp).reshape(-1, len(some.cells)))


def _map(store: Store, optimiser: CheckedOptimiser, trial: int) -> BehaviourMap | None:
    last = store.generations(trial) - 1
    optimiser.restore(store.state(trial), last)
    return optimiser.behaviour_map(last)


def _is_better(objective: Objective, value: float, other: float) -> bool:
    return value > other if objective.is_maximised else value < other

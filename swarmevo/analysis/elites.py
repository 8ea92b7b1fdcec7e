# SPDX-License-Identifier: BSD-3-Clause
"""The map of behaviours that a run's optimiser keeps (Mouret & Clune 2015): the best that it knows of each kind."""

from __future__ import annotations

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
    config = store.config
    with Evaluator(config, workers=1) as evaluator:
        driver.check_objectives(store, evaluator)
        maps = {one: _map(store, CheckedOptimiser(config, evaluator, one), one) for one in trials}
    kept = {one: found for one, found in maps.items() if found is not None}
    if not kept:
        return None
    grids = {(found.cells, found.objective) for found in kept.values()}
    (name,) = config.optimiser
    if len(grids) > 1:
        raise PluginError(f"optimiser.{name}: behaviour_map: expected the same cells and objective in all trials")
    ((cells, judged),) = grids
    column = [one.name for one in store.objectives].index(judged)
    objective, found = store.objectives[column], store.individuals(trial)
    ids = store.genome_ids_by_digest()
    rows = {(int(t), int(genome)): row for row, (t, genome) in enumerate(zip(found.trial, found.genome, strict=True))}
    costs = to_costs(list(store.objectives), found.objectives)[:, column]
    best: dict[tuple[int, ...], int] = {}
    for one, on_map in kept.items():
        for place, genome in zip(on_map.places.tolist(), on_map.genomes, strict=True):
            row = rows.get((one, ids.get(checksums.of_genes(genome), 0)))
            if row is None:
                raise PluginError(
                    f"optimiser.{name}: behaviour_map, trial {one}: expected genomes that the trial evaluated, got "
                    "another; repair the plugin"
                )
            held = best.setdefault(tuple(place), row)
            if costs[row] < costs[held]:
                best[tuple(place)] = row
    places = sorted(best)
    points = fronts.points(store, found, np.array([best[place] for place in places], dtype=np.intp))
    return Elites(cells, objective, points, np.array(places, dtype=np.intp).reshape(-1, len(cells)))


def _map(store: Store, optimiser: CheckedOptimiser, trial: int) -> BehaviourMap | None:
    last = store.generations(trial) - 1
    optimiser.restore(store.state(trial), last)
    return optimiser.behaviour_map()

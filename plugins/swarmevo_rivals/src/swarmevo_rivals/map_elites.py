# SPDX-License-Identifier: BSD-3-Clause
"""MAP-Elites (Mouret & Clune 2015, arXiv 1504.04909): the best genome of each kind of behaviour."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from swarmevo.protocols import BehaviourMap, FloatArray, GenomeSpace, IntArray, Problem
from swarmevo_rivals.genomes import random_genomes

MOST_CELLS: Final = 1_000_000
"""Of a map."""


def require_cells(cells: object, problem: Problem) -> None:
    """Refuse a map without axes, or one of too many cells."""
    if not problem.descriptors:
        raise ValueError("problem: expected a fitness that has descriptors, got none; choose one beside the others")
    if type(cells) is not int or cells < 1 or cells ** len(problem.descriptors) > MOST_CELLS:
        raise ValueError(f"cells: expected a whole number of at least 1, up to {MOST_CELLS} in all, got {cells!r}")


def column_of(objective: str | None, problem: Problem) -> int:
    """Return the column of the objective of that name, or of the first."""
    names = [one.name for one in problem.objectives]
    if objective is not None and objective not in names:
        raise ValueError(f"objective: expected one of {', '.join(names)}, got {objective!r}")
    return names.index(objective) if objective else 0


class MapElites:
    """MAP-Elites: a map of behaviours, each cell of which keeps the best genome that behaved so.

    The map is a grid over the descriptors' ranges. Children are made of elites by the operator of iso and line
    (Vassiliades & Mouret 2018, arXiv 1804.03906).

    Args:
        space: Layout of a genome.
        population: Genomes of a generation.
        objectives: Number of costs.
        rng: The only source of randomness.
        problem: Its descriptors are the axes of the map; at least one.
        cells: Along each axis.
        objective: Name of the one that is made better. Nothing: the first.
        iso: Standard deviation of what is added to each real gene.
        line: Standard deviation of the step towards another elite, as a share of the distance.
        flips: Probability that a switch is turned.

    Raises:
        ValueError: An option is out of its range, or nothing is described.
    """

    def __init__(
        self,
        space: GenomeSpace,
        population: int,
        objectives: int,
        rng: np.random.Generator,
        problem: Problem,
        *,
        cells: int = 10,
        objective: str | None = None,
        iso: float = 0.1,
        line: float = 0.2,
        flips: float = 0.05,
    ) -> None:
        require_cells(cells, problem)
        for name, value, most in (("iso", iso, math.inf), ("line", line, math.inf), ("flips", flips, 1.0)):
            if not isinstance(value, (int, float)) or not 0 <= value <= most or value == math.inf:
                span = "from 0 to 1" if most == 1 else "of at least 0"
                raise ValueError(f"{name}: expected a number {span}, got {value!r}")
        self._space, self._population, self._rng = space, population, rng
        self._column = column_of(objective, problem)
        self._objective = problem.objectives[self._column].name
        self._cells, self._iso, self._line, self._flips = cells, float(iso), float(line), float(flips)
        self._low, self._high = np.array([one.range for one in problem.descriptors]).T
        self._genomes: FloatArray = np.empty((0, space.size))  # the elites, in the order of their cells
        self._costs: FloatArray = np.empty(0)
        self._places: IntArray = np.empty(0, dtype=np.intp)  # number of each elite's cell
        self._given: FloatArray = np.empty((0, space.size))  # to begin from

    def start_from(self, genomes: FloatArray) -> None:
        """Begin from ``genomes`` ``(k, size)``; what the population has more is random."""
        self._given = genomes.copy()

    def ask(self) -> FloatArray:
        """Return genomes ``(n, size)``: children of elites; before there are any, those given and random ones."""
        if len(self._genomes):
            return self._children()
        random = random_genomes(self._space, max(0, self._population - len(self._given)), self._rng)
        return np.concatenate([self._given, random])

    def tell(self, genomes: FloatArray, costs: FloatArray, descriptors: FloatArray) -> None:
        """Keep each genome that is better than the elite of its cell; what failed (NaN) is in none."""
        known = np.flatnonzero(~np.isnan(descriptors).any(axis=1))
        cost = np.concatenate([self._costs, costs[known, self._column]])
        place = np.concatenate([self._places, self._place(descriptors[known])])
        everybody = np.concatenate([self._genomes, genomes[known]])
        order = np.lexsort((np.arange(len(cost)), cost, place))  # of equal ones the elder
        _, first = np.unique(place[order], return_index=True)
        elites = order[first]
        self._genomes, self._costs, self._places = everybody[elites], cost[elites], place[elites]

    def behaviour_map(self) -> BehaviourMap:
        """Return the elites, each judged by the generation in which it came to its cell."""
        shape = (self._cells,) * len(self._low)
        places = np.stack(np.unravel_index(self._places, shape), axis=1)
        return BehaviourMap(shape, self._objective, places, self._genomes.copy())

    def state(self) -> dict[str, Any]:
        """Return the map, the genomes to begin from and the RNG's state."""
        return {
            "genomes": self._genomes.copy(),
            "costs": self._costs.copy(),
            "places": self._places.copy(),
            "given": self._given.copy(),
            "rng": self._rng.bit_generator.state,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from ``state``."""
        self._genomes, self._costs = np.array(state["genomes"]), np.array(state["costs"])
        self._places, self._given = np.array(state["places"], dtype=np.intp), np.array(state["given"])
        self._rng.bit_generator.state = state["rng"]

    def _place(self, descriptors: FloatArray) -> IntArray:
        """Return ``(n,)``: the number of the cell of each of ``(n, d)``."""
        share = (descriptors - self._low) / (self._high - self._low)
        along = np.clip((share * self._cells).astype(np.intp), 0, self._cells - 1)
        number: IntArray = np.ravel_multi_index(tuple(along.T), (self._cells,) * len(self._low)).astype(np.intp)
        return number

    def _children(self) -> FloatArray:
        n, rho = self._population, self._space.is_switch
        one, other = self._genomes[self._rng.integers(len(self._genomes), size=(2, n))]
        iso = self._iso * self._rng.standard_normal(one.shape)
        line = self._line * self._rng.standard_normal((n, 1))
        children = one + iso + line * (other - one)
        turned = self._rng.random((n, np.count_nonzero(rho))) < self._flips
        children[:, rho] = (one[:, rho] >= 0.5) != turned
        within: FloatArray = np.clip(children, *self._space.bounds)
        return within

# SPDX-License-Identifier: BSD-3-Clause
"""Searches for a Pareto front by the library pymoo (Blank & Deb 2020): NSGA-II, -III, SPEA2, GDE3, SMS-EMOA, MOEA/D."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np

from swarmevo.protocols import FloatArray, GenomeSpace, Problem
from swarmevo_rivals.checks import require_positive
from swarmevo_rivals.genomes import random_genomes
from swarmevo_rivals.replayed import Replayed
from swarmevo_rivals.shares import Shares


class ParetoSearch(Replayed):
    """A search by an algorithm of pymoo.

    Costs are given to it as shares of the objectives' ranges, 0 the best.

    Args:
        space: Layout of a genome.
        population: Genomes of a generation.
        objectives: Number of costs.
        rng: The only source of randomness.
        problem: Ranges of the objectives.
        reach: Genes without bounds of their own lie between minus this and this; pymoo needs bounds.

    Raises:
        ValueError: An option is out of its range, or there are too few objectives or genomes for the algorithm.
    """

    libraries = ("pymoo", "moocore")
    least_objectives: ClassVar[int] = 1
    least_population: ClassVar[int] = 2

    def __init__(
        self,
        space: GenomeSpace,
        population: int,
        objectives: int,
        rng: np.random.Generator,
        problem: Problem,
        *,
        reach: float = 5.0,
    ) -> None:
        require_positive("reach", reach)
        if objectives < self.least_objectives:
            raise ValueError(
                f"objectives: expected at least {self.least_objectives}, got {objectives}; choose a fitness beside"
            )
        if population < self.least_population:
            raise ValueError(f"population: expected a number of at least {self.least_population}, got {population}")
        low, high = space.bounds
        self._low, self._high = np.maximum(low, -reach), np.minimum(high, reach)
        self._low[space.is_switch], self._high[space.is_switch] = 0.0, 1.0
        self._shares = Shares(problem)
        self._asked: Any = None
        super().__init__(space, population, objectives, rng)

    def ask(self) -> FloatArray:
        """Return genomes ``(n, size)``: the population at first, then its children.

        Where the algorithm finds no child that it has not had, they are random.
        """
        self._asked = self._made.ask()
        if self._asked is None or not len(self._asked):
            self._asked = None
            return self._within(random_genomes(self._space, self._population, self._rng))
        return np.array(self._asked.get("X"), dtype=np.float64)

    def tell(self, genomes: FloatArray, costs: FloatArray) -> None:
        """Give the costs ``(n, objectives)`` of the genomes asked for to the algorithm."""
        self._tell(self._shares(costs))

    @abstractmethod
    def _algorithm(self, first: FloatArray) -> Any:
        """Return pymoo's algorithm with the first population."""

    def _begin(self) -> None:
        from pymoo.core.problem import Problem as Bounded
        from pymoo.core.termination import NoTermination

        bounded = Bounded(n_var=self._space.size, n_obj=self._columns, xl=self._low, xu=self._high)
        self._made = self._algorithm(self._first.copy())
        self._made.setup(bounded, termination=NoTermination(), seed=self._seed, verbose=False)
        self._asked = None

    def _learn(self, told: FloatArray) -> None:
        if self._asked is not None:
            self._asked.set("F", told)
            self._made.tell(infills=self._asked)

    def _within(self, genomes: FloatArray) -> FloatArray:
        within: FloatArray = np.clip(genomes, self._low, self._high)
        return within

    def _directions(self) -> FloatArray:
        """Return directions in the objectives' space, as many as the population has room for (Das & Dennis 1998)."""
        from pymoo.util.ref_dirs import get_reference_directions

        parts = 1
        while math.comb(parts + self._columns, self._columns - 1) <= self._population:
            parts += 1
        found: FloatArray = get_reference_directions("das-dennis", self._columns, n_partitions=parts)
        return found


class NSGA2(ParetoSearch):
    """NSGA-II (Deb et al. 2002): ranks by domination, then by the distance to the neighbours on the front."""

    def _algorithm(self, first: FloatArray) -> Any:
        from pymoo.algorithms.moo import nsga2

        return nsga2.NSGA2(pop_size=self._population, sampling=first)


class NSGA3(ParetoSearch):
    """NSGA-III (Deb & Jain 2014): for three objectives and more; spreads along directions through their space."""

    least_objectives = 2

    def _algorithm(self, first: FloatArray) -> Any:
        from pymoo.algorithms.moo import nsga3

        return nsga3.NSGA3(self._directions(), pop_size=self._population, sampling=first)


class SPEA2(ParetoSearch):
    """SPEA2 (Zitzler et al. 2001): counts who dominates whom, and thins out where the front is dense."""

    least_objectives = 2

    def _algorithm(self, first: FloatArray) -> Any:
        from pymoo.algorithms.moo import spea2

        # By default all searches of a process share one survival, which scales by what it remembers. Ours are shares.
        survival = spea2.SPEA2Survival(normalize=False)
        return spea2.SPEA2(pop_size=self._population, sampling=first, survival=survival)


class GDE3(ParetoSearch):
    """GDE3 (Kukkonen & Lampinen 2005): differential evolution for several objectives, the nearest to PDE."""

    least_population = 4

    def _algorithm(self, first: FloatArray) -> Any:
        from pymoo.algorithms.moo import gde3

        return gde3.GDE3(pop_size=self._population, sampling=first)


class SMSEMOA(ParetoSearch):
    """SMS-EMOA (Beume et al. 2007): drops who adds least to the hypervolume."""

    least_objectives = 2

    def _algorithm(self, first: FloatArray) -> Any:
        from pymoo.algorithms.moo import sms

        return sms.SMSEMOA(pop_size=self._population, sampling=first)


class MOEAD(ParetoSearch):
    """MOEA/D (Zhang & Li 2007): a weighted problem for each of many directions, neighbours help each other.

    A generation is asked at once, each child for the problem of a random direction. The population is as large as there
    are directions, at most as large as is set.
    """

    least_objectives = 2
    least_population = 4

    def _algorithm(self, first: FloatArray) -> Any:
        from pymoo.algorithms.moo.moead import ParallelMOEAD

        directions = self._directions()
        return ParallelMOEAD(directions, n_neighbors=min(20, len(directions)), sampling=first[: len(directions)])

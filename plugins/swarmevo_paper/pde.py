# SPDX-License-Identifier: BSD-3-Clause
"""Elitist Pareto-frontier differential evolution (PDE): the paper's section III, step by step.

Where the paper is silent, the reading and its reasons are in ``docs/paper-map.md``.

The order of random draws is part of the interface, so that a second implementation can be held against this one:

- initial population: ``standard_normal((population, real genes))``, then ``random((population, switches)) < 0.5``;
- each child: ``choice(retained, 3, replace=False)``; ``random(links) < crossover_rate``; ``standard_normal(parts)``;
  ``random(units) < mutation_rate``; ``standard_normal(real genes) * mutation_spread``, drawn whether used or not;
- of genes with two bounds also ``random((population, such genes))`` after the initial population;
- with self-chosen rates also ``random((population, 2))`` after the initial population, and ``standard_normal(2)`` after
  each ``choice``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal, get_args

import moocore
import numpy as np

from swarmevo.protocols import FloatArray, GenomeSpace, IntArray

Reevaluate = Literal["accumulate", "once", "renew"]
Acceptance = Literal["always", "dominates"]
Rates = Literal["fixed", "self"]

PARENTS = 3
"""One main and two supporting parents (paper step 3.4.1)."""


class PDE:
    """The paper's optimiser.

    A front that fills the population leaves no room for children: more than ``front`` of it is not retained. That never
    happens with the paper's settings: the front has at most one point for each number of hidden neurons, 0 to 15.

    Args:
        space: Layout of a genome.
        population: At least 4: three parents and a child.
        objectives: Number of costs.
        rng: The only source of randomness.
        crossover_rate: Probability that a link's genes are crossed over (paper Table I).
        mutation_rate: Probability that a unit mutates (paper Table I).
        mutation_spread: Standard deviation of the mutation of real genes (paper step 3.4.3).
        reevaluate: What becomes of the retained: evaluated in every generation and judged by the mean of all their
            evaluations (``accumulate``) or by the newest (``renew``), or not evaluated again (``once``).
        acceptance: Whether a child enters the selection ``always``, or only if it ``dominates`` its main parent.
        front: Largest share of the population that the front may take, but 3 at least and all but one at most. Of a
            larger front those are left out that are nearest to others.
        rates: Whether the three options of crossover and mutation hold for all (``fixed``), or each individual has two
            rates of its own (``self``): of crossover, and of mutation, which is its spread, too. They begin anywhere
            from 0 to 1 and are inherited as weights are (SPDE: Abbass 2002).

    Raises:
        ValueError: An option is out of its range.
    """

    def __init__(
        self,
        space: GenomeSpace,
        population: int,
        objectives: int,
        rng: np.random.Generator,
        *,
        crossover_rate: float = 0.7,
        mutation_rate: float = 0.01,
        mutation_spread: float = 0.01,
        reevaluate: Reevaluate = "accumulate",
        acceptance: Acceptance = "always",
        front: float = 0.6,
        rates: Rates = "fixed",
    ) -> None:
        _require_number("population", population, PARENTS + 1)
        _require_number("crossover_rate", crossover_rate, 0, 1)
        _require_number("mutation_rate", mutation_rate, 0, 1)
        _require_number("mutation_spread", mutation_spread, 0)
        _require_number("front", front, 0, 1)
        _require_choice("reevaluate", reevaluate, get_args(Reevaluate))
        _require_choice("acceptance", acceptance, get_args(Acceptance))
        _require_choice("rates", rates, get_args(Rates))
        self._space, self._population, self._rng = space, population, rng
        self._mutation_spread, self._chooses_rates = mutation_spread, rates == "self"
        self._reevaluate, self._acceptance = reevaluate, acceptance
        self._largest_front = min(max(round(front * population), PARENTS), population - 1)

        self._genomes = self._random_genomes()  # step 2.0
        self._rates = np.tile([float(crossover_rate), float(mutation_rate)], (population, 1))  # of each individual
        if self._chooses_rates:
            self._rates = rng.random((population, 2))
        self._cost_sums = np.zeros((population, objectives))
        self._evaluations = np.zeros(population, dtype=np.intp)
        self._main_parents = np.full(population, -1, dtype=np.intp)  # index into the population; -1: not a new child

    def start_from(self, genomes: FloatArray) -> None:
        """Begin from ``genomes`` ``(k, size)``; the rest of the population stays random, as it was drawn.

        Raises:
            ValueError: They are more than the population.
        """
        if len(genomes) > self._population:
            raise ValueError(
                f"genomes: expected at most the population, {self._population}, got {len(genomes)}; "
                "give fewer or make evolution.population larger"
            )
        rho = self._space.is_switch
        self._genomes[: len(genomes)] = np.where(rho, genomes >= 0.5, genomes)

    def ask(self) -> FloatArray:
        """Return the genomes ``(n, size)`` to evaluate: the retained, if evaluated again, then the children."""
        return self._genomes[self._asked()]

    def tell(self, genomes: FloatArray, costs: FloatArray) -> None:
        """Take the costs ``(n, objectives)`` of the genomes asked for, and make the next population."""
        self._record(costs)  # step 3.1, evaluate
        if self._acceptance == "dominates":
            self._retain(self._accepted())  # PDE of 2001; not in the paper
        self._retain(self._labelled())  # step 3.3
        self._fill_up()  # steps 3.4 and 3.5

    def state(self) -> dict[str, Any]:
        """Return the population, its evaluations and the RNG's state."""
        rates = {"rates": self._rates.copy()} if self._chooses_rates else {}
        return {
            "genomes": self._genomes.copy(),
            "cost_sums": self._cost_sums.copy(),
            "evaluations": self._evaluations.copy(),
            "main_parents": self._main_parents.copy(),
            "rng": self._rng.bit_generator.state,
            **rates,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from ``state``."""
        self._genomes = np.array(state["genomes"], dtype=np.float64)
        self._cost_sums = np.array(state["cost_sums"], dtype=np.float64)
        self._evaluations = np.array(state["evaluations"], dtype=np.intp)
        self._main_parents = np.array(state["main_parents"], dtype=np.intp)
        self._rng.bit_generator.state = state["rng"]
        if self._chooses_rates:
            self._rates = np.array(state["rates"], dtype=np.float64)

    def _random_genomes(self) -> FloatArray:
        """Step 2.0: return the initial population ``(population, size)``."""
        rho = self._space.is_switch
        genomes = np.empty((self._population, self._space.size))
        genomes[:, ~rho] = self._rng.standard_normal((self._population, np.count_nonzero(~rho)))  # omega ~ N(0, 1)
        genomes[:, rho] = self._rng.random((self._population, np.count_nonzero(rho))) < 0.5  # P(rho = 1) = 0.5
        return self._within_bounds(self._anywhere_between_bounds(genomes))

    def _anywhere_between_bounds(self, genomes: FloatArray) -> FloatArray:
        """Draw genes with two bounds from all between them. Not in the paper, whose weights have none."""
        low, high = self._space.bounds
        bounded = np.isfinite(low) & np.isfinite(high)
        if bounded.any():
            share = self._rng.random((len(genomes), np.count_nonzero(bounded)))
            genomes[:, bounded] = low[bounded] + share * (high - low)[bounded]
        return genomes

    def _within_bounds(self, genomes: FloatArray) -> FloatArray:
        """Return genomes with the genes that are out of their bounds on them. Not in the paper."""
        within: FloatArray = np.clip(genomes, *self._space.bounds)
        return within

    def _asked(self) -> IntArray:
        """Return who is to be evaluated: indices into the population."""
        once = self._reevaluate == "once"
        return np.flatnonzero(self._evaluations == 0) if once else np.arange(len(self._genomes))

    def _record(self, costs: FloatArray) -> None:
        """Step 3.1: remember the costs of those who were asked for."""
        asked = self._asked()
        if self._reevaluate == "renew":
            self._cost_sums[asked], self._evaluations[asked] = 0, 0
        self._cost_sums[asked] += costs
        self._evaluations[asked] += 1

    def _costs(self) -> FloatArray:
        """Return ``(population, objectives)``: the mean of the evaluations that count."""
        return self._cost_sums / self._evaluations[:, np.newaxis]

    def _accepted(self) -> IntArray:
        """Return all but the new children that do not dominate their main parent. The retained are three at least."""
        costs = self._costs()
        parent_costs = costs[self._main_parents]
        dominates = np.all(costs <= parent_costs, axis=1) & np.any(costs < parent_costs, axis=1)
        return np.flatnonzero(dominates | (self._main_parents < 0))

    def _labelled(self) -> IntArray:
        """Steps 3.1 to 3.2.2: return the first layer of non-dominated solutions, at least three and not too many.

        Only representatives form layers. Duplicates do not dominate each other: they would fill the population for
        good. They come last, if there are not enough others.
        """
        costs = self._costs()
        first = _representatives(self._genomes, costs)
        layer = moocore.pareto_rank(costs[first])  # step 3.1: layer 0
        front: IntArray = first[layer == 0]
        if len(front) > self._largest_front:
            return front[_apart(costs[front], self._largest_front)]  # PDE of 2001; cannot happen in the paper
        by_layer = first[np.argsort(layer, kind="stable")]  # in a layer: in the population's order
        queue = np.concatenate([by_layer, np.setdiff1d(np.arange(len(costs)), first)])
        return np.sort(queue[: max(len(front), PARENTS)])  # steps 3.2 to 3.2.2

    def _retain(self, survivors: IntArray) -> None:
        """Step 3.3: delete everybody else."""
        self._genomes = self._genomes[survivors]
        self._cost_sums, self._evaluations = self._cost_sums[survivors], self._evaluations[survivors]
        self._rates = self._rates[survivors]

    def _fill_up(self) -> None:
        """Steps 3.4 and 3.5: put a child in the place of each deleted solution."""
        retained, deleted = len(self._genomes), self._population - len(self._genomes)
        alphas = np.empty((deleted, PARENTS), dtype=np.intp)
        children, rates = np.empty((deleted, self._space.size)), np.empty((deleted, 2))
        for i in range(deleted):  # step 3.5
            alphas[i] = self._rng.choice(retained, PARENTS, replace=False)  # step 3.4.1
            rates[i] = self._inherited_rates(*self._rates[alphas[i]])
            children[i] = self._crossover(rates[i, 0], *self._genomes[alphas[i]])  # step 3.4.2
            self._mutate(children[i], rates[i, 1])  # step 3.4.3
        self._genomes = np.concatenate([self._genomes, self._within_bounds(children)])
        self._cost_sums = np.concatenate([self._cost_sums, np.zeros((deleted, self._cost_sums.shape[1]))])
        self._evaluations = np.concatenate([self._evaluations, np.zeros(deleted, dtype=np.intp)])
        self._main_parents = np.concatenate([np.full(retained, -1), alphas[:, 0]])
        self._rates = np.concatenate([self._rates, rates])

    def _inherited_rates(self, alpha_1: FloatArray, alpha_2: FloatArray, alpha_3: FloatArray) -> FloatArray:
        """Return a child's rates ``(2,)`` of those of its parents. Not in the paper but for ``fixed`` ones."""
        if not self._chooses_rates:
            return alpha_1
        rates = np.abs(alpha_1 + self._rng.standard_normal(2) * (alpha_2 - alpha_3))
        return np.where(rates > 1, rates - np.floor(rates), rates)  # SPDE: of what is above 1 the fraction

    def _crossover(
        self, crossover_rate: float, alpha_1: FloatArray, alpha_2: FloatArray, alpha_3: FloatArray
    ) -> FloatArray:
        """Step 3.4.2: return a child ``(size,)``, a link at a time either crossed over or the main parent's."""
        rho, link, part = self._space.is_switch, self._space.link_of, self._space.part_of
        crossed = self._rng.random(_count(link)) < crossover_rate  # "with some uniform (0,1) probability, do"
        factor = self._rng.standard_normal(_count(part))  # N(0, 1)
        omega = alpha_1 + factor[part] * (alpha_2 - alpha_3)
        omega[rho] = omega[rho] >= 0.5  # rho <- 1, 0 otherwise
        return np.where(crossed[link], omega, alpha_1)  # otherwise: as alpha_1

    def _mutate(self, child: FloatArray, mutation_rate: float) -> None:
        """Step 3.4.3: in place, a unit at a time."""
        spread = mutation_rate if self._chooses_rates else self._mutation_spread
        rho, unit = self._space.is_switch, self._space.unit_of
        mutated = (self._rng.random(_count(unit)) < mutation_rate)[unit]  # "with some uniform (0,1) probability"
        noise = self._rng.standard_normal(np.count_nonzero(~rho)) * spread  # N(0, mutation_rate)
        child[~rho & mutated] += noise[mutated[~rho]]  # omega <- omega + N(0, mutation_rate)
        child[rho & mutated] = 1 - child[rho & mutated]  # rho <- 1 if it was 0, 0 otherwise


def _representatives(genomes: FloatArray, costs: FloatArray) -> IntArray:
    """Return the indices of those who share neither genome nor costs with a representative before them."""
    genomes_seen: set[tuple[float, ...]] = set()
    costs_seen: set[tuple[float, ...]] = set()
    indices = []
    for i, (genome, cost) in enumerate(zip(map(tuple, genomes.tolist()), map(tuple, costs.tolist()), strict=True)):
        if genome not in genomes_seen and cost not in costs_seen:
            genomes_seen.add(genome)
            costs_seen.add(cost)
            indices.append(i)
    return np.array(indices, dtype=np.intp)


def _apart(costs: FloatArray, most: int) -> IntArray:
    """Return the indices of ``most`` points, far from each other, of a front ``(n, objectives)`` with n above ``most``.

    One after the other, the point goes whose mean distance to its two nearest neighbours is the least; of equal ones
    the last. A point that is the first of the best in an objective goes only when no other is left. Distances are in
    shares of the front's range in each objective.
    """
    low, span = costs.min(axis=0), np.ptp(costs, axis=0)
    place = (costs - low) / np.where(span > 0, span, 1.0)
    distance = np.sqrt(np.square(place[:, np.newaxis] - place).sum(axis=2))
    np.fill_diagonal(distance, np.inf)  # nobody is a neighbour of their own
    nearest = _two_least(distance)
    index = np.arange(len(costs))
    is_best, gone = np.isin(index, costs.argmin(axis=0)), np.zeros(len(costs), dtype=np.bool_)
    for _ in range(len(costs) - most):
        leaves = np.lexsort((-index, nearest.sum(axis=1), is_best, gone))[0]
        gone[leaves] = True
        lost = distance[:, leaves] <= nearest[:, 1]  # whose neighbour it was
        distance[:, leaves] = np.inf
        nearest[lost] = _two_least(distance[lost])
    return np.flatnonzero(~gone)


def _two_least(distance: FloatArray) -> FloatArray:
    """Return ``(n, 2)``: the two least of each row of ``(n, k)``, k at least 2, in order."""
    least: FloatArray = np.partition(distance, 1, axis=1)[:, :2]
    return least


def _count(numbers: IntArray) -> int:
    """Return how many units, links or parts there are: they are numbered from 0."""
    return int(numbers.max()) + 1


def _require_number(name: str, value: object, low: float, high: float = math.inf) -> None:
    if not isinstance(value, (int, float)) or not low <= value <= high or value == math.inf:
        span = f"from {low} to {high}" if high < math.inf else f"of at least {low}"
        raise ValueError(f"{name}: expected a number {span}, got {value!r}")


def _require_choice(name: str, value: object, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise ValueError(f"{name}: expected one of {', '.join(choices)}, got {value!r}")

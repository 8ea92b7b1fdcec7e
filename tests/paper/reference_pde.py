# SPDX-License-Identifier: BSD-3-Clause
"""The elitist PDE of the paper (section III), written a second time and slowly, to check the fast one against.

Every loop over individuals, hidden units, inputs and outputs is spelled out and every line that belongs to a step of
the paper's pseudo-code names it. Numpy serves only as the random generator and as the form of what goes in and out.
Where the paper is open, the agreed protocol of random draws holds; it is repeated at each draw.

A genome is flat: input_hidden (hidden x inputs, the bias among the inputs), hidden_output (outputs x (hidden + 1), the
last column being the output bias), hidden_switch (hidden values, each exactly 0.0 or 1.0).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy
from numpy.typing import ArrayLike, NDArray

REEVALUATE = ("accumulate", "renew", "once")


@dataclass(eq=False)
class Individual:
    """One chromosome and every cost vector it was ever given, oldest first."""

    omega_ih: list[list[float]]  # [h][i]
    omega_ho: list[list[float]]  # [o][c], c = hidden: the output bias
    rho: list[float]  # [h]
    evaluations: list[list[float]] = field(default_factory=list)

    def genome(self) -> list[float]:
        """The flat genome."""
        genes: list[float] = []
        for row in self.omega_ih:
            genes.extend(row)
        for row in self.omega_ho:
            genes.extend(row)
        genes.extend(self.rho)
        return genes


def dominates(first: list[float], second: list[float]) -> bool:
    """Standard Pareto dominance, all costs minimised: nowhere worse and somewhere better."""
    better = False
    for a, b in zip(first, second, strict=True):
        if a > b:
            return False
        if a < b:
            better = True
    return better


def non_dominated(candidates: list[int], costs: list[list[float]]) -> list[int]:
    """Those of the candidates that no other candidate dominates, in the order given."""
    layer: list[int] = []
    for one in candidates:
        dominated = False
        for other in candidates:
            if dominates(costs[other], costs[one]):
                dominated = True
        if not dominated:
            layer.append(one)
    return layer


def representatives(genomes: list[list[float]], costs: list[list[float]]) -> list[int]:
    """One individual per genome and per cost vector: in population order, each unlike every one chosen before it."""
    chosen: list[int] = []
    for index in range(len(genomes)):
        seen = False
        for earlier in chosen:
            if genomes[earlier] == genomes[index] or costs[earlier] == costs[index]:
                seen = True
        if not seen:
            chosen.append(index)
    return chosen


def room_of(one: int, others: list[int], places: dict[int, list[float]]) -> float:
    """The mean of the distances from one individual to the two of the others that are nearest to it."""
    distances: list[float] = []
    for other in others:
        if other != one:
            square = 0.0
            for a, b in zip(places[one], places[other], strict=True):
                square += (a - b) * (a - b)
            distances.append(math.sqrt(square))
    distances.sort()
    return (distances[0] + distances[1]) / 2


def thinned(front: list[int], costs: list[list[float]], most: int) -> list[int]:
    """What is left of a front when the most crowded have gone one by one; not in the paper, see docs/paper-map.md."""
    places: dict[int, list[float]] = {index: [] for index in front}
    best: list[int] = []  # in each objective the first one
    for objective in range(len(costs[front[0]])):
        column = [costs[index][objective] for index in front]
        low, high = min(column), max(column)
        for index in front:
            share = 0.0 if high == low else (costs[index][objective] - low) / (high - low)
            places[index].append(share)
        best.append(front[column.index(low)])
    left = list(front)
    while len(left) > most:
        may_go = [index for index in left if index not in best] or left
        leaver, least = -1, math.inf
        for index in may_go:
            room = room_of(index, left, places)
            if room <= least:  # the last of equal ones
                leaver, least = index, room
        left.remove(leaver)
    return left


def retained_indices(genomes: list[list[float]], costs: list[list[float]], most: int) -> list[int]:
    """Steps 3.1 and 3.2: the indices of the labelled individuals, in population order; of a front ``most``."""
    unlabelled = representatives(genomes, costs)
    labelled = non_dominated(unlabelled, costs)  # 3.1 label as parents those that are non-dominated
    if len(labelled) > most:
        return thinned(labelled, costs, most)
    unlabelled = [index for index in unlabelled if index not in labelled]
    while len(labelled) < 3 and unlabelled:  # 3.2 the second and subsequent layers
        layer = non_dominated(unlabelled, costs)  # 3.2.1 non-dominated among those who are not labelled
        for index in layer:
            if len(labelled) < 3:
                labelled.append(index)  # 3.2.2
        unlabelled = [index for index in unlabelled if index not in layer]
    for index in range(len(genomes)):  # 3.2 the representatives ran out: the others, in population order
        if len(labelled) < 3 and index not in labelled:
            labelled.append(index)
    return sorted(labelled)


class ReferencePDE:
    """The elitist Pareto-frontier Differential Evolution, asked for genomes and told their costs (all minimised)."""

    def __init__(
        self,
        population: int,
        hidden: int,
        rng: numpy.random.Generator,
        crossover_rate: float = 0.7,
        mutation_rate: float = 0.01,
        mutation_spread: float = 0.01,
        reevaluate: str = "accumulate",
        front: float = 0.6,
        inputs: int = 14,
        outputs: int = 2,
    ) -> None:
        if population < 4:
            raise ValueError("differential evolution needs three parents and room for a child")
        if reevaluate not in REEVALUATE:
            raise ValueError(f"reevaluate is one of {REEVALUATE}, not {reevaluate!r}")
        self.size = population
        self.hidden = hidden
        self.rng = rng
        self.crossover_rate = crossover_rate
        self.mutation_rate = mutation_rate
        self.mutation_spread = mutation_spread
        self.reevaluate = reevaluate
        self.most = round(front * population)  # of the front that are retained
        if self.most < 3:
            self.most = 3
        if self.most > population - 1:
            self.most = population - 1
        self.inputs = inputs
        self.outputs = outputs
        self.n_real = hidden * inputs + outputs * (hidden + 1)
        self.population: list[Individual] = self._initial_population()
        self.n_retained = 0  # how many, at the head of the population, were retained from the generation before

    def ask(self) -> NDArray[numpy.float64]:
        """The genomes to be evaluated now; the same ones until they are told."""
        rows = [individual.genome() for individual in self._asked()]
        return numpy.array(rows, dtype=numpy.float64).reshape(len(rows), self.n_real + self.hidden)

    def tell(self, costs: ArrayLike) -> None:
        """Take the costs of the genomes last asked for, one row each, and make the next generation."""
        told = numpy.asarray(costs, dtype=numpy.float64)
        asked = self._asked()
        if told.ndim != 2 or told.shape[0] != len(asked):
            raise ValueError(f"costs of shape {told.shape} for {len(asked)} genomes")
        if numpy.isnan(told).any():
            raise ValueError("a cost is not a number")
        for individual, row in zip(asked, told, strict=True):  # 3.1 evaluate the individuals
            individual.evaluations.append([float(cost) for cost in row])

        genomes = [individual.genome() for individual in self.population]
        current = [self._cost(individual) for individual in self.population]
        kept = retained_indices(genomes, current, self.most)  # 3.1, 3.2
        retained = [self.population[index] for index in kept]  # 3.3 the others are deleted
        children: list[Individual] = []
        while len(retained) + len(children) < self.size:  # 3.4, 3.5 repeat for all of the deleted
            children.append(self._child(retained))
        self.population = retained + children
        self.n_retained = len(retained)

    def _asked(self) -> list[Individual]:
        if self.reevaluate == "once":
            return self.population[self.n_retained :]
        return self.population

    def _cost(self, individual: Individual) -> list[float]:
        """What an individual costs now, from all that it was told."""
        if self.reevaluate == "renew":
            return individual.evaluations[-1]
        mean: list[float] = []  # with "once" there is a single evaluation, which is its own mean
        for objective in range(len(individual.evaluations[0])):
            total = 0.0
            for evaluation in individual.evaluations:
                total += evaluation[objective]
            mean.append(total / len(individual.evaluations))
        return mean

    def _unflatten(self, real: list[float], rho: list[float]) -> Individual:
        omega_ih: list[list[float]] = []
        omega_ho: list[list[float]] = []
        gene = 0
        for _h in range(self.hidden):
            row: list[float] = []
            for _i in range(self.inputs):
                row.append(real[gene])
                gene += 1
            omega_ih.append(row)
        for _o in range(self.outputs):
            row = []
            for _c in range(self.hidden + 1):
                row.append(real[gene])
                gene += 1
            omega_ho.append(row)
        return Individual(omega_ih, omega_ho, rho)

    def _initial_population(self) -> list[Individual]:
        """Step 2.0; drawn: all weights as (population, n_real), then all switches as (population, hidden)."""
        weights = self.rng.standard_normal((self.size, self.n_real)).tolist()  # 2.0 N(0, 1)
        uniform = self.rng.random((self.size, self.hidden)).tolist()  # 2.0 uniform on [0, 1]
        individuals: list[Individual] = []
        for n in range(self.size):
            rho = [1.0 if u < 0.5 else 0.0 for u in uniform[n]]  # 2.0 1 with probability 0.5; 0 otherwise
            individuals.append(self._unflatten(weights[n], rho))
        return individuals

    def _child(self, retained: list[Individual]) -> Individual:
        """Steps 3.4.1 to 3.4.3; drawn in the order of the lines."""
        hidden, inputs, outputs = self.hidden, self.inputs, self.outputs
        bias = hidden  # the last column of omega_ho

        # 3.4.1 the main parent and two supporting parents, all distinct
        parents = self.rng.choice(len(retained), 3, replace=False).tolist()
        alpha1, alpha2, alpha3 = retained[parents[0]], retained[parents[1]], retained[parents[2]]

        # 3.4.2 one decision for each h (omega_ih and rho_h together), then one for each column of omega_ho
        cross = [u < self.crossover_rate for u in self.rng.random(hidden + hidden + 1).tolist()]
        cross_ih, cross_ho = cross[:hidden], cross[hidden:]
        # 3.4.2 the factors N(0,1): one for each row h of omega_ih, each column of omega_ho, each rho_h
        factor = self.rng.standard_normal(hidden + hidden + 1 + hidden).tolist()
        factor_ih = factor[:hidden]
        factor_ho = factor[hidden : hidden + hidden + 1]
        factor_rho = factor[hidden + hidden + 1 :]

        # 3.4.3 one decision for each hidden unit, then one for the output bias; noise for all real genes in gene order
        mutate = [u < self.mutation_rate for u in self.rng.random(hidden + 1).tolist()]
        drawn = self.rng.standard_normal(self.n_real).tolist()
        noise = self._unflatten([self.mutation_spread * z for z in drawn], [0.0] * hidden)

        child = self._unflatten([0.0] * self.n_real, [0.0] * hidden)
        for h in range(hidden):
            if cross_ih[h]:
                for i in range(inputs):  # 3.4.2 omega_ih, crossover
                    difference = alpha2.omega_ih[h][i] - alpha3.omega_ih[h][i]
                    child.omega_ih[h][i] = alpha1.omega_ih[h][i] + factor_ih[h] * difference
                if alpha1.rho[h] + factor_rho[h] * (alpha2.rho[h] - alpha3.rho[h]) >= 0.5:  # 3.4.2 rho_h, crossover
                    child.rho[h] = 1.0
                else:
                    child.rho[h] = 0.0
            else:
                for i in range(inputs):  # 3.4.2 omega_ih, otherwise
                    child.omega_ih[h][i] = alpha1.omega_ih[h][i]
                child.rho[h] = alpha1.rho[h]  # 3.4.2 rho_h, otherwise
        for c in range(hidden + 1):
            for o in range(outputs):
                if cross_ho[c]:  # 3.4.2 omega_ho, crossover
                    difference = alpha2.omega_ho[o][c] - alpha3.omega_ho[o][c]
                    child.omega_ho[o][c] = alpha1.omega_ho[o][c] + factor_ho[c] * difference
                else:  # 3.4.2 omega_ho, otherwise
                    child.omega_ho[o][c] = alpha1.omega_ho[o][c]

        for h in range(hidden):
            if mutate[h]:
                for i in range(inputs):
                    child.omega_ih[h][i] += noise.omega_ih[h][i]  # 3.4.3 omega_ih
                for o in range(outputs):
                    child.omega_ho[o][h] += noise.omega_ho[o][h]  # 3.4.3 omega_ho
                if child.rho[h] == 0.0:  # 3.4.3 rho_h
                    child.rho[h] = 1.0
                else:
                    child.rho[h] = 0.0
        if mutate[bias]:
            for o in range(outputs):
                child.omega_ho[o][bias] += noise.omega_ho[o][bias]  # 3.4.3 omega_ho, the output bias
        return child

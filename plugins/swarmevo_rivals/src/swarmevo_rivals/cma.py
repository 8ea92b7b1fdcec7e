# SPDX-License-Identifier: BSD-3-Clause
"""CMA-ES (Hansen, arXiv 1604.00772) for genomes: switches, several objectives, restarts, and its mean as the answer."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any, Final, Literal, get_args

import numpy as np

from swarmevo.protocols import FloatArray, GenomeSpace
from swarmevo_rivals.checks import require_choice, require_count, require_positive
from swarmevo_rivals.genomes import Frame, middle
from swarmevo_rivals.restarts import Restarts, Schedule
from swarmevo_rivals.search import Search

Switches = Literal["evolve", "on"]
LearningRate = Literal["fixed", "adaptive"]

LEAST_POPULATION: Final = 4
"""Of fewer the better half is one genome, from which no covariance is learnt."""

SURE: Final = 5
"""Generations whose costs tell which of several starts is the best."""


class CMAES:
    """CMA-ES: learns the mean and the covariance of a normal distribution; one objective, or several weighted.

    Args:
        space: Layout of a genome.
        population: Genomes of a generation, at least 4.
        objectives: Number of costs.
        rng: The only source of randomness.
        sigma: Standard deviation of each gene in the first generation.
        switches: Whether switches are genes like the others, which begin about 0.5 and are on from there
            (``evolve``), or are held ``on``.
        weights: Of the objectives in their order, none below 0: what becomes less is the sum of costs times weights.
            Nothing: 1 each.
        restarts: What follows a search that is over: nothing, its distribution stays (``none``); a search from
            elsewhere with twice the population (``ipop``); or that in turn with smaller searches (``bipop``).
        starts: Searches from the middle, one after the other, of which the best goes on: for tasks on which many a one
            learns the wrong thing.
        start_generations: Of each of them, if they are several. The best has the least median cost, in the mean of its
            last five generations.
        learning_rate: That of the literature (``fixed``), or one that becomes less where noise hides what is better
            (``adaptive``).

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
        sigma: float = 1.0,
        switches: Switches = "evolve",
        weights: list[float] | None = None,
        restarts: Restarts = "none",
        starts: int = 1,
        start_generations: int = 30,
        learning_rate: LearningRate = "fixed",
    ) -> None:
        if population < LEAST_POPULATION:
            raise ValueError(f"population: expected a number of at least {LEAST_POPULATION}, got {population}")
        require_positive("sigma", sigma)
        require_count("starts", starts)
        require_count("start_generations", start_generations)
        require_choice("switches", switches, get_args(Switches))
        require_choice("restarts", restarts, get_args(Restarts))
        require_choice("learning_rate", learning_rate, get_args(LearningRate))
        self._rho, self._rng = space.is_switch, rng
        self._weights = _checked_weights(weights, objectives)
        self._is_free = ~self._rho if switches == "on" else np.ones(space.size, dtype=np.bool_)
        if not self._is_free.any():
            raise ValueError("switches: expected evolve, as the genome has nothing but switches, got on")
        self._frame = Frame(space.bounds[:, self._is_free])
        self._sigma, self._adapts, self._restarts = float(sigma), learning_rate == "adaptive", restarts
        self._schedule = Schedule(restarts, population, self._sigma)
        self._centre = self._points(middle(space))
        self._search = self._begin(self._centre, population, self._sigma)
        self._starts, self._start_generations = starts, start_generations
        self._heat: dict[str, Any] | None = None if starts == 1 else {"left": starts, "medians": [], "best": None}
        self._is_over = False  # nothing follows
        self._cost: float | None = None  # median of the latest generation
        self._best_ended: dict[str, Any] | None = None  # of the searches that are over: mean and cost

    def start_from(self, genomes: FloatArray) -> None:
        """Begin with the mean of ``genomes`` ``(k, size)``.

        Raises:
            ValueError: A switch is off that is to be held on.
        """
        if np.any(genomes[:, ~self._is_free] < 0.5):
            raise ValueError(
                "genomes: expected every switch on, as the option switches=on holds them, got one that is off"
            )
        mean = np.where(self._rho, genomes >= 0.5, genomes).mean(axis=0)
        self._heat = None
        self._search = self._begin(self._points(mean), self._search.population, self._sigma)

    def ask(self) -> FloatArray:
        """Return genomes ``(n, size)`` of the distribution; n is the population, or that of a restart."""
        if self._heat is None and not self._is_over and self._search.is_over():
            self._follow()
        return self._genomes(self._search.ask())

    def tell(self, genomes: FloatArray, costs: FloatArray) -> None:
        """Learn from the costs ``(n, objectives)`` of the genomes asked for."""
        if self._is_over:
            return
        cost = costs @ self._weights
        self._search.tell(self._points(genomes), cost)
        self._schedule.count(len(genomes))
        self._cost = float(np.median(cost))
        if self._heat is not None:
            self._race(self._heat, self._cost)

    def answer(self) -> FloatArray:
        """Return ``(k, size)``: the mean of the distribution, and that of the best search that is over.

        Best is the least median of the costs of the last generation. Switches are 0 or 1; nothing was told, k is 0.
        """
        means = [self._search.mean] if self._search.generations else []
        if self._best_ended is not None:
            means.append(self._best_ended["mean"])
        genomes = self._genomes(np.reshape(means, (len(means), len(self._centre))))
        return np.where(self._rho, genomes >= 0.5, genomes)

    def state(self) -> dict[str, Any]:
        """Return the search, what is known of those before, and the RNG's state."""
        return {
            "search": self._search.state(),
            "schedule": self._schedule.state(),
            "heat": copy.deepcopy(self._heat),
            "is_over": self._is_over,
            "cost": self._cost,
            "best_ended": copy.deepcopy(self._best_ended),
            "rng": self._rng.bit_generator.state,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from ``state``."""
        self._search.restore(state["search"])
        self._schedule.restore(state["schedule"])
        self._heat = copy.deepcopy(state.get("heat"))  # a run from before there were starts has one
        self._is_over, self._cost = state["is_over"], state["cost"]
        self._best_ended = copy.deepcopy(state["best_ended"])
        self._rng.bit_generator.state = state["rng"]

    def _begin(self, mean: FloatArray, population: int, sigma: float) -> Search:
        return Search(mean, sigma, population, self._adapts, self._rng)

    def _race(self, heat: dict[str, Any], cost: float) -> None:
        """Note how a start does; when it is over begin the next one, after the last one go on with the best."""
        heat["medians"] = [*heat["medians"], cost][-SURE:]
        if self._search.generations < self._start_generations and not self._search.is_over():
            return
        reached = float(np.mean(heat["medians"]))
        if heat["best"] is None or reached < heat["best"]["cost"]:
            heat["best"] = {"cost": reached, "search": self._search.state()}
        heat["left"], heat["medians"] = heat["left"] - 1, []
        self._search = self._begin(self._centre, self._search.population, self._sigma)
        if not heat["left"]:
            self._search.restore(heat["best"]["search"])
            self._heat = None

    def _follow(self) -> None:
        """Go on from a search that is over: with another one, or as it is."""
        if self._restarts == "none":
            self._is_over = True
            return
        if self._cost is not None and (self._best_ended is None or self._cost < self._best_ended["cost"]):
            self._best_ended = {"mean": self._search.mean, "cost": self._cost}
        mean = self._centre + self._sigma * self._rng.standard_normal(len(self._centre))
        self._search = self._begin(mean, *self._schedule.follow(self._rng))

    def _genomes(self, points: FloatArray) -> FloatArray:
        """Return ``(n, size)``: the points ``(n, free genes)`` with the switches that are held on."""
        genomes = np.ones((len(points), len(self._is_free)))
        genomes[:, self._is_free] = self._frame.genes(points)
        return genomes

    def _points(self, genomes: FloatArray) -> FloatArray:
        """Return ``(..., free genes)``: where genomes ``(..., size)`` are in the search."""
        return self._frame.points(genomes[..., self._is_free])


def _checked_weights(weights: list[float] | None, objectives: int) -> FloatArray:
    checked = np.ones(objectives) if weights is None else np.array(weights, dtype=np.float64)
    if checked.shape != (objectives,) or not np.all((checked >= 0) & (checked < np.inf)) or not checked.any():
        raise ValueError(
            f"weights: expected a number of at least 0 for each of {objectives} objectives, not all 0, got {weights!r}"
        )
    return checked

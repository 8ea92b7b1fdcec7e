# SPDX-License-Identifier: BSD-3-Clause
"""Pareto searches by pymoo, and random search: the conformance kit, what they find, and their states to the bit."""

from __future__ import annotations

import moocore
import numpy as np
import pytest

from swarmevo.evolution.state import decode_state, encode_state
from swarmevo.protocols import Block, GenomeSpace, Objective, Problem
from swarmevo.testing import OptimiserTests
from swarmevo_rivals import replayed
from swarmevo_rivals.pareto import GDE3, MOEAD, NSGA2, NSGA3, SMSEMOA, SPEA2
from swarmevo_rivals.random_search import RandomSearch

SEARCHES = (NSGA2, NSGA3, SPEA2, GDE3, SMSEMOA, MOEAD)
SPACE = GenomeSpace(
    (Block("weights", (8,)), Block("bounded", (2,), bounds=(0.0, 1.0)), Block("switch", (2,), "switch"))
)


def problem(objectives: int = 2) -> Problem:
    return Problem(tuple(Objective(f"o{k}", "minimise", (0.0, 40.0)) for k in range(objectives)))


def make(search=NSGA2, objectives=2, population=20, seed=1, **options):
    rng = np.random.Generator(np.random.PCG64(seed))
    return search(SPACE, population, objectives, rng, problem(objectives), **options)


def costs_of(genomes: np.ndarray, objectives: int = 2) -> np.ndarray:
    """Distances from as many places, of which no genome has all."""
    weights = genomes[:, :8]
    return np.stack([((weights - k) ** 2).sum(axis=1) + genomes[:, 8] for k in range(objectives)], axis=1)


def evolve(optimiser, generations: int, objectives: int = 2) -> np.ndarray:
    told = []
    for _ in range(generations):
        genomes = optimiser.ask()
        told.append(costs_of(genomes, objectives))
        optimiser.tell(genomes, told[-1])
    return np.concatenate(told)


# ---- the conformance kit ---------------------------------------------------------------------------------------------


class TestNSGA2(OptimiserTests):
    def create(self, space, population, objectives, rng, problem):
        return NSGA2(space, population, objectives, rng, problem)


class TestGDE3(OptimiserTests):
    populations = (4, 7)

    def create(self, space, population, objectives, rng, problem):
        return GDE3(space, population, objectives, rng, problem)


class TestSMSEMOA(OptimiserTests):
    objectives = (2, 3)

    def create(self, space, population, objectives, rng, problem):
        return SMSEMOA(space, population, objectives, rng, problem)


class TestNSGA3(OptimiserTests):
    objectives = (2, 3)

    def create(self, space, population, objectives, rng, problem):
        return NSGA3(space, population, objectives, rng, problem)


class TestSPEA2(OptimiserTests):
    objectives = (2, 3)

    def create(self, space, population, objectives, rng, problem):
        return SPEA2(space, population, objectives, rng, problem)


class TestMOEAD(OptimiserTests):
    objectives = (2, 3)

    def create(self, space, population, objectives, rng, problem):
        return MOEAD(space, population, objectives, rng, problem)


class TestRandomSearch(OptimiserTests):
    def create(self, space, population, objectives, rng):
        return RandomSearch(space, population, objectives, rng)


# ---- what they find --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("search", SEARCHES)
def test_its_front_is_better_than_that_of_chance(search) -> None:
    """In as many evaluations, by what all that was tried leaves of the hypervolume; the best front leaves 10.7."""
    found = evolve(make(search), 40)
    chance = evolve(RandomSearch(SPACE, 20, 2, np.random.Generator(np.random.PCG64(1))), 40)
    left, left_by_chance = (40.0**2 - moocore.hypervolume(points, ref=[40.0, 40.0]) for points in (found, chance))
    assert left < 0.8 * left_by_chance


@pytest.mark.parametrize("search", SEARCHES)
def test_genomes_keep_to_their_bounds(search) -> None:
    optimiser = make(search, reach=3.0)
    for _ in range(10):
        genomes = optimiser.ask()
        assert genomes[:, :8].min() >= -3
        assert genomes[:, :8].max() <= 3
        assert genomes[:, 8:].min() >= 0
        assert genomes[:, 8:].max() <= 1
        optimiser.tell(genomes, costs_of(genomes))


def test_more_may_be_better() -> None:
    """A cost of an objective to be maximised is its negative: of its best value it is a share of 0."""
    rng = np.random.Generator(np.random.PCG64(1))
    goals = Problem((Objective("gain", "maximise", (-1.0, 3.0)), Objective("size", "minimise", (1.0, 5.0))))
    optimiser = NSGA2(SPACE, 4, 2, rng, goals)
    genomes = optimiser.ask()
    optimiser.tell(genomes, np.array([[-3.0, 1.0], [1.0, 5.0], [-1.0, 3.0], [-3.0, 5.0]]))
    assert optimiser.state()["told"].tolist() == [[0, 0], [1, 1], [0.5, 0.5], [0, 1]]


def test_it_begins_from_given_genomes() -> None:
    given = np.linspace(0.1, 0.9, 36).reshape(3, 12)
    optimiser = make(population=5)
    optimiser.start_from(given)
    genomes = optimiser.ask()
    assert (genomes[:3] == given).all()
    assert len(genomes) == 5


# ---- its state -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("search", SEARCHES)
@pytest.mark.parametrize("objectives", [2, 3])
def test_a_search_goes_on_to_the_same_bits(search, objectives) -> None:
    whole, cut = make(search, objectives), make(search, objectives)
    evolve(whole, 4, objectives)
    evolve(cut, 4, objectives)
    fresh = make(search, objectives, seed=99)
    fresh.restore(decode_state(encode_state(cut.state())))
    assert np.array_equal(evolve(whole, 5, objectives), evolve(fresh, 5, objectives))


def test_a_search_of_another_version_of_the_library_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    state = make().state()
    monkeypatch.setattr(replayed, "version", lambda _: "0.0")
    with pytest.raises(ValueError, match=r"expected pymoo .*, with which the run was begun, got 0\.0; install that"):
        make().restore(state)


@pytest.mark.parametrize(
    ("search", "objectives", "population", "options", "message"),
    [
        (NSGA2, 2, 20, {"reach": 0}, "reach: expected a number above 0, got 0"),
        (NSGA2, 2, 20, {"reach": float("nan")}, "reach: expected a number above 0, got nan"),
        (SMSEMOA, 1, 20, {}, "objectives: expected at least 2, got 1"),
        (NSGA3, 1, 20, {}, "objectives: expected at least 2, got 1"),
        (SPEA2, 1, 20, {}, "objectives: expected at least 2, got 1"),
        (MOEAD, 1, 20, {}, "objectives: expected at least 2, got 1"),
        (GDE3, 2, 3, {}, "population: expected a number of at least 4, got 3"),
        (NSGA2, 2, 1, {}, "population: expected a number of at least 2, got 1"),
    ],
)
def test_what_is_out_of_range_is_refused(search, objectives, population, options, message) -> None:
    with pytest.raises(ValueError, match=message):
        make(search, objectives, population, **options)

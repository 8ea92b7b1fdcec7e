# SPDX-License-Identifier: BSD-3-Clause
"""COMO-CMA-ES: the conformance kit, what its kernels find, and its state to the bit."""

from __future__ import annotations

import re
from pathlib import Path

import moocore
import numpy as np
import pytest

from swarmevo.evolution.state import decode_state, encode_state
from swarmevo.protocols import Block, GenomeSpace, Objective, Problem
from swarmevo.testing import OptimiserTests
from swarmevo_rivals.como import COMOCMAES
from swarmevo_rivals.random_search import RandomSearch

SPACE = GenomeSpace(
    (Block("weights", (6,)), Block("bounded", (2,), bounds=(0.0, 1.0)), Block("switch", (2,), "switch"))
)
PROBLEM = Problem(tuple(Objective(name, "minimise", (0.0, 40.0)) for name in ("one", "two")))


def make(population=24, seed=1, **options):
    options = {"kernels": 4, **options}
    return COMOCMAES(SPACE, population, 2, np.random.Generator(np.random.PCG64(seed)), PROBLEM, **options)


def costs_of(genomes: np.ndarray) -> np.ndarray:
    """Distances from two places, of which no genome has both."""
    weights = genomes[:, :6]
    return np.stack([((weights - k) ** 2).sum(axis=1) + genomes[:, 6] for k in range(2)], axis=1)


def evolve(optimiser, generations: int) -> np.ndarray:
    told = []
    for _ in range(generations):
        genomes = optimiser.ask()
        told.append(costs_of(genomes))
        optimiser.tell(genomes, told[-1])
    return np.concatenate(told)


class TestConformance(OptimiserTests):
    populations = (5, 23)
    objectives = (2,)

    def create(self, space, population, objectives, rng, problem):
        return COMOCMAES(space, population, objectives, rng, problem)


def test_its_kernels_come_to_the_front() -> None:
    """The front is the line between both places: x = t, where f1 = 6 t^2 and f2 = 6 (1 - t)^2."""
    found = evolve(make(), 60)
    chance = evolve(RandomSearch(SPACE, 24, 2, np.random.Generator(np.random.PCG64(1))), 60)
    t = np.linspace(0, 1, 4)
    four_best = np.stack([6 * t**2, 6 * (1 - t) ** 2], axis=1)
    volumes = [moocore.hypervolume(points, ref=[40.0, 40.0]) for points in (chance, four_best, found)]
    assert sorted(volumes) == volumes  # all that was tried leaves more than four points of the front itself


def test_a_kernel_that_has_converged_is_followed_by_another() -> None:
    """Costs that tell nothing apart end a kernel; the search goes on with random ones."""
    optimiser = make()
    for _ in range(200):
        genomes = optimiser.ask()
        assert len(genomes) >= 20
        optimiser.tell(genomes, np.full((len(genomes), 2), 7.0))
    assert len(optimiser._made.kernels) > 4


def test_a_search_goes_on_to_the_same_bits_past_a_restart() -> None:
    whole, cut = make(), make()
    evolve(whole, 160)
    evolve(cut, 160)
    assert len(whole._made.kernels) > 4
    fresh = make(seed=99)
    fresh.restore(decode_state(encode_state(cut.state())))
    assert np.array_equal(evolve(whole, 5), evolve(fresh, 5))


@pytest.mark.parametrize("library", ["comocma", "cma", "moarchiving"])
def test_a_search_of_another_version_of_a_library_that_it_computes_in_is_refused(library: str) -> None:
    with pytest.raises(ValueError, match=rf"^expected {library} 0\.0, with which the run was begun"):
        make().restore({**make().state(), library: "0.0"})


def test_a_state_of_when_one_library_was_known_is_read() -> None:
    whole = make()
    evolve(whole, 3)
    state = {name: value for name, value in whole.state().items() if name not in ("cma", "moarchiving")}
    assert "comocma" in state
    fresh = make(seed=99)
    fresh.restore(state)
    assert np.array_equal(evolve(whole, 2), evolve(fresh, 2))


def test_it_leaves_the_global_generator_and_the_folder_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The library draws from NumPy's global generator and writes logs, unless it is told otherwise."""
    monkeypatch.chdir(tmp_path)
    before = np.random.get_state()[1].copy()
    evolve(make(), 5)
    assert np.array_equal(np.random.get_state()[1], before)
    assert not list(tmp_path.iterdir())


def test_it_begins_from_given_genomes() -> None:
    given = np.linspace(0.1, 0.9, 20).reshape(2, 10)
    optimiser = make()
    optimiser.start_from(given)
    assert optimiser.ask()[:2] == pytest.approx(given)


@pytest.mark.parametrize(
    ("population", "options", "message"),
    [
        (24, {"kernels": 0}, "kernels: expected a whole number of at least 1, got 0"),
        (24, {"sigma": -1}, "sigma: expected a number above 0, got -1"),
        (19, {}, "population: expected a number of at least 20 for 4 kernels, got 19"),
    ],
)
def test_wrong_options_are_one_clear_line(population, options, message) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        make(population, **options)


def test_three_objectives_are_refused() -> None:
    with pytest.raises(ValueError, match=r"^objectives: expected two, for which the library is made, got 3$"):
        COMOCMAES(SPACE, 24, 3, np.random.default_rng(1), PROBLEM)

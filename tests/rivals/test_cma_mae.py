# SPDX-License-Identifier: BSD-3-Clause
"""CMA-MAE: the conformance kit, what it puts on the map, and its state to the bit."""

from __future__ import annotations

import builtins
import re

import numpy as np
import pytest

from swarmevo.evolution.state import decode_state, encode_state
from swarmevo.protocols import Block, Descriptor, GenomeSpace, Objective, Problem
from swarmevo.testing import OptimiserTests
from swarmevo_rivals.cma_mae import CMAMAE
from swarmevo_rivals.random_search import RandomSearch

SPACE = GenomeSpace(
    (Block("weights", (8,)), Block("bounded", (2,), bounds=(0.0, 1.0)), Block("switch", (2,), "switch"))
)
PROBLEM = Problem(
    (Objective("one", "minimise", (0.0, 40.0)), Objective("two", "maximise", (0.0, 40.0))),
    (Descriptor("x", (-3.0, 3.0)), Descriptor("y", (-3.0, 3.0))),
)


def make(population=24, seed=1, **options):
    return CMAMAE(SPACE, population, 2, np.random.Generator(np.random.PCG64(seed)), PROBLEM, **options)


def behave(genomes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance from the middle and its negative, and two genes, squeezed, as descriptors."""
    distance = np.minimum((genomes[:, :8] ** 2).sum(axis=1), 40)
    return np.stack([distance, -distance], axis=1), 3 * np.tanh(genomes[:, :2] / 6)


def evolve(optimiser, generations: int) -> dict[tuple[int, int], float]:
    """Return the least cost that came to each cell of a map of 10 by 10."""
    cells: dict[tuple[int, int], float] = {}
    for _ in range(generations):
        genomes = optimiser.ask()
        costs, descriptors = behave(genomes)
        optimiser.tell(genomes, costs, descriptors)
        for cost, place in zip(costs[:, 0], np.minimum((descriptors + 3) / 0.6, 9).astype(int), strict=True):
            cells[tuple(place)] = min(cells.get(tuple(place), 40.0), cost)
    return cells


class Chance(RandomSearch):
    """Random search, which may be told descriptors."""

    def __init__(self):
        super().__init__(SPACE, 24, 2, np.random.default_rng(1))

    def tell(self, genomes, costs, descriptors):
        pass


class TestConformance(OptimiserTests):
    populations = (4, 23)
    objectives = (1,)
    descriptors = (2,)

    def create(self, space, population, objectives, rng, problem):
        return CMAMAE(space, population, objectives, rng, problem, cells=4)


def test_its_map_is_better_than_that_of_chance() -> None:
    """By the sum over the cells of how far below the worst each is: the QD score."""
    found, by_chance = (sum(40 - cost for cost in evolve(made, 60).values()) for made in (make(), Chance()))
    assert found > 1.2 * by_chance


def test_the_chosen_objective_is_made_better() -> None:
    """The second is better the farther a genome is."""
    near, far = (np.mean(list(evolve(make(objective=name), 60).values())) for name in ("one", "two"))
    assert far > 2 * near


def test_what_failed_changes_no_threshold() -> None:
    optimiser = make(emitters=1)
    genomes = optimiser.ask()
    costs, descriptors = behave(genomes)
    descriptors[::2] = np.nan
    optimiser.tell(genomes, costs, descriptors)
    assert len(optimiser._made.archive) == len(
        {tuple(np.minimum((d + 3) / 0.6, 9).astype(int)) for d in descriptors[1::2]}
    )


def test_a_search_goes_on_to_the_same_bits() -> None:
    whole, cut = make(), make()
    whole.start_from(np.full((2, 12), 0.3))
    cut.start_from(np.full((2, 12), 0.3))
    evolve(whole, 20)
    evolve(cut, 20)
    fresh = make(seed=99)
    fresh.restore(decode_state(encode_state(cut.state())))
    for _ in range(3):
        genomes = whole.ask()
        assert np.array_equal(genomes, fresh.ask())
        for optimiser in (whole, fresh):
            optimiser.tell(genomes, *behave(genomes))


def test_a_search_that_nobody_helps_goes_on_past_restarts_to_the_same_bits() -> None:
    """Costs at the worst end put nobody on the map, and tell nothing apart, so that all emitters restart."""

    def tell(optimiser, worst: bool) -> np.ndarray:
        genomes = optimiser.ask()
        costs, descriptors = behave(genomes)
        optimiser.tell(genomes, np.full_like(costs, 40.0) if worst else costs, descriptors)
        return genomes

    whole, cut = make(), make()
    asked = [tell(whole, worst=True) for _ in range(3)]
    assert whole._made.archive.empty
    assert [emitter.restarts for emitter in whole._made.emitters] == [3, 3]
    assert abs(asked[2]).max() < 10  # about where it began
    assert not np.array_equal(asked[1], asked[2])
    for generation in range(6):
        fresh = make(seed=99)
        fresh.restore(decode_state(encode_state(cut.state())))
        cut = fresh
        genomes = tell(cut, worst=generation < 3)
        assert np.array_equal(genomes, asked[generation] if generation < 3 else tell(whole, worst=False))
    assert not whole._made.archive.empty


def test_it_begins_about_the_mean_of_given_genomes() -> None:
    optimiser = make(sigma=0.001)
    optimiser.start_from(np.stack([np.full(12, 0.2), np.full(12, 0.4)]))
    assert optimiser.ask() == pytest.approx(np.full((24, 12), 0.3), abs=0.01)


@pytest.mark.parametrize(
    ("population", "options", "message"),
    [
        (24, {"cells": 0}, "cells: expected a whole number of at least 1, up to 1000000 in all, got 0"),
        (24, {"emitters": 0}, "emitters: expected a whole number of at least 1, got 0"),
        (24, {"sigma": 0}, "sigma: expected a number above 0, got 0"),
        (24, {"learning_rate": 1.5}, "learning_rate: expected a number from 0 to 1, got 1.5"),
        (24, {"objective": "three"}, "objective: expected one of one, two, got 'three'"),
        (11, {"emitters": 3}, "population: expected a number of at least 12 for 3 emitters, got 11"),
    ],
)
def test_wrong_options_are_one_clear_line(population, options, message) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        make(population=population, **options)


def test_a_missing_library_is_one_clear_line(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(name, *args, **kwargs):
        if name.startswith("ribs"):
            raise ImportError("No module named 'ribs'")
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ImportError, match=r"^cma_mae needs pyribs: pip install 'swarmevo-rivals\[ribs\]'"):
        make()

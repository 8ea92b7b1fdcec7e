# SPDX-License-Identifier: BSD-3-Clause
"""MAP-Elites: the conformance kit, what its map holds, and runs to the same bits."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import toy_plugins
from swarmevo import plugins
from swarmevo.errors import PluginError
from swarmevo.protocols import Block, Descriptor, GenomeSpace, Objective, Problem
from swarmevo.runs import driver, verification
from swarmevo.runs.store import Store
from swarmevo.testing import OptimiserTests
from swarmevo_rivals.map_elites import MapElites
from swarmevo_rivals.random_search import RandomSearch

SPACE = GenomeSpace((Block("weights", (3,)), Block("switches", (2,), "switch")))
PROBLEM = Problem(
    (Objective("one", "minimise", (0.0, 9.0)), Objective("two", "minimise", (0.0, 9.0))),
    (Descriptor("x", (-1.0, 1.0)), Descriptor("y", (0.0, 4.0))),
)


def make(population=20, seed=1, **options):
    return MapElites(SPACE, population, 2, np.random.default_rng(seed), PROBLEM, **options)


class TestConformance(OptimiserTests):
    descriptors = (1, 2)

    def create(self, space, population, objectives, rng, problem):
        return MapElites(space, population, objectives, rng, problem, cells=4)


def told(made, costs, descriptors):
    """Tell the first of the genomes asked for; return them."""
    genomes = made.ask()[: len(costs)]
    made.tell(genomes, np.array(costs, dtype=float), np.array(descriptors, dtype=float))
    return genomes


def elites(made):
    """Return the genome in each cell, by the number of the cell."""
    state = made.state()
    return {int(place): genome.tolist() for place, genome in zip(state["places"], state["genomes"], strict=True)}


def test_each_cell_keeps_the_best_by_one_objective():
    """Cells are numbered along y first; what lies on the far end is in the last cell."""
    made = make(cells=2)
    genomes = told(made, [[3, 0], [2, 9], [5, 5], [1, 1]], [[-1, 0], [-0.1, 1.9], [1, 4], [0, 0]]).tolist()
    assert elites(made) == {0: genomes[1], 3: genomes[2], 2: genomes[3]}
    made = make(cells=2, objective="two")
    genomes = told(made, [[3, 0], [2, 9], [5, 5], [1, 1]], [[-1, 0], [-0.1, 1.9], [1, 4], [0, 0]]).tolist()
    assert elites(made) == {0: genomes[0], 3: genomes[2], 2: genomes[3]}


def test_an_elite_stays_until_a_better_one_comes():
    made = make(cells=1)
    (first,) = told(made, [[2, 0]], [[0, 0]]).tolist()
    told(made, [[2, 0], [3, 0]], [[0, 0], [0, 0]])
    assert elites(made) == {0: first}
    better = told(made, [[2.5, 0], [1, 0]], [[0, 0], [0, 0]])[1].tolist()
    assert elites(made) == {0: better}


def test_what_failed_is_no_elite():
    made = make(cells=2)
    told(made, [[0, 0], [5, 5]], [[np.nan, np.nan], [1, 4]])
    assert list(elites(made)) == [3]


def test_it_begins_from_given_genomes():
    made = make(population=4)
    given = np.arange(10.0).reshape(2, 5)
    made.start_from(given)
    asked = made.ask()
    assert asked[:2].tolist() == given.tolist()
    assert len(asked) == 4


def test_it_fills_a_map_better_than_random_search():
    """Behaviours are two of the genes squeezed to their ranges; the third is to be 0."""

    def behave(genomes):
        described = np.column_stack([np.tanh(genomes[:, 0] / 4), 2 + 2 * np.tanh(genomes[:, 1] / 4)])
        return np.abs(genomes[:, 2:3]) * [1, 1], described

    made, random, chance = make(cells=10), make(cells=10), RandomSearch(SPACE, 20, 2, np.random.default_rng(1))
    for _ in range(100):
        genomes = made.ask()
        made.tell(genomes, *behave(genomes))
        genomes = chance.ask()
        random.tell(genomes, *behave(genomes))
    filled, by_chance = len(elites(made)), len(elites(random))
    assert filled > 1.5 * by_chance
    assert made.state()["costs"].mean() < 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"cells": 0}, "cells: expected a whole number of at least 1, up to 1000000 in all, got 0"),
        ({"cells": 1001}, "cells: expected a whole number of at least 1, up to 1000000 in all, got 1001"),
        ({"iso": -0.1}, "iso: expected a number of at least 0, got -0.1"),
        ({"line": float("nan")}, "line: expected a number of at least 0, got nan"),
        ({"flips": 1.5}, "flips: expected a number from 0 to 1, got 1.5"),
        ({"objective": "three"}, "objective: expected one of one, two, got 'three'"),
    ],
)
def test_wrong_options_are_one_clear_line(options, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        make(**options)


# ---- runs ------------------------------------------------------------------------------------------------------------


@pytest.fixture
def _toys(distribution: Any) -> None:
    toy_plugins.install(distribution)


def settings(*fitness: str) -> Any:
    return toy_plugins.config(optimiser="map_elites", fitness=list(fitness), evolution={"generations": 4})


@pytest.mark.usefixtures("_toys")
def test_a_run_that_was_cut_short_has_the_same_bits(tmp_path: Path) -> None:
    class Enough(Exception):  # noqa: N818 - no error
        pass

    def leave(now: Any) -> None:
        raise Enough

    def content(folder: Path) -> list[Any]:
        with Store.open(folder) as store:
            kept = [store.generation(trial, number) for trial in (0, 1) for number in range(store.generations(trial))]
            return [(one.genomes.tobytes(), one.episodes["descriptor"].tobytes()) for one in kept]

    for name in ("whole", "cut"):
        driver.begin(tmp_path / name, settings("toy_travel", "toy_places"))
    with Store.open(tmp_path / "whole", readonly=False) as store:
        driver.evolve(store, 2, lambda now: None)
        assert verification.verify(store, 1).is_sound
    for _ in range(3):
        with Store.open(tmp_path / "cut", readonly=False) as store, pytest.raises(Enough):
            driver.evolve(store, 1, leave)
    with Store.open(tmp_path / "cut", readonly=False) as store:
        driver.evolve(store, 1, lambda now: None)
    assert len(content(tmp_path / "whole")) == 8
    assert content(tmp_path / "cut") == content(tmp_path / "whole")


@pytest.mark.usefixtures("_toys")
def test_without_descriptors_it_says_what_to_do() -> None:
    (error,) = plugins.option_errors(settings("toy_travel"))
    assert error.startswith(
        "optimiser.map_elites: problem: expected a fitness that has descriptors, got none; choose one"
    )


def test_it_is_a_plugin() -> None:
    assert plugins.find("optimiser", "map_elites").distribution == "swarmevo-rivals"
    (report,) = plugins.check("map_elites")
    assert report.error is None
    with pytest.raises(PluginError, match="unknown option"):
        plugins.create("optimiser", "map_elites", {"cell": 3}, SPACE, 4, 2, np.random.default_rng(0), problem=PROBLEM)

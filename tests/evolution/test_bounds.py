# SPDX-License-Identifier: BSD-3-Clause
"""Genes with bounds: a controller says them, optimisers keep to them, and the host refuses what is out of them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import toy_plugins
from swarmevo import returned
from swarmevo.config import Config
from swarmevo.errors import PluginError
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.evolution.optimiser import CheckedOptimiser
from swarmevo.protocols import Block, GenomeSpace, SceneInfo
from swarmevo.testing import CHROMOSOME, random_genomes

SPACE = GenomeSpace(
    (Block("weights", (2,)), Block("delays", (3,), bounds=(0.5, 4.0)), Block("gain", (1,), bounds=(0, np.inf)))
)


class Bounded(toy_plugins.Linear):
    """A controller whose weights are from 0 to 1."""

    def space(self, scene: SceneInfo) -> GenomeSpace:
        return GenomeSpace((Block("weights", (2, 13), bounds=(0.0, 1.0)), Block("bias", (2,))))


@pytest.fixture
def evaluator(distribution: Any) -> Iterator[Evaluator]:
    toy_plugins.install(distribution)
    distribution("bounded", "1.0", {"swarmevo.controllers": {"bounded": f"{__name__}:Bounded"}})
    with Evaluator(config("toy_search"), 1) as made:
        yield made


def config(optimiser: str) -> Config:
    return toy_plugins.config(controller="bounded", optimiser=optimiser)


def test_a_space_tells_the_bounds_of_each_gene() -> None:
    inf = np.inf
    assert SPACE.bounds.tolist() == [[-inf, -inf, 0.5, 0.5, 0.5, 0], [inf, inf, 4, 4, 4, inf]]
    assert SPACE.tile(2).bounds.tolist() == np.tile(SPACE.bounds, 2).tolist()
    assert np.isinf(CHROMOSOME.bounds).all()


def test_random_genomes_are_within_bounds_and_the_others_as_ever() -> None:
    genomes = random_genomes(SPACE, 500)
    returned.check_bounds(genomes, SPACE)
    between = genomes[:, 2:5]
    assert between.min() < 0.6 < 3.9 < between.max()
    alone = random_genomes(GenomeSpace((Block("weights", (6,)),)), 500)
    assert np.array_equal(genomes[:, :2], alone[:, :2])


@pytest.mark.parametrize(
    ("block", "got"),
    [
        (Block("gain", (1,), bounds=(1.0, 1.0)), r"got \(1\.0, 1\.0\)"),
        (Block("gain", (1,), bounds=(0.0, np.nan)), r"got \(0\.0, nan\)"),
        (Block("gain", (1,), bounds=("0", "1")), r"got \('0', '1'\)"),  # type: ignore[arg-type]
        (Block("gain", (1,), bounds=1.0), r"got 1\.0"),  # type: ignore[arg-type]
        (Block("on", (1,), "switch", bounds=(0.0, 1.0)), r"got \(0\.0, 1\.0\) of switches"),
    ],
)
def test_wrong_bounds_are_one_clear_line(block: Block, got: str) -> None:
    message = rf"^block {block.name}: expected as bounds of real genes two numbers, low and high, or None, {got}$"
    with pytest.raises(ValueError, match=message):
        returned.space(GenomeSpace((block,)))


def test_an_optimiser_that_leaves_the_bounds_is_named(evaluator: Evaluator) -> None:
    optimiser = CheckedOptimiser(config("toy_search"), evaluator, trial=0)
    message = (
        r"^optimiser\.toy_search \(toys 1\.0\): ask, trial 0, generation 0: expected genes within the controller's "
        r"bounds, got -\d.* in genome 0, gene \d+, which is from 0 to 1; repair the plugin"
    )
    with pytest.raises(PluginError, match=message):
        optimiser.ask(0)


@pytest.mark.parametrize("name", ["pde", "cma"])
def test_ours_keep_to_bounds_and_use_all_between(evaluator: Evaluator, name: str) -> None:
    optimiser = CheckedOptimiser(config(name), evaluator, trial=0)
    seen = []
    for generation in range(12):
        genomes = optimiser.ask(generation)
        seen.append(genomes[:, :26])
        costs = np.column_stack([np.square(genomes[:, :26] - 0.75).sum(axis=1)] * 3)
        optimiser.tell(generation, genomes, costs, np.empty((len(genomes), 0)))
    assert seen[0].min() < 0.2 < 0.8 < seen[0].max()
    assert len(np.unique(np.concatenate(seen))) > 100


def test_given_genomes_out_of_bounds_are_refused(evaluator: Evaluator) -> None:
    optimiser = CheckedOptimiser(config("pde"), evaluator, trial=0)
    given = np.full((2, 28), 0.5)
    given[1, 3] = 1.5
    message = (
        r"start_from: expected genes within the controller's bounds, got 1\.5 in genome 1, gene 3, which is from 0"
    )
    with pytest.raises(PluginError, match=message):
        optimiser.start_from(given)

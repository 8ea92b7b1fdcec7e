# SPDX-License-Identifier: BSD-3-Clause
"""The course of a trial, taken in pieces as it comes, against what a run that is read at once tells."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import grids
from swarmevo import config
from swarmevo.analysis import course, dominance, fronts
from swarmevo.analysis.course import Course
from swarmevo.config import Config
from swarmevo.evolution.results import Generation
from swarmevo.protocols import FloatArray, Objective
from swarmevo.runs.store import Store

OBJECTIVES = [Objective("score", "maximise", (0.0, 1.0)), Objective("neurons", "minimise", (0.0, 15.0))]
GENERATIONS, INDIVIDUALS = 24, 6


@pytest.fixture(scope="module", params=[1, 5], ids=["one episode is enough", "five are needed"])
def store(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A run of which half of each generation was evaluated before, often those on the front."""
    evolution = {"generations": GENERATIONS, "population": INDIVIDUALS, "trials": 1, "least_episodes": request.param}
    settings = Config.model_validate({"team": {"robots": 1}, "evolution": evolution})
    folder, rng = tmp_path_factory.mktemp("runs") / "run", np.random.default_rng(2)
    with Store.create(folder, config.dump(settings), {}, OBJECTIVES, 1, 5) as run:
        known = [0.0]
        for number in range(GENERATIONS):
            genes = [*(len(known) + i for i in range(INDIVIDUALS // 2)), *rng.choice(known[-20:], INDIVIDUALS // 2)]
            known += genes
            run.append(0, number, generation(genes, rng), "{}")
        yield run


def generation(genes: Sequence[float], rng: np.random.Generator) -> Generation:
    shape = len(genes), 2
    objective = np.stack([rng.random(shape), np.broadcast_to(rng.integers(4, size=(len(genes), 1)), shape)], axis=-1)
    return Generation(np.array(genes)[:, np.newaxis], grids.scored(objective))


@pytest.mark.parametrize("piece", [1, 5])
def test_a_course_in_pieces_is_the_whole(store: Store, piece: int) -> None:
    summaries, found = list(store.summaries(0)), Course(store.objectives, store.over_worlds, store.config.evolution)
    steps = [step for i in range(0, GENERATIONS, piece) for step in found.add(summaries[i : i + piece])]
    assert steps == course.history(store, 0)
    front = fronts.front(store, 0)
    assert [(one.genome, one.first_generation, one.last_generation, one.episodes) for one in found.front] == [
        (one.genome, one.first_generation, one.last_generation, one.episodes) for one in front
    ]
    np.testing.assert_allclose([one.values for one in found.front], [list(one.objectives.values()) for one in front])


def test_a_generation_more_looks_once_at_all_that_are_there(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    summaries, found = list(store.summaries(0)), Course(store.objectives, store.over_worlds, store.config.evolution)
    found.add(summaries[:-1])
    compared: list[int] = []

    def counted(points: FloatArray, **options: Any) -> Any:
        compared.append(len(points))
        return is_nondominated(points, **options)

    is_nondominated = dominance.moocore.is_nondominated
    monkeypatch.setattr(dominance.moocore, "is_nondominated", counted)
    found.add(summaries[-1:])
    assert sorted(compared)[-2] < 30 < store.totals().genomes

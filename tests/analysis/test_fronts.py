# SPDX-License-Identifier: BSD-3-Clause
"""Fronts, hypervolume, cost and forecast, against numbers worked out by hand."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import grids
from swarmevo import config
from swarmevo.analysis import dominance, fronts
from swarmevo.analysis.measures import measures_of
from swarmevo.config import Config
from swarmevo.evolution.results import Generation
from swarmevo.protocols import Block, FloatArray, GenomeSpace, Objective
from swarmevo.runs.store import Store

SCORE = Objective("score", "maximise", (0.0, 100.0))
NEURONS = Objective("neurons", "minimise", (0.0, 15.0))
ROBOTS = 2

SETTINGS = Config.model_validate(
    {
        "episode": {"horizon": 10.0},
        "team": {"robots": ROBOTS},
        "evolution": {"generations": 2, "population": 3, "trials": 2, "repeats": 2, "seed": 5},
    }
)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with Store.create(tmp_path / "run", config.dump(SETTINGS), {}, [SCORE, NEURONS], ROBOTS, 5) as store:
        yield store


def append(store: Store, trial: int, individuals: Sequence[tuple[float, Sequence[float], float]]) -> None:
    """Store a generation: for each individual its one gene, the scores of its episodes and its neurons.

    In an episode with a score above 0 the box is pushed after 4 s and the first robot is home after 2 s.
    """
    scores = np.array([scores for _, scores, _ in individuals], dtype=float)
    neurons = np.broadcast_to(np.array([[neurons] for _, _, neurons in individuals]), scores.shape)
    homing = np.full((*scores.shape, ROBOTS), np.nan)
    homing[..., 0] = np.where(scores > 0, 2.0, np.nan)
    genomes = np.array([[gene] for gene, _, _ in individuals], dtype=float)
    episodes = grids.results(
        objective=np.stack([scores, neurons], axis=-1),
        hash=np.zeros(scores.shape, dtype=np.uint64),
        push_time=np.where(scores > 0, 4.0, np.nan),
        homing_time=homing,
        ode_messages=np.ones(scores.shape, dtype=np.uint32),
        unsolved_steps=np.zeros(scores.shape, dtype=np.uint32),
        seconds=0.5,
    )
    store.append(trial, store.generations(trial), Generation(genomes, episodes), "{}")


def gene(store: Store, point: fronts.FrontPoint) -> float:
    return float(store.genome(point.genome)[0])


# ---- fronts ----------------------------------------------------------------------------------------------------------


def test_the_front_holds_the_non_dominated_best_score_first(store: Store) -> None:
    append(store, 0, [(1, [2, 4], 1), (2, [10, 30], 5), (3, [2, 2], 1), (4, [19, 19], 6)])
    found = fronts.front(store, 0)
    assert [gene(store, point) for point in found] == [2, 1]
    assert found[0].objectives == {"score": 20.0, "neurons": 5.0}


def test_individuals_are_judged_by_all_their_episodes(store: Store) -> None:
    append(store, 0, [(1, [50, 50], 5), (2, [20, 20], 5)])
    append(store, 0, [(1, [0, 0], 5), (2, [40, 40], 5)])
    (best,) = fronts.front(store, 0)
    assert gene(store, best) == 2
    assert best.objectives["score"] == 30
    assert (best.episodes, best.first_generation, best.last_generation) == (4, 0, 1)


def test_one_represents_all_with_the_same_objectives(store: Store) -> None:
    append(store, 0, [(1, [3, 5], 1), (2, [4, 4], 1), (3, [0, 8], 1)])
    assert len(fronts.front(store, 0)) == 1


def test_the_front_over_all_trials(store: Store) -> None:
    append(store, 0, [(1, [10, 10], 3)])
    append(store, 1, [(2, [20, 20], 3), (3, [5, 5], 1)])
    assert [(point.trial, gene(store, point)) for point in fronts.front(store)] == [(1, 2), (1, 3)]
    assert [gene(store, point) for point in fronts.front(store, 0)] == [1]


def test_rates_and_times(store: Store) -> None:
    append(store, 0, [(1, [10, 0], 3)])
    (point,) = fronts.front(store, 0)
    assert (point.homing_rate, point.homing_time) == (0.25, 2.0)  # one of two robots in one of two episodes
    assert (point.push_rate, point.push_time) == (0.5, 4.0)


def test_what_never_happened_has_no_time(store: Store) -> None:
    append(store, 0, [(1, [0, 0], 3)])
    (point,) = fronts.front(store, 0)
    assert (point.homing_time, point.push_time) == (None, None)


def test_an_empty_run_has_an_empty_front(store: Store) -> None:
    assert fronts.front(store) == []
    assert fronts.summarise(store).trials == []


# ---- hypervolume -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("points", "volume"),
    [
        ([[10, 5]], 10 * 10),
        ([[10, 5], [4, 1]], 10 * 10 + 4 * 4),
        ([[10, 5], [4, 6]], 10 * 10),
        ([[0, 0], [100, 15]], 0),
        ([[100, 0]], 100 * 15),
    ],
)
def test_hypervolume_is_measured_from_the_worse_ends(points: list[list[float]], volume: float) -> None:
    assert fronts.hypervolume([SCORE, NEURONS], np.array(points, dtype=float)) == pytest.approx(volume)


def test_history_is_judged_by_what_was_known_then(store: Store) -> None:
    append(store, 0, [(1, [10, 10], 5)])
    append(store, 0, [(1, [0, 0], 5), (2, [4, 4], 1)])
    first, second = fronts.history(store, 0)
    assert (first.hypervolume, first.front_size, first.best) == (100, 1, {"score": 10, "neurons": 5})
    assert (second.hypervolume, second.front_size, second.best) == (5 * 10 + 4 * 4, 2, {"score": 5, "neurons": 1})


def test_history_ends_at_the_front(store: Store) -> None:
    rng = np.random.default_rng(0)
    for _ in range(5):
        append(store, 0, [(g, rng.random(2) * 50, rng.integers(0, 15)) for g in rng.integers(0, 9, 6)])
    front = fronts.front(store, 0)
    last = fronts.history(store, 0)[-1]
    points = np.array([list(point.objectives.values()) for point in front])
    assert last.front_size == len(front)
    assert last.hypervolume == pytest.approx(fronts.hypervolume(store.objectives, points))


# ---- the run as a whole ----------------------------------------------------------------------------------------------


@pytest.fixture
def long(store: Store) -> Store:
    """A run of 40 generations of 8, half of them evaluated again in a later one, or in the same."""
    rng = np.random.default_rng(3)
    known = [0.0]
    for _ in range(40):
        genes = [*(1.0 + len(known) + i for i in range(4)), *rng.choice(known[-30:], 4)]
        known += genes
        append(store, 0, [(gene, rng.random(2).round(2), float(rng.integers(4))) for gene in genes])
    return store


def test_history_is_that_of_all_individuals_so_far(long: Store) -> None:
    """Case 64: though most of them are not looked at again."""
    seen: dict[int, list[FloatArray]] = {}
    for summary, step in zip(long.summaries(0), fronts.history(long, 0), strict=True):
        for genome, values in zip(summary.genomes.tolist(), summary.means[:, 0], strict=True):
            seen.setdefault(genome, []).append(values)
        means = np.array([np.sum(values, axis=0) / len(values) for values in seen.values()])
        points = means[dominance.places(long.objectives, means)]
        assert step.front_size == len(points)
        assert step.hypervolume == pytest.approx(fronts.hypervolume(long.objectives, points), rel=1e-12)
        assert step.best == pytest.approx({"score": points[:, 0].max(), "neurons": points[:, 1].min()}, rel=1e-12)


def test_history_does_not_compare_all_with_all(long: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 64: else it is quadratic in the number of generations."""
    compared = []
    is_nondominated = dominance.moocore.is_nondominated

    def counted(points: FloatArray, **options: Any) -> Any:
        compared.append(len(points))
        return is_nondominated(points, **options)

    monkeypatch.setattr(dominance.moocore, "is_nondominated", counted)
    fronts.history(long, 0)
    assert long.totals().genomes > 150
    assert max(compared) < 60  # the front, and those that are met again


def test_summary_and_cost(store: Store) -> None:
    for trial in range(2):
        append(store, trial, [(1, [1, 2], 3), (2, [0, 0], 4)])
        append(store, trial, [(1, [1, 2], 3), (3, [0, 0], 4)])
        assert fronts.summarise(store).complete == (trial == 1)
    summary = fronts.summarise(store)
    assert (summary.seed, summary.trials_planned, summary.generations_planned) == (5, 2, 2)
    assert [trial.trial for trial in summary.trials] == [0, 1]
    cost = summary.cost
    assert (cost.generations, cost.individuals, cost.genomes, cost.episodes) == (4, 8, 3, 16)
    assert (cost.simulated_seconds, cost.seconds, cost.ode_messages) == (16.0, 2.0, 16)  # of ten steps each
    assert fronts.generations(store) == (4, 4)


# ---- forecast --------------------------------------------------------------------------------------------------------


class FakeEvaluator:
    """Takes a tenth of a second for each genome."""

    space = GenomeSpace((Block("weights", (3,)), Block("switches", (2,), "switch")))

    def __init__(self) -> None:
        self.tried: list[FloatArray] = []

    def evaluate(self, genomes: FloatArray, trial: int, generation: int) -> Any:
        self.tried.append(genomes)
        return SimpleNamespace(seconds=0.1 * len(genomes))


def test_forecast() -> None:
    evaluator: Any = FakeEvaluator()
    found = fronts.forecast(SETTINGS, evaluator, workers=3)
    assert found.episodes == 2 * 2 * 3 * 2  # trials, generations, population, repeats
    assert found.simulated_seconds == 240
    assert found.episodes_per_second == pytest.approx(20)
    assert found.wall_seconds == pytest.approx(1.2)
    assert len(evaluator.tried[-1]) == SETTINGS.evolution.population  # no more than a generation has
    assert set(np.unique(evaluator.tried[-1][:, 3:])) <= {0.0, 1.0}


def test_the_most_successful_is_who_pushes_most_surely(store: Store) -> None:
    """Neither the first of the front, which was lucky once, nor who has few episodes of which each was a success."""
    measures = measures_of(store.config, store.objectives)
    append(store, 0, [(1.0, [90.0, 0.0], 3.0), (2.0, [20.0, 10.0], 2.0), (3.0, [0.0, 0.0], 0.0)])
    points = fronts.front(store)
    assert [(point.genome, point.push_rate) for point in points] == [(1, 0.5), (2, 1.0), (3, 0.0)]
    assert fronts.most_successful(points, measures).genome == 2
    append(store, 0, [(1.0, [90.0] * 20, 3.0)])
    points = fronts.front(store)
    assert [round(point.push_rate, 2) for point in points[:2]] == [0.95, 1.0]
    assert fronts.most_successful(points, measures).genome == 1


def test_equally_successful_ones_are_in_the_front_s_order(store: Store) -> None:
    append(store, 0, [(1.0, [0.0, 0.0], 3.0), (2.0, [0.0, 0.0], 1.0)])
    points = fronts.front(store)
    assert fronts.most_successful(points, measures_of(store.config, store.objectives)) == points[0]

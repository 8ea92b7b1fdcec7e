# SPDX-License-Identifier: BSD-3-Clause
"""How good controllers are by tests that did not choose them: no front is called better for its size."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from swarmevo.analysis import fronts, halves
from swarmevo.analysis.significance import mann_whitney
from swarmevo.protocols import Objective

GAIN = Objective("gain", "maximise", (-1.0, 3.0))
SIZE = Objective("size", "minimise", (0.0, 4.0))
TIME = Objective("time", "minimise", (10.0, 20.0))
SPEED = Objective("speed", "maximise", (0.0, 0.5))


@pytest.mark.parametrize(
    ("objectives", "error"),
    [([GAIN], 1e-12), ([GAIN, SIZE], 1e-5), ([GAIN, SIZE, TIME], 5e-3), ([GAIN, SIZE, TIME, SPEED], 1e-2)],
    ids=["one objective", "two", "three", "four"],
)
@pytest.mark.parametrize("controllers", [1, 2, 30])
def test_where_nothing_is_left_to_luck_it_is_the_hypervolume(
    objectives: list[Objective], error: float, controllers: int
) -> None:
    """Held against moocore's."""
    rng = np.random.default_rng(controllers)
    points = np.stack([rng.uniform(*one.range, size=controllers) for one in objectives], axis=1)
    exact = fronts.hypervolume(objectives, points) / fronts.volume(objectives)
    for repeats in (1, 2, 5):
        tests = np.repeat(points[:, np.newaxis], repeats, axis=1)
        assert halves.hypervolume(objectives, points, tests) == pytest.approx(exact, abs=error)


def test_a_controller_counts_with_the_half_that_did_not_choose_it() -> None:
    """Of one objective: the first half of the tests chooses the second controller, the other the first."""
    tests = np.array([[0.0, 0.0, 2.0, 3.0], [1.0, 2.0, 0.0, -1.0]])[..., np.newaxis]
    share = np.mean([(-0.5 + 1) / 4, (0.0 + 1) / 4])
    assert halves.hypervolume([GAIN], tests[:, 0], tests) == pytest.approx(share)


def test_with_one_test_evolution_chooses() -> None:
    evolved, tests = np.array([[1.0], [2.0]]), np.array([[[3.0]], [[0.0]]])
    assert halves.hypervolume([GAIN], evolved, tests) == pytest.approx(1 / 4)


def test_at_the_worst_ends_nothing_is_reached() -> None:
    tests = np.tile([-1.0, 4.0], (3, 4, 1))
    assert halves.hypervolume([GAIN, SIZE], tests[:, 0], tests) == 0


def test_who_is_the_best_one_half_of_the_tests_says_and_how_good_the_other() -> None:
    first = np.array([[5.0, 5.0, 1.0, 2.0], [4.0, 4.0, 9.0, 9.0], [0.0, 0.0, 7.0, 8.0]])
    success = np.array([[0.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.5, 1.0], [1.0, 1.0, 1.0, 0.0]])
    evolved = np.array([1.0, 2.0, 3.0])
    # The first half says the first one in the objective, the third one in success; the other half the second one twice.
    assert halves.of_the_best(evolved, first, success) == ((1.5 + 4.0) / 2, (0.5 + 0.5) / 2)
    # Of the same rate, the better one.
    assert halves.of_the_best(evolved, first[:2], success[:2]) == ((1.5 + 4.0) / 2, (0.0 + 0.5) / 2)
    # One test: as in evolution.
    assert halves.of_the_best(evolved, first[:, :1], success[:, :1]) == (0.0, 1.0)


# ---- where all are alike, fronts of two and of fifteen differ in one of twenty comparisons -------------------------


Trials = Callable[[np.random.Generator, int], list[tuple[float, ...]]]


def of_the_best(rng: np.random.Generator, controllers: int) -> list[tuple[float, ...]]:
    size = (20, controllers, 10)
    first, success = rng.normal(size=size), rng.binomial(1, 0.5, size=size).astype(float)
    return [halves.of_the_best(one.mean(axis=1), one, two) for one, two in zip(first, success, strict=True)]


def of_a_sure_size(rng: np.random.Generator, controllers: int) -> list[tuple[float, ...]]:
    """Return hypervolumes where the second objective is the same in all tests, as the number of neurons is."""
    gain = rng.normal(1.0, 0.8, size=(20, controllers, 10)).clip(*GAIN.range)
    tests = np.stack([gain, np.full_like(gain, 1.0)], axis=-1)
    return [(halves.hypervolume([GAIN, SIZE], one.mean(axis=1), one),) for one in tests]


def of_two_unsure(rng: np.random.Generator, controllers: int) -> list[tuple[float, ...]]:
    gain = rng.normal(1.0, 0.6, size=(20, controllers, 10)).clip(*GAIN.range)
    time = rng.normal(15.0, 1.5, size=(20, controllers, 10)).clip(*TIME.range)
    tests = np.stack([gain, time], axis=-1)
    return [(halves.hypervolume([GAIN, TIME], one.mean(axis=1), one),) for one in tests]


@pytest.mark.parametrize("trials", [of_the_best, of_a_sure_size, of_two_unsure], ids=lambda one: one.__name__)
def test_fronts_of_two_and_of_fifteen_alike_differ_in_one_of_twenty(trials: Trials) -> None:
    """200 times twenty trials each, ten tests of a controller: 5 % are 10, more than 21 come in one of 1700 tries."""
    rng = np.random.default_rng(8)
    found = 0
    for _ in range(200):
        small, large = (zip(*trials(rng, controllers), strict=True) for controllers in (2, 15))
        found = found + np.array([mann_whitney(a, b) < 0.05 for a, b in zip(small, large, strict=True)])
    assert (found >= 1).all()
    assert (found <= 21).all()


def test_by_the_same_tests_a_larger_front_would_look_better() -> None:
    """So the test above can fail: by the hypervolume of all tests, where all are alike, the larger one is ahead."""
    rng = np.random.default_rng(8)
    volumes = []
    for controllers in (2, 15):
        gain = rng.normal(1.0, 0.8, size=(20, controllers, 10)).clip(*GAIN.range).mean(axis=2)
        points = np.stack([gain, np.full_like(gain, 1.0)], axis=-1)
        volumes.append([fronts.hypervolume([GAIN, SIZE], one) for one in points])
    assert mann_whitney(*volumes) < 0.001

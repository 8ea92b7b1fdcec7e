# SPDX-License-Identifier: BSD-3-Clause
"""How good controllers are by tests that did not choose them: no front is called better for its size."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from swarmevo.analysis import cross_fitting, fronts
from swarmevo.analysis.significance import mann_whitney
from swarmevo.protocols import Objective

GAIN = Objective("gain", "maximise", (-1.0, 3.0))
SIZE = Objective("size", "minimise", (0.0, 4.0))
TIME = Objective("time", "minimise", (10.0, 20.0))
SPEED = Objective("speed", "maximise", (0.0, 0.5))


@pytest.mark.parametrize(
    ("objectives", "error"),
    [([GAIN], 1e-12), ([GAIN, SIZE], 2e-4), ([GAIN, SIZE, TIME], 3e-3), ([GAIN, SIZE, TIME, SPEED], 1.1e-2)],
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
        assert cross_fitting.hypervolume(objectives, points, tests) == pytest.approx(exact, abs=error)


def test_what_counts_is_the_test_that_did_not_choose() -> None:
    """Of one objective: without the first test the first controller is the best, without the others the second."""
    tests = np.array([[0.0, 1.0, 1.0], [3.0, 0.5, 0.0]])[..., np.newaxis]
    share = np.mean([0.0 + 1, 0.5 + 1, 0.0 + 1]) / 4
    assert cross_fitting.hypervolume([GAIN], tests[:, 0], tests) == pytest.approx(share)


def test_with_one_test_evolution_chooses() -> None:
    evolved, tests = np.array([[1.0], [2.0]]), np.array([[[3.0]], [[0.0]]])
    assert cross_fitting.hypervolume([GAIN], evolved, tests) == pytest.approx(1 / 4)


def test_at_the_worst_ends_nothing_is_reached() -> None:
    tests = np.tile([-1.0, 4.0], (3, 4, 1))
    assert cross_fitting.hypervolume([GAIN, SIZE], tests[:, 0], tests) == 0


def test_all_tests_but_one_say_who_is_the_best_and_that_one_how_good() -> None:
    first = np.array([[5.0, 5.0, 1.0], [4.0, 4.0, 9.0], [0.0, 0.0, 7.0]])
    success = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.5], [1.0, 1.0, 0.0]])
    evolved = np.array([1.0, 2.0, 3.0])
    # Without the first test, and without the second one, the second controller has the best objective; without the
    # third one the first has. Successful most often are the third (of two of one half the better one), the second, and
    # the third.
    assert cross_fitting.of_the_best(evolved, first, success) == ((4 + 4 + 1) / 3, (1 + 0 + 0) / 3)
    # One test: as in evolution, which knows no success.
    assert cross_fitting.of_the_best(evolved, first[:, :1], success[:, :1]) == (0.0, 1.0)
    # Of equals in all that counts the first.
    alike = np.zeros((2, 2))
    assert cross_fitting.of_the_best(alike[:, 0], alike, np.array([[1.0, 1.0], [1.0, 1.0]])) == (0.0, 1.0)


@pytest.mark.parametrize("repeats", [3, 10])
def test_controllers_that_are_nearly_as_good_cost_little(repeats: int) -> None:
    """A trade-off of ten, as far from each other as a test is unsure."""
    rng = np.random.default_rng(3)
    true = np.stack([np.linspace(0.2, 0.8, 10), np.linspace(0.8, 0.2, 10)], axis=1)
    objectives = [Objective(name, "maximise", (0.0, 1.0)) for name in ("one", "other")]
    found = []
    for _ in range(50):
        tests = rng.normal(true[:, np.newaxis], 0.1, size=(10, repeats, 2))
        found.append(cross_fitting.hypervolume(objectives, true, tests.clip(0, 1)))
    exact = fronts.hypervolume(objectives, true)
    assert exact - {3: 0.08, 10: 0.04}[repeats] < np.mean(found) < exact


# ---- where all are alike, fronts of two and of fifteen differ in one of twenty comparisons -------------------------


Trials = Callable[[np.random.Generator, int], list[tuple[float, ...]]]


def of_the_best(rng: np.random.Generator, controllers: int) -> list[tuple[float, ...]]:
    size = (20, controllers, 10)
    first, success = rng.normal(size=size), rng.binomial(1, 0.5, size=size).astype(float)
    return [cross_fitting.of_the_best(one.mean(axis=1), one, two) for one, two in zip(first, success, strict=True)]


def of_a_sure_size(rng: np.random.Generator, controllers: int) -> list[tuple[float, ...]]:
    """Return hypervolumes where the second objective is the same in all tests, as the number of neurons is."""
    gain = rng.normal(1.0, 0.8, size=(20, controllers, 10)).clip(*GAIN.range)
    tests = np.stack([gain, np.full_like(gain, 1.0)], axis=-1)
    return [(cross_fitting.hypervolume([GAIN, SIZE], one.mean(axis=1), one),) for one in tests]


def of_two_unsure(rng: np.random.Generator, controllers: int) -> list[tuple[float, ...]]:
    gain = rng.normal(1.0, 0.6, size=(20, controllers, 10)).clip(*GAIN.range)
    time = rng.normal(15.0, 1.5, size=(20, controllers, 10)).clip(*TIME.range)
    tests = np.stack([gain, time], axis=-1)
    return [(cross_fitting.hypervolume([GAIN, TIME], one.mean(axis=1), one),) for one in tests]


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

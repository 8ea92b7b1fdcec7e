# SPDX-License-Identifier: BSD-3-Clause
"""Differences of attainment, held against a direct count of who attains a place."""

from __future__ import annotations

import moocore
import numpy as np
import pytest

from swarmevo.analysis import attainment

POOR, GOOD = np.array([[3.0, -2.0]]), np.array([[1.0, -8.0]])


def share(trials: list[np.ndarray], place: np.ndarray) -> float:
    return sum(bool((points <= place).all(axis=1).any()) for points in trials) / len(trials)


def at(found: list[attainment.Rectangle], place: np.ndarray) -> float:
    inside = [one for one in found if (np.array(one.low) <= place).all() and (place < np.array(one.high)).all()]
    assert len(inside) <= 1
    return inside[0].difference if inside else 0.0


def test_by_hand_two_trials_against_eight() -> None:
    """Three of eight attain more than both of two: 37.5 % where only they do, and nowhere else a difference."""
    found = list(attainment.differences([POOR] * 2, [GOOD] * 3 + [POOR] * 5))
    assert at(found, np.array([1.0, -8.0])) == -0.375
    assert at(found, np.array([2.9, 0.0])) == -0.375
    assert at(found, np.array([9.0, -2.1])) == -0.375
    assert at(found, np.array([3.0, -2.0])) == 0
    assert at(found, np.array([0.9, 0.0])) == 0
    assert [one.difference for one in attainment.differences([POOR] * 10, [GOOD] * 5)] == [-1.0, -1.0]
    assert not list(attainment.differences([POOR], [POOR] * 3))


@pytest.mark.parametrize(("many", "few"), [(2, 8), (20, 10), (5, 6), (1, 1)])
def test_of_random_fronts_each_place_has_its_count(many: int, few: int) -> None:
    rng = np.random.default_rng([many, few])
    a, b = ([rng.integers(9, size=(rng.integers(1, 6), 2)).astype(float) for _ in range(n)] for n in (many, few))
    found = list(attainment.differences(a, b))
    for place in np.stack(np.meshgrid(np.arange(-1, 11, 0.5), np.arange(-1, 11, 0.5)), axis=-1).reshape(-1, 2):
        assert at(found, place) == pytest.approx(share(a, place) - share(b, place), abs=1e-12)


def test_of_equal_groups_it_is_the_librarys() -> None:
    rng = np.random.default_rng(3)
    a, b = ([rng.random((4, 2)) for _ in range(7)] for _ in range(2))
    found = list(attainment.differences(a, b))
    sets = [np.column_stack([np.concatenate(one), np.repeat(np.arange(1, 8), 4)]) for one in (a, b)]
    theirs = moocore.eafdiff(*sets, rectangles=True)
    assert len(theirs) > 10
    for *corners, difference in theirs:
        low, high = np.reshape(corners, (2, 2))
        middle = (low + np.where(np.isinf(high), low + 1, high)) / 2
        assert at(found, middle) == pytest.approx(difference / 7)

# SPDX-License-Identifier: BSD-3-Clause
"""Rank tests, effect sizes and their intervals: by hand, on planted differences, and where there is none."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from swarmevo.analysis.significance import (
    holm,
    kruskal_wallis,
    mann_whitney,
    vargha_delaney,
    vargha_delaney_interval,
)
from swarmevo.errors import SwarmevoError


def test_mann_whitney_by_hand() -> None:
    """Of three and three values that do not overlap: 2 of the 20 orders are as extreme."""
    assert mann_whitney([1, 2, 3], [4, 5, 6]) == pytest.approx(2 / 20)


def test_a12_by_hand() -> None:
    assert vargha_delaney([1, 2, 3], [4, 5, 6]) == 0
    assert vargha_delaney([4, 5, 6], [1, 2, 3]) == 1
    assert vargha_delaney([1, 3], [2, 3]) == (0 + 0 + 1 + 0.5) / 4


def test_the_same_values_differ_in_nothing() -> None:
    assert mann_whitney([0, 0, 0], [0, 0]) == 1
    assert kruskal_wallis([[2.0], [2.0, 2.0], [2.0]]) == 1
    assert vargha_delaney_interval([0, 0], [0, 0]) == (0.5, 0.5)


def test_holm_by_hand() -> None:
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert holm([0.5, 0.9]) == [1.0, 1.0]
    assert holm([0.2]) == [0.2]


def test_where_there_is_no_difference_one_in_twenty_is_found_at_most() -> None:
    """800 pairs of ten trials each: 5 % are 40; more than 56 come by chance in one of 200 tries."""
    rng = np.random.default_rng(3)
    found = sum(mann_whitney(*rng.normal(size=(2, 10))) < 0.05 for _ in range(800))
    assert 15 <= found <= 56


@pytest.mark.parametrize("ties", [False, True])
def test_of_four_groups_that_do_not_differ_one_in_twenty_is_said_to_at_most(ties: bool) -> None:
    """800 times four groups of ten trials: 5 % are 40; more than 56 come by chance in one of 200 tries."""
    rng = np.random.default_rng(9)
    draw = (lambda: rng.binomial(10, 0.5, size=(4, 10))) if ties else (lambda: rng.normal(size=(4, 10)))
    found = sum(kruskal_wallis(list(draw())) < 0.05 for _ in range(800))
    assert 15 <= found <= 56


def test_several_pairs_find_no_more() -> None:
    """Of 400 times three groups without a difference, any pair after Holm: 5 % are 20, 34 come in one of 500 tries."""
    rng = np.random.default_rng(4)
    found = 0
    for _ in range(400):
        a, b, c = rng.normal(size=(3, 10))
        found += min(holm([mann_whitney(a, b), mann_whitney(a, c), mann_whitney(b, c)])) < 0.05
    assert 2 <= found <= 34


def test_a_planted_difference_is_found() -> None:
    """Of ten trials each that are two standard deviations apart nearly all: A12 is the normal distribution's."""
    rng = np.random.default_rng(5)
    pairs = [(rng.normal(2, size=10), rng.normal(0, size=10)) for _ in range(100)]
    assert sum(mann_whitney(a, b) < 0.05 for a, b in pairs) >= 90
    assert np.mean([vargha_delaney(a, b) for a, b in pairs]) == pytest.approx(0.9214, abs=0.02)
    assert sum(kruskal_wallis([a, b, b]) < 0.05 for a, b in pairs) >= 90


def test_the_interval_holds_the_true_effect_mostly() -> None:
    """Of 40 samples of twenty: a percentile bootstrap of so few is a little too narrow."""
    rng = np.random.default_rng(6)
    true = 0.7602  # of normal distributions one standard deviation apart
    held = 0
    for _ in range(40):
        low, high = vargha_delaney_interval(rng.normal(1, size=20), rng.normal(0, size=20))
        held += low <= true <= high
    assert held >= 33


def test_the_same_samples_have_the_same_interval() -> None:
    a, b = np.random.default_rng(7).normal(size=(2, 10))
    assert vargha_delaney_interval(a, b) == vargha_delaney_interval(a, b)


def test_without_scipy_it_is_said_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "scipy", None)
    with pytest.raises(SwarmevoError, match=r"^scipy: expected it installed .*pip install 'swarmevo\[stats\]'"):
        mann_whitney([1, 2], [3, 4])

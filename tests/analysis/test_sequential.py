# SPDX-License-Identifier: BSD-3-Clause
"""When a rate is known well enough."""

from __future__ import annotations

import numpy as np
import pytest

from swarmevo.analysis.sequential import CHUNK, Until, decide, looks


def pushes(*successes: bool) -> np.ndarray:
    return np.where(successes, 1.0, np.nan)


def nobody(tests: int) -> np.ndarray:
    return np.full((tests, 2), np.nan)


def test_looks_end_at_the_most() -> None:
    assert looks(60) == [25, 50, 60]
    assert looks(50) == [25, 50]
    assert looks(3) == [3]


def test_the_first_look_that_decides_is_taken() -> None:
    """125 successes in a row: Wilson's lower bound is 0.9702; of 100 it is 0.9630."""
    found = decide(Until(0.97), nobody(300), pushes(*[True] * 300), 300)
    assert (found.verdict, found.tests, found.rate) == ("above", 125, 1.0)
    assert found.low == pytest.approx(125 / (125 + 1.959964**2), abs=1e-6)
    found = decide(Until(0.97), nobody(300), pushes(*[False] * 300), 300)
    assert (found.verdict, found.tests, found.low) == ("below", CHUNK, 0.0)


def test_what_is_not_decided_is_open() -> None:
    found = decide(Until(0.5), nobody(60), pushes(*[True, False] * 30), 60)
    assert (found.verdict, found.tests, found.rate) == ("open", 60, 0.5)


def test_tests_beyond_the_most_do_not_count() -> None:
    assert decide(Until(0.97), nobody(300), pushes(*[True] * 300), 60).verdict == "open"


def test_the_share_of_robots_that_homed() -> None:
    half = np.where(np.tile([True, False], (100, 1)), 2.0, np.nan)
    assert decide(Until(0.3, "homing"), half, pushes(*[False] * 100), 100).rate == 0.5
    assert decide(Until(0.3, "homing"), half, pushes(*[False] * 100), 100).verdict == "above"
    assert decide(Until(0.3, "push"), half, pushes(*[False] * 100), 100).verdict == "below"

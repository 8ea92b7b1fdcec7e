# SPDX-License-Identifier: BSD-3-Clause
"""When a rate is known well enough."""

from __future__ import annotations

import numpy as np
import pytest

from swarmevo.analysis.measures import Measures
from swarmevo.analysis.sequential import CHUNK, Until, decide, looks, settled, successes
from swarmevo.errors import InvalidArgument
from swarmevo.evolution.results import Results
from swarmevo.protocols import Objective

ERROR = Objective("error", "minimise", (0.0, 2.0), success=0.5)
OBJECTIVES = Objective("gain", "maximise", (0.0, 1.0), success=0.75), ERROR
NOTHING = Measures(homing=False, push=False, one_box=False, paper=False, successes=())


def done(homing_time: object, push_time: object, objective: object) -> Results:
    values = {"homing_time": homing_time, "push_time": push_time, "objective": objective}
    arrays = {name: np.array(value, dtype=np.float64) for name, value in values.items()}
    n = len(arrays["push_time"])
    return Results(individual=np.zeros(n, int), repeat=np.arange(n), values=arrays, faults=("",) * n, seconds=0.0)


def test_looks_end_at_the_most() -> None:
    assert looks(60) == [25, 50, 60]
    assert looks(50) == [25, 50]
    assert looks(3) == [3]


def test_the_first_look_that_decides_is_taken() -> None:
    """125 successes in a row: Wilson's lower bound is 0.9702; of 100 it is 0.9630."""
    found = decide(Until(0.97), np.array([True] * 300, float), 300)
    assert (found.verdict, found.tests, found.rate) == ("above", 125, 1.0)
    assert found.low == pytest.approx(125 / (125 + 1.959964**2), abs=1e-6)
    found = decide(Until(0.97), np.array([False] * 300, float), 300)
    assert (found.verdict, found.tests, found.low) == ("below", CHUNK, 0.0)


def test_what_is_not_decided_is_open() -> None:
    found = decide(Until(0.5), np.array([True, False] * 30, float), 60)
    assert (found.verdict, found.tests, found.rate) == ("open", 60, 0.5)


def test_tests_beyond_the_most_do_not_count() -> None:
    assert decide(Until(0.97), np.array([True] * 300, float), 60).verdict == "open"


def test_each_rate_by_hand() -> None:
    found = done([[1, np.nan], [2, 3], [np.nan, np.nan]], [np.nan, 4, 5], [[0.75, 0.6], [0.7, 0.5], [1, 0]])
    rates = {name: successes(name, found, OBJECTIVES).tolist() for name in ("homing", "push", "gain", "error")}
    assert rates == {"homing": [0.5, 1, 0], "push": [0, 1, 1], "gain": [1, 0, 1], "error": [0, 1, 1]}


@pytest.mark.parametrize(
    ("measures", "first"),
    [
        (Measures(homing=True, push=True, one_box=True, paper=True, successes=OBJECTIVES), "push"),
        (Measures(homing=True, push=False, one_box=False, paper=False, successes=OBJECTIVES), "gain"),
        (Measures(homing=True, push=False, one_box=False, paper=False, successes=()), "homing"),
    ],
)
def test_the_rate_is_the_tasks_first_if_nobody_says_which(measures: Measures, first: str) -> None:
    assert settled(Until(0.5), measures) == Until(0.5, first)
    assert settled(Until(0.5, "homing"), measures).rate == "homing"
    with pytest.raises(InvalidArgument, match=rf"^rate: expected .*{first}.*, got 'speed'$"):
        settled(Until(0.5, "speed"), measures)


def test_a_task_without_success_cannot_be_decided() -> None:
    with pytest.raises(InvalidArgument, match=r"^until: expected a task with a rate of success"):
        settled(Until(0.5), NOTHING)

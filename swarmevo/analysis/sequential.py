# SPDX-License-Identifier: BSD-3-Clause
"""Sequential tests: a controller is tested until it is known whether it succeeds more often than a limit, or less.

After each chunk of tests Wilson's interval of its rate is looked at; when it lies on one side of the limit, that is
decided. Looking several times errs a little more often than the interval's confidence says. Tests always come in the
same order, hence a decision depends on nothing else, such as how many more are stored.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from swarmevo.analysis.measures import DELIVERED, HOMING, PUSH, Measures
from swarmevo.analysis.statistics import wilson
from swarmevo.errors import InvalidArgument
from swarmevo.evolution.results import Results
from swarmevo.protocols import FloatArray, Objective

CHUNK: Final = 25
"""Tests between two looks."""
MOST: Final = 1000
"""Tests of a controller, if nobody says otherwise."""


@dataclass(frozen=True)
class Until:
    """When a controller's tests end."""

    limit: float
    """Of its rate, in (0, 1)."""
    rate: str = ""
    """One of the task's :attr:`~swarmevo.analysis.measures.Measures.rates`; "": the first."""


@dataclass(frozen=True)
class Decision:
    """Whether a rate is over a limit."""

    verdict: Literal["above", "below", "open"]
    """Open: the interval still holds the limit."""
    tests: int
    """After which it was decided, or all of them."""
    rate: float
    low: float
    """Of Wilson's 95 % interval."""
    high: float


def looks(most: int) -> list[int]:
    """Return after how many tests the interval is looked at."""
    return [*range(CHUNK, most, CHUNK), most]


def settled(until: Until, measures: Measures) -> Until:
    """Return what is to be decided, its rate by name.

    Raises:
        InvalidArgument: The task has no such rate, or none at all.
    """
    if not measures.rates:
        raise InvalidArgument(
            "until: expected a task with a rate of success, but its scene has neither source nor goal, and no "
            "objective says what a success is"
        )
    if until.rate and until.rate not in measures.rates:
        raise InvalidArgument(f"rate: expected {' or '.join(measures.rates)}, got {until.rate!r}")
    return Until(until.limit, until.rate or measures.rates[0])


def successes(rate: str, tests: Results, objectives: Sequence[Objective]) -> FloatArray:
    """Return ``(tests,)``: how far each was a success, from 0 to 1.

    Args:
        rate: Which rate of success.
        tests: Of one controller.
        objectives: That they were judged by.
    """
    if rate in (PUSH, DELIVERED):
        return np.asarray(np.isfinite(tests["push_time"]), dtype=np.float64)
    if rate == HOMING:
        return np.asarray(np.isfinite(tests["homing_time"]).mean(axis=1), dtype=np.float64)
    number, objective = next((k, one) for k, one in enumerate(objectives) if one.name == rate)
    return np.asarray(objective.is_success(tests["objective"][:, number]), dtype=np.float64)


def decide(until: Until, success: FloatArray, most: int) -> Decision:
    """Return what tests decide: the first ``most``, or those up to the first look that decides.

    Args:
        until: The limit.
        success: ``(tests,)``: of each test (:func:`successes`); at least one.
        most: Tests beyond are not looked at.
    """
    decision = None
    for tests in looks(min(most, len(success))):
        rate = float(success[:tests].mean())
        low, high = wilson(rate * tests, tests)
        verdict: Literal["above", "below", "open"] = (
            "above" if low > until.limit else "below" if high < until.limit else "open"
        )
        decision = Decision(verdict, tests, rate, low, high)
        if verdict != "open":
            break
    assert decision is not None
    return decision

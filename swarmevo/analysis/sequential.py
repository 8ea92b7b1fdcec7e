# SPDX-License-Identifier: BSD-3-Clause
"""Sequential tests: a controller is tested until it is known whether it succeeds more often than a limit, or less.

After each chunk of tests Wilson's interval of its rate is looked at; when it lies on one side of the limit, that is
decided. Looking several times errs a little more often than the interval's confidence says. Tests always come in the
same order, hence a decision depends on nothing else, such as how many more are stored.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np

from swarmevo.analysis.statistics import wilson
from swarmevo.protocols import FloatArray

CHUNK: Final = 25
"""Tests between two looks."""
MOST: Final = 1000
"""Tests of a controller, if nobody says otherwise."""
Rate = Literal["push", "homing"]
"""Share of tests in which the box touched the target wall; of robots that came within the emitter's range."""
RATES: Final = get_args(Rate)


@dataclass(frozen=True)
class Until:
    """When a controller's tests end."""

    limit: float
    """Of its rate, in (0, 1)."""
    rate: Rate = "push"


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


def decide(until: Until, homing_time: FloatArray, push_time: FloatArray, most: int) -> Decision:
    """Return what tests decide: the first ``most``, or those up to the first look that decides.

    Args:
        until: The limit.
        homing_time: ``(tests, robots)``; NaN: never.
        push_time: ``(tests,)``; NaN: never. At least one test.
        most: Tests beyond are not looked at.
    """
    is_push = until.rate == "push"
    success = np.isfinite(push_time) if is_push else np.isfinite(homing_time).mean(axis=1)
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

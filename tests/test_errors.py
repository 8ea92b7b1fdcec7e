# SPDX-License-Identifier: BSD-3-Clause
"""Errors are single lines, and travel between processes as they are."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Iterator

import pytest

from swarmevo import errors
from swarmevo.evolution import processes


def _all(kind: type[BaseException]) -> Iterator[type[BaseException]]:
    yield kind
    for child in kind.__subclasses__():
        yield from _all(child)


EVERY = sorted(
    {*_all(errors.SwarmevoError), errors.Interrupted, processes.Lost, processes.Cancelled},
    key=lambda kind: kind.__name__,
)


@pytest.mark.parametrize("kind", EVERY, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("lines", [(), ("one: a line",), ("one: a; b", "two: 'c'\\d")])
@pytest.mark.parametrize("journey", [copy.copy, copy.deepcopy, lambda error: pickle.loads(pickle.dumps(error))])
def test_an_error_survives_a_journey(kind: type[BaseException], lines: tuple[str, ...], journey: object) -> None:
    """Case 31: with its lines, its message, its notes and whatever was attached to it."""
    assert callable(journey)
    error = kind(*lines)
    error.add_note("while testing")
    error.place = "trial 0"  # type: ignore[attr-defined]
    found = journey(error)
    assert type(found) is kind
    assert (str(found), repr(found), vars(found)) == (str(error), repr(error), vars(error))
    assert getattr(found, "errors", lines) == lines


def test_many_lines_of_a_kind_are_the_first_ones_and_how_many_more() -> None:
    outside = [f"team.start_poses[{i}]: expected it inside, got {9 + i / 10}, 9 m" for i in range(20)]
    told = errors.SwarmevoError("robot.mass: expected less, got 5", *outside, "robot.radius: expected more, got 0.1")
    assert told.errors == (
        "robot.mass: expected less, got 5",
        *outside[:2],
        outside[2] + " (and 17 more like this)",
        "robot.radius: expected more, got 0.1",
    )
    assert pickle.loads(pickle.dumps(told)).errors == told.errors
    assert errors.SwarmevoError(*outside[:4]).errors == tuple(outside[:4])
    assert (
        errors.SwarmevoError(*(f"{word}: expected a number, got 1" for word in "abcdefgh")).errors[-1].startswith("h")
    )

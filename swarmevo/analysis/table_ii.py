# SPDX-License-Identifier: BSD-3-Clause
"""What tests of a run's controllers gave, beside the paper's Table II: views of what is stored of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import fmean
from typing import Any, Final, NamedTuple

import numpy as np
import pydantic

from swarmevo.analysis.measures import DELIVERED, HOMING, PUSH, Measures
from swarmevo.analysis.sequential import Decision, Until
from swarmevo.protocols import FloatArray, Objective

FORMAT: Final = 3
"""Of the JSON."""


class PaperRow(NamedTuple):
    """A row of the paper's Table II; rates in [0, 1], times in seconds, None: "Max"."""

    robots: int
    homing_rate: float
    homing_time: float
    push_rate: float
    push_time: float | None


PAPER: Final = (
    PaperRow(1, 0.1333, 10.36, 0.0, None),
    PaperRow(2, 0.2667, 12.37, 0.0, None),
    PaperRow(3, 0.9767, 13.54, 0.96, 43.44),
    PaperRow(4, 0.9333, 13.78, 0.56, 37.42),
    PaperRow(5, 0.8867, 11.68, 0.30, 30.67),
)
"""The paper's Table II."""


class Mean(NamedTuple):
    """Of an objective over tests."""

    mean: float
    error: float | None
    """Standard error of the mean; None: of one test."""


@dataclass(frozen=True)
class Outcome:
    """What a number of tests with teams of one size gave."""

    robots: int
    tests: int
    homing_rate: float
    """Share of robots that came within the emitter's range."""
    any_home_rate: float
    """Share of tests in which at least one robot did."""
    all_home_rate: float
    """Share of tests in which all robots did."""
    homing_time: float | None
    """Mean over the robots that did [s]; None: none did."""
    push_rate: float
    """Share of tests in which the box touched the target wall."""
    push_time: float | None
    """Mean over those tests [s]; None: in none, the paper's "Max"."""
    success_rates: dict[str, float] = field(default_factory=dict)
    """For each objective that says what a success is, the share of tests that were one."""
    objectives: dict[str, Mean] = field(default_factory=dict)
    """Of each objective that is measured in an episode."""

    def rate(self, name: str) -> float:
        """Return one of the rates that a task's :class:`~swarmevo.analysis.measures.Measures` name."""
        delivery = dict.fromkeys((PUSH, DELIVERED), self.push_rate)
        return {**delivery, HOMING: self.homing_rate, **self.success_rates}[name]


@dataclass(frozen=True)
class Tested:
    """One controller of a trial's front."""

    trial: int
    genome: int
    """Its id in the store."""
    evolved: dict[str, float]
    """Its objectives in the run: means over the episodes it was selected by."""
    tested: dict[str, float]
    """The same in the tests, with as many robots as in evolution."""
    outcomes: list[Outcome]
    """One for each team size, of all its tests."""
    behaviours: dict[str, float]
    """Share of robots with each label of the census, with as many robots as in evolution; empty: it has seen none."""


@dataclass(frozen=True)
class Condition:
    """A change of the world that no controller was evolved in."""

    name: str
    changes: str
    """Of the configuration."""
    outcome: Outcome


@dataclass(frozen=True)
class Verdict(Decision):
    """Of a controller's tests with teams of one size."""

    trial: int
    genome: int
    robots: int


@dataclass(frozen=True)
class Assessment:
    """Tests of controllers."""

    generation: int
    """Of the tests' episode keys."""
    repeats: int
    """Tests of each controller and team size, the same for all, that ``rows`` and ``robustness`` count."""
    measures: Measures
    """Which rates say something of the task."""
    horizon: float
    """Of a test [s]: a robot that has not succeeded by then never does."""
    rows: list[Outcome]
    """Table II: for each team size the means over all controllers, each of which counts the same."""
    controllers: list[Tested]
    behaviours: dict[str, float]
    """Over all controllers; empty: the census has not seen them."""
    robustness: list[Condition]
    """The undisturbed world first; empty if there was no test of it."""
    changes: list[str] = field(default_factory=list)
    """What the tests' world has other than that of evolution, key by key."""
    until: Until | None = None
    """What was to be decided."""
    verdicts: list[Verdict] = field(default_factory=list)
    """Of each controller and team size, if something was to be decided."""
    untested: int = 0
    """Controllers of the fronts without some of these tests."""

    @property
    def most_successful(self) -> Tested:
        """Who succeeded most often in what matters most, in the mean over the team sizes; of equals the first."""

        def rates(tested: Tested) -> list[float]:
            return [fmean(one.rate(name) for one in tested.outcomes) for name in self.measures.rates]

        return max(self.controllers, key=rates)


def outcome(
    robots: int,
    homing_time: FloatArray,
    push_time: FloatArray,
    objectives: Sequence[Objective],
    values: FloatArray,
) -> Outcome:
    """Return the outcome of tests.

    Args:
        robots: In the team.
        homing_time: ``(tests, robots)``; NaN: never.
        push_time: ``(tests,)``; likewise.
        objectives: m.
        values: ``(tests, m)``
    """
    home = np.isfinite(homing_time)
    measured = [(one, column) for one, column in zip(objectives, values.T, strict=True) if one.of == "episode"]
    return Outcome(
        robots=robots,
        tests=len(push_time),
        homing_rate=float(home.mean()),
        any_home_rate=float(home.any(axis=1).mean()),
        all_home_rate=float(home.all(axis=1).mean()),
        homing_time=_mean(homing_time),
        push_rate=float(np.isfinite(push_time).mean()),
        push_time=_mean(push_time),
        success_rates={
            one.name: float(one.is_success(column).mean()) for one, column in measured if one.success is not None
        },
        objectives={one.name: _with_error(column) for one, column in measured},
    )


def _with_error(values: FloatArray) -> Mean:
    error = float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else None
    return Mean(float(values.mean()), error)


def _mean(times: FloatArray) -> float | None:
    finite = times[np.isfinite(times)]
    return float(finite.mean()) if finite.size else None


def as_json(assessment: Assessment) -> str:
    """Return an assessment as JSON, with the paper's table beside it."""
    found = {"format": FORMAT, **dataclasses.asdict(assessment), "paper": [row._asdict() for row in PAPER]}
    return pydantic.TypeAdapter(dict[str, Any]).dump_json(found, indent=2).decode()

# SPDX-License-Identifier: BSD-3-Clause
"""Numbers, times, rates and counts as text."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import pytest

from swarmevo.analysis.fronts import Cost
from swarmevo.analysis.table_ii import PAPER
from swarmevo.config import Config, Emitter, surroundings
from swarmevo.protocols import Objective
from swarmevo.runs.records import Totals
from swarmevo.views import text

MINUTE, HOUR, DAY = 60, 3600, 24 * 3600


def said(found: str) -> str:
    """Return text with ordinary spaces for those that do not break."""
    return found.replace("\N{NO-BREAK SPACE}", " ").replace("\N{NARROW NO-BREAK SPACE}", "'")


@pytest.mark.parametrize(
    ("time", "expected"),
    [
        (0.4, "0 s"), (59, "59 s"), (61, "1 min"), (90 * MINUTE, "1.5 h"), (47 * HOUR, "47.0 h"), (3 * DAY, "3.0 days"),
    ],
)  # fmt: skip
def test_a_duration_has_the_unit_that_suits_it(time: float, expected: str) -> None:
    assert said(text.duration(time)) == expected


def test_a_clock_runs_to_the_second() -> None:
    assert text.clock(0.4) == "0:00:00"
    assert text.clock(2 * HOUR + 61) == "2:01:01"


def test_counts_have_their_plural_and_gaps_between_thousands() -> None:
    assert [said(text.count(n, "episode")) for n in (0, 1, 2, 12345)] == [
        "0 episodes", "1 episode", "2 episodes", "12'345 episodes",
    ]  # fmt: skip


def test_numbers() -> None:
    assert [text.number(value) for value in (0.0, 17.12999, 1234567.0)] == ["0", "17.13", "1.235e+06"]
    assert [text.difference(value) for value in (-0.25, 0.0, 3.14159)] == ["-0.25", "+0", "+3.14"]
    assert text.percent(0.125) == "12%"
    assert text.throughput(1234.5, "ep") == "1.23e+03 ep/s"


def test_times_of_events() -> None:
    assert [said(text.moment(time)) for time in (12.34, math.nan)] == ["after 12.3 s", "never"]
    assert [said(text.time_taken(time)) for time in (12.34, None)] == ["12.3 s", "Max"]
    assert [said(text.span(times)) for times in ([3.0, 5.0, 12.34], [3.0], [3.01, 3.02])] == [
        "3.0 to 12.3 s", "3.0 s", "3.0 s",
    ]  # fmt: skip
    assert said(text.horizon(180.0)) == "180 s"


def test_rates_of_tests_are_those_of_the_papers_table() -> None:
    assert [said(cell) for cell in text.outcome(PAPER[2])] == ["98%", "13.5 s", "96%", "43.4 s"]
    assert [said(cell) for cell in text.outcome(PAPER[0])][2:] == ["0%", "Max"]
    assert [said(text.rate(share, time)) for share, time in ((0.5, 3.0), (0.0, None))] == ["50%, after 3.0 s", "0%"]


@pytest.mark.parametrize("faults", [0, 1])
def test_a_runs_cost(faults: int) -> None:
    totals = Totals(4, 16, 8, 32, ode_messages=1, unsolved_steps=0, steps=40_000, seconds=2.0, faults=faults)
    cost = Cost(**asdict(totals), simulated_seconds=4000.0)
    assert said(text.speed(cost)) == "2'000 times real time"
    assert text.physics(cost) == "1 warning of ODE, 0 unsolved steps" + ", 1 failed episode" * faults


def test_an_objective_says_which_direction_is_better() -> None:
    objectives = [("box_pushing", "maximise"), ("hidden_neurons", "minimise"), ("energy", "minimise")]
    assert [text.label(Objective(name, direction, (0, 1))) for name, direction in objectives] == [
        "box pushing (more is better)", "hidden neurons (less is better)", "energy (less is better)",
    ]  # fmt: skip


def test_a_console_gets_ordinary_spaces_and_no_gaps() -> None:
    assert text.plain(f"{text.count(12345, 'episode')} in {text.duration(5)}") == "12345 episodes in 5 s"


@pytest.mark.parametrize(("direction", "sign", "plain"), [("maximise", "\u2265", ">="), ("minimise", "\u2264", "<=")])
def test_a_success_has_its_sign(direction: str, sign: str, plain: str) -> None:
    success = text.success(Objective("coverage", direction, (0, 1), success=0.8))
    assert (success, text.plain(success)) == (f"coverage {sign} 0.8", f"coverage {plain} 0.8")


@pytest.mark.parametrize(
    ("scene", "delivered", "distance"),
    [
        ({}, "box at the wall", "box to target wall"),
        ({"goals": [{"region": [0, 1, 0, 1]}]}, "box at the goal", "box to goal"),
        ({"goals": [{"wall": "north"}, {"wall": "east"}]}, "box at the wall", "box to a goal"),
        ({"movables": [{}, {}], "goals": [{"wall": "north"}]}, "all at a goal", "nearest movable to target wall"),
        ({"movables": [{"shape": "cylinder"}]}, "cylinder at the wall", "cylinder to target wall"),
        ({"movables": []}, "", ""),
        ({"goals": []}, "", ""),
    ],
)
def test_a_push_is_named_as_the_scene_has_it(scene: dict[str, Any], delivered: str, distance: str) -> None:
    spelled = surroundings(Config.model_validate({"scene": scene}))
    assert text.delivery(spelled) == delivered
    assert text.delivery_distance(spelled) == distance


@pytest.mark.parametrize(
    ("emitters", "expected"),
    [
        ([], ""),
        ([{}], "robots at the source"),
        ([{"reach": "arena"}], "robots at the beacon"),
        ([{"rides_on": 0}, {"rides_on": 1}], "robots at a beacon"),
    ],
)
def test_who_has_homed_in_on_what(emitters: list[dict[str, Any]], expected: str) -> None:
    assert text.homing([Emitter(**one) for one in emitters]) == expected


def test_one_generation_is_no_span() -> None:
    assert [text.generations(3, last) for last in (3, 5)] == ["generation 3", "generations 3 to 5"]

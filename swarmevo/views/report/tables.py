# SPDX-License-Identifier: BSD-3-Clause
"""The tables of a report: the fronts, the paper's Table II beside ours, robustness, and evolution against tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from swarmevo.analysis.table_ii import PAPER, Assessment, Outcome, PaperRow
from swarmevo.protocols import Objective
from swarmevo.simulation import layout
from swarmevo.views import text
from swarmevo.views.report.run import Run


class Beside(NamedTuple):
    """A cell with two results."""

    ours: str
    papers: str


@dataclass(frozen=True)
class Table:
    """Heads and cells, as text."""

    heads: list[str]
    rows: Sequence[Sequence[str | Beside]]


def front(run: Run) -> Table:
    """Return the points of the fronts of all trials."""
    names = [text.words(objective.name) for objective in run.summary.objectives]
    delivered = text.delivery(run.scene)
    rows = [
        [
            *map(text.number, point.objectives.values()),
            *([text.rate(point.homing_rate, point.homing_time)] if layout.homing_emitters(run.scene) else []),
            *([text.rate(point.push_rate, point.push_time)] if delivered else []),
            str(point.episodes),
            str(point.trial),
            str(point.genome),
            "yes" if (point.trial, point.genome) in run.best else "",
        ]
        for point in run.points
    ]
    measured = [
        *(["robots at the source"] if layout.homing_emitters(run.scene) else []),
        *([delivered] if delivered else []),
    ]
    return Table([*names, *measured, "episodes", "trial", "individual", "global front"], rows)


def table_ii(run: Run, tests: Assessment) -> Table:
    """Return the paper's Table II: for each team size what the tests gave, with the paper's results beside."""
    paper = {row.robots: row for row in PAPER}
    pushed = text.delivery(run.scene) or "pushed"
    heads = ["robots", "robots at the source", "any", "all", "time taken", pushed, "time taken"]
    return Table(heads, [_table_ii_row(row, paper.get(row.robots)) for row in tests.rows])


def _table_ii_row(row: Outcome, paper: PaperRow | None) -> list[str | Beside]:
    cells: list[str | Beside] = [*text.outcome(row)]
    if paper is not None:
        cells = [Beside(ours, papers) for ours, papers in zip(text.outcome(row), text.outcome(paper), strict=True)]
    homing, home_time, pushing, push_time = cells
    shares = text.percent(row.any_home_rate), text.percent(row.all_home_rate)
    return [str(row.robots), homing, *shares, home_time, pushing, push_time]


def robustness(run: Run, tests: Assessment) -> Table:
    """Return what the tests in other worlds gave."""
    pushed = text.delivery(run.scene) or "pushed"
    heads = ["world", "changes", "robots at the source", "time taken", pushed, "time taken"]
    return Table(heads, [[one.name, one.changes, *text.outcome(one.outcome)] for one in tests.robustness])


def gap(objective: Objective, tests: Assessment) -> Table:
    """Return how the controllers fare beside what evolution thought of them."""
    name = objective.name
    rows = [
        [
            str(one.genome),
            str(one.trial),
            text.number(one.evolved[name]),
            text.number(one.tested[name]),
            text.difference(one.tested[name] - one.evolved[name]),
        ]
        for one in tests.controllers
        if one.tested
    ]
    return Table(["individual", "trial", "in evolution", "in fresh tests", "difference"], rows)

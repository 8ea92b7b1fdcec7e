# SPDX-License-Identifier: BSD-3-Clause
"""The tables of a report: the fronts, the paper's Table II beside ours, robustness, and evolution against tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from swarmevo.analysis.table_ii import PAPER, Assessment, Outcome, PaperRow
from swarmevo.protocols import Objective
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
            *([text.rate(point.homing_rate, point.homing_time)] if run.homing else []),
            *([text.rate(point.push_rate, point.push_time)] if delivered else []),
            *map(text.percent, point.success_rates.values()),
            str(point.episodes),
            str(point.trial),
            str(point.genome),
            "yes" if (point.trial, point.genome) in run.best else "",
        ]
        for point in run.points
    ]
    measured = [
        *([run.homing] if run.homing else []),
        *([delivered] if delivered else []),
        *map(text.success, run.summary.measures.successes),
    ]
    return Table([*names, *measured, "episodes", "trial", "individual", "global front"], rows)


def table_ii(run: Run, tests: Assessment) -> Table:
    """Return for each team size what the tests gave; in the paper's scene as its Table II, with its results beside."""
    if not tests.measures.paper:
        rows = [[str(row.robots), *text.measured(row, tests.measures)] for row in tests.rows]
        return Table(["robots", *_heads(run, tests)], rows)
    paper = {row.robots: row for row in PAPER}
    heads = ["robots", run.homing, "any", "all", "time taken", text.delivery(run.scene), "time taken"]
    return Table(
        [*heads, *map(text.success, tests.measures.successes)],
        [_table_ii_row(row, paper.get(row.robots)) for row in tests.rows],
    )


def _heads(run: Run, tests: Assessment) -> list[str]:
    objectives = tests.rows[0].objectives if tests.rows else ()
    return text.measured_heads(tests.measures, objectives, run.homing, text.delivery(run.scene))


def _table_ii_row(row: Outcome, paper: PaperRow | None) -> list[str | Beside]:
    cells: list[str | Beside] = [*text.outcome(row)]
    if paper is not None:
        cells = [Beside(ours, papers) for ours, papers in zip(text.outcome(row), text.outcome(paper), strict=True)]
    homing, home_time, pushing, push_time = cells
    shares = text.percent(row.any_home_rate), text.percent(row.all_home_rate)
    successes = map(text.percent, row.success_rates.values())
    return [str(row.robots), homing, *shares, home_time, pushing, push_time, *successes]


def robustness(run: Run, tests: Assessment) -> Table:
    """Return what the tests in other worlds gave."""
    rows = [[one.name, one.changes, *text.measured(one.outcome, tests.measures)] for one in tests.robustness]
    return Table(["world", "changes", *_heads(run, tests)], rows)


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

# SPDX-License-Identifier: BSD-3-Clause
"""Tests on the console: the paper's Table II, ours and the paper's side by side, robustness and behaviours."""

from __future__ import annotations

from typing import TYPE_CHECKING

from swarmevo.views import text
from swarmevo.views.console import output

if TYPE_CHECKING:
    from swarmevo.analysis.table_ii import Assessment, Outcome, PaperRow


def show_assessment(found: Assessment) -> None:
    """Print the paper's Table II, ours and the paper's side by side, and what else was tested."""
    from swarmevo.analysis.table_ii import PAPER

    out = output.stdout()
    out.print(
        f"{len(found.controllers)} controllers of all trials' fronts, {found.repeats} tests each on fresh seeds. "
        "Rates are over robots or tests, times means over those that succeeded; (in brackets: the paper)"
    )
    if found.changes:
        out.print(f"In another world than that of evolution: {', '.join(found.changes)}")
    paper = {row.robots: row for row in PAPER}
    heads = ("robots", "homing", "", "any", "all", "time", "", "pushing", "", "time", "")
    table = output.table(*heads, right=True)
    for row in found.rows:
        table.add_row(*_table_ii_row(row, paper.get(row.robots)))
    out.print(table)
    if found.robustness:
        out.print(f"\nRobustness, {found.robustness[0].outcome.robots} robots")
        table = output.table("world", "changes", "homing", "time", "pushing", "time")
        for one in found.robustness:
            table.add_row(one.name, one.changes, *map(text.plain, text.outcome(one.outcome)))
        out.print(table)
    out.print("\nShare of robots with a behaviour of the paper's section VII")
    for label, share in found.behaviours.items():
        out.print(f"  {share:4.0%}  {label}")


def _table_ii_row(row: Outcome, paper: PaperRow | None) -> list[str]:
    homing, home_time, pushing, push_time = text.outcome(row)
    beside = [f"({value})" for value in text.outcome(paper)] if paper else [""] * 4
    cells = [
        str(row.robots),
        *(homing, beside[0], text.percent(row.any_home_rate), text.percent(row.all_home_rate), home_time, beside[1]),
        *(pushing, beside[2], push_time, beside[3]),
    ]
    return [text.plain(cell) for cell in cells]

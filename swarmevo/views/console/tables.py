# SPDX-License-Identifier: BSD-3-Clause
"""Tests on the console: the paper's Table II, ours and the paper's side by side, robustness and behaviours."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Console

from swarmevo.views import text
from swarmevo.views.console import output

if TYPE_CHECKING:
    from swarmevo.analysis.sequential import Until
    from swarmevo.analysis.table_ii import Assessment, Outcome, PaperRow


def show_assessment(found: Assessment, whose: str) -> None:
    """Print the paper's Table II, ours and the paper's side by side, and what else was tested.

    Args:
        found: To print.
        whose: The controllers, in words.
    """
    from swarmevo.analysis.table_ii import PAPER

    out = output.stdout()
    out.print(
        f"{whose}, {text.plain(text.count(found.repeats, 'test'))} each on fresh seeds. "
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
    if found.until:
        _show_verdicts(out, found, found.until)
    out.print("\nShare of robots with a behaviour of the paper's section VII")
    for label, share in found.behaviours.items():
        out.print(f"  {share:4.0%}  {label}")


def _show_verdicts(out: Console, found: Assessment, until: Until) -> None:
    shown = {"above": "yes", "below": "no", "open": "not decided"}
    out.print(
        f"\nIs the {until.rate} rate above {until.limit:g}? A controller is tested until its 95% interval says so"
    )
    table = output.table("robots", "individual", "trial", "above", "tests", until.rate, "95% interval", right=True)
    for one in found.verdicts:
        interval = f"{one.low:.1%} to {one.high:.1%}"
        where = str(one.robots), str(one.genome), str(one.trial)
        table.add_row(*where, shown[one.verdict], str(one.tests), f"{one.rate:.1%}", interval)
    out.print(table)


def _table_ii_row(row: Outcome, paper: PaperRow | None) -> list[str]:
    homing, home_time, pushing, push_time = text.outcome(row)
    beside = [f"({value})" for value in text.outcome(paper)] if paper else [""] * 4
    cells = [
        str(row.robots),
        *(homing, beside[0], text.percent(row.any_home_rate), text.percent(row.all_home_rate), home_time, beside[1]),
        *(pushing, beside[2], push_time, beside[3]),
    ]
    return [text.plain(cell) for cell in cells]

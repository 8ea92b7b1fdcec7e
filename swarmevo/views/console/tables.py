# SPDX-License-Identifier: BSD-3-Clause
"""Tests on the console: as the paper's Table II, with its results beside, or by the task's measures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from swarmevo.views import text
from swarmevo.views.console import output

if TYPE_CHECKING:
    from swarmevo.analysis.sequential import Until
    from swarmevo.analysis.table_ii import Assessment, Outcome, PaperRow


def show_assessment(found: Assessment, whose: str) -> None:
    """Print for each team size what the tests gave, where it can be the paper's Table II too, and what else was tested.

    Args:
        found: To print.
        whose: The controllers, in words.
    """
    out = output.stdout()
    more = "(in brackets: the paper)" if found.measures.paper else "objectives are means with their standard error"
    out.print(
        f"{whose}, {text.plain(text.count(found.repeats, 'test'))} each on fresh seeds. "
        f"Rates are over robots or tests, times means over those that succeeded; {more}"
    )
    if found.changes:
        out.print(f"In another world than that of evolution: {', '.join(found.changes)}")
    out.print(_table_ii(found) if found.measures.paper else _task(found))
    if said := _most_successful(found):
        out.print(said)
    if found.robustness:
        out.print(f"\nRobustness, {found.robustness[0].outcome.robots} robots")
        table = output.table("world", "changes", *_heads(found))
        for one in found.robustness:
            table.add_row(one.name, one.changes, *map(text.plain, text.measured(one.outcome, found.measures)))
        out.print(table)
    if found.until:
        _show_verdicts(out, found, found.until)
    out.print("\nShare of robots with a behaviour")
    for label, share in found.behaviours.items():
        out.print(f"  {share:4.0%}  {label}")


def _table_ii(found: Assessment) -> Table:
    from swarmevo.analysis.table_ii import PAPER

    paper = {row.robots: row for row in PAPER}
    heads = ("robots", "homing", "", "any", "all", "time", "", "pushing", "", "time", "")
    table = output.table(*heads, *map(text.plain, map(text.success, found.measures.successes)), right=True)
    for row in found.rows:
        successes = map(text.percent, row.success_rates.values())
        table.add_row(*_table_ii_row(row, paper.get(row.robots)), *map(text.plain, successes))
    return table


def _task(found: Assessment) -> Table:
    table = output.table("robots", *_heads(found), right=True)
    for row in found.rows:
        table.add_row(str(row.robots), *map(text.plain, text.measured(row, found.measures)))
    return table


def _most_successful(found: Assessment) -> str:
    """Return who succeeded most often; empty: nobody did, or there is one controller or no success alone."""
    if len(found.controllers) < 2 or not found.measures.rates:
        return ""
    best, name = found.most_successful, found.measures.rates[0]
    if not any(one.rate(name) for one in best.outcomes):
        return ""
    rates = ", ".join(f"{100 * one.rate(name):.1f}" for one in best.outcomes)
    sizes = ", ".join(str(one.robots) for one in best.outcomes)
    who = f"individual {best.genome} of trial {best.trial}"
    return text.plain(f"Most successful of them: {who}, {text.words(name)} in {rates} % with {sizes} robots")


def _heads(found: Assessment) -> list[str]:
    objectives = found.rows[0].objectives if found.rows else ()
    pushing = "pushing" if found.measures.one_box else "all delivered"
    heads = text.measured_heads(found.measures, objectives, "homing", pushing)
    return ["time" if head == "time taken" else text.plain(head) for head in heads]


def _show_verdicts(out: Console, found: Assessment, until: Until) -> None:
    shown = {"above": "yes", "below": "no", "open": "not decided"}
    out.print(
        f"\nIs the {text.words(until.rate)} rate above {until.limit:g}? "
        "A controller is tested until its 95% interval says so"
    )
    heads = "robots", "individual", "trial", "above", "tests", text.words(until.rate), "95% interval"
    table = output.table(*heads, right=True)
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

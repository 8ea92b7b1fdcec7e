# SPDX-License-Identifier: BSD-3-Clause
"""A comparison on the console."""

from __future__ import annotations

from typing import TYPE_CHECKING

from swarmevo.views import text
from swarmevo.views.console import output

if TYPE_CHECKING:
    from rich.console import Console

    from swarmevo.analysis.comparison import Comparison
    from swarmevo.views.report.tables import Table


def show_comparison(found: Comparison) -> None:
    """Print the groups, and what they differ by in each measure."""
    from swarmevo.views.compare import page

    out = output.stdout()
    out.print(
        f"Fronts of {len(found.groups)} groups, each controller tested {found.repeats} times on fresh seeds. "
        "Hypervolumes are shares of the product of the objectives' ranges; medians over trials"
    )
    _show(out, page.group_table(found))
    for measure in found.measures:
        any_differs = "" if measure.p is None else f"; that any group differs: p = {page.p_value(measure.p)}"
        out.print(f"\n{text.words(measure.name).capitalize()} of each trial{any_differs}")
        _show(out, page.value_table(measure))
        _show(out, page.pair_table(measure))
    for note in found.notes:
        out.print(f"\n{note}")


def _show(out: Console, content: Table) -> None:
    table = output.table(*content.heads)
    for row in content.rows:
        table.add_row(*(text.plain(str(cell)) for cell in row))
    out.print(table)

# SPDX-License-Identifier: BSD-3-Clause
"""A sweep on the console: what it will cost, how it goes on, what it found."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from rich.progress import BarColumn, TextColumn
from rich.progress import Progress as Bar

from swarmevo.printable import printable
from swarmevo.views import text
from swarmevo.views.console import bars, output

if TYPE_CHECKING:
    from swarmevo.sweeps.outcome import Findings
    from swarmevo.sweeps.planning import Forecast
    from swarmevo.sweeps.runner import Progress

_SHOWN_FAILURES: Final = 10
"""``--json`` has them all."""


@contextmanager
def sweep_progress() -> Iterator[Callable[[Progress], None]]:
    """Show how a sweep goes on: a live bar on a terminal, a line for each run that ends elsewhere; failures on both."""
    if (console := bars.terminal()) is None:
        yield lambda now: print(_line(now), file=sys.stderr, flush=True) if now.cell else None
        return
    columns = (BarColumn(bar_width=None), TextColumn("{task.description}", markup=False))
    with Bar(*columns, console=console, expand=True) as bar:
        task = bar.add_task("starting", total=None)

        def observe(now: Progress) -> None:
            left = "" if now.eta_seconds is None else f"  ETA {text.clock(now.eta_seconds)}"
            said = f"{now.ended} of {now.runs} runs{left}"
            bar.update(task, completed=now.generations, total=now.generations_planned, description=said)
            if now.failed:
                console.print(_line(now), markup=False, highlight=False)

        yield observe


def _line(now: Progress) -> str:
    assert now.cell is not None
    left = "" if now.eta_seconds is None else f", {text.clock(now.eta_seconds)} left"
    what = f"failed: {now.failed}" if now.failed else "complete"
    return printable(f"run {now.ended}/{now.runs}, {now.cell.name}: {what}{left}")


def show_sweep(found: Findings) -> None:
    """Print a row for each setting."""
    from swarmevo.views.sweep import page

    out = output.stdout()
    runs, done = len(found.seeds) * len(found.rows), sum(run.complete for row in found.rows for run in row.runs)
    out.print(
        f"{found.sweep}: {done} of {runs} runs are complete. Medians over trials, by the episodes of evolution; "
        "hypervolumes are shares of the product of the objectives' ranges"
    )
    content = page.table(found)
    table = output.table(*content.heads, right=True)
    for row in content.rows:
        table.add_row(*(text.plain(str(cell)) for cell in row))
    out.print(table)
    failures = page.failures(found)
    for line in failures[:_SHOWN_FAILURES]:
        out.print(f"failed: {line}")
    if (more := len(failures) - _SHOWN_FAILURES) > 0:
        out.print(f"and {more} more runs failed; --json lists them")


def show_sweep_forecast(forecast: Forecast) -> None:
    """Print what a sweep will cost."""
    out = output.stdout()
    table = output.table("setting", "episodes", "simulated", "time", right=True)
    for name, cost in forecast.settings:
        table.add_row(name, str(cost.episodes), text.clock(cost.simulated_seconds), text.clock(cost.wall_seconds))
    out.print(table)
    out.print(
        f"{text.count(forecast.runs, 'run')}, {forecast.episodes} episodes, {text.clock(forecast.simulated_seconds)} "
        f"simulated\n{text.clock(forecast.wall_seconds)} in all on {forecast.workers} workers, measured with random "
        "genomes; evolved teams pressing on the box may take several times longer\nnothing was written"
    )

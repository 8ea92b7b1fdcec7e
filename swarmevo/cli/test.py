# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo test``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmevo.cli import streams
from swarmevo.cli.common import AsJson, OtherWorld, Run, Workers, app, interruptible, say, team_sizes, worker_count

if TYPE_CHECKING:
    from swarmevo.analysis.table_ii import Assessment


@app.command("test")
def assess(
    run: Run,
    robots: Annotated[str, typer.Option(metavar="N|N-M", help="Team sizes: rows of the table.")] = "1-5",
    repeats: Annotated[int, typer.Option(metavar="N", min=1, max=65535, help="Tests of each controller.")] = 5,
    robustness: Annotated[bool, typer.Option("--robustness", help="Also other noise, starts and bumpers.")] = False,
    settings: OtherWorld = None,
    workers: Workers = "auto",
    as_json: AsJson = False,
) -> None:
    """Test the fronts' controllers on fresh seeds, in teams of several sizes: the paper's Table II."""
    from swarmevo.analysis import assessment, table_ii
    from swarmevo.runs.store import Store
    from swarmevo.views import console

    sizes, count = team_sizes(robots), worker_count(workers)
    with Store.open(run) as store, interruptible("nothing was stored") as stop, console.tests() as observe:
        found = assessment.assess(store, sizes, repeats, robustness, count, observe, stop, settings or [])
    try:
        if as_json:
            print(table_ii.as_json(found), file=streams.data())
        else:
            console.show_assessment(found)
    finally:  # printed first, for a run may be read-only; stored even where nobody reads what is printed
        fate = _keep(found, run)
    say(fate)


def _keep(found: Assessment, run: Path) -> str:
    """Store what was found, unless it is not the run's or something richer is stored; return what became of it."""
    from swarmevo.analysis import table_ii

    if found.changes:
        return "not stored, being of another world"
    if lost := table_ii.lost_by_saving(found, run):
        file = run / table_ii.FILE
        return f"not stored: {file} holds more ({', '.join(lost)}); to store this instead, move that file away"
    return f"stored in {table_ii.save(found, run)}"

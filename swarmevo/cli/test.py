# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo test``."""

from __future__ import annotations

from typing import Annotated

import typer

from swarmevo.cli import streams
from swarmevo.cli.common import AsJson, OtherWorld, Run, Workers, app, interruptible, say, team_sizes, worker_count


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
        fate = "not stored, being of another world" if found.changes else f"stored in {table_ii.save(found, run)}"
    say(fate)

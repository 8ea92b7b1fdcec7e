# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo verify``."""

from __future__ import annotations

from typing import Annotated

import typer

from swarmevo.cli.common import FAILED, AsJson, Run, Workers, app, examples, interruptible, worker_count


@app.command(epilog=examples("swarmevo verify runs/first", "swarmevo verify runs/first --sample 100"))
def verify(
    run: Run,
    sample: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Simulate only so many evaluations, and so many tests, drawn at random."),
    ] = None,
    workers: Workers = "auto",
    as_json: AsJson = False,
) -> None:
    """Simulate a run anew and say what differs, and why.

    Its evaluations and tests are simulated; the exit code is 1 where something differs.
    """
    from swarmevo.runs import verification
    from swarmevo.runs.store import Store
    from swarmevo.views import console

    count = worker_count(workers)
    with Store.open(run) as store, interruptible() as stop, console.evaluations() as observe:
        report = verification.verify(store, count, sample, observe, stop)
    console.show_verification(report, as_json)
    if not report.is_sound:
        raise SystemExit(FAILED)

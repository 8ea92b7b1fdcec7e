# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo report``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from swarmevo.cli.common import USAGE, app, examples, exit_with, say, say_changed_plugins, without_effect


@app.command(
    epilog=examples(
        "swarmevo report runs/first", "swarmevo report runs/pde runs/cma --html both.html --figures figures"
    )
)
def report(
    context: typer.Context,
    runs: Annotated[
        list[Path],
        typer.Argument(metavar="RUN...", help="The folders of one or more runs.", exists=True, file_okay=False),
    ],
    html: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Write to this file, whose folder is made; default: report.html in the run folder.",
            show_default=False,
        ),
    ] = None,
    figures: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Write the figures to this folder as well, which is made, as PDF and PNG.",
            show_default=False,
        ),
    ] = None,
    width: Annotated[
        float,
        typer.Option(metavar="INCHES", help="The width of the figures: 3.5 for a column, 7 for a page.", min=2, max=20),
    ] = 3.5,
) -> None:
    """Write one HTML page about runs, with replays to click on. It needs no network."""
    from swarmevo.runs.store import Store
    from swarmevo.runs.tests_file import TESTS_FILE
    from swarmevo.views.report import page as report

    if not figures:
        without_effect(context, "without --figures", "width")
    if html is None and len(runs) > 1:
        exit_with(USAGE, "--html: expected a file for the report of several runs, got none")
    for run in runs:
        if os.path.exists(run / "table_ii.json") and not os.path.exists(run / TESTS_FILE):
            say(f"{run}: table_ii.json is of an earlier version and not read; make it anew with: swarmevo test {run}")
        with Store.open(run) as store:
            say_changed_plugins(store)
    print(report.write(runs, html or runs[0] / report.FILE, say))
    for path in report.write_figures(runs, figures, width) if figures else []:
        print(path)

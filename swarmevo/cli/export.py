# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo export``."""

from __future__ import annotations

import json
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TextIO, cast

import typer

from swarmevo.cli import streams
from swarmevo.cli.common import USAGE, Run, app, examples, exit_with, say_changed_plugins, without_effect

if TYPE_CHECKING:
    from swarmevo.runs.store import Store


@app.command(
    epilog=examples(
        "swarmevo export runs/first --csv --out episodes.csv",
        "swarmevo export runs/first --controller 31 --as epuck --out controller.c",
    )
)
def export(
    context: typer.Context,
    run: Run,
    as_csv: Annotated[bool, typer.Option("--csv", help="Write every episode as a line of CSV.")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Write configuration, provenance, genomes and episodes as JSON.")
    ] = False,
    controller: Annotated[
        int | None, typer.Option(metavar="ID", help="Write the controller of the individual with this id.")
    ] = None,
    form: Annotated[
        str,
        typer.Option(
            "--as", metavar="json|epuck|webots", help="Write the controller in this format; epuck and webots are C99."
        ),
    ] = "json",
    robot: Annotated[
        int, typer.Option(metavar="N", help="Write the controller of this robot, where each has its own.")
    ] = 0,
    infrared: Annotated[
        str,
        typer.Option(
            metavar="evolved|2013|2022",
            help="Give the infrared sensors in Webots the table evolved with, or that of its E-puck of this year.",
        ),
    ] = "evolved",
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="PATH",
            help="Write this file, or the folder of a Webots project; default: stdout, the controller alone for it.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Write a run, or one of its controllers, for other programs."""
    from swarmevo.runs import files
    from swarmevo.runs.store import Store

    if as_csv + as_json + (controller is not None) != 1:
        exit_with(USAGE, "export: expected one of --csv, --json and --controller ID")
    _check_form(context, controller, form, infrared, out)
    with Store.open(run) as store:
        if controller is not None:
            say_changed_plugins(store)
        if form == "webots" and out is not None:
            _write_project(store, controller or 0, infrared, out)
            return
        text = "" if controller is None else _controller(store, controller, form, robot, infrared)
        with ExitStack() as opened:
            if out:
                opened.enter_context(files.folder_made(out.parent))
            stream = opened.enter_context(files.opened(out, fresh_only=True)) if out else streams.data()
            _write(store, stream, text, as_csv)


def _check_form(context: typer.Context, controller: int | None, form: str, infrared: str, out: Path | None) -> None:
    """Exit if an option is wrong, or would change nothing."""
    if controller is None:
        without_effect(context, "without --controller", "form", "robot")
    if form == "json":
        without_effect(context, "without --as epuck or webots", "robot")
    if form != "webots":
        without_effect(context, "without --as webots", "infrared")
    elif out is not None:
        without_effect(context, "in a Webots project, which has all robots", "robot")
    if form not in ("json", "epuck", "webots"):
        exit_with(USAGE, f"--as: expected json, epuck or webots, got {form!r}")
    if infrared not in ("evolved", "2013", "2022"):
        exit_with(USAGE, f"--infrared: expected evolved, 2013 or 2022, got {infrared!r}")


def _write_project(store: Store, genome: int, infrared: str, out: Path) -> None:
    from swarmevo.runs.export import webots_project
    from swarmevo.runs.webots.tables import Infrared

    webots_project(store, genome, out, cast(Infrared, infrared))


def _controller(store: Store, genome: int, form: str, robot: int, infrared: str) -> str:
    from swarmevo.runs import export
    from swarmevo.runs.webots.tables import Infrared

    if form == "json":
        return json.dumps(export.controller(store, genome), indent=1) + "\n"
    target: export.Target = "epuck" if form == "epuck" else "webots"
    return export.source(store, genome, target, robot, cast(Infrared, infrared))


def _write(store: Store, stream: TextIO, text: str, as_csv: bool) -> None:
    from swarmevo.runs import export

    if text:
        stream.write(text)
    elif as_csv:
        export.write_csv(store, stream)
    else:
        export.write_json(store, stream)

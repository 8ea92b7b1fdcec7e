# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo export``."""

from __future__ import annotations

import json
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TextIO

import typer

from swarmevo.cli import streams
from swarmevo.cli.common import USAGE, Run, app, exit_with, say_changed_plugins, without_effect

if TYPE_CHECKING:
    from swarmevo.runs.store import Store


@app.command()
def export(
    context: typer.Context,
    run: Run,
    as_csv: Annotated[bool, typer.Option("--csv", help="Every episode, one line each.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Configuration, provenance, genomes and episodes.")] = False,
    controller: Annotated[int | None, typer.Option(metavar="ID", help="The genome with this id.")] = None,
    form: Annotated[
        str,
        typer.Option("--as", metavar="json|epuck|webots", help="Format of the controller; epuck and webots are C99."),
    ] = "json",
    robot: Annotated[int, typer.Option(metavar="N", help="The robot, if each has its own controller.")] = 0,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Output file; default: stdout.", show_default=False)
    ] = None,
) -> None:
    """Write a run, or one of its controllers, for other programs."""
    from swarmevo.runs import files
    from swarmevo.runs.store import Store

    if as_csv + as_json + (controller is not None) != 1:
        exit_with(USAGE, "export: expected one of --csv, --json and --controller ID")
    if controller is None:
        without_effect(context, "without --controller", "form", "robot")
    if form == "json":
        without_effect(context, "without --as epuck or webots", "robot")
    if form not in ("json", "epuck", "webots"):
        exit_with(USAGE, f"--as: expected json, epuck or webots, got {form!r}")
    with Store.open(run) as store:
        if controller is not None:
            say_changed_plugins(store)
        text = "" if controller is None else _controller(store, controller, form, robot)
        with files.opened(out, fresh_only=True) if out else nullcontext(streams.data()) as stream:
            _write(store, stream, text, as_csv)


def _controller(store: Store, genome: int, form: str, robot: int) -> str:
    from swarmevo.runs import export

    if form == "json":
        return json.dumps(export.controller(store, genome), indent=1) + "\n"
    return export.source(store, genome, "epuck" if form == "epuck" else "webots", robot)


def _write(store: Store, stream: TextIO, text: str, as_csv: bool) -> None:
    from swarmevo.runs import export

    if text:
        stream.write(text)
    elif as_csv:
        export.write_csv(store, stream)
    else:
        export.write_json(store, stream)

# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo sweep``; and ``show`` and ``resume`` of a sweep."""

from __future__ import annotations

import dataclasses
import json
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmevo.cli import streams
from swarmevo.cli.common import (
    FAILED,
    AsJson,
    DryRun,
    Workers,
    app,
    examples,
    exit_with,
    interruptible,
    say,
    without_effect,
    worker_count,
)
from swarmevo.cli.evolve import Log, Scheduler, check_scheduler

if TYPE_CHECKING:
    from swarmevo.sweeps.folder import Sweep
    from swarmevo.sweeps.outcome import Findings


@app.command(
    epilog=examples(
        "swarmevo sweep paper --grid noise.infrared=0,0.1 team.robots=3,5 --seeds 1-10 --out noise",
        "swarmevo sweep my.yaml --grid optimiser=pde,cma --set evolution.trials=1 --dry-run",
    )
)
def sweep(
    context: typer.Context,
    config: Annotated[
        str | None,
        typer.Argument(
            metavar="CONFIG",
            help="A YAML file, or the name of a configuration that comes with swarmevo, such as paper; default: quick.",
        ),
    ] = None,
    grid: Annotated[
        list[str] | None,
        typer.Option(
            "--grid",
            metavar="SECTION.KEY=VALUE,VALUE ...",
            help="Give this key each of these values, which are YAML; of several keys, in all combinations.",
            show_default=False,
        ),
    ] = None,
    seeds: Annotated[
        str, typer.Option(metavar="N-N|N,N", help="Evolve with each setting once for each of these seeds.")
    ] = "1-5",
    workers: Workers = "auto",
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="SECTION.KEY=VALUE ...",
            help="Override the configuration of all settings; values are YAML.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Make the sweep in this folder, or go on with the one there, perhaps with more seeds or values; "
            "default: a new one in runs.",
            show_default=False,
        ),
    ] = None,
    scheduler: Scheduler = None,
    log: Log = None,
    dry_run: DryRun = False,
    as_json: AsJson = False,
) -> None:
    """Evolve with each setting of a grid and each seed.

    Each has a run folder, as many evolve at once as there are workers, and one table tells what came of them. However a
    sweep ends, the same command with --out, or swarmevo resume DIR, goes on with it. swarmevo show DIR prints the
    table, swarmevo compare DIR tests whether settings differ.
    """
    from swarmevo.plugins import trackers
    from swarmevo.sweeps import extension, planning
    from swarmevo.sweeps import folder as folders
    from swarmevo.sweeps import grid as grids
    from swarmevo.sweeps.folder import Sweep

    count = worker_count(workers)
    if scheduler:
        without_effect(context, "with --scheduler", "dry_run")
    trackers.check(log or [])
    numbers, name = grids.parse_seeds(seeds), Path(config or "quick").stem
    found = planning.settings(config, settings or [], grids.parse(grid or []), numbers)
    there = folders.begun(out)
    found, numbers = extension.extended(there, found, numbers)
    tried = there.settings if there else []
    is_more = there is None or (len(found), len(numbers)) != (len(tried), len(there.seeds))
    if scheduler and is_more:
        check_scheduler(scheduler)
    with interruptible("nothing was written") as stop:
        found = planning.rehearsed(found, numbers[0], stop, tried)
    if dry_run:
        from swarmevo.views.console.sweeps import show_sweep_forecast

        show_sweep_forecast(planning.forecast(found, numbers, count))
        return
    whole = Sweep(out or folders.fresh(name), found, numbers)
    whole.create(there)
    go_on(whole, count, scheduler, log or [], as_json)


def go_on(
    sweep: Sweep,
    workers: int,
    scheduler: str | None,
    log: list[str],
    as_json: bool = False,
    accept_changed_plugin: bool = False,
) -> None:
    """Bring a sweep to its end and show it; when that fails, say how to go on."""
    from swarmevo.errors import OutputError
    from swarmevo.sweeps import runner
    from swarmevo.sweeps.folder import PAGE
    from swarmevo.views.console.sweeps import sweep_progress
    from swarmevo.views.sweep import page

    place = shlex.quote(str(sweep.folder))
    how = f"go on with: swarmevo resume {place}" + (f" --scheduler {shlex.quote(scheduler)}" if scheduler else "")
    say(f"sweep {sweep.folder}: {len(sweep.settings)} settings, {len(sweep.seeds)} seeds")
    try:
        with interruptible(how) as stop, sweep_progress() as observe:
            found = runner.run(sweep, workers, observe, stop, scheduler, log, accept_changed_plugin)
    except Exception:
        say(how)
        raise
    show_findings(found, as_json)
    try:
        say(f"written: {page.write(found, sweep.folder / PAGE)}")
    except OutputError as error:  # the table is there, and what failed is still to be told
        say(f"warning: no page: {error}")
    if failed := sum(len(row.failed) for row in found.rows):
        exit_with(FAILED, f"{failed} of {len(sweep.cells)} runs failed; {how}")
    if len(sweep.settings) > 1 and sweep.is_of_one_task:
        say(f"test whether they differ with: swarmevo compare {place}")


def show_findings(found: Findings, as_json: bool) -> None:
    """Print the table of a sweep, or all of it."""
    if as_json:
        print(json.dumps(dataclasses.asdict(found), indent=2, allow_nan=False), file=streams.data())
        return
    from swarmevo.views.console.sweeps import show_sweep

    show_sweep(found)

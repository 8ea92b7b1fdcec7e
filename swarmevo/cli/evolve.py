# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo evolve`` and ``swarmevo resume``."""

from __future__ import annotations

import json
import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmevo.cli.common import (
    USAGE,
    DryRun,
    Run,
    Workers,
    app,
    examples,
    exit_with,
    interruptible,
    say,
    say_how_it_was_left,
    without_effect,
    worker_count,
)
from swarmevo.cli.usage import listing

if TYPE_CHECKING:
    from swarmevo.config import Config
    from swarmevo.evolution.threads import MakeBackend

Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Run episodes on a Dask cluster, whose scheduler is there, such as tcp://host:8786.",
        show_default=False,
    ),
]

Log = Annotated[
    list[str] | None,
    typer.Option(
        "--log",
        metavar="TRACKER",
        help="Log each generation with this tracker, such as tensorboard; swarmevo plugins lists them.",
        show_default=False,
    ),
]


@app.command(
    epilog=examples(
        "swarmevo evolve quick --seed 1 --out runs/first",
        "swarmevo evolve paper --trials 3 --set evolution.generations=50 noise.infrared=0.1",
        "swarmevo evolve my.yaml --plugin nsga2 --dry-run",
    )
)
def evolve(
    context: typer.Context,
    config: Annotated[
        str | None,
        typer.Argument(
            metavar="CONFIG",
            help="A YAML file, or the name of a configuration that comes with swarmevo, such as paper; default: quick.",
        ),
    ] = None,
    plugin: Annotated[
        str | None, typer.Option(metavar="NAME", help="Use this optimiser; swarmevo plugins lists them.")
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(metavar="N", help="Seed of all that is random; one is drawn and printed if none is given."),
    ] = None,
    trials: Annotated[int | None, typer.Option(metavar="N", help="Evolve so many times, independently.")] = None,
    start: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|RUN[:ID]",
            help="Begin from genomes of a JSON or CSV file, or of another run.",
            show_default=False,
        ),
    ] = None,
    workers: Workers = "auto",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="SECTION.KEY=VALUE ...", help="Override the configuration; values are YAML."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Make the run in this folder, which must not exist; default: a new one in runs.",
            show_default=False,
        ),
    ] = None,
    scheduler: Scheduler = None,
    log: Log = None,
    dry_run: DryRun = False,
) -> None:
    """Evolve controllers and print their Pareto front.

    Every episode is kept in a run folder, with which an interrupted evolution goes on.
    """
    from swarmevo.config import seeded
    from swarmevo.plugins import trackers
    from swarmevo.plugins.team import load_config

    count = worker_count(workers)
    if scheduler:
        without_effect(context, "with --scheduler", "workers", "dry_run")
    if out is not None and os.path.lexists(out):
        exit_with(USAGE, f"--out {out}: exists already and is never overwritten; choose another name")
    given = {"optimiser": plugin and json.dumps(plugin), "evolution.seed": seed, "evolution.trials": trials}
    given |= {"evolution.start": start and json.dumps(start)}
    overrides = [f"{key}={value}" for key, value in given.items() if value is not None] + (settings or [])
    chosen = seeded(load_config(config, overrides))
    trackers.check(log or [])
    if dry_run:
        _forecast(chosen, count)
        return

    from swarmevo.runs import driver

    if scheduler:
        check_scheduler(scheduler)
    with interruptible("nothing was written") as stop:
        folder = driver.begin(out, chosen, stop, Path(config or "quick").stem)
    say(f"run {folder}, seed {chosen.evolution.seed}")
    _go_on(folder, count, scheduler, log or [])


@app.command(epilog=examples("swarmevo resume runs/first", "swarmevo resume runs/first --generations +50"))
def resume(
    context: typer.Context,
    run: Run,
    workers: Workers = "auto",
    generations: Annotated[
        str | None,
        typer.Option(metavar="+N|N", help="Make the run longer: by so many generations, or to so many in all."),
    ] = None,
    scheduler: Scheduler = None,
    log: Log = None,
    accept: Annotated[
        bool, typer.Option("--accept-changed-plugin", help="Go on though a plugin was changed since the last session.")
    ] = False,
) -> None:
    """Go on with a run or a sweep, or make a run longer.

    The result is that of one that was never interrupted.
    """
    from swarmevo.sweeps import folder

    count = worker_count(workers)
    if folder.is_sweep(run):
        from swarmevo.cli import sweep

        without_effect(context, "on a sweep", "generations")
        sweep.go_on(folder.Sweep.open(run), count, scheduler, log or [], accept_changed_plugin=accept)
        return
    if scheduler:
        without_effect(context, "with --scheduler", "workers")
    if generations is not None:
        _extend(run, generations, accept)
    _go_on(run, count, scheduler, log or [], accept)


def _forecast(config: Config, workers: int) -> None:
    from swarmevo.analysis import fronts
    from swarmevo.evolution import loop
    from swarmevo.evolution.evaluation import Evaluator
    from swarmevo.runs import driver
    from swarmevo.views import console

    loop.rehearse(config)
    with Evaluator(config, workers) as evaluator:
        driver.check_names(evaluator)
        driver.resolved_start(config, evaluator)
        console.show_forecast(fronts.forecast(config, evaluator, workers))


def _extend(folder: Path, generations: str, accept_changed_plugin: bool) -> None:
    from swarmevo.runs import driver
    from swarmevo.runs.store import Store

    with Store.open(folder, readonly=False) as store:
        say_how_it_was_left(store)
        total = driver.extend(store, generations, accept_changed_plugin)
    say(f"{folder}: {total} generations in each trial")


def _go_on(
    folder: Path, workers: int, scheduler: str | None, log: list[str], accept_changed_plugin: bool = False
) -> None:
    """Bring a run to its end and show it; when that fails, say how to go on."""
    from swarmevo.analysis import fronts, tracking
    from swarmevo.runs import driver
    from swarmevo.runs.store import Store
    from swarmevo.views import console

    how = f"go on with: swarmevo resume {shlex.quote(str(folder))}"
    if scheduler:
        how += f" --scheduler {shlex.quote(scheduler)}"
    with Store.open(folder, readonly=False) as store:
        say_how_it_was_left(store)
        try:
            with (
                interruptible(how) as stop,
                console.progress(*fronts.generations(store)) as show,
                tracking.tracked(store, log, show, say) as observe,
            ):
                driver.evolve(store, workers, observe, stop, _backend(scheduler), accept_changed_plugin)
        except Exception:
            if store.is_in_place and (store.trials() or scheduler):
                say(how)
            raise
        console.show_run(fronts.summarise(store))
    _say_what_next(folder)


def _say_what_next(folder: Path) -> None:
    """Print the commands that a finished run is looked at with."""
    run = shlex.quote(str(folder))
    say("next:")
    rows = [
        (f"swarmevo report {run}", "its front and its replays as a page to open"),
        (f"swarmevo replay {run}", "the most successful of its front in 3-D"),
        (f"swarmevo test {run}", "its front on fresh seeds; those above are a bit too good"),
    ]
    for line in listing(rows):
        say(line)


def check_scheduler(scheduler: str) -> None:
    """Refuse a scheduler that does not answer, before a folder is made."""
    from swarmevo.evolution import cluster

    cluster.check(scheduler)


def _backend(scheduler: str | None) -> MakeBackend:
    """Return where episodes run: here, or on a cluster."""
    from swarmevo.evolution.threads import ThreadBackend

    if scheduler is None:
        return ThreadBackend
    from swarmevo.evolution import cluster

    return cluster.backend(scheduler, say)

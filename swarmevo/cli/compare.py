# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo compare``."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Annotated, Final

import typer

from swarmevo.cli import streams
from swarmevo.cli.common import (
    USAGE,
    AsJson,
    Workers,
    app,
    examples,
    exit_with,
    interruptible,
    say,
    say_changed_plugins,
    worker_count,
)

_MOST_NAMED: Final = 3
"""Runs of a pooled group that its name has."""


@app.command(
    epilog=examples(
        "swarmevo compare runs/pde runs/cma --html pde-cma.html",
        "swarmevo compare runs/pde-1 runs/pde-2 --against runs/cma-1 runs/cma-2 --json",
    )
)
def compare(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN...",
            help="The folders of the runs; a folder of runs, or a sweep, stands for all in it.",
            exists=True,
            file_okay=False,
        ),
    ],
    against: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="RUN...",
            help="Hold those that directly follow this as one group against all others, as another.",
            show_default=False,
        ),
    ] = None,
    repeats: Annotated[
        int, typer.Option(metavar="N", min=1, max=65535, help="Test each controller so many times, on fresh seeds.")
    ] = 10,
    html: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Write a page to this file as well, whose folder is made.", show_default=False
        ),
    ] = None,
    workers: Workers = "auto",
    as_json: AsJson = False,
) -> None:
    """Hold runs of one task against each other.

    Their fronts are tested again, and there are hypervolume, effect sizes and p-values. Each run is a group of trials,
    and so are all runs of a folder of runs; a sweep has a group for each setting. With --against there are two groups:
    those that directly follow it, and all others.
    """
    from swarmevo.analysis import comparison
    from swarmevo.runs.store import Store

    groups = _groups(runs, against or [])
    with contextlib.ExitStack() as opened:
        stores = {
            name: [opened.enter_context(Store.open(folder)) for folder in folders] for name, folders in groups.items()
        }
        for store in (one for members in stores.values() for one in members):
            say_changed_plugins(store)
        with interruptible("what was tested is stored; once more goes on from there") as stop:
            found = comparison.compare(stores, repeats, worker_count(workers), say, stop)
    if as_json:
        print(comparison.as_json(found), file=streams.data())
    else:
        from swarmevo.views.console.comparison import show_comparison

        show_comparison(found)
    if html is not None:
        from swarmevo.views.compare import page

        say(f"written: {page.write(found, html)}")


def _groups(runs: list[Path], against: list[Path]) -> dict[str, list[Path]]:
    """Return the folders of each group, by a name that no other has."""
    from swarmevo.sweeps import folder as folders

    ours, theirs = folders.groups(runs), folders.groups(against)
    every = [folder.resolve() for group in (*ours, *theirs) for folder in folders.runs_of(group)]
    for folder in every:
        if every.count(folder) > 1:
            exit_with(USAGE, f"{folder}: expected each run once, got it twice; leave one out")
    if not against and len(ours) < 2:
        exit_with(USAGE, "compare: expected at least two runs, got one; name another")
    from swarmevo.views.report.page import names

    called = names([*ours, *theirs])
    if not against:
        return {name: folders.runs_of(group) for name, group in zip(called, ours, strict=True)}
    sides = {_pooled(called[: len(ours)]): ours, _pooled(called[len(ours) :]): theirs}
    return {name: [run for group in side for run in folders.runs_of(group)] for name, side in sides.items()}


def _pooled(names: list[str]) -> str:
    return "+".join(names) if len(names) <= _MOST_NAMED else f"{names[0]}+{len(names) - 1} more"

# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo test``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from swarmevo.cli import streams
from swarmevo.cli.common import (
    USAGE,
    AsJson,
    OtherWorld,
    Workers,
    app,
    exit_with,
    interruptible,
    run_and_individual,
    say,
    team_sizes,
    without_effect,
    worker_count,
)

if TYPE_CHECKING:
    from swarmevo.analysis.sequential import Until
    from swarmevo.analysis.table_ii import Assessment
    from swarmevo.runs.tests import StoredTests


@app.command("test")
def assess(
    context: typer.Context,
    run: Annotated[
        str, typer.Argument(metavar="RUN[:ID]", help="A run folder, and an individual; default: its fronts.")
    ],
    robots: Annotated[str, typer.Option(metavar="N|N-M", help="Team sizes: rows of the table.")] = "1-5",
    repeats: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=1, max=65535, help="Tests of each controller; default: 5, with --until 1000 at most."
        ),
    ] = None,
    until: Annotated[
        float | None, typer.Option(metavar="RATE", help="Test each until its 95 % interval is above or below.")
    ] = None,
    rate: Annotated[str, typer.Option(metavar="push|homing", help="Of --until.")] = "push",
    robustness: Annotated[bool, typer.Option("--robustness", help="Also other noise, starts and bumpers.")] = False,
    settings: OtherWorld = None,
    workers: Workers = "auto",
    as_json: AsJson = False,
) -> None:
    """Test the fronts' controllers on fresh seeds, in teams of several sizes: the paper's Table II. Tests add up."""
    from swarmevo.analysis import assessment, sequential
    from swarmevo.runs.store import Store
    from swarmevo.runs.tests import StoredTests
    from swarmevo.views import console

    sizes, count = team_sizes(robots), worker_count(workers)
    wanted = _until(until, rate)
    if wanted is None:
        without_effect(context, "without --until", "rate")
    most = repeats or (sequential.MOST if wanted else assessment.REPEATS)
    folder, genome = run_and_individual(run)
    with Store.open(folder) as store, StoredTests.open(store, readonly=False) as tests:
        if tests.rerun:
            say(f"warning: {tests.file}: {tests.rerun} tests were damaged, and are run again")
        with interruptible(_kept(tests)) as stop, console.tests() as observe:
            found = assessment.assess(
                store, sizes, most, robustness, count, observe, stop, settings or [], wanted, genome, tests
            )
        fate = _fate(tests)
    whose = (
        f"Individual {genome}" if genome is not None else f"{len(found.controllers)} controllers of all trials' fronts"
    )
    try:
        _show(found, whose, as_json)
    finally:  # said even where nobody reads what is printed
        say(fate)


def _show(found: Assessment, whose: str, as_json: bool) -> None:
    from swarmevo.analysis import table_ii
    from swarmevo.views import console

    if as_json:
        print(table_ii.as_json(found), file=streams.data())
    else:
        console.show_assessment(found, whose)


def _until(limit: float | None, rate: str) -> Until | None:
    from swarmevo.analysis.sequential import RATES, Until

    chosen = next((known for known in RATES if known == rate), None)
    if chosen is None:
        exit_with(USAGE, f"--rate: expected {' or '.join(RATES)}, got {rate!r}")
    if limit is None:
        return None
    if not 0 < limit < 1:
        exit_with(USAGE, f"--until: expected a rate between 0 and 1, got {limit:g}")
    return Until(limit, chosen)


def _kept(tests: StoredTests) -> str:
    """Return what becomes of tests that were interrupted."""
    return "nothing was stored" if tests.not_stored else "what was tested is stored; once more goes on from there"


def _fate(tests: StoredTests) -> str:
    """Return what became of what was found."""
    if tests.not_stored:
        return f"not stored: {tests.not_stored}"
    return f"stored in {tests.file}" if tests.added else f"all of it was stored before, in {tests.file}"

# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo test``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, TypedDict

import typer

from swarmevo.cli import streams
from swarmevo.cli.common import (
    USAGE,
    AsJson,
    OtherWorld,
    Workers,
    app,
    examples,
    exit_with,
    interruptible,
    run_and_individual,
    say,
    say_changed_plugins,
    team_sizes,
    without_effect,
    worker_count,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from swarmevo.analysis.sequential import Until
    from swarmevo.analysis.table_ii import Assessment
    from swarmevo.config import Config
    from swarmevo.protocols import Objective
    from swarmevo.runs.tests import StoredTests


@app.command(
    "test",
    epilog=examples(
        "swarmevo test runs/first --repeats 100",
        "swarmevo test runs/first:31 --robots 3-5 --until 0.97",
        "swarmevo test --genome best.json paper --set noise.infrared=0.1",
    ),
)
def assess(
    context: typer.Context,
    run: Annotated[
        str | None,
        typer.Argument(
            metavar="RUN[:ID]",
            help="The folder of a run, and the id of an individual; default: those of its fronts. With --genome a "
            "configuration.",
            show_default=False,
        ),
    ] = None,
    genome: Annotated[
        str | None,
        typer.Option(metavar="FILE|RUN[:ID]", help="Test controllers of a JSON or CSV file, or of another run."),
    ] = None,
    robots: Annotated[
        str | None,
        typer.Option(
            metavar="N|N-M",
            help="Test teams of these sizes, each a row of the table; default: 1-5, and the size that was evolved.",
            show_default=False,
        ),
    ] = None,
    repeats: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=1,
            max=65535,
            help="Test each controller so many times; default: 5, with --until 1000 at most.",
        ),
    ] = None,
    until: Annotated[
        float | None,
        typer.Option(metavar="RATE", help="Test each until its 95 % interval is above or below this rate."),
    ] = None,
    rate: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Which rate --until means: push (all_delivered where it is not one box), homing, or an objective's; "
            "default: the task's first.",
            show_default=False,
        ),
    ] = None,
    robustness: Annotated[
        bool, typer.Option("--robustness", help="Test with other noise, starts and bumpers as well.")
    ] = False,
    settings: OtherWorld = None,
    workers: Workers = "auto",
    as_json: AsJson = False,
) -> None:
    """Test the fronts' controllers on fresh seeds.

    Tests of teams of several sizes add up from one command to the next. In the paper's scene this is its Table II, in
    others what they have of sources, goals and objectives.
    """
    from swarmevo.analysis import assessment, sequential

    wanted = _until(until, rate)
    if wanted is None:
        without_effect(context, "without --until", "rate")
    tests = _Wanted(
        sizes=None if robots is None else team_sizes(robots),
        repeats=repeats or (sequential.MOST if wanted else assessment.REPEATS),
        robustness=robustness,
        workers=worker_count(workers),
        until=wanted,
    )
    if genome is not None:
        found, whose, fate = _of_no_run(run, genome, settings or [], tests)
    elif run is not None:
        found, whose, fate = _of_run(run, settings or [], tests)
    else:
        exit_with(USAGE, "test: expected a run folder, or --genome FILE; got neither")
    try:
        _show(found, whose, as_json)
    finally:  # said even where nobody reads what is printed
        say(fate)


class _Wanted(TypedDict):
    """What shall be tested."""

    sizes: list[int] | None
    repeats: int
    robustness: bool
    workers: int
    until: Until | None


def _of_run(run: str, settings: list[str], wanted: _Wanted) -> tuple[Assessment, str, str]:
    """Test controllers of a run; return what was found, whose it is, and what became of it, in words."""
    from swarmevo.analysis import assessment
    from swarmevo.runs.store import Store
    from swarmevo.runs.tests import StoredTests
    from swarmevo.views import console

    folder, individual = run_and_individual(run)
    with Store.open(folder) as store, StoredTests.open(store, readonly=False) as tests:
        say_changed_plugins(store)
        _settle(wanted, store.config, store.objectives)
        if tests.rerun:
            say(f"warning: {tests.file}: {tests.rerun} tests were damaged, and are run again")
        with interruptible(_kept(tests)) as stop, console.tests() as observe:
            found = assessment.assess(
                store, **wanted, observe=observe, stop=stop, overrides=settings, genome=individual, tests=tests
            )
        everybody = f"{len(found.controllers)} controllers of all trials' fronts"
        return found, everybody if individual is None else f"Individual {individual}", _fate(tests)


def _of_no_run(config: str | None, source: str, settings: list[str], wanted: _Wanted) -> tuple[Assessment, str, str]:
    """Test controllers from outside; return as :func:`_of_run`."""
    from swarmevo.analysis import assessment
    from swarmevo.config import seeded, sets
    from swarmevo.errors import ConfigError
    from swarmevo.plugins.team import Team, load_config
    from swarmevo.runs.genomes import read_genomes
    from swarmevo.runs.other_world import ineffective, test_world
    from swarmevo.views import console

    if refused := ineffective(settings):
        raise ConfigError(*refused)
    chosen = seeded(load_config(config, settings))
    if not sets(settings, "episode", "until"):
        chosen = test_world(chosen)
    team = Team(chosen)
    _settle(wanted, chosen, team.objectives)
    genomes = read_genomes(source, chosen, team.space)
    with interruptible("nothing was stored") as stop, console.tests() as observe:
        found = assessment.assess_genomes(chosen, genomes, **wanted, observe=observe, stop=stop)
    whose = f"{len(genomes)} controller{'s' * (len(genomes) != 1)} of {source}"
    return found, whose, f"not stored, being of no run; seed {chosen.evolution.seed}"


def _show(found: Assessment, whose: str, as_json: bool) -> None:
    from swarmevo.analysis import table_ii
    from swarmevo.views import console

    if as_json:
        print(table_ii.as_json(found), file=streams.data())
    else:
        console.show_assessment(found, whose)


def _until(limit: float | None, rate: str | None) -> Until | None:
    from swarmevo.analysis.sequential import Until

    if limit is None:
        return None
    if not 0 < limit < 1:
        exit_with(USAGE, f"--until: expected a rate between 0 and 1, got {limit:g}")
    return Until(limit, rate or "")


def _settle(wanted: _Wanted, settings: Config, objectives: Sequence[Objective]) -> None:
    """Settle which rate is to be decided: one that the task has."""
    from swarmevo.analysis.measures import measures_of
    from swarmevo.analysis.sequential import settled
    from swarmevo.errors import InvalidArgument

    if wanted["until"] is not None:
        try:
            wanted["until"] = settled(wanted["until"], measures_of(settings, objectives))
        except InvalidArgument as error:
            exit_with(USAGE, f"--{error}")


def _kept(tests: StoredTests) -> str:
    """Return what becomes of tests that were interrupted."""
    return "nothing was stored" if tests.not_stored else "what was tested is stored; once more goes on from there"


def _fate(tests: StoredTests) -> str:
    """Return what became of what was found."""
    if not tests.added:
        return f"all of it was stored before, in {tests.file}"
    return f"not stored: {tests.not_stored}" if tests.not_stored else f"stored in {tests.file}"

# SPDX-License-Identifier: BSD-3-Clause
"""A run on the console: its fronts, its hypervolume and its cost; what one will cost; what verifying one found."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from rich.console import Console

from swarmevo.views import text
from swarmevo.views.console import output

if TYPE_CHECKING:
    from swarmevo.analysis.fronts import Cost, Forecast, FrontPoint, Step, Summary
    from swarmevo.runs.verification import Report

_SPARKS: Final = "▁▂▃▄▅▆▇█"
_PLAIN_SPARKS: Final = ".:-=+*%#"
_SPARKLINE: Final = 60
"""[characters] at most."""
_SHOWN_DIFFERENCES: Final = 20
"""Of verifying; ``--json`` has them all."""


def show_json(summary: Summary) -> None:
    """Print everything about a run as JSON."""
    print(json.dumps(dataclasses.asdict(summary), indent=2, allow_nan=False))


def show_run(summary: Summary) -> None:
    """Print a run's fronts, its hypervolume and its cost."""
    out = output.stdout()
    state = "complete" if summary.complete else "not complete"
    out.print(f"{summary.run}: seed {summary.seed}, {state}. Trials and generations count from 0.")
    if len(summary.trials) > 1:
        for trial in summary.trials:
            _show_front(out, f"Front of trial {trial.trial}", summary, trial.front)
    _show_front(out, "Front over all trials", summary, summary.front)
    reference = ", ".join(f"{o.name} {o.worst:g}" for o in summary.objectives)
    out.print(f"\nHypervolume per generation, against {reference}")
    for trial in summary.trials:
        _show_history(out, trial.trial, trial.history, summary.generations_planned)
    _show_cost(out, summary.cost)


def _show_front(out: Console, title: str, summary: Summary, front: Sequence[FrontPoint]) -> None:
    out.print(f"\n{title}")
    names = [f"{objective.name}\n({objective.direction})" for objective in summary.objectives]
    table = output.table(*names, "episodes", *_measures(summary), "gens", "trial", "individual", right=True)
    for point in front:
        table.add_row(
            *map(text.number, point.objectives.values()),
            str(point.episodes),
            *_measured(summary, point),
            "-".join(map(str, dict.fromkeys((point.first_generation, point.last_generation)))),
            str(point.trial),
            str(point.genome),
        )
    out.print(table)


def _measures(summary: Summary) -> list[str]:
    measures = summary.measures
    pushing, push = ("pushing", "push\n(s)") if measures.one_box else ("all\ndelivered", "taken\n(s)")
    return [
        *(["homing"] if measures.homing else []),
        *([pushing, push] if measures.push else []),
        *map(text.plain, map(text.success, measures.successes)),
    ]


def _measured(summary: Summary, point: FrontPoint) -> list[str]:
    measures = summary.measures
    time = "-" if point.push_time is None else f"{point.push_time:.1f}"
    return [
        *([text.percent_within(point.homing_rate, point.homing_interval)] if measures.homing else []),
        *([text.percent_within(point.push_rate, point.push_interval), time] if measures.push else []),
        *(text.percent_within(rate, point.success_intervals[name]) for name, rate in point.success_rates.items()),
    ]


def _show_history(out: Console, trial: int, history: Sequence[Step], planned: int) -> None:
    values = [step.hypervolume for step in history]
    line = sparkline(values, _SPARKS if _can_print(out, _SPARKS) else _PLAIN_SPARKS)
    out.print(
        f"  trial {trial}  {line}  {text.number(values[0])} to {text.number(values[-1])}, "
        f"{len(values)} of {planned} generations, "
        f"{_least_and_most([step.new_genomes for step in history])} new genomes each"
    )
    if still := [step.generation for step in history if not step.new_genomes and not step.refining]:
        generations = text.plain(text.count(len(still), "generation"))
        out.print(f"  warning: trial {trial}: in {generations}, first in {still[0]}, {text.STANDSTILL}")


def _least_and_most(values: Sequence[int]) -> str:
    least, most = min(values), max(values)
    return str(most) if least == most else f"{least} to {most}"


def sparkline(values: Sequence[float], sparks: str = _SPARKS) -> str:
    """Return values as a row of characters from low to high; many values share one, the last of them."""
    width = min(len(values), _SPARKLINE)
    picked = [values[(i + 1) * len(values) // width - 1] for i in range(width)]
    low, span = min(picked), max(picked) - min(picked)
    return "".join(sparks[round((value - low) / span * (len(sparks) - 1)) if span > 0 else 0] for value in picked)


def _can_print(out: Console, characters: str) -> bool:
    try:
        characters.encode(out.encoding)
    except UnicodeEncodeError:
        return False
    return True


def _show_cost(out: Console, cost: Cost) -> None:
    said = (
        f"\nCost so far: {text.count(cost.episodes, 'episode')} of {text.count(cost.genomes, 'genome')}, "
        f"{text.clock(cost.simulated_seconds)} simulated in {text.clock(cost.seconds)} ({text.speed(cost)}); "
        f"{text.physics(cost)}"
    )
    out.print(text.plain(said))


def show_forecast(forecast: Forecast) -> None:
    """Print what a run will cost."""
    out = output.stdout()
    out.print(
        f"{forecast.episodes} episodes, {text.clock(forecast.simulated_seconds)} simulated\n"
        f"{text.throughput(forecast.episodes_per_second, 'episodes')} on {forecast.workers} workers, "
        f"measured on {forecast.measured_episodes} episodes with random genomes\n"
        f"{text.clock(forecast.wall_seconds)} in all; evolved teams pressing on the box may take several times longer\n"
        "nothing was written",
    )


def show_verification(report: Report, as_json: bool) -> None:
    """Print what came of verifying a run."""
    if as_json:
        print(json.dumps({"sound": report.is_sound, **dataclasses.asdict(report)}, indent=2))
        return
    out = output.stdout()
    if report.damage:
        for what in report.damage:
            out.print(f"damaged: {what} is not as it was stored")
        out.print("nothing was simulated anew; restore the run from a copy first")
        return
    out.print(f"{report.checked} of {report.evaluations} evaluations simulated anew, {report.episodes} episodes")
    for found in report.differences[:_SHOWN_DIFFERENCES]:
        out.print(
            f"differs: trial {found.trial}, generation {found.generation}, individual {found.individual}, "
            f"repeat {found.repeat}, genome {found.genome}, session {found.session}: {', '.join(found.what)}"
        )
    if (more := len(report.differences) - _SHOWN_DIFFERENCES) > 0:
        out.print(f"and {more} more episodes differ; --json lists them")
    if report.tests:
        out.print(f"{report.tests_checked} of {report.tests} tests of controllers simulated anew")
    for test in report.different_tests[:_SHOWN_DIFFERENCES]:
        out.print(
            f"differs: test {test.repeat} of individual {test.genome}, trial {test.trial}, world {test.world}, "
            f"session {test.session} of tests: {', '.join(test.what)}"
        )
    if (more := len(report.different_tests) - _SHOWN_DIFFERENCES) > 0:
        out.print(f"and {more} more tests differ; --json lists them")
    for line in report.explanations:
        out.print(f"  {line}")
    different = len(report.differences) + len(report.different_tests)
    out.print("the same, bit by bit" if report.is_sound else f"{different} episodes differ")

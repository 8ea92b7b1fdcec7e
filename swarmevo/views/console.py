# SPDX-License-Identifier: BSD-3-Clause
"""How things look on the console: tables and data on stdout, progress on stderr."""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, TextColumn
from rich.progress import Progress as Bar
from rich.table import Table

from swarmevo.views import text

if TYPE_CHECKING:
    from swarmevo.analysis.assessment import Assessment, Outcome, PaperRow
    from swarmevo.analysis.fronts import Cost, Forecast, FrontPoint, Step, Summary
    from swarmevo.evolution.loop import Progress
    from swarmevo.plugins import PluginEntry, Report
    from swarmevo.protocols import Objective
    from swarmevo.runs.verification import Report as Verification
    from swarmevo.views.doctor import Finding

_PIPE_WIDTH = 1000  # [characters]: in a pipe no row is wrapped or cut
_SPARKS = "▁▂▃▄▅▆▇█"
_PLAIN_SPARKS = ".:-=+*%#"
_SPARKLINE = 60  # [characters] at most


def _stdout() -> Console:
    width = None if sys.stdout.isatty() else _PIPE_WIDTH
    return Console(width=width, highlight=False, markup=False)  # a plugin's name may have brackets


# ---- progress --------------------------------------------------------------------------------------------------------


@contextmanager
def progress(done: int, total: int) -> Iterator[Callable[[Progress], None]]:
    """Show progress on stderr: a live bar on a terminal, one line for each generation elsewhere.

    Args:
        done: Generations stored already, over all trials.
        total: Generations of the whole run.
    """
    console = Console(stderr=True)
    if not console.is_terminal or console.is_dumb_terminal:
        yield lambda now: print(_line(now), file=sys.stderr, flush=True)
        return
    columns = (BarColumn(bar_width=None), TextColumn("{task.description}", markup=False))
    with Bar(*columns, console=console, expand=True) as bar:
        task = bar.add_task("starting", completed=done, total=total)

        def observe(now: Progress) -> None:
            nonlocal done
            done += 1
            bar.update(task, completed=done, description=_short_line(now))

        yield observe


@contextmanager
def frames(total: int) -> Iterator[Callable[[int], None]]:
    """Show on stderr how many frames of a film are drawn: a live bar on a terminal, a line now and then elsewhere."""
    console = Console(stderr=True)
    if not console.is_terminal or console.is_dumb_terminal:
        some = max(1, total // 4)
        yield lambda done: print(f"frame {done} of {total}", file=sys.stderr) if done % some == 0 else None
        return
    columns = (BarColumn(bar_width=None), TextColumn("frame {task.completed:.0f} of {task.total:.0f}"))
    with Bar(*columns, console=console) as bar:
        task = bar.add_task("frames", total=total)
        yield lambda done: bar.update(task, completed=done)


def _line(now: Progress) -> str:
    objective, best = next(iter(now.best.items()))
    return (
        f"trial {now.trial + 1}/{now.trials}, generation {now.generation + 1}/{now.generations}: "
        f"best {objective} {text.number(best)}, front {now.front_size}, "
        f"{text.throughput(now.episodes_per_second, 'episodes')}, {text.clock(now.eta_seconds)} left"
    )


def _short_line(now: Progress) -> str:
    """Return what fits beside a bar on 80 columns."""
    objective, best = next(iter(now.best.items()))
    return (
        f"trial {now.trial + 1}/{now.trials} gen {now.generation + 1}/{now.generations}  "
        f"{objective} {text.number(best)}  front {now.front_size}  {text.throughput(now.episodes_per_second, 'ep')}  "
        f"ETA {text.clock(now.eta_seconds)}"
    )


# ---- a run -----------------------------------------------------------------------------------------------------------


def show_json(summary: Summary) -> None:
    """Print everything about a run as JSON."""
    print(json.dumps(dataclasses.asdict(summary), indent=2, allow_nan=False))


def show_run(summary: Summary) -> None:
    """Print a run's fronts, its hypervolume and its cost."""
    out = _stdout()
    state = "complete" if summary.complete else "not complete"
    out.print(f"{summary.run}: seed {summary.seed}, {state}. Trials and generations count from 0.")
    if len(summary.trials) > 1:
        for trial in summary.trials:
            _show_front(out, f"Front of trial {trial.trial}", summary.objectives, trial.front)
    _show_front(out, "Front over all trials", summary.objectives, summary.front)
    reference = ", ".join(f"{o.name} {o.worst:g}" for o in summary.objectives)
    out.print(f"\nHypervolume per generation, against {reference}")
    for trial in summary.trials:
        _show_history(out, trial.trial, trial.history, summary.generations_planned)
    _show_cost(out, summary.cost)


def _show_front(out: Console, title: str, objectives: Sequence[Objective], front: Sequence[FrontPoint]) -> None:
    out.print(f"\n{title}")
    names = [f"{objective.name}\n({objective.direction})" for objective in objectives]
    table = _table(*names, "episodes", "homing", "pushing", "push\n(s)", "gens", "trial", "genome", right=True)
    for point in front:
        table.add_row(
            *map(text.number, point.objectives.values()),
            str(point.episodes),
            text.percent(point.homing_rate),
            text.percent(point.push_rate),
            "-" if point.push_time is None else f"{point.push_time:.1f}",
            f"{point.first_generation}-{point.last_generation}",
            str(point.trial),
            str(point.genome),
        )
    out.print(table)


def _show_history(out: Console, trial: int, history: Sequence[Step], planned: int) -> None:
    values = [step.hypervolume for step in history]
    line = sparkline(values, _SPARKS if _can_print(out, _SPARKS) else _PLAIN_SPARKS)
    out.print(
        f"  trial {trial}  {line}  {text.number(values[0])} to {text.number(values[-1])}, "
        f"{len(values)} of {planned} generations"
    )


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
    out = _stdout()
    out.print(
        f"{forecast.episodes} episodes, {text.clock(forecast.simulated_seconds)} simulated\n"
        f"{text.throughput(forecast.episodes_per_second, 'episodes')} on {forecast.workers} workers, "
        f"measured on {forecast.measured_episodes} episodes with random genomes\n"
        f"{text.clock(forecast.wall_seconds)} in all; evolved teams pressing on the box may take several times longer\n"
        "nothing was written",
    )


# ---- tests -----------------------------------------------------------------------------------------------------------


@contextmanager
def tests() -> Iterator[Callable[[int, int], None]]:
    """Show the progress of tests on stderr: a live bar on a terminal, nothing elsewhere."""
    console = Console(stderr=True)
    if not console.is_terminal or console.is_dumb_terminal:
        yield lambda done, total: None
        return
    columns = (BarColumn(bar_width=None), TextColumn("{task.completed:.0f} of {task.total:.0f} episodes"))
    with Bar(*columns, console=console, expand=True) as bar:
        task = bar.add_task("tests")
        yield lambda done, total: bar.update(task, completed=done, total=total)


def show_assessment(found: Assessment) -> None:
    """Print the paper's Table II, ours and the paper's side by side, and what else was tested."""
    from swarmevo.analysis.assessment import PAPER

    out = _stdout()
    out.print(
        f"{len(found.controllers)} controllers of all trials' fronts, {found.repeats} tests each on fresh seeds. "
        "Rates are over robots or tests, times means over those that succeeded; (in brackets: the paper)"
    )
    if found.changes:
        out.print(f"In another world than that of evolution: {', '.join(found.changes)}")
    paper = {row.robots: row for row in PAPER}
    heads = ("robots", "homing", "", "any", "all", "time", "", "pushing", "", "time", "")
    table = _table(*heads, right=True)
    for row in found.rows:
        table.add_row(*_table_ii_row(row, paper.get(row.robots)))
    out.print(table)
    if found.robustness:
        out.print(f"\nRobustness, {found.robustness[0].outcome.robots} robots")
        table = _table("world", "changes", "homing", "time", "pushing", "time")
        for one in found.robustness:
            table.add_row(one.name, one.changes, *map(text.plain, text.outcome(one.outcome)))
        out.print(table)
    out.print("\nShare of robots with a behaviour of the paper's section VII")
    for label, share in found.behaviours.items():
        out.print(f"  {share:4.0%}  {label}")


def _table_ii_row(row: Outcome, paper: PaperRow | None) -> list[str]:
    homing, home_time, pushing, push_time = text.outcome(row)
    beside = [f"({value})" for value in text.outcome(paper)] if paper else [""] * 4
    cells = [
        str(row.robots),
        *(homing, beside[0], text.percent(row.any_home_rate), text.percent(row.all_home_rate), home_time, beside[1]),
        *(pushing, beside[2], push_time, beside[3]),
    ]
    return [text.plain(cell) for cell in cells]


# ---- verification ----------------------------------------------------------------------------------------------------


_SHOWN_DIFFERENCES = 20  # on the console; --json has them all


@contextmanager
def evaluations() -> Iterator[Callable[[int, int], None]]:
    """Show on stderr how many evaluations are done; only on a terminal, and gone at the end."""
    console = Console(stderr=True)
    if not console.is_terminal or console.is_dumb_terminal:
        yield lambda done, total: None
        return
    columns = (BarColumn(bar_width=None), TextColumn("{task.completed}/{task.total} evaluations", markup=False))
    with Bar(*columns, console=console, expand=True, transient=True) as bar:
        task = bar.add_task("")
        yield lambda done, total: bar.update(task, completed=done, total=total)


def show_verification(report: Verification, as_json: bool) -> None:
    """Print what came of verifying a run."""
    if as_json:
        print(json.dumps({"sound": report.is_sound, **dataclasses.asdict(report)}, indent=2))
        return
    out = _stdout()
    out.print(f"{report.checked} of {report.evaluations} evaluations simulated anew, {report.episodes} episodes")
    for found in report.differences[:_SHOWN_DIFFERENCES]:
        out.print(
            f"differs: trial {found.trial}, generation {found.generation}, individual {found.individual}, "
            f"repeat {found.repeat}, genome {found.genome}, session {found.session}: {', '.join(found.what)}"
        )
    if (more := len(report.differences) - _SHOWN_DIFFERENCES) > 0:
        out.print(f"and {more} more episodes differ; --json lists them")
    for genome in report.damaged_genomes:
        out.print(f"damaged: genome {genome} is not what was stored")
    for line in report.explanations:
        out.print(f"  {line}")
    out.print("the same, bit by bit" if report.is_sound else f"{len(report.differences)} episodes differ")


# ---- the installation ------------------------------------------------------------------------------------------------


def show_plugins(entries: Iterable[PluginEntry]) -> None:
    """Print a table of plugins."""
    table = _table("kind", "name", "distribution", "target", "")
    for entry in entries:
        table.add_row(entry.kind, entry.name, entry.origin, entry.target, "name taken twice" if entry.clash else "")
    _stdout().print(table)


def show_reports(reports: Iterable[Report]) -> None:
    """Print what came of loading plugins."""
    out = _stdout()
    for report in reports:
        out.print(f"{report.entry}")
        for option in report.options:
            out.print(f"  {option}")
        out.print(f"  broken: {report.error}" if report.error else "  sound")


def show_findings(findings: Iterable[Finding]) -> None:
    """Print what the doctor found."""
    out = _stdout()
    for finding in findings:
        verdict = ("FAIL" if finding.is_fault else "warn") if finding.advice else "ok"
        out.print(f"{verdict:4}  {finding.subject}: {finding.text}")
        if finding.advice:
            out.print(f"      what to do: {finding.advice}")


def _table(*columns: str, right: bool = False) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    for column in columns:
        table.add_column(column, justify="right" if right else "left", overflow="fold")
    return table

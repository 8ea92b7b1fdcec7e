# SPDX-License-Identifier: BSD-3-Clause
"""Progress on stderr: live bars on a terminal, lines or nothing elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, TextColumn
from rich.progress import Progress as Bar

from swarmevo.printable import printable
from swarmevo.views import text

if TYPE_CHECKING:
    from swarmevo.evolution.loop import Progress

Observe = Callable[[int, int], None]
"""Called with how many are done and how many there are."""


@contextmanager
def progress(done: int, total: int) -> Iterator[Callable[[Progress], None]]:
    """Show how a run goes on: a live bar on a terminal, one line for each generation elsewhere.

    When a search begins to stand still, a line says so on both.

    Args:
        done: Generations stored already, over all trials.
        total: Generations of the whole run.
    """
    if (console := terminal()) is None:
        warn = _standstill_warning(_print_line)

        def observe_line(now: Progress) -> None:
            _print_line(_line(now))
            warn(now)

        yield observe_line
        return
    columns = (BarColumn(bar_width=None), TextColumn("{task.description}", markup=False))
    with Bar(*columns, console=console, expand=True) as bar:
        task = bar.add_task("starting", completed=done, total=total)
        warn = _standstill_warning(lambda line: console.print(line, markup=False, highlight=False))

        def observe(now: Progress) -> None:
            nonlocal done
            done += 1
            bar.update(task, completed=done, description=_short_line(now))
            warn(now)

        yield observe


def _standstill_warning(say: Callable[[str], object]) -> Callable[[Progress], None]:
    """Return what warns once of generations in a row that had no new genome."""
    standing: int | None = None  # the trial that has none

    def observe(now: Progress) -> None:
        nonlocal standing
        if now.new_genomes or now.refining:
            standing = None
        elif standing != now.trial:
            standing = now.trial
            say(f"warning: trial {now.trial}, generation {now.generation}: {text.STANDSTILL}")

    return observe


def _print_line(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


@contextmanager
def frames(total: int) -> Iterator[Callable[[int], None]]:
    """Show how many frames of a film are drawn: a live bar on a terminal, a line now and then elsewhere."""
    if terminal() is None:
        some = max(1, total // 4)
        yield lambda done: print(f"frame {done} of {total}", file=sys.stderr) if done % some == 0 else None
        return
    with _counter("frame {task.completed} of {task.total}") as observe:
        observe(0, total)
        yield lambda done: observe(done, total)


@contextmanager
def tests() -> Iterator[Observe]:
    """Show how many episodes of tests are done: a live bar on a terminal, nothing elsewhere."""
    with _counter("{task.completed} of {task.total} episodes") as observe:
        yield observe


@contextmanager
def evaluations() -> Iterator[Observe]:
    """Show how many evaluations are done: only on a terminal, and gone at the end."""
    with _counter("{task.completed} of {task.total} evaluations", transient=True) as observe:
        yield observe


@contextmanager
def _counter(said: str, transient: bool = False) -> Iterator[Observe]:
    """Show a bar with words beside it, from when the total is known; on a terminal only, elsewhere nothing."""
    if (console := terminal()) is None:
        yield lambda done, total: None
        return
    columns = (BarColumn(bar_width=None), TextColumn(said, markup=False))
    with Bar(*columns, console=console, expand=True, transient=transient) as bar:
        task = bar.add_task("", visible=False)
        yield lambda done, total: bar.update(task, completed=done, total=total, visible=True)


def terminal() -> Console | None:
    """Return stderr, if a live bar can be shown there."""
    console = Console(stderr=True)
    return console if console.is_terminal and not console.is_dumb_terminal else None


def _line(now: Progress) -> str:
    objective, best = next(iter(now.best.items()))
    return printable(
        f"trial {now.trial}/{now.trials - 1}, generation {now.generation}/{now.generations - 1}: "
        f"best {objective} {text.number(best)}, front {now.front_size}, {_new(now)}, "
        f"{text.throughput(now.episodes_per_second, 'episodes')}, {text.clock(now.eta_seconds)} left"
    )


def _new(now: Progress) -> str:
    return "refining" if now.refining else f"{now.new_genomes} new"


def _short_line(now: Progress) -> str:
    """Return what fits beside a bar on 80 columns."""
    objective, best = next(iter(now.best.items()))
    return printable(
        f"trial {now.trial}/{now.trials - 1} gen {now.generation}/{now.generations - 1}  "
        f"{objective} {text.number(best)}  front {now.front_size}  {_new(now)}  "
        f"{text.throughput(now.episodes_per_second, 'ep')}  ETA {text.clock(now.eta_seconds)}"
    )

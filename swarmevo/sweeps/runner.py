# SPDX-License-Identifier: BSD-3-Clause
"""Runs a sweep: as many runs at once as there are workers, each in a process of its own.

A run alone keeps few cores busy: at each generation's end they wait for its last episode and its optimiser. Hence runs
are parallel first, and only when there are fewer runs than workers does each have several threads. The results depend
on neither.
"""

from __future__ import annotations

import contextlib
import math
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from time import perf_counter
from typing import Final

from swarmevo.errors import ClusterError, Interrupted, SwarmevoError
from swarmevo.evolution import processes
from swarmevo.plugins import trackers
from swarmevo.plugins.team import never
from swarmevo.sweeps import board as boards
from swarmevo.sweeps import cell as cells
from swarmevo.sweeps.board import Board
from swarmevo.sweeps.folder import Cell, Sweep
from swarmevo.sweeps.outcome import Findings, Outcome, findings

GLANCE_SECONDS: Final = 0.1
"""Between two looks whether to stop."""


@dataclass(frozen=True)
class Progress:
    """Where a sweep stands."""

    cell: Cell | None
    """That has just ended; None: it is only later than before."""
    failed: str
    """Why that failed; "": it did not."""
    ended: int
    """Runs."""
    runs: int
    generations: int
    """Stored, in all runs; of those that were begun before, once this session has looked at them."""
    generations_planned: int
    eta_seconds: float | None
    """To the end of the sweep; None: nothing is known yet."""


def run(
    sweep: Sweep,
    workers: int,
    observe: Callable[[Progress], None] = lambda now: None,
    stop: Callable[[], bool] = never,
    scheduler: str | None = None,
    log: Sequence[str] = (),
    accept_changed_plugin: bool = False,
) -> Findings:
    """Run all that is missing of a sweep. A run that fails does not keep others from theirs.

    Args:
        sweep: Its folder is there.
        workers: Episodes to run at once; with a scheduler, runs at once. 0: one for each processor.
        observe: Told when a run has ended, and now and then.
        stop: Asked now and then; when true, the runs in work are stopped; the sweep can be continued.
        scheduler: Of a Dask cluster, on which the episodes run.
        log: Names of trackers, which each run has.
        accept_changed_plugin: See :func:`swarmevo.runs.driver.evolve`.

    Raises:
        ClusterError: The cluster cannot be used, or is gone.
        ConfigError, PluginError: A tracker cannot be used.
        Interrupted: ``stop`` said so.
        StoreError: Somebody else runs the sweep.
    """
    trackers.check(log)
    workers = workers or len(os.sched_getaffinity(0))
    slots = min(workers, len(sweep.cells))
    with sweep.locked(), boards.new(len(sweep.cells)) as board, _threads(slots) as (threads, cancelled):

        def run_one(number: int, cell: Cell) -> Outcome:
            config, folder = cell.config.model_dump_json(), str(cell.folder)
            order = cells.Order(folder, config, number, board.path, scheduler, tuple(log), accept_changed_plugin)
            with processes.child() as child:
                return child.call(cells.run, (order,), math.inf, cancelled.is_set)

        unfinished = {threads.submit(run_one, number, cell): cell for number, cell in enumerate(sweep.cells)}
        return _Watch(sweep, board, workers, slots, observe).to_the_end(unfinished, stop)


@contextlib.contextmanager
def _threads(count: int) -> Iterator[tuple[ThreadPoolExecutor, threading.Event]]:
    """Give threads that wait for processes, and what tells them to end these at once, as is done if the block fails."""
    cancelled = threading.Event()
    threads = ThreadPoolExecutor(count, thread_name_prefix="swarmevo-sweep")
    try:
        yield threads, cancelled
    finally:
        cancelled.set()
        threads.shutdown(cancel_futures=True)
        processes.dismiss()


class _Watch:
    """Looks after the runs."""

    def __init__(
        self, sweep: Sweep, board: Board, workers: int, slots: int, observe: Callable[[Progress], None]
    ) -> None:
        self._sweep, self._board, self._workers, self._slots, self._observe = sweep, board, workers, slots, observe
        self._outcomes: dict[str, Outcome] = {}
        self._failed: dict[str, str] = {}
        evolution = [setting.config.evolution for setting in sweep.settings]
        self._planned = len(sweep.seeds) * sum(one.trials * one.generations for one in evolution)
        self._started = perf_counter()

    def to_the_end(self, unfinished: dict[Future[Outcome], Cell], stop: Callable[[], bool]) -> Findings:
        """Wait for all runs and return what they found."""
        fatal: ClusterError | None = None
        waiting, stopped = set(unfinished), False
        while waiting:
            self._board.share = math.ceil(self._workers / min(self._slots, len(waiting)))
            done, waiting = wait(waiting, GLANCE_SECONDS, FIRST_COMPLETED)
            for future in done:
                try:
                    self._note(unfinished[future], future)
                except Interrupted:
                    stopped = True
                except ClusterError as error:
                    fatal = error
            if (stop() or fatal) and not self._board.stop:
                self._board.stop = stopped = True
                waiting = {future for future in waiting if not future.cancel()}
            if not done:
                self._tell(None)
        if fatal:
            raise fatal
        if stopped:
            raise Interrupted
        return findings(self._sweep, self._outcomes, self._failed)

    def _note(self, cell: Cell, future: Future[Outcome]) -> None:
        """Keep what a run gave.

        Raises:
            ClusterError, Interrupted: It said so.
        """
        try:
            self._outcomes[cell.name] = future.result()
        except ClusterError:
            raise
        except SwarmevoError as error:
            self._failed[cell.name] = str(error)
        except processes.Lost as error:
            self._failed[cell.name] = str(error)
        self._tell(cell)

    def _tell(self, cell: Cell | None) -> None:
        stored, made = self._board.stored, self._board.made
        left = max(0, self._planned - stored)
        self._observe(
            Progress(
                cell=cell,
                failed=self._failed.get(cell.name, "") if cell else "",
                ended=len(self._outcomes) + len(self._failed),
                runs=len(self._sweep.cells),
                generations=stored,
                generations_planned=self._planned,
                eta_seconds=(perf_counter() - self._started) * left / made if made else None,
            )
        )

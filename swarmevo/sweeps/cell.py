# SPDX-License-Identifier: BSD-3-Clause
"""One run of a sweep, in a process of its own."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from swarmevo.analysis import fronts, tracking
from swarmevo.config import Config
from swarmevo.errors import StoreError
from swarmevo.evolution.jobs import Job
from swarmevo.evolution.loop import Progress
from swarmevo.evolution.results import Results
from swarmevo.evolution.threads import JOB_SECONDS, MakeBackend, ThreadBackend
from swarmevo.runs import driver
from swarmevo.runs.store import Store
from swarmevo.sweeps.board import Board
from swarmevo.sweeps.outcome import Outcome, outcome


@dataclass(frozen=True)
class Order:
    """To run a cell. Plain data."""

    folder: str
    """Of the run; begun if it is not there."""
    config_json: str
    number: int
    """Of the run in the sweep, from 0."""
    board: str
    """Path of the :class:`Board`."""
    scheduler: str | None
    """Of a Dask cluster."""
    log: tuple[str, ...]
    """Names of trackers."""
    accept_changed_plugin: bool


def run(order: Order) -> Outcome:
    """Bring a run to its end, from wherever it is, and return what it found.

    Raises:
        ConfigError, EvaluationError, PluginError, SimulatorError, StoreError: As :func:`swarmevo.runs.driver.evolve`.
        Interrupted: The board said so.
    """
    board, folder = Board(order.board), Path(order.folder)
    config = Config.model_validate_json(order.config_json)
    if not os.path.lexists(folder):
        _begin(folder, config, lambda: board.stop)
    with Store.open(folder) as store:
        _require_ours(store, config)
        stored, planned = fronts.generations(store)
        complete = fronts.is_complete(store)  # by its episodes, perhaps, with fewer generations
        board.note(order.number, planned if complete else stored, 0)
    if not complete:
        _go_on(folder, order, board, stored)
    with Store.open(folder) as store:
        return outcome(store)


def _begin(folder: Path, config: Config, stop: Callable[[], bool]) -> None:
    """Make a run's folder as a whole: a process that is killed meanwhile leaves none of its name."""
    begun = folder.with_name(f".{folder.name}")
    shutil.rmtree(begun, ignore_errors=True)
    try:
        driver.begin(begun, config, stop)
        begun.rename(folder)
    except OSError as error:
        raise StoreError(f"{folder}: {error.strerror}") from error


def _require_ours(store: Store, config: Config) -> None:
    """Refuse a run of another configuration; it may have been made longer."""
    same = {"evolution": config.evolution.model_copy(update={"generations": store.config.evolution.generations})}
    if store.config != config.model_copy(update=same):
        raise StoreError(f"{store.folder}: expected the run of the sweep's setting, got another; move it away")


def _go_on(folder: Path, order: Order, board: Board, stored: int) -> None:
    made = 0

    def note(now: Progress) -> None:
        nonlocal made
        made += 1
        board.note(order.number, stored + made, made)

    with (
        Store.open(folder, readonly=False) as store,
        tracking.tracked(store, order.log, note, _say) as observe,
    ):
        backend = _backend(order.scheduler, board)
        driver.evolve(store, board.share, observe, lambda: board.stop, backend, order.accept_changed_plugin)
        _, planned = fronts.generations(store)
    board.note(order.number, planned, made)


def _backend(scheduler: str | None, board: Board) -> MakeBackend:
    if scheduler is None:
        return lambda config_json, workers: SharedThreads(config_json, board)
    from swarmevo.evolution import cluster

    return cluster.backend(scheduler, _say)


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


class SharedThreads:
    """Runs jobs on as many threads as are this process's share now; see :class:`swarmevo.evolution.threads.Backend`."""

    job_seconds = JOB_SECONDS

    def __init__(self, config_json: str, board: Board) -> None:
        self._config_json, self._board = config_json, board
        self._threads = ThreadBackend(config_json, board.share)

    @property
    def slots(self) -> int:
        """See :class:`swarmevo.evolution.threads.Backend`."""
        return self._board.share

    @property
    def machines(self) -> Mapping[str, Any]:
        """See :class:`swarmevo.evolution.threads.Backend`."""
        return self._threads.machines

    def run(self, jobs: Sequence[Job], stop: Callable[[], bool]) -> Generator[Results, None, None]:
        """See :class:`swarmevo.evolution.threads.Backend`."""
        if self._threads.slots != (share := self.slots):
            self._threads.close()
            self._threads = ThreadBackend(self._config_json, share)
        yield from self._threads.run(jobs, stop)

    def close(self) -> None:
        """See :class:`swarmevo.evolution.threads.Backend`."""
        self._threads.close()

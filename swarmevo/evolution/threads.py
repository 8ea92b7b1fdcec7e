# SPDX-License-Identifier: BSD-3-Clause
"""Where jobs run: on threads of this process, or wherever another :class:`Backend` brings them."""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection, Generator, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice
from typing import Any, Final, Protocol, TypeAlias

from swarmevo.errors import Interrupted
from swarmevo.evolution import processes
from swarmevo.evolution.jobs import Job, run_job
from swarmevo.evolution.results import Results

JOB_SECONDS: Final = 0.5
"""A job should not take longer, so that Ctrl-C is answered soon; one episode is the least."""
GLANCE_SECONDS: Final = 0.1
"""Between two looks whether to stop."""
AHEAD: Final = 4
"""Jobs that a thread has before it: enough to be always busy, few enough to look through again and again."""
PATIENCE_SECONDS: Final = 0.3
"""To wait for a job whose result is not wanted any more."""


class Backend(Protocol):
    """Where jobs run."""

    @property
    def slots(self) -> int:
        """How many jobs run at once, at least 1; it may change."""
        ...

    @property
    def job_seconds(self) -> float:
        """What a job should take: short enough to stop soon, long enough to be worth its way."""
        ...

    @property
    def machines(self) -> Mapping[str, Any]:
        """What to note about where jobs run, if not here."""
        ...

    def run(self, jobs: Sequence[Job], stop: Callable[[], bool]) -> Generator[Results, None, None]:
        """Yield the jobs' results in any order.

        When closed early, drop the rest and wait for what still runs, but not for what hangs.

        Args:
            jobs: To run.
            stop: Asked between results; when true, begin no more jobs, yield what is finished, and end.

        Raises:
            Interrupted: ``stop`` said so before the last result.
        """
        ...

    def close(self) -> None:
        """Free what it holds."""
        ...


class ThreadBackend:
    """Runs jobs on threads of this process, a job on each."""

    def __init__(self, config_json: str, workers: int) -> None:
        self._config_json = config_json
        self.slots = workers
        self._hangs = False
        self._threads = ThreadPoolExecutor(workers, thread_name_prefix="swarmevo")

    @property
    def job_seconds(self) -> float:
        """See :class:`Backend`."""
        return JOB_SECONDS

    @property
    def machines(self) -> Mapping[str, Any]:
        """See :class:`Backend`."""
        return {}

    def run(self, jobs: Sequence[Job], stop: Callable[[], bool]) -> Generator[Results, None, None]:
        """See :class:`Backend`."""
        cancelled = threading.Event()
        waiting, unfinished, to_come = iter(jobs), set[Future[Results]](), len(jobs)
        place: dict[Future[Results], int] = {}  # among the jobs
        try:
            while to_come:
                for job in islice(waiting, AHEAD * self.slots - len(unfinished)):
                    unfinished.add(future := self._threads.submit(run_job, self._config_json, job, cancelled.is_set))
                    place[future] = len(place)
                finished, unfinished = wait(unfinished, GLANCE_SECONDS, FIRST_COMPLETED)
                is_over = not finished and stop()
                for future in sorted(finished, key=place.__getitem__):  # of several faults the first is told
                    yield future.result()
                    to_come -= 1
                    is_over = is_over or (stop() and to_come > 0)
                if is_over:
                    yield from self._last(unfinished, cancelled)
                    raise Interrupted
        finally:
            cancelled.set()
            self._drop(unfinished)

    def _last(self, unfinished: Collection[Future[Results]], cancelled: threading.Event) -> Iterator[Results]:
        """Begin no more jobs; yield what those in work give soon."""
        cancelled.set()
        finished, _ = wait(unfinished, PATIENCE_SECONDS)
        for future in finished:
            if not isinstance(future.exception(), Interrupted):
                yield future.result()

    def _drop(self, unfinished: Collection[Future[Results]]) -> None:
        """Wait for jobs that nobody wants any more, but not for ever: a thread that hangs cannot be ended."""
        _, hanging = wait(unfinished, PATIENCE_SECONDS)
        self._hangs = self._hangs or bool(hanging)

    def close(self) -> None:
        """See :class:`Backend`."""
        self._threads.shutdown(wait=not self._hangs, cancel_futures=True)
        processes.dismiss()


MakeBackend: TypeAlias = Callable[[str, int], Backend]
"""From a configuration as JSON and a number of workers."""

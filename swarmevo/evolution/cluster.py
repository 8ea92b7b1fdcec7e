# SPDX-License-Identifier: BSD-3-Clause
"""Where one machine ends: jobs on a Dask cluster. Needs ``pip install 'swarmevo[dask]'``.

A task is a job: plain data, which :func:`swarmevo.evolution.jobs.run_job` turns into the same bits anywhere. A worker
runs as many as it has threads, each of which simulates with the interpreter lock released. Before it runs anything it
compares its versions and its plugins' files with the driver's, so that a worker with other ones is refused and does no
harm. A worker that was started before a plugin was changed has the old one until it is started again.

A worker that dies costs the jobs that it had: Dask gives them to another one. When there is no worker, jobs wait for
the next. When the scheduler is gone, so are the jobs in work; what came back before is stored, and the run can be
resumed.
"""

from __future__ import annotations

import asyncio
import logging
import queue
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TYPE_CHECKING, Any, Final

from swarmevo._version import __version__
from swarmevo.config import Config
from swarmevo.errors import ClusterError, EvaluationError, Interrupted, PluginError, SimulatorError
from swarmevo.evolution.identity import Identity, difference, identity
from swarmevo.evolution.jobs import Job, run_job
from swarmevo.evolution.results import Results
from swarmevo.plugins.calls import one_line
from swarmevo.simulation.library import cpu

if TYPE_CHECKING:
    from distributed import Client, Future

TASK_SECONDS: Final = 2.0
"""A task should not take longer: what is lost with a worker, and what is still run after Ctrl-C."""
CONNECT_SECONDS: Final = 10.0
"""To wait for the scheduler's answer."""
_GLANCE_SECONDS: Final = 0.2  # between two looks whether to stop and whether the scheduler is there
_COUNT_SECONDS: Final = 5.0  # between two counts of the workers while nothing comes


def backend(address: str, say: Callable[[str], None]) -> Callable[[str, int], DaskBackend]:
    """Return what makes the backend of a run.

    Args:
        address: Of the scheduler, such as ``tcp://host:8786``.
        say: Told, one line each, how many workers there are, and when there is none.
    """
    return lambda config_json, workers: DaskBackend(config_json, address, say)


# ---- on a worker -----------------------------------------------------------------------------------------------------


@cache
def _identity(config_json: str) -> Identity:
    return identity(Config.model_validate_json(config_json))


def run_task(job: Job, config_json: str, expected: Identity) -> Results:
    """Run a job on a worker.

    Raises:
        ClusterError: The worker is not what the driver is.
        EvaluationError, PluginError: As :func:`swarmevo.evolution.jobs.run_job`.
    """
    if wrong := difference(_identity(config_json), expected):
        raise ClusterError(f"worker {_worker()}: has {wrong}; install the same there and start it again, or stop it")
    return run_job(config_json, job)


def _worker() -> str:
    from distributed import get_worker

    return str(get_worker().address)


# ---- on the driver ---------------------------------------------------------------------------------------------------


class DaskBackend:
    """Runs jobs on a cluster; see :class:`swarmevo.evolution.threads.Backend`.

    Args:
        config_json: A ``Config``, by ``model_dump_json()``.
        address: Of the scheduler.
        say: Told what to know about the workers.

    Raises:
        ClusterError: Dask is not installed, or no scheduler answers.
    """

    job_seconds: Final = TASK_SECONDS

    def __init__(self, config_json: str, address: str, say: Callable[[str], None]) -> None:
        self._config_json = config_json
        self._expected = identity(Config.model_validate_json(config_json))
        self._address = address
        self._say = say
        self._client = _connect(address)
        self._count_at = 0.0  # when to count the workers again
        threads = self._client.nthreads()
        self._workers = len(threads)
        say(f"scheduler {address}: {len(threads)} workers, {sum(threads.values())} threads")

    @property
    def slots(self) -> int:
        """How many jobs run at once, at least 1: the workers' threads."""
        return max(1, sum(self._threads().values()))

    @property
    def machines(self) -> Mapping[str, Any]:
        """What to note about where jobs run: the workers' CPUs."""
        return {"worker_cpus": sorted(set(self._client.run(cpu).values()))}

    def run(self, jobs: Sequence[Job], stop: Callable[[], bool]) -> Generator[Results, None, None]:
        """See :class:`swarmevo.evolution.threads.Backend`."""
        self._check_scheduler()
        futures = self._client.map(
            run_task, jobs, config_json=self._config_json, expected=self._expected, pure=False, key="swarmevo"
        )
        finished: queue.SimpleQueue[Future[Results]] = queue.SimpleQueue()
        for future in futures:
            future.add_done_callback(finished.put)
        try:
            for to_come in range(len(futures) - 1, -1, -1):
                yield self._result(self._next(finished, stop), stop)
                if to_come and stop():
                    raise Interrupted
        finally:
            if self._client.status == "running":
                self._client.cancel(futures)

    def close(self) -> None:
        """See :class:`swarmevo.evolution.threads.Backend`."""
        self._client.close(timeout=1)

    def _next(self, finished: queue.SimpleQueue[Future[Results]], stop: Callable[[], bool]) -> Future[Results]:
        """Wait for a job to finish."""
        while True:
            try:
                return finished.get(timeout=_GLANCE_SECONDS)
            except queue.Empty:
                self._look_around(stop)

    def _look_around(self, stop: Callable[[], bool]) -> None:
        """Nothing comes: see whether to stop, whether the scheduler is there, and whether there are workers."""
        if stop():
            raise Interrupted
        self._check_scheduler()
        if time.monotonic() < self._count_at:
            return
        workers = len(self._threads())
        self._count_at = time.monotonic() + _COUNT_SECONDS
        if not workers and self._workers:
            self._say(f"scheduler {self._address}: no worker; waiting for some")
        self._workers = workers

    def _result(self, future: Future[Results], stop: Callable[[], bool]) -> Results:
        """Fetch what a job gave; if it is lost with its worker, wait until another one has run it."""
        from distributed import CancelledError, KilledWorker

        while True:
            try:
                result: Results = future.result(timeout=_GLANCE_SECONDS)
                return result
            except TimeoutError:
                self._look_around(stop)
            except CancelledError as error:
                raise self._gone() from error
            except KilledWorker as error:
                raise ClusterError(
                    "a job was lost with one worker after the other; does an episode crash them? Set "
                    "evolution.episode_timeout in a new run: then it runs in a process of its own"
                ) from error
            except (EvaluationError, PluginError, SimulatorError):
                raise
            except Exception as error:
                raise ClusterError(
                    f"a worker cannot run a job: {one_line(error)}; it needs swarmevo {__version__} and the plugins"
                ) from error

    def _threads(self) -> dict[str, int]:
        try:
            threads: dict[str, int] = self._client.nthreads()
        except (OSError, TimeoutError) as error:
            raise self._gone() from error
        return threads

    def _check_scheduler(self) -> None:
        if self._client.status != "running":
            raise self._gone()

    def _gone(self) -> ClusterError:
        return ClusterError(f"{self._address}: the scheduler is gone; start it again, then go on")


def check(address: str) -> None:
    """Refuse a scheduler that does not answer.

    Args:
        address: Of the scheduler, such as ``tcp://host:8786``.

    Raises:
        ClusterError: Dask is not installed, or no scheduler answers.
    """
    _connect(address).close(timeout=1)


def _connect(address: str) -> Client:
    try:
        from distributed import Client
    except ImportError as error:
        raise ClusterError("--scheduler needs Dask: pip install 'swarmevo[dask]'") from error
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what matters comes as an error of one line
    try:
        with ThreadPoolExecutor(1) as thread:  # a notebook has an event loop in its own
            thread.submit(asyncio.run, _greet(address)).result()
        return Client(address, timeout=CONNECT_SECONDS, set_as_default=False, name="swarmevo")
    except TypeError as error:  # so Dask says that it has no certificates
        raise ClusterError(f"{address}: expected certificates in Dask's configuration: {one_line(error)}") from error
    except (OSError, ValueError, TimeoutError) as error:
        raise ClusterError(f"{address}: no Dask scheduler answers; start one with: dask scheduler") from error


async def _greet(address: str) -> None:
    """Exchange greetings with a scheduler: a client would wait for those of any other server for ever.

    Raises:
        OSError, TimeoutError: It did not answer as one.
        TypeError: There are no certificates.
        ValueError: It is no address.
    """
    from distributed import Security
    from distributed.comm import connect

    async with asyncio.timeout(CONNECT_SECONDS):
        comm = await connect(address, CONNECT_SECONDS, **Security().get_connection_args("client"))
        await comm.close()

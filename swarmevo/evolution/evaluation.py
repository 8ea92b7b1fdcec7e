# SPDX-License-Identifier: BSD-3-Clause
"""Genomes and seeds in, objectives out; and where the episodes run.

An evaluation is cut into jobs (``jobs.py``). A :class:`Backend` decides where they run: here on threads, each of which
simulates a job's episodes with the interpreter lock released.

All individuals of a generation meet the same noise (common random numbers): an episode's key knows the run's seed, the
trial, the generation and the repeat, not the individual.
"""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Callable, Collection, Generator, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed, wait
from contextlib import closing
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Final, Protocol, Self

import numpy as np

from swarmevo import simulation
from swarmevo.config import Config
from swarmevo.errors import EvaluationError, Interrupted
from swarmevo.evolution import processes
from swarmevo.evolution.jobs import Job, JobResult, Setup, joined, never, run_job
from swarmevo.evolution.results import Results
from swarmevo.plugins.checked import TeamController
from swarmevo.protocols import FloatArray, GenomeSpace, Objective
from swarmevo.simulation import EpisodeKey

__all__ = [
    "Backend",
    "Evaluation",
    "EvaluationError",
    "Evaluator",
    "Interrupted",
    "Job",
    "JobResult",
    "TeamController",
    "ThreadBackend",
    "joined",
    "mean_over_repeats",
    "never",
    "reference_costs",
    "run_job",
    "to_costs",
]

TELEMETRY_BYTES: Final = 64 * 2**20
"""Most that the telemetry of one job takes."""
JOB_SECONDS: Final = 0.5
"""A job should not take longer, so that Ctrl-C is answered soon; one episode is the least."""
LEFT_SHARE: Final = 2
"""A job is at most this part of what is left for each worker: large ones first, so that the last ones are short."""
LOCKSTEP_WORLDS: Final = 8
"""Episodes in a job of a controller written in Python: enough to make a call of it cheap."""


@dataclass(frozen=True, kw_only=True)
class Evaluation(Results):
    """What n genomes did in r episodes each; m objectives."""

    costs: FloatArray
    """``(n, m)``: mean over the repeats, all to be minimised."""
    faults: dict[tuple[int, int], str]
    """Why episodes failed, by individual and repeat; theirs are the worst objectives and the hash 0."""
    seconds: float
    """From start to end."""


# ---- costs -----------------------------------------------------------------------------------------------------------


def to_costs(objectives: Sequence[Objective], values: FloatArray) -> FloatArray:
    """Return ``values`` ``(..., m)``, each in its own direction, as costs: less is better in every column."""
    maximised = np.array([objective.direction == "maximise" for objective in objectives])
    costs: FloatArray = np.where(maximised, 0.0 - values, values)  # 0 - x, as -x would make -0 of 0
    return costs


def reference_costs(objectives: Sequence[Objective]) -> FloatArray:
    """Return ``(m,)``: the worse end of each objective's range as costs, the hypervolume's reference."""
    return to_costs(objectives, np.array([objective.worst for objective in objectives], dtype=np.float64))


def mean_over_repeats(objectives: FloatArray) -> FloatArray:
    """Return ``(n, m)`` of ``(n, r, m)``, added up in the order of the repeats: the same bits for any n."""
    total = np.zeros_like(objectives[:, 0])
    for repeat in range(objectives.shape[1]):
        total += objectives[:, repeat]
    mean: FloatArray = total / objectives.shape[1]
    return mean


# ---- where jobs run --------------------------------------------------------------------------------------------------


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

    def run(self, jobs: Sequence[Job], stop: Callable[[], bool]) -> Generator[JobResult, None, None]:
        """Yield the jobs' results in any order.

        When closed early, drop the rest and wait for what still runs.

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
        self._threads = ThreadPoolExecutor(workers, thread_name_prefix="swarmevo")

    @property
    def job_seconds(self) -> float:
        """See :class:`Backend`."""
        return JOB_SECONDS

    @property
    def machines(self) -> Mapping[str, Any]:
        """See :class:`Backend`."""
        return {}

    def run(self, jobs: Sequence[Job], stop: Callable[[], bool]) -> Generator[JobResult, None, None]:
        """See :class:`Backend`."""
        cancelled = threading.Event()
        futures = [self._threads.submit(run_job, self._config_json, job, cancelled.is_set) for job in jobs]
        to_come = len(jobs)
        try:
            for future in as_completed(futures):
                if isinstance(future.exception(), Interrupted):
                    continue
                to_come -= 1
                yield future.result()
                if not cancelled.is_set() and stop() and to_come:
                    cancelled.set()
            if cancelled.is_set():
                raise Interrupted
        finally:
            cancelled.set()
            wait(futures)

    def close(self) -> None:
        """See :class:`Backend`."""
        self._threads.shutdown()
        processes.dismiss()


# ---- the evaluator ---------------------------------------------------------------------------------------------------


def forget(result: JobResult, seconds: float) -> None:
    """Do not keep."""


class Evaluator:
    """Evaluates genomes under a configuration. Use as a context manager.

    Args:
        config: With a seed.
        workers: Jobs to run at once; 0 is one for each processor that this process may use.
        backend: Made from the configuration as JSON and ``workers``.

    Raises:
        EvaluationError: A plugin is not what it should be.
        PluginError: A plugin cannot be made.
        SimulatorError: The library refuses the scene.
        ValueError: The configuration has no seed, or ``workers`` is negative.
    """

    def __init__(self, config: Config, workers: int, backend: Callable[[str, int], Backend] = ThreadBackend) -> None:
        if config.evolution.seed is None:
            raise ValueError("evolution.seed: expected a number, got None; draw one with config.seeded()")
        if workers < 0:
            raise ValueError(f"workers: expected a number of at least 0, got {workers}")
        self.seed: Final = config.evolution.seed
        self._repeats = config.evolution.repeats
        self._setup = Setup(config)
        self._episode_seconds = math.inf  # of one worker, measured
        self._backend = backend(config.model_dump_json(), workers or len(os.sched_getaffinity(0)))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the workers."""
        self._backend.close()

    @property
    def objectives(self) -> list[Objective]:
        """Of all fitness plugins, side by side."""
        return self._setup.objectives

    @property
    def reference(self) -> FloatArray:
        """``(m,)``: the worse end of each objective's range, as costs."""
        return reference_costs(self.objectives)

    @property
    def space(self) -> GenomeSpace:
        """The layout of an individual: of one robot, or, where each robot has its own genome, of the team."""
        return self._setup.space

    @property
    def robots(self) -> int:
        """In the team."""
        return self._setup.robots

    @property
    def machines(self) -> Mapping[str, Any]:
        """What to note about where episodes run, if not here."""
        return self._backend.machines

    @property
    def library(self) -> dict[str, str]:
        """What the simulator says about itself."""
        return simulation.library_info()

    def evaluate(
        self,
        genomes: FloatArray,
        trial: int,
        generation: int,
        stop: Callable[[], bool] = never,
        known: JobResult | None = None,
        keep: Callable[[JobResult, float], None] = forget,
    ) -> Evaluation:
        """Run every genome through the configured number of episodes.

        Args:
            genomes: ``(n, space.size)``, finite.
            trial: From 0.
            generation: From 0.
            stop: Asked between jobs; when true, the evaluation ends.
            known: Results of some of these episodes, from an evaluation that was cut short: not run again.
            keep: Given the results of each job when they come, and the seconds since the start; but not those of a job
                in which an episode failed, which should have another try.

        Raises:
            EvaluationError: A plugin or an episode failed.
            Interrupted: ``stop`` said so.
            ValueError: ``genomes`` has another shape.
        """
        if genomes.ndim != 2 or genomes.shape[1] != self.space.size:
            raise ValueError(f"genomes: expected the shape (n, {self.space.size}), got {genomes.shape}")
        started = time.perf_counter()
        jobs = self._jobs(genomes, trial, generation, known)
        results = []
        for result in self._run(jobs, stop):
            results.append(result)
            if not any(result.faults):
                keep(result, time.perf_counter() - started)
        if results:
            self._episode_seconds = sum(result.seconds for result in results) / sum(map(len, results))
        if known is not None:
            results.append(_without(known, jobs))
        return self._evaluation(joined(results), len(genomes), time.perf_counter() - started)

    def _evaluation(self, results: JobResult, n: int, seconds: float) -> Evaluation:
        """Return the results of all episodes of n genomes, by genome and repeat."""
        if all(results.faults):
            raise EvaluationError(f"every episode of the generation failed; the first: {results.faults[0]}")
        shape = (n, self._repeats)
        arrays = results.reshaped(*shape)
        return Evaluation(
            **arrays,
            costs=to_costs(self.objectives, mean_over_repeats(arrays["objectives"])),
            faults={place: fault for place, fault in zip(np.ndindex(shape), results.faults, strict=True) if fault},
            seconds=seconds,
        )

    def _jobs(self, genomes: FloatArray, trial: int, generation: int, known: JobResult | None) -> list[Job]:
        """Cut what is not known of the evaluation into jobs: for each individual its repeats, one after the other."""
        total = len(genomes) * self._repeats
        keys = [EpisodeKey(self.seed, trial, generation, repeat) for repeat in range(self._repeats)]
        jobs = []
        for places in self._cut(total, [] if known is None else known.places.tolist()):
            individuals = tuple(place // self._repeats for place in places)
            episodes = tuple(keys[place % self._repeats] for place in places)
            jobs.append(Job(places.start, individuals, genomes[list(individuals)], episodes))
        return jobs

    def _cut(self, total: int, known: Collection[int]) -> list[range]:
        """Return the places of each job's episodes."""
        memory = max(1, TELEMETRY_BYTES // max(self._setup.episode_bytes, 1))
        if not self._setup.native:  # always the same jobs, each as a whole: how they are cut may show in the results
            length = min(memory, LOCKSTEP_WORLDS)
            jobs = [range(start, min(start + length, total)) for start in range(0, total, length)]
            return [job for job in jobs if not set(job) <= set(known)]
        most = min(memory, self._backend.job_seconds / self._episode_seconds)
        slots, left = self._backend.slots, total - len(known)
        jobs, start = [], 0
        for end in sorted({*known, total}):
            while start < end:
                length = max(1, int(min(most, left / (slots * LEFT_SHARE), end - start)))
                jobs.append(range(start, start + length))
                start, left = start + length, left - length
            start = end + 1
        return jobs

    def _run(self, jobs: Sequence[Job], stop: Callable[[], bool]) -> Iterator[JobResult]:
        """Yield the jobs' results as they come."""
        if stop():
            raise Interrupted
        with closing(self._backend.run(jobs, stop)) as finished:
            yield from finished


def _without(known: JobResult, jobs: Sequence[Job]) -> JobResult:
    """Return the known results but for those that ``jobs`` run anew."""
    anew = {job.start + i for job in jobs for i in range(len(job.episodes))}
    return known.only(np.array([place not in anew for place in known.places.tolist()], dtype=np.bool_))

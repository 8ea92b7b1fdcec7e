# SPDX-License-Identifier: BSD-3-Clause
"""Genomes and seeds in, objectives out; and where the episodes run.

An evaluation is cut into jobs (``jobs.py``). A :class:`~swarmevo.evolution.threads.Backend` decides where they run: on
threads of this process, say, each of which simulates a job's episodes with the interpreter lock released.

All individuals of a generation meet the same noise (common random numbers): an episode's key knows the run's seed, the
trial, the generation and the repeat, not the individual.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Final, Self

import numpy as np

from swarmevo import simulation
from swarmevo.config import Config
from swarmevo.errors import EvaluationError, Interrupted
from swarmevo.evolution.jobs import Job, Setup
from swarmevo.evolution.results import Results, joined
from swarmevo.evolution.threads import MakeBackend, ThreadBackend
from swarmevo.plugins.team import never
from swarmevo.protocols import FloatArray, GenomeSpace, Objective
from swarmevo.simulation import EpisodeKey

TELEMETRY_BYTES: Final = 64 * 2**20
"""Most that the telemetry of one job takes."""
LEFT_SHARE: Final = 2
"""A job is at most this part of what is left for each worker: large ones first, so that the last ones are short."""
LOCKSTEP_WORLDS: Final = 8
"""Episodes in a job of a controller written in Python: enough to make a call of it cheap."""


@dataclass(frozen=True)
class Evaluation:
    """What n genomes did in r episodes each; m objectives."""

    episodes: Results
    """All of them, by individual and repeat."""
    costs: FloatArray
    """``(n, m)``: mean over the repeats, all to be minimised."""
    seconds: float
    """From start to end."""

    @property
    def objectives(self) -> FloatArray:
        """``(n, r, m)``: as measured, each in its own direction."""
        objectives: FloatArray = self.episodes.grid("objective")
        return objectives


# ---- costs -----------------------------------------------------------------------------------------------------------


def to_costs(objectives: Sequence[Objective], values: FloatArray) -> FloatArray:
    """Return ``values`` ``(..., m)``, each in its own direction, as costs: less is better in every column."""
    maximised = np.array([objective.is_maximised for objective in objectives])
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


# ---- the evaluator ---------------------------------------------------------------------------------------------------


def forget(result: Results, seconds: float) -> None:
    """Keep nothing."""


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

    def __init__(self, config: Config, workers: int, backend: MakeBackend = ThreadBackend) -> None:
        if config.evolution.seed is None:
            raise ValueError("evolution.seed: expected a number, got None; draw one with config.seeded()")
        if workers < 0:
            raise ValueError(f"workers: expected a number of at least 0, got {workers}")
        self.seed: Final = config.evolution.seed
        self._repeats = config.evolution.repeats
        self._setup = Setup(config)
        self._episode_seconds = math.inf  # of one worker, measured
        self._backend = backend(config.model_dump_json(), workers or len(os.sched_getaffinity(0)))
        self._process = os.getpid()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the workers; in a fork of the process that made them they are not."""
        if os.getpid() == self._process:
            self._backend.close()

    @property
    def objectives(self) -> list[Objective]:
        """Of all fitness plugins, side by side."""
        return self._setup.team.objectives

    @property
    def reference(self) -> FloatArray:
        """``(m,)``: the worse end of each objective's range, as costs."""
        return reference_costs(self.objectives)

    @property
    def space(self) -> GenomeSpace:
        """The layout of an individual: of one robot, or, where each robot has its own genome, of the team."""
        return self._setup.team.space

    @property
    def robots(self) -> int:
        """In the team."""
        return self._setup.team.robots

    @property
    def block(self) -> int:
        """How many of an individual's episodes are always run together; 1: how they are cut shows in no result."""
        return 1 if self._setup.team.is_native else min(self._most_in_memory, LOCKSTEP_WORLDS)

    @property
    def _most_in_memory(self) -> int:
        return max(1, TELEMETRY_BYTES // max(self._setup.episode_bytes, 1))

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
        known: Results | None = None,
        keep: Callable[[Results, float], None] = forget,
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
            EvaluationError: A plugin or an episode failed, ``genomes`` has another shape, or this is a fork of the
                process that made the evaluator.
            Interrupted: ``stop`` said so.
        """
        if os.getpid() != self._process:
            raise EvaluationError(
                f"evaluator: expected process {self._process}, which made it, got {os.getpid()}, a fork of it without "
                "its workers; make one in each process"
            )
        self._setup.team.check(genomes)
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
        where = f"trial {trial}, generation {generation}"
        return self._evaluation(joined(results), time.perf_counter() - started, where)

    def _evaluation(self, episodes: Results, seconds: float, where: str) -> Evaluation:
        """Return what all episodes of an evaluation mean; ``where``: of which generation they are, in words."""
        if all(episodes.faults):
            raise EvaluationError(f"{where}: every episode failed; individual 0, repeat 0: {episodes.faults[0]}")
        costs = to_costs(self.objectives, mean_over_repeats(episodes.grid("objective")))
        return Evaluation(episodes, costs, seconds)

    def _jobs(self, genomes: FloatArray, trial: int, generation: int, known: Results | None) -> list[Job]:
        """Cut what is not known of the evaluation into jobs: for each individual its repeats, one after the other."""
        total = len(genomes) * self._repeats
        keys = [EpisodeKey(self.seed, trial, generation, repeat) for repeat in range(self._repeats)]
        jobs = []
        for places in self._cut(total, [] if known is None else self._places(known)):
            individuals = tuple(place // self._repeats for place in places)
            episodes = tuple(keys[place % self._repeats] for place in places)
            jobs.append(Job(individuals, genomes[list(individuals)], episodes))
        return jobs

    def _places(self, known: Results) -> list[int]:
        """Return the number of each episode in the evaluation: individual by individual, repeat by repeat."""
        places: list[int] = (known.individual * self._repeats + known.repeat).tolist()
        return places

    def _cut(self, total: int, known: Collection[int]) -> list[range]:
        """Return the places of each job's episodes."""
        if (
            not self._setup.team.is_native
        ):  # always the same jobs, each as a whole: how they are cut may show in the results
            length = self.block
            jobs = [range(start, min(start + length, total)) for start in range(0, total, length)]
            return [job for job in jobs if not set(job) <= set(known)]
        most = min(self._most_in_memory, self._backend.job_seconds / self._episode_seconds)
        slots, left = self._backend.slots, total - len(known)
        jobs, start = [], 0
        for end in sorted({*known, total}):
            while start < end:
                length = max(1, int(min(most, left / (slots * LEFT_SHARE), end - start)))
                jobs.append(range(start, start + length))
                start, left = start + length, left - length
            start = end + 1
        return jobs

    def _run(self, jobs: Sequence[Job], stop: Callable[[], bool]) -> Iterator[Results]:
        """Yield the jobs' results as they come."""
        if stop():
            raise Interrupted
        with closing(self._backend.run(jobs, stop)) as finished:
            yield from finished


def _without(known: Results, jobs: Sequence[Job]) -> Results:
    """Return the known results but for those that ``jobs`` run anew."""
    anew = {(i, key.repeat) for job in jobs for i, key in zip(job.individuals, job.episodes, strict=True)}
    places = zip(known.individual.tolist(), known.repeat.tolist(), strict=True)
    return known.only(np.array([place not in anew for place in places], dtype=np.bool_))

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

import moocore
import numpy as np

from swarmevo import simulation
from swarmevo.config import Config
from swarmevo.errors import EvaluationError, Interrupted
from swarmevo.evolution.aggregation import OverWorlds
from swarmevo.evolution.archive import Archive
from swarmevo.evolution.costs import reference_costs, to_costs
from swarmevo.evolution.jobs import Job, Setup
from swarmevo.evolution.results import Place, Results, joined
from swarmevo.evolution.threads import MakeBackend, ThreadBackend
from swarmevo.plugins.team import never
from swarmevo.protocols import BoolArray, Descriptor, FloatArray, GenomeSpace, IntArray, Objective
from swarmevo.simulation import EpisodeKey

TELEMETRY_BYTES: Final = 64 * 2**20
"""Most that the telemetry of one job takes."""
LEFT_SHARE: Final = 2
"""A job is at most this part of what is left for each worker: large ones first, so that the last ones are short."""
LOCKSTEP_WORLDS: Final = 8
"""Episodes in a job of a controller written in Python: enough to make a call of it cheap."""


@dataclass(frozen=True)
class Evaluation:
    """What n genomes did in their episodes; m objectives, d descriptors."""

    episodes: Results
    """All of them, by individual and repeat."""
    costs: FloatArray
    """``(n, m)``: means in each world, then over the worlds (``aggregation.py``), all to be minimised."""
    descriptors: FloatArray
    """``(n, d)``: likewise, as measured; NaN where every episode failed."""
    seconds: float
    """From start to end."""

    @property
    def objectives(self) -> FloatArray:
        """``(n, r, m)``: as measured, each in its own direction; where all have r episodes."""
        objectives: FloatArray = self.episodes.grid("objective")
        return objectives


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
        self._setup = Setup(config)
        self._over_worlds = OverWorlds(config, self.objectives)
        self._evolution = config.evolution
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
        """Of all fitness plugins, side by side, each with the widest range that it has in any world."""
        return self._setup.objectives

    @property
    def descriptors(self) -> list[Descriptor]:
        """Likewise."""
        return self._setup.descriptors

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
        """In the largest team of any world."""
        return self._setup.robots

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

    def archive(self) -> Archive:
        """Return an empty archive of a trial."""
        return Archive(self._over_worlds, self.objectives, self.space.size)

    def evaluate(
        self,
        genomes: FloatArray,
        trial: int,
        generation: int,
        stop: Callable[[], bool] = never,
        known: Results | None = None,
        keep: Callable[[Results, float], None] = forget,
        racing: int = 0,
        episodes: IntArray | None = None,
    ) -> Evaluation:
        """Run every genome through its episodes: in each world as many as the configuration has repeats.

        Args:
            genomes: ``(n, space.size)``, finite.
            trial: From 0.
            generation: From 0.
            stop: Asked between jobs; when true, the evaluation ends.
            known: Results of some of these episodes, from an evaluation that was cut short: not run again.
            keep: Given the results of each job when they come, and the seconds since the start; but not those of a job
                in which an episode failed, which should have another try.
            racing: How many of the genomes, from the first on, race (``evolution.race_after``).
            episodes: ``(n,)``: how many episodes each genome has; nobody races then.

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
        all_repeats = self._evolution.repeats * len(self._setup.worlds)
        most = np.full(len(genomes), all_repeats) if episodes is None else episodes
        first = self._evolution.race_after * len(self._setup.worlds)
        parts: list[Results] = []

        def run(plan: list[Place]) -> None:
            jobs = self._jobs(genomes, plan, trial, generation, set() if known is None else known.places())
            results = []
            for result in self._run(jobs, stop):
                results.append(result)
                if not any(result.faults):
                    keep(result, time.perf_counter() - started)
            if results:
                self._episode_seconds = sum(result.seconds for result in results) / sum(map(len, results))
            if known is not None:
                results.append(known.only(known.are_of(set(plan) - {place for job in jobs for place in job.places()})))
            parts.extend(results)

        if racing and 0 < first < all_repeats:
            run([(i, repeat) for i in range(len(genomes)) for repeat in range(first)])
            goes_on = self._goes_on(joined(parts), len(genomes), racing)
            run([(i, repeat) for i in np.flatnonzero(goes_on).tolist() for repeat in range(first, all_repeats)])
        else:
            run([(i, repeat) for i, count in enumerate(most.tolist()) for repeat in range(count)])
        where = f"trial {trial}, generation {generation}"
        return self._evaluation(joined(parts), len(genomes), time.perf_counter() - started, where)

    def _evaluation(self, episodes: Results, individuals: int, seconds: float, where: str) -> Evaluation:
        """Return what all episodes of an evaluation mean; ``where``: of which generation they are, in words."""
        if all(episodes.faults):
            raise EvaluationError(f"{where}: every episode failed; individual 0, repeat 0: {episodes.faults[0]}")
        costs, descriptors = self._costs(episodes, individuals), self._over_worlds.describe(episodes, individuals)
        return Evaluation(episodes, costs, descriptors, seconds)

    def _costs(self, episodes: Results, individuals: int) -> FloatArray:
        return to_costs(self.objectives, self._over_worlds.judge(episodes, individuals))

    def _goes_on(self, episodes: Results, individuals: int, racing: int) -> BoolArray:
        """Return ``(individuals,)``: who has more episodes after the first ones.

        Of those who race, whole layers of non-dominated ones go on, the first first, until they are ``race_keep`` of
        them.
        """
        layer = moocore.pareto_rank(self._costs(episodes, individuals)[:racing])
        worst = np.sort(layer)[max(1, math.ceil(self._evolution.race_keep * racing)) - 1]
        return np.concatenate([layer <= worst, np.ones(individuals - racing, dtype=np.bool_)])

    def _jobs(
        self, genomes: FloatArray, plan: Sequence[Place], trial: int, generation: int, known: Collection[Place]
    ) -> list[Job]:
        """Cut what is not known of a plan into jobs."""
        jobs = []
        for part in self._cut(len(plan), [i for i, place in enumerate(plan) if place in known]):
            individuals = tuple(plan[i][0] for i in part)
            episodes = tuple(EpisodeKey(self.seed, trial, generation, plan[i][1]) for i in part)
            jobs.append(Job(individuals, genomes[list(individuals)], episodes))
        return jobs

    def _cut(self, total: int, known: Collection[int]) -> list[range]:
        """Return the places in the plan of each job's episodes."""
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

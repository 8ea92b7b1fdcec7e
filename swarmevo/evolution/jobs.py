# SPDX-License-Identifier: BSD-3-Clause
"""Some of an evaluation's episodes as plain data, and what turns them into results anywhere.

A result must not depend on how the work was cut, or a run could not be repeated. So every plugin is shown one episode
at a time: NumPy may sum in another order when other episodes stand beside it. Only a controller written in Python sees
the several worlds of its job at once; its jobs are therefore cut the same way on every machine.

An episode fails when the physics, the controller or a fitness does. Then the run ends, or, with ``evolution.on_fault:
worst``, the episode gets the worst objectives. A job that fails as a whole is run again episode by episode, so that
only those episodes fail which do so alone.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swarmevo import simulation
from swarmevo.config import Config
from swarmevo.errors import EvaluationError, Interrupted
from swarmevo.evolution import processes
from swarmevo.evolution.results import Results
from swarmevo.plugins.checked import (
    CancellableController,
    CheckedController,
    CheckedFitness,
    TeamController,
    check_names,
)
from swarmevo.protocols import CHANNELS, BoolArray, FloatArray, Telemetry
from swarmevo.simulation import EpisodeKey

START_SECONDS: Final = 120.0
"""Most that a process with a time limit takes to start and to load the plugins, on a busy machine."""


@dataclass(frozen=True)
class Job:
    """Some of an evaluation's k episodes, as plain data."""

    start: int
    """Number of its first episode in the evaluation."""
    individuals: tuple[int, ...]
    """``k``: whom each episode tries, to name in errors."""
    genomes: FloatArray
    """``(k, size)``"""
    episodes: tuple[EpisodeKey, ...]
    """``k``"""

    def alone(self, i: int) -> Job:
        """Return episode i as a job of its own."""
        return Job(self.start + i, self.individuals[i : i + 1], self.genomes[i : i + 1], self.episodes[i : i + 1])


@dataclass(frozen=True, kw_only=True)
class JobResult(Results):
    """What k episodes gave."""

    places: NDArray[np.intp]
    """``(k,)``: number of each episode in the evaluation: individual times repeats, plus repeat."""
    faults: tuple[str, ...]
    """``k``: why each failed; "" where it did not."""
    seconds: float
    """That they took."""

    def __len__(self) -> int:
        return len(self.places)

    def only(self, wanted: BoolArray) -> JobResult:
        """Return the episodes where ``wanted`` ``(k,)`` is true."""
        return JobResult(
            **{name: array[wanted] for name, array in self.results().items()},
            places=self.places[wanted],
            faults=tuple(fault for fault, want in zip(self.faults, wanted, strict=True) if want),
            seconds=self.seconds,
        )


def joined(results: Sequence[JobResult]) -> JobResult:
    """Return one or more results as one, in the order of their episodes."""
    places = np.concatenate([result.places for result in results])
    order = np.argsort(places)
    arrays = [result.results() for result in results]
    faults = [fault for result in results for fault in result.faults]
    return JobResult(
        **{name: np.concatenate([array[name] for array in arrays])[order] for name in arrays[0]},
        places=places[order],
        faults=tuple(faults[i] for i in order),
        seconds=sum(result.seconds for result in results),
    )


def never() -> bool:
    """Do not stop."""
    return False


def run_job(config_json: str, job: Job, cancelled: Callable[[], bool] = never) -> JobResult:
    """Run a job on the calling thread. A pure function: any process on any machine gives the same.

    With a time limit (``evolution.episode_timeout``) it runs in a process of its own, which is killed when it takes
    longer than the limit times its number of episodes, or ends by itself.

    Args:
        config_json: A ``Config``, by ``model_dump_json()``.
        job: What to run.
        cancelled: Asked now and then; when true, the result is not wanted any more.

    Raises:
        EvaluationError: A plugin or an episode failed.
        PluginError: A plugin cannot be made.
        Interrupted: It was cancelled.
    """
    if cancelled():
        raise Interrupted
    setup = _setup(config_json)
    if setup.timeout is None:
        return setup.run(job, cancelled)
    return _run_supervised(config_json, setup, job, cancelled)


def _run_supervised(config_json: str, setup: Setup, job: Job, cancelled: Callable[[], bool]) -> JobResult:
    """Run a job in another process; if that gets lost, run its episodes one by one or say what happened."""
    limit = (setup.timeout or 0.0) * len(job.episodes)
    started = time.perf_counter()
    try:
        with processes.child() as child:
            child.call(_warm_up, (config_json,), START_SECONDS, cancelled)
            return child.call(_run_here, (config_json, job), limit, cancelled)
    except processes.Cancelled as wish:
        raise Interrupted from wish
    except processes.Lost as lost:
        reason = f"the episode {lost}"
        if not setup.goes_on:
            raise EvaluationError(f"{_place(job, 0)}{_others(job)}: {reason} (evolution.episode_timeout)") from lost
        if len(job.episodes) == 1:
            return setup.failed(job, reason, time.perf_counter() - started)
        return joined([_run_supervised(config_json, setup, job.alone(i), cancelled) for i in range(len(job.episodes))])


def _warm_up(config_json: str) -> None:
    _setup(config_json)


def _run_here(config_json: str, job: Job) -> JobResult:
    return _setup(config_json).run(job, never)


def _others(job: Job) -> str:
    more = len(job.episodes) - 1
    return f", or one of the {more} episodes after it" if more else ""


_THREAD = threading.local()  # a cache: what a thread made from the configuration that it saw last


def _setup(config_json: str) -> Setup:
    if getattr(_THREAD, "config_json", None) != config_json:
        _THREAD.setup = Setup(Config.model_validate_json(config_json))
        _THREAD.config_json = config_json
    setup: Setup = _THREAD.setup
    return setup


class Setup:
    """A configuration's scene and plugins, for one thread: a plugin need not be safe to share."""

    def __init__(self, config: Config) -> None:
        self._scene = simulation.Scene(config)
        self._info = self._scene.info
        self._own_genomes = config.team.genomes == "individual"
        self._controller = CheckedController(config, self._info)
        self._fitness = [CheckedFitness(name, options) for name, options in config.fitness.items()]
        self._channels = sorted({channel for fitness in self._fitness for channel in fitness.channels})
        self.objectives = [objective for fitness in self._fitness for objective in fitness.objectives]
        check_names(self.objectives)
        self.timeout = config.evolution.episode_timeout
        self.goes_on = config.evolution.on_fault == "worst"
        space = self._controller.space
        self.space = space.tile(self._info.robots) if self._own_genomes else space
        self._judged = TeamController(self._controller.made, self._info.robots) if self._own_genomes else None

    @property
    def native(self) -> bool:
        """Whether the controller runs in the library."""
        return self._controller.is_native

    @property
    def robots(self) -> int:
        """In the team."""
        return self._info.robots

    @property
    def episode_bytes(self) -> int:
        """Size of an episode's telemetry."""
        sizes = [CHANNELS[name].sizes(self._info.robots) for name in self._channels]
        return 8 * self._info.control_steps * sum(map(math.prod, sizes))

    def run(self, job: Job, cancelled: Callable[[], bool]) -> JobResult:
        """Run a job on the calling thread."""
        started = time.perf_counter()
        try:
            return self._run(job, cancelled)
        except EvaluationError as error:
            if not self.goes_on:
                raise
            if len(job.episodes) == 1:
                return self.failed(job, str(error), time.perf_counter() - started)
            return joined([self.run(job.alone(i), cancelled) for i in range(len(job.episodes))])

    def _run(self, job: Job, cancelled: Callable[[], bool]) -> JobResult:
        started = time.perf_counter()
        done = self._simulate(job, cancelled)
        failed = np.flatnonzero(done.status)
        if len(failed):
            first = int(failed[0])
            raise EvaluationError(f"{_place(job, first)}: the episode failed: {done.messages[first]}")
        objectives = [self._judge(done.telemetry, job.genomes, i) for i in range(len(job.episodes))]
        return JobResult(
            places=job.start + np.arange(len(job.episodes)),
            objectives=np.array(objectives),
            hash=done.hash,
            push_time=done.telemetry.push_time,
            homing_time=done.telemetry.homing_time,
            ode_messages=done.ode_messages,
            unsolved_steps=done.unsolved_steps,
            faults=("",) * len(job.episodes),
            seconds=time.perf_counter() - started,
        )

    def failed(self, job: Job, reason: str, seconds: float) -> JobResult:
        """Return the result of a job whose one episode failed."""
        return JobResult(
            places=np.array([job.start]),
            objectives=np.array([[objective.worst for objective in self.objectives]], dtype=np.float64),
            hash=np.zeros(1, dtype=np.uint64),
            push_time=np.full(1, np.nan),
            homing_time=np.full((1, self._info.robots), np.nan),
            ode_messages=np.zeros(1, dtype=np.uint32),
            unsolved_steps=np.zeros(1, dtype=np.uint32),
            faults=(reason,),
            seconds=seconds,
        )

    def _simulate(self, job: Job, cancelled: Callable[[], bool]) -> simulation.Episodes:
        n, robots = len(job.episodes), self._info.robots
        teams = job.genomes.reshape(n, robots if self._own_genomes else 1, -1)  # (n, robots or 1, size)
        if not self._controller.is_native:
            genomes = np.repeat(teams, robots // teams.shape[1], axis=1)
            controller = CancellableController(self._controller, cancelled)
            return simulation.simulate_lockstep(self._scene, controller, genomes, job.episodes, self._channels)
        policies = self._controller.policies(teams)
        numbers = np.arange(n * teams.shape[1], dtype=np.uint32).reshape(teams.shape[:2])
        robot_policies = np.ascontiguousarray(np.broadcast_to(numbers, (n, robots)))
        try:
            return simulation.simulate(self._scene, policies, job.episodes, robot_policies, self._channels)
        except simulation.InvalidArgument as error:
            raise EvaluationError(f"{self._controller.title}: its policies were refused: {error}") from error

    def _judge(self, telemetry: Telemetry, genomes: FloatArray, i: int) -> FloatArray:
        """Return the objectives ``(m,)`` of episode i."""
        controller = self._judged or self._controller.made
        return np.concatenate(
            [
                fitness.evaluate(_episode(telemetry, i, fitness.channels), genomes[i : i + 1].copy(), controller)
                for fitness in self._fitness
            ]
        )


def _place(job: Job, i: int) -> str:
    key = job.episodes[i]
    return f"trial {key.trial}, generation {key.generation}, individual {job.individuals[i]}, repeat {key.repeat}"


def _episode(telemetry: Telemetry, i: int, channels: Sequence[str]) -> Telemetry:
    """Return episode i alone, with no channel but ``channels``: what a fitness does not name it does not get."""
    arrays = {name: getattr(telemetry, name)[i : i + 1] for name in ("homing_time", "push_time", *channels)}
    for array in arrays.values():
        array.flags.writeable = False  # the next fitness reads it too
    return Telemetry(control_period=telemetry.control_period, **arrays)

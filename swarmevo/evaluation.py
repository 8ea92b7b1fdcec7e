# SPDX-License-Identifier: BSD-3-Clause
"""Genomes and seeds in, objectives out; and where the episodes run.

An evaluation is cut into jobs: plain data, which :func:`run_job` turns into results anywhere. A :class:`Backend`
decides where: here on threads, each of which simulates a job's episodes with the interpreter lock released.

A result must not depend on how the work was cut, or a run could not be repeated. So every plugin is shown one episode
at a time: NumPy may sum in another order when other episodes stand beside it. Only a controller written in Python sees
the several worlds of its job at once; its jobs are therefore cut the same way on every machine.

All individuals of a generation meet the same noise (common random numbers): an episode's key knows the run's seed, the
trial, the generation and the repeat, not the individual.

An episode fails when the physics, the controller or a fitness does. Then the run ends, or, with ``evolution.on_fault:
worst``, the episode gets the worst objectives. A job that fails as a whole is run again episode by episode, so that
only those episodes fail which do so alone.
"""

from __future__ import annotations

import dataclasses
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
from numpy.typing import NDArray

from swarmevo import plugins, simulator, supervision
from swarmevo.config import Config
from swarmevo.protocols import (
    CHANNELS,
    BoolArray,
    Compiled,
    Controller,
    FeedForward,
    Fitness,
    FloatArray,
    GenomeSpace,
    NativeController,
    NativePolicies,
    Objective,
    SceneInfo,
    Telemetry,
)
from swarmevo.simulator import EpisodeKey

TELEMETRY_BYTES: Final = 64 * 2**20
"""Most that the telemetry of one job takes."""
JOB_SECONDS: Final = 0.5
"""A job should not take longer, so that Ctrl-C is answered soon; one episode is the least."""
LEFT_SHARE: Final = 2
"""A job is at most this part of what is left for each worker: large ones first, so that the last ones are short."""
START_SECONDS: Final = 120.0
"""Most that a process with a time limit takes to start and to load the plugins, on a busy machine."""
LOCKSTEP_WORLDS: Final = 8
"""Episodes in a job of a controller written in Python: enough to make a call of it cheap."""


class EvaluationError(Exception):
    """A plugin returned what it must not, or an episode failed. One line, which names it."""


class Interrupted(Exception):  # noqa: N818 - a wish fulfilled, not an error
    """The evaluation was asked to stop, and did."""


@dataclass(frozen=True)
class Evaluation:
    """What n genomes did in r episodes each; m objectives."""

    objectives: FloatArray
    """``(n, r, m)``, each in its own direction."""
    costs: FloatArray
    """``(n, m)``: mean over the repeats, all to be minimised."""
    hash: NDArray[np.uint64]
    """``(n, r)``: of each episode's trajectory."""
    push_time: FloatArray
    """``(n, r)`` [s]; NaN: never."""
    homing_time: FloatArray
    """``(n, r, robots)`` [s]; NaN: never."""
    ode_messages: NDArray[np.uint32]
    """``(n, r)``: warnings of the physics library."""
    unsolved_steps: NDArray[np.uint32]
    """``(n, r)``: time steps that it could not solve."""
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


def worst(objectives: Sequence[Objective]) -> FloatArray:
    """Return ``(m,)``: the worse end of each objective's range."""
    return np.array([o.range[0] if o.direction == "maximise" else o.range[1] for o in objectives], dtype=np.float64)


def reference_costs(objectives: Sequence[Objective]) -> FloatArray:
    """Return ``(m,)``: the worse end of each objective's range as costs, the hypervolume's reference."""
    return to_costs(objectives, worst(objectives))


def mean_over_repeats(objectives: FloatArray) -> FloatArray:
    """Return ``(n, m)`` of ``(n, r, m)``, added up in the order of the repeats: the same bits for any n."""
    total = np.zeros_like(objectives[:, 0])
    for repeat in range(objectives.shape[1]):
        total += objectives[:, repeat]
    mean: FloatArray = total / objectives.shape[1]
    return mean


# ---- jobs ------------------------------------------------------------------------------------------------------------


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


@dataclass(frozen=True)
class JobResult:
    """What k episodes gave; fields as in :class:`Evaluation`, with one axis for individuals and repeats."""

    places: NDArray[np.intp]
    """``(k,)``: number of each episode in the evaluation: individual times repeats, plus repeat."""
    objectives: FloatArray
    hash: NDArray[np.uint64]
    push_time: FloatArray
    homing_time: FloatArray
    ode_messages: NDArray[np.uint32]
    unsolved_steps: NDArray[np.uint32]
    faults: tuple[str, ...]
    """``k``: why each failed; "" where it did not."""
    seconds: float
    """That they took."""

    def __len__(self) -> int:
        return len(self.places)

    def only(self, wanted: BoolArray) -> JobResult:
        """Return the episodes where ``wanted`` ``(k,)`` is true."""
        arrays = {name: getattr(self, name)[wanted] for name in _ARRAYS}
        return JobResult(
            **arrays,
            faults=tuple(fault for fault, want in zip(self.faults, wanted, strict=True) if want),
            seconds=self.seconds,
        )


_ARRAYS: Final = ("places", "objectives", "hash", "push_time", "homing_time", "ode_messages", "unsolved_steps")


def joined(results: Sequence[JobResult]) -> JobResult:
    """Return one or more results as one, in the order of their episodes."""
    places = np.concatenate([result.places for result in results])
    order = np.argsort(places)
    faults = [fault for result in results for fault in result.faults]
    return JobResult(
        **{name: np.concatenate([getattr(result, name) for result in results])[order] for name in _ARRAYS},
        faults=tuple(faults[i] for i in order),
        seconds=sum(result.seconds for result in results),
    )


def never() -> bool:
    """Do not stop."""
    return False


def forget(result: JobResult, seconds: float) -> None:
    """Do not keep."""


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


def _run_supervised(config_json: str, setup: _Setup, job: Job, cancelled: Callable[[], bool]) -> JobResult:
    """Run a job in another process; if that gets lost, run its episodes one by one or say what happened."""
    limit = (setup.timeout or 0.0) * len(job.episodes)
    started = time.perf_counter()
    try:
        with supervision.child() as child:
            child.call(_warm_up, (config_json,), START_SECONDS, cancelled)
            return child.call(_run_here, (config_json, job), limit, cancelled)
    except supervision.Cancelled as wish:
        raise Interrupted from wish
    except supervision.Lost as lost:
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


def _setup(config_json: str) -> _Setup:
    if getattr(_THREAD, "config_json", None) != config_json:
        _THREAD.setup = _Setup(Config.model_validate_json(config_json))
        _THREAD.config_json = config_json
    setup: _Setup = _THREAD.setup
    return setup


class _Setup:
    """A configuration's scene and plugins, for one thread: a plugin need not be safe to share."""

    def __init__(self, config: Config) -> None:
        self._scene = simulator.Scene(config)
        self._info = self._scene.info
        self._own_genomes = config.team.genomes == "individual"
        self._controller = _CheckedController(config, self._info)
        self._fitness = [_CheckedFitness(name, options) for name, options in config.fitness.items()]
        self._channels = sorted({channel for fitness in self._fitness for channel in fitness.channels})
        self.objectives = [objective for fitness in self._fitness for objective in fitness.objectives]
        _check_names(self.objectives)
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
        shapes = [[self._info.robots if a == "robots" else int(a) for a in CHANNELS[c]] for c in self._channels]
        return 8 * self._info.control_steps * sum(math.prod(shape) for shape in shapes)

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
            objectives=worst(self.objectives)[np.newaxis],
            hash=np.zeros(1, dtype=np.uint64),
            push_time=np.full(1, np.nan),
            homing_time=np.full((1, self._info.robots), np.nan),
            ode_messages=np.zeros(1, dtype=np.uint32),
            unsolved_steps=np.zeros(1, dtype=np.uint32),
            faults=(reason,),
            seconds=seconds,
        )

    def _simulate(self, job: Job, cancelled: Callable[[], bool]) -> simulator.Episodes:
        n, robots = len(job.episodes), self._info.robots
        teams = job.genomes.reshape(n, robots if self._own_genomes else 1, -1)  # (n, robots or 1, size)
        if not self._controller.is_native:
            genomes = np.repeat(teams, robots // teams.shape[1], axis=1)
            controller = _CancellableController(self._controller, cancelled)
            return simulator.simulate_lockstep(self._scene, controller, genomes, job.episodes, self._channels)
        policies = self._controller.policies(teams)
        numbers = np.arange(n * teams.shape[1], dtype=np.uint32).reshape(teams.shape[:2])
        robot_policies = np.ascontiguousarray(np.broadcast_to(numbers, (n, robots)))
        try:
            return simulator.simulate(self._scene, policies, job.episodes, robot_policies, self._channels)
        except simulator.InvalidArgument as error:
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


# ---- plugins, checked ------------------------------------------------------------------------------------------------


class TeamController:
    """A controller whose robots have a genome each, as the fitness sees it: a genome is a whole team's."""

    def __init__(self, controller: Controller, robots: int) -> None:
        self._controller = controller
        self._robots = robots

    def space(self, scene: SceneInfo) -> GenomeSpace:
        """Return the layout of a team's genome: a robot's, as often as there are robots."""
        return self._controller.space(scene).tile(self._robots)

    def complexity(self, genomes: FloatArray) -> FloatArray:
        """Return ``(n,)``: mean over the robots."""
        each = self._controller.complexity(genomes.reshape(len(genomes) * self._robots, -1))
        mean: FloatArray = np.reshape(each, (len(genomes), self._robots)).mean(axis=1)
        return mean


class _CheckedController:
    """The configured controller; what it returns is checked, what it raises is explained."""

    def __init__(self, config: Config, info: SceneInfo) -> None:
        ((name, options),) = config.controller.items()
        self.title = plugin_title("controller", name)
        self.made: Any = plugins.create("controller", name, options)
        self.is_native = isinstance(self.made, NativeController)
        self.space = self._checked_space(info)

    def _checked_space(self, info: SceneInfo) -> GenomeSpace:
        space = _call(self.title, "space", self.made.space, info)
        if not isinstance(space, GenomeSpace):
            raise EvaluationError(f"{self.title}: space: expected a GenomeSpace, got {type(space).__name__}")
        if space.size < 1:
            raise EvaluationError(f"{self.title}: space: expected at least one gene, got none")
        return space

    def policies(self, teams: FloatArray) -> NativePolicies:
        """Return one policy for each genome of ``teams`` ``(n, genomes, size)``, made team by team."""
        return _one([self._policies(team.copy()) for team in teams])

    def _policies(self, genomes: FloatArray) -> NativePolicies:
        policies = _call(self.title, "policies", self.made.policies, genomes)
        if not isinstance(policies, FeedForward | Compiled):
            raise EvaluationError(
                f"{self.title}: policies: expected FeedForward or Compiled, got {type(policies).__name__}"
            )
        if len(policies) != len(genomes):
            raise EvaluationError(f"{self.title}: policies: expected {len(genomes)} policies, got {len(policies)}")
        return policies


class _CancellableController:
    """A controller in lockstep: asked before each step whether to go on, its commands checked after it."""

    def __init__(self, controller: _CheckedController, cancelled: Callable[[], bool]) -> None:
        self._controller = controller
        self._cancelled = cancelled

    def space(self, scene: SceneInfo) -> GenomeSpace:
        return self._controller.space

    def complexity(self, genomes: FloatArray) -> FloatArray:
        complexity: FloatArray = self._controller.made.complexity(genomes)
        return complexity

    def start(self, genomes: FloatArray) -> None:
        _call(self._controller.title, "start", self._controller.made.start, genomes)

    def act(self, observations: FloatArray) -> FloatArray:
        if self._cancelled():
            raise Interrupted
        commands = _call(self._controller.title, "act", self._controller.made.act, observations)
        return _numbers(commands, (*observations.shape[:2], 2), f"{self._controller.title}: act")


class _CheckedFitness:
    """A configured fitness; what it returns is checked, what it raises is explained."""

    def __init__(self, name: str, options: dict[str, Any]) -> None:
        self._title = plugin_title("fitness", name)
        self._made: Fitness = plugins.create("fitness", name, options)
        self.objectives: tuple[Objective, ...] = _call(self._title, "objectives", lambda: tuple(self._made.objectives))
        self.channels: tuple[str, ...] = _call(self._title, "channels", lambda: tuple(self._made.channels))
        self._check_objectives()
        self._check_channels()

    def _check_objectives(self) -> None:
        if not self.objectives:
            raise EvaluationError(f"{self._title}: objectives: expected at least one, got none")
        for objective in self.objectives:
            if not isinstance(objective, Objective):
                wrong = f"expected an Objective, got {type(objective).__name__}"
            elif objective.direction not in ("maximise", "minimise"):
                wrong = f"{objective.name}: expected the direction maximise or minimise, got {objective.direction!r}"
            elif not _is_range(objective.range):
                wrong = f"{objective.name}: expected as range two finite numbers, low and high, got {objective.range!r}"
            else:
                continue
            raise EvaluationError(f"{self._title}: objectives: {wrong}")

    def _check_channels(self) -> None:
        unknown = [channel for channel in self.channels if channel not in list(CHANNELS)]
        if unknown:
            raise EvaluationError(
                f"{self._title}: channels: expected some of {', '.join(CHANNELS)}, got {unknown[0]!r}"
            )

    def evaluate(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> FloatArray:
        """Return the objectives ``(m,)`` of one episode."""
        values = _call(self._title, "evaluate", self._made.evaluate, telemetry, genomes, controller)
        objectives: FloatArray = _numbers(values, (1, len(self.objectives)), f"{self._title}: evaluate")[0]
        if not np.isfinite(objectives).all():
            raise EvaluationError(f"{self._title}: evaluate: expected finite numbers, got {objectives.tolist()}")
        return objectives


def plugin_title(kind: str, name: str) -> str:
    """Return how a plugin is called in errors: with the distribution that it is from."""
    return f"{kind}.{name} ({plugins.find(kind, name).origin})"


def one_line(error: BaseException) -> str:
    """Return an exception's type and message as one line."""
    return " ".join(f"{type(error).__name__}: {error}".split())


def _call(title: str, method: str, function: Callable[..., Any], *arguments: object) -> Any:
    """Call a plugin's method."""
    try:
        return function(*arguments)
    except Exception as error:  # whatever a stranger's plugin raises
        raise EvaluationError(f"{title}: {method} raised {one_line(error)}") from error


def _is_range(value: Any) -> bool:
    try:
        low, high = value
        return bool(-math.inf < low < high < math.inf)
    except (TypeError, ValueError):  # no pair, or not of numbers
        return False


def _numbers(values: object, shape: tuple[int, ...], what: str) -> FloatArray:
    """Return ``values`` as a float array after a check of its shape."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise EvaluationError(f"{what}: expected an array of numbers, got {type(values).__name__}") from error
    if array.shape != shape:
        raise EvaluationError(f"{what}: expected an array of shape {shape}, got {array.shape}")
    return array


def _check_names(objectives: Sequence[Objective]) -> None:
    names = [objective.name for objective in objectives]
    for name in names:
        if names.count(name) > 1:
            raise EvaluationError(f"fitness: two objectives are named {name!r}; choose plugins or options that differ")


def _one(parts: Sequence[NativePolicies]) -> NativePolicies:
    """Return the policies of all ``parts``, which one controller made."""
    first = parts[0]
    if isinstance(first, FeedForward):
        networks = [part for part in parts if isinstance(part, FeedForward)]
        return dataclasses.replace(
            first,
            input_hidden=np.concatenate([part.input_hidden for part in networks]),
            hidden_output=np.concatenate([part.hidden_output for part in networks]),
            hidden_switch=np.concatenate([part.hidden_switch for part in networks]),
        )
    parameters = np.concatenate([part.parameters for part in parts if isinstance(part, Compiled)])
    return dataclasses.replace(first, parameters=parameters, keep_alive=tuple(parts))


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
        supervision.dismiss()


# ---- the evaluator ---------------------------------------------------------------------------------------------------


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
        self._setup = _Setup(config)
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
        return simulator.library_info()

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

        def gathered(name: str) -> NDArray[Any]:
            values = getattr(results, name)
            return np.reshape(values, (*shape, *values.shape[1:]))

        objectives = gathered("objectives")
        return Evaluation(
            objectives=objectives,
            costs=to_costs(self.objectives, mean_over_repeats(objectives)),
            hash=gathered("hash"),
            push_time=gathered("push_time"),
            homing_time=gathered("homing_time"),
            ode_messages=gathered("ode_messages"),
            unsolved_steps=gathered("unsolved_steps"),
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

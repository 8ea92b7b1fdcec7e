# SPDX-License-Identifier: BSD-3-Clause
"""Some of an evaluation's episodes as plain data, and what turns them into results anywhere.

A result must not depend on how the work was cut, or a run could not be repeated. So every plugin is shown one episode
at a time: NumPy may sum in another order when other episodes stand beside it. Only a controller written in Python sees
the several worlds of its job at once; its jobs are therefore cut the same way on every machine.

An episode fails when the physics, the controller or a fitness does. Then the run ends, or, with ``evolution.on_fault:
worst``, the episode gets the worst objectives. A job that fails as a whole is run again episode by episode, so that
only those episodes fail which do so alone, and the line that ends a run names the one.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from swarmevo.config import Config, Worlds, each_world
from swarmevo.errors import EvaluationError, Interrupted, PluginError
from swarmevo.evolution import processes
from swarmevo.evolution.identity import Identity, difference, identity
from swarmevo.evolution.results import COLUMNS, Place, Results, joined
from swarmevo.plugins.checked import check_together, widest
from swarmevo.plugins.team import Team, never
from swarmevo.protocols import CHANNELS, Descriptor, FloatArray, Objective
from swarmevo.simulation import EpisodeKey, parse_types, scene_errors

MOST_TEAMS: Final = 256
"""Kept by a thread, each in the world of an episode."""
START_SECONDS: Final = 120.0
"""Most that a process with a time limit takes to start and to load the plugins, on a busy machine."""


@dataclass(frozen=True)
class Job:
    """Some of an evaluation's k episodes, as plain data."""

    individuals: tuple[int, ...]
    """``k``: places in the generation of those whom the episodes try."""
    genomes: FloatArray
    """``(k, size)``"""
    episodes: tuple[EpisodeKey, ...]
    """``k``"""

    def places(self) -> list[Place]:
        """Return the place of each episode in its generation."""
        return [(i, key.repeat) for i, key in zip(self.individuals, self.episodes, strict=True)]

    def alone(self, i: int) -> Job:
        """Return episode i as a job of its own."""
        return self.only([i])

    def only(self, chosen: Sequence[int]) -> Job:
        """Return some of the episodes as a job of their own."""
        return Job(
            tuple(self.individuals[i] for i in chosen),
            self.genomes[list(chosen)],
            tuple(self.episodes[i] for i in chosen),
        )


def run_job(config_json: str, job: Job, cancelled: Callable[[], bool] = never) -> Results:
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


def _run_supervised(config_json: str, setup: Setup, job: Job, cancelled: Callable[[], bool]) -> Results:
    """Run a job in another process; if that gets lost, run its episodes one by one or say what happened."""
    limit = (setup.timeout or 0.0) * len(job.episodes)
    started = time.perf_counter()
    try:
        with processes.child() as child:
            found = child.call(_warm_up, (config_json,), START_SECONDS, cancelled)
            if wrong := difference(found, setup.identity):
                raise PluginError(
                    f"a process for an episode has {wrong}: a plugin was changed while the run went on; undo that, "
                    "then resume, or go on with --accept-changed-plugin"
                )
            return child.call(_run_here, (config_json, job), limit, cancelled)
    except processes.Cancelled as wish:
        raise Interrupted from wish
    except processes.Lost as lost:
        reason = f"the episode {lost}"
        if not setup.goes_on:
            raise EvaluationError(f"{place(job)}: {reason} (evolution.episode_timeout)") from lost
        if len(job.episodes) == 1:
            return setup.failed(job, reason, time.perf_counter() - started)
        return joined([_run_supervised(config_json, setup, job.alone(i), cancelled) for i in range(len(job.episodes))])


def _warm_up(config_json: str) -> Identity:
    parse_types()
    return _setup(config_json).identity


def _run_here(config_json: str, job: Job) -> Results:
    return _setup(config_json).run(job, never)


_THREAD = threading.local()  # a cache: what a thread made from the configuration that it saw last


def _setup(config_json: str) -> Setup:
    if getattr(_THREAD, "config_json", None) != config_json:
        _THREAD.setup = Setup(Config.model_validate_json(config_json))
        _THREAD.config_json = config_json
    setup: Setup = _THREAD.setup
    return setup


class Setup:
    """Runs jobs of a configuration with a team of its own. For one thread."""

    def __init__(self, config: Config) -> None:
        self.identity = identity(config)
        self.worlds = Worlds(config)
        self.team = Team(self.worlds[0].config)
        """In the first world."""
        teams = [self.team, *(self.team.in_world(world) for _, world in each_world(config))]
        self.objectives: Final = widest([team.objectives for team in teams])
        """Each with the widest range that it has in any world."""
        self.descriptors: Final = widest([team.descriptors for team in teams])
        """Likewise."""
        check_together(self.objectives, self.descriptors)
        self._ranges: dict[str, Objective | Descriptor] = {one.name: one for one in self.objectives}
        self._ranges.update({one.name: one for one in self.descriptors})
        self.robots: Final = max(team.robots for team in teams)
        steps = max(team.scene.info.control_steps for team in teams)
        largest = replace(self.team.scene.info, robots=self.robots)
        sizes = [CHANNELS[name].sizes(largest) for name in {name for team in teams for name in team.channels}]
        self.episode_bytes: Final = 8 * steps * sum(map(math.prod, sizes))
        """Of the telemetry of the longest episode with the largest team, ``robots``."""
        self.timeout = config.evolution.episode_timeout
        self.goes_on = config.evolution.on_fault == "worst"
        self._teams: dict[Hashable, Team] = {}

    def team_of(self, key: EpisodeKey) -> Team:
        """Return the team in the world of an episode."""
        place = self._world_of(key)
        if place not in self._teams:
            if len(self._teams) >= MOST_TEAMS:
                self._teams.clear()
            self._teams[place] = self.team.in_world(self.worlds.of_episode(*key, scene_errors))
        return self._teams[place]

    def _world_of(self, key: EpisodeKey) -> Hashable:
        """Return what is equal for episodes in the same world."""
        return key if self.worlds.vary else self.worlds.number_of(key.repeat)

    def run(self, job: Job, cancelled: Callable[[], bool]) -> Results:
        """Run a job on the calling thread."""
        started = time.perf_counter()
        try:
            return self._run(job, cancelled)
        except EvaluationError as error:
            if len(job.episodes) > 1:
                alone = [self.run(job.alone(i), cancelled) for i in range(len(job.episodes))]
                if self.goes_on:
                    return joined(alone)
            if not self.goes_on:  # of several episodes none fails alone
                raise EvaluationError(f"{error}, in {place(job)}") from error
            return self.failed(job, str(error), time.perf_counter() - started)

    def _run(self, job: Job, cancelled: Callable[[], bool]) -> Results:
        started = time.perf_counter()
        together: dict[Hashable, list[int]] = {}
        for i, key in enumerate(job.episodes):
            together.setdefault(self._world_of(key), []).append(i)
        left = self._empty(job)
        for episodes in together.values():
            for name, values in self._in_one_world(job.only(episodes), cancelled).items():
                left[name][episodes] = values
        return self._results(job, left, ("",) * len(job.episodes), time.perf_counter() - started)

    def _in_one_world(self, job: Job, cancelled: Callable[[], bool]) -> dict[str, NDArray[Any]]:
        """Run episodes of one world; return what they left."""
        team = self.team_of(job.episodes[0])
        done = team.simulate(job.genomes, job.episodes, cancelled=cancelled)
        failed = np.flatnonzero(done.status)
        if len(failed):
            first = int(failed[0])
            raise EvaluationError(f"the episode failed: {done.messages[first]}")
        left = {name: getattr(done, name) for name in _SIMULATED}
        if team.robots < self.robots:
            left["homing_time"] = np.pad(
                done.homing_time, ((0, 0), (0, self.robots - team.robots)), constant_values=np.nan
            )
        for name, measure in (("objective", team.judge), ("descriptor", team.describe)):
            left[name] = np.array([measure(done, job.genomes, i, self._ranges) for i in range(len(job.episodes))])
        return left

    def _empty(self, job: Job) -> dict[str, NDArray[Any]]:
        """Return what episodes leave that have failed."""
        k = len(job.episodes)
        shape: dict[str, tuple[int, ...]] = {
            "": (k,),
            "robots": (k, self.robots),
            "objectives": (k, len(self.objectives)),
            "descriptors": (k, len(self.descriptors)),
        }
        left = {column.name: np.full(shape[column.axis], column.failed, dtype=column.dtype) for column in COLUMNS}
        left["objective"][:] = [objective.worst for objective in self.objectives]
        left["world"][:] = [self.worlds.number_of(key.repeat) for key in job.episodes]
        left["robots"][:] = [self.team_of(key).robots for key in job.episodes]
        return left

    def failed(self, job: Job, reason: str, seconds: float) -> Results:
        """Return the result of a job whose one episode failed."""
        return self._results(job, self._empty(job), (reason,), seconds)

    def _results(self, job: Job, left: dict[str, NDArray[Any]], faults: tuple[str, ...], seconds: float) -> Results:
        return Results(
            individual=np.array(job.individuals, dtype=np.intp),
            repeat=np.array([key.repeat for key in job.episodes], dtype=np.intp),
            values=left,
            faults=faults,
            seconds=seconds,
        )


_NOT_SIMULATED: Final = ("world", "robots", "objective", "descriptor")
_SIMULATED: Final = [column.name for column in COLUMNS if column.name not in _NOT_SIMULATED]
"""What the simulator tells of an episode."""


def place(job: Job) -> str:
    """Return which episodes a job has, in words."""
    key, more = job.episodes[0], len(job.episodes) - 1
    first = f"trial {key.trial}, generation {key.generation}, individual {job.individuals[0]}, repeat {key.repeat}"
    return f"{first}, or one of the {more} episodes after it" if more else first

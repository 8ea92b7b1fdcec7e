# SPDX-License-Identifier: BSD-3-Clause
"""A configuration's team: its scene, controller and fitness functions, made and checked once.

Everything that lets an individual act goes through :class:`Team`: evolution, tests, replays, exports and figures.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from swarmevo import config, simulation
from swarmevo.config import Config
from swarmevo.errors import EvaluationError
from swarmevo.plugins.checked import (
    CancellableController,
    CheckedController,
    CheckedFitness,
    JudgedController,
    Ranges,
    check_together,
)
from swarmevo.plugins.registry import individual_space, option_errors, settled_options
from swarmevo.protocols import (
    CENSUS_CHANNELS,
    Descriptor,
    FloatArray,
    GenomeSpace,
    NativePolicies,
    Objective,
    Telemetry,
)
from swarmevo.simulation import EpisodeKey, Episodes


def load_config(source: str | Path | None, overrides: Sequence[str] = ()) -> Config:
    """Read a configuration and check all of it: keys, the world, the plugins and their options.

    Args:
        source: As :func:`swarmevo.config.load` takes it.
        overrides: ``section.key=value``.

    Raises:
        ConfigError: With everything that is wrong.
    """

    def errors(found: Config) -> list[str]:
        wrong = simulation.scene_errors(found) or _world_errors(found) or config.idle_errors(found, overrides)
        return wrong + option_errors(found)

    return config.load(source, overrides, errors, settled_options)


def _world_errors(settings: Config) -> list[str]:
    """Return all that is wrong with the worlds that an individual is tried in, one line each."""
    return config.world_errors(settings) or [
        f"{where}: {line}"
        for where, world in config.each_world(settings)
        for line in (simulation.scene_errors(world) or config.sense_errors(settings, world))
    ]


def never() -> bool:
    """Say that nothing is to stop."""
    return False


class Team:
    """What an individual acts with and is judged by. For one thread: a plugin need not be safe to share.

    Args:
        settings: Of the run; the section ``evolution`` is not read.

    Raises:
        EvaluationError: A plugin is not what it should be.
        PluginError: A plugin cannot be made.
        SimulatorError: The library refuses the scene.
    """

    def __init__(self, settings: Config) -> None:
        self.config = settings
        self.scene = simulation.Scene(settings)
        self.robots = self.scene.info.robots
        self._controller = CheckedController(settings, self.scene.info)
        self._fitness = [CheckedFitness(name, options, self.scene.info) for name, options in settings.fitness.items()]
        check_together(self.objectives, self.descriptors)
        self.space: GenomeSpace = individual_space(self._controller.space, settings.team)
        """The layout of an individual: of one robot, or, where each robot has its own genome, of the team."""
        self._judged = JudgedController(self._controller, settings.team)

    def in_world(self, settings: Config) -> Team:
        """Return this team in another world, its plugins the same, but for a fitness that is made for a scene.

        Raises:
            EvaluationError: The controller's genome is another one there, or a fitness measures something else.
            PluginError: A fitness cannot be made for that scene.
            SimulatorError: The library refuses the scene.
        """
        other = copy.copy(self)
        other.config = settings
        other.scene = simulation.Scene(settings)
        other.robots = other.scene.info.robots
        if wrong := config.sense_errors(self.config, settings):
            raise EvaluationError(f"{self._controller.title}: {wrong[0]}")
        if (space := self._controller.checked_space(other.scene.info)) != self._controller.space:
            raise EvaluationError(
                f"{self._controller.title}: space: expected the same genome in all worlds, of "
                f"{self._controller.space.size} genes, got one of {space.size} with {other.robots} robots"
            )
        other._fitness = [fitness.in_scene(other.scene.info) for fitness in self._fitness]
        return other

    @property
    def objectives(self) -> list[Objective]:
        """Of all fitness functions, side by side, with the ranges that they have in this world."""
        return [objective for fitness in self._fitness for objective in fitness.objectives]

    @property
    def descriptors(self) -> list[Descriptor]:
        """Likewise."""
        return [descriptor for fitness in self._fitness for descriptor in fitness.descriptors]

    @property
    def channels(self) -> list[str]:
        """Telemetry that the fitness functions need."""
        return sorted({channel for fitness in self._fitness for channel in fitness.channels})

    @property
    def is_native(self) -> bool:
        """Whether the controller runs in the library."""
        return self._controller.is_native

    def check(self, genomes: FloatArray) -> None:
        """Refuse individuals that are not ``(n, space.size)``.

        Raises:
            EvaluationError: They are of another size: not of this controller, or of another version of its plugin.
        """
        if genomes.ndim != 2 or genomes.shape[1] != self.space.size:
            raise EvaluationError(
                f"{self._controller.title}: genomes: expected the shape (n, {self.space.size}), got {genomes.shape}; "
                "install the version of the plugin that they were evolved with, and take the robot.sensors of then"
            )

    def robot_genomes(self, genomes: FloatArray) -> FloatArray:
        """Return individuals ``(n, space.size)`` as robots' genomes ``(n, genomes_per_team, size)``.

        Raises:
            EvaluationError: They are of another size.
        """
        self.check(genomes)
        return genomes.reshape(len(genomes), self.config.team.genomes_per_team, -1)

    def simulate(
        self,
        genomes: FloatArray,
        keys: Sequence[EpisodeKey],
        channels: Sequence[str] | None = None,
        threads: int = 1,
        cancelled: Callable[[], bool] = never,
    ) -> Episodes:
        """Run an episode of each individual.

        Args:
            genomes: ``(n, space.size)``.
            keys: ``n``: of the episodes.
            channels: Telemetry to record; None: what the fitness functions need.
            threads: At most so many at once; 0: one for each processor.
            cancelled: Asked before each control step of a controller written in Python.

        Raises:
            EvaluationError: The controller failed, or its policies were refused.
            Interrupted: It was cancelled.
            SimulatorError: The library failed. An episode that fails alone has its ``status`` set instead.
        """
        wanted = self.channels if channels is None else channels
        teams = self.robot_genomes(genomes)
        n, each = teams.shape[:2]
        if not self.is_native:
            controller = CancellableController(self._controller, cancelled)
            everyone = np.repeat(teams, self.robots // each, axis=1)
            return simulation.simulate_lockstep(self.scene, controller, everyone, keys, wanted, threads)
        policies = self._controller.policies(teams)
        numbers = np.arange(n * each, dtype=np.uint32).reshape(n, each)
        drivers = np.ascontiguousarray(np.broadcast_to(numbers, (n, self.robots)))
        try:
            return simulation.simulate(self.scene, policies, keys, drivers, wanted, threads)
        except simulation.InvalidArgument as error:
            raise EvaluationError(f"{self._controller.title}: its policies were refused: {error}") from error

    def judge(self, done: Episodes, genomes: FloatArray, i: int, ranges: Ranges | None = None) -> FloatArray:
        """Return the objectives ``(m,)`` of episode i, in which ``genomes[i]`` acted.

        Args:
            done: The episodes.
            genomes: ``(n, space.size)``.
            i: From 0.
            ranges: In which each value must be; None: whatever it is.

        Raises:
            EvaluationError: A fitness function failed, or a value is out of its range.
        """
        return self._measured(CheckedFitness.evaluate, done, genomes, i, ranges)

    def describe(self, done: Episodes, genomes: FloatArray, i: int, ranges: Ranges | None = None) -> FloatArray:
        """Return the descriptors ``(d,)`` of episode i; as :meth:`judge`."""
        return self._measured(CheckedFitness.describe, done, genomes, i, ranges)

    def _measured(
        self, ask: Callable[..., FloatArray], done: Episodes, genomes: FloatArray, i: int, ranges: Ranges | None
    ) -> FloatArray:
        genome = genomes[i : i + 1]
        return np.concatenate(
            [
                ask(fitness, self._alone(done, i, fitness.channels), genome.copy(), self._judged, ranges)
                for fitness in self._fitness
            ]
        )

    def terms(self, done: Episodes, i: int) -> tuple[int, Mapping[str, FloatArray]]:
        """Return the parts of an objective in episode i, ``(steps done,)`` each, and that objective's number.

        They are of the first fitness function that explains itself; none does: 0 and no parts.
        """
        before = 0
        for fitness in self._fitness:
            parts = fitness.terms(self._alone(done, i, list(done.telemetry.channels)), int(done.steps[i]))
            if parts is not None:
                return before, {name: part[0] for name, part in parts.items()}
            before += len(fitness.objectives)
        return 0, {}

    def behaviours(self, done: Episodes, i: int) -> dict[str, float]:
        """Return the share of robots that showed each behaviour which a fitness function knows, in episode i.

        Of several that know one by the same name the first is asked.

        Args:
            done: The episodes, with all channels of the fitness functions, and those of the census.
            i: From 0.

        Raises:
            EvaluationError: A fitness function failed.
        """
        found: dict[str, float] = {}
        for fitness in self._fitness:
            channels = sorted({*fitness.channels, *CENSUS_CHANNELS})
            found = {**fitness.behaviours(self._alone(done, i, channels)), **found}
        return found

    def complexity(self, genomes: FloatArray) -> FloatArray:
        """Return ``(n,)``: how many hidden neurons each individual of ``(n, space.size)`` uses."""
        self.check(genomes)
        return self._judged.complexity(genomes)

    def policies(self, genome: FloatArray) -> NativePolicies | None:
        """Return an individual's policies, one, or one for each robot; None: its controller is written in Python."""
        return self._controller.policies(self.robot_genomes(genome[np.newaxis])) if self.is_native else None

    def _alone(self, done: Episodes, i: int, channels: Sequence[str]) -> Telemetry:
        """Return episode i to its end, with these channels alone: what a fitness does not name it does not get."""
        telemetry, steps = done.telemetry, int(done.steps[i])
        arrays = {name: getattr(telemetry, name)[i : i + 1] for name in ("homing_time", "push_time")}
        arrays |= {name: telemetry.channels[name][i : i + 1, :steps] for name in channels}
        for array in arrays.values():
            array.flags.writeable = False  # the next fitness reads it too
        return Telemetry(control_period=telemetry.control_period, world=self.scene.info.world, **arrays)

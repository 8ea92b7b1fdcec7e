# SPDX-License-Identifier: BSD-3-Clause
"""The plugins that an evaluation asks: what they return is checked, what they raise is explained."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeAlias, TypeVar

import numpy as np

from swarmevo import plugins, returned, simulation
from swarmevo.config import Config, Team
from swarmevo.errors import EvaluationError, Interrupted, InvalidArgument, SwarmevoError
from swarmevo.plugins.calls import blamed, one_line
from swarmevo.plugins.registry import has, individual_space
from swarmevo.protocols import (
    CHANNELS,
    Compiled,
    Controller,
    Descriptor,
    ExplainedFitness,
    Fitness,
    FloatArray,
    Follower,
    GenomeSpace,
    NativeController,
    NativePolicies,
    Objective,
    SceneInfo,
    Step,
    StepwiseFitness,
    Telemetry,
    WatchingFitness,
)

Measured = TypeVar("Measured", Objective, Descriptor)
Ranges: TypeAlias = Mapping[str, Objective | Descriptor]
"""By the name of an objective or a descriptor: that with the range in which its values must be."""


class CheckedController:
    """The configured controller; what it returns is checked, what it raises is explained."""

    def __init__(self, config: Config, info: SceneInfo) -> None:
        ((name, options),) = config.controller.items()
        self.title = plugin_title("controller", name)
        self.made: Any = plugins.create("controller", name, options)
        self.is_native = isinstance(self.made, NativeController)
        self.info = info
        self.space = self.checked_space(info)

    def checked_space(self, info: SceneInfo) -> GenomeSpace:
        """Return the layout of a robot's genome."""
        space = _call(self.title, "space", self.made.space, info)
        found: GenomeSpace = _check(self.title, "space", returned.space, space)
        return found

    def complexity(self, genomes: FloatArray) -> FloatArray:
        """Return ``(n,)``: what the controller says of genomes ``(n, size)`` of robots."""
        found = _call(self.title, "complexity", self.made.complexity, genomes.copy())
        return _numbers(self.title, "complexity", found, (len(genomes),))

    def policies(self, teams: FloatArray) -> NativePolicies:
        """Return one policy for each genome of ``teams`` ``(n, genomes, size)``, made team by team."""
        return _one([self._policies(team.copy()) for team in teams])

    def _policies(self, genomes: FloatArray) -> NativePolicies:
        policies = _call(self.title, "policies", self.made.policies, genomes)
        if not isinstance(policies, NativePolicies):
            raise EvaluationError(
                f"{self.title}: policies: expected FeedForward, Linear, Recurrent or Compiled, got "
                f"{type(policies).__name__}"
            )
        try:
            simulation.check_policies(policies, self.info)
        except InvalidArgument as error:
            raise EvaluationError(f"{self.title}: its policies were refused: {error}") from error
        if len(policies) != len(genomes):
            raise EvaluationError(f"{self.title}: policies: expected {len(genomes)} policies, got {len(policies)}")
        return policies


class JudgedController:
    """The controller as the fitness sees it: a genome is an individual's, of one robot or of a whole team."""

    def __init__(self, controller: CheckedController, team: Team) -> None:
        self._controller = controller
        self._team = team

    def space(self, scene: SceneInfo) -> GenomeSpace:
        """Return the layout of an individual's genome."""
        return individual_space(self._controller.checked_space(scene), self._team)

    def complexity(self, genomes: FloatArray) -> FloatArray:
        """Return ``(n,)``: mean over the genomes of a team."""
        n, robots = len(genomes), self._team.genomes_per_team
        mean: FloatArray = self._controller.complexity(genomes.reshape(n * robots, -1)).reshape(n, robots).mean(axis=1)
        return mean


class CancellableController:
    """A controller in lockstep: asked before each step whether to go on, its commands checked after it."""

    def __init__(self, controller: CheckedController, cancelled: Callable[[], bool]) -> None:
        self._controller = controller
        self._cancelled = cancelled

    def start(self, genomes: FloatArray) -> None:
        """See :class:`swarmevo.protocols.Actor`."""
        _call(self._controller.title, "start", self._controller.made.start, genomes)

    def act(self, observations: FloatArray) -> FloatArray:
        """See :class:`swarmevo.protocols.Actor`."""
        if self._cancelled():
            raise Interrupted
        commands = _call(self._controller.title, "act", self._controller.made.act, observations)
        return _numbers(
            self._controller.title, "act", commands, (*observations.shape[:2], self._controller.info.commands)
        )


class CheckedFitness:
    """A configured fitness; what it returns is checked, what it raises is explained."""

    def __init__(self, name: str, options: dict[str, Any], scene: SceneInfo) -> None:
        self._title = plugin_title("fitness", name)
        self._name, self._options = name, options
        self._made: Fitness = plugins.create("fitness", name, options, scene=scene)
        self.channels: tuple[str, ...] = _call(self._title, "channels", lambda: tuple(self._made.channels))
        self._describes = self._is_describing()
        self.objectives = self._checked("objectives", returned.objective)
        self.descriptors = self._checked("descriptors", returned.descriptor) if self._describes else ()
        if not self.objectives and not self.descriptors:
            raise EvaluationError(f"{self._title}: objectives: expected at least one, got none")
        self._check_channels()

    def in_scene(self, scene: SceneInfo) -> CheckedFitness:
        """Return the fitness for another scene: the same one, unless its factory takes the scene.

        Raises:
            EvaluationError: It measures something else there.
            PluginError: It cannot be made.
        """
        if not plugins.takes("fitness", self._name, "scene"):
            return self
        other = CheckedFitness(self._name, self._options, scene)
        for what in ("objectives", "descriptors"):
            here, there = getattr(self, what), getattr(other, what)
            if list(map(_kind, here)) != list(map(_kind, there)):
                raise EvaluationError(
                    f"{self._title}: {what}: expected the same in all worlds, but for their ranges, got {here} and "
                    f"{there}"
                )
        return other

    def _is_describing(self) -> bool:
        names = ("descriptors", "describe")
        found = _call(self._title, "descriptors", lambda: [name for name in names if has(self._made, name)])
        if len(found) == 1:
            raise EvaluationError(f"{self._title}: descriptors: expected {' and '.join(names)}, got {found[0]} alone")
        return bool(found)

    def _checked(self, what: str, check: Callable[[object], Any]) -> tuple[Any, ...]:
        """Return what it measures, checked one by one."""
        given = _call(self._title, what, lambda: tuple(getattr(self._made, what)))
        return tuple(_check(self._title, what, check, one) for one in given)

    def _check_channels(self) -> None:
        unknown = [channel for channel in self.channels if channel not in list(CHANNELS)]
        if unknown:
            raise EvaluationError(
                f"{self._title}: channels: expected some of {', '.join(CHANNELS)}, got {unknown[0]!r}"
            )

    def evaluate(
        self,
        telemetry: Telemetry,
        genomes: FloatArray,
        controller: Controller,
        ranges: Ranges | None = None,
    ) -> FloatArray:
        """Return the objectives ``(m,)`` of one episode, which must be in these ``ranges``; None: whatever they are."""
        values = _call(self._title, "evaluate", self._made.evaluate, telemetry, genomes, controller)
        return self._measured("evaluate", values, self.objectives, ranges)

    def describe(
        self,
        telemetry: Telemetry,
        genomes: FloatArray,
        controller: Controller,
        ranges: Ranges | None = None,
    ) -> FloatArray:
        """Return the descriptors ``(d,)`` of one episode; as :meth:`evaluate`."""
        if not self._describes:
            return np.empty(0)
        made: Any = self._made
        values = _call(self._title, "describe", made.describe, telemetry, genomes, controller)
        return self._measured("describe", values, self.descriptors, ranges)

    def _measured(
        self, method: str, values: object, measured: Sequence[Objective | Descriptor], ranges: Ranges | None
    ) -> FloatArray:
        found = _numbers(self._title, method, values, (1, len(measured)))
        if ranges is not None:
            _check(self._title, method, returned.check_range, found, [ranges[one.name] for one in measured])
        only: FloatArray = found[0]
        return only

    def terms(self, telemetry: Telemetry, steps: int) -> Mapping[str, FloatArray] | None:
        """Return the parts of an objective ``(episodes, steps)`` by name; None: it does not explain itself."""
        made = self._made
        if not isinstance(made, ExplainedFitness):
            return None
        parts: dict[str, Any] = _call(self._title, "terms", lambda: dict(made.terms(telemetry)))
        shape = len(telemetry.homing_time), steps
        return {str(name): _numbers(self._title, f"terms: {name}", part, shape) for name, part in parts.items()}

    def stepwise(self, worlds: int) -> Follower:
        """Return what follows the objectives ``(worlds, m)`` of worlds from step to step.

        Raises:
            EvaluationError: The fitness does not tell them before the end of an episode.
        """
        made = self._made
        if not isinstance(made, StepwiseFitness):
            names = ", ".join(objective.name for objective in self.objectives)
            raise EvaluationError(
                f"{self._title}: expected stepwise, which tells {names} at each control step, got a fitness without "
                "it; leave it out of the weights of rewards"
            )
        follower = _call(self._title, "stepwise", made.stepwise, worlds)
        shape = worlds, len(self.objectives)

        def follow(step: Step) -> FloatArray:
            return _numbers(self._title, "stepwise", _call(self._title, "stepwise", follower, step), shape)

        return follow

    def behaviours(self, telemetry: Telemetry) -> dict[str, float]:
        """Return the share of robots that showed each behaviour it knows by name, in one episode; mostly none."""
        made = self._made
        if not isinstance(made, WatchingFitness):
            return {}
        flags: dict[str, Any] = _call(self._title, "behaviours", lambda: dict(made.behaviours(telemetry)))
        shape = telemetry.homing_time.shape
        return {
            str(name): float(_check(self._title, f"behaviours: {name}", returned.flags, one, shape).mean())
            for name, one in flags.items()
        }


def plugin_title(kind: str, name: str) -> str:
    """Return how a plugin is called in errors: with the distribution that it is from."""
    return f"{kind}.{name} ({plugins.find(kind, name).origin})"


def _call(title: str, method: str, function: Callable[..., Any], *arguments: object) -> Any:
    """Call a plugin's method."""

    def explain(error: BaseException) -> SwarmevoError:
        if isinstance(error, SwarmevoError):  # of another plugin that this one asked, and named in it
            return error
        return EvaluationError(f"{title}: {method} raised {one_line(error)}")

    with blamed(explain, f"{title}: {method}"):
        return function(*arguments)


def _check(title: str, method: str, check: Callable[..., Any], *values: object) -> Any:
    """Return what a check of :mod:`swarmevo.returned` makes of what a plugin's method returned."""
    try:
        return check(*values)
    except ValueError as error:
        raise EvaluationError(f"{title}: {method}: {error}") from error


def _numbers(title: str, method: str, values: object, shape: tuple[int, ...]) -> FloatArray:
    found: FloatArray = _check(title, method, returned.numbers, values, shape)
    return found


def _kind(measured: Objective | Descriptor) -> tuple[str, ...]:
    """Return what is measured, whatever its range."""
    if isinstance(measured, Descriptor):
        return (measured.name,)
    return measured.name, measured.direction, measured.of


def widest(worlds: Iterable[Sequence[Measured]]) -> list[Measured]:
    """Return what is measured in several worlds, where only ranges differ, with the widest range of each."""
    return [
        dataclasses.replace(same[0], range=(min(one.range[0] for one in same), max(one.range[1] for one in same)))
        for same in zip(*worlds, strict=True)
    ]


def check_together(objectives: Sequence[Objective], descriptors: Sequence[Descriptor]) -> None:
    """Refuse no objective, two of one name among all, and ranges whose hypervolume is no finite number.

    Raises:
        EvaluationError: There are.
    """
    if not objectives:
        raise EvaluationError("fitness: expected at least one objective, got none; choose another plugin beside")
    if not math.isfinite(math.prod(high - low for low, high in (objective.range for objective in objectives))):
        raise EvaluationError("fitness: expected ranges of objectives whose product is finite; make them narrower")
    names = [*(one.name for one in objectives), *(one.name for one in descriptors)]
    for name in names:
        if names.count(name) > 1:
            what = "objectives or descriptors" if descriptors else "objectives"
            raise EvaluationError(f"fitness: two {what} are named {name!r}; choose plugins or options that differ")


def _one(parts: Sequence[NativePolicies]) -> NativePolicies:
    """Return the policies of all ``parts``, which one controller made."""
    first = parts[0]
    changes: dict[str, Any] = {
        member.name: np.concatenate([getattr(part, member.name) for part in parts])
        for member in dataclasses.fields(first)
        if isinstance(getattr(first, member.name), np.ndarray)
    }
    if isinstance(first, Compiled):
        changes["keep_alive"] = tuple(parts)
    return dataclasses.replace(first, **changes)

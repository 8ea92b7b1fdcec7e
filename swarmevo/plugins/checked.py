# SPDX-License-Identifier: BSD-3-Clause
"""The plugins that an evaluation asks: what they return is checked, what they raise is explained."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from swarmevo import plugins
from swarmevo.config import Config
from swarmevo.errors import EvaluationError, Interrupted
from swarmevo.protocols import (
    CHANNELS,
    Compiled,
    Controller,
    ExplainedFitness,
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


class CheckedController:
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

    def complexity(self, controller: Controller, genomes: FloatArray) -> FloatArray:
        """Return ``(n,)``: what ``controller``, this one or a team of it, says of genomes."""
        return _numbers(
            _call(self.title, "complexity", controller.complexity, genomes.copy()),
            (len(genomes),),
            f"{self.title}: complexity",
        )

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
        return _numbers(commands, (*observations.shape[:2], 2), f"{self._controller.title}: act")


class CheckedFitness:
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

    def terms(self, telemetry: Telemetry) -> Mapping[str, FloatArray] | None:
        """Return the parts of an objective ``(episodes, steps)`` by name; None: it does not explain itself."""
        made = self._made
        if not isinstance(made, ExplainedFitness):
            return None
        parts: Mapping[str, FloatArray] = _call(self._title, "terms", lambda: dict(made.terms(telemetry)))
        return parts


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


def check_names(objectives: Sequence[Objective]) -> None:
    """Refuse two objectives of one name.

    Raises:
        EvaluationError: There are.
    """
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

# SPDX-License-Identifier: BSD-3-Clause
"""What every controller must do."""

from __future__ import annotations

from dataclasses import fields
from typing import get_args, get_type_hints

import numpy as np

from swarmevo import returned
from swarmevo.protocols import (
    Compiled,
    Controller,
    FloatArray,
    Linear,
    NativeController,
    NativePolicies,
    PythonController,
    Recurrent,
    SceneInfo,
)
from swarmevo.testing.checks import accepted, frozen, require, require_array
from swarmevo.testing.data import random_genomes, scene_of


class ControllerTests:
    """Tests that every controller must pass. Override :meth:`create`."""

    scene = scene_of(robots=5, control_steps=20)

    def create(self) -> Controller:
        """Return a new controller."""
        raise NotImplementedError("create: expected an override that returns the controller to test")

    def test_has_the_methods_of_a_controller(self) -> None:
        """It is a controller, and either a native or a Python one."""
        controller = self.create()
        require(isinstance(controller, Controller), "controller: expected the methods space and complexity")
        kinds = isinstance(controller, NativeController) + isinstance(controller, PythonController)
        require(kinds == 1, "controller: expected either policies(), or start() and act()")

    def test_lays_out_a_genome(self) -> None:
        """Its space has well-formed blocks, and is the same whenever it is asked."""
        space = accepted("space", returned.space, self.create().space(self.scene))
        require(self.create().space(self.scene) == space, "space: expected the same space in every call")

    def test_tells_complexity(self) -> None:
        """Complexity is a finite number for each genome, whatever genomes stand beside it."""
        controller, genomes = self._controller_and_genomes(6)
        complexity = controller.complexity(genomes)
        require_array("complexity", complexity, (6,))
        require(bool(np.all(complexity >= 0)), "complexity: expected no negative number")
        single = np.concatenate([controller.complexity(genomes[i : i + 1]) for i in range(6)])
        require(np.array_equal(complexity, single), "complexity: expected the same for a genome on its own")

    def test_makes_native_policies(self) -> None:
        """A native controller makes one sound policy of each genome, whatever genomes stand beside it."""
        controller, genomes = self._controller_and_genomes(6)
        if not isinstance(controller, NativeController):
            return
        policies = controller.policies(genomes)
        require(len(policies) == 6, f"policies: expected one for each of 6 genomes, got {len(policies)}")
        _require_sound_policies(policies, self.scene)
        single = np.concatenate([_parameters(controller.policies(genomes[i : i + 1])) for i in range(6)])
        require(np.array_equal(_parameters(policies), single), "policies: expected the same for a genome on its own")

    def test_acts(self) -> None:
        """A Python controller's commands have their shape and range."""
        for commands in self._act(worlds=slice(None)):
            require_array("act", commands, (4, self.scene.robots, self.scene.commands))
            require(bool(np.all(np.abs(commands) <= 1)), "act: expected commands in [-1, 1]")

    def test_acts_the_same_in_every_batch(self) -> None:
        """A world's commands do not depend on the worlds beside it: results must not depend on the chunking."""
        everybody = self._act(worlds=slice(None))
        for world in range(4):
            alone = self._act(worlds=slice(world, world + 1))
            same = all(np.array_equal(one[world : world + 1], two) for one, two in zip(everybody, alone, strict=True))
            require(same, "act: expected the same bits for a world on its own")

    def test_start_forgets(self) -> None:
        """An episode does not depend on the one before."""
        controller, _ = self._controller_and_genomes(1)
        first, second = (self._act(worlds=slice(None), controller=controller) for _ in range(2))
        same = all(np.array_equal(one, two) for one, two in zip(first, second, strict=True))
        require(same, "start: expected it to forget the episode before")

    def _controller_and_genomes(self, n: int) -> tuple[Controller, FloatArray]:
        controller = self.create()
        return controller, frozen(random_genomes(controller.space(self.scene), n))

    def _act(self, worlds: slice, controller: Controller | None = None) -> list[FloatArray]:
        """Return the commands of an episode in some of four worlds; none if the controller is not a Python one."""
        controller = controller or self.create()
        if not isinstance(controller, PythonController):
            return []
        space, robots = controller.space(self.scene), self.scene.robots
        genomes = random_genomes(space, 4 * robots).reshape(4, robots, space.size)
        observations = np.random.default_rng(0).random((self.scene.control_steps, 4, robots, self.scene.observations))
        controller.start(frozen(genomes[worlds].copy()))
        return [controller.act(frozen(step[worlds].copy())).copy() for step in observations]


def _require_sound_policies(policies: NativePolicies, scene: SceneInfo) -> None:
    if isinstance(policies, Compiled):
        require(policies.function != 0, "policies: expected the function's address, got 0")
        require(policies.memory >= 0, f"policies: expected memory of at least 0 doubles, got {policies.memory}")
        require_array("policies: parameters", policies.parameters, (len(policies), None))
        return
    known = get_args(get_type_hints(type(policies))["activation"])
    require(policies.activation in known, f"policies: expected {' or '.join(known)}, got {policies.activation!r}")
    inputs = scene.observations + policies.bias
    if isinstance(policies, Linear):
        require_array("policies: input_output", policies.input_output, (len(policies), scene.commands, inputs))
        return
    n, hidden = policies.hidden_switch.shape
    require(policies.hidden_switch.dtype == np.bool_, "policies: hidden_switch: expected booleans")
    require_array("policies: input_hidden", policies.input_hidden, (n, hidden, inputs))
    require_array("policies: hidden_output", policies.hidden_output, (n, scene.commands, hidden + policies.bias))
    if isinstance(policies, Recurrent):
        context = scene.commands if policies.recurrence == "jordan" else hidden
        require_array("policies: context_hidden", policies.context_hidden, (n, hidden, context))
        if policies.recurrence == "ctrnn":
            require_array("policies: time_constants", policies.time_constants, (n, hidden))


def _parameters(policies: NativePolicies) -> FloatArray:
    """Return all numbers of each policy, ``(n, numbers)``."""
    members = (getattr(policies, member.name) for member in fields(policies))
    arrays = [member.reshape(len(policies), -1) for member in members if isinstance(member, np.ndarray)]
    return np.concatenate([array.astype(np.float64) for array in arrays], axis=1)

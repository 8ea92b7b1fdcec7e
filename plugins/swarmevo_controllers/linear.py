# SPDX-License-Identifier: BSD-3-Clause
"""Sensors to wheels without anything between: Braitenberg's vehicles (*Vehicles*, MIT Press 1984), evolved."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np

from swarmevo.protocols import Block, FloatArray, Linear, SceneInfo
from swarmevo_controllers.layout import SceneLayout
from swarmevo_controllers.options import check_bias, check_choice

Activation = Literal["identity", "tanh", "logistic"]


class LinearController(SceneLayout):
    """A weighted sum of all observations for each command.

    Args:
        bias: Whether there is a constant input.
        activation: Of the sums. With `identity` a command is the sum, cut off at the top speed.

    Raises:
        ValueError: An option is out of its range.
    """

    def __init__(self, bias: bool = True, activation: Activation = "identity") -> None:
        check_bias(bias)
        check_choice("activation", activation, get_args(Activation))
        self._bias, self._activation = bias, activation

    def _blocks(self, scene: SceneInfo) -> Sequence[Block]:
        return [Block("input_output", (scene.commands, scene.observations + self._bias))]

    def policies(self, genomes: FloatArray) -> Linear:
        """Return the networks of ``genomes`` ``(n, size)``.

        Raises:
            ValueError: The genomes are not ``size`` long.
        """
        return Linear(self._split(genomes)["input_output"], self._bias, self._activation)

    def complexity(self, genomes: FloatArray) -> FloatArray:
        """Return ``(n,)``: zeros, for there are no hidden neurons."""
        return np.zeros(len(genomes))

# SPDX-License-Identifier: BSD-3-Clause
"""Networks with one hidden layer and a memory: Elman's, Jordan's, and continuous-time ones.

Sources: J. L. Elman, *Finding Structure in Time*, Cognitive Science 14 (1990); M. I. Jordan, *Serial Order*, ICS Report
8604, UC San Diego (1986); R. D. Beer, *On the Dynamics of Small Continuous-Time Recurrent Neural Networks*, Adaptive
Behavior 3 (1995).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import ClassVar, get_args

import numpy as np

from swarmevo.protocols import (
    Activation,
    Block,
    BoolArray,
    FloatArray,
    Integration,
    Recurrence,
    Recurrent,
    SceneInfo,
)
from swarmevo_controllers.layout import SceneLayout
from swarmevo_controllers.options import check_bias, check_choice, check_hidden


class _HiddenLayer(SceneLayout):
    """What the networks of this file have in common.

    As in the paper's controller a neuron's inputs and its switch are crossed over together, its outputs on their own,
    and all of them mutate together. What a neuron hears of the context are inputs like the others.
    """

    recurrence: ClassVar[Recurrence]

    def __init__(self, hidden: int, bias: bool, activation: Activation) -> None:
        check_hidden(hidden)
        check_bias(bias)
        check_choice("activation", activation, get_args(Activation))
        self._hidden, self._bias, self._activation = hidden, bias, activation

    def _blocks(self, scene: SceneInfo) -> Sequence[Block]:
        context = scene.commands if self.recurrence == "jordan" else self._hidden
        return [
            _inputs("input_hidden", self._hidden, scene.observations + self._bias),
            _inputs("context_hidden", self._hidden, context),
            Block(
                "hidden_output",
                (scene.commands, self._hidden + self._bias),
                unit_axis=1,
                units="hidden",
                linked="output",
            ),
            Block("hidden_switch", (self._hidden,), "switch", units="hidden", linked="input"),
        ]

    def policies(self, genomes: FloatArray) -> Recurrent:
        """Return the networks of ``genomes`` ``(n, size)``.

        Raises:
            ValueError: The genomes are not ``size`` long.
        """
        genes = self._split(genomes)
        return Recurrent(
            recurrence=self.recurrence,
            input_hidden=genes["input_hidden"],
            context_hidden=genes["context_hidden"],
            hidden_output=genes["hidden_output"],
            hidden_switch=_is_on(genes["hidden_switch"]),
            bias=self._bias,
            activation=self._activation,
        )

    def complexity(self, genomes: FloatArray) -> FloatArray:
        """Return ``(n,)``: the number of hidden neurons switched on."""
        return np.asarray(_is_on(self._split(genomes)["hidden_switch"]).sum(axis=-1), dtype=np.float64)


class Elman(_HiddenLayer):
    """Elman's network: hidden neurons hear what all of them were a control step ago.

    Args:
        hidden: Hidden neurons in a genome, on or off: 1 to 1024.
        bias: Whether hidden neurons and outputs have a constant input.
        activation: Of hidden neurons and outputs.

    Raises:
        ValueError: An option is out of its range.
    """

    recurrence = "elman"

    def __init__(self, hidden: int = 5, bias: bool = True, activation: Activation = "tanh") -> None:
        super().__init__(hidden, bias, activation)


class Jordan(_HiddenLayer):
    """Jordan's network: hidden neurons hear what was commanded a control step ago.

    Args:
        hidden: Hidden neurons in a genome, on or off: 1 to 1024.
        bias: Whether hidden neurons and outputs have a constant input.
        activation: Of hidden neurons and outputs.

    Raises:
        ValueError: An option is out of its range.
    """

    recurrence = "jordan"

    def __init__(self, hidden: int = 5, bias: bool = True, activation: Activation = "tanh") -> None:
        super().__init__(hidden, bias, activation)


class CTRNN(_HiddenLayer):
    """A continuous-time recurrent network (Beer 1995): hidden neurons are leaky integrators that hear each other.

    Args:
        hidden: Hidden neurons in a genome, on or off: 1 to 1024.
        bias: Whether hidden neurons and outputs have a constant input.
        activation: Of hidden neurons and outputs.
        time_constants: The shortest and the longest that a hidden neuron can have [s].
        integration: Over a control period: `exponential`, exact while what a neuron hears stands still, or a step of
            Euler's, which wants no time constant shorter than `episode.control_period`.
        reach: Weights, biases and genes of time constants lie between minus this and this; 0: they have no bounds.

    Raises:
        ValueError: An option is out of its range.
    """

    recurrence = "ctrnn"

    def __init__(
        self,
        hidden: int = 5,
        bias: bool = True,
        activation: Activation = "logistic",
        time_constants: tuple[float, float] = (0.1, 10.0),
        integration: Integration = "exponential",
        reach: float = 5.0,
    ) -> None:
        super().__init__(hidden, bias, activation)
        shortest, longest = time_constants
        if not (0 < shortest <= longest < math.inf and longest / shortest < math.inf):
            raise ValueError(
                "time_constants: expected two numbers of seconds above 0, the shortest and the longest, got "
                f"{list(time_constants)}"
            )
        check_choice("integration", integration, get_args(Integration))
        if isinstance(reach, bool) or not 0 <= reach < math.inf:
            raise ValueError(f"reach: expected a number of at least 0, got {reach!r}")
        self._shortest, self._longest, self._integration = shortest, longest, integration
        self._bounds = (-float(reach), float(reach)) if reach else None

    def _blocks(self, scene: SceneInfo) -> Sequence[Block]:
        if self._integration == "euler" and self._shortest < scene.control_period:
            raise ValueError(
                f"time_constants: expected none below the control period of {scene.control_period:g} s with "
                f"integration=euler, got {self._shortest:g}"
            )
        blocks = [
            *super()._blocks(scene),
            Block("time_constant", (self._hidden,), units="hidden", linked="input"),
        ]
        return [dataclasses.replace(one, bounds=self._bounds) if one.kind == "real" else one for one in blocks]

    def policies(self, genomes: FloatArray) -> Recurrent:
        """Return the networks of ``genomes`` ``(n, size)``.

        Raises:
            ValueError: The genomes are not ``size`` long.
        """
        made = super().policies(genomes)
        time_constants = self._time_constants(self._split(genomes)["time_constant"])
        return dataclasses.replace(made, time_constants=time_constants, integration=self._integration)

    def _time_constants(self, genes: FloatArray) -> FloatArray:
        """Return time constants [s]: any gene is one, 0 the geometric mean of the shortest and the longest.

        By Python's functions, as NumPy's may differ in the last bit between kinds of processors.
        """
        width = math.log(self._longest / self._shortest)
        logistic = ((1 + math.tanh(gene / 2)) / 2 for gene in genes.ravel().tolist())
        return np.array([self._shortest * math.exp(width * share) for share in logistic]).reshape(genes.shape)


def _inputs(name: str, hidden: int, size: int) -> Block:
    return Block(name, (hidden, size), units="hidden", linked="input")


def _is_on(switches: FloatArray) -> BoolArray:
    return switches >= 0.5

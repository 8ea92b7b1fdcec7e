# SPDX-License-Identifier: BSD-3-Clause
"""The paper's controller (section II, Fig. 1): a feed-forward network whose hidden neurons can be switched off."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from swarmevo.protocols import Block, BoolArray, FeedForward, FloatArray, GenomeSpace, SceneInfo

Activation = Literal["tanh", "logistic"]

MOST_HIDDEN = 1024
"""Largest number of hidden neurons that the library runs."""


class FeedForwardNetwork:
    """A network with one hidden layer: sensors to hidden neurons to wheels.

    The genome is Fig. 1's chromosome. In crossover a hidden neuron's inputs and its switch go together, its outputs on
    their own; in mutation all three go together (paper steps 3.4.2 and 3.4.3).

    Args:
        hidden: Hidden neurons in a genome, on or off: 1 to 1024 (paper Table I: 15).
        bias: Whether hidden neurons and outputs have a constant input.
        activation: Of hidden neurons and outputs.

    Raises:
        ValueError: An option is out of its range.
    """

    def __init__(self, hidden: int = 15, bias: bool = True, activation: Activation = "tanh") -> None:
        if type(hidden) is not int or not 1 <= hidden <= MOST_HIDDEN:
            raise ValueError(f"hidden: expected a whole number from 1 to {MOST_HIDDEN}, got {hidden!r}")
        if not isinstance(bias, bool):
            raise ValueError(f"bias: expected true or false, got {bias!r}")
        if activation not in get_args(Activation):
            raise ValueError(f"activation: expected one of {', '.join(get_args(Activation))}, got {activation!r}")
        self._hidden, self._bias, self._activation = hidden, bias, activation
        self._space: GenomeSpace | None = None

    def space(self, scene: SceneInfo) -> GenomeSpace:
        """Return the chromosome's layout for what robots observe and are told in a scene.

        The other methods take genomes of the scene that was asked about last.
        """
        hidden, bias = self._hidden, self._bias
        self._space = GenomeSpace(
            (
                # omega_ih, omega_ho and rho_h
                Block("input_hidden", (hidden, scene.observations + bias), units="hidden", linked="input"),
                Block("hidden_output", (scene.commands, hidden + bias), unit_axis=1, units="hidden", linked="output"),
                Block("hidden_switch", (hidden,), "switch", units="hidden", linked="input"),
            )
        )
        return self._space

    def policies(self, genomes: FloatArray) -> FeedForward:
        """Return the networks of ``genomes`` ``(n, size)``.

        Raises:
            ValueError: The genomes are not ``size`` long.
        """
        weights = self._split(genomes)
        return FeedForward(
            input_hidden=weights["input_hidden"],
            hidden_output=weights["hidden_output"],
            hidden_switch=_is_on(weights["hidden_switch"]),
            bias=self._bias,
            activation=self._activation,
        )

    def complexity(self, genomes: FloatArray) -> FloatArray:
        """Return ``(n,)``: the number of hidden neurons switched on, the sum in eq. 2."""
        return np.asarray(_is_on(self._split(genomes)["hidden_switch"]).sum(axis=-1), dtype=np.float64)

    def _split(self, genomes: FloatArray) -> dict[str, FloatArray]:
        if self._space is None:
            raise ValueError("genomes: expected space(scene) to be asked for first; it tells what they hold")
        return self._space.split(genomes)


def _is_on(switches: FloatArray) -> BoolArray:
    return switches >= 0.5

# SPDX-License-Identifier: BSD-3-Clause
"""A robot's network, without what is switched off, and what its hidden neurons did in an episode."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from swarmevo.protocols import Compiled, FeedForward, FloatArray, Linear, NativePolicies, Recurrent, SceneInfo


@dataclass(frozen=True)
class Network:
    """One robot's network, without what is switched off. A bias is the last of the inputs."""

    hidden: Sequence[str]
    """h names; none of a linear network"""
    input_hidden: FloatArray
    """``(h, inputs)``"""
    hidden_output: FloatArray
    """``(commands, h)``"""
    input_output: FloatArray
    """``(commands, inputs)``: of a linear network all, of the others the bias alone"""
    remembered: FloatArray
    """``(h, h + commands)``: what hidden neurons hear of themselves and of the commands a control step ago"""

    @property
    def largest(self) -> float:
        """The largest weight."""
        every = (self.input_hidden, self.hidden_output, self.input_output, self.remembered)
        return max(1e-9, *(float(np.abs(weights).max(initial=0)) for weights in every))


def network_of(policies: NativePolicies, info: SceneInfo, i: int = 0) -> Network:
    """Return one of some networks.

    Raises:
        ValueError: They are compiled functions.
    """
    if isinstance(policies, Compiled):
        raise ValueError("network_of: expected networks that the library runs, got compiled functions")
    inputs = info.observations + policies.bias
    if isinstance(policies, Linear):
        nothing = np.zeros((0, inputs)), np.zeros((info.commands, 0))
        return Network([], *nothing, policies.input_output[i], np.zeros((0, info.commands)))
    on = _on(policies, i)
    names, remembered = [f"{number}" for number in on], np.zeros((len(on), len(on) + info.commands))
    if isinstance(policies, Recurrent):
        context = policies.context_hidden[i][on]
        of_commands = policies.recurrence == "jordan"
        remembered[:, slice(len(on), None) if of_commands else slice(len(on))] = (
            context if of_commands else context[:, on]
        )
        if policies.time_constants is not None:
            names = [f"{name}: {time:.2g} s" for name, time in zip(names, policies.time_constants[i][on], strict=True)]
    out, direct = policies.hidden_output[i], np.zeros((info.commands, inputs))
    if policies.bias:
        direct[:, -1] = out[:, -1]  # the bias comes last
    return Network(names, policies.input_hidden[i][on], out[:, on], direct, remembered)


def activations(
    policies: NativePolicies, i: int, observation: FloatArray, command: FloatArray, period: float
) -> FloatArray:
    """Return ``(steps, robots, h)``: what the hidden neurons of one of some networks made of what they were told.

    Args:
        policies: Networks.
        i: Which of them.
        observation: ``(steps, robots, observations)``, from an episode's start.
        command: ``(steps, robots, commands)``, as they were given; Jordan's networks remember them.
        period: From a control step to the next [s].

    Raises:
        ValueError: As :func:`network_of`.
    """
    if isinstance(policies, Compiled):
        raise ValueError("activations: expected networks that the library runs, got compiled functions")
    if isinstance(policies, Linear):
        return np.zeros((*observation.shape[:2], 0))
    on, act = _on(policies, i), _ACTIVATIONS[policies.activation]
    weights = policies.input_hidden[i][on]
    bias = weights[:, -1] if policies.bias else np.zeros(len(on))
    heard = observation @ weights[:, : observation.shape[-1]].T
    if isinstance(policies, FeedForward):
        return act(heard + bias)
    context = policies.context_hidden[i][on]
    if policies.recurrence == "jordan":
        before = np.concatenate([np.zeros_like(command[:1]), command[:-1]])
        return act(heard + before @ context.T + bias)
    if policies.recurrence == "elman":
        return _elman(heard + bias, context[:, on], act)
    assert policies.time_constants is not None
    share = period / policies.time_constants[i][on]
    rates = share if policies.integration == "euler" else -np.expm1(-share)
    return _ctrnn(heard, bias, context[:, on], rates, act)


_Activation = Callable[[FloatArray], FloatArray]
_ACTIVATIONS: dict[str, _Activation] = {"tanh": np.tanh, "logistic": lambda x: (1 + np.tanh(x / 2)) / 2}


def _on(policies: FeedForward | Recurrent, i: int) -> list[int]:
    on: list[int] = np.flatnonzero(policies.hidden_switch[i]).tolist()
    return on


def _elman(driven: FloatArray, context: FloatArray, act: _Activation) -> FloatArray:
    """Return the activations where each neuron hears those of the control step before."""
    found = np.zeros_like(driven)
    hidden = np.zeros_like(driven[0])
    for step, drive in enumerate(driven):
        hidden = found[step] = act(drive + hidden @ context.T)
    return found


def _ctrnn(heard: FloatArray, bias: FloatArray, context: FloatArray, rates: FloatArray, act: _Activation) -> FloatArray:
    """Return the activations of leaky integrators that hear each other."""
    found = np.zeros_like(heard)
    state = np.zeros_like(heard[0])
    for step, drive in enumerate(heard):
        state = state + rates * (drive + act(state + bias) @ context.T - state)
        found[step] = act(state + bias)
    return found

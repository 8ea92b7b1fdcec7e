# SPDX-License-Identifier: BSD-3-Clause
"""Networks without the hidden units that are off: as plain data, and as C99."""

from __future__ import annotations

import dataclasses
import math
import string
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, Final, Protocol

import numpy as np

from swarmevo.protocols import Compiled, FeedForward, FloatArray, Linear, NativePolicies, Recurrent

_LOGISTIC: Final = "1.0 / (1.0 + exp(-x))"
_HIDDEN: Final = {"tanh": "tanh(x)", "logistic": _LOGISTIC}
_OUTPUT: Final = {
    "identity": "x < -1.0 ? -1.0 : x > 1.0 ? 1.0 : x",  # as the library clips it
    "tanh": "tanh(x)",
    "logistic": f"2.0 * ({_LOGISTIC}) - 1.0",
}
"""Activations of hidden units and of outputs, as ``native/src/networks/layer.hpp`` has them."""


class Network(Protocol):
    """A network of any kind; h hidden units."""

    @property
    def description(self) -> str:
        """What it is, in words."""
        ...

    @property
    def template(self) -> str:
        """The name of its C99 in ``templates/``."""
        ...

    def values(self) -> Mapping[str, str]:
        """Return what the template's placeholders stand for."""
        ...


@dataclass(frozen=True)
class FeedForwardNetwork:
    """With one hidden layer."""

    activation: str
    input_hidden: FloatArray
    """``(h, observations)``"""
    hidden_bias: FloatArray
    """``(h,)``"""
    hidden_output: FloatArray
    """``(h, commands)``"""
    output_bias: FloatArray
    """``(commands,)``"""

    @property
    def description(self) -> str:
        """See :class:`Network`."""
        return f"A feed-forward network: {len(self.hidden_bias)} hidden units, {self.activation}."

    @property
    def template(self) -> str:
        """See :class:`Network`."""
        return "feedforward"

    def values(self) -> Mapping[str, str]:
        """See :class:`Network`. C has no empty arrays: there is a row more than there are units."""
        return {
            "hidden": str(len(self.hidden_bias)),
            "input_hidden": _rows(_longer(self.input_hidden)),
            "hidden_bias": _row([*self.hidden_bias, 0.0]),
            "hidden_output": _rows(_longer(self.hidden_output)),
            "output_bias": _row(self.output_bias),
            "hidden_activation": _HIDDEN[self.activation],
            "output_activation": _OUTPUT[self.activation],
        }


@dataclass(frozen=True)
class LinearNetwork:
    """Without hidden units."""

    activation: str
    input_output: FloatArray
    """``(commands, observations)``"""
    output_bias: FloatArray
    """``(commands,)``"""

    @property
    def description(self) -> str:
        """See :class:`Network`."""
        return f"A linear network: no hidden units, {self.activation}."

    @property
    def template(self) -> str:
        """See :class:`Network`."""
        return "linear"

    def values(self) -> Mapping[str, str]:
        """See :class:`Network`."""
        return {
            "input_output": _rows(self.input_output),
            "output_bias": _row(self.output_bias),
            "output_activation": _OUTPUT[self.activation],
        }


@dataclass(frozen=True)
class RecurrentNetwork(FeedForwardNetwork):
    """With one hidden layer that hears a context besides the observation."""

    recurrence: str
    context_hidden: FloatArray
    """``(h, context)``: of ``jordan`` the commands, of the others the hidden units"""
    time_constants: FloatArray | None
    """``(h,)``: of ``ctrnn`` [s]"""
    rates: FloatArray | None
    """``(h,)``: of ``ctrnn``, the share of the way to what drives a unit that its state goes in a control period"""

    @property
    def description(self) -> str:
        """See :class:`Network`."""
        name = {"elman": "An Elman network", "jordan": "A Jordan network", "ctrnn": "A CTRNN"}[self.recurrence]
        memory = (
            "Its memory is of the control period that it evolved with, SWARMEVO_CONTROL_PERIOD_MS: call it as often."
        )
        return f"{name}: {len(self.hidden_bias)} hidden units, {self.activation}. {memory}"

    @property
    def template(self) -> str:
        """See :class:`Network`."""
        return "ctrnn" if self.recurrence == "ctrnn" else "recurrent"

    def values(self) -> Mapping[str, str]:
        """See :class:`Network`."""
        of_commands = self.recurrence == "jordan"
        return {
            **super().values(),
            "context_hidden": _rows(np.pad(self.context_hidden, ((0, 1), (0, 1)))),
            "context": "SWARMEVO_COMMANDS" if of_commands else "SWARMEVO_HIDDEN",
            "remembered": "command" if of_commands else "hidden",
            "rates": "" if self.rates is None else _row([*self.rates, 0.0]),
        }


def networks(policies: NativePolicies | None, control_period: float) -> list[Network]:
    """Return the networks of a controller; none if it is something else.

    Args:
        policies: Of the controller; None: it does not run in the library.
        control_period: Of the scene [s].
    """
    if policies is None or isinstance(policies, Compiled):
        return []
    if isinstance(policies, Linear):
        return list(_linear(policies))
    if isinstance(policies, Recurrent):
        return list(_recurrent(policies, control_period))
    return [FeedForwardNetwork(**layers) for layers in _layers(policies)]


def plain(network: Any) -> dict[str, Any]:
    """Return a network as plain data, without what it has not."""
    members = {member.name: getattr(network, member.name) for member in dataclasses.fields(network)}
    return {
        "description": network.description,
        **{
            name: value.tolist() if isinstance(value, np.ndarray) else value
            for name, value in members.items()
            if value is not None
        },
    }


def as_c(network: Network) -> str:
    """Return C99 that defines ``swarmevo_controller``."""
    return template(network.template).substitute(network.values())


def template(name: str, suffix: str = ".c") -> string.Template:
    """Return a file of ``templates/``."""
    return string.Template((files("swarmevo.runs") / "templates" / f"{name}{suffix}").read_text(encoding="utf-8"))


def literal(value: float) -> str:
    """Return a double as C reads it back, bit by bit."""
    return repr(float(value))


# ---- without what is off ---------------------------------------------------------------------------------------------


def _linear(policies: Linear) -> Iterator[LinearNetwork]:
    for rows in policies.input_output:
        weights, bias = _apart(rows, policies.bias)
        yield LinearNetwork(policies.activation, weights, bias)


def _layers(policies: FeedForward | Recurrent) -> Iterator[dict[str, Any]]:
    for i, on in enumerate(policies.hidden_switch):
        inputs, hidden_bias = _apart(policies.input_hidden[i][on], policies.bias)
        outputs, output_bias = _apart(policies.hidden_output[i], policies.bias)
        yield {
            "activation": policies.activation,
            "input_hidden": inputs,
            "hidden_bias": hidden_bias,
            "hidden_output": outputs[:, on].T,
            "output_bias": output_bias,
        }


def _recurrent(policies: Recurrent, control_period: float) -> Iterator[RecurrentNetwork]:
    for i, layers in enumerate(_layers(policies)):
        on, context = policies.hidden_switch[i], policies.context_hidden[i]
        time_constants = None if policies.time_constants is None else policies.time_constants[i][on]
        yield RecurrentNetwork(
            **layers,
            recurrence=policies.recurrence,
            context_hidden=context[on] if policies.recurrence == "jordan" else context[on][:, on],
            time_constants=time_constants,
            rates=None if time_constants is None else _rates(policies, control_period / time_constants),
        )


def _rates(policies: Recurrent, steps: FloatArray) -> FloatArray:
    """Return ``(h,)`` of the control period over the time constants, as ``native/src/networks/recurrent.cpp`` does."""
    if policies.integration == "euler":
        return steps
    return np.array([-math.expm1(-step) for step in steps.tolist()])


def _apart(rows: FloatArray, has_bias: bool) -> tuple[FloatArray, FloatArray]:
    """Return weights, and the bias that stands behind each row if there is one, else 0."""
    return (rows[:, :-1], rows[:, -1]) if has_bias else (rows, np.zeros(len(rows)))


# ---- numbers of C ----------------------------------------------------------------------------------------------------


def _longer(matrix: FloatArray) -> FloatArray:
    return np.pad(matrix, ((0, 1), (0, 0)))


def _rows(matrix: FloatArray) -> str:
    return "".join(f"    {{\n{_row(row)}}},\n" for row in matrix)


def _row(values: Sequence[float] | FloatArray) -> str:
    return "".join(f"    {literal(value)},\n" for value in values)

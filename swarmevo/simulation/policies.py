# SPDX-License-Identifier: BSD-3-Clause
"""Controllers that run in the library, as it takes them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

from swarmevo import returned
from swarmevo.errors import InvalidArgument
from swarmevo.protocols import (
    Compiled,
    FeedForward,
    Linear,
    NativePolicies,
    Recurrent,
    SceneInfo,
)
from swarmevo.simulation._ffi import check, load


def check_policies(policies: NativePolicies, info: SceneInfo) -> None:
    """Refuse what the library would take for something else: it is given numbers without their Python types.

    Args:
        policies: The controllers.
        info: The scene in which they are to act.

    Raises:
        InvalidArgument: A member has another type or shape, or is not finite.
    """
    if isinstance(policies, Compiled):
        _check_compiled(policies)
        return
    if not isinstance(policies.bias, bool | np.bool_):
        raise InvalidArgument(f"bias: expected True or False, got {policies.bias!r}")
    _check_choice(policies, "activation")
    if isinstance(policies, FeedForward):
        _check_feedforward(policies, info)
    elif isinstance(policies, Linear):
        shape = len(policies), info.commands, info.observations + int(policies.bias)
        _check_numbers("input_output", policies.input_output, shape)
    else:
        _check_recurrent(policies, info)


def _check_choice(policies: NativePolicies, name: str) -> None:
    """Refuse a member that is not among the texts of its annotation."""
    kind: type = type(policies)
    value, choices = getattr(policies, name), _choices(kind, name)
    if not isinstance(value, str) or value not in choices:
        raise InvalidArgument(f"{name}: expected {', '.join(choices[:-1])} or {choices[-1]}, got {value!r}")


@cache
def _choices(kind: type, member: str) -> tuple[str, ...]:
    return get_args(get_type_hints(kind)[member])


def _check_switch(switch: object) -> tuple[int, int]:
    """Return how many networks there are, and of how many hidden units."""
    if not isinstance(switch, np.ndarray) or switch.dtype != np.bool_ or switch.ndim != 2:
        raise InvalidArgument(f"hidden_switch: expected booleans of shape (n, hidden), got {_kind(switch)}")
    n, hidden = switch.shape
    return n, hidden


def _check_feedforward(policies: FeedForward, info: SceneInfo) -> None:
    (n, hidden), bias = _check_switch(policies.hidden_switch), int(policies.bias)
    _check_numbers("input_hidden", policies.input_hidden, (n, hidden, info.observations + bias))
    _check_numbers("hidden_output", policies.hidden_output, (n, info.commands, hidden + bias))


def _check_recurrent(policies: Recurrent, info: SceneInfo) -> None:
    (n, hidden), bias = _check_switch(policies.hidden_switch), int(policies.bias)
    _check_choice(policies, "recurrence")
    _check_choice(policies, "integration")
    context = info.commands if policies.recurrence == "jordan" else hidden
    _check_numbers("input_hidden", policies.input_hidden, (n, hidden, info.observations + bias))
    _check_numbers("context_hidden", policies.context_hidden, (n, hidden, context))
    _check_numbers("hidden_output", policies.hidden_output, (n, info.commands, hidden + bias))
    if policies.recurrence == "ctrnn":
        _check_numbers("time_constants", policies.time_constants, (n, hidden))
    elif policies.time_constants is not None:
        raise InvalidArgument(f"time_constants: expected None for {policies.recurrence}; only ctrnn has them")


def _check_compiled(policies: Compiled) -> None:
    for name, least, most in (("function", 1, 2**64 - 1), ("memory", 0, 2**32 - 1), *_COUNTS):
        value = getattr(policies, name)
        if not isinstance(value, int | np.integer) or not least <= value <= most:
            raise InvalidArgument(f"{name}: expected a whole number from {least} to {most}, got {_kind(value)}")
    rows = policies.parameters
    if not isinstance(rows, np.ndarray) or rows.ndim != 2:
        raise InvalidArgument(f"parameters: expected an array of shape (n, size), got {_kind(rows)}")
    _check_numbers("parameters", rows, rows.shape)


_COUNTS = (("observations", 0, 2**32 - 1), ("commands", 0, 2**32 - 1))


def _check_numbers(name: str, values: object, shape: tuple[int, ...]) -> None:
    if not isinstance(values, np.ndarray):
        raise InvalidArgument(f"{name}: expected an array of shape {shape}, got {_kind(values)}")
    try:
        returned.numbers(values, shape)
    except ValueError as error:
        raise InvalidArgument(f"{name}: {error}") from error


def _kind(value: object) -> str:
    """Return what a value is, in words."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype} of shape {value.shape}"
    return repr(value) if isinstance(value, float) else type(value).__name__


def _feedforward_handles(policies: FeedForward) -> tuple[Any, list[Any]]:
    _, lib = load()
    config = _filled(
        "network",
        observations=policies.input_hidden.shape[2] - int(policies.bias),
        commands=policies.hidden_output.shape[1],
        hidden=policies.hidden_switch.shape[1],
        bias=policies.bias,
        activation=policies.activation,
    )
    arrays = (policies.input_hidden, policies.hidden_output, policies.hidden_switch)
    return _network_handles(lib.swe_networks_create, config, len(policies), arrays)


def _linear_handles(policies: Linear) -> tuple[Any, list[Any]]:
    _, lib = load()
    _, commands, inputs = policies.input_output.shape
    config = _filled(
        "linear",
        observations=inputs - int(policies.bias),
        commands=commands,
        bias=policies.bias,
        activation=policies.activation,
    )
    return _network_handles(lib.swe_linear_create, config, len(policies), (policies.input_output,))


def _recurrent_handles(policies: Recurrent, control_period: float) -> tuple[Any, list[Any]]:
    _, lib = load()
    config = _filled(
        "recurrent",
        observations=policies.input_hidden.shape[2] - int(policies.bias),
        commands=policies.hidden_output.shape[1],
        hidden=policies.hidden_switch.shape[1],
        bias=policies.bias,
        activation=policies.activation,
        recurrence=policies.recurrence,
        integration=policies.integration,
        control_period=control_period,
    )
    arrays = (
        policies.input_hidden,
        policies.context_hidden,
        policies.hidden_output,
        policies.time_constants,
        policies.hidden_switch,
    )
    return _network_handles(lib.swe_recurrent_create, config, len(policies), arrays)


def _filled(name: str, **members: object) -> Any:
    """Return a ``swe_<name>_config *`` with these members; choices become their constants."""
    ffi, lib = load()
    config = ffi.new(f"swe_{name}_config *")
    getattr(lib, f"swe_{name}_config_init")(config)
    for key, value in members.items():
        setattr(config, key, getattr(lib, f"SWE_{key}_{value}".upper()) if isinstance(value, str) else value)
    return config


def _network_handles(create: Any, config: Any, n: int, arrays: Sequence[NDArray[Any] | None]) -> tuple[Any, list[Any]]:
    """Return the policies of ``n`` networks that ``create`` makes of arrays of numbers and of switches."""
    ffi, lib = load()
    handle, given = ffi.new("swe_networks **"), []
    for array in arrays:
        if array is None:
            given.append(ffi.NULL)
            continue
        is_switch = array.dtype == np.bool_
        rows = np.ascontiguousarray(array, dtype=np.uint8 if is_switch else np.float64)
        given.append(ffi.from_buffer("uint8_t[]" if is_switch else "double[]", rows))
    check(create(handle, config, n, *given))
    networks = ffi.gc(handle[0], lib.swe_networks_destroy)
    native = ffi.new("swe_policy[]", n)
    check(lib.swe_networks_policies(native, n, networks))
    return native, [networks]


def _compiled_handles(policies: Compiled) -> tuple[Any, list[Any]]:
    ffi, _ = load()
    rows = np.ascontiguousarray(policies.parameters, dtype=np.float64)
    start = ffi.cast("char *", ffi.from_buffer(rows))
    native = ffi.new("swe_policy[]", len(rows))
    for i, policy in enumerate(native):
        policy.function = ffi.cast("swe_policy_function", policies.function)
        policy.parameters = start + i * rows.strides[0]
        policy.memory = policies.memory
        policy.observations, policy.commands = policies.observations, policies.commands
    return native, [rows, policies.keep_alive]


def native_policies(policies: NativePolicies, info: SceneInfo) -> tuple[Any, list[Any]]:
    """Return a ``swe_policy[]`` for a scene, and what must live as long as it.

    Raises:
        InvalidArgument: The library would take them for something else, or refuses them.
    """
    check_policies(policies, info)
    if isinstance(policies, FeedForward):
        return _feedforward_handles(policies)
    if isinstance(policies, Linear):
        return _linear_handles(policies)
    if isinstance(policies, Recurrent):
        return _recurrent_handles(policies, info.control_period)
    return _compiled_handles(policies)

# SPDX-License-Identifier: BSD-3-Clause
"""Controllers that run in the library, as it takes them."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np

from swarmevo import returned
from swarmevo.errors import InvalidArgument
from swarmevo.protocols import Activation, Compiled, FeedForward, NativePolicies, SceneInfo
from swarmevo.simulation._ffi import check, load


def check_policies(policies: NativePolicies, info: SceneInfo) -> None:
    """Refuse what the library would take for something else: it is given numbers without their Python types.

    Args:
        policies: The controllers.
        info: The scene in which they are to act.

    Raises:
        InvalidArgument: A member has another type or shape, or is not finite.
    """
    if isinstance(policies, FeedForward):
        _check_networks(policies, info)
    else:
        _check_compiled(policies)


def _check_networks(policies: FeedForward, info: SceneInfo) -> None:
    switch = policies.hidden_switch
    if not isinstance(switch, np.ndarray) or switch.dtype != np.bool_ or switch.ndim != 2:
        raise InvalidArgument(f"hidden_switch: expected booleans of shape (n, hidden), got {_kind(switch)}")
    if not isinstance(policies.bias, bool | np.bool_):
        raise InvalidArgument(f"bias: expected True or False, got {policies.bias!r}")
    if policies.activation not in get_args(Activation):
        raise InvalidArgument(f"activation: expected tanh or logistic, got {policies.activation!r}")
    n, hidden = switch.shape
    bias = int(policies.bias)
    _check_numbers("input_hidden", policies.input_hidden, (n, hidden, info.observations + bias))
    _check_numbers("hidden_output", policies.hidden_output, (n, info.commands, hidden + bias))


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
    ffi, lib = load()
    n, hidden = policies.hidden_switch.shape
    bias = int(policies.bias)
    config = ffi.new("swe_network_config *")
    lib.swe_network_config_init(config)
    config.hidden, config.bias = hidden, bias
    config.observations, config.commands = policies.input_hidden.shape[2] - bias, policies.hidden_output.shape[1]
    config.activation = getattr(lib, f"SWE_ACTIVATION_{policies.activation}".upper())
    arrays = [
        np.ascontiguousarray(policies.input_hidden, dtype=np.float64),
        np.ascontiguousarray(policies.hidden_output, dtype=np.float64),
        np.ascontiguousarray(policies.hidden_switch, dtype=np.uint8),
    ]
    handle = ffi.new("swe_networks **")
    check(
        lib.swe_networks_create(
            handle,
            config,
            n,
            ffi.from_buffer("double[]", arrays[0]),
            ffi.from_buffer("double[]", arrays[1]),
            ffi.from_buffer("uint8_t[]", arrays[2]),
        )
    )
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
    return _compiled_handles(policies)

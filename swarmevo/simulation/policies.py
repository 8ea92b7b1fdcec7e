# SPDX-License-Identifier: BSD-3-Clause
"""Controllers that run in the library, as it takes them."""

from __future__ import annotations

from typing import Any

import numpy as np

from swarmevo.errors import InvalidArgument
from swarmevo.protocols import COMMANDS, OBSERVATIONS, Compiled, FeedForward, NativePolicies
from swarmevo.simulation._ffi import check, load


def _feedforward_handles(policies: FeedForward) -> tuple[Any, list[Any]]:
    ffi, lib = load()
    n, hidden = policies.hidden_switch.shape
    bias = int(policies.bias)
    expected = {"input_hidden": (n, hidden, OBSERVATIONS + bias), "hidden_output": (n, COMMANDS, hidden + bias)}
    for name, shape in expected.items():
        if getattr(policies, name).shape != shape:
            raise InvalidArgument(f"{name}: expected shape {shape}, got {getattr(policies, name).shape}")
    config = ffi.new("swe_network_config *")
    lib.swe_network_config_init(config)
    config.hidden, config.bias = hidden, bias
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
    return native, [rows, policies.keep_alive]


def native_policies(policies: NativePolicies) -> tuple[Any, list[Any]]:
    """Return a ``swe_policy[]`` and what must live as long as it."""
    if isinstance(policies, FeedForward):
        return _feedforward_handles(policies)
    return _compiled_handles(policies)

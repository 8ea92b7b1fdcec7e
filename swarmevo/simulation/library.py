# SPDX-License-Identifier: BSD-3-Clause
"""What is known about the native library, and the processor that it runs on."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import math
import platform
import struct
from pathlib import Path

from swarmevo.errors import SimulatorError
from swarmevo.simulation._ffi import library_path, load


def library_info() -> dict[str, str]:
    """Return what is known about the native library: its path, its build and its ABI version.

    Raises:
        SimulatorError: It cannot be loaded.
    """
    ffi, lib = load()
    return {
        "path": str(library_path()),
        "build": ffi.string(lib.swe_build_info()).decode(),
        "abi": str(lib.swe_abi_version()),
    }


@functools.cache
def libm() -> str:
    """Return a digest of what the C library's functions return that the simulator calls: 8 hexadecimal digits.

    glibc rounds them otherwise from version to version, and on processors without fused multiply-add; where two digests
    differ, the same episode may end differently.
    """
    digest = hashlib.sha256()
    for i in range(1, 2001):
        x, y = i / 250, 0.3 + i / 700
        values = (math.sin(x), math.cos(x), math.exp(-x), math.expm1(-x), math.log(x), math.tanh(x), math.atan2(y, -x))
        digest.update(struct.pack("8d", *values, abs(complex(x, y))))  # hypot of C; that of math is Python's own
    return digest.hexdigest()[:8]


def selftest() -> None:
    """Provoke an assertion inside ODE and see that it arrives as an error instead of ending the process.

    Raises:
        SimulatorError: It did not arrive.
    """
    _, lib = load()
    if lib.swe_selftest_ode_error() != lib.SWE_PHYSICS_ERROR:
        raise SimulatorError("an assertion inside ODE was not caught; reinstall swarmevo")


def cpu() -> str:
    """Return the processor's model."""
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()

# SPDX-License-Identifier: BSD-3-Clause
"""The native library: read the installed header, load the library beside it, turn its errors into exceptions.

The only module that imports cffi. ``SWARMEVO_LIBRARY`` names another library file, say one built with sanitizers; its
header must lie beside it or in the package.
"""

from __future__ import annotations

import math
import os
import re
import threading
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from importlib.resources import files
from itertools import zip_longest
from pathlib import Path
from typing import Any, Final

from cffi import FFI

from swarmevo.errors import InvalidArgument, SimulatorError
from swarmevo.protocols import CHANNELS, Channel

_LOADING = threading.Lock()
_STRUCTS = (  # in the order of swe_abi_layout
    "scene_config",
    "network_config",
    "policy",
    "episode",
    "outcome",
    "channel_info",
    "channel",
    "linear_config",
    "recurrent_config",
)
_PACKAGES = {"libode.so.8": "libode8 (Debian, Ubuntu)"}
"""That have the shared libraries which the native library may need, beside those of every Linux."""
_CFFI_PART = re.compile(r"/\* \[cffi begins\].*?\*/(.*)/\* \[cffi ends\] \*/", re.DOTALL)


def _installed(name: str) -> Path:
    """Return the path of an installed file of the package; it need not exist.

    In a checkout or an editable install the built files lie elsewhere than the modules; the metadata knows where.
    """
    beside = Path(str(files("swarmevo") / name))
    if beside.exists():
        return beside
    with suppress(PackageNotFoundError):
        for file in distribution("swarmevo").files or ():
            if file.parts[-2:] == ("swarmevo", name):
                return Path(str(file.locate()))
    return beside


def library_path() -> Path:
    """Return the path of the native library; it need not exist."""
    named = os.environ.get("SWARMEVO_LIBRARY")
    return Path(named) if named else _installed("libswarmevo.so")


def _declarations() -> str:
    """Return the declarations between the header's two markers."""
    beside = library_path().with_name("swarmevo.h")
    header = beside if beside.exists() else _installed("swarmevo.h")
    try:
        text = header.read_text(encoding="utf-8")
    except OSError as error:
        raise SimulatorError(f"cannot read {header}: {error.strerror}; reinstall swarmevo") from None
    match = _CFFI_PART.search(text)
    if match is None:
        raise SimulatorError(f"{header}: the cffi markers are missing; reinstall swarmevo")
    return match.group(1)


def _check_abi(ffi: FFI, lib: Any, path: Path) -> None:
    """Refuse a library that was built from another header."""
    expected: int = lib.SWE_ABI_VERSION
    try:
        version = lib.swe_abi_version()
        if version != expected:  # another version may lack the functions that are called below
            raise SimulatorError(f"{path}: expected ABI version {expected}, got {version}; reinstall swarmevo")
        sizes = ffi.new("uint32_t[]", lib.SWE_LAYOUT_SIZES)
        lib.swe_abi_layout(sizes)
    except AttributeError as error:
        raise SimulatorError(f"{path}: not a swarmevo library ({error}); reinstall swarmevo") from None
    for name, size in zip(_STRUCTS, sizes, strict=True):
        if size != ffi.sizeof(f"swe_{name}"):
            raise SimulatorError(
                f"{path}: swe_{name} has {size} bytes there and {ffi.sizeof(f'swe_{name}')} here: "
                "the library is older or newer than its header; reinstall swarmevo"
            )


def _check_channels(ffi: FFI, lib: Any, path: Path) -> None:
    """Refuse a library whose channels are not those of ``CHANNELS``, in name, shape or order."""
    info, found = ffi.new("swe_channel_info *"), []
    for i in range(lib.swe_channel_count()):
        lib.swe_channel_describe(info, i, ffi.NULL)  # widths that a scene decides are 0
        found.append((ffi.string(info.name).decode(), bool(info.per_robot), info.width))
    expected = [(name, "robots" in channel.shape, _fixed_width(channel)) for name, channel in CHANNELS.items()]
    for here, there in zip_longest(expected, found):
        if here != there:
            raise SimulatorError(
                f"{path}: expected the channel {_described(here)}, got {_described(there)}: the library is older or "
                "newer than swarmevo/protocols.py; reinstall swarmevo"
            )


def _fixed_width(channel: Channel) -> int:
    """Return how many values a channel has of each robot or of the world; 0: a scene decides it."""
    return math.prod(0 if isinstance(axis, str) else axis for axis in channel.shape if axis != "robots")


def _described(channel: tuple[str, bool, int] | None) -> str:
    if channel is None:
        return "none"
    name, per_robot, width = channel
    return f"{name} with {width} values {'a robot' if per_robot else 'a world'}"


def load() -> tuple[FFI, Any]:
    """Return ``(ffi, lib)``, loaded and checked once.

    Raises:
        SimulatorError: The library is missing, cannot be loaded, or does not fit its header.
    """
    with _LOADING:  # by one thread, once
        return _load()


def _unloadable(error: str, path: Path) -> str:
    """Return why the native library cannot be loaded and what to do, from what cffi says."""
    reason = re.split(r"\.\s+Additionally, ", error)[0]  # cffi goes on about a search that has no meaning for a path
    reason = reason.removeprefix(f"cannot load library '{path}': ")
    lacking = re.match(r"(?:\S*/)?(lib\w[\w+-]*\.so[.\d]*): ", reason)
    if lacking is None or lacking[1] == path.name:
        return f"{reason}; reinstall swarmevo"
    package = _PACKAGES.get(lacking[1])
    install = f"install {package}" if package else f"install the package that has {lacking[1]}"
    return f"{reason}; {install}, or a wheel of swarmevo that has it inside (make wheel)"


_EPISODE_TYPES: Final = (
    *("char *", "char[]", "double[]", "uint8_t[]", "uint32_t[]"),
    *("swe_batch **", "swe_channel[]", "swe_episode[]", "swe_outcome", "swe_outcome[]", "swe_policy[]"),
    *(
        "swe_policy_function",
        "swe_networks **",
        "swe_network_config *",
        "swe_linear_config *",
        "swe_recurrent_config *",
    ),
)


@cache
def _load() -> tuple[FFI, Any]:
    ffi = FFI()
    ffi.cdef(_declarations())
    path = library_path()
    try:
        lib: Any = ffi.dlopen(str(path))
    except OSError as error:
        raise SimulatorError(f"cannot load the native library {path}: {_unloadable(str(error), path)}") from None
    _check_abi(ffi, lib, path)
    _check_channels(ffi, lib, path)
    return ffi, lib


def parse_types() -> None:
    """Have cffi parse an episode's types: milliseconds each, the first time, that are not the episode's."""
    ffi, _ = load()
    for name in _EPISODE_TYPES:
        ffi.typeof(name)


def check(status: int) -> None:
    """Raise what the library reports.

    Raises:
        InvalidArgument: An argument was refused.
        SimulatorError: Anything else.
    """
    ffi, lib = load()
    if status == lib.SWE_OK:
        return
    message = ffi.string(lib.swe_error_message()).decode("utf-8", "replace")
    if status == lib.SWE_INVALID_ARGUMENT:
        raise InvalidArgument(*message.split("; "))  # as the library joins them, scene/check.hpp
    raise SimulatorError(message)

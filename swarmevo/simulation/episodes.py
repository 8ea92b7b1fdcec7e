# SPDX-License-Identifier: BSD-3-Clause
"""Episodes with controllers that run in the library. NumPy in, NumPy out."""

from __future__ import annotations

import math
import os
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmevo.errors import InvalidArgument, SimulatorError
from swarmevo.protocols import CHANNELS, FloatArray, NativePolicies, Telemetry
from swarmevo.simulation._ffi import check, load
from swarmevo.simulation.policies import native_policies
from swarmevo.simulation.scene import Scene

MOST_THREADS: Final = 1024
"""Of a call."""


class EpisodeKey(NamedTuple):
    """What everything random in an episode depends on, besides the robot and the time."""

    seed: int
    trial: int
    generation: int
    repeat: int


@dataclass(frozen=True)
class Episodes:
    """Outcomes and telemetry of ``n`` episodes."""

    telemetry: Telemetry
    """The channels asked for, and the homing and push times."""
    status: NDArray[np.int32]
    """``(n,)``: 0 where the episode went well; else all its other entries are meaningless."""
    messages: list[str]
    """``n`` reasons of failure; empty where it went well."""
    steps: NDArray[np.uint32]
    """``(n,)``: control steps done; fewer than the horizon's where ``episode.until`` ends the episode. What telemetry
    records is NaN after them."""
    hash: NDArray[np.uint64]
    """``(n,)``: of every body's state at every control step."""
    ode_messages: NDArray[np.uint32]
    """``(n,)``: warnings of ODE's solver; each makes a step be tried again."""
    unsolved_steps: NDArray[np.uint32]
    """``(n,)``: steps that no further try mended."""
    box_pose: FloatArray
    """``(n, 3)``: x [m], y [m], heading [rad] at the end."""
    max_penetration: FloatArray
    """``(n,)``: deepest overlap of any two bodies, walls or floor, beyond the travel of bumpers [m]."""
    max_lift: FloatArray
    """``(n,)``: largest rise of a body's centre [m]."""
    min_upright: FloatArray
    """``(n,)``: smallest cosine of a body's tilt."""

    def __len__(self) -> int:
        return len(self.status)

    @property
    def homing_time(self) -> FloatArray:
        """``(n, robots)``: first time within the emitter's range [s]; NaN: never."""
        return self.telemetry.homing_time

    @property
    def push_time(self) -> FloatArray:
        """``(n,)``: first touch of box and target wall [s]; NaN: never."""
        return self.telemetry.push_time


class Buffers:
    """The arrays that the library writes ``n`` episodes to: outcomes, and channels at some control steps, or at one."""

    def __init__(self, scene: Scene, n: int, channels: Collection[str], steps: int | None) -> None:
        ffi, _ = load()
        unknown = sorted(set(channels) - set(CHANNELS))
        if unknown:
            raise InvalidArgument(f"channels: expected some of {', '.join(CHANNELS)}; got {', '.join(unknown)}")
        self._period = scene.info.control_period
        self.native_outcomes = ffi.new("swe_outcome[]", n)
        outcomes, fields = ffi.buffer(self.native_outcomes), _outcome_dtype()
        self.outcomes = np.frombuffer(outcomes, fields) if n else np.empty(0, fields)  # the same memory
        self.homing_time = np.empty((n, scene.info.robots))
        self.native_homing_time = ffi.from_buffer("double[]", self.homing_time)
        self.channels = {name: _empty(name, scene, (n,) if steps is None else (n, steps)) for name in channels}
        self.native_channels = ffi.new("swe_channel[]", len(channels))
        self._alive: list[Any] = []
        for channel, (name, array) in zip(self.native_channels, self.channels.items(), strict=True):
            channel.name = title = ffi.new("char[]", name.encode())
            channel.values = values = ffi.from_buffer("double[]", array)
            channel.length = array.size
            self._alive += [title, values]

    def collect(self, batch: Any) -> Episodes:
        """Return what the library has written; the arrays of channels and homing times are not copied."""
        ffi, lib = load()
        table = self.outcomes.copy()
        return Episodes(
            telemetry=Telemetry(self._period, self.homing_time, table["push_time"], channels=self.channels),
            status=table["status"],
            messages=[ffi.string(lib.swe_batch_episode_message(batch, i)).decode() for i in range(len(table))],
            steps=table["control_steps"],
            hash=table["hash"],
            ode_messages=table["ode_messages"],
            unsolved_steps=table["unsolved_steps"],
            box_pose=table["box_pose"],
            max_penetration=table["max_penetration"],
            max_lift=table["max_lift"],
            min_upright=table["min_upright"],
        )


def _empty(name: str, scene: Scene, axes: tuple[int, ...]) -> FloatArray:
    """Return the array of a channel."""
    shape = (*axes, *CHANNELS[name].sizes(scene.info))
    try:
        return np.empty(shape)
    except MemoryError:
        raise SimulatorError(
            f"telemetry {name}: expected {math.prod(shape) * 8 / 2**30:.1f} GiB of memory for {axes[0]} episodes of "
            f"{scene.info.control_steps} control steps, got less; use a shorter episode.horizon or a longer "
            "episode.control_period"
        ) from None


_NUMPY_FORMATS = {"int32_t": "i4", "uint32_t": "u4", "uint64_t": "u8", "double": "f8", "double[3]": "3f8"}


@cache
def _outcome_dtype() -> np.dtype[Any]:
    """Return ``swe_outcome`` as a dtype."""
    ffi, _ = load()
    fields = ffi.typeof("swe_outcome").fields
    return np.dtype(
        {
            "names": [name for name, _ in fields],
            "offsets": [field.offset for _, field in fields],
            "formats": [_NUMPY_FORMATS[field.type.cname] for _, field in fields],
            "itemsize": ffi.sizeof("swe_outcome"),
        }
    )


def native_episodes(episodes: Sequence[EpisodeKey]) -> Any:
    """Return a ``swe_episode[]``."""
    ffi, _ = load()
    try:
        return ffi.new("swe_episode[]", [tuple(key) for key in episodes])
    except OverflowError:
        raise InvalidArgument(
            "episodes: expected 0 <= seed < 2**64 and 0 <= generation < 2**32, 0 <= trial, repeat < 2**16"
        ) from None


def _native_indices(robot_policies: NDArray[np.integer[Any]], shape: tuple[int, int]) -> NDArray[np.uint32]:
    given = np.asarray(robot_policies)
    if given.shape != shape:
        raise InvalidArgument(f"robot_policies: expected shape {shape}, got {given.shape}")
    if given.dtype.kind not in "iu":
        raise InvalidArgument(f"robot_policies: expected whole numbers, got dtype {given.dtype}")
    indices = np.ascontiguousarray(given, dtype=np.uint32)
    if (indices != given).any():
        raise InvalidArgument(f"robot_policies: expected 0 <= index < 2**32, got {given[indices != given][0]}")
    return indices


def create_batch(scene: Scene, threads: int) -> Any:
    """Return a ``swe_batch *`` that is freed with its last reference."""
    ffi, lib = load()
    if not 0 <= threads <= MOST_THREADS:
        raise InvalidArgument(f"threads: expected 0 to {MOST_THREADS}, got {threads}")
    handle = ffi.new("swe_batch **")
    check(lib.swe_batch_create(handle, scene._handle, threads or len(os.sched_getaffinity(0))))
    return ffi.gc(handle[0], lib.swe_batch_destroy)


def simulate(
    scene: Scene,
    policies: NativePolicies,
    episodes: Sequence[EpisodeKey],
    robot_policies: NDArray[np.integer[Any]] | None = None,
    channels: Collection[str] = (),
    threads: int = 1,
) -> Episodes:
    """Run episodes to their end with controllers that run natively.

    Args:
        scene: The world.
        policies: The controllers.
        episodes: One key for each episode. The same episodes give the same bits on any number of threads, in any
            order or division into calls.
        robot_policies: ``(len(episodes), robots)``: which of ``policies`` drives each robot. By default policy i is
            cloned to the whole team of episode i.
        channels: Telemetry to record: keys of ``CHANNELS``.
        threads: Worker threads, up to 1024; 0: one for each processor.

    Raises:
        InvalidArgument: A size, index, weight or channel is wrong; nothing ran.
        SimulatorError: The library failed as a whole. An episode that fails alone has its ``status`` set instead.
    """
    ffi, lib = load()
    keys = native_episodes(episodes)
    if robot_policies is None:
        robot_policies = np.repeat(np.arange(len(episodes), dtype=np.uint32)[:, None], scene.info.robots, axis=1)
    drivers = _native_indices(robot_policies, (len(episodes), scene.info.robots))
    native, _alive = native_policies(policies, scene.info)
    buffers = Buffers(scene, len(episodes), channels, scene.info.control_steps)
    batch = create_batch(scene, threads)
    check(
        lib.swe_batch_run(
            buffers.native_outcomes,
            buffers.native_homing_time,
            buffers.native_channels,
            len(buffers.native_channels),
            batch,
            keys,
            len(episodes),
            native,
            len(native),
            ffi.from_buffer("uint32_t[]", drivers),
        )
    )
    return buffers.collect(batch)

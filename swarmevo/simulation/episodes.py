# SPDX-License-Identifier: BSD-3-Clause
"""Episodes with controllers that run in the library. NumPy in, NumPy out."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmevo.errors import InvalidArgument, SimulatorError
from swarmevo.protocols import CHANNELS, FloatArray, NativePolicies, Telemetry
from swarmevo.simulation._ffi import check, load
from swarmevo.simulation.policies import native_policies
from swarmevo.simulation.scene import Scene


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


class Buffers:
    """The arrays that a batch of episodes writes to."""

    def __init__(self, scene: Scene, n: int, channels: Collection[str]) -> None:
        ffi, _ = load()
        unknown = sorted(set(channels) - set(CHANNELS))
        if unknown:
            raise InvalidArgument(f"channels: expected some of {', '.join(CHANNELS)}; got {', '.join(unknown)}")
        robots, steps = scene.info.robots, scene.info.control_steps
        self.outcomes = ffi.new("swe_outcome[]", n)
        self.homing = np.empty((n, robots))
        self.channels: dict[str, FloatArray] = {}
        for name in channels:
            shape = CHANNELS[name].sizes(robots)
            try:
                self.channels[name] = np.empty((n, steps, *shape))
            except MemoryError:
                gibibytes = n * steps * int(np.prod(shape)) * 8 / 2**30
                raise SimulatorError(
                    f"telemetry {name}: expected {gibibytes:.1f} GiB of memory for {n} episodes of {steps} control "
                    "steps, got less; use a shorter episode.horizon or a longer episode.control_period"
                ) from None
        self.native_channels, self._alive = native_channels(self.channels)

    def homing_pointer(self) -> Any:
        """Return where the library writes the homing times."""
        return load()[0].from_buffer("double[]", self.homing)

    def collect(self, scene: Scene, batch: Any) -> Episodes:
        """Return what the library has written."""
        ffi, lib = load()
        n = len(self.outcomes)
        dtype = np.dtype(
            {
                "names": [name for name, _ in ffi.typeof("swe_outcome").fields],
                "offsets": [field.offset for _, field in ffi.typeof("swe_outcome").fields],
                "formats": [_NUMPY_FORMATS[field.type.cname] for _, field in ffi.typeof("swe_outcome").fields],
                "itemsize": ffi.sizeof("swe_outcome"),
            }
        )
        table = np.frombuffer(ffi.buffer(self.outcomes), dtype=dtype).copy() if n else np.empty(0, dtype=dtype)
        return Episodes(
            telemetry=Telemetry(
                control_period=scene.info.control_period,
                homing_time=self.homing,
                push_time=table["push_time"],
                channels=self.channels,
            ),
            status=table["status"],
            messages=[ffi.string(lib.swe_batch_episode_message(batch, i)).decode() for i in range(n)],
            hash=table["hash"],
            ode_messages=table["ode_messages"],
            unsolved_steps=table["unsolved_steps"],
            box_pose=table["box_pose"],
            max_penetration=table["max_penetration"],
            max_lift=table["max_lift"],
            min_upright=table["min_upright"],
        )


def native_channels(arrays: Mapping[str, FloatArray]) -> tuple[Any, list[Any]]:
    """Return a ``swe_channel[]`` by which the library writes to ``arrays``, and what must live as long as it."""
    ffi, _ = load()
    channels = ffi.new("swe_channel[]", len(arrays))
    alive: list[Any] = []
    for channel, (name, array) in zip(channels, arrays.items(), strict=True):
        alive += [ffi.new("char[]", name.encode()), ffi.from_buffer("double[]", array)]
        channel.name, channel.values, channel.length = alive[-2], alive[-1], array.size
    return channels, alive


_NUMPY_FORMATS = {"int32_t": "i4", "uint32_t": "u4", "uint64_t": "u8", "double": "f8", "double[3]": "3f8"}


def native_episodes(episodes: Sequence[EpisodeKey]) -> Any:
    """Return a ``swe_episode[]``."""
    ffi, _ = load()
    try:
        return ffi.new("swe_episode[]", [tuple(key) for key in episodes])
    except OverflowError:
        raise InvalidArgument(
            "episodes: expected 0 <= seed < 2**64 and 0 <= trial, generation, repeat < 2**32"
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
    if not 1 <= threads <= 1024:
        raise InvalidArgument(f"threads: expected 1 to 1024, got {threads}")
    handle = ffi.new("swe_batch **")
    check(lib.swe_batch_create(handle, scene._handle, threads))
    return ffi.gc(handle[0], lib.swe_batch_destroy)


def simulate(
    scene: Scene,
    policies: NativePolicies,
    episodes: Sequence[EpisodeKey],
    robot_policies: NDArray[np.integer[Any]] | None = None,
    channels: Collection[str] = (),
    threads: int = 1,
) -> Episodes:
    """Run episodes to their horizon with controllers that run natively.

    Args:
        scene: The world.
        policies: The controllers.
        episodes: One key for each episode. The same episodes give the same bits on any number of threads, in any
            order or division into calls.
        robot_policies: ``(len(episodes), robots)``: which of ``policies`` drives each robot. By default policy i is
            cloned to the whole team of episode i.
        channels: Telemetry to record: keys of ``CHANNELS``.
        threads: Worker threads, 1 to 1024.

    Raises:
        InvalidArgument: A size, index, weight or channel is wrong; nothing ran.
        SimulatorError: The library failed as a whole. An episode that fails alone has its ``status`` set instead.
    """
    ffi, lib = load()
    keys = native_episodes(episodes)
    if robot_policies is None:
        robot_policies = np.repeat(np.arange(len(episodes), dtype=np.uint32)[:, None], scene.info.robots, axis=1)
    drivers = _native_indices(robot_policies, (len(episodes), scene.info.robots))
    native, _alive = native_policies(policies)
    buffers = Buffers(scene, len(episodes), channels)
    batch = create_batch(scene, threads)
    check(
        lib.swe_batch_run(
            buffers.outcomes,
            buffers.homing_pointer(),
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
    return buffers.collect(scene, batch)

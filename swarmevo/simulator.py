# SPDX-License-Identifier: BSD-3-Clause
"""The simulator: scenes and episodes. NumPy in, NumPy out.

>>> from swarmevo.config import Config
>>> scene = Scene(Config())
>>> scene.info.robots
5
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmevo._ffi import InvalidArgument, SimulatorError, check, library_path, load
from swarmevo.config import Config, Team
from swarmevo.protocols import (
    CHANNELS,
    COMMANDS,
    OBSERVATIONS,
    Compiled,
    FeedForward,
    FloatArray,
    NativePolicies,
    PythonController,
    SceneInfo,
    Telemetry,
)

__all__ = [
    "EpisodeKey",
    "Episodes",
    "InvalidArgument",
    "Scene",
    "SimulatorError",
    "library_info",
    "scene_errors",
    "selftest",
    "simulate",
    "simulate_lockstep",
    "start_poses",
]

_OWN_CARE = {"start", "start_poses"}  # copied by _native_config: rows of robots are resolved to poses first
_SECTIONS = ("arena", "box", "emitter", "robot", "team", "sensors", "noise", "physics", "episode")


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


# ---- scenes ----------------------------------------------------------------------------------------------------------


def start_poses(team: Team, arena_size: float) -> FloatArray:
    """Return the start poses ``(robots, 3)`` that a team's config names: x [m], y [m], heading [rad].

    ``row``: centred rows of as many robots as the arena's width takes, from ``row_y`` on northwards, heading south.
    """
    if team.start == "poses":
        return np.array(team.start_poses, dtype=float).reshape(-1, 3)
    fitting = np.nan_to_num(arena_size / team.row_spacing - 1 + 1e-9)  # half a spacing free at either wall
    in_row = int(np.clip(fitting, 1, team.robots))
    row, place = np.divmod(np.arange(team.robots), in_row)
    members = np.minimum(in_row, team.robots - row * in_row)
    x = (place - (members - 1) / 2) * team.row_spacing
    y = team.row_y + row * team.row_spacing
    return np.column_stack([x, y, np.full(team.robots, -np.pi / 2)])


def _copy_section(ffi: Any, lib: Any, target: Any, section: Any) -> None:
    """Copy a section of the config into the struct of the same name, key by key; choices become their constants."""
    for name, _ in ffi.typeof(target).fields:
        value = getattr(section, name, None)
        if value is None or name in _OWN_CARE:
            continue
        setattr(target, name, getattr(lib, f"SWE_{name}_{value}".upper()) if isinstance(value, str) else value)


def _native_config(config: Config) -> tuple[Any, list[Any]]:
    """Return a filled ``swe_scene_config *`` and the buffers that it points to."""
    ffi, lib = load()
    native = ffi.new("swe_scene_config *")
    lib.swe_scene_config_init(native)
    for name in _SECTIONS:
        _copy_section(ffi, lib, getattr(native, name), getattr(config, name))
    native.sensors.infrared_curve_points = len(config.sensors.infrared_curve)
    native.team.start = lib.SWE_START_RANDOM if config.team.start == "random" else lib.SWE_START_POSES

    poses = np.ascontiguousarray(start_poses(config.team, config.arena.size))
    if config.team.start != "random" and len(poses) != config.team.robots:
        raise InvalidArgument(
            f"team.start_poses: expected one pose for each of {config.team.robots} robots, got {len(poses)}"
        )
    buffer = ffi.from_buffer("double[]", poses)
    native.team.start_poses = buffer
    return native, [poses, buffer]


def scene_errors(config: Config) -> list[str]:
    """Return every reason, one line each, why the library refuses the world of ``config``; ``[]`` if it accepts it."""
    try:
        Scene(config)
    except InvalidArgument as error:
        return str(error).split("; ")
    return []


class Scene:
    """An immutable, validated world, ready for episodes; may be shared by threads.

    Args:
        config: The world; its other sections are not read.

    Raises:
        InvalidArgument: The library refuses the world; the message names every error, separated by ``"; "``.
    """

    def __init__(self, config: Config) -> None:
        ffi, lib = load()
        native, _buffers = _native_config(config)
        handle = ffi.new("swe_scene **")
        check(lib.swe_scene_create(handle, native))
        self._handle = ffi.gc(handle[0], lib.swe_scene_destroy)
        self.info = SceneInfo(
            robots=lib.swe_scene_robots(self._handle),
            control_steps=lib.swe_scene_control_steps(self._handle),
            control_period=config.episode.control_period,
        )


# ---- policies --------------------------------------------------------------------------------------------------------


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


def _native_policies(policies: NativePolicies) -> tuple[Any, list[Any]]:
    """Return a ``swe_policy[]`` and what must live as long as it."""
    if isinstance(policies, FeedForward):
        return _feedforward_handles(policies)
    return _compiled_handles(policies)


# ---- episodes --------------------------------------------------------------------------------------------------------


class _Buffers:
    """The arrays that a batch of episodes writes to."""

    def __init__(self, scene: Scene, n: int, channels: Collection[str]) -> None:
        ffi, lib = load()
        unknown = sorted(set(channels) - set(CHANNELS))
        if unknown:
            raise InvalidArgument(f"channels: expected some of {', '.join(CHANNELS)}; got {', '.join(unknown)}")
        robots, steps = scene.info.robots, scene.info.control_steps
        self.outcomes = ffi.new("swe_outcome[]", n)
        self.homing = np.empty((n, robots))
        self.telemetry = ffi.new("swe_telemetry *")
        lib.swe_telemetry_init(self.telemetry)
        self.channels: dict[str, FloatArray] = {}
        for name in channels:
            shape = [robots if axis == "robots" else int(axis) for axis in CHANNELS[name]]
            try:
                array = np.empty((n, steps, *shape))
            except MemoryError:
                gibibytes = n * steps * int(np.prod(shape)) * 8 / 2**30
                raise SimulatorError(
                    f"telemetry {name}: expected {gibibytes:.1f} GiB of memory for {n} episodes of {steps} control "
                    "steps, got less; use a shorter episode.horizon or a longer episode.control_period"
                ) from None
            channel = getattr(self.telemetry, name)
            channel.data, channel.length = ffi.from_buffer("double[]", array), array.size
            self.channels[name] = array

    def homing_pointer(self) -> Any:
        return load()[0].from_buffer("double[]", self.homing)

    def collect(self, scene: Scene, batch: Any) -> Episodes:
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
                **self.channels,
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


_NUMPY_FORMATS = {"int32_t": "i4", "uint32_t": "u4", "uint64_t": "u8", "double": "f8", "double[3]": "3f8"}


def _native_episodes(episodes: Sequence[EpisodeKey]) -> Any:
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


def _create_batch(scene: Scene, threads: int) -> Any:
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
    keys = _native_episodes(episodes)
    if robot_policies is None:
        robot_policies = np.repeat(np.arange(len(episodes), dtype=np.uint32)[:, None], scene.info.robots, axis=1)
    drivers = _native_indices(robot_policies, (len(episodes), scene.info.robots))
    native, _alive = _native_policies(policies)
    buffers = _Buffers(scene, len(episodes), channels)
    batch = _create_batch(scene, threads)
    check(
        lib.swe_batch_run(
            buffers.outcomes,
            buffers.homing_pointer(),
            buffers.telemetry,
            batch,
            keys,
            len(episodes),
            native,
            len(native),
            ffi.from_buffer("uint32_t[]", drivers),
        )
    )
    return buffers.collect(scene, batch)


def simulate_lockstep(
    scene: Scene,
    controller: PythonController,
    genomes: FloatArray,
    episodes: Sequence[EpisodeKey],
    channels: Collection[str] = (),
    threads: int = 1,
) -> Episodes:
    """Run episodes side by side, a control step at a time, with a controller written in Python.

    Args:
        scene: The world.
        controller: Sees all robots of all episodes at once.
        genomes: ``(len(episodes), robots, size)``: given to the controller.
        episodes: One key for each episode.
        channels: Telemetry to record: keys of ``CHANNELS``.
        threads: Worker threads, 1 to 1024.

    Raises:
        InvalidArgument: A size or channel is wrong, or the controller's commands have a wrong shape.
        SimulatorError: The library failed as a whole. An episode that fails alone has its ``status`` set instead.
    """
    ffi, lib = load()
    n, robots = len(episodes), scene.info.robots
    if genomes.shape[:2] != (n, robots):
        raise InvalidArgument(f"genomes: expected shape ({n}, {robots}, size), got {genomes.shape}")
    buffers = _Buffers(scene, n, channels)
    batch = _create_batch(scene, threads)
    check(lib.swe_lockstep_begin(batch, buffers.telemetry, _native_episodes(episodes), n))
    controller.start(genomes)
    for _ in range(scene.info.control_steps):
        observations = np.empty((n, robots, OBSERVATIONS))
        check(lib.swe_lockstep_observe(ffi.from_buffer("double[]", observations), observations.size, batch))
        commands = np.ascontiguousarray(controller.act(observations), dtype=np.float64)
        if commands.shape != (n, robots, COMMANDS):
            raise InvalidArgument(f"commands: expected shape {(n, robots, COMMANDS)}, got {commands.shape}")
        check(lib.swe_lockstep_advance(batch, ffi.from_buffer("double[]", commands), commands.size))
    check(lib.swe_lockstep_end(buffers.outcomes, buffers.homing_pointer(), batch))
    return buffers.collect(scene, batch)


# ---- the library -----------------------------------------------------------------------------------------------------


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


def selftest() -> None:
    """Provoke an assertion inside ODE and see that it arrives as an error instead of ending the process.

    Raises:
        SimulatorError: It did not arrive.
    """
    _, lib = load()
    if lib.swe_selftest_ode_error() != lib.SWE_PHYSICS_ERROR:
        raise SimulatorError("an assertion inside ODE was not caught; reinstall swarmevo")

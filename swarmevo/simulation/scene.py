# SPDX-License-Identifier: BSD-3-Clause
"""Scenes: a world as the library holds it, immutable and checked.

>>> from swarmevo.config import Config
>>> Scene(Config()).info.robots
5
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from swarmevo.config import LIGHT, Arena, Config, Section, Surroundings, Team, scene_info, surroundings
from swarmevo.errors import InvalidArgument
from swarmevo.protocols import FloatArray
from swarmevo.simulation._ffi import check, load
from swarmevo.simulation.layout import as_box, is_outside, obstacle_corners

_SECTIONS = ("robot", "team", "sensors", "noise", "physics", "episode")
"""Copied key by key."""
_OWN_CARE = {"start", "start_poses", "sensors"}
"""Copied on their own: rows of robots are resolved to poses first."""
_UNSET = {"channel": None, "rides_on": None}


def start_poses(team: Team, width: float) -> FloatArray:
    """Return the start poses ``(robots, 3)`` that a team's config names: x [m], y [m], heading [rad].

    ``row``: centred rows of as many robots as the arena's width [m] takes, from ``row_y`` on northwards, heading south.
    """
    if team.start == "poses":
        return np.array(team.start_poses, dtype=float).reshape(-1, 3)
    fitting = np.nan_to_num(width / team.row_spacing - 1 + 1e-9)  # half a spacing free at either wall
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


def _copy_arena(ffi: Any, lib: Any, native: Any, arena: Arena) -> None:
    _copy_section(ffi, lib, native, arena.model_copy(update={"shape": None, "size": None, "corners": None}))
    shape = "rectangle" if arena.shape == "square" else arena.shape
    native.shape = getattr(lib, f"SWE_ARENA_SHAPE_{shape}".upper())
    native.size = arena.sides if arena.shape == "rectangle" else (arena.size, arena.size)
    native.n_corners = len(arena.corners)
    for target, corner in zip(native.corners, arena.corners, strict=False):
        target[0:2] = corner


def _copy_scene(ffi: Any, lib: Any, native: Any, scene: Surroundings) -> None:
    """Copy the lists of what is in the arena."""

    def copy(target: Any, entries: Sequence[Section]) -> int:
        for struct, entry in zip(target, entries, strict=False):
            _copy_section(ffi, lib, struct, entry)
        return len(entries)

    native.n_movables = copy(native.movables, scene.movables or ())
    for struct, movable in zip(native.movables, scene.movables or (), strict=False):
        struct.start = lib.SWE_START_RANDOM if movable.start == "random" else lib.SWE_START_POSES
    native.n_obstacles = copy(native.obstacles, [as_box(obstacle) for obstacle in scene.obstacles])
    emitters = scene.emitters or ()
    native.n_emitters = copy(native.emitters, [emitter.model_copy(update=_UNSET) for emitter in emitters])
    for struct, emitter in zip(native.emitters, emitters, strict=False):
        is_light = emitter.channel == LIGHT
        struct.channel = lib.SWE_CHANNEL_LIGHT if is_light else scene.radio_channels.index(emitter.channel)
        struct.rides_on = lib.SWE_NOTHING if emitter.rides_on is None else emitter.rides_on
    native.ground.grey = scene.grey
    native.ground.n_patches = copy(native.ground.patches, scene.patches)
    native.n_goals = len(scene.goals or ())
    for struct, goal in zip(native.goals, scene.goals or (), strict=False):
        struct.kind = getattr(lib, f"SWE_GOAL_{goal.wall or 'region'}".upper())
        struct.region = goal.region or (0, 0, 0, 0)


def _native_config(config: Config) -> tuple[Any, list[Any]]:
    """Return a filled ``swe_scene_config *`` and the buffers that it points to."""
    ffi, lib = load()
    native = ffi.new("swe_scene_config *")
    lib.swe_scene_config_init(native)
    _copy_arena(ffi, lib, native.arena, config.arena)
    _copy_scene(ffi, lib, native, surroundings(config))
    for name in _SECTIONS:
        _copy_section(ffi, lib, getattr(native, name), getattr(config, name))
    native.robot.sensor_count = len(config.robot.sensors)
    for i, device in enumerate(config.robot.sensors):
        native.robot.sensors[i] = getattr(lib, f"SWE_SENSOR_{device}".upper())
    native.sensors.infrared_count = len(config.sensors.infrared_yaw_deg)
    native.sensors.infrared_curve_points = len(config.sensors.infrared_curve)
    native.sensors.touch_count = len(config.sensors.touch_yaw_deg)
    native.sensors.ground_count = len(config.sensors.ground_position)
    native.team.start = lib.SWE_START_RANDOM if config.team.start == "random" else lib.SWE_START_POSES

    west, east, *_ = config.arena.bounds
    poses = np.ascontiguousarray(start_poses(config.team, east - west))
    if config.team.start != "random" and len(poses) != config.team.robots:
        raise InvalidArgument(
            f"team.start_poses: expected one pose for each of {config.team.robots} robots, got {len(poses)}"
        )
    buffer = ffi.from_buffer("double[]", poses)
    native.team.start_poses = buffer
    return native, [poses, buffer]


def _in_words_of(config: Config, line: str) -> str:
    """Return an error of the library with the keys that the config has: those of lists are in ``scene``."""
    scene = config.scene
    if config.arena.shape == "rectangle":
        line = line.replace("arena.size[", "arena.sides[")
    else:
        line = re.sub(r"arena\.size\[\d\]", "arena.size", line)
    if scene.movables is None:
        line = line.replace("movables[0].friction", "physics.box_friction").replace("movables[0]", "box")
    if scene.emitters is None:
        line = line.replace("emitters[0]", "emitter")
    for i, obstacle in enumerate(scene.obstacles):
        if obstacle.shape == "wall":  # the library knows it as a box
            line = line.replace(f"obstacles[{i}].size[0]:", f"obstacles[{i}].ends: their distance:")
            line = line.replace(f"obstacles[{i}].size[1]", f"obstacles[{i}].thickness")
    return re.sub(r"\b(movables|obstacles|emitters|goals)\[", r"scene.\1[", line).replace("ground.", "scene.")


def _out_of_reach(config: Config) -> list[str]:
    """Return which obstacles and goals nobody can ever meet, one line each."""
    scene, where = surroundings(config), {}
    for i, obstacle in enumerate(scene.obstacles):
        where[f"obstacles[{i}].{'ends' if obstacle.shape == 'wall' else 'pose'}"] = obstacle_corners(obstacle)
    for i, goal in enumerate(scene.goals or ()):
        if goal.region is not None:
            west, east, south, north = goal.region
            where[f"goals[{i}].region"] = np.array([(west, south), (east, south), (east, north), (west, north)])
    return [
        f"scene.{key}: expected it in the arena, a part at least, got it beyond a wall"
        for key, corners in where.items()
        if is_outside(config.arena, corners)
    ]


def scene_errors(config: Config) -> list[str]:
    """Return every reason, one line each, why the library refuses the world of ``config``; ``[]`` if it accepts it."""
    try:
        Scene(config)
    except InvalidArgument as error:
        return list(error.errors)
    return []


class Scene:
    """An immutable, validated world, ready for episodes; may be shared by threads, and pickles as its config.

    Args:
        config: The world; its other sections are not read.

    Raises:
        InvalidArgument: The library refuses the world; the message names every error, separated by ``"; "``.
    """

    def __init__(self, config: Config) -> None:
        ffi, lib = load()
        self._config = config
        native, _buffers = _native_config(config)
        handle = ffi.new("swe_scene **")
        try:
            check(lib.swe_scene_create(handle, native))
        except InvalidArgument as error:
            raise InvalidArgument(*dict.fromkeys(_in_words_of(config, line) for line in error.errors)) from None
        self._handle = ffi.gc(handle[0], lib.swe_scene_destroy)
        if beyond := _out_of_reach(config):
            raise InvalidArgument(*beyond)
        self.info = scene_info(config)

    @property
    def ends_with_push(self) -> bool:
        """Whether an episode ends when the box touches the target wall."""
        return self._config.episode.until == "push"

    def __reduce__(self) -> tuple[type[Scene], tuple[Config]]:
        return type(self), (self._config,)

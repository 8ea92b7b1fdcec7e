# SPDX-License-Identifier: BSD-3-Clause
"""Scenes: a world as the library holds it, immutable and checked.

>>> from swarmevo.config import Config
>>> Scene(Config()).info.robots
5
"""

from __future__ import annotations

from typing import Any

import numpy as np

from swarmevo.config import WORLD, Config, Team, scene_info
from swarmevo.errors import InvalidArgument
from swarmevo.protocols import FloatArray
from swarmevo.simulation._ffi import check, load

_OWN_CARE = {"start", "start_poses", "sensors"}  # copied by _native_config: rows of robots are resolved to poses first


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
    for name in WORLD:
        _copy_section(ffi, lib, getattr(native, name), getattr(config, name))
    native.robot.sensor_count = len(config.robot.sensors)
    for i, device in enumerate(config.robot.sensors):
        native.robot.sensors[i] = getattr(lib, f"SWE_SENSOR_{device}".upper())
    native.sensors.infrared_count = len(config.sensors.infrared_yaw_deg)
    native.sensors.infrared_curve_points = len(config.sensors.infrared_curve)
    native.sensors.touch_count = len(config.sensors.touch_yaw_deg)
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
        check(lib.swe_scene_create(handle, native))
        self._handle = ffi.gc(handle[0], lib.swe_scene_destroy)
        self.info = scene_info(config)

    @property
    def ends_with_push(self) -> bool:
        """Whether an episode ends when the box touches the target wall."""
        return self._config.episode.until == "push"

    def __reduce__(self) -> tuple[type[Scene], tuple[Config]]:
        return type(self), (self._config,)

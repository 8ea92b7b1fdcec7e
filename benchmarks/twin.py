# SPDX-License-Identifier: BSD-3-Clause
"""The world of a configuration in the reference simulator."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.reference import Movable, Obstacle, Planar, Surroundings
from swarmevo.config import Config, models
from swarmevo.protocols import FloatArray

REFERENCE_STEP = 1e-5
"""Of the reference [s]."""


def twin(
    config: Config,
    poses: Sequence[Sequence[float]] | FloatArray | None = None,
    shift_loads: bool = False,
    time_step: float = REFERENCE_STEP,
    **own_parameters: float,
) -> Planar:
    """Return the reference's world with the parameters of a config.

    Args:
        config: The world.
        poses: Of the robots ``(n, 3)``: x [m], y [m], heading [rad]; None: ``team.start_poses``.
        shift_loads: Whether what pushes the box's sides shifts load between its feet.
        time_step: [s]
        own_parameters: Those of the reference that no config has, such as the stiffness of the feet, and others to
            take instead of the config's.
    """
    robot, physics = config.robot, config.physics
    parameters: dict[str, Any] = {
        "robot_mass": robot.mass,
        "robot_radius": robot.radius,
        "axle": robot.axle_length,
        "wheel_radius": robot.wheel_radius,
        "wheel_top_speed": robot.top_speed,
        "mu_wheel": physics.wheel_friction,
        "mass_height": robot.centre_of_mass,
        "caster_offset": robot.caster_offset,
        "mu_side": physics.side_friction,
        "bumper_stiffness": robot.bumper_stiffness,
        "bumper_damping": robot.bumper_damping,
        "bumper_travel": robot.bumper_travel,
    }
    return Planar(
        config.team.start_poses if poses is None else poses,
        surroundings_of(config),
        bumper=robot.bumper,
        shift_loads=shift_loads,
        time_step=time_step,
        **{**parameters, **own_parameters},
    )


def surroundings_of(config: Config) -> Surroundings:
    """Return all but robots; what is drawn at random is not built here.

    A wall is a rectangle from one end to the other (docs/scenes.md).
    """
    movables = config.scene.movables if config.scene.movables is not None else (config.box,)
    return Surroundings(
        [
            Movable(
                m.shape,
                m.size[:2],
                m.mass,
                config.physics.box_friction if m.friction is None else m.friction,
                m.pose,
                m.velocity,
                m.feet,
                m.size[2] / 2,
            )
            for m in movables
        ],
        [_obstacle(one) for one in config.scene.obstacles],
        arena_of(config),
    )


def _obstacle(one: models.Obstacle) -> Obstacle:
    if one.shape != "wall":
        return Obstacle(one.shape, one.size[:2], one.pose)
    start, end = np.array(one.ends)
    along, middle = end - start, (start + end) / 2
    heading = float(np.arctan2(along[1], along[0]))
    return Obstacle("box", (float(np.hypot(*along)), one.thickness), (*middle.tolist(), heading))


def arena_of(config: Config) -> float | list[tuple[float, float]]:
    """Return the radius of a round arena, or the corners of another, anticlockwise [m]."""
    arena = config.arena
    if arena.shape == "circle":
        return arena.size / 2
    if arena.shape == "polygon":
        return list(arena.corners)
    west, east, south, north = arena.bounds
    return [(west, south), (east, south), (east, north), (west, north)]

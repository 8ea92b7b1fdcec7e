# SPDX-License-Identifier: BSD-3-Clause
"""The world of a configuration in the reference simulator."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.reference import Planar
from swarmevo.config import Config
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
    parameters = {
        "arena_size": config.arena.size,
        "robot_mass": robot.mass,
        "robot_radius": robot.radius,
        "axle": robot.axle_length,
        "wheel_radius": robot.wheel_radius,
        "wheel_top_speed": robot.top_speed,
        "mu_wheel": physics.wheel_friction,
        "mass_height": robot.centre_of_mass,
        "caster_offset": robot.caster_offset,
        "box_mass": config.box.mass,
        "box_length": config.box.size[0],
        "box_width": config.box.size[1],
        "mu_box": physics.box_friction,
        "push_height": config.box.size[2] / 2,
        "mu_side": physics.side_friction,
        "bumper_stiffness": robot.bumper_stiffness,
        "bumper_damping": robot.bumper_damping,
        "bumper_travel": robot.bumper_travel,
    }
    return Planar(
        config.team.start_poses if poses is None else poses,
        box=config.box.pose,
        box_velocity=config.box.velocity,
        bumper=robot.bumper,
        shift_loads=shift_loads,
        time_step=time_step,
        **{**parameters, **own_parameters},
    )

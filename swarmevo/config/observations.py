# SPDX-License-Identifier: BSD-3-Clause
"""What a plugin may know about the scene of a configuration: the numbers that a robot observes, and their names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from swarmevo.config.models import Config, Sensors, surroundings, world
from swarmevo.protocols import WHEELS, SceneInfo


def _numbered(name: str, n: int) -> tuple[str, ...]:
    return tuple(f"{name}_{i}" for i in range(n))


READINGS: Final[Mapping[str, Callable[[Sensors], tuple[str, ...]]]] = {
    "infrared": lambda sensors: _numbered("infrared", len(sensors.infrared_yaw_deg)),
    "touch": lambda sensors: _numbered("touch", len(sensors.touch_yaw_deg)),
    "rf": lambda sensors: ("rf",),
}
"""For each device the names of its readings, in their order; ``native/src/sensors/`` has the devices themselves."""


def scene_info(config: Config) -> SceneInfo:
    """Return what a plugin may know about the scene of ``config``."""
    episode, sensors = config.episode, config.sensors
    return SceneInfo(
        robots=config.team.robots,
        control_steps=round(episode.horizon / episode.control_period),
        control_period=episode.control_period,
        observation_names=tuple(name for device in config.robot.sensors for name in READINGS[device](sensors)),
        command_names=WHEELS,
        infrared=len(sensors.infrared_yaw_deg),
        touch=len(sensors.touch_yaw_deg),
        movables=len(surroundings(config).movables or ()),
        world=world(config),
    )

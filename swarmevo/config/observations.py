# SPDX-License-Identifier: BSD-3-Clause
"""What a plugin may know about the scene of a configuration: the numbers that a robot observes, and their names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from swarmevo.config.models import Config, surroundings, world
from swarmevo.protocols import WHEELS, SceneInfo


def _numbered(name: str, n: int) -> tuple[str, ...]:
    return tuple(f"{name}_{i}" for i in range(n))


def _by_channel(name: str, config: Config) -> tuple[str, ...]:
    """Return a name for each channel of RF signals; the first is that of a world with one channel, or with none."""
    return (name, *(f"{name}_{channel}" for channel in surroundings(config).radio_channels[1:]))


READINGS: Final[Mapping[str, Callable[[Config], tuple[str, ...]]]] = {
    "infrared": lambda config: _numbered("infrared", len(config.sensors.infrared_yaw_deg)),
    "touch": lambda config: _numbered("touch", len(config.sensors.touch_yaw_deg)),
    "rf": lambda config: _by_channel("rf", config),
    "rf_bearing": lambda config: tuple(
        f"{name}_{part}" for name in _by_channel("rf_bearing", config) for part in ("cos", "sin")
    ),
    "range_and_bearing": lambda config: tuple(
        name
        for sector in _numbered("range_and_bearing", config.sensors.range_and_bearing_sectors)
        for name in (sector, *_numbered(f"{sector}_message", config.sensors.range_and_bearing_message))
    ),
    "ground": lambda config: _numbered("ground", len(config.sensors.ground_position)),
    "light": lambda config: _numbered("light", config.sensors.light_sectors),
    "odometry": lambda _config: ("odometry_left", "odometry_right"),
    "movable_motion": lambda _config: ("movable_motion_ahead", "movable_motion_left", "movable_motion_spin"),
}
"""For each device the names of its readings, in their order; ``native/src/sensors/`` has the devices themselves."""
SIGNED: Final = frozenset({"rf_bearing", "odometry", "movable_motion"})
"""Devices whose readings are in [-1, 1]; those of all others are in [0, 1]."""


def scene_info(config: Config) -> SceneInfo:
    """Return what a plugin may know about the scene of ``config``."""
    episode, sensors = config.episode, config.sensors
    bits = sensors.range_and_bearing_message if "range_and_bearing" in config.robot.sensors else 0
    return SceneInfo(
        robots=config.team.robots,
        control_steps=round(episode.horizon / episode.control_period),
        control_period=episode.control_period,
        observation_names=tuple(name for device in config.robot.sensors for name in READINGS[device](config)),
        command_names=(*WHEELS, *_numbered("message", bits)),
        infrared=len(sensors.infrared_yaw_deg),
        touch=len(sensors.touch_yaw_deg),
        movables=len(surroundings(config).movables or ()),
        arena=config.arena.bounds,
        world=world(config),
    )


def smallest_observation(config: Config) -> tuple[float, ...]:
    """Return for each reading of an observation the smallest it can be, 0 or -1; the largest is 1."""
    devices = config.robot.sensors
    return tuple(-1.0 if device in SIGNED else 0.0 for device in devices for _ in READINGS[device](config))


def sense_errors(made_for: Config, config: Config) -> list[str]:
    """Return why a controller that was made for one world cannot act in another, one line; ``[]``: it can."""
    theirs, ours = scene_info(made_for), scene_info(config)
    if theirs.observation_names == ours.observation_names and theirs.command_names == ours.command_names:
        return []
    return [
        f"robot.sensors: expected the observations and commands that the controller was made for, "
        f"{_counted(theirs)} of {_listed(made_for)}; got {_counted(ours)} of {_listed(config)}"
    ]


def _counted(info: SceneInfo) -> str:
    return f"{info.observations} and {info.commands}"


def _listed(config: Config) -> str:
    return ", ".join(config.robot.sensors) or "no sensors"

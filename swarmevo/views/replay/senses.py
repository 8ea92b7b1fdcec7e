# SPDX-License-Identifier: BSD-3-Clause
"""What robots sense, as the player draws it: a glyph for each device of ``robot.sensors`` beside the scene."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Final

from swarmevo.config import Config, scene_info, surroundings
from swarmevo.config.observations import READINGS
from swarmevo.simulation import layout
from swarmevo.views import text

_INFRARED_HALF: Final = math.radians(10)  # as wide as a ray is drawn, at most


def senses(config: Config) -> list[dict[str, Any]]:
    """Return each device of a robot, in the order of an observation, and the message that it sends.

    A receiver of several channels is one for each. Each has ``device``, ``name``, ``first`` and ``count`` of its
    readings in an observation, and a ``glyph``: a ``rose`` of wedges at ``yaw`` and ``half`` as wide [rad], one for
    every ``stride`` readings, a ``level`` from ``least`` to ``most``, a ``needle`` (cosine, sine), ``greys``, signed
    ``bars``, or ``bits``, which are no readings, but what the robot sends.
    """
    found, first = [], 0
    for device in config.robot.sensors:
        looks = list(_LOOKS[device](config))
        count = len(READINGS[device](config)) // len(looks)
        for look in looks:
            found.append({"device": device, "first": first, "count": count, **look})
            first += count
    if bits := scene_info(config).message:
        found.append({"device": "message", "name": "sends", "first": 0, "count": bits, "glyph": "bits"})
    return found


def _touch(config: Config) -> dict[str, Any]:
    sensors = config.sensors
    return _rose("touch", sensors.touch_yaw_deg, math.radians(sensors.touch_half_width_deg))


def _infrared(config: Config) -> dict[str, Any]:
    yaw = sorted(bearing % 360 for bearing in config.sensors.infrared_yaw_deg)
    apart = min((b - a for a, b in zip(yaw, [*yaw[1:], yaw[0] + 360], strict=True) if b > a), default=360.0)
    look = _rose("infrared", config.sensors.infrared_yaw_deg, min(_INFRARED_HALF, math.radians(apart / 2)))
    (_, largest), *_ = curve = config.sensors.infrared_curve
    return {**look, "curve": [(distance, round(value / largest, 5)) for distance, value in curve]}


def _rose(name: str, yaw_deg: tuple[float, ...], half: float, stride: int = 1) -> dict[str, Any]:
    yaw = [round(math.radians(bearing), 4) for bearing in yaw_deg]
    return {"name": name, "glyph": "rose", "yaw": yaw, "half": round(half, 4), "stride": stride}


def _sectors(name: str, n: int, stride: int = 1) -> dict[str, Any]:
    return _rose(name, tuple(360 * k / n for k in range(n)), math.pi / n, stride)


def _range_and_bearing(config: Config) -> dict[str, Any]:
    sensors = config.sensors
    stride = 1 + sensors.range_and_bearing_message
    look = _sectors("range and bearing", sensors.range_and_bearing_sectors, stride)
    return {**look, "range": sensors.range_and_bearing_range}


def _channels(name: str, config: Config) -> list[str]:
    """Return what a receiver's readings of each channel are called."""
    return [name, *(f"{name} {text.words(channel)}" for channel in surroundings(config).radio_channels[1:])]


def _rf(config: Config) -> Iterator[dict[str, Any]]:
    scene = surroundings(config)
    for channel, name in enumerate(_channels("RF", config)):
        scale = layout.signal_scale(scene, channel)
        least, most = (strength / scale for strength in layout.signal_range(scene, channel))
        yield {"name": name, "glyph": "level", "least": least, "most": most}


_LOOKS: Final[Mapping[str, Callable[[Config], Iterable[dict[str, Any]]]]] = {
    "infrared": lambda config: [_infrared(config)],
    "touch": lambda config: [_touch(config)],
    "rf": _rf,
    "rf_bearing": lambda config: [{"name": name, "glyph": "needle"} for name in _channels("RF bearing", config)],
    "range_and_bearing": lambda config: [_range_and_bearing(config)],
    "ground": lambda _config: [{"name": "ground", "glyph": "greys"}],
    "light": lambda config: [_sectors("light", config.sensors.light_sectors)],
    "odometry": lambda _config: [{"name": "odometry", "glyph": "bars"}],
    "movable_motion": lambda _config: [{"name": "movable motion", "glyph": "bars"}],
}
"""How each device is drawn; a receiver once for each channel."""

# SPDX-License-Identifier: BSD-3-Clause
"""The part of a Webots controller around the network: devices are read into an observation, commands drive the motors.

Each device is a template of its own, with functions ``enable_...``, ``hear_...`` if it listens, and ``sense_...``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from swarmevo.config import LIGHT, Config, scene_info, surroundings
from swarmevo.errors import ExportError
from swarmevo.runs.networks import literal, template
from swarmevo.runs.webots.robot import GROUND_FULL
from swarmevo.runs.webots.tables import EPUCK, Infrared
from swarmevo.simulation import layout

_PARTS: Final[Mapping[str, Sequence[str]]] = {
    "infrared": ("infrared",),
    "touch": ("touch",),
    "rf": ("radio", "sources", "signals", "rf"),
    "rf_bearing": ("radio", "sources", "signals", "rf_bearing"),
    "range_and_bearing": ("radio", "sectors", "range_and_bearing"),
    "ground": ("ground",),
    "light": ("radio", "sources", "sectors", "light"),
    "odometry": ("odometry",),
}
"""For each device that Webots has, the templates that it is made of, in their order."""
_ENABLING: Final = {
    **{part: f"enable_{part}(step)" for part in ("infrared", "touch", "ground", "odometry", "signals", "light")},
    "range_and_bearing": "enable_range_and_bearing(step, argc > 1 ? atoi(argv[1]) : 0)",
}
_HEARING: Final = {"signals": "hear_signals", "light": "hear_light", "range_and_bearing": "hear_messages"}


def errors(config: Config) -> list[str]:
    """Return what Webots cannot sense, one line each."""
    found = [
        f"robot.sensors: expected devices that Webots has, {', '.join(_PARTS)}, got {device}; write the controller as "
        "JSON, or with --as epuck as C that is given observations"
        for device in config.robot.sensors
        if device not in _PARTS
    ]
    if "touch" in config.robot.sensors and config.sensors.touch_mode != "binary":
        found.append(
            "sensors.touch_mode: expected binary for Webots, whose bumpers tell touch alone, got "
            f"{config.sensors.touch_mode}"
        )
    return found


def source(config: Config, infrared: Infrared) -> str:
    """Return the C that follows ``swarmevo_controller``.

    Args:
        config: Of the run.
        infrared: Which lookup table the world's infrared sensors have.

    Raises:
        ExportError: Webots cannot sense what the robot senses.
    """
    if found := errors(config):
        raise ExportError(*found)
    devices = config.robot.sensors
    parts = list(dict.fromkeys(part for device in devices for part in _PARTS[device]))
    if infrared != "evolved" and "infrared" in parts:
        parts.insert(parts.index("infrared"), "infrared_table")
    values = _values(config, infrared)
    body = {
        "devices": "".join(template(f"webots/{part}").substitute(values) for part in parts),
        "enable": "".join(f"    {_ENABLING[part]};\n" for part in parts if part in _ENABLING),
        "hear": "".join(f"        {_HEARING[part]}();\n" for part in parts if part in _HEARING),
        "send": "        send_message(command);\n" if "range_and_bearing" in devices else "",
        "sense": "".join(f"        next = sense_{device}(next);\n" for device in devices),
    }
    return template("webots/main").substitute(body)


def _values(config: Config, infrared: Infrared) -> dict[str, str]:
    info, sensors, scene = scene_info(config), config.sensors, surroundings(config)
    emitters = scene.emitters or ()
    scales = [layout.signal_scale(scene, i) for i in range(max(1, len(scene.radio_channels)))]
    bits = info.commands - 2
    return {
        "infrared": str(info.infrared),
        "reading": f"limited(value / {literal(sensors.infrared_curve[0][1])}, 0.0, 1.0)"
        if infrared == "evolved"
        else "infrared_reading(infrared_distance(value))",
        **_tables(config, infrared),
        "touch": str(info.touch),
        "ground": str(len(sensors.ground_position)),
        "ground_full": literal(GROUND_FULL),
        "packet": str(1 + bits),
        "sources": str(len(emitters)),
        "channels": str(len(scales)),
        "signal_most": ", ".join(map(literal, scales)),
        "source_rows": "".join(
            f"    {{{-1 if one.channel == LIGHT else scene.radio_channels.index(one.channel)}, "
            f"{literal(one.strength[0])}, {literal(one.strength[1])}}},\n"
            for one in emitters
        ),
        "light_sectors": str(sensors.light_sectors),
        "robots": str(info.robots),
        "sectors": str(sensors.range_and_bearing_sectors),
        "bits": str(bits),
        "range": literal(sensors.range_and_bearing_range),
    }


def _tables(config: Config, infrared: Infrared) -> dict[str, str]:
    returned, evolved = EPUCK.get(infrared, ()), config.sensors.infrared_curve
    return {
        "points": str(len(returned)),
        "returned": "".join(f"    {{{literal(x)}, {literal(value)}}},\n" for x, value, _ in returned),
        "evolved_points": str(len(evolved)),
        "evolved": "".join(f"    {{{literal(x)}, {literal(value)}}},\n" for x, value in evolved),
    }

# SPDX-License-Identifier: BSD-3-Clause
"""Robots by name: what differs from the default robot, the paper's e-puck. Sources of each number: ``docs/robots.md``.

A preset stands in for defaults: a key that a configuration names wins over it. What a robot needs to run at all, such
as a shorter time step for a fast one, is part of its preset.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from pydantic import BaseModel

Preset = Mapping[str, Mapping[str, Any]]
Plain = Callable[[Any], Any]

PRESETS: Final[Mapping[str, Preset]] = {
    "epuck": {},
    "epuck_real": {"robot": {"mass": 0.15}},
    "khepera_iv": {
        "robot": {
            "radius": 0.0704,
            "height": 0.0577,
            "mass": 0.566,
            "centre_of_mass": 0.02,
            "wheel_radius": 0.021,
            "axle_length": 0.1054,
            "top_speed": 38.1,
            "motor_torque": 0.12,
            "caster_offset": 0.05,
            "bumper": "rigid",
        },
        "sensors": {
            "infrared_yaw_deg": [0.0, 45.0, 90.0, 135.0, 180.0, -135.0, -90.0, -45.0],
            "infrared_curve": [
                [0.0, 1023.0],
                [0.01, 1010.0],
                [0.02, 1000.0],
                [0.03, 990.0],
                [0.04, 800.0],
                [0.05, 500.0],
                [0.06, 400.0],
                [0.07, 350.0],
                [0.08, 280.0],
                [0.09, 250.0],
                [0.1, 220.0],
                [0.15, 180.0],
                [0.2, 120.0],
                [0.25, 0.0],
            ],
        },
        "physics": {"time_step": 0.025},
        "team": {"row_spacing": 0.18},
    },
    "thymio_ii": {
        "robot": {
            "radius": 0.056,
            "height": 0.053,
            "mass": 0.27,
            "centre_of_mass": 0.02,
            "wheel_radius": 0.022,
            "axle_length": 0.094,
            "top_speed": 6.36,
            "motor_torque": 0.06,
            "caster_offset": 0.05,
            "bumper": "rigid",
        },
        "sensors": {
            "infrared_yaw_deg": [40.0, 20.0, 0.0, -20.0, -40.0, -148.0, 148.0],
            "infrared_curve": [
                [0.0, 4235.0],
                [0.02, 4139.0],
                [0.03, 3515.0],
                [0.04, 2965.0],
                [0.05, 2570.0],
                [0.06, 2248.0],
                [0.07, 1941.0],
                [0.08, 1597.0],
                [0.09, 1195.0],
                [0.0933, 0.0],
            ],
            "ground_position": [[0.072, 0.012], [0.072, -0.012]],
        },
        "team": {"row_spacing": 0.15},
    },
}
"""By name, for each section of the configuration the keys that differ from their defaults."""
_DEFAULT: Final = "epuck"


def filled(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return a configuration's data with what its preset says of keys that it does not name."""
    preset = _of(data)
    found = dict(data)
    for section, values in preset.items():
        if (named := _named(data.get(section))) is not None:
            found[section] = {**values, **named}
    return found


def stripped(data: Mapping[str, Any], defaults: Mapping[str, Mapping[str, Any]], plain: Plain) -> dict[str, Any]:
    """Return a configuration's data without the keys that are as its preset has them, so that another may stand in.

    Args:
        data: As it is written.
        defaults: Of each section the keys and their defaults.
        plain: Makes plain data of what is written.
    """
    found, preset = dict(data), _of(data, plain)
    for section in sorted({section for other in PRESETS.values() for section in other}):
        if isinstance(named := data.get(section), Mapping):
            own = {**defaults[section], **preset.get(section, {})}
            theirs = {key for other in PRESETS.values() for key in other.get(section, {})}
            found[section] = {
                key: value for key, value in named.items() if key not in theirs or plain(value) != own[key]
            }
    return found


def _of(data: Mapping[str, Any], plain: Plain = lambda value: value) -> Preset:
    named = _named(data.get("robot")) or {}
    name = plain(named.get("preset", _DEFAULT))
    return PRESETS.get(name, {}) if isinstance(name, str) else {}


def _named(section: Any) -> Mapping[str, Any] | None:
    """Return the keys that a section names; None: it is none."""
    if section is None:
        return {}
    if isinstance(section, BaseModel):
        return {key: getattr(section, key) for key in section.model_fields_set}
    return section if isinstance(section, Mapping) else None

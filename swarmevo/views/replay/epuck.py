# SPDX-License-Identifier: BSD-3-Clause
"""An E-puck as meshes: body, wheels, bumper, and what lights up when it senses something."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from meshcat import transformations as tf
from meshcat.geometry import Box

from swarmevo.config import Robot, Sensors
from swarmevo.views.replay import shapes
from swarmevo.views.replay.shapes import Part

BUMPER: Final = "#7d8891"
_BODY, _CIRCUIT, _CAP, _TYRE, _HUB = "#2fae6b", "#1d6b45", "#f5f6f2", "#22272b", "#d9dee2"
_TOUCH: Final = "#ffb000"
_HALOS: Final = {"rf": shapes.SIGNAL, "light": shapes.LIGHT}
_WHEEL_WIDTH: Final = 0.06  # of the axle's length
_BUMPER_HEIGHT: Final = 0.3  # of the box's height: a band half-way up, where bumper and box meet


def parts(path: str, robot: Robot, sensors: Sensors, colour: str, number: str) -> list[Part]:
    """Return an E-puck: a clear green body with gaps for the wheels, the circuit board on it, a cap with its number."""
    r, deck = _hard_radius(robot), max(0.7 * robot.height, 2.05 * robot.wheel_radius)
    top = max(robot.height, deck + 0.1 * r)
    core = 0.5 * robot.axle_length * (1 - 1.6 * _WHEEL_WIDTH)
    gap = min(math.atan2(robot.wheel_radius, robot.axle_length / 2) + 0.12, 1.2)  # [rad] at either side, for a wheel
    return [
        Part(
            f"{path}/core",
            shapes.cylinder(core, 0.9 * deck),
            shapes.glossy(shapes.CORE),
            shapes.at(z=0.55 * deck) @ shapes.UPRIGHT,
        ),
        *_body(path, r, deck, gap),
        Part(
            f"{path}/board", shapes.cylinder(r, 0.05 * r), shapes.glossy(_CIRCUIT), shapes.at(z=deck) @ shapes.UPRIGHT
        ),
        Part(
            f"{path}/ring",
            shapes.Shape("TorusGeometry", radius=0.9 * r, tube=0.07 * r, radialSegments=10, tubularSegments=48),
            shapes.glossy(colour),
            shapes.at(z=deck + 0.03 * r),
        ),
        Part(
            f"{path}/cap",
            shapes.cylinder(0.66 * r, top - deck, 0.62 * r),
            shapes.glossy(_CAP),
            shapes.at(z=(top + deck) / 2) @ shapes.UPRIGHT,
        ),
        *_marks(path, r, top, colour, number),
        *_wheels(path, robot),
        *_senses(path, robot, deck, sensors),
    ]


def _body(path: str, r: float, deck: float, gap: float) -> Iterator[Part]:
    """Yield the clear body's front and rear; between them is a gap [rad] for each wheel."""
    for name, yaw in (("front", 0.0), ("rear", math.pi)):
        pipe = shapes.tube(0.84 * r, r, 0.12 * deck, deck, yaw, math.pi / 2 - gap)
        clear = shapes.glossy(_BODY, 0.72, shininess=90, specular=0x666666)
        yield Part(f"{path}/{name}", pipe, clear, shapes.UPRIGHT)


def _marks(path: str, r: float, top: float, colour: str, number: str) -> Iterator[Part]:
    """Yield what lies on the cap: a triangle that points forward and the robot's number."""
    triangle = shapes.Shape("CircleGeometry", radius=0.3 * r, segments=3)
    yield Part(f"{path}/nose", triangle, shapes.flat(colour), shapes.at(x=0.36 * r, z=top + 0.0004), shadow=False)
    square = shapes.Shape("PlaneGeometry", width=1.0 * r, height=1.0 * r)
    written = shapes.flat("#ffffff", map=shapes.Text(number))
    place = shapes.at(x=-0.17 * r, z=top + 0.0006) @ tf.rotation_matrix(-math.pi / 2, [0, 0, 1])
    yield Part(f"{path}/number", square, written, place, shadow=False)


def _hard_radius(robot: Robot) -> float:
    """Return the radius of what does not give way [m]."""
    return robot.radius - (robot.bumper_travel if robot.bumper == "sprung" else 0)


def bumper(path: str, robot: Robot, box_height: float) -> Part:
    """Return the sprung bumper at rest. Pressed in, it sinks into what it meets, up to the body at most."""
    height = min(box_height, robot.height)
    low, high = (1 - _BUMPER_HEIGHT) * height / 2, (1 + _BUMPER_HEIGHT) * height / 2
    band = shapes.tube(_hard_radius(robot), robot.radius, low, high, 0.0, math.pi)
    return Part(f"{path}/bumper", band, shapes.glossy(BUMPER, shininess=8), shapes.UPRIGHT)


def _wheels(path: str, robot: Robot) -> Iterator[Part]:
    """Yield tyres and hubs in the frames of their axles, which the player turns."""
    r, width = robot.wheel_radius, _WHEEL_WIDTH * robot.axle_length
    for name, side in (("left", 1), ("right", -1)):
        outside = side * width / 2
        yield Part(f"{path}/{name}/tyre", shapes.cylinder(r, width), shapes.glossy(_TYRE, shininess=10), shapes.at())
        yield Part(f"{path}/{name}/hub", shapes.cylinder(0.62 * r, 0.0006), shapes.glossy(_HUB), shapes.at(y=outside))
        for spoke in range(2):
            bar = Box([1.16 * r, 0.0004, 0.16 * r])
            turn = tf.rotation_matrix(spoke * math.pi / 2, [0, 1, 0])
            place = shapes.at(y=outside + side * 0.0004) @ turn
            yield Part(f"{path}/{name}/spoke{spoke}", bar, shapes.glossy(shapes.CORE), place)


def _senses(path: str, robot: Robot, deck: float, sensors: Sensors) -> Iterator[Part]:
    """Yield what lights up: arcs for touch, above what is touched, and a halo on the floor for the signal or light."""
    r = robot.radius
    if "touch" in robot.sensors:
        shown = max(0.86 * math.radians(sensors.touch_half_width_deg), 0.02)  # a gap between neighbours
        for number, yaw in enumerate(sensors.touch_yaw_deg):
            arc, look = shapes.sector(1.08 * r, 1.42 * r, math.radians(yaw), shown), shapes.flat(_TOUCH, 0.95)
            yield Part(f"{path}/touch/{number}", arc, look, shapes.at(z=deck + 0.004), shadow=False)
    for device in ("rf", "light"):
        if device in robot.sensors:
            halo, look = shapes.sector(1.12 * r, 1.6 * r, 0, math.pi), shapes.flat(_HALOS[device], 0.5)
            floor = shapes.at(z=shapes.FLOOR_LAYERS["halo"])
            yield Part(f"{path}/halo/{device}", halo, look, floor, shadow=False)

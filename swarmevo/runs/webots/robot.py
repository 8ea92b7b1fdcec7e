# SPDX-License-Identifier: BSD-3-Clause
"""A robot as a Webots node, with the E-puck's device names.

Its body, wheels, masses and rays are those of the configuration; devices that the E-puck has are called as in its PROTO
(https://github.com/cyberbotics/webots, projects/robots/gctronic/e-puck/protos/E-puck.proto, R2022a): motors and sensors
of the wheels, ``ps0`` and on, ``gs0`` and on, ``emitter``, ``receiver``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

from swarmevo.config import Config
from swarmevo.runs.webots.tables import Infrared, table
from swarmevo.runs.webots.vrml import Node, node

CHANNEL: Final = {"source": 1, "range_and_bearing": 2, "light": 3}
"""Of Webots' radio, for what is sent."""
GROUND_FULL: Final = 1000.0
"""What a ground sensor returns above white, as that of Webots' E-puck."""
_GROUND_HEIGHT: Final = 0.002
"""Of the ground sensors [m]: below all else, for infra-red rays meet their own robot."""
_GROUND_POINTS: Final = 32
_WHEEL_SHARE: Final = 0.06
"""Of the robot's mass in each wheel, as in ``native/src/epuck.hpp``."""
_CASTER: Final = 0.003
"""Radius of the casters [m]."""
_INWARDS: Final = 0.001
"""From the body's rim to the touch sensors, so that those of two robots do not meet [m]."""
_ARC: Final = math.radians(12)
"""Of a bumper's sector that one flat piece covers."""


def primitive(shape: str, size: Sequence[float]) -> Node:
    """Return a box, or a cylinder whose diameter is its length."""
    length, width, height = size
    if shape == "cylinder":
        return node("Cylinder", radius=length / 2, height=height)
    return node("Box", size=(length, width, height))


def look(geometry: Node, colour: tuple[float, float, float], transparency: float = 0.0) -> Node:
    """Return a geometry in a colour."""
    paint = node("PBRAppearance", baseColor=colour, roughness=0.6, metalness=0.0, transparency=transparency)
    return node("Shape", appearance=paint, geometry=geometry)


def body(
    config: Config,
    number: int,
    pose: Sequence[float],
    program: str,
    infrared: Infrared,
    step: float,
    rays: float,
    top: float,
) -> Node:
    """Return a robot.

    Args:
        config: Of the run.
        number: Of the robot, from 0.
        pose: x [m], y [m], heading [rad] at the start.
        program: The name of its controller.
        infrared: Which lookup table its infrared sensors have.
        step: Height at which its body begins, below which are its bumpers [m].
        rays: Height of its infrared sensors [m].
        top: Height at which its body ends [m].
    """
    robot = config.robot
    x, y, heading = pose
    middle, rest = (step + top) / 2, robot.mass * (1 - 2 * _WHEEL_SHARE)
    drum = node("Cylinder", radius=robot.radius, height=top - step)
    flat = rest * (3 * robot.radius**2 + robot.height**2) / 12
    lower = -middle  # from the robot's origin to the floor
    return node(
        "Robot",
        translation=(x, y, middle),
        rotation=(0.0, 0.0, 1.0, heading),
        children=[
            look(drum, (0.3, 0.55, 0.35), 0.35),
            *_wheels(config, lower),
            *_casters(config, lower),
            _skirt(config, step, lower),
            *_devices(config, infrared, step, rays, lower),
        ],
        name=f"robot {number}",
        contactMaterial="robot",
        boundingObject=drum,
        physics=node(
            "Physics",
            density=-1.0,
            mass=rest,
            centerOfMass=[(0.0, 0.0, robot.centre_of_mass + lower)],
            inertiaMatrix=[(flat, flat, rest * robot.radius**2 / 2), (0.0, 0.0, 0.0)],
        ),
        controller=program,
        controllerArgs=[str(number)],
        window="<none>",
    )


def _wheels(config: Config, lower: float) -> Iterator[Node]:
    robot = config.robot
    for side, left in (("left", 1), ("right", -1)):
        at = (0.0, left * robot.axle_length / 2, robot.wheel_radius + lower)
        tyre = node("Cylinder", radius=robot.wheel_radius, height=0.1 * robot.wheel_radius)
        yield node(
            "HingeJoint",
            jointParameters=node("HingeJointParameters", axis=(0.0, 1.0, 0.0), anchor=at),
            device=[
                node(
                    "RotationalMotor",
                    name=f"{side} wheel motor",
                    maxVelocity=robot.top_speed,
                    maxTorque=robot.motor_torque,
                ),
                node("PositionSensor", name=f"{side} wheel sensor"),
            ],
            endPoint=node(
                "Solid",
                translation=at,
                rotation=(1.0, 0.0, 0.0, math.pi / 2),  # a cylinder stands along its z
                children=[look(tyre, (0.15, 0.15, 0.15))],
                name=f"{side} wheel",
                contactMaterial="wheel",
                boundingObject=tyre,
                physics=node("Physics", density=-1.0, mass=robot.mass * _WHEEL_SHARE),
            ),
        )


def _casters(config: Config, lower: float) -> Iterator[Node]:
    for name, ahead in (("front", 1), ("rear", -1)):
        ball = node("Sphere", radius=_CASTER)
        yield node(
            "Solid",
            translation=(ahead * config.robot.caster_offset, 0.0, _CASTER + lower),
            children=[look(ball, (0.5, 0.5, 0.5))],
            name=f"{name} caster",
            contactMaterial="caster",
            boundingObject=ball,
        )


def _skirt(config: Config, step: float, lower: float) -> Node:
    """Return the bumper where there is no touch sensor."""
    band = node("Cylinder", radius=config.robot.radius - 1.5 * _INWARDS, height=0.5 * step)
    return node(
        "Solid",
        translation=(0.0, 0.0, 0.6 * step + lower),
        children=[look(band, (0.2, 0.2, 0.2), 0.5)],
        name="bumper",
        contactMaterial="bumper",
        boundingObject=band,
    )


# ---- devices ---------------------------------------------------------------------------------------------------------


def _devices(config: Config, infrared: Infrared, step: float, rays: float, lower: float) -> Iterator[Node]:
    robot, sensors, noise = config.robot, config.sensors, config.noise
    devices, roof = robot.sensors, (0.0, 0.0, robot.height + lower)
    if "infrared" in devices:
        for i, yaw_deg in enumerate(sensors.infrared_yaw_deg):
            yield _ray(f"ps{i}", robot.radius, math.radians(yaw_deg), rays + lower, config, infrared)
    if "touch" in devices:
        for i, yaw_deg in enumerate(sensors.touch_yaw_deg):
            yield _touch(f"ts{i}", config, math.radians(yaw_deg), step, lower)
    if "ground" in devices:
        for i, (ahead, left) in enumerate(sensors.ground_position):
            yield _ground(f"gs{i}", (ahead, left, _GROUND_HEIGHT + lower), noise.ground)
    if "rf" in devices or "rf_bearing" in devices:
        yield _receiver("receiver", roof, "source", noise.rf, noise.rf_bearing)
    if "light" in devices:
        yield _receiver("light receiver", roof, "light", noise.light, 0.0)
    if "range_and_bearing" in devices:
        # A strength of 1/r^2 errs by about twice as much as the distance.
        yield _receiver("range and bearing receiver", roof, "range_and_bearing", 2 * noise.range_and_bearing, 0.0)
        yield node(
            "Emitter",
            translation=roof,
            name="emitter",
            type="radio",
            range=sensors.range_and_bearing_range,
            channel=CHANNEL["range_and_bearing"],
        )


def _ray(name: str, radius: float, yaw: float, height: float, config: Config, infrared: Infrared) -> Node:
    """Return an infrared sensor: it looks along its x, from the rim. "generic" rays do not mind colours."""
    return node(
        "DistanceSensor",
        translation=(radius * math.cos(yaw), radius * math.sin(yaw), height),
        rotation=(0.0, 0.0, 1.0, yaw),
        name=name,
        type="generic",
        numberOfRays=1,
        lookupTable=[tuple(row) for row in table(config, infrared)],
    )


def _touch(name: str, config: Config, yaw: float, step: float, lower: float) -> Node:
    """Return a sector of the bumper, made of flat pieces that touch its circle."""
    half = math.radians(config.sensors.touch_half_width_deg)
    pieces = max(1, math.ceil(2 * half / _ARC))
    angle, reach, depth = half / pieces, config.robot.radius - _INWARDS, 0.002
    size = (depth, 2 * reach * math.tan(angle), 0.5 * step)
    parts = []
    for piece in range(pieces):
        at, out = yaw - half + (2 * piece + 1) * angle, reach - depth / 2
        parts.append(
            node(
                "Transform",
                translation=(out * math.cos(at), out * math.sin(at), 0.0),
                rotation=(0.0, 0.0, 1.0, at),
                children=[look(node("Box", size=size), (0.1, 0.2, 0.5))],
            )
        )
    return node(
        "TouchSensor",
        translation=(0.0, 0.0, 0.6 * step + lower),
        children=list(parts),
        name=name,
        type="bumper",
        contactMaterial="bumper",
        boundingObject=node("Group", children=list(parts)),
    )


def _ground(name: str, place: tuple[float, float, float], noise: float) -> Node:
    """Return a sensor that looks down.

    Webots divides the distance of an "infra-red" ray by 0.2 + 0.8 red before it looks it up, where the floor has no
    roughness (reference manual, DistanceSensor); the table turns this into grey.
    """
    rows = []
    for i in range(_GROUND_POINTS, -1, -1):
        grey = (i / _GROUND_POINTS) ** 2  # denser where the distance changes fast
        rows.append((_GROUND_HEIGHT / (0.2 + 0.8 * grey), GROUND_FULL * grey, noise / grey if grey else 0.0))
    return node(
        "DistanceSensor",
        translation=place,
        rotation=(0.0, 1.0, 0.0, math.pi / 2),
        name=name,
        type="infra-red",
        numberOfRays=1,
        lookupTable=[(0.0, GROUND_FULL, 0.0), *rows],
    )


def _receiver(name: str, place: tuple[float, float, float], channel: str, strength: float, direction: float) -> Node:
    return node(
        "Receiver",
        translation=place,
        name=name,
        type="radio",
        channel=CHANNEL[channel],
        signalStrengthNoise=strength,
        directionNoise=direction,
    )

# SPDX-License-Identifier: BSD-3-Clause
"""A scene as a Webots world, in its ENU coordinates, which are ours: x east, y north, z up, robots look along their x.

Everything is made of Webots' base nodes, with the sizes, masses and devices of the configuration: no PROTO is needed.

Bumpers are to feel movables alone, as the touch sensors here do. So there are two storeys: in the lower one, up to
:attr:`Storeys.step`, are movables in full size, and the robots' bumpers; walls, obstacles and the robots' bodies stand
in the upper one, where movables are smaller by the bumpers' travel.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from swarmevo.config import LIGHT, Config, Emitter, Movable, surroundings
from swarmevo.errors import ExportError
from swarmevo.protocols import FloatArray
from swarmevo.runs.webots.robot import CHANNEL, body, look, primitive
from swarmevo.runs.webots.tables import Infrared
from swarmevo.runs.webots.vrml import Node, node, text
from swarmevo.simulation import layout

HEADER: Final = "#VRML_SIM R2022a utf8"
LONGEST_STEP: Final = 20
"""Of the world's basic time step [ms]: the largest divisor of the control period up to this."""
WALL: Final = 0.02
"""Thickness of the arena's walls [m]."""
CIRCLE_CORNERS: Final = 48
HARD: Final = {"softERP": 0.2, "softCFM": 1e-5}


@dataclass(frozen=True)
class Storeys:
    """Heights [m]."""

    step: float
    """Where the upper storey begins."""
    rays: float
    """Of the infrared sensors."""
    top: float
    """Of walls, obstacles and robots at least, so that rays meet them."""
    inset: float
    """By how much movables are smaller in the upper storey, all round."""

    @classmethod
    def of(cls, config: Config) -> Storeys:
        """Return those of a configuration.

        Raises:
            ExportError: Rays cannot pass above the movables and meet robots.
        """
        movables = surroundings(config).movables or ()
        heights = [movable.size[2] for movable in movables] or [config.arena.wall_height]
        step = 0.4 * min(*heights, config.robot.height)
        sees_all = config.sensors.infrared_target == "all"
        rays = (
            (step + min(*heights, config.robot.height)) / 2
            if sees_all
            else _above(max(heights), config, bool(movables))
        )
        travel = config.robot.bumper_travel if config.robot.bumper == "sprung" and not sees_all else 0.001
        narrowest = min((min(movable.size[:2]) for movable in movables), default=1.0)
        return cls(step, rays, max(rays + 0.005, config.robot.height), min(travel + 0.001, narrowest / 4))


def _above(height: float, config: Config, has_movables: bool) -> float:
    if not has_movables:
        return config.robot.height / 2
    if "infrared" in config.robot.sensors and height >= config.robot.height:
        raise ExportError(
            f"sensors.infrared_target: expected all, or movables lower than the robots, {config.robot.height} m, for "
            f"Webots, where rays pass above what they do not see; got a movable of {height} m"
        )
    return (height + config.robot.height) / 2


def basic_time_step(config: Config) -> int:
    """Return the world's basic time step [ms].

    Raises:
        ExportError: The control period is no whole number of milliseconds.
    """
    period = 1000 * config.episode.control_period
    if abs(period - round(period)) > 1e-6 or round(period) < 1:
        raise ExportError(
            f"episode.control_period: expected whole milliseconds for Webots, got {config.episode.control_period} s"
        )
    return max(step for step in range(1, LONGEST_STEP + 1) if round(period) % step == 0)


def world(
    config: Config, title: str, poses: FloatArray, movables: FloatArray, programs: Sequence[str], infrared: Infrared
) -> str:
    """Return the text of a world file.

    Args:
        config: Of the run.
        title: One line.
        poses: ``(robots, 3)``: where the robots start: x [m], y [m], heading [rad].
        movables: ``(movables, 3)``: where the movables start.
        programs: The name of each robot's controller.
        infrared: Which lookup table its infrared sensors have.

    Raises:
        ExportError: Webots has no such thing.
    """
    storeys, scene = Storeys.of(config), surroundings(config)
    emitters = [(number, emitter, channel(emitter)) for number, emitter in enumerate(scene.emitters or ())]
    nodes = [
        node(
            "WorldInfo",
            title=title,
            basicTimeStep=float(basic_time_step(config)),
            gravity=config.physics.gravity,
            ERP=config.physics.contact_erp,
            CFM=config.physics.contact_cfm,
            randomSeed=1,
            lineScale=0.05,
            contactProperties=list(_contacts(config)),
        ),
        *_stage(config),
        _floor(config),
        *_walls(config, storeys),
        *_obstacles(config, storeys),
    ]
    for i, (movable, pose) in enumerate(zip(scene.movables or (), movables.tolist(), strict=True)):
        lower = -_middle(movable, storeys)
        riding = [_radio(number, emitter, on, lower) for number, emitter, on in emitters if emitter.rides_on == i]
        nodes.append(_movable(i, movable, pose, storeys, riding))
    nodes += [_source(number, emitter, on) for number, emitter, on in emitters if emitter.rides_on is None]
    nodes += [
        body(config, i, pose, program, infrared, storeys.step, storeys.rays, storeys.top)
        for i, (pose, program) in enumerate(zip(poses.tolist(), programs, strict=True))
    ]
    return text(nodes, HEADER)


# ---- contacts --------------------------------------------------------------------------------------------------------


def _contacts(config: Config) -> Iterator[Node]:
    """Yield what materials do where they meet; the first that fits counts."""
    movables, physics = surroundings(config).movables or (), config.physics
    yield _contact("wheel", "floor", physics.wheel_friction, HARD)
    yield _contact("caster", "floor", 0.0, HARD)
    for i, movable in enumerate(movables):
        yield _contact(f"movable {i}", "floor", movable.friction or 0.0, HARD)
    soft = _sprung(config)
    others = ["wall", "robot", *(f"movable {i}" for i in range(len(movables)))]
    for other in others:
        yield _contact("bumper", other, physics.side_friction, soft)
    for i, one in enumerate(others):
        for other in others[i:]:
            is_bumped = one in ("wall", "robot") and other == "robot"
            yield _contact(one, other, physics.side_friction, soft if is_bumped else HARD)


def _contact(one: str, other: str, friction: float, softness: dict[str, float]) -> Node:
    return node(
        "ContactProperties", material1=one, material2=other, coulombFriction=[(friction,)], bounce=0.0, **softness
    )


def _sprung(config: Config) -> dict[str, float]:
    """Return ERP and CFM of an implicit spring and damper (ODE manual, "How to use ERP and CFM")."""
    robot = config.robot
    if robot.bumper == "rigid":
        return HARD
    step = basic_time_step(config) / 1000
    both = step * robot.bumper_stiffness + robot.bumper_damping
    return {"softERP": step * robot.bumper_stiffness / both, "softCFM": 1 / both}


# ---- what stands still -----------------------------------------------------------------------------------------------


def _stage(config: Config) -> Iterator[Node]:
    west, east, south, north = config.arena.bounds
    extent = max(east - west, north - south)
    x, y, down = (west + east) / 2, south - 0.9 * extent, 1.2 * extent
    yield node("Viewpoint", position=(x, y, down), orientation=(-0.328, 0.328, 0.886, 1.692))
    yield node("Background", skyColor=[(0.93, 0.94, 0.96)])
    yield node("DirectionalLight", direction=(0.4, 0.6, -1.0), intensity=1.5, ambientIntensity=0.6, castShadows=True)


def _floor(config: Config) -> Node:
    west, east, south, north = config.arena.bounds
    size = max(east - west, north - south) + 2 * WALL
    paint = node(
        "PBRAppearance",
        baseColorMap=node("ImageTexture", url=["floor.png"], filtering=0, repeatS=False, repeatT=False),
        roughness=0.0,
        metalness=0.0,
    )
    return node(
        "Solid",
        translation=((west + east) / 2, (south + north) / 2, 0.0),
        children=[node("Shape", appearance=paint, geometry=node("Plane", size=(size, size)))],
        name="floor",
        contactMaterial="floor",
        boundingObject=node("Plane", size=(size, size)),
        locked=True,
    )


def _walls(config: Config, storeys: Storeys) -> Iterator[Node]:
    arena = config.arena
    corners = layout.outline(arena, CIRCLE_CORNERS)
    for i, ((x, y), (to_x, to_y)) in enumerate(
        zip(corners.tolist(), [*corners.tolist()[1:], corners.tolist()[0]], strict=True)
    ):
        length, heading = math.hypot(to_x - x, to_y - y), math.atan2(to_y - y, to_x - x)
        out = WALL / 2  # behind the edge, which goes counter-clockwise
        middle = ((x + to_x) / 2 + out * math.sin(heading), (y + to_y) / 2 - out * math.cos(heading))
        size = (length + 2 * WALL, WALL, max(arena.wall_height, storeys.top))
        yield _standing(f"wall {i}", "box", size, (*middle, heading), storeys, (0.55, 0.57, 0.6))


def _obstacles(config: Config, storeys: Storeys) -> Iterator[Node]:
    for i, obstacle in enumerate(map(layout.as_box, surroundings(config).obstacles)):
        size = (*obstacle.size[:2], max(obstacle.size[2], storeys.top))
        yield _standing(f"obstacle {i}", obstacle.shape, size, obstacle.pose, storeys, (0.4, 0.42, 0.45))


def _standing(
    name: str,
    shape: str,
    size: tuple[float, float, float],
    pose: Sequence[float],
    storeys: Storeys,
    colour: tuple[float, float, float],
) -> Node:
    """Return what never moves; robots and rays meet it in the upper storey alone, movables there too."""
    height = size[2] - storeys.step
    x, y, heading = pose
    solid = primitive(shape, (size[0], size[1], height))
    return node(
        "Solid",
        translation=(x, y, storeys.step + height / 2),
        rotation=(0.0, 0.0, 1.0, heading),
        children=[look(solid, colour)],
        name=name,
        contactMaterial="wall",
        boundingObject=solid,
        locked=True,
    )


# ---- what can be pushed ----------------------------------------------------------------------------------------------


def _middle(movable: Movable, storeys: Storeys) -> float:
    """Return the height of the middle of its part in the upper storey, which is its origin [m]."""
    return (storeys.step + movable.size[2]) / 2


def _movable(number: int, movable: Movable, pose: Sequence[float], storeys: Storeys, riding: list[Node]) -> Node:
    x, y, heading = pose
    length, width, height = movable.size
    middle, mass, name = _middle(movable, storeys), movable.mass, f"movable {number}"
    upper = primitive(movable.shape, (length - 2 * storeys.inset, width - 2 * storeys.inset, height - storeys.step))
    lower = primitive(movable.shape, (length, width, storeys.step))
    foot = node(
        "Solid",
        translation=(0.0, 0.0, storeys.step / 2 - middle),
        children=[look(lower, (0.8, 0.5, 0.2))],
        name="foot",
        contactMaterial=name,
        boundingObject=lower,
    )
    flat = (width**2, length**2) if movable.shape == "box" else (0.75 * length**2, 0.75 * length**2)
    spin = length**2 + width**2 if movable.shape == "box" else 1.5 * length**2
    moments = tuple(mass / 12 * moment for moment in (flat[0] + height**2, flat[1] + height**2, spin))
    vx, vy, turn = movable.velocity
    # What carries an emitter has a program that sends.
    program = {"controller": "swarmevo_source", "window": "<none>"} if riding else {}
    return node(
        "Robot" if riding else "Solid",
        translation=(x, y, middle),
        rotation=(0.0, 0.0, 1.0, heading),
        children=[look(upper, (0.9, 0.6, 0.25)), foot, *riding],
        name=name,
        contactMaterial=name,
        boundingObject=upper,
        physics=node(
            "Physics",
            density=-1.0,
            mass=mass,
            centerOfMass=[(0.0, 0.0, height / 2 - middle)],
            inertiaMatrix=[moments, (0.0, 0.0, 0.0)],
        ),
        **program,
        linearVelocity=(vx, vy, 0.0),
        angularVelocity=(0.0, 0.0, turn),
    )


# ---- emitters --------------------------------------------------------------------------------------------------------


def channel(emitter: Emitter) -> str:
    """Return which of ``CHANNEL`` an emitter sends on: one for all of RF, as there is one receiver."""
    return "light" if emitter.channel == LIGHT else "source"


def _radio(number: int, emitter: Emitter, on: str, lower: float = 0.0) -> Node:
    """Return an emitter."""
    x, y, z = emitter.position
    reach = emitter.range if emitter.reach == "range" else -1.0
    return node(
        "Emitter",
        translation=(x, y, z + lower),
        name=f"emitter {number}",
        type="radio",
        range=reach,
        channel=CHANNEL[on],
    )


def _source(number: int, emitter: Emitter, on: str) -> Node:
    colour = (1.0, 0.9, 0.3) if on == "light" else (0.9, 0.2, 0.2)
    radio = _radio(number, emitter.model_copy(update={"position": (0.0, 0.0, 0.0)}), on)
    return node(
        "Robot",
        translation=emitter.position,
        children=[look(node("Sphere", radius=0.006, subdivision=2), colour), radio],
        name=f"source {number}",
        controller="swarmevo_source",
        window="<none>",
        locked=True,
    )

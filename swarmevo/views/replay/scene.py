# SPDX-License-Identifier: BSD-3-Clause
"""The world of a configuration as meshcat commands: what the viewer in a replay page builds its scene from.

Only what stands still is said here: shapes, colours, places within their parents. The player in ``assets/`` moves
the nodes ``/box``, ``/robots/I``, ``/robots/I/left`` and ``right``, and lights up ``/robots/I/halo``,
``/robots/I/touch/K`` and ``/arena/target``.

World frame as everywhere: metres, origin at the arena's centre on the floor, x east, y north, z up.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import umsgpack
from meshcat.geometry import Box

from swarmevo.config import Config
from swarmevo.protocols import FloatArray
from swarmevo.views.replay import epuck, shapes
from swarmevo.views.replay.shapes import Command, Part

COLOURS: Final = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#F0E442")
"""Of robots, in turn: Okabe and Ito's, which colour-blind people tell apart."""

_WALL_THICKNESS: Final = 0.02  # of the arena's size
_STRIPE: Final = 0.035  # of the arena's size: width of the stripe along the target wall
_TARGET: Final = "#1b9e8f"
_DIRECTIONS: Final = {"north": (0, 1), "south": (0, -1), "east": (1, 0), "west": (-1, 0)}


def commands(config: Config) -> list[Command]:
    """Return the meshcat commands, not yet packed, that build the world of ``config``."""
    parts = [*_arena(config), *_box(config), *_emitter(config)]
    for robot in range(config.team.robots):
        path = f"robots/{robot}"
        parts += epuck.parts(path, config.robot, config.sensors, COLOURS[robot % len(COLOURS)], str(robot + 1))
        if config.robot.bumper == "sprung":
            parts.append(epuck.bumper(path, config.robot, config.box.size[2]))
    return [command for part in parts for command in part.commands()]


def packed(config: Config) -> list[str]:
    """Return :func:`commands`, each as meshcat's server would send it (msgpack), in base64."""
    return [base64.b64encode(umsgpack.packb(command)).decode("ascii") for command in commands(config)]


def colours(robots: int) -> Sequence[str]:
    """Return each robot's colour, for plots beside the scene."""
    return [COLOURS[robot % len(COLOURS)] for robot in range(robots)]


def touch_sensors(config: Config) -> int:
    """Return how many touch sensors each robot has."""
    return len(config.sensors.touch_yaw_deg)


def _arena(config: Config) -> list[Part]:
    size, height = config.arena.size, config.arena.wall_height
    thick, stripe = _WALL_THICKNESS * size, _STRIPE * size
    parts = [
        Part("arena/floor", Box([size, size, 0.01]), shapes.matt("#eceae4"), shapes.at(z=-0.005)),
        *_grid(size),
    ]
    for name, (x, y) in _DIRECTIONS.items():
        along = [thick, size + 2 * thick] if x else [size + 2 * thick, thick]
        middle = (size + thick) / 2
        wall = "target" if name == config.arena.target_wall else f"walls/{name}"
        place = shapes.at(x * middle, y * middle, height / 2)
        parts.append(Part(f"arena/{wall}", Box([*along, height]), shapes.matt("#c9cdd0"), place))
    x, y = _DIRECTIONS[config.arena.target_wall]
    along = [stripe, size] if x else [size, stripe]
    middle = (size - stripe) / 2
    place = shapes.at(x * middle, y * middle, shapes.FLOOR_LAYERS["stripe"])
    plane = shapes.Shape("PlaneGeometry", width=along[0], height=along[1])
    parts.append(Part("arena/stripe", plane, shapes.flat(_TARGET), place))
    return parts


def _grid(size: float) -> Iterator[Part]:
    """Yield thin lines every tenth of the arena (10 cm in the paper's)."""
    places = np.linspace(-size / 2, size / 2, 11)[1:-1]
    for axis, extent in {"x": (0.0015, size), "y": (size, 0.0015)}.items():
        for number, place in enumerate(places.tolist()):
            line = shapes.Shape("PlaneGeometry", width=extent[0], height=extent[1])
            where = shapes.at(**{axis: place}, z=shapes.FLOOR_LAYERS["grid"])
            yield Part(f"arena/grid/{axis}{number}", line, shapes.flat("#000000", 0.06), where, shadow=False)


def _box(config: Config) -> list[Part]:
    x, y, z = config.box.size
    top = shapes.Shape("PlaneGeometry", width=0.9 * x, height=0.85 * y)
    return [
        Part("box/body", Box([x, y, z]), shapes.glossy("#c59a63", shininess=12), shapes.at(z=z / 2)),
        Part("box/top", top, shapes.flat("#ffffff", 0.16), shapes.at(z=z + 0.0004), shadow=False),
    ]


def _emitter(config: Config) -> list[Part]:
    x, y, z = config.emitter.position
    parts = [
        Part("emitter/foot", shapes.cylinder(0.013, 0.004), shapes.glossy(shapes.CORE), _upright(x, y, z + 0.002)),
        Part("emitter/mast", shapes.cylinder(0.0022, 0.04), shapes.glossy(shapes.CORE), _upright(x, y, z + 0.022)),
    ]
    ball = shapes.Shape("SphereGeometry", radius=0.008, widthSegments=24, heightSegments=16)
    lit = shapes.glossy(shapes.SIGNAL, emissive=shapes.number("#3a22b0"))
    return [*_range(config), *parts, Part("emitter/ball", ball, lit, shapes.at(x, y, z + 0.045)), *_waves(x, y)]


def _upright(x: float, y: float, z: float) -> FloatArray:
    place: FloatArray = shapes.at(x, y, z) @ shapes.UPRIGHT
    return place


def _range(config: Config) -> Iterator[Part]:
    """Yield the emitter's range, as a disc on the floor with an edge."""
    (x, y, _), reach = config.emitter.position, config.emitter.range
    disc = shapes.Shape("CircleGeometry", radius=reach, segments=96)
    place = shapes.at(x, y, shapes.FLOOR_LAYERS["range"])
    yield Part("emitter/range/disc", disc, shapes.flat(shapes.SIGNAL, 0.10), place, shadow=False)
    edge = shapes.sector(reach - 0.003, reach, 0, math.pi)
    place = shapes.at(x, y, shapes.FLOOR_LAYERS["edge"])
    yield Part("emitter/range/edge", edge, shapes.flat(shapes.SIGNAL, 0.55), place, shadow=False)


def _waves(x: float, y: float) -> Iterator[Part]:
    """Yield unit rings, which the player widens."""
    for wave in range(2):
        ring = shapes.Shape("RingGeometry", innerRadius=0.985, outerRadius=1.0, thetaSegments=96)
        place = shapes.at(x, y, shapes.FLOOR_LAYERS["edge"])
        yield Part(f"emitter/range/wave{wave}", ring, shapes.flat(shapes.SIGNAL, 0.4), place, shadow=False)

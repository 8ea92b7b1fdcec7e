# SPDX-License-Identifier: BSD-3-Clause
"""The world of a configuration as meshcat commands: what the viewer in a replay page builds its scene from.

Only what stands still is said here: shapes, colours, places within their parents. The player in ``assets/`` moves
the nodes ``/movables/I``, ``/emitters/I``, ``/robots/I``, ``/robots/I/left`` and ``right``, lights up ``/goals``,
``/movables/I/top``, ``/robots/I/halo/DEVICE`` and ``/robots/I/touch/K``, paints floor, patches, walls and obstacles,
and draws trails and what robots perceive at a distance.

World frame as everywhere: metres, origin at the arena's centre on the floor, x east, y north, z up.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import umsgpack
from meshcat.geometry import Box, Geometry

from swarmevo.config import LIGHT, Config, Emitter, Surroundings, surroundings
from swarmevo.protocols import FloatArray
from swarmevo.simulation import layout
from swarmevo.views.replay import epuck, shapes
from swarmevo.views.replay.shapes import Command, Material, Part

COLOURS: Final = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#F0E442")
"""Of robots, in turn: Okabe and Ito's, which colour-blind people tell apart."""

_WALL_THICKNESS: Final = 0.02  # of the arena's extent
_STRIPE: Final = 0.035  # of the arena's extent: width of the stripe along a goal's wall
_TARGET: Final = "#1b9e8f"
_WALL: Final = "#c9cdd0"
_CLIP_CORNERS: Final = 32  # of a circular arena's clipping planes: each costs time for every pixel
_FLOOR_ORDER: Final = -100  # the floor is drawn first, then its patches, the later ones on top
_CHANNELS: Final = {shapes.SIGNAL: "#3a22b0", "#c2387a": "#7a1c48", "#3f7fbf": "#1d4b78", "#8a6d1a": "#5a430a"}
"""Colours of emitters by channel, in turn, and what their balls glow with."""
_LIT: Final = (shapes.LIGHT, "#8a6a00")  # the same of lights


def commands(config: Config) -> list[Command]:
    """Return the meshcat commands, not yet packed, that build the world of ``config``."""
    scene = surroundings(config)
    parts = [*_arena(config), *_patches(scene), *_goals(config), *_obstacles(scene), *_movables(scene)]
    parts += [part for i, emitter in enumerate(scene.emitters or ()) for part in _emitter(scene, i, emitter)]
    heights = [movable.size[2] for movable in scene.movables or ()]
    for robot in range(config.team.robots):
        path = f"robots/{robot}"
        parts += epuck.parts(path, config.robot, config.sensors, COLOURS[robot % len(COLOURS)], str(robot + 1))
        if config.robot.bumper == "sprung":
            parts.append(epuck.bumper(path, config.robot, min(heights, default=config.robot.height)))
    return [command for part in parts for command in part.commands()]


def packed(config: Config) -> list[str]:
    """Return :func:`commands`, each as meshcat's server would send it (msgpack), in base64."""
    return [base64.b64encode(umsgpack.packb(command)).decode("ascii") for command in commands(config)]


def colours(robots: int) -> Sequence[str]:
    """Return each robot's colour, for plots beside the scene."""
    return [COLOURS[robot % len(COLOURS)] for robot in range(robots)]


def clipping(config: Config) -> list[list[float]]:
    """Return a, b, c of the planes between which the arena is: a x + b y + c >= 0."""
    planes: list[list[float]] = layout.inward_planes(layout.outline(config.arena, _CLIP_CORNERS)).tolist()
    return planes


# ---- the arena -------------------------------------------------------------------------------------------------------


def extent(config: Config) -> float:
    """Return the longer side of the rectangle around the arena [m]."""
    west, east, south, north = config.arena.bounds
    return max(east - west, north - south)


def _arena(config: Config) -> Iterator[Part]:
    corners = layout.outline(config.arena)
    floor = shapes.at(z=shapes.FLOOR_LAYERS["floor"])
    yield Part("arena/floor", shapes.polygon(corners), shapes.matt("#eceae4"), floor, order=_FLOOR_ORDER)
    yield from _grid(corners, extent(config) / 10)
    height, thick = config.arena.wall_height, _WALL_THICKNESS * extent(config)
    if config.arena.shape == "circle":
        radius = config.arena.size / 2
        tube = shapes.tube(radius, radius + thick, 0, height, 0, math.pi, segments=len(corners))
        yield Part("arena/walls/round", tube, shapes.matt(_WALL), shapes.UPRIGHT)
        return
    goals = {goal.wall for goal in surroundings(config).goals or ()}
    for name, box, place in _walls(config, corners, thick):
        if name not in goals:
            yield Part(f"arena/walls/{name}", Box([*box, height]), shapes.matt(_WALL), place)


def _walls(config: Config, corners: FloatArray, thick: float) -> Iterator[tuple[str, tuple[float, float], FloatArray]]:
    """Yield each wall's name, its length and thickness, and its place: along an edge, outside, mitred with the next."""
    ends = np.roll(corners, -1, axis=0)
    lengths = np.hypot(*(ends - corners).T)
    headings = np.arctan2(*(ends - corners).T[::-1])
    turns = (headings - np.roll(headings, 1)) % (2 * math.pi)  # at the corner where an edge begins
    over = np.minimum(thick * np.tan(np.minimum(turns, 3.0) / 2), 2 * thick)
    names = ("south", "east", "north", "west") if config.arena.shape != "polygon" else map(str, range(len(corners)))
    for i, name in enumerate(names):
        before, after = over[i], over[(i + 1) % len(over)]
        along = shapes.at(lengths[i] / 2 + (after - before) / 2, -thick / 2, config.arena.wall_height / 2)
        place = shapes.turned(corners[i, 0], corners[i, 1], headings[i]) @ along
        yield name, (lengths[i] + before + after, thick), place


def _grid(corners: FloatArray, step: float) -> Iterator[Part]:
    """Yield thin lines in both directions, every tenth of the arena (10 cm in the paper's)."""
    for axis, name in enumerate("xy"):
        low, high = corners[:, axis].min(), corners[:, axis].max()
        most = math.ceil((high - low) / 2 / step - 1e-6) - 1
        for number, k in enumerate(range(-most, most + 1)):
            place = (low + high) / 2 + k * step
            start, end = _chord(corners, axis, place)
            width, middle = (0.0015, end - start), (place, (start + end) / 2)
            if axis:
                width, middle = width[::-1], middle[::-1]
            line = shapes.Shape("PlaneGeometry", width=width[0], height=width[1])
            where = shapes.at(*middle, shapes.FLOOR_LAYERS["grid"])
            yield Part(f"arena/grid/{name}{number}", line, shapes.flat("#000000", 0.06), where, shadow=False)


def _chord(corners: FloatArray, axis: int, place: float) -> tuple[float, float]:
    """Return from where to where a line at ``place`` of one axis is inside a convex polygon, on the other axis."""
    ends = np.roll(corners, -1, axis=0)
    crossed = (corners[:, axis] - place) * (ends[:, axis] - place) <= 0
    crossed &= corners[:, axis] != ends[:, axis]
    a, b = corners[crossed], ends[crossed]
    share = (place - a[:, axis]) / (b[:, axis] - a[:, axis])
    other = a[:, 1 - axis] + share * (b[:, 1 - axis] - a[:, 1 - axis])
    return float(other.min()), float(other.max())


def _patches(scene: Surroundings) -> Iterator[Part]:
    for i, patch in enumerate(scene.patches):
        length, width = patch.size
        flat = shapes.Shape("PlaneGeometry", width=length, height=width)
        if patch.shape == "cylinder":
            flat = shapes.Shape("CircleGeometry", radius=length / 2, segments=64)
        place = shapes.turned(*patch.pose, z=shapes.FLOOR_LAYERS["patch"])
        look = shapes.matt("#eceae4", depthWrite=False)  # the later patch is on top at the same height
        yield Part(f"arena/patches/{i}", flat, look, place, order=_FLOOR_ORDER + 1 + i)


def _goals(config: Config) -> Iterator[Part]:
    corners, thick = layout.outline(config.arena), _WALL_THICKNESS * extent(config)
    layer, height = shapes.FLOOR_LAYERS["stripe"], config.arena.wall_height
    for i, goal in enumerate(surroundings(config).goals or ()):
        if goal.region is not None:
            west, east, south, north = goal.region
            plane = shapes.Shape("PlaneGeometry", width=east - west, height=north - south)
            place = shapes.at((west + east) / 2, (south + north) / 2, layer)
            yield Part(f"goals/{i}/region", plane, shapes.flat(_TARGET, 0.5), place)
            continue
        (box, place), *_ = [(box, place) for name, box, place in _walls(config, corners, thick) if name == goal.wall]
        yield Part(f"goals/{i}/wall", Box([*box, height]), shapes.matt(_WALL), place)
        stripe, length = _STRIPE * extent(config), box[0] - 2 * thick
        inwards = shapes.at(0, (thick + stripe) / 2, layer - height / 2)
        plane = shapes.Shape("PlaneGeometry", width=length, height=stripe)
        yield Part(f"goals/{i}/stripe", plane, shapes.flat(_TARGET), place @ inwards)


# ---- what is in it ---------------------------------------------------------------------------------------------------


def _obstacles(scene: Surroundings) -> Iterator[Part]:
    for i, obstacle in enumerate(map(layout.as_box, scene.obstacles)):
        x, y, heading = obstacle.pose
        place = shapes.turned(x, y, heading, z=obstacle.size[2] / 2)
        yield Part(f"obstacles/{i}", *_solid(obstacle.shape, obstacle.size, shapes.matt(_WALL), place))


def _movables(scene: Surroundings) -> Iterator[Part]:
    for i, movable in enumerate(scene.movables or ()):
        x, y, z = movable.size
        wood = shapes.glossy("#c59a63", shininess=12)
        yield Part(f"movables/{i}/body", *_solid(movable.shape, movable.size, wood, shapes.at(z=z / 2)))
        top = shapes.Shape("PlaneGeometry", width=0.9 * x, height=0.85 * y)
        if movable.shape == "cylinder":
            top = shapes.Shape("CircleGeometry", radius=0.42 * x, segments=40)
        lid = shapes.at(z=z + 0.0004)
        yield Part(f"movables/{i}/top", top, shapes.flat("#ffffff", 0.16), lid, shadow=False)


def _solid(
    shape: str, size: tuple[float, float, float], look: Material, place: FloatArray
) -> tuple[Geometry, Material, FloatArray]:
    """Return a box or an upright cylinder at a place of its middle."""
    if shape == "cylinder":
        return shapes.cylinder(size[0] / 2, size[2]), look, place @ shapes.UPRIGHT
    return Box(list(size)), look, place


def _emitter(scene: Surroundings, number: int, emitter: Emitter) -> Iterator[Part]:
    """Yield an emitter in its own frame, below its middle on the floor, where the player puts it."""
    path, z = f"emitters/{number}", emitter.position[2]
    colour, glow = _LIT
    if emitter.channel != LIGHT:
        channel = scene.radio_channels.index(emitter.channel)
        colour, glow = list(_CHANNELS.items())[channel % len(_CHANNELS)]
    layer = shapes.FLOOR_LAYERS["edge"]
    if layout.has_range(scene, emitter):
        disc = shapes.Shape("CircleGeometry", radius=emitter.range, segments=96)
        below = shapes.at(z=shapes.FLOOR_LAYERS["range"])
        yield Part(f"{path}/range/disc", disc, shapes.flat(colour, 0.10), below, shadow=False)
        edge = shapes.sector(max(emitter.range - 0.003, 0), emitter.range, 0, math.pi)
        yield Part(f"{path}/range/edge", edge, shapes.flat(colour, 0.55), shapes.at(z=layer), shadow=False)
    for wave in range(2):  # unit rings, which the player widens
        ring = shapes.Shape("RingGeometry", innerRadius=0.985, outerRadius=1.0, thetaSegments=96)
        yield Part(f"{path}/range/wave{wave}", ring, shapes.flat(colour, 0.4), shapes.at(z=layer), shadow=False)
    core, lit = shapes.glossy(shapes.CORE), shapes.glossy(colour, emissive=shapes.number(glow))
    yield Part(f"{path}/foot", shapes.cylinder(0.013, 0.004), core, shapes.at(z=z + 0.002) @ shapes.UPRIGHT)
    yield Part(f"{path}/mast", shapes.cylinder(0.0022, 0.04), core, shapes.at(z=z + 0.022) @ shapes.UPRIGHT)
    ball = shapes.Shape("SphereGeometry", radius=0.008, widthSegments=24, heightSegments=16)
    yield Part(f"{path}/ball", ball, lit, shapes.at(z=z + 0.045))

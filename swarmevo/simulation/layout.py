# SPDX-License-Identifier: BSD-3-Clause
"""Where the things of a scene are: walls, obstacles, emitters and goals, and how far places and movables are from them.

World frame: metres, x east, y north. Places are ``(..., 2)``, poses ``(..., 3)`` with a heading [rad].

>>> from swarmevo.config import Arena
>>> wall_distance(Arena(), np.array([[0.0, 0.0], [0.4, 0.1]])).round(3).tolist()
[0.5, 0.1]
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from swarmevo.config import Arena, Config, Emitter, Goal, Movable, Obstacle, Surroundings, surroundings
from swarmevo.protocols import FloatArray

DIRECTIONS: Final = {"north": (0.0, 1.0), "south": (0.0, -1.0), "east": (1.0, 0.0), "west": (-1.0, 0.0)}
"""Towards each wall of a square or rectangular arena."""
CIRCLE_CORNERS: Final = 96
"""Of the polygon around a circular arena that :func:`outline` gives: 0.3 mm from a circle of 1 m at most."""


# ---- walls and obstacles ---------------------------------------------------------------------------------------------


def outline(arena: Arena, circle_corners: int = CIRCLE_CORNERS) -> FloatArray:
    """Return the corners ``(n, 2)`` of what the walls enclose, counter-clockwise; a circle as a polygon around it."""
    if arena.shape == "circle":
        angles = np.arange(circle_corners) * (2 * math.pi / circle_corners)
        around = arena.size / 2 / math.cos(math.pi / circle_corners)
        return around * np.column_stack([np.cos(angles), np.sin(angles)])
    if arena.shape == "polygon":
        return np.array(arena.corners, dtype=float).reshape(-1, 2)
    west, east, south, north = arena.bounds
    return np.array([[west, south], [east, south], [east, north], [west, north]])


def inward_planes(corners: FloatArray) -> FloatArray:
    """Return ``(n, 3)``: for each edge of a convex polygon a, b, c; ``a x + b y + c`` is how far inside a place is."""
    edges = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack([-edges[:, 1], edges[:, 0]]) / np.linalg.norm(edges, axis=1, keepdims=True)
    return np.column_stack([normals, -(normals * corners).sum(axis=1)])


def wall_distance(arena: Arena, places: FloatArray) -> FloatArray:
    """Return ``(...)``: from places inside the arena to the nearest wall [m]."""
    if arena.shape == "circle":
        distance: FloatArray = arena.size / 2 - np.hypot(places[..., 0], places[..., 1])
        return distance
    planes = inward_planes(outline(arena))
    inside: FloatArray = (places @ planes[:, :2].T + planes[:, 2]).min(axis=-1)
    return inside


def is_outside(arena: Arena, corners: FloatArray) -> bool:
    """Whether a convex polygon with these corners ``(n, 2)`` lies beyond one of the walls, all of it."""
    planes = inward_planes(outline(arena))
    return bool((corners @ planes[:, :2].T + planes[:, 2] <= 0).all(axis=0).any())


def obstacle_corners(obstacle: Obstacle) -> FloatArray:
    """Return the corners ``(4, 2)`` of an obstacle, counter-clockwise; of a cylinder those of a square around it."""
    box = as_box(obstacle)
    (x, y, heading), (length, width, _) = box.pose, box.size
    cosine, sine = math.cos(heading), math.sin(heading)
    own = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * (length / 2, width / 2)
    corners: FloatArray = own @ np.array([[cosine, sine], [-sine, cosine]]) + (x, y)
    return corners


def as_box(obstacle: Obstacle) -> Obstacle:
    """Return an obstacle of a shape that the library knows: a wall is a thin box."""
    if obstacle.shape != "wall":
        return obstacle
    (x, y), (to_x, to_y) = obstacle.ends
    return Obstacle.model_construct(
        shape="box",
        size=(math.hypot(to_x - x, to_y - y), obstacle.thickness, obstacle.size[2]),
        pose=((x + to_x) / 2, (y + to_y) / 2, math.atan2(to_y - y, to_x - x)),
    )


def obstacle_distance(scene: Surroundings, places: FloatArray) -> FloatArray:
    """Return ``(...)``: from places to the nearest obstacle [m], 0 within one; infinite without any."""
    nearest: FloatArray = np.full(places.shape[:-1], np.inf)
    for obstacle in map(as_box, scene.obstacles):
        x, y, heading = obstacle.pose
        dx, dy = places[..., 0] - x, places[..., 1] - y
        if obstacle.shape == "cylinder":
            away = np.hypot(dx, dy) - obstacle.size[0] / 2
        else:
            cosine, sine = math.cos(heading), math.sin(heading)
            along = np.abs(cosine * dx + sine * dy) - obstacle.size[0] / 2
            across = np.abs(cosine * dy - sine * dx) - obstacle.size[1] / 2
            away = np.hypot(np.maximum(along, 0), np.maximum(across, 0))
        nearest = np.minimum(nearest, np.maximum(away, 0))
    return nearest


def has_one_box(scene: Surroundings) -> bool:
    """Return whether what robots can push is one box, as in the paper."""
    return [movable.shape for movable in scene.movables or ()] == ["box"]


# ---- emitters --------------------------------------------------------------------------------------------------------


def radio_emitters(scene: Surroundings, channel: int) -> tuple[Emitter, ...]:
    """Return those that RF receivers hear on a channel, by its number among ``scene.radio_channels``."""
    named = scene.radio_channels[channel : channel + 1]
    return tuple(emitter for emitter in scene.emitters or () if emitter.channel in named)


def homing_emitters(scene: Surroundings) -> tuple[Emitter, ...]:
    """Return those that the robots home in on, of the first channel; none where a scene has none."""
    return radio_emitters(scene, 0)


def has_range(scene: Surroundings, emitter: Emitter) -> bool:
    """Whether an emitter's range means something: it is heard no farther, or robots are home within it."""
    return emitter.reach == "range" or emitter in homing_emitters(scene)


def signal_range(scene: Surroundings, channel: int = 0) -> tuple[float, float]:
    """Return the strength of a channel's signal out of range of all its emitters, and at the strongest."""
    strengths = [emitter.strength for emitter in radio_emitters(scene, channel)] or [(0.0, 0.0)]
    least, most = zip(*strengths, strict=True)
    return max(least), max(most)


def signal_scale(scene: Surroundings, channel: int = 0) -> float:
    """Return what readings of a channel's signal are divided by: its largest strength; 1 without an emitter."""
    return signal_range(scene, channel)[1] or 1.0


def emitter_places(emitter: Emitter, movables: FloatArray) -> FloatArray:
    """Return ``(..., 2)``: where an emitter is, given the poses of the movables ``(..., movables, 3)``."""
    x, y, _ = emitter.position
    if emitter.rides_on is None:
        return np.broadcast_to([x, y], (*movables.shape[:-2], 2))
    carrier = movables[..., emitter.rides_on, :]
    cosine, sine = np.cos(carrier[..., 2]), np.sin(carrier[..., 2])
    return np.stack([carrier[..., 0] + cosine * x - sine * y, carrier[..., 1] + sine * x + cosine * y], axis=-1)


# ---- goals -----------------------------------------------------------------------------------------------------------


def goal_distance(arena: Arena, movable: Movable, goal: Goal, poses: FloatArray) -> FloatArray:
    """Return ``(...)``: how far a movable is from a goal [m]: its rim from a wall, its centre from a region."""
    x, y, heading = np.moveaxis(poses, -1, 0)
    if goal.region is not None:
        west, east, south, north = goal.region
        outside: FloatArray = np.hypot(
            np.maximum(np.maximum(west - x, x - east), 0), np.maximum(np.maximum(south - y, y - north), 0)
        )
        return outside
    length, width, _ = movable.size
    if movable.shape == "cylinder":
        reach = length / 2
    else:
        cosine, sine = np.abs(np.cos(heading)), np.abs(np.sin(heading))
        is_along_x = goal.wall in ("east", "west")
        reach = (length * cosine + width * sine if is_along_x else length * sine + width * cosine) / 2
    west, east, south, north = arena.bounds
    to_wall = {"east": east - x, "west": x - west, "north": north - y, "south": y - south}
    distance: FloatArray = to_wall[goal.wall or ""] - reach
    return distance


def delivery_distance(config: Config, movables: FloatArray, at_goal: FloatArray) -> FloatArray | None:
    """Return how far the movable nearest to a goal is from it [m], of those that are not at one.

    Args:
        config: Of the scene.
        movables: ``(..., movables, 3)``: their poses.
        at_goal: ``(..., movables)``: 1 where one is at a goal.

    Returns:
        ``(...)``; where all are at a goal, the distance of the nearest; None without movables or goals.
    """
    scene = surroundings(config)
    if not scene.movables or not scene.goals:
        return None
    distances = np.stack(
        [
            np.min([goal_distance(config.arena, movable, goal, movables[..., i, :]) for goal in scene.goals], axis=0)
            for i, movable in enumerate(scene.movables)
        ],
        axis=-1,
    )
    is_there = at_goal > 0
    pending = np.where(is_there & ~is_there.all(axis=-1, keepdims=True), np.inf, distances)
    nearest: FloatArray = pending.min(axis=-1)
    return nearest

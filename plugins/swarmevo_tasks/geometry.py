# SPDX-License-Identifier: BSD-3-Clause
"""What a world says of its arena, its obstacles and its goals; world frame, lengths in metres."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from swarmevo.protocols import FloatArray, World
from swarmevo_shaped.geometry import WALLS


def half_sides(arena: Mapping[str, Any]) -> tuple[float, float]:
    """Return half of what a square, circular or rectangular arena measures along x and y."""
    x, y = arena["sides"] if arena["shape"] == "rectangle" else (arena["size"],) * 2
    return x / 2, y / 2


def corners_of(arena: Mapping[str, Any]) -> FloatArray:
    """Return ``(n, 2)``: the corners of an arena, counter-clockwise; of a circle those of the square around it."""
    if arena["shape"] == "polygon":
        return np.array(arena["corners"], dtype=np.float64)
    return np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * half_sides(arena)


def radius_of(arena: Mapping[str, Any]) -> float:
    """Return the radius of a circle that has the arena in it."""
    if arena["shape"] == "circle":
        return half_sides(arena)[0]
    corners = corners_of(arena)
    return float(np.hypot(*(corners - corners.mean(axis=0)).T).max())


def clearance(world: World, points: FloatArray) -> FloatArray:
    """Return for ``points`` ``(n, 2)`` the distance to the nearest wall or obstacle; below 0: beyond it."""
    to_all = [_to_walls(world["arena"], points)]
    to_all += [_to_obstacle(obstacle, points) for obstacle in world["scene"]["obstacles"]]
    nearest: FloatArray = np.min(to_all, axis=0)
    return nearest


def way_to_goals(world: World, movable: Mapping[str, Any], poses: FloatArray) -> FloatArray:
    """Return for ``poses`` ``(..., 3)`` of a movable how far it is from the nearest goal.

    To a region that is from its centre, to a wall from what of it is nearest to the wall.
    """
    ways = [_way_to_goal(world["arena"], goal, movable, poses) for goal in world["scene"]["goals"]]
    nearest: FloatArray = np.maximum(np.min(ways, axis=0), 0)
    return nearest


def _to_walls(arena: Mapping[str, Any], points: FloatArray) -> FloatArray:
    if arena["shape"] == "circle":
        return np.asarray(arena["size"] / 2 - np.hypot(*points.T))
    corners = corners_of(arena)
    along = np.roll(corners, -1, axis=0) - corners
    inwards = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.hypot(*along.T)[:, np.newaxis]
    to_each = ((points[:, np.newaxis] - corners) * inwards).sum(axis=-1)
    return np.asarray(to_each.min(axis=1))


def _to_obstacle(obstacle: Mapping[str, Any], points: FloatArray) -> FloatArray:
    length, width = obstacle["size"][:2]
    x, y, heading = obstacle["pose"]
    if obstacle["shape"] == "wall":
        (x_0, y_0), (x_1, y_1) = obstacle["ends"]
        x, y, heading = (x_0 + x_1) / 2, (y_0 + y_1) / 2, np.arctan2(y_1 - y_0, x_1 - x_0)
        length, width = np.hypot(x_1 - x_0, y_1 - y_0), obstacle["thickness"]
    away = points - (x, y)
    if obstacle["shape"] == "cylinder":
        return np.asarray(np.hypot(*away.T) - length / 2)
    cosine, sine = np.cos(heading), np.sin(heading)
    own = away @ np.array([[cosine, -sine], [sine, cosine]])
    beyond = np.abs(own) - np.array([length, width]) / 2
    return np.asarray(np.hypot(*np.maximum(beyond, 0).T) + np.minimum(beyond.max(axis=1), 0))


def _way_to_goal(
    arena: Mapping[str, Any], goal: Mapping[str, Any], movable: Mapping[str, Any], poses: FloatArray
) -> FloatArray:
    x, y, heading = np.moveaxis(poses, -1, 0)
    if goal["wall"] is None:
        west, east, south, north = goal["region"]
        return np.asarray(
            np.hypot(np.maximum.reduce([west - x, x - east, 0 * x]), np.maximum(south - y, y - north).clip(0))
        )
    (wall_x, wall_y), (length, width) = WALLS[goal["wall"]], movable["size"][:2]
    half_x, half_y = half_sides(arena)
    across = np.full_like(heading, length / 2)
    if movable["shape"] == "box":
        # The half extent of a turned rectangle along the wall's normal.
        turned = heading - (np.pi / 2 if wall_x == 0 else 0)
        across = (np.abs(np.cos(turned)) * length + np.abs(np.sin(turned)) * width) / 2
    return np.asarray(abs(wall_x) * half_x + abs(wall_y) * half_y - wall_x * x - wall_y * y - across)

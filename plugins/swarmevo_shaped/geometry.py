# SPDX-License-Identifier: BSD-3-Clause
"""What poses say of box, robots and target wall, at each control step."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from swarmevo.protocols import BoolArray, FloatArray, IntArray, Telemetry, World

WALLS: Final = {"north": (0.0, 1.0), "south": (0.0, -1.0), "east": (1.0, 0.0), "west": (-1.0, 0.0)}
"""For each wall the unit vector towards it."""
LAST: Final = 1.0
"""[s] before the push, whose mean stands for all the time after it."""


def world_of(telemetry: Telemetry) -> World:
    """Return the world of the episodes.

    Raises:
        ValueError: Nobody gave it.
    """
    if not telemetry.world:
        raise ValueError("telemetry.world: expected the world of the episodes, got none; give it to Telemetry(...)")
    return telemetry.world


# ---- what a world must have ------------------------------------------------------------------------------------------


def box_and_wall(world: World) -> tuple[float, float, str]:
    """Return length and width of the only box [m], and the wall that it is to be pushed to.

    Raises:
        ValueError: The scene has not one box and one wall.
    """
    movables, goals = world["scene"]["movables"], world["scene"]["goals"]
    if [movable["shape"] for movable in movables] != ["box"] or len(goals) != 1 or goals[0]["wall"] is None:
        found = [f"{len(movables)} movables", *(f"a {movable['shape']}" for movable in movables if len(movables) == 1)]
        ends = ["a wall" if goal["wall"] else "a region" for goal in goals] or ["no goal"]
        raise ValueError(
            f"scene: expected one box and one wall to push it to, got {found[-1]} and {', '.join(ends)}; "
            "success and speed are for any scene with goals"
        )
    length, width, _ = movables[0]["size"]
    return length, width, goals[0]["wall"]


def check_delivery(world: World) -> None:
    """Refuse a world without movables or without goals, where nothing can be brought to one.

    Raises:
        ValueError: It is such a world.
    """
    for key in ("movables", "goals"):
        if not world["scene"][key]:
            raise ValueError(f"expected a scene with {key}, got none; see scene.{key}")


def check_homing(world: World) -> None:
    """Refuse a world without emitters but lights, where no robot comes within an emitter's range.

    Raises:
        ValueError: It is such a world.
    """
    if all(emitter["channel"] == "light" for emitter in world["scene"]["emitters"]):
        found = "lights alone" if world["scene"]["emitters"] else "none"
        raise ValueError(f"scene.emitters: expected one to home in on, got {found}; nearness is for lights too")


def still_emitter(world: World) -> tuple[float, float]:
    """Return the place of the only emitter [m]; a light counts where there is no other.

    Raises:
        ValueError: The scene has not one emitter that stands still.
    """
    every = world["scene"]["emitters"]
    emitters = [emitter for emitter in every if emitter["channel"] != "light"] or every
    if len(emitters) != 1 or emitters[0]["rides_on"] is not None:
        found = "one that rides on a movable" if len(emitters) == 1 else str(len(emitters))
        raise ValueError(f"scene.emitters: expected one that stands still, got {found}; homing is for any emitters")
    x, y, _ = emitters[0]["position"]
    return x, y


# ---- what poses say --------------------------------------------------------------------------------------------------


def _sides(arena: Mapping[str, Any]) -> tuple[float, float]:
    """Return the extent of a square or rectangular arena along x and y [m]."""
    size: float = arena["size"]
    width, depth = arena["sides"] if arena["shape"] == "rectangle" else (size, size)
    return width, depth


def steps_of(telemetry: Telemetry) -> int:
    """Return how many control steps the horizon has. An episode that ended before it has fewer."""
    horizon: float = world_of(telemetry)["episode"]["horizon"]
    return round(horizon / telemetry.control_period)


def has_pushed(telemetry: Telemetry) -> BoolArray:
    """Return ``(episodes,)``: whether the box has touched the target wall."""
    return np.isfinite(telemetry.push_time)


def steps_before_push(telemetry: Telemetry) -> IntArray:
    """Return ``(episodes,)``: control steps before the box touched the target wall; never: all of the horizon's."""
    steps = np.where(has_pushed(telemetry), telemetry.push_time / telemetry.control_period, steps_of(telemetry))
    return np.rint(steps).astype(np.intp)


def last_steps(telemetry: Telemetry) -> int:
    """Return how many control steps the last second before the push has, whose mean stands for all the time after."""
    return max(1, round(LAST / telemetry.control_period))


def robots_at_face(telemetry: Telemetry, facing: float) -> FloatArray:
    """Return ``(episodes, steps)``: how many robots touch the box's pushing face.

    That is the face whose outward normal points most away from the target wall at that moment. A robot touches it if
    its centre is between the face's ends, its body not farther than the box sensors see, and its heading within
    ``facing`` [rad] of the face's inward normal.
    """
    world, box = world_of(telemetry), telemetry.box[..., np.newaxis, :]
    length, width, wall = box_and_wall(world)
    half_x, half_y = length / 2, width / 2
    cosine, sine = np.cos(box[..., 2]), np.sin(box[..., 2])

    # The direction to the wall, in the box's frame, tells which face: of its x or of its y, and on which side.
    wall_x, wall_y = WALLS[wall]
    ahead_x, ahead_y = cosine * wall_x + sine * wall_y, cosine * wall_y - sine * wall_x
    is_y = np.abs(ahead_y) >= np.abs(ahead_x)
    side = np.sign(np.where(is_y, ahead_y, ahead_x))

    # Robots in the box's frame: outwards from that face, and along it.
    dx, dy = telemetry.pose[..., 0] - box[..., 0], telemetry.pose[..., 1] - box[..., 1]
    x, y, turn = cosine * dx + sine * dy, cosine * dy - sine * dx, telemetry.pose[..., 2] - box[..., 2]
    outwards = -side * np.where(is_y, y, x) - np.where(is_y, half_y, half_x)
    along = np.abs(np.where(is_y, x, y)) - np.where(is_y, half_x, half_y)
    inwards = side * np.where(is_y, np.sin(turn), np.cos(turn))

    reach = world["robot"]["radius"] + world["sensors"]["touch_range"]
    touches = (outwards > 0) & (outwards <= reach) & (along <= 0) & (inwards >= math.cos(facing))
    count: FloatArray = touches.sum(axis=-1, dtype=np.float64)
    return count


def free_way(telemetry: Telemetry) -> FloatArray:
    """Return ``(episodes, steps)``: distance between the target wall and the corner of the box nearest to it [m]."""
    world, (x, y, heading) = world_of(telemetry), np.moveaxis(telemetry.box, -1, 0)
    length, width, wall = box_and_wall(world)
    wall_x, wall_y = WALLS[wall]
    cosine, sine = np.abs(np.cos(heading)), np.abs(np.sin(heading))
    across = (cosine * width + sine * length) if wall_x == 0 else (cosine * length + sine * width)
    side = _sides(world["arena"])[1 if wall_x == 0 else 0]
    way: FloatArray = (side - across) / 2 - (wall_x * x + wall_y * y)
    return way


def nearness(telemetry: Telemetry) -> FloatArray:
    """Return ``(episodes, steps)``: 1 at the emitter, 0 at the arena's farthest corner from it; mean over robots.

    Raises:
        ValueError: As :func:`still_emitter`.
    """
    distance, (x, y) = from_emitter(telemetry)
    near: FloatArray = np.clip(1 - distance / _farthest(world_of(telemetry)["arena"], x, y), 0, 1).mean(axis=-1)
    return near


def from_emitter(telemetry: Telemetry) -> tuple[FloatArray, tuple[float, float]]:
    """Return ``(episodes, steps, robots)``: how far each is from the emitter [m]; and where that stands.

    Raises:
        ValueError: As :func:`still_emitter`.
    """
    x, y = still_emitter(world_of(telemetry))
    return np.hypot(telemetry.pose[..., 0] - x, telemetry.pose[..., 1] - y), (x, y)


def _farthest(arena: Mapping[str, Any], x: float, y: float) -> float:
    """Return how far the arena's farthest place is from another [m]."""
    if arena["shape"] == "circle":
        return math.hypot(x, y) + float(arena["size"]) / 2
    if arena["shape"] == "polygon":
        return max(math.hypot(x - corner_x, y - corner_y) for corner_x, corner_y in arena["corners"])
    width, depth = _sides(arena)
    return math.hypot(width / 2 + abs(x), depth / 2 + abs(y))

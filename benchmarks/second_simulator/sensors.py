# SPDX-License-Identifier: BSD-3-Clause
"""What robots sense, without noise, by plane geometry.

In all functions ``poses`` are of the robots, ``(n, 3)``, and ``movables`` of what they push, ``(m, 3)``: x [m], y [m],
heading [rad].
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.reference import Movable, Obstacle
from benchmarks.twin import arena_of, surroundings_of
from swarmevo.config import Config, models
from swarmevo.protocols import BoolArray, FloatArray

OUTWARDS = {"north": (0, 1), "south": (0, -1), "east": (1, 0), "west": (-1, 0)}


def in_frame(vectors: FloatArray, heading: float) -> FloatArray:
    """Return how far vectors ``(..., 2)`` lead ahead and to the left of a heading."""
    c, s = np.cos(heading), np.sin(heading)
    return np.asarray(vectors @ np.array([[c, -s], [s, c]]))


def gaps_to_walls(config: Config, points: FloatArray) -> FloatArray:
    """Return how far points ``(..., 2)`` are from the nearest wall [m]; below 0: beyond it."""
    arena = arena_of(config)
    if isinstance(arena, float):
        return np.asarray(arena - np.hypot(points[..., 0], points[..., 1]))
    return np.asarray(_to_sides(arena, points).min(axis=-1))


def gap_to(thing: Movable | Obstacle, pose: FloatArray, points: FloatArray) -> FloatArray:
    """Return how far points ``(..., 2)`` are from a thing's rim [m]; 0 within it."""
    away = points - pose[:2]
    if thing.shape == "cylinder":
        return np.maximum(np.hypot(away[..., 0], away[..., 1]) - thing.size[0] / 2, 0)
    beyond = np.maximum(np.abs(in_frame(away, pose[2])) - np.array(thing.size) / 2, 0)
    return np.asarray(np.hypot(beyond[..., 0], beyond[..., 1]))


def _to_sides(corners: list[tuple[float, float]], points: FloatArray) -> FloatArray:
    """Return how far points ``(..., 2)`` are from each side's line ``(..., sides)`` [m]; below 0: beyond it."""
    start, inwards = _sides(corners)
    return np.asarray(((points[..., np.newaxis, :] - start) * inwards).sum(axis=-1))


def _sides(corners: list[tuple[float, float]]) -> tuple[FloatArray, FloatArray]:
    """Return of each side, anticlockwise, where it begins and its unit normal inwards: ``(sides, 2)`` both."""
    start = np.array(corners)
    along = np.roll(start, -1, axis=0) - start
    return start, np.stack([-along[:, 1], along[:, 0]], axis=1) / np.hypot(along[:, :1], along[:, 1:])


# ---- infrared --------------------------------------------------------------------------------------------------------


def infrared_distances(config: Config, poses: FloatArray, movables: FloatArray) -> FloatArray:
    """Return how far from the rim each ray first meets something [m]: ``(n, rays)``; 0 within it, infinite: nothing.

    Rays start at the rim and lead straight away from the robot's middle.
    """
    around = surroundings_of(config)
    bearings = poses[:, 2:] + np.radians(config.sensors.infrared_yaw_deg)
    rays = np.stack([np.cos(bearings), np.sin(bearings)], axis=-1)
    from_middle = [_to_walls(config, poses, rays), _to_robots(config, poses, rays)]
    from_middle += [_to_thing(config, poses, one, np.array(one.pose), rays) for one in around.obstacles]
    if config.sensors.infrared_target == "all":
        from_middle += [
            _to_thing(config, poses, one, pose, rays) for one, pose in zip(around.movables, movables, strict=True)
        ]
    return np.asarray(np.maximum(np.min(from_middle, axis=0) - config.robot.radius, 0))


def infrared_readings(config: Config, distances: FloatArray) -> FloatArray:
    """Return the curve at these distances over its first value: in [0, 1], 0 beyond its end."""
    curve = np.array(config.sensors.infrared_curve)
    return np.asarray(np.interp(distances, curve[:, 0], curve[:, 1], right=0) / curve[0, 1])


def _to_walls(config: Config, poses: FloatArray, rays: FloatArray) -> FloatArray:
    at = poses[:, np.newaxis, :2]
    if config.arena.shape == "circle":
        along, radius = (at * rays).sum(axis=-1), config.arena.size / 2
        return np.asarray(np.sqrt(along**2 + radius**2 - (at**2).sum(axis=-1)) - along)
    if config.arena.shape == "polygon":
        corners = list(config.arena.corners)
        closing = -(rays @ _sides(corners)[1].T)  # how fast a ray nears each side
        gaps = _to_sides(corners, at)
        with np.errstate(divide="ignore"):
            return np.asarray(np.where(closing > 0, gaps / closing, np.inf).min(axis=-1))
    _, east, _, north = config.arena.bounds
    with np.errstate(divide="ignore"):
        ways = (np.array([east, north]) - np.sign(rays) * at) / np.abs(rays)
    return np.asarray(ways.min(axis=-1))


def _to_robots(config: Config, poses: FloatArray, rays: FloatArray) -> FloatArray:
    """Return the way to where a ray comes into a robot, from who sends it; robots behind the rim are not seen."""
    offsets = (poses[np.newaxis, :, :2] - poses[:, np.newaxis, :2])[:, :, np.newaxis]  # (who looks, at whom, 1, 2)
    ways = _to_disc(config, offsets, rays[:, np.newaxis], config.robot.radius)
    ways[np.diag_indices(len(poses))] = np.inf
    return np.asarray(ways.min(axis=1))


def _to_thing(
    config: Config, poses: FloatArray, thing: Movable | Obstacle, pose: FloatArray, rays: FloatArray
) -> FloatArray:
    offsets = (pose[:2] - poses[:, :2])[:, np.newaxis]
    if thing.shape == "cylinder":
        return _to_disc(config, offsets, rays, thing.size[0] / 2)
    # To where a ray has come between both pairs of a box's sides.
    half = np.array(thing.size) / 2
    at, sent = in_frame(-offsets, pose[2]), in_frame(rays, pose[2])
    with np.errstate(divide="ignore"):
        to_sides = np.stack([(-half - at) / sent, (half - at) / sent])
    near, far = to_sides.min(axis=0).max(axis=-1), to_sides.max(axis=0).min(axis=-1)
    return np.where((near <= far) & (far > config.robot.radius), near, np.inf)


def _to_disc(config: Config, offsets: FloatArray, rays: FloatArray, radius: float) -> FloatArray:
    """Return the way to where rays come into a disc whose middle is at ``offsets``; infinite where it is not seen."""
    along = (offsets * rays).sum(axis=-1)
    across = offsets[..., 0] * rays[..., 1] - offsets[..., 1] * rays[..., 0]
    half_chord = np.sqrt(np.maximum(radius**2 - across**2, 0))
    is_seen = (np.abs(across) < radius) & (along + half_chord > config.robot.radius)
    return np.where(is_seen, along - half_chord, np.inf)


# ---- touch -----------------------------------------------------------------------------------------------------------


def touch_readings(config: Config, poses: FloatArray, movables: FloatArray) -> FloatArray:
    """Return what the touch sensors say: ``(n, sensors)``.

    They answer to each movable's nearest point, those in whose sectors it is.
    """
    sensors = config.sensors
    found = np.zeros((len(poses), len(sensors.touch_yaw_deg)))
    for thing, pose in zip(surroundings_of(config).movables, movables, strict=True):
        at = in_frame(poses[:, :2] - pose[:2], pose[2])
        if thing.shape == "cylinder":
            away = np.hypot(at[:, :1], at[:, 1:])
            to_thing = at * (thing.size[0] / 2 / away - 1)
        else:
            half = np.array(thing.size) / 2
            to_thing = np.clip(at, -half, half) - at
        gaps = np.maximum(np.hypot(to_thing[:, 0], to_thing[:, 1]) - config.robot.radius, 0)
        bearings = np.arctan2(to_thing[:, 1], to_thing[:, 0]) + pose[2] - poses[:, 2]
        off = bearings[:, np.newaxis] - np.radians(sensors.touch_yaw_deg)
        within = np.abs(np.angle(np.exp(1j * off))) <= np.radians(sensors.touch_half_width_deg)
        near = gaps <= sensors.touch_range
        readings = near * (1.0 if sensors.touch_mode == "binary" else 1 - gaps / sensors.touch_range)
        found = np.maximum(found, within * readings[:, np.newaxis])
    return found


# ---- emitters --------------------------------------------------------------------------------------------------------


class Source(NamedTuple):
    """An emitter, and what robots have of it."""

    emitter: models.Emitter
    distances: FloatArray
    """From the receivers on the robots' tops, in space [m]: ``(n,)``."""
    bearings: FloatArray
    """From ahead, to the left [rad]: ``(n,)``."""

    @property
    def is_heard(self) -> BoolArray:
        """Whether it reaches them: ``(n,)``."""
        return np.asarray((self.emitter.reach == "arena") | (self.distances <= self.emitter.range))

    @property
    def strengths(self) -> FloatArray:
        """1/r^2 within its limits, its least where it is not heard: ``(n,)``."""
        with np.errstate(divide="ignore"):
            heard = np.clip(1 / self.distances**2, *self.emitter.strength)
        return np.where(self.is_heard, heard, self.emitter.strength[0])


def sources(config: Config, poses: FloatArray, movables: FloatArray) -> list[Source]:
    """Return what robots have of each emitter; one that rides goes and turns with what carries it."""
    listed = config.scene.emitters
    return [_source(config, poses, movables, one) for one in ((config.emitter,) if listed is None else listed)]


def _source(config: Config, poses: FloatArray, movables: FloatArray, emitter: models.Emitter) -> Source:
    x, y, z = emitter.position
    if emitter.rides_on is not None:
        carrier = movables[emitter.rides_on]
        x, y = carrier[:2] + in_frame(np.array([x, y]), -carrier[2])
    to_x, to_y = x - poses[:, 0], y - poses[:, 1]
    distances = np.sqrt(to_x**2 + to_y**2 + (config.robot.height - z) ** 2)
    return Source(emitter, distances, np.asarray(np.arctan2(to_y, to_x) - poses[:, 2]))


def lights(config: Config, poses: FloatArray, movables: FloatArray) -> list[Source]:
    """Return the sources that are lights."""
    return [one for one in sources(config, poses, movables) if one.emitter.channel == "light"]


def radio_sources(config: Config, poses: FloatArray, movables: FloatArray) -> list[list[Source]]:
    """Return the sources that are no lights, those of each channel in a list, channels as they come first."""
    channels: dict[str, list[Source]] = {}
    for one in sources(config, poses, movables):
        if one.emitter.channel != "light":
            channels.setdefault(one.emitter.channel, []).append(one)
    return list(channels.values())


def homing_sources(config: Config, poses: FloatArray, movables: FloatArray) -> list[Source]:
    """Return those that robots home in on: of the first channel."""
    return next(iter(radio_sources(config, poses, movables)), [])


def strongest(channel: Sequence[Source]) -> FloatArray:
    """Return S of the strongest: ``(n,)``."""
    return np.asarray(np.max([one.strengths for one in channel], axis=0))


def nearest_bearings(channel: Sequence[Source]) -> FloatArray:
    """Return the bearing of the nearest that is heard [rad]: ``(n,)``; NaN: none is."""
    heard = [(np.where(one.is_heard, one.distances, np.inf), one.bearings) for one in channel]
    distances, bearings = np.array(heard).transpose(1, 2, 0)
    nearest = distances.argmin(axis=-1)[:, np.newaxis]
    found = np.take_along_axis(bearings, nearest, axis=-1)[:, 0]
    return np.where(np.isfinite(distances.min(axis=-1)), found, np.nan)


# ---- sectors all round -----------------------------------------------------------------------------------------------


def sector_of(bearings: FloatArray, sectors: int) -> FloatArray:
    """Return in which sector bearings from ahead to the left [rad] are: the first one's middle is ahead."""
    return np.asarray(np.floor(np.mod(bearings / (2 * np.pi) * sectors + 0.5, sectors)))


def in_sectors(bearings: FloatArray, readings: FloatArray, sectors: int) -> FloatArray:
    """Return the largest of readings ``(n, things)`` in each sector by the things' bearings: ``(n, sectors)``."""
    where = sector_of(bearings, sectors)[..., np.newaxis] == np.arange(sectors)
    return np.asarray(np.where(where, readings[..., np.newaxis], 0.0).max(axis=1, initial=0.0))


def neighbours(poses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return how far each robot is from each [m], infinite from itself, and at which bearing [rad]: ``(n, n)`` both."""
    away = poses[np.newaxis, :, :2] - poses[:, np.newaxis, :2]
    distances = np.hypot(away[..., 0], away[..., 1])
    np.fill_diagonal(distances, np.inf)
    return distances, np.arctan2(away[..., 1], away[..., 0]) - poses[:, 2:]


# ---- what counts as done ---------------------------------------------------------------------------------------------

AT_WALL = 0.002
"""What is as near to a wall that is a goal touches it [m]."""


def are_home(config: Config, poses: FloatArray, movables: FloatArray) -> BoolArray:
    """Return which robots are within the range of an emitter that they home in on: ``(n,)``."""
    found = homing_sources(config, poses, movables)
    near: BoolArray = np.zeros(len(poses), dtype=np.bool_)
    for one in found:
        near |= one.distances <= one.emitter.range
    return near


def are_at_goal(config: Config, movables: FloatArray) -> BoolArray:
    """Return which movables touch a wall that is a goal, or have their middle in a region that is one: ``(m,)``."""
    listed = config.scene.goals
    goals = [models.Goal(wall=config.arena.target_wall)] if listed is None else listed
    return np.array(
        [
            any(_is_at(config, goal, thing, pose) for goal in goals)
            for thing, pose in zip(surroundings_of(config).movables, movables, strict=True)
        ],
        dtype=bool,
    )


def _is_at(config: Config, goal: models.Goal, thing: Movable, pose: FloatArray) -> bool:
    if goal.wall is not None:
        return way_to_wall(config, goal.wall, thing, pose) <= AT_WALL
    west, east, south, north = goal.region or (np.nan,) * 4  # it is one or the other
    return bool(west <= pose[0] <= east and south <= pose[1] <= north)


def way_to_wall(config: Config, wall: str, thing: Movable, pose: FloatArray) -> float:
    """Return how far a thing's farthest point is from a wall of a rectangular arena [m]."""
    _, east, _, north = config.arena.bounds
    outwards = np.array(OUTWARDS[wall])
    if thing.shape == "cylinder":
        farthest = float(pose[:2] @ outwards) + thing.size[0] / 2
    else:
        length, width = thing.size
        corners = np.array([(x, y) for x in (-length / 2, length / 2) for y in (-width / 2, width / 2)])
        farthest = float(((pose[:2] + in_frame(corners, -pose[2])) @ outwards).max())
    return float(np.abs(outwards) @ (east, north)) - farthest

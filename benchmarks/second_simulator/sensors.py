# SPDX-License-Identifier: BSD-3-Clause
"""What robots sense, without noise, by plane geometry.

In all functions ``poses`` are of the robots, ``(n, 3)``, and ``box`` is that of the box, ``(3,)``: x [m], y [m],
heading [rad].
"""

from __future__ import annotations

import numpy as np

from swarmevo.config import Config
from swarmevo.protocols import BoolArray, FloatArray

# ---- infrared --------------------------------------------------------------------------------------------------------


def infrared_distances(config: Config, poses: FloatArray, box: FloatArray) -> FloatArray:
    """Return how far from the rim each ray first meets something [m]: ``(n, 8)``; 0 within it, infinite where nothing.

    Rays start at the rim and lead straight away from the robot's middle.
    """
    bearings = poses[:, 2:] + np.radians(config.sensors.infrared_yaw_deg)
    rays = np.stack([np.cos(bearings), np.sin(bearings)], axis=-1)
    from_middle = [_to_walls(config, poses, rays), _to_robots(config, poses, rays)]
    if config.sensors.infrared_target == "all":
        from_middle.append(_to_box(config, poses, box, rays))
    return np.asarray(np.maximum(np.min(from_middle, axis=0) - config.robot.radius, 0))


def infrared_readings(config: Config, distances: FloatArray) -> FloatArray:
    """Return the curve at these distances over its first value: in [0, 1], 0 beyond its end."""
    curve = np.array(config.sensors.infrared_curve)
    return np.asarray(np.interp(distances, curve[:, 0], curve[:, 1], right=0) / curve[0, 1])


def _to_walls(config: Config, poses: FloatArray, rays: FloatArray) -> FloatArray:
    at = poses[:, np.newaxis, :2]
    with np.errstate(divide="ignore"):
        ways = (config.arena.size / 2 - np.sign(rays) * at) / np.abs(rays)
    return np.asarray(ways.min(axis=-1))


def _to_robots(config: Config, poses: FloatArray, rays: FloatArray) -> FloatArray:
    """Return the way to where a ray comes into a robot, from who sends it; robots behind the rim are not seen."""
    radius = config.robot.radius
    offsets = (poses[np.newaxis, :, :2] - poses[:, np.newaxis, :2])[:, :, np.newaxis]  # (who looks, at whom, 1, 2)
    sent = rays[:, np.newaxis]
    along = (offsets * sent).sum(axis=-1)
    across = offsets[..., 0] * sent[..., 1] - offsets[..., 1] * sent[..., 0]
    half_chord = np.sqrt(np.maximum(radius**2 - across**2, 0))
    seen = (np.abs(across) < radius) & (along + half_chord > radius)
    seen[np.diag_indices(len(poses))] = False
    return np.asarray(np.where(seen, along - half_chord, np.inf).min(axis=1))


def _to_box(config: Config, poses: FloatArray, box: FloatArray, rays: FloatArray) -> FloatArray:
    """Return the way to where a ray has come between both pairs of the box's sides."""
    half = np.array(config.box.size[:2]) / 2
    at, sent = _in_box_frame(poses[:, :2] - box[:2], box)[:, np.newaxis], _in_box_frame(rays, box)
    with np.errstate(divide="ignore"):
        to_sides = np.stack([(-half - at) / sent, (half - at) / sent])
    near, far = to_sides.min(axis=0).max(axis=-1), to_sides.max(axis=0).min(axis=-1)
    return np.where((near <= far) & (far > config.robot.radius), near, np.inf)


def _in_box_frame(vectors: FloatArray, box: FloatArray) -> FloatArray:
    c, s = np.cos(box[2]), np.sin(box[2])
    return np.asarray(vectors @ np.array([[c, -s], [s, c]]))


# ---- box sensors -----------------------------------------------------------------------------------------------------


def touch_readings(config: Config, poses: FloatArray, box: FloatArray) -> FloatArray:
    """Return what the four box sensors say: ``(n, 4)``. The one answers in whose sector the box's nearest point is."""
    sensors = config.sensors
    half = np.array(config.box.size[:2]) / 2
    at = _in_box_frame(poses[:, :2] - box[:2], box)
    to_box = np.clip(at, -half, half) - at
    gaps = np.maximum(np.hypot(to_box[:, 0], to_box[:, 1]) - config.robot.radius, 0)
    bearings = np.arctan2(to_box[:, 1], to_box[:, 0]) + box[2] - poses[:, 2]
    off = bearings[:, np.newaxis] - np.radians(sensors.touch_yaw_deg)
    within = np.abs(np.angle(np.exp(1j * off))) <= np.radians(sensors.touch_half_width_deg)
    near = gaps <= sensors.touch_range
    readings = near * (1.0 if sensors.touch_mode == "binary" else 1 - gaps / sensors.touch_range)
    return np.asarray(within * readings[:, np.newaxis])


# ---- the emitter -----------------------------------------------------------------------------------------------------


def emitter_distances(config: Config, poses: FloatArray) -> FloatArray:
    """Return how far the receivers on the robots' tops are from the emitter, in space [m]: ``(n,)``."""
    x, y, z = config.emitter.position
    return np.asarray(np.sqrt((poses[:, 0] - x) ** 2 + (poses[:, 1] - y) ** 2 + (config.robot.height - z) ** 2))


def signal_strengths(config: Config, poses: FloatArray) -> FloatArray:
    """Return S: ``(n,)``, 1/r^2 within its limits, its least where the emitter is not heard."""
    r = emitter_distances(config, poses)
    with np.errstate(divide="ignore"):
        heard = np.clip(1 / r**2, *config.emitter.strength)
    everywhere = config.emitter.reach == "arena"
    return np.where(everywhere | (r <= config.emitter.range), heard, config.emitter.strength[0])


# ---- what counts as done ---------------------------------------------------------------------------------------------

AT_WALL = 0.002
"""A corner of the box that is as near to the target wall touches it [m]."""


def are_home(config: Config, poses: FloatArray) -> BoolArray:
    """Return which robots are within the emitter's range: ``(n,)``."""
    return np.asarray(emitter_distances(config, poses) <= config.emitter.range)


def is_box_at_wall(config: Config, box: FloatArray) -> bool:
    """Return whether a corner of the box touches the target wall."""
    length, width, _ = config.box.size
    corners = np.array([(x, y) for x in (-length / 2, length / 2) for y in (-width / 2, width / 2)])
    c, s = np.cos(box[2]), np.sin(box[2])
    outwards = {"north": (0, 1), "south": (0, -1), "east": (1, 0), "west": (-1, 0)}[config.arena.target_wall]
    farthest = (box[:2] + corners @ np.array([[c, s], [-s, c]])) @ np.array(outwards)
    return bool(farthest.max() >= config.arena.size / 2 - AT_WALL)

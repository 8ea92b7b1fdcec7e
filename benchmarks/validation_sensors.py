# SPDX-License-Identifier: BSD-3-Clause
"""Sensors against brute force, through the public interface: random scenes of one control step.

The references share nothing with the library but the poses: infrared rays march by the distance to the nearest surface,
touch sensors look for the nearest of many points on the box's outline, RF is computed from its definition.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from benchmarks.cases import changed
from benchmarks.validation_scenes import (
    Section,
    Settings,
    keys,
    millimetres,
    sound,
    standing,
    table,
    turn,
    wheels,
    without_noise,
)
from swarmevo.config import Config
from swarmevo.protocols import BoolArray, FloatArray, IntArray
from swarmevo.simulation import Scene, simulate

ROBOTS, ARENA = 8, 0.6
"""Many robots in little room [m], so that sensors have something to see."""
TOUCH_RANGE = 0.05
"""Far enough that touch sensors are asked often [m]."""

_BOXES = 25  # poses of the box
_STRIDE = 1e-9  # a ray that is this near to a surface has met it [m]
_OUTLINE = 4e-4  # between points on the box's outline [m]


class Scenes(NamedTuple):
    """Random scenes and what the robots sense in them. First axes: scenes, robots."""

    config: Config
    robots: FloatArray
    """``(n, robots, 3)``"""
    box: FloatArray
    """``(n, 3)``"""
    infrared: FloatArray
    touch: FloatArray
    rf: FloatArray


class Check(NamedTuple):
    """How a sensor compares with its reference."""

    name: str
    readings: int
    answering: int
    """Readings of something."""
    largest: float
    """Largest deviation of a reading."""
    undecided: int
    """Readings left out, because they lie on an edge within the reference's precision."""


def draw(n: int, threads: int) -> list[Scenes]:
    """Return about ``n`` random scenes, a part of them for each of some poses of the box."""
    rng = np.random.default_rng(5)
    parts = []
    for i in range(_BOXES):
        config = _scene(tuple(rng.uniform([-0.1, -0.1, -np.pi], [0.1, 0.1, np.pi])))
        count = max(1, n // _BOXES)
        drivers = np.zeros((count, ROBOTS), dtype=np.uint32)
        channels = ("pose", "box", "infrared", "touch", "rf")
        policy = wheels([(0.0, 0.0)])
        done = sound(
            simulate(Scene(config), policy, keys(count, first=i * count), drivers, channels, threads)
        ).telemetry
        poses, box, infrared, touch, rf = (getattr(done, channel)[:, 0] for channel in channels)
        parts.append(Scenes(config, poses, box, infrared, touch, rf))
    return parts


def _scene(box: tuple[float, ...]) -> Config:
    room = ARENA / 2 - Config().robot.radius
    return changed(
        without_noise(Config()),
        arena={"size": ARENA},
        box={"pose": box},
        emitter={"position": (box[0], box[1], 0.03)},
        team={"robots": ROBOTS, "start": "random", "start_region": (-room, room, -room, room)},
        sensors={"infrared_target": "all", "touch_mode": "graded", "touch_range": TOUCH_RANGE},
        episode={"horizon": Config().physics.time_step, "control_period": Config().physics.time_step},
    )


# ---- references ------------------------------------------------------------------------------------------------------


def distance_to_box(points: FloatArray, box: FloatArray, size: tuple[float, ...]) -> FloatArray:
    """Return the distances of points ``(n, 2)`` from boxes ``(n, 3)``, 0 inside."""
    offset = points - box[:, :2]
    c, s = np.cos(box[:, 2]), np.sin(box[:, 2])
    local = np.stack([c * offset[:, 0] + s * offset[:, 1], c * offset[:, 1] - s * offset[:, 0]], axis=1)
    beyond = np.maximum(np.abs(local) - np.array(size[:2]) / 2, 0)
    return np.asarray(np.hypot(beyond[:, 0], beyond[:, 1]))


def march(scenes: Scenes) -> FloatArray:
    """Return the distance that each infrared ray meets something at, infinite beyond the range ``(n, robots, 8)``.

    From the rim outwards, each time as far as nothing can be (the distance to the nearest surface).
    """
    config, n = scenes.config, len(scenes.robots)
    yaw = np.radians(config.sensors.infrared_yaw_deg)
    bearing = scenes.robots[:, :, 2:] + yaw
    direction = np.stack([np.cos(bearing), np.sin(bearing)], axis=-1).reshape(-1, 2)
    origin = np.repeat(scenes.robots[:, :, :2], len(yaw), axis=1).reshape(-1, 2) + config.robot.radius * direction
    scene = np.repeat(np.arange(n), ROBOTS * len(yaw))
    owner = np.tile(np.repeat(np.arange(ROBOTS), len(yaw)), n)

    reach = config.sensors.infrared_curve[-1][0]
    way, met = np.zeros(len(scene)), np.full(len(scene), np.inf)
    active = np.arange(len(scene))
    while len(active):
        points = origin[active] + way[active, np.newaxis] * direction[active]
        free = _free_distance(scenes, scene[active], owner[active], points)
        arrived = free < _STRIDE
        met[active[arrived]] = way[active[arrived]]
        way[active] += free
        active = active[~arrived & (way[active] <= reach)]
    return met.reshape(n, ROBOTS, len(yaw))


def _free_distance(scenes: Scenes, scene: IntArray, owner: IntArray, points: FloatArray) -> FloatArray:
    """Return how far each point is from everything but its owner."""
    config = scenes.config
    nearest = config.arena.size / 2 - np.abs(points).max(axis=1)
    nearest = np.minimum(nearest, distance_to_box(points, scenes.box[scene], config.box.size))
    for robot in range(ROBOTS):
        gap = np.linalg.norm(points - scenes.robots[scene, robot, :2], axis=1) - config.robot.radius
        nearest = np.where(owner == robot, nearest, np.minimum(nearest, gap))
    return np.asarray(np.maximum(nearest, 0))


def response(distance: FloatArray, config: Config) -> FloatArray:
    """Return the infrared reading for a distance: the curve over its first value, 0 beyond its end."""
    curve = np.array(config.sensors.infrared_curve)
    return np.asarray(np.interp(distance, curve[:, 0], curve[:, 1], right=0) / curve[0, 1])


def nearest_on_outline(scenes: Scenes) -> tuple[FloatArray, FloatArray]:
    """Return for each robot the distance of its rim to the nearest of many points on the box, and its bearing."""
    half = np.array(scenes.config.box.size[:2]) / 2
    sides = []
    for axis in (0, 1):
        along = np.arange(-half[axis], half[axis] + _OUTLINE / 2, _OUTLINE)
        for sign in (-1, 1):
            side = np.empty((len(along), 2))
            side[:, axis], side[:, 1 - axis] = along, sign * half[1 - axis]
            sides.append(side)
    corners = np.array([[x, y] for x in (-half[0], half[0]) for y in (-half[1], half[1])])
    outline = np.concatenate([*sides, corners])
    x, y, heading = scenes.box[0]  # the same in all scenes of a part
    c, s = np.cos(heading), np.sin(heading)
    world = outline @ np.array([[c, s], [-s, c]]) + (x, y)
    robots = scenes.robots.reshape(-1, 3)
    gaps, bearings = np.empty(len(robots)), np.empty(len(robots))
    for i, (rx, ry, rh) in enumerate(robots):
        squares = (world[:, 0] - rx) ** 2 + (world[:, 1] - ry) ** 2
        best = int(squares.argmin())
        gaps[i] = np.sqrt(squares[best]) - scenes.config.robot.radius
        bearings[i] = turn(np.arctan2(world[best, 1] - ry, world[best, 0] - rx) - rh)
    return gaps.reshape(-1, ROBOTS), bearings.reshape(-1, ROBOTS)


def signal_strength(scenes: Scenes) -> FloatArray:
    """Return S: 1 / r^2 in three dimensions within its limits, the smallest out of range."""
    emitter, robot = scenes.config.emitter, scenes.config.robot
    receivers = np.concatenate([scenes.robots[..., :2], np.full((*scenes.robots.shape[:2], 1), robot.height)], axis=-1)
    r = np.linalg.norm(receivers - np.array(emitter.position), axis=-1)
    heard = np.clip(1 / r**2, *emitter.strength)
    return np.where(r <= emitter.range, heard, emitter.strength[0])


# ---- checks ----------------------------------------------------------------------------------------------------------


def check_infrared(parts: list[Scenes]) -> Check:
    """Compare all infrared readings with marching rays."""
    expected = np.concatenate([response(march(part), part.config) for part in parts])
    found = np.concatenate([part.infrared for part in parts])
    return _compare("infrared", found, expected, np.zeros(found.shape, dtype=bool))


def check_touch(parts: list[Scenes]) -> Check:
    """Compare all touch readings with the nearest point of the outline."""
    expected, found, undecided = [], [], []
    for part in parts:
        gap, bearing = nearest_on_outline(part)
        sensors = part.config.sensors
        off = np.abs(turn(bearing[..., np.newaxis] - np.radians(sensors.touch_yaw_deg)))
        inside = off <= np.radians(sensors.touch_half_width_deg)
        near = (gap <= sensors.touch_range)[..., np.newaxis]
        expected.append(np.where(inside & near, 1 - np.maximum(gap, 0)[..., np.newaxis] / sensors.touch_range, 0))
        found.append(part.touch)
        # The outline's points are some tenths of a millimetre apart: seen from a robot's centre, half a degree.
        undecided.append(np.abs(off - np.radians(sensors.touch_half_width_deg)) < np.radians(0.5))
    return _compare("touch", np.concatenate(found), np.concatenate(expected), np.concatenate(undecided))


def check_rf(parts: list[Scenes]) -> Check:
    """Compare all signal strengths with their definition, relative to them."""
    expected = np.concatenate([signal_strength(part) for part in parts])
    found = np.concatenate([part.rf for part in parts])
    check = _compare("RF", found / expected, np.ones(found.shape), np.zeros(found.shape, dtype=bool))
    return check._replace(answering=int((expected > Config().emitter.strength[0]).sum()))


def _compare(name: str, found: FloatArray, expected: FloatArray, undecided: BoolArray) -> Check:
    deviation = np.where(undecided, 0, np.abs(found - expected))
    return Check(name, found.size, int((expected > 0).sum()), float(deviation.max()), int(undecided.sum()))


class Spread(NamedTuple):
    """An infrared sensor that looks at a wall for a while."""

    distance: float  # [m]
    expected: float
    mean: float
    deviation: float
    """Relative standard deviation of its readings."""


def infrared_spread(distance: float, readings: int) -> Spread:
    """Measure the noise of ps2, which looks straight to the right, at a wall."""
    defaults = Config()
    x = defaults.arena.size / 2 - defaults.robot.radius - distance
    heading = float(turn(-np.radians(defaults.sensors.infrared_yaw_deg[2])))
    config = changed(standing([(x, -0.1, heading)]), noise=defaults.noise.model_dump())
    config = changed(config, episode={"horizon": readings * config.episode.control_period})
    drivers = np.zeros((1, 1), dtype=np.uint32)
    done = sound(simulate(Scene(config), wheels([(0.0, 0.0)]), keys(1), drivers, ("infrared",)))
    values = done.telemetry.infrared[0, :, 0, 2]
    exact = float(response(np.array(distance), config))
    return Spread(distance, exact, float(values.mean()), float(values.std() / exact) if exact > 0 else 0.0)


# ---- the page --------------------------------------------------------------------------------------------------------


def section(settings: Settings) -> Section:
    """Measure, and write this part of the page."""
    parts = draw(settings.scenes, settings.threads)
    checks = [check_infrared(parts), check_touch(parts), check_rf(parts)]
    scenes = sum(len(part.robots) for part in parts)
    rows = [[c.name, c.readings, c.answering, c.undecided, f"{c.largest:.1e}"] for c in checks]
    head = ["sensor", "readings", "of something", "left out at edges", "largest deviation"]
    return Section(
        f"""## Sensors

{scenes} random scenes of {ROBOTS} robots and the box in an arena of {ARENA:g} m, without noise, infrared sensors
seeing the box
too, touch sensors graded over {millimetres(TOUCH_RANGE):g} mm. The references: rays that march by the distance to the
nearest
surface; the nearest of points every {millimetres(_OUTLINE):g} mm on the box's outline (hence the deviation, and the
sectors'
edges that it cannot decide); 1/r^2 in three dimensions.

{table(head, rows)}
The deviations are of readings in [0, 1]; of RF, relative to S.

{_spread_text()}
Odd places are in the native tests: rays that start inside a body, run along an edge, touch a disc or hit a corner;
robots that touch two walls, a wall and the box, or overlap a little.
""",
        {},
    )


def _spread_text() -> str:
    readings = 3000
    points = [point for point, _ in Config().sensors.infrared_curve]
    distances = sorted({*points[:1], *((a + b) / 2 for a, b in pairwise(points)), *points[1:-1]})
    rows = [
        [f"{millimetres(s.distance):g}", f"{s.expected:.4f}", f"{s.mean:.4f}", f"{100 * s.deviation:.2f} %"]
        for s in (infrared_spread(distance, readings) for distance in distances)
    ]
    noise = Config().noise
    return f"""An infrared sensor before a wall, {readings} readings with the default noise
({100 * noise.infrared:g} %, at contact {100 * noise.infrared_at_contact:g} %,
linear between over the curve's first interval; at contact half of the noise is
cut off,
since a reading ends at 1):

{table(["distance [mm]", "curve", "mean reading", "relative deviation"], rows)}"""

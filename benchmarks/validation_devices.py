# SPDX-License-Identifier: BSD-3-Clause
"""Every device of a robot against brute force, in random scenes of all that a scene can have.

Written from docs/robots.md and docs/scenes.md. What shares nothing with the library are the surroundings as the
reference has them, the distance of a point to each of them, rays that march by it, and points on outlines.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from itertools import pairwise
from typing import Any, Literal, NamedTuple

import numpy as np

from benchmarks import validation_objects as objects
from benchmarks.cases import changed
from benchmarks.reference import Movable, Obstacle
from benchmarks.twin import surroundings_of, twin
from benchmarks.validation_scenes import Section, Settings, in_parallel, sound, table, turn, without_noise
from benchmarks.validation_sensors import response
from swarmevo.config import Config, models
from swarmevo.protocols import BoolArray, FeedForward, FloatArray
from swarmevo.simulation import EpisodeKey, Scene, simulate

ROBOTS, MESSAGE = 8, 2
YAWS = tuple(np.linspace(-180, 170, 25).round(1).tolist())
"""Of infrared rays [deg]."""
TOUCH_YAWS, TOUCH_HALF_WIDTH, TOUCH_RANGE = (90.0, 30.0, -30.0, -90.0, -150.0, 150.0), 30.0, 0.08
SECTORS = {"range_and_bearing": 5, "light": 3}
SPOTS = ((0.03, 0.01), (-0.02, -0.02))
ARENAS: tuple[Mapping[str, Any], ...] = (
    {"shape": "circle", "size": 1.3},
    {"shape": "rectangle", "sides": (1.4, 1.1)},
    {"shape": "polygon", "corners": ((-0.6, -0.5), (0.5, -0.6), (0.75, 0.1), (0.1, 0.7), (-0.6, 0.4))},
)
DEVICES = ("infrared", "touch", "rf", "rf_bearing", "range_and_bearing", "ground", "light")

_STRIDE = 1e-10  # a ray that is this near to a surface has met it [m]
_OUTLINE = 2000  # points on an outline
_EDGE = np.radians(0.5)  # from a sector's edge within which points on outlines do not tell [rad]


# ---- random scenes ---------------------------------------------------------------------------------------------------


def random_config(number: int) -> Config:
    """Return a world of one control step with robots and movables anywhere, among obstacles, lights and patches."""
    rng = np.random.default_rng((7, number))

    def place(x: float, y: float, heading: float = np.pi) -> tuple[float, float, float]:
        return (x + rng.uniform(-0.05, 0.05), y + rng.uniform(-0.05, 0.05), rng.uniform(-heading, heading))

    def size(round_one: bool) -> tuple[float, float, float]:
        length, width = rng.uniform(0.05, 0.12, 2).tolist()
        return (length, length if round_one else width, 0.03)

    anywhere: dict[str, Any] = {"start": "random", "start_region": (-0.35, 0.35, -0.2, 0.4), "mass": 0.05}
    shapes: tuple[Literal["box", "cylinder"], ...] = ("cylinder", "box", "cylinder", "box")
    wall_x, wall_y, _ = place(0.0, -0.4)
    emitters: tuple[dict[str, Any], ...] = (
        {"position": place(0.2, 0.3, 0.1), "range": 0.4, "strength": (1.0, 30.0)},
        {"rides_on": 1, "position": (0.04, -0.02, 0.03), "range": 0.25, "strength": (1.0, 30.0)},
        {"channel": "prey", "rides_on": 0, "position": (0.0, 0.0, 0.03), "strength": (1.0, 20.0)},
        {"channel": "light", "position": place(-0.3, 0.1, 0.1), "range": 0.5, "strength": (0.0, 40.0)},
        {"channel": "light", "rides_on": 3, "position": (-0.03, 0.02, 0.1), "reach": "arena", "strength": (0.5, 15.0)},
    )
    return changed(
        without_noise(Config()),
        arena=dict(ARENAS[number % len(ARENAS)]),
        robot={"sensors": DEVICES},
        team={"robots": ROBOTS, "start": "random", "start_region": (-0.5, 0.5, -0.5, 0.45)},
        sensors={
            "infrared_yaw_deg": YAWS,
            "infrared_target": ("all", "walls_and_robots")[number % 2],
            "infrared_curve": ((0.0, 100.0), (0.02, 80.0), (0.25, 10.0)),
            "touch_yaw_deg": TOUCH_YAWS,
            "touch_half_width_deg": TOUCH_HALF_WIDTH,
            "touch_range": TOUCH_RANGE,
            "touch_mode": ("graded", "binary")[number // 2 % 2],
            "range_and_bearing_range": 0.4,
            "range_and_bearing_sectors": SECTORS["range_and_bearing"],
            "range_and_bearing_message": MESSAGE,
            "light_sectors": SECTORS["light"],
            "ground_position": SPOTS,
        },
        scene={
            "movables": tuple(models.Movable(shape=s, size=size(s == "cylinder"), **anywhere) for s in shapes),
            "obstacles": (
                models.Obstacle(shape="box", size=(0.15, 0.06, 0.1), pose=place(-0.4, 0.05)),
                models.Obstacle(shape="cylinder", size=(0.1, 0.1, 0.1), pose=place(0.35, -0.2)),
                models.Obstacle(
                    shape="wall", ends=((wall_x - 0.15, wall_y), (wall_x + 0.1, wall_y + 0.06)), thickness=0.02
                ),
            ),
            "emitters": tuple(models.Emitter(**one) for one in emitters),
            "goals": (),
            "grey": 0.5,
            "patches": (
                models.Patch(shape="box", size=(0.5, 0.3), pose=place(0.1, 0.1), grey=0.2),
                models.Patch(shape="cylinder", size=(0.4, 0.4), pose=place(-0.1, 0.0), grey=0.9),
            ),
        },
        episode={"horizon": 0.1},
    )


class Moment(NamedTuple):
    """What is where, and what each robot observes."""

    config: Config
    robots: FloatArray
    """``(robots, 3)``"""
    movables: FloatArray
    """``(movables, 3)``"""
    observations: dict[str, FloatArray]
    """By device, ``(robots, width)``."""


def moments(config: Config, n: int, seed: int = 5) -> list[Moment]:
    """Return the first moments of ``n`` episodes."""
    scene = Scene(config)
    info = scene.info
    still = FeedForward(
        np.zeros((1, 0, info.observations)), np.zeros((1, info.commands, 0)), np.zeros((1, 0), dtype=bool), bias=False
    )
    keys = [EpisodeKey(seed, 0, 0, repeat) for repeat in range(n)]
    drivers = np.zeros((n, info.robots), dtype=np.uint32)
    channels = simulate(scene, still, keys, drivers, ["pose", "movables", "observation"]).telemetry
    devices = devices_of(info.observation_names, config.robot.sensors)
    return [
        Moment(config, pose, movables, {name: seen[:, where] for name, where in devices.items()})
        for pose, movables, seen in zip(
            channels.pose[:, 0], channels.movables[:, 0], channels.observation[:, 0], strict=True
        )
    ]


def devices_of(names: Sequence[str], devices: Sequence[str]) -> dict[str, list[int]]:
    """Return where each device's readings are among the observations; those of ``rf_bearing`` are none of ``rf``."""
    longest_first = sorted(devices, key=len, reverse=True)
    owners = [next(device for device in longest_first if name.startswith(device)) for name in names]
    return {device: [i for i, owner in enumerate(owners) if owner == device] for device in devices}


# ---- geometry --------------------------------------------------------------------------------------------------------


def in_frame(pose: FloatArray, points: FloatArray) -> FloatArray:
    """Return points ``(..., 2)`` ahead and to the left of a pose."""
    turned = ((points[..., 0] - pose[0]) + 1j * (points[..., 1] - pose[1])) * np.exp(-1j * pose[2])
    return np.stack([turned.real, turned.imag], axis=-1)


def out_of_frame(pose: FloatArray, points: FloatArray) -> FloatArray:
    """Return where points ``(..., 2)`` are that are given ahead and to the left of a pose."""
    turned = (points[..., 0] + 1j * points[..., 1]) * np.exp(1j * pose[2])
    return np.stack([turned.real + pose[0], turned.imag + pose[1]], axis=-1)


def distance_to(thing: Movable | Obstacle, pose: FloatArray, points: FloatArray) -> FloatArray:
    """Return how far points ``(..., 2)`` are from a thing, 0 inside [m]."""
    local = in_frame(pose, points)
    if thing.shape == "cylinder":
        return np.maximum(np.hypot(local[..., 0], local[..., 1]) - thing.size[0] / 2, 0)
    beyond = np.maximum(np.abs(local) - np.array(thing.size) / 2, 0)
    return np.asarray(np.hypot(beyond[..., 0], beyond[..., 1]))


def distance_to_walls(config: Config, points: FloatArray) -> FloatArray:
    """Return how far points ``(..., 2)`` within the arena are from its walls, 0 beyond [m]."""
    arena = surroundings_of(config).arena
    if isinstance(arena, float):
        return np.asarray(np.maximum(arena - np.hypot(points[..., 0], points[..., 1]), 0))
    corners = np.array(arena)
    ways = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along, away = end - start, points - start
        ways.append((along[0] * away[..., 1] - along[1] * away[..., 0]) / np.hypot(*along))
    return np.asarray(np.maximum(np.min(ways, axis=0), 0))


def outline(thing: Movable, pose: FloatArray) -> FloatArray:
    """Return many points on a movable's rim, ``(n, 2)``."""
    share = np.arange(_OUTLINE) / _OUTLINE
    if thing.shape == "cylinder":
        angles = 2 * np.pi * share
        return out_of_frame(pose, thing.size[0] / 2 * np.stack([np.cos(angles), np.sin(angles)], axis=-1))
    half = np.array(thing.size) / 2
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]) * half
    sides = [a + 4 * share[: _OUTLINE // 4, np.newaxis] * (b - a) for a, b in pairwise(corners)]
    return out_of_frame(pose, np.concatenate(sides))


# ---- devices ---------------------------------------------------------------------------------------------------------


def infrared(moment: Moment) -> FloatArray:
    """Return readings of rays that march from the rim by the distance to the nearest thing, ``(robots, rays)``."""
    config, radius = moment.config, moment.config.robot.radius
    around = surroundings_of(config)
    reach = config.sensors.infrared_curve[-1][0]
    bearings = moment.robots[:, 2:] + np.radians(config.sensors.infrared_yaw_deg)
    rays = np.stack([np.cos(bearings), np.sin(bearings)], axis=-1)
    way = np.zeros(bearings.shape)

    def free(points: FloatArray) -> FloatArray:
        ways = [distance_to_walls(config, points)]
        ways += [distance_to(one, np.array(one.pose), points) for one in around.obstacles]
        if config.sensors.infrared_target == "all":
            ways += [distance_to(one, pose, points) for one, pose in zip(around.movables, moment.movables, strict=True)]
        for i, robot in enumerate(moment.robots):
            gap = np.maximum(np.hypot(points[..., 0] - robot[0], points[..., 1] - robot[1]) - radius, 0)
            gap[i] = np.inf  # nobody sees himself
            ways.append(gap)
        return reduce(np.minimum, ways)

    for _ in range(2000):
        step = free(moment.robots[:, np.newaxis, :2] + (radius + way)[..., np.newaxis] * rays)
        moving = (step > _STRIDE) & (way <= reach)
        if not moving.any():
            break
        way = np.where(moving, way + step, way)
    return response(way, config)


def touch(moment: Moment) -> tuple[FloatArray, FloatArray]:
    """Return readings ``(robots, sensors)``, and whether outlines' points tell them."""
    config = moment.config
    centres, half_width = np.radians(config.sensors.touch_yaw_deg), np.radians(config.sensors.touch_half_width_deg)
    readings = np.zeros((len(moment.robots), len(centres)))
    clear = np.ones(readings.shape, dtype=bool)
    for thing, pose in zip(surroundings_of(config).movables, moment.movables, strict=True):
        points = outline(thing, pose)
        for i, robot in enumerate(moment.robots):
            local = in_frame(robot, points)
            away = np.hypot(local[:, 0], local[:, 1])
            nearest = local[away.argmin()]
            gap = max(float(away.min()) - config.robot.radius, 0.0)
            off = np.abs(turn(np.arctan2(nearest[1], nearest[0]) - centres))
            near = gap <= config.sensors.touch_range
            strength = 1.0 if config.sensors.touch_mode == "binary" else 1 - gap / config.sensors.touch_range
            readings[i] = np.maximum(readings[i], (off <= half_width) * near * strength)
            is_edge = (np.abs(off - half_width) < _EDGE) | (abs(gap - config.sensors.touch_range) < 1e-4)
            clear[i] &= ~(is_edge & (gap <= config.sensors.touch_range + 1e-4))
    return readings, clear


def emitters(moment: Moment, channel: str) -> list[tuple[models.Emitter, FloatArray]]:
    """Return emitters of a channel, and where they are in space [m]; one that rides goes and turns with its carrier."""
    found = []
    for one in moment.config.scene.emitters or ():
        place = np.array(one.position)
        if one.rides_on is not None:
            place[:2] = out_of_frame(moment.movables[one.rides_on], place[:2])
        if one.channel == channel:
            found.append((one, place))
    return found


def _strength(one: models.Emitter, away: FloatArray) -> float:
    """Return 1/r^2 within its limits; NaN out of its range."""
    r = float(np.linalg.norm(away))
    return float(np.clip(1 / r**2, *one.strength)) if one.reach == "arena" or r <= one.range else float("nan")


def signals(moment: Moment) -> tuple[FloatArray, FloatArray]:
    """Return strengths ``(robots, channels)`` and bearings ``(robots, 2 channels)``, channels as they come first."""
    named = list(dict.fromkeys(one.channel for one in moment.config.scene.emitters or () if one.channel != "light"))
    strengths, bearings = zip(*(signal(moment, channel) for channel in named), strict=True)
    return np.concatenate(strengths, axis=1), np.concatenate(bearings, axis=1)


def signal(moment: Moment, channel: str) -> tuple[FloatArray, FloatArray]:
    """Return the strength of the strongest of a channel over the largest, and the nearest heard's bearing."""
    sources = emitters(moment, channel)
    largest = max(one.strength[1] for one, _ in sources)
    strengths, bearings = np.zeros((ROBOTS, 1)), np.zeros((ROBOTS, 2))
    for i, robot in enumerate(moment.robots):
        receiver = np.array([*robot[:2], moment.config.robot.height])
        heard = [(_strength(one, at - receiver), at) for one, at in sources]
        audible = [(strength, at) for strength, at in heard if not np.isnan(strength)]
        strengths[i] = max((strength for strength, _ in audible), default=sources[0][0].strength[0]) / largest
        if audible:
            nearest = min((at for _, at in audible), key=lambda at: float(np.linalg.norm(at - receiver)))
            bearing = np.arctan2(nearest[1] - robot[1], nearest[0] - robot[0]) - robot[2]
            bearings[i] = np.cos(bearing), np.sin(bearing)
    return strengths, bearings


def sector(place: FloatArray, sectors: int) -> int:
    """Return in which sector a place ``(2,)`` ahead and to the left is: the one whose middle is nearest by angle."""
    middles = 2 * np.pi * np.arange(sectors) / sectors
    return int(np.abs(turn(np.arctan2(place[1], place[0]) - middles)).argmin())


def light(moment: Moment) -> FloatArray:
    """Return for each sector the largest share of a light in it of what that light gives at most."""
    sectors = moment.config.sensors.light_sectors
    readings = np.zeros((len(moment.robots), sectors))
    for one, at in emitters(moment, "light"):
        for robot, reading in zip(moment.robots, readings, strict=True):
            strength = _strength(one, at - np.array([*robot[:2], moment.config.robot.height]))
            if not np.isnan(strength):
                where = sector(in_frame(robot, at[:2]), sectors)
                reading[where] = max(reading[where], strength / one.strength[1])
    return readings


def neighbours(moment: Moment) -> FloatArray:
    """Return for each sector how near the nearest robot is, and its message, which is empty before the first step."""
    sensors = moment.config.sensors
    width = 1 + sensors.range_and_bearing_message
    readings = np.zeros((len(moment.robots), sensors.range_and_bearing_sectors, width))
    for i, robot in enumerate(moment.robots):
        for j, other in enumerate(moment.robots):
            local = in_frame(robot, other[:2])
            near = 1 - float(np.hypot(*local)) / sensors.range_and_bearing_range
            if i != j and near >= 0:
                where = sector(local, sensors.range_and_bearing_sectors)
                readings[i, where, 0] = max(readings[i, where, 0], near)
    return readings.reshape(len(moment.robots), -1)


def ground(moment: Moment) -> FloatArray:
    """Return the grey of the last patch that each spot is on."""
    scene = moment.config.scene
    readings = np.full((len(moment.robots), len(moment.config.sensors.ground_position)), scene.grey)
    for i, robot in enumerate(moment.robots):
        spots = out_of_frame(robot, np.array(moment.config.sensors.ground_position))
        for patch in scene.patches:
            shape = Obstacle(patch.shape, patch.size, patch.pose)
            readings[i, distance_to(shape, np.array(patch.pose), spots) == 0] = patch.grey
    return readings


# ---- checks ----------------------------------------------------------------------------------------------------------


class Check(NamedTuple):
    """How a device compares with brute force."""

    readings: int
    answering: int
    """Other than at rest."""
    largest: float
    """Largest deviation of a reading."""
    undecided: int
    """Left out, within what points on outlines do not tell."""


def check(seen: Sequence[Moment]) -> dict[str, Check]:
    """Compare all readings of some moments."""
    expected: dict[str, list[FloatArray]] = {name: [] for name in DEVICES}
    clear: list[FloatArray] = []
    for moment in seen:
        touched, told = touch(moment)
        strength, bearing = signals(moment)
        readings = (infrared(moment), touched, strength, bearing, neighbours(moment), ground(moment), light(moment))
        for name, reading in zip(DEVICES, readings, strict=True):
            expected[name].append(reading)
        clear.append(told)
    checks = {}
    for name, readings_of_all in expected.items():
        truth, found = np.array(readings_of_all), np.array([moment.observations[name] for moment in seen])
        counts: BoolArray = np.array(clear, dtype=np.bool_) if name == "touch" else np.ones(truth.shape, dtype=np.bool_)
        rests = {"rf": [1 / 30, 1 / 20], "ground": [0.5]}  # of the first channel and the prey's
        rest = np.array(rests.get(name, [0.0]))
        off = np.abs(found - truth)[counts]
        checks[name] = Check(
            truth.size, int((np.abs(truth - rest) > 1e-9).sum()), float(off.max()), int((~counts).sum())
        )
    return checks


def merged(checks: Sequence[dict[str, Check]]) -> dict[str, Check]:
    """Return the checks of all parts together."""
    return {
        name: Check(
            sum(part[name].readings for part in checks),
            sum(part[name].answering for part in checks),
            max(part[name].largest for part in checks),
            sum(part[name].undecided for part in checks),
        )
        for name in DEVICES
    }


# ---- what moves ------------------------------------------------------------------------------------------------------


class Motion(NamedTuple):
    """Readings of wheels and of the movable that is touched, over a push."""

    wheels: float
    """Largest deviation from the command, from 0.2 s on, whether or not wheels slip."""
    movable: float
    """Largest deviation from what the reference's movable does, in shares of the top speed and of a robot's spin."""
    answering: int
    """Readings of a movable that moves or turns by more than a twentieth."""


def motion(case: objects.Case, time_step: float | None = None) -> Motion:
    """Compare what robots sense of their wheels and of what they push with the reference's velocities."""
    config = changed(case.config(time_step), robot={"sensors": ("odometry", "movable_motion")})
    robot, held = config.robot, np.array(case.held())
    done = drive_blind(config, held)
    world = twin(config)
    world.set(held)
    fastest = robot.top_speed * robot.wheel_radius
    scales = np.array([fastest, fastest, 2 * fastest / robot.axle_length])
    wheels, off, answering = 0.0, 0.0, 0
    for step, seen in enumerate(done):
        if step > 0:
            world.go(config.episode.control_period)
        bodies = world.state()
        robots, pushed = bodies[: len(held)], bodies[len(held) :]
        if step >= 2:
            wheels = max(wheels, float(np.abs(seen[:, :2] - held).max()))
        for body, reading in zip(robots, seen[:, 2:], strict=True):
            if step < 2 or not reading.any():
                continue
            things = surroundings_of(config).movables
            gaps = [float(distance_to(one, at[:3], body[:2])) for one, at in zip(things, pushed, strict=True)]
            velocity = pushed[int(np.argmin(gaps)), 3:]
            ahead = (velocity[0] + 1j * velocity[1]) * np.exp(-1j * body[2])
            expected = np.array([ahead.real, ahead.imag, velocity[2]]) / scales
            off = max(off, float(np.abs(reading - expected).max()))
            answering += int((np.abs(expected) > 0.05).sum())
    return Motion(wheels, off, answering)


def drive_blind(config: Config, held: FloatArray) -> FloatArray:
    """Return what robots observe that keep their commands, ``(steps, robots, width)``."""
    scene = Scene(config)
    outputs = np.arctanh(np.clip(held, -1 + 1e-15, 1 - 1e-15))[:, :, np.newaxis]
    n = len(held)
    policies = FeedForward(np.zeros((n, 0, scene.info.observations + 1)), outputs, np.zeros((n, 0), dtype=bool))
    drivers = np.arange(n, dtype=np.uint32)[np.newaxis]
    done = sound(simulate(scene, policies, [EpisodeKey(1, 0, 0, 0)], drivers, ["observation"]))
    return np.asarray(done.telemetry.observation[0])


MOTIONS = ("one 20 mm off the middle", "narrow feet, one 20 mm off", "box into a box, 30 mm off",
           "box stopped at one end by a block", "robot at a block")  # fmt: skip
"""Pushes in which movables turn, or wheels slip at what does not give way."""


def motions(settings: Settings) -> dict[str, Motion]:
    """Compare them with the default physics."""
    cases = [case for case in objects.CASES if case.name in MOTIONS]
    return dict(zip((case.name for case in cases), in_parallel(motion, cases, settings.threads), strict=True))


# ---- the page --------------------------------------------------------------------------------------------------------

LARGEST, LARGEST_MOTION = 1e-5, 0.05
"""How far readings in [0, 1] may be from brute force, and those of a movable's motion from the reference's."""
EPISODES = 8
"""Moments of each random world."""


def section(settings: Settings) -> Section:
    """Measure, and write this part of the page."""
    worlds = max(len(ARENAS), settings.scenes // 100)
    found = merged(in_parallel(lambda k: check(moments(random_config(k), EPISODES)), range(worlds), settings.threads))
    rows = [[f"`{name}`", c.readings, c.answering, c.undecided, f"{c.largest:.1e}"] for name, c in found.items()]
    moved = motions(settings)
    moving = [[name, m.answering, f"{m.wheels:.1e}", f"{m.movable:.3f}"] for name, m in moved.items()]
    kept = max(c.largest for c in found.values()) <= LARGEST
    followed = max(m.movable for m in moved.values()) <= LARGEST_MOTION
    return Section(
        f"""## Sensors among objects

{worlds * EPISODES} moments of {worlds} random worlds without noise: {ROBOTS} robots, two cylinders and two boxes
anywhere among a block, a post and a wall in round, rectangular and five-sided arenas; emitters that stand or ride on
movables, on channels of their own; lights; patches. All devices of [robots](robots.md) that read places, with
{len(YAWS)} infrared rays, against brute force written from that page, over the surroundings of the reference: rays that
march by the distance to the nearest thing, the nearest of points on each movable's rim, definitions for the rest.

{table(["device", "readings", "of something", "left out at edges", "largest deviation"], rows)}
All within {LARGEST:g}: **{"yes" if kept else "no"}**.

What moves is held against the reference's velocities, over pushes of the tables above: `movable_motion` of robots that
touch something, in shares of a robot's top speed and spin, and `odometry` against the command from 0.2 s on, while
wheels slip as well:

{table(["push", "readings of motion", "odometry, largest deviation", "movable_motion, largest deviation"], moving)}
All of motion within {LARGEST_MOTION:g}: **{"yes" if followed else "no"}**.
""",
        {},
    )

#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Chipmunk peer (by way of pymunk), seen from above: five E-pucks, a box, walls. Prints one JSON line.

    pymunk_scene.py roaming|pushing|random --networks FILE

FILE has one network a line, from benchmarks.cases.write_networks; episode i is driven by network i modulo their number.
The rate is simulated seconds for each second of CPU time, with sensing, networks, noise and making the worlds.

A robot is a disc on a tread that moves as its wheels would have it: a kinematic body without a shape, tied to it by a
pivot and a gear that hold its velocity with a limited force and torque, so that the solver weighs drive and contacts
against each other. The scene is that of box2d_scene.cpp, function for function.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from typing import Any, NamedTuple

import numpy as np
import pymunk
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# ---- the scene, as swarmevo/config/models.py has it; in m, kg, s, rad ----

ROBOTS, INFRARED, TOUCH, INPUTS, HIDDEN = 5, 8, 4, 13, 15
GRAVITY = 9.81  # [m/s^2]
ARENA_SIZE = 1.0  # [m]
WIDE_ARENA_SIZE = 20.0  # of `pushing` [m]
BOX_LENGTH, BOX_WIDTH = 0.275, 0.18  # along x and y [m]
BOX_MASS = 0.24  # [kg]
BOX_Y = 0.345  # at the start [m]; the emitter is above it
ROBOT_RADIUS = 0.035  # [m]
ROBOT_MASS = 0.08  # [kg]
CENTRE_OF_MASS = 0.015  # above the floor [m]
CASTER_OFFSET = 0.03  # from the axle [m]
AXLE_LENGTH = 0.053  # [m]
TOP_SPEED = 0.12874  # of a rim: 6.28 rad/s at 20.5 mm [m/s]
WHEEL_FRICTION = 1.0  # [1]
BOX_FRICTION = 0.62  # of the floor, unless told otherwise [1]
SIDE_FRICTION = 0.2  # [1]
ROW_Y = -0.4  # [m]
ROW_SPACING = 0.12  # [m]
POSITION_JITTER, HEADING_JITTER = 0.01, 0.1  # [m], [rad]
PUSHER_SPACING = 0.0715  # of `pushing` [m]
PUSHER_GAP = 0.002  # from the box [m]
BOX_TO_SOUTH_WALL = 0.6  # of `pushing`, from the box's centre [m]
CONTROL_PERIOD = 0.1  # [s]
WHEEL_NOISE = 0.05  # largest relative error [1]
INFRARED_NOISE, INFRARED_NOISE_AT_CONTACT = 0.05, 0.005  # relative standard deviations [1]

INFRARED_YAW_DEG = (-17.2, -45.9, -90.0, -151.5, 151.2, 90.0, 45.8, 17.1)
INFRARED_CURVE = (
    (0.0, 4095.0),
    (0.005, 3474.0),
    (0.01, 2211.0),
    (0.02, 676.0),
    (0.03, 306.0),
    (0.04, 164.0),
    (0.05, 90.0),
    (0.06, 56.0),
    (0.07, 34.0),
)  # [m], raw value [1]
INFRARED_RANGE = 0.07  # [m]
TOUCH_YAW_DEG = (45.0, 15.0, -15.0, -45.0)
TOUCH_HALF_WIDTH_DEG = 15.0
TOUCH_RANGE = 0.002  # [m]
EMITTER_RANGE, EMITTER_ABOVE_RECEIVER = 0.3, -0.02  # [m]
LEAST_STRENGTH, MOST_STRENGTH = 1.0, 50.0  # [1]

INFRARED_YAW, TOUCH_YAW = np.radians(INFRARED_YAW_DEG), np.radians(TOUCH_YAW_DEG)
INFRARED_DISTANCES, INFRARED_VALUES = np.transpose(INFRARED_CURVE)

# What a robot pushes with: its own friction tips it onto a caster (native/src/epuck.hpp). Simplification: the same
# limit sideways, where a robot that does not push has up to WHEEL_FRICTION * ROBOT_MASS * GRAVITY.
TRACTION = WHEEL_FRICTION * ROBOT_MASS * GRAVITY / (1 + WHEEL_FRICTION * CENTRE_OF_MASS / CASTER_OFFSET)  # [N]
TURNING_TRACTION = WHEEL_FRICTION * ROBOT_MASS * GRAVITY * AXLE_LENGTH / 2  # [N m]

# ---- what Chipmunk wants ----

SLOP = 0.0005  # overlap that is left alone [m]; its default of 0.1 is for pixels
SHAPE_FRICTION = math.sqrt(SIDE_FRICTION)  # it multiplies the two shapes'
BOX_CATEGORY = 2
NOT_THE_BOX = pymunk.ShapeFilter.ALL_MASKS() ^ BOX_CATEGORY  # infrared looks over it


class Networks(NamedTuple):
    """Of all episodes; the last weight of each row is the bias."""

    hidden: FloatArray  # (n, HIDDEN, INPUTS + 1)
    output: FloatArray  # (n, 2, HIDDEN + 1)
    on: FloatArray  # (n, HIDDEN)


def read_networks(path: str) -> Networks:
    rows = np.loadtxt(path, delimiter=",", ndmin=2)
    hidden, output, on = np.split(rows, np.cumsum([HIDDEN * (INPUTS + 1), 2 * (HIDDEN + 1)]), axis=1)
    return Networks(hidden.reshape(-1, HIDDEN, INPUTS + 1), output.reshape(-1, 2, HIDDEN + 1), on)


class Robot:
    """Its body, its tread, and how fast its wheels want to go."""

    def __init__(self, space: pymunk.Space, x: float, y: float, heading: float, number: int) -> None:
        self.body = pymunk.Body(ROBOT_MASS, ROBOT_MASS * ROBOT_RADIUS**2 / 2)
        self.body.position, self.body.angle = (x, y), heading
        shape = pymunk.Circle(self.body, ROBOT_RADIUS)
        shape.friction = SHAPE_FRICTION
        shape.filter = pymunk.ShapeFilter(group=number + 1)
        self.rays = pymunk.ShapeFilter(group=number + 1, mask=NOT_THE_BOX)
        self.tread = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        space.add(self.body, shape, self.tread)
        rub(space, self.tread, self.body, TRACTION, TURNING_TRACTION)
        self.speed = self.turn = 0.0  # [m/s], [rad/s]


def rub(space: pymunk.Space, first: pymunk.Body, second: pymunk.Body, force: float, torque: float) -> None:
    """Hold two bodies' velocities together, up to a force [N] and a torque [N m]."""
    pivot, gear = pymunk.PivotJoint(first, second, (0, 0), (0, 0)), pymunk.GearJoint(first, second, 0, 1)
    for joint, limit in ((pivot, force), (gear, torque)):
        joint.max_bias = 0  # velocities alone: where the bodies are does not matter
        joint.max_force = limit
        space.add(joint)


class World:
    """One episode."""

    def __init__(self, a: argparse.Namespace, episode: int, networks: Networks) -> None:
        self.a, self.rng = a, np.random.default_rng(episode)
        self.hidden, self.output, self.on = (part[episode % len(part)] for part in networks)
        self.pushing = a.case == "pushing"
        self.half = (WIDE_ARENA_SIZE if self.pushing else ARENA_SIZE) / 2
        self.box_y = BOX_TO_SOUTH_WALL - self.half if self.pushing else BOX_Y
        self.space = pymunk.Space()
        self.space.collision_slop = SLOP
        self.space.iterations = a.iterations
        self.add_walls()
        self.add_box()
        self.robots = [Robot(self.space, *self.start(i), i) for i in range(ROBOTS)]
        self.overlap = 0.0  # [m]

    def add_walls(self) -> None:
        corners = [(-self.half, -self.half), (self.half, -self.half), (self.half, self.half), (-self.half, self.half)]
        for i, corner in enumerate(corners):
            wall = pymunk.Segment(self.space.static_body, corner, corners[i - 1], 0)
            wall.friction = SHAPE_FRICTION
            self.space.add(wall)

    def add_box(self) -> None:
        self.box = pymunk.Body(BOX_MASS, BOX_MASS * (BOX_LENGTH**2 + BOX_WIDTH**2) / 12)
        self.box.position = 0, self.box_y
        shape = pymunk.Poly.create_box(self.box, (BOX_LENGTH, BOX_WIDTH))
        shape.friction = SHAPE_FRICTION
        shape.filter = pymunk.ShapeFilter(categories=BOX_CATEGORY)
        self.space.add(self.box, shape)
        # It stands on its corners. Simplification: sliding does not weaken what holds it from turning.
        hold = self.a.box_friction * BOX_MASS * GRAVITY
        rub(self.space, self.space.static_body, self.box, hold, hold * math.hypot(BOX_LENGTH, BOX_WIDTH) / 2)

    def start(self, number: int) -> tuple[float, float, float]:
        place = number - (ROBOTS - 1) / 2
        if self.pushing:
            return PUSHER_SPACING * place, self.box_y - BOX_WIDTH / 2 - ROBOT_RADIUS - PUSHER_GAP, math.pi / 2
        dx, dy, turn = self.rng.uniform(-1, 1, 3) * (POSITION_JITTER, POSITION_JITTER, HEADING_JITTER)
        return ROW_SPACING * place + dx, ROW_Y + dy, turn - math.pi / 2

    def run(self) -> None:
        for _ in range(round(self.a.seconds / CONTROL_PERIOD)):
            self.drive(self.act(self.observe()))
            for _ in range(round(CONTROL_PERIOD / self.a.dt)):
                self.step()

    @property
    def way(self) -> float:
        """Of the box from its start [m]."""
        x, y = self.box.position
        return math.hypot(x, y - self.box_y)

    # ---- sensing ----

    def observe(self) -> FloatArray:
        centres = np.array([robot.body.position for robot in self.robots])
        headings = np.array([robot.body.angle for robot in self.robots])
        inputs = np.empty((ROBOTS, INPUTS))
        inputs[:, :INFRARED] = self.infrared(centres, headings)
        inputs[:, INFRARED:-1] = self.touch(centres, headings)
        square = ((centres - (0, BOX_Y)) ** 2).sum(1) + EMITTER_ABOVE_RECEIVER**2
        strength = np.clip(1 / square, LEAST_STRENGTH, MOST_STRENGTH)
        inputs[:, -1] = np.where(square <= EMITTER_RANGE**2, strength, LEAST_STRENGTH) / MOST_STRENGTH
        return inputs

    def infrared(self, centres: FloatArray, headings: FloatArray) -> FloatArray:
        """Return readings: rays from the centre, since from the rim they would miss what overlaps the robot."""
        reach, query = ROBOT_RADIUS + INFRARED_RANGE, self.space.segment_query_first
        angles = headings[:, None] + INFRARED_YAW
        ends = centres[:, None] + reach * np.stack((np.cos(angles), np.sin(angles)), -1)
        hits = np.ones((ROBOTS, INFRARED))
        for i, (robot, centre, rays) in enumerate(zip(self.robots, centres.tolist(), ends.tolist(), strict=True)):
            for k, end in enumerate(rays):
                hit = query(centre, end, 0, robot.rays)
                if hit is not None:
                    hits[i, k] = hit.alpha
        distances = np.maximum(0, hits * reach - ROBOT_RADIUS)
        readings: FloatArray = np.interp(distances, INFRARED_DISTANCES, INFRARED_VALUES / INFRARED_VALUES[0])
        readings[hits == 1] = 0
        if self.a.noise:
            share = np.minimum(1, distances / INFRARED_DISTANCES[1])
            deviations = INFRARED_NOISE_AT_CONTACT + share * (INFRARED_NOISE - INFRARED_NOISE_AT_CONTACT)
            readings *= 1 + deviations * self.rng.standard_normal(readings.shape)
        return np.clip(readings, 0, 1)

    def to_box(self, centres: FloatArray) -> FloatArray:
        """Return the vectors from points to the nearest ones of the box."""
        cosine, sine = math.cos(self.box.angle), math.sin(self.box.angle)
        turn = np.array(((cosine, -sine), (sine, cosine)))  # times it: from the world's frame to the box's
        local = (centres - self.box.position) @ turn
        half = (BOX_LENGTH / 2, BOX_WIDTH / 2)
        vectors: FloatArray = (np.clip(local, np.negative(half), half) - local) @ turn.T
        return vectors

    def touch(self, centres: FloatArray, headings: FloatArray) -> NDArray[np.bool_]:
        towards = self.to_box(centres)
        bearings = np.arctan2(towards[:, 1], towards[:, 0]) - headings
        off = np.abs(np.remainder(bearings[:, None] - TOUCH_YAW + math.pi, 2 * math.pi) - math.pi)
        near = np.hypot(*towards.T) <= ROBOT_RADIUS + TOUCH_RANGE
        readings: NDArray[np.bool_] = (off <= math.radians(TOUCH_HALF_WIDTH_DEG)) & near[:, None]
        return readings

    # ---- moving ----

    def act(self, inputs: FloatArray) -> FloatArray:
        """Return commands in [-1, 1], shape (ROBOTS, 2)."""
        hidden = np.tanh(inputs @ self.hidden[:, :-1].T + self.hidden[:, -1]) * self.on
        commands: FloatArray = np.tanh(hidden @ self.output[:, :-1].T + self.output[:, -1])
        return commands

    def drive(self, commands: FloatArray) -> None:
        errors = self.rng.uniform(-WHEEL_NOISE, WHEEL_NOISE, commands.shape) if self.a.noise else 0
        for robot, (left, right) in zip(self.robots, (TOP_SPEED * commands * (1 + errors)).tolist(), strict=True):
            robot.speed = (left + right) / 2
            robot.turn = robot.tread.angular_velocity = (right - left) / AXLE_LENGTH

    def step(self) -> None:
        for robot in self.robots:
            heading = robot.body.angle + robot.turn * self.a.dt / 2  # mid-step
            robot.tread.velocity = robot.speed * math.cos(heading), robot.speed * math.sin(heading)
        self.space.step(self.a.dt)
        if self.a.overlap:
            self.overlap = max(self.overlap, self.deepest_overlap())

    def deepest_overlap(self) -> float:
        """Return how far robots are within each other or the box now [m]."""
        centres = np.array([robot.body.position for robot in self.robots])
        apart = np.hypot(*(centres[:, None] - centres)[np.triu_indices(ROBOTS, 1)].T)
        to_box = np.hypot(*self.to_box(centres).T)
        return float(max(2 * ROBOT_RADIUS - apart.min(), ROBOT_RADIUS - to_box.min()))


def run(a: argparse.Namespace) -> dict[str, Any]:
    networks = read_networks(a.networks)
    start = time.process_time()
    worlds = [World(a, episode, networks) for episode in range(a.episodes)]
    for world in worlds:
        world.run()
    cpu = time.process_time() - start
    return dict(
        realtime_factor_per_cpu_s=round(a.episodes * a.seconds / cpu, 1),
        box_way_m=float(np.mean([world.way for world in worlds])),
        **(dict(deepest_overlap_mm=round(1000 * max(world.overlap for world in worlds), 3)) if a.overlap else {}),
    )


def main() -> None:
    p = argparse.ArgumentParser()
    p.add_argument("case", choices=("roaming", "pushing", "random"))
    p.add_argument("--networks", required=True)
    p.add_argument("--dt", type=float, default=0.01)
    p.add_argument("--seconds", type=float, default=180)
    p.add_argument("--episodes", type=int, default=1)
    p.add_argument("--box-friction", type=float, default=BOX_FRICTION)
    p.add_argument("--noise", type=int, choices=(0, 1), default=1)
    p.add_argument("--overlap", type=int, choices=(0, 1), default=0, help="measure it, which takes time")
    p.add_argument("--iterations", type=int, default=10, help="of the solver; Chipmunk's default")
    a = p.parse_args()
    note = {name: value for name, value in vars(a).items() if name not in ("case", "dt", "networks")}
    version = dict(version=pymunk.version, chipmunk=pymunk.chipmunk_version)
    print(json.dumps(dict(peer="pymunk", **version, case=a.case, dt=a.dt, **run(a), note=note)))


if __name__ == "__main__":
    main()

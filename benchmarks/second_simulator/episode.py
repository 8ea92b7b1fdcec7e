# SPDX-License-Identifier: BSD-3-Clause
"""A team's episode in the reference: start, noise, network, and what comes of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from benchmarks.reference import Movable, Obstacle
from benchmarks.second_simulator import sensors
from benchmarks.twin import surroundings_of, twin
from swarmevo.config import Config, models
from swarmevo.errors import InvalidArgument
from swarmevo.protocols import BoolArray, FloatArray

TIME_STEP: Final = 2e-5
"""Of the bodies [s]. With half of it robots go the same ways, but for the chaos where they run into each other."""

Mind = Callable[[FloatArray], FloatArray]
"""Wheel commands ``(n, 2)`` in [-1, 1], left and right, for what robots observe, ``(n, readings)``."""

# ---- a controller ----------------------------------------------------------------------------------------------------


class Network(NamedTuple):
    """A feed-forward network of h hidden units, as an exported controller tells it (docs/runs.md)."""

    activation: str
    input_hidden: FloatArray
    """``(h, 13)``"""
    hidden_bias: FloatArray
    """``(h,)``"""
    hidden_output: FloatArray
    """``(h, 2)``"""
    output_bias: FloatArray
    """``(2,)``"""

    def command(self, observation: FloatArray) -> FloatArray:
        """Return left and right wheel in [-1, 1] for an observation ``(13,)``."""
        hidden = self.hidden_bias + self.input_hidden @ observation
        hidden = np.tanh(hidden) if self.activation == "tanh" else (1 + np.tanh(hidden / 2)) / 2
        output = self.output_bias + hidden @ self.hidden_output
        return np.asarray(np.tanh(output if self.activation == "tanh" else output / 2))


def networks_of(exported: Mapping[str, Any]) -> list[Network]:
    """Return the networks of an exported controller: one for all robots, or one for each.

    Raises:
        InvalidArgument: It is no feed-forward network.
    """
    found = exported.get("networks")
    if not found:
        raise InvalidArgument(
            "controller: expected a feed-forward network in `networks`, as `swarmevo export --controller` writes it, "
            "got none"
        )
    return [
        Network(
            activation=one["activation"],
            input_hidden=np.reshape(one["input_hidden"], (-1, 13)),
            hidden_bias=np.array(one["hidden_bias"]),
            hidden_output=np.reshape(one["hidden_output"], (-1, 2)),
            output_bias=np.array(one["output_bias"]),
        )
        for one in found
    ]


def team_of(networks: Sequence[Network]) -> Mind:
    """Return what commands robots by networks: one for all, or one for each."""

    def act(seen: FloatArray) -> FloatArray:
        minds = networks if len(networks) > 1 else [networks[0]] * len(seen)
        return np.array([mind.command(one) for mind, one in zip(minds, seen, strict=False)])

    return act


# ---- starts ----------------------------------------------------------------------------------------------------------

MOST_DRAWS: Final = 10_000
"""Of a place that is clear of all else."""


def start(config: Config, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Return where robots ``(n, 3)`` and movables ``(m, 3)`` start.

    Robots in a row that looks south, or at ``start_poses``, each disturbed, or anywhere in their region; movables at
    their poses, or anywhere in theirs, clear of all else with the circle about them.

    Raises:
        InvalidArgument: There is no room.
    """
    team, radius = config.team, config.robot.radius
    there: list[tuple[FloatArray, float]] = []  # middles and radii of what stands already
    movables = []
    for one, thing in zip(_movables(config), surroundings_of(config).movables, strict=True):
        reach = thing.size[0] / 2 if thing.shape == "cylinder" else float(np.hypot(*thing.size)) / 2
        pose = np.array(one.pose) if one.start == "pose" else _anywhere(config, one.start_region, reach, there, [], rng)
        there.append((pose, reach))
        movables.append(pose)
    things = list(zip(surroundings_of(config).movables, movables, strict=True))
    if team.start == "random":
        robots: list[FloatArray] = []
        for _ in range(team.robots):
            others = [(pose, radius) for pose in robots]
            robots.append(_anywhere(config, team.start_region, radius, others, things, rng))
        return np.array(robots), np.reshape(movables, (-1, 3))
    if team.start == "poses":
        exact = np.array(team.start_poses)
    else:
        x = (np.arange(team.robots) - (team.robots - 1) / 2) * team.row_spacing
        exact = np.column_stack([x, np.full(team.robots, team.row_y), np.full(team.robots, -np.pi / 2)])
    way, angle = team.start_jitter
    return np.asarray(exact + rng.uniform(-1, 1, exact.shape) * (way, way, angle)), np.reshape(movables, (-1, 3))


def _movables(config: Config) -> Sequence[models.Movable]:
    return (config.box,) if config.scene.movables is None else config.scene.movables


def _anywhere(
    config: Config,
    region: Sequence[float],
    reach: float,
    there: Sequence[tuple[FloatArray, float]],
    things: Sequence[tuple[Movable, FloatArray]],
    rng: np.random.Generator,
) -> FloatArray:
    """Return a pose in a region at which a disc is clear of walls, obstacles, other discs and things."""
    west, east, south, north = region
    standing: list[tuple[Movable | Obstacle, FloatArray]] = [*things]
    standing += [(one, np.array(one.pose)) for one in surroundings_of(config).obstacles]
    for _ in range(MOST_DRAWS):
        pose = rng.uniform((west, south, -np.pi), (east, north, np.pi))
        gaps = [float(sensors.gaps_to_walls(config, pose[:2]))]
        gaps += [float(np.hypot(*(pose - other)[:2])) - far for other, far in there]
        gaps += [float(sensors.gap_to(one, at, pose[:2])) for one, at in standing]
        if min(gaps) > reach:
            return np.asarray(pose)
    raise InvalidArgument(f"start_region: expected room for a disc of {reach:g} m, got {list(region)}")


# ---- what robots observe ---------------------------------------------------------------------------------------------


def observation_names(config: Config) -> list[str]:
    """Return the names of what robots observe, in its order (docs/robots.md)."""
    own = config.sensors
    by_device = {
        "infrared": [f"infrared_{i}" for i in range(len(own.infrared_yaw_deg))],
        "touch": [f"touch_{i}" for i in range(len(own.touch_yaw_deg))],
        "rf": ["rf"],
        "rf_bearing": ["rf_bearing_cos", "rf_bearing_sin"],
        "range_and_bearing": [f"range_and_bearing_{i}" for i in range(own.range_and_bearing_sectors)],
        "light": [f"light_{i}" for i in range(own.light_sectors)],
    }
    return [name for device in config.robot.sensors for name in by_device[device]]


def observe(config: Config, poses: FloatArray, movables: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return what robots make of their sensors, with noise: ``(n, readings)``, as ``observation_names`` names them."""
    readings = [DEVICES[device](config, poses, movables, rng) for device in config.robot.sensors]
    return np.concatenate(readings, axis=1)


def _infrared(config: Config, poses: FloatArray, movables: FloatArray, rng: np.random.Generator) -> FloatArray:
    noise, curve = config.noise, config.sensors.infrared_curve
    distances = sensors.infrared_distances(config, poses, movables)
    spread = np.interp(distances, (0, curve[1][0]), (noise.infrared_at_contact, noise.infrared))
    infrared = sensors.infrared_readings(config, distances) * (1 + spread * rng.standard_normal(spread.shape))
    return np.asarray(np.clip(infrared, 0, 1))


def _touch(config: Config, poses: FloatArray, movables: FloatArray, rng: np.random.Generator) -> FloatArray:
    return sensors.touch_readings(config, poses, movables)


def _rf(config: Config, poses: FloatArray, movables: FloatArray, rng: np.random.Generator) -> FloatArray:
    """S over its most, of each channel."""
    readings = []
    for heard in sensors.radio_sources(config, poses, movables):
        least, most = heard[0].emitter.strength[0], max(one.emitter.strength[1] for one in heard)
        noisy = sensors.strongest(heard) * (1 + config.noise.rf * rng.standard_normal(len(poses)))
        readings.append(np.clip(noisy, least, most) / most)
    return np.column_stack(readings)


def _rf_bearing(config: Config, poses: FloatArray, movables: FloatArray, rng: np.random.Generator) -> FloatArray:
    readings = []
    for heard in sensors.radio_sources(config, poses, movables):
        bearings = sensors.nearest_bearings(heard) + config.noise.rf_bearing * rng.standard_normal(len(poses))
        readings += [np.cos(bearings), np.sin(bearings)]
    return np.asarray(np.nan_to_num(np.column_stack(readings)))  # nobody heard: 0, 0


def _range_and_bearing(config: Config, poses: FloatArray, movables: FloatArray, rng: np.random.Generator) -> FloatArray:
    reach, sectors = config.sensors.range_and_bearing_range, config.sensors.range_and_bearing_sectors
    distances, bearings = sensors.neighbours(poses)
    measured = distances * (1 + config.noise.range_and_bearing * rng.standard_normal(distances.shape))
    nearness = np.where(distances <= reach, np.clip(1 - measured / reach, 0, 1), 0.0)
    return sensors.in_sectors(bearings, nearness, sectors)


def _light(config: Config, poses: FloatArray, movables: FloatArray, rng: np.random.Generator) -> FloatArray:
    found = sensors.lights(config, poses, movables)
    bearings = np.reshape([one.bearings for one in found], (-1, len(poses))).T
    shares = np.reshape(
        [np.where(one.is_heard, one.strengths, 0) / one.emitter.strength[1] for one in found], (-1, len(poses))
    ).T
    noisy = shares * (1 + config.noise.light * rng.standard_normal(shares.shape))
    return sensors.in_sectors(bearings, np.clip(noisy, 0, 1), config.sensors.light_sectors)


DEVICES: Final[Mapping[str, Callable[[Config, FloatArray, FloatArray, np.random.Generator], FloatArray]]] = {
    "infrared": _infrared,
    "touch": _touch,
    "rf": _rf,
    "rf_bearing": _rf_bearing,
    "range_and_bearing": _range_and_bearing,
    "light": _light,
}
"""Those that are built here, each ``(n, readings)``."""


# ---- the episode -----------------------------------------------------------------------------------------------------


class Outcome(NamedTuple):
    """What came of an episode."""

    homing_times: FloatArray
    """When each robot was first within the emitter's range [s]: ``(n,)``; NaN: never."""
    push_time: float
    """When the last movable was at a goal that had not been at one [s]; NaN: never."""
    poses: FloatArray
    """Of robots, then of movables, at each control step, ``(steps, n + m, 3)``: x [m], y [m], heading [rad]."""
    at_goal: BoolArray
    """Which movables are at a goal, ``(steps, m)``."""
    seen: FloatArray
    """What robots observe, ``(steps, n, readings)``."""
    commands: FloatArray
    """What they do about it, ``(steps, n, 2)``, before wheels err."""


def check(config: Config) -> None:
    """Refuse a world that is not built here.

    Raises:
        InvalidArgument: It has something else; names all of it.
    """
    team = config.team
    west, east, _, _ = config.arena.bounds
    in_row = int((east - west) / team.row_spacing + 1e-9)
    unknown = [device for device in config.robot.sensors if device not in DEVICES]
    wrong = {
        f"robot.sensors: expected {', '.join(DEVICES)}, got {', '.join(unknown)}": unknown,
        f"team.robots: expected at most {in_row} in a row, got {team.robots}": (
            team.start == "row" and team.robots > in_row
        ),
        "sensors.touch_mode: expected binary or graded, got force": config.sensors.touch_mode == "force",
        "sensors.range_and_bearing_message: expected none": config.sensors.range_and_bearing_message > 0,
        f"physics.gravity: expected 9.81, got {config.physics.gravity}": config.physics.gravity != 9.81,
    }
    if any(wrong.values()):
        raise InvalidArgument("; ".join(line for line, is_so in wrong.items() if is_so))


def run(
    config: Config,
    mind: Mind,
    rng: np.random.Generator,
    time_step: float = TIME_STEP,
    whole: bool = False,
) -> Outcome:
    """Simulate an episode, to the horizon or until nothing is left to find out: all is at its goal, all robots home.

    Args:
        config: The world; time step, drive and other keys of the library's own method are not read.
        mind: What commands the robots.
        rng: Everything random.
        time_step: Of the bodies [s].
        whole: To the horizon, unless ``episode.until`` says otherwise.

    Raises:
        InvalidArgument: The world has something that is not built here.
    """
    check(config)
    headroom = 1 + config.noise.wheels  # a wheel's noise may take it beyond its top speed
    robots, movables = start(config, rng)
    world = twin(
        _standing(config, movables), robots, time_step=time_step, wheel_top_speed=headroom * config.robot.top_speed
    )
    n = len(robots)
    homing_times, goal_times = np.full(n, np.nan), np.full(len(movables), np.nan)
    path, at_goal, readings, commanded = [], [], [], []
    period = config.episode.control_period
    for step in range(round(config.episode.horizon / period)):
        bodies = world.state()[:, :3]
        poses, movables = bodies[:n], bodies[n:]
        path.append(bodies)
        homing_times[np.isnan(homing_times) & sensors.are_home(config, poses, movables)] = step * period
        at_goal.append(sensors.are_at_goal(config, movables))
        goal_times[np.isnan(goal_times) & at_goal[-1]] = step * period
        is_done = len(movables) > 0 and np.isfinite(goal_times).all()
        seen = observe(config, poses, movables, rng)
        commands = mind(seen)
        readings.append(seen)
        commanded.append(commands)
        if is_done and (config.episode.until == "push" or (not whole and np.isfinite(homing_times).all())):
            break
        error = rng.uniform(-config.noise.wheels, config.noise.wheels, commands.shape)
        world.set(commands * (1 + error) / headroom)
        world.go(period)
    push_time = float(goal_times.max()) if len(goal_times) else np.nan
    return Outcome(homing_times, push_time, np.array(path), np.array(at_goal), np.array(readings), np.array(commanded))


def _standing(config: Config, poses: FloatArray) -> Config:
    """Return the world with its movables at these poses."""
    movables = tuple(
        one.model_copy(update={"pose": tuple(pose), "start": "pose"})
        for one, pose in zip(_movables(config), poses.tolist(), strict=True)
    )
    return config.model_copy(update={"scene": config.scene.model_copy(update={"movables": movables})})

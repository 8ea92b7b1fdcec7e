# SPDX-License-Identifier: BSD-3-Clause
"""A team's episode in the reference: start, noise, network, and what comes of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from benchmarks.second_simulator import sensors
from benchmarks.twin import twin
from swarmevo.config import Config
from swarmevo.errors import InvalidArgument
from swarmevo.protocols import FloatArray

TIME_STEP: Final = 2e-5
"""Of the bodies [s]. With half of it robots go the same ways, but for the chaos where they run into each other."""

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


# ---- noise -----------------------------------------------------------------------------------------------------------


def start(config: Config, rng: np.random.Generator) -> FloatArray:
    """Return where robots start: in a row that looks south, or at ``start_poses``, each disturbed."""
    team = config.team
    if team.start == "poses":
        exact = np.array(team.start_poses)
    else:
        x = (np.arange(team.robots) - (team.robots - 1) / 2) * team.row_spacing
        exact = np.column_stack([x, np.full(team.robots, team.row_y), np.full(team.robots, -np.pi / 2)])
    way, angle = team.start_jitter
    return np.asarray(exact + rng.uniform(-1, 1, exact.shape) * (way, way, angle))


def observe(config: Config, poses: FloatArray, box: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return what robots make of their sensors, ``(n, 13)``: infrared, box sensors, S over its most, with noise."""
    noise, curve, most = config.noise, config.sensors.infrared_curve, config.emitter.strength[1]
    distances = sensors.infrared_distances(config, poses, box)
    spread = np.interp(distances, (0, curve[1][0]), (noise.infrared_at_contact, noise.infrared))
    infrared = sensors.infrared_readings(config, distances) * (1 + spread * rng.standard_normal(spread.shape))
    strengths = sensors.signal_strengths(config, poses) * (1 + noise.rf * rng.standard_normal(len(poses)))
    signal = np.clip(strengths, *config.emitter.strength) / most
    return np.column_stack([np.clip(infrared, 0, 1), sensors.touch_readings(config, poses, box), signal])


# ---- the episode -----------------------------------------------------------------------------------------------------


class Outcome(NamedTuple):
    """What came of an episode."""

    homing_times: FloatArray
    """When each robot was first within the emitter's range [s]: ``(n,)``; NaN: never."""
    push_time: float
    """When the box first touched the target wall [s]; NaN: never."""
    poses: FloatArray
    """Of robots, then of the box, at each control step, ``(steps, n + 1, 3)``: x [m], y [m], heading [rad]."""


def check(config: Config) -> None:
    """Refuse a world that is not built here.

    Raises:
        InvalidArgument: It has something else; names all of it.
    """
    team, in_row = config.team, int(config.arena.size / config.team.row_spacing)
    box, rays, sectors = config.box, len(config.sensors.infrared_yaw_deg), len(config.sensors.touch_yaw_deg)
    wrong = {
        "scene: expected nothing beside box, emitter and target wall": config.scene != type(config.scene)(),
        f"arena.shape: expected square, got {config.arena.shape}": config.arena.shape != "square",
        "box: expected a box on its corners, with physics.box_friction, that starts at its pose": (
            (box.shape, box.friction, box.feet, box.start) != ("box", None, 1.0, "pose")
        ),
        "emitter.rides_on: expected none": config.emitter.rides_on is not None,
        f"robot.sensors: expected infrared, touch, rf, got {', '.join(config.robot.sensors)}": (
            config.robot.sensors != ("infrared", "touch", "rf")
        ),
        f"sensors: expected 8 infrared rays and 4 box sensors, got {rays} and {sectors}": (rays, sectors) != (8, 4),
        "team.start: expected row or poses, got random": team.start == "random",
        f"team.robots: expected at most {in_row} in a row, got {team.robots}": (
            team.start == "row" and team.robots > in_row
        ),
        "sensors.touch_mode: expected binary or graded, got force": config.sensors.touch_mode == "force",
        f"physics.gravity: expected 9.81, got {config.physics.gravity}": config.physics.gravity != 9.81,
    }
    if any(wrong.values()):
        raise InvalidArgument("; ".join(line for line, is_so in wrong.items() if is_so))


def run(
    config: Config,
    networks: Sequence[Network],
    rng: np.random.Generator,
    time_step: float = TIME_STEP,
    whole: bool = False,
) -> Outcome:
    """Simulate an episode, to the horizon or until nothing is left to find out: box at the wall, all robots home.

    Args:
        config: The world; time step, drive and other keys of the library's own method are not read.
        networks: One for all robots, or one for each.
        rng: Everything random.
        time_step: Of the bodies [s].
        whole: To the horizon, come what may.

    Raises:
        InvalidArgument: The world has something that is not built here.
    """
    check(config)
    headroom = 1 + config.noise.wheels  # a wheel's noise may take it beyond its top speed
    poses = start(config, rng)
    world = twin(config, poses, time_step=time_step, wheel_top_speed=headroom * config.robot.top_speed)
    minds = networks if len(networks) > 1 else [networks[0]] * len(poses)
    homing_times, push_time = np.full(len(poses), np.nan), np.nan
    path = []
    period = config.episode.control_period
    for step in range(round(config.episode.horizon / period)):
        bodies = world.state()[:, :3]
        poses, box = bodies[:-1], bodies[-1]
        path.append(bodies)
        homing_times[np.isnan(homing_times) & sensors.are_home(config, poses)] = step * period
        if np.isnan(push_time) and sensors.is_box_at_wall(config, box):
            push_time = step * period
        if not whole and np.isfinite([push_time, *homing_times]).all():
            break
        seen = observe(config, poses, box, rng)
        commands = np.array([mind.command(one) for mind, one in zip(minds, seen, strict=False)])
        error = rng.uniform(-config.noise.wheels, config.noise.wheels, commands.shape)
        world.set(commands * (1 + error) / headroom)
        world.go(period)
    return Outcome(homing_times, push_time, np.array(path))

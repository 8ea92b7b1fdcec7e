# SPDX-License-Identifier: BSD-3-Clause
"""A census of behaviours: the unpredicted ones that the paper's section VII tells of, as criteria.

Each criterion looks at one episode and says of every robot whether it showed the behaviour. They are simple on purpose:
thresholds on where a robot was, whether it moved, and whether it pressed on a box. A robot may have several labels.
In other scenes than the paper's a wall is an obstacle too, the box is whatever robots can push, and the source any
emitter that they home in on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from swarmevo.config import Config, surroundings
from swarmevo.protocols import CENSUS_CHANNELS, BoolArray, FloatArray, IntArray, Telemetry
from swarmevo.simulation import layout

MOVING: Final = 0.01
"""A robot moves where it comes further than this within a second [m]: a tenth of its top speed."""
FINAL_SHARE: Final = 1 / 6
"""A robot stands for good if it does not move in the end of the episode: 30 s of the paper's 180 s."""
NEIGHBOUR: Final = 0.15
"""Robots circle together up to this distance of their centres [m]: two robots' widths."""
CIRCLING: Final = 10.0
"""They do so for at least this long [s] ..."""
FULL_TURN: Final = 2 * np.pi
"""... each turns by this much on balance [rad] ..."""
COMMON_CENTRE: Final = 0.06
"""... and the middles of their ways are no further apart [m]: each in a circle of its own is not together."""
FORWARD: Final = 0.1
"""A robot pushes if a box sensor answers while it drives forwards with this share of its top speed."""
PUSHING: Final = 1.0
"""It pushed if it did so for at least this long in all [s]."""


@dataclass(frozen=True)
class Episode:
    """What the criteria see of one episode; ``steps`` control steps."""

    config: Config
    pose: FloatArray
    """``(steps, robots, 3)``: x [m], y [m], heading [rad]."""
    command: FloatArray
    """``(steps, robots, 2)``"""
    touch: FloatArray
    """``(steps, robots, 4)``"""
    movables: FloatArray
    """``(steps, movables, 3)``: x [m], y [m], heading [rad] of what robots can push."""
    homing_time: FloatArray
    """``(robots,)`` [s]; NaN: never."""

    @property
    def period(self) -> float:
        """Of a step [s]."""
        return self.config.episode.control_period

    @property
    def steps(self) -> int:
        """Number of control steps."""
        return len(self.pose)

    @cached_property
    def moves(self) -> BoolArray:
        """``(steps, robots)``: it comes further than MOVING within the second that begins there."""
        lag = max(1, round(1 / self.period))
        later = self.pose[np.minimum(np.arange(self.steps) + lag, self.steps - 1), :, :2]
        far: BoolArray = np.linalg.norm(later - self.pose[:, :, :2], axis=-1) > MOVING * lag * self.period
        return far

    @cached_property
    def stop(self) -> IntArray:
        """``(robots,)``: the first step after which it never moves again; ``steps`` if it moves in the end."""
        last = self.steps - 1 - np.argmax(self.moves[::-1], axis=0)
        stop = np.where(self.moves.any(axis=0), last + 1, 0)
        return np.where(stop <= self.steps * (1 - FINAL_SHARE), stop, self.steps)

    @cached_property
    def touches(self) -> BoolArray:
        """``(steps, robots)``: a box sensor answers."""
        return np.asarray(self.touch.max(axis=-1, initial=0) > 0)

    @cached_property
    def pushes(self) -> BoolArray:
        """``(steps, robots)``: it drives against the box."""
        return np.asarray(self.touches & (self.command.mean(axis=-1) >= FORWARD))

    @cached_property
    def in_range(self) -> BoolArray:
        """``(steps, robots)``: within range of an emitter that robots home in on."""
        found = np.zeros(self.pose.shape[:2], dtype=bool)
        for emitter in layout.homing_emitters(surroundings(self.config)):
            places = layout.emitter_places(emitter, self.movables)
            found |= np.linalg.norm(self.pose[:, :, :2] - places[:, None], axis=-1) <= emitter.range
        return found

    @cached_property
    def near_wall(self) -> BoolArray:
        """``(steps, robots)``: the infrared sensors can see a wall or an obstacle."""
        places = self.pose[:, :, :2]
        walls = layout.wall_distance(self.config.arena, places)
        nearest = np.minimum(walls, layout.obstacle_distance(surroundings(self.config), places))
        return np.asarray(nearest <= self.config.robot.radius + self.sight)

    @cached_property
    def distances(self) -> FloatArray:
        """``(steps, robots, robots)``: between centres [m]; infinite to itself."""
        between = self.pose[:, :, None, :2] - self.pose[:, None, :, :2]
        away: FloatArray = np.linalg.norm(between, axis=-1)
        away[:, np.arange(away.shape[1]), np.arange(away.shape[1])] = np.inf
        return away

    @property
    def sight(self) -> float:
        """How far the infrared sensors see from a robot's body [m]."""
        return self.config.sensors.infrared_curve[-1][0]

    def at_stop(self, values: BoolArray) -> BoolArray:
        """Return ``values`` ``(steps, robots)`` where each robot stopped; False for who did not."""
        robots = np.arange(values.shape[1])
        return np.asarray((self.stop < self.steps) & values[np.minimum(self.stop, self.steps - 1), robots])


# ---- criteria: each returns (robots,) --------------------------------------------------------------------------------


def static_near_wall(seen: Episode) -> BoolArray:
    """It stands for good where it sees a wall and does not touch the box."""
    return seen.at_stop(seen.near_wall & ~seen.touches)


def circling_together(seen: Episode) -> BoolArray:
    """It and a neighbour move close to each other for some time, off the box, in full circles about the same place."""
    robots = seen.pose.shape[1]
    heading = np.unwrap(seen.pose[:, :, 2], axis=0)
    free = seen.moves & ~seen.touches
    found = np.zeros(robots, dtype=bool)
    for a in range(robots):
        for b in range(a + 1, robots):
            together = free[:, a] & free[:, b] & (seen.distances[:, a, b] <= NEIGHBOUR)
            for start, end in _stretches(together, round(CIRCLING / seen.period)):
                turned = np.abs(heading[end - 1, [a, b]] - heading[start, [a, b]])
                middles = seen.pose[start:end, [a, b], :2].mean(axis=0)
                if (turned >= FULL_TURN).all() and np.linalg.norm(middles[0] - middles[1]) <= COMMON_CENTRE:
                    found[[a, b]] = True
    return found


def stopped_for_robot(seen: Episode) -> BoolArray:
    """It had moved, then stands for good where it sees another robot, but neither box nor wall is at hand."""
    near = seen.distances.min(axis=-1) <= 2 * seen.config.robot.radius + seen.sight
    return seen.at_stop(near & ~seen.touches) & seen.moves.any(axis=0) & ~static_near_wall(seen)


def homed_without_pushing(seen: Episode) -> BoolArray:
    """It came to the source and stayed there for most of the time, but did not push."""
    since = np.nan_to_num(seen.homing_time / seen.period, nan=float(seen.steps))
    after = np.arange(seen.steps)[:, None] >= since
    stayed = (seen.in_range & after).sum(axis=0) >= 0.5 * after.sum(axis=0)
    pushed = seen.pushes.sum(axis=0) * seen.period >= PUSHING
    return np.asarray(np.isfinite(seen.homing_time) & stayed & ~pushed)


def pushed_without_rf(seen: Episode) -> BoolArray:
    """It pushed outside the emitter's range: it found the box without the signal, or pushed it out of it."""
    return np.asarray((seen.pushes & ~seen.in_range).sum(axis=0) * seen.period >= PUSHING)


LABELS: Final[dict[str, Callable[[Episode], BoolArray]]] = {
    "static near a wall": static_near_wall,
    "circling together": circling_together,
    "stopped for a near robot": stopped_for_robot,
    "homed without pushing": homed_without_pushing,
    "pushed without RF": pushed_without_rf,
}
"""Each label's criterion, in the order of section VII."""


_OF_A_TEAM: Final = ("circling together", "stopped for a near robot")
_OF_BOX_AND_SOURCE: Final = ("homed without pushing", "pushed without RF")


def fitting(config: Config) -> list[str]:
    """Return the labels that say something where there is one robot, nothing to push, or no source."""
    scene = surroundings(config)
    out = [
        *(_OF_A_TEAM if config.team.robots == 1 else ()),
        *(() if scene.movables and layout.homing_emitters(scene) else _OF_BOX_AND_SOURCE),
    ]
    return [label for label in LABELS if label not in out]


def census(config: Config, telemetry: Telemetry) -> dict[str, float]:
    """Return for each label the share of robots, over all episodes, that showed the behaviour.

    Args:
        config: Of the episodes.
        telemetry: With CENSUS_CHANNELS.

    Raises:
        ValueError: A channel is missing.
    """
    return dict(zip(LABELS, by_episode(config, telemetry).mean(axis=0).tolist(), strict=True))


def by_episode(config: Config, telemetry: Telemetry, steps: Sequence[int] | None = None) -> FloatArray:
    """Return ``(episodes, labels)``: in each episode the share of robots that showed each behaviour.

    Args:
        config: Of the episodes.
        telemetry: With CENSUS_CHANNELS.
        steps: Control steps of each episode that are looked at; None: all.

    Raises:
        ValueError: A channel is missing.
    """
    missing = [name for name in CENSUS_CHANNELS if name not in telemetry.channels]
    if missing:
        raise ValueError(
            f"telemetry: expected the channels {', '.join(CENSUS_CHANNELS)}; missing are {', '.join(missing)}"
        )
    channels = {name: telemetry.channels[name] for name in CENSUS_CHANNELS}
    shares = []
    for i, homing_time in enumerate(telemetry.homing_time):
        recorded = {name: channel[i, : None if steps is None else steps[i]] for name, channel in channels.items()}
        seen = Episode(config, homing_time=homing_time, **recorded)
        shares.append([float(np.mean(criterion(seen))) for criterion in LABELS.values()])
    return np.array(shares)


def _stretches(flags: BoolArray, least: int) -> list[tuple[int, int]]:
    """Return start and end of every unbroken stretch of at least ``least`` true ``flags``."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= least]

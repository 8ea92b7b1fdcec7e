# SPDX-License-Identifier: BSD-3-Clause
"""Each criterion of the census on robots made for it, and on some that come close."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from swarmevo.analysis import census
from swarmevo.analysis.census import Episode
from swarmevo.config import Config
from swarmevo.protocols import BoolArray, FloatArray, Telemetry

CONFIG = Config.model_validate({"team": {"robots": 2}, "episode": {"horizon": 60.0}})
STEPS, PERIOD = 600, 0.1
TIME = np.arange(STEPS) * PERIOD
BOX = np.tile(CONFIG.box.pose, (STEPS, 1, 1))
FAR = (-0.2, -0.2)
"""A place out of the way: no wall, box or source is near."""
HOME = (0.0, 0.1)
"""A place within the emitter's range."""


def still(x: float, y: float) -> FloatArray:
    """A robot that never moves, ``(steps, 3)``."""
    return np.tile([x, y, 0.0], (STEPS, 1))


def drive(start: tuple[float, float], end: tuple[float, float], arrival: float) -> FloatArray:
    """A robot that drives straight and stops at ``arrival`` [s]."""
    part = np.clip(TIME / arrival, 0, 1)[:, None]
    places = np.array(start) + part * (np.array(end) - np.array(start))
    return np.column_stack([places, np.zeros(STEPS)])


def circle(x: float, y: float, radius: float, phase: float = 0.0, speed: float = 1.0) -> FloatArray:
    """A robot that drives in a circle with ``speed`` [rad/s]."""
    angle = speed * TIME + phase
    heading = (angle + np.pi / 2 + np.pi) % (2 * np.pi) - np.pi
    return np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle), heading])


def episode(
    *robots: FloatArray,
    touch: FloatArray | float = 0.0,
    command: float = 1.0,
    homing: tuple[float, float] = (np.nan, np.nan),
) -> Episode:
    """Two robots; ``touch`` ``(steps,)`` is the first one's front box sensor."""
    sensors = np.zeros((STEPS, 2, 4))
    sensors[:, 0, 1] = touch
    commands = np.full((STEPS, 2, 2), command)
    return Episode(CONFIG, np.stack(robots, axis=1), commands, sensors, BOX, np.array(homing))


def first(criterion: Callable[[Episode], BoolArray], seen: Episode) -> bool:
    found = criterion(seen)
    assert found.shape == (2,)
    return bool(found[0])


NEAR_WALL = (0.45, -0.2)
HALF_TIME = np.where(TIME < 30, 1.0, 0.0)


@pytest.mark.parametrize(
    ("seen", "expected"),
    [
        (episode(drive(FAR, NEAR_WALL, 20), still(*FAR)), True),
        (episode(still(*NEAR_WALL), still(*FAR)), True),
        (episode(drive(FAR, (0.1, -0.2), 20), still(*HOME)), False),  # not near a wall
        (episode(drive(FAR, NEAR_WALL, 58), still(*HOME)), False),  # it stops too late to be called static
        (episode(drive(FAR, NEAR_WALL, 20), still(*HOME), touch=1.0), False),  # it holds the box
    ],
)
def test_static_near_wall(seen: Episode, expected: bool) -> None:
    assert first(census.static_near_wall, seen) == expected


PAIR = (circle(*FAR, 0.05), circle(*FAR, 0.05, phase=np.pi))


def slow_pair(speed: float) -> tuple[FloatArray, FloatArray]:
    """Two that follow each other in a wide circle, with ``speed`` [rad/s]."""
    return circle(*FAR, 0.2, speed=speed), circle(*FAR, 0.2, phase=0.5, speed=speed)


@pytest.mark.parametrize(
    ("seen", "expected"),
    [
        (episode(*PAIR), True),
        (episode(circle(-0.26, -0.2, 0.03), circle(-0.14, -0.2, 0.03)), False),  # each in its own circle
        (episode(circle(*FAR, 0.05), circle(0.3, -0.2, 0.05)), False),  # far from each other
        (episode(drive((-0.4, 0), (0.4, 0), 60), drive((-0.4, 0.1), (0.4, 0.1), 60)), False),  # side by side, straight
        (episode(circle(*FAR, 0.001), circle(*FAR, 0.001)), False),  # spinning on the spot
        (episode(*PAIR, touch=1.0), False),  # at the box
        (episode(*(np.where(TIME[:, None] < 8, way, way[-1]) for way in PAIR)), False),  # too short
        (episode(*PAIR, touch=np.where(TIME < 10.0, 0.0, 1.0)), True),
        (episode(*PAIR, touch=np.where(TIME < 9.85, 0.0, 1.0)), False),  # a step too short
        (episode(*slow_pair(0.11)), True),
        (episode(*slow_pair(0.1)), False),  # 6.0 rad: not quite a turn
        (episode(circle(*FAR, 0.1), circle(*FAR, 0.1, phase=np.pi)), False),  # about one place, but 20 cm apart
    ],
)
def test_circling_together(seen: Episode, expected: bool) -> None:
    assert census.circling_together(seen).tolist() == [expected] * 2


@pytest.mark.parametrize(
    ("seen", "expected"),
    [
        (episode(drive((0.2, -0.2), (-0.1, -0.2), 20), still(*FAR)), True),
        (episode(drive((0.2, -0.2), (0.0, -0.2), 20), still(*FAR)), False),  # 20 cm away: not seen
        (episode(still(-0.1, -0.2), still(*FAR)), False),  # it never moved
        (episode(drive((0.2, -0.2), (-0.1, -0.2), 20), still(*FAR), touch=1.0), False),  # the box stopped it
        (episode(drive((0.4, 0.0), (0.45, -0.2), 20), still(0.45, -0.1)), False),  # the wall may have
        (episode(drive((0.2, -0.2), (-0.1, -0.2), 58), still(*FAR)), False),  # it may go on
    ],
)
def test_stopped_for_robot(seen: Episode, expected: bool) -> None:
    assert first(census.stopped_for_robot, seen) == expected


@pytest.mark.parametrize(
    ("seen", "expected"),
    [
        (episode(still(*HOME), still(*FAR), homing=(5, np.nan)), True),
        (episode(still(*HOME), still(*FAR), homing=(5, np.nan), touch=1.0, command=0.0), True),  # touches, drives not
        (episode(still(*HOME), still(*FAR), homing=(5, np.nan), touch=HALF_TIME), False),  # it pushed
        (episode(drive(HOME, FAR, 10), still(*FAR), homing=(0.1, np.nan)), False),  # it left
        (episode(still(*HOME), still(*FAR)), False),  # nobody counted it as home
        (episode(drive(HOME, FAR, 40), still(*FAR), homing=(50, np.nan)), False),  # it was there before, not after
    ],
)
def test_homed_without_pushing(seen: Episode, expected: bool) -> None:
    assert first(census.homed_without_pushing, seen) == expected


@pytest.mark.parametrize(
    ("seen", "expected"),
    [
        (episode(still(*FAR), still(*HOME), touch=HALF_TIME), True),
        (episode(still(*HOME), still(*FAR), touch=HALF_TIME), False),  # within the signal
        (episode(still(*FAR), still(*HOME), touch=np.where(TIME < 0.5, 1.0, 0.0)), False),  # only brushed it
        (episode(still(*FAR), still(*HOME), touch=HALF_TIME, command=0.12), True),
        (episode(still(*FAR), still(*HOME), touch=HALF_TIME, command=0.08), False),  # hardly drove
        (episode(still(*FAR), still(*HOME), touch=HALF_TIME, command=-1.0), False),  # drove backwards
    ],
)
def test_pushed_without_rf(seen: Episode, expected: bool) -> None:
    assert first(census.pushed_without_rf, seen) == expected


def test_shares_are_over_robots_and_episodes() -> None:
    poses = np.stack([np.stack([still(*NEAR_WALL), still(*FAR)], axis=1), np.stack([still(*FAR), still(*FAR)], axis=1)])
    telemetry = Telemetry(
        control_period=PERIOD,
        homing_time=np.full((2, 2), np.nan),
        push_time=np.full(2, np.nan),
        pose=poses,
        command=np.zeros((2, STEPS, 2, 2)),
        touch=np.zeros((2, STEPS, 2, 4)),
        movables=np.stack([BOX, BOX]),
    )
    shares = census.census(CONFIG, telemetry)
    assert list(shares) == list(census.LABELS)
    assert shares["static near a wall"] == 0.25
    assert shares["pushed without RF"] == 0


def test_a_missing_channel_is_named() -> None:
    telemetry = Telemetry(PERIOD, np.zeros((1, 2)), np.zeros(1), pose=np.zeros((1, 9, 2, 3)))
    with pytest.raises(ValueError, match="missing are command, touch, movables"):
        census.census(CONFIG, telemetry)


def test_moving_is_a_speed_whatever_the_period() -> None:
    slow = CONFIG.model_copy(update={"episode": CONFIG.episode.model_copy(update={"control_period": 2.0})})
    pose = np.zeros((9, 2, 3))
    pose[:, 0, 0], pose[:, 1, 0] = 0.018 * np.arange(9), 0.022 * np.arange(9)  # 9 and 11 mm/s
    seen = Episode(slow, pose, np.zeros((9, 2, 2)), np.zeros((9, 2, 4)), BOX[:9], np.full(2, np.nan))
    assert seen.moves[:-1].tolist() == [[False, True]] * 8


def test_an_episode_may_be_shorter_than_a_second() -> None:
    tiny = Episode(CONFIG, np.zeros((3, 2, 3)), np.zeros((3, 2, 2)), np.zeros((3, 2, 4)), BOX[:3], np.full(2, np.nan))
    for criterion in census.LABELS.values():
        assert criterion(tiny).shape == (2,)


# ---- other scenes than the paper's -----------------------------------------------------------------------------------


def in_scene(scene: dict[str, Any], arena: dict[str, Any], movables: FloatArray, *robots: FloatArray) -> Episode:
    config = CONFIG.model_validate({**CONFIG.model_dump(), "scene": scene, "arena": arena})
    still_commands, no_touch = np.zeros((STEPS, 2, 2)), np.zeros((STEPS, 2, 4))
    return Episode(config, np.stack(robots, axis=1), still_commands, no_touch, movables, np.full(2, np.nan))


def test_the_range_is_where_the_emitter_rides() -> None:
    carrier = np.zeros((STEPS, 1, 3))
    carrier[:, 0] = drive((-0.5, 0.0), (0.5, 0.0), 60)
    scene = {"emitters": [{"position": [0.0, 0.0, 0.03], "range": 0.1, "rides_on": 0}]}
    seen = in_scene(scene, {}, carrier, still(-0.5, 0.0), still(0.5, 0.0))
    assert seen.in_range[0].tolist() == [True, False]
    assert seen.in_range[-1].tolist() == [False, True]


def test_nobody_is_in_range_without_an_emitter() -> None:
    seen = in_scene({"emitters": [], "movables": []}, {}, np.zeros((STEPS, 0, 3)), still(*HOME), still(*HOME))
    assert not seen.in_range.any()


def test_walls_are_those_of_the_arena_and_obstacles() -> None:
    pillar = {"obstacles": [{"shape": "cylinder", "size": [0.1, 0.1, 0.1], "pose": [0.0, 0.0, 0.0]}]}
    round_arena = {"shape": "circle", "size": 1.0}
    places = still(0.1, 0.05), still(0.3, 0.3)  # 0.06 m from the pillar, 0.08 m from the round wall
    assert in_scene(pillar, round_arena, BOX, *places).near_wall[0].tolist() == [True, True]
    assert in_scene({}, {}, BOX, *places).near_wall[0].tolist() == [False, False]

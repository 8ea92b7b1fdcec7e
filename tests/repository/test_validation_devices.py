# SPDX-License-Identifier: BSD-3-Clause
"""Devices among cylinders, obstacles, walls of any arena and emitters that ride, against brute force; and at limits."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

# The benchmarks are not installed. At the end of the path: the installed swarmevo comes first.
sys.path.append(str(Path(__file__).parents[2]))

from benchmarks import validation_devices as devices
from benchmarks import validation_objects as objects
from benchmarks.validation_scenes import changed, standing
from swarmevo.config import Config, models
from swarmevo.protocols import FloatArray

LEAST_ANSWERS = {"infrared": 1500, "touch": 40, "rf": 60, "rf_bearing": 120, "range_and_bearing": 300, "ground": 60,
                 "light": 150}  # fmt: skip


def test_all_devices_in_random_scenes_of_all_objects() -> None:
    found = devices.merged([devices.check(devices.moments(devices.random_config(k), 4)) for k in range(6)])
    for name, check in found.items():
        assert check.largest <= devices.LARGEST, name
        assert check.answering >= LEAST_ANSWERS[name], name
        assert check.undecided < check.readings / 50, name


@pytest.mark.parametrize(
    ("section", "change"),
    [
        ("sensors", {"infrared_target": "walls_and_robots"}),
        ("sensors", {"touch_half_width_deg": 28.0}),
        ("robot", {"height": 0.06}),
        ("scene", {"obstacles": ()}),
        ("scene", {"patches": ()}),
    ],
)
def test_another_world_is_told_apart(section: str, change: dict[str, Any]) -> None:
    seen = devices.moments(devices.random_config(0), 4)
    other = changed(seen[0].config, **{section: change})
    checks = devices.check([moment._replace(config=other) for moment in seen])
    assert max(check.largest for check in checks.values()) > 0.01


@pytest.mark.parametrize("name", devices.MOTIONS)
def test_wheels_and_what_is_pushed_move_as_sensors_say(name: str) -> None:
    (case,) = (case for case in objects.CASES if case.name == name)
    moved = devices.motion(case)
    assert moved.wheels < 1e-12
    assert moved.movable <= devices.LARGEST_MOTION
    assert moved.answering > 10 or not case.movables


# ---- at limits -------------------------------------------------------------------------------------------------------


def reading(device: str, *poses: tuple[float, float, float], **sections: dict[str, Any]) -> FloatArray:
    """Return what the first robot reads that stands at a pose, alone but for others that are given."""
    lists = {"movables": (), "obstacles": (), "emitters": (), "goals": ()} | sections.pop("scene", {})
    robot = {"sensors": (device,)}
    config = changed(standing(poses), scene=lists, robot=robot, episode={"horizon": 0.1}, **sections)
    (moment,) = devices.moments(config, 1)
    return moment.observations[device][0]


EPSILON = 1e-9
RADIUS = Config().robot.radius
END = Config().sensors.infrared_curve[-1]
AHEAD: dict[str, Any] = {"infrared_yaw_deg": (0.0,)}
POST = objects.post(0.1, 0.2, 0.0)
WALL = objects.partition((0.3, -0.1), (0.3, 0.1))


@pytest.mark.parametrize(
    ("arena", "obstacles", "at"),
    [
        ({"shape": "circle", "size": 0.8}, (), 0.4),
        ({"shape": "polygon", "corners": ((-0.5, -0.5), (0.5, -0.4), (0.5, 0.4), (-0.5, 0.5))}, (), 0.5),
        ({}, (POST,), 0.15),
        ({}, (WALL,), 0.295),
    ],
)
def test_infrared_at_the_ends_of_its_curve(arena: dict[str, Any], obstacles: Any, at: float) -> None:
    def of(distance: float) -> float:
        pose = (at - RADIUS - distance, 0.0, 0.0)
        return float(reading("infrared", pose, arena=arena, sensors=AHEAD, scene={"obstacles": obstacles})[0])

    assert of(EPSILON) == pytest.approx(1, abs=1e-6)
    assert of(END[0] - EPSILON) == pytest.approx(END[1] / 4095, rel=1e-6)
    assert of(END[0] + EPSILON) == 0


@pytest.mark.parametrize("shape", ["box", "cylinder"])
def test_touch_at_the_ends_of_its_range(shape: str) -> None:
    movable = objects.box(0.1, 0.2, 0.05, (0, 0, 0)) if shape == "box" else objects.cylinder(0.1, 0.05, (0, 0, 0))

    def of(gap: float, mode: str = "binary") -> float:
        sensors = {"touch_yaw_deg": (0.0,), "touch_range": 0.03, "touch_mode": mode}
        scene = {"movables": (movable,)}
        return float(reading("touch", (-0.05 - RADIUS - gap, 0.0, 0.0), sensors=sensors, scene=scene)[0])

    assert of(EPSILON) == of(0.03 - EPSILON) == 1
    assert of(0.03 + EPSILON) == 0
    assert of(EPSILON, "graded") == pytest.approx(1, abs=1e-6)
    assert of(0.03 - EPSILON, "graded") == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize(("device", "silent"), [("rf", 1 / 50), ("light", 0.0)])
def test_emitters_at_the_ends_of_their_range(device: str, silent: float) -> None:
    top = Config().robot.height
    source = models.Emitter(channel=device, position=(0.0, 0.0, top), range=0.3, strength=(1.0, 50.0))

    def of(distance: float) -> float:
        values = reading(device, (-distance, 0.0, 0.0), scene={"emitters": (source,)})
        assert np.count_nonzero(values[1:]) == 0  # it is ahead
        return float(values[0])

    assert of(0.3 - EPSILON) == pytest.approx(1 / 0.09 / 50, rel=1e-6)
    assert of(0.3 + EPSILON) == pytest.approx(silent)
    assert of(0.14) == 1  # 1/r^2 is above 50
    assert of(0.15) == pytest.approx(1 / 0.0225 / 50)


def test_sectors_end_half_way_between_their_middles() -> None:
    source = models.Emitter(channel="light", position=(0.0, 0.0, 0.1), reach="arena", strength=(0.0, 50.0))
    for edge in range(8):
        bearing = np.pi / 4 * (edge + 0.5)
        for side in (-EPSILON, EPSILON):
            values = reading("light", (0.3, 0.0, np.pi - bearing - side), scene={"emitters": (source,)})
            assert np.flatnonzero(values).tolist() == [(edge + (side > 0)) % 8]


def test_the_sector_of_a_robot_is_that_of_its_centre_up_to_the_range() -> None:
    for edge in range(4):
        bearing = np.pi / 2 * (edge + 0.5)
        for side in (-EPSILON, EPSILON):
            other = (0.2 * np.cos(bearing + side), 0.2 * np.sin(bearing + side), 1.0)
            values = reading("range_and_bearing", (0.0, 0.0, 0.0), other)
            assert np.flatnonzero(values).tolist() == [(edge + (side > 0)) % 4]
            assert values.max() == pytest.approx(1 - 0.2 / 0.7)
    assert not reading("range_and_bearing", (0.0, 0.0, 0.0), (0.3 + EPSILON, 0.0, 0.0),
                       sensors={"range_and_bearing_range": 0.3}).any()  # fmt: skip


def test_a_pressed_bumper_reads_as_contact() -> None:
    """At a round wall, a slanted one, a post and a wall among the obstacles; wheels slip and turn on."""
    scenes = [
        objects.Case("round", [(0.3, 0.0, 0.0)], arena=objects.ROUND),
        objects.Case("hexagon", [(0.2, 0.1155, np.pi / 6)], arena=objects.HEXAGON),
        objects.Case("post", [(0.05, 0.0, 0.0)], obstacles=[POST]),
        objects.Case("wall", [(0.2, 0.0, 0.0)], obstacles=[WALL]),
    ]
    for case in scenes:
        config = changed(case.config(), robot={"sensors": ("infrared", "odometry")}, sensors=AHEAD)
        seen = devices.drive_blind(config, np.array([(1.0, 1.0)]))
        assert seen[0, 0, 0] < 1
        np.testing.assert_allclose(seen[-1, 0], 1, atol=1e-12)

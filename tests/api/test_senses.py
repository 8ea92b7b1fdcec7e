# SPDX-License-Identifier: BSD-3-Clause
"""A controller acts in worlds whose robots observe what it was made for, and in no others."""

from __future__ import annotations

import pytest

import swarmevo as se
from swarmevo.config import load, scene_info, sense_errors
from swarmevo.simulation import Scene


def test_another_list_is_refused_with_one_line() -> None:
    paper = load("paper")
    assert sense_errors(paper, load("paper", ["sensors.infrared_yaw_deg=[1, 2, 3, 4, 5, 6, 7, 8]"])) == []
    (line,) = sense_errors(paper, load("paper", ["robot.sensors=[rf, infrared, touch]"]))
    assert line == (
        "robot.sensors: expected the observations and commands that the controller was made for, 13 and 2 of infrared, "
        "touch, rf; got 13 and 2 of rf, infrared, touch"
    )
    bits = ["robot.sensors=[infrared, range_and_bearing]", "sensors.range_and_bearing_message=2"]
    assert sense_errors(load("paper", bits[:1]), load("paper", bits)) != []
    assert scene_info(load("paper", bits)).message == 2


def test_the_shipped_controller_refuses_other_sensors() -> None:
    with pytest.raises(se.ConfigError, match=r"robot.sensors: expected the observations and commands"):
        se.best().simulate(1, set={"robot.sensors": ["rf", "infrared", "touch"]})


def test_message_bits_want_the_device_that_sends_them() -> None:
    with pytest.raises(
        se.SwarmevoError,
        match=r"^sensors.range_and_bearing_message: expected 0 bits of a robot without range_and_bearing, got 2: add ",
    ):
        Scene(load("paper", ["sensors.range_and_bearing_message=2"]))


@pytest.mark.parametrize(("reach", "name"), [("range", "robots at the source"), ("arena", "robots at the beacon")])
def test_rates_are_called_as_the_scene_has_it(reach: str, name: str) -> None:
    told = se.best().simulate(1, set={"emitter.reach": reach, "episode.horizon": 1})._repr_html_()
    assert name in told
    assert "box at the wall" in told

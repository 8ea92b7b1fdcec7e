# SPDX-License-Identifier: BSD-3-Clause
"""What a plugin sees of telemetry."""

from __future__ import annotations

import copy
import dataclasses
import pickle

import numpy as np
import pytest

from swarmevo.protocols import CHANNELS, SceneInfo, Telemetry

WORLD = {"box": {"size": (0.3, 0.2, 0.1)}, "arena": {"target_wall": "east"}}


def telemetry() -> Telemetry:
    pose, rf = np.ones((2, 4, 3, 3)), np.ones((2, 4, 3))
    return Telemetry(0.1, np.zeros((2, 3)), np.zeros(2), pose=pose, rf=rf, world=WORLD)


def test_channels_are_attributes() -> None:
    seen = telemetry()
    assert seen.pose is seen.channels["pose"]
    assert seen.rf.shape == (2, 4, 3)
    assert {"pose", "rf", "homing_time"} <= set(dir(seen))
    assert repr(seen) == "<Telemetry: 2 episodes of 3 robots; pose, rf>"


def test_a_channel_that_was_not_recorded_says_what_to_do() -> None:
    with pytest.raises(AttributeError, match=r'^touch was not recorded: add "touch" to the channels of the fitness'):
        _ = telemetry().touch
    assert not hasattr(telemetry(), "touch")


def test_what_is_no_channel_is_told_with_those_that_are() -> None:
    with pytest.raises(AttributeError, match="Telemetry has no 'smell'; the channels are pose, command"):
        _ = telemetry().smell
    with pytest.raises(TypeError, match=r"expected channels among pose, command, .*; got smell"):
        Telemetry(0.1, np.zeros((2, 3)), np.zeros(2), smell=np.zeros(2))


def test_replacing_a_part_keeps_the_others() -> None:
    seen = dataclasses.replace(telemetry(), push_time=np.ones(2))
    assert seen.push_time[0] == 1
    assert set(seen.channels) == {"pose", "rf"}
    assert seen.world == WORLD
    assert dataclasses.replace(telemetry(), rf=np.zeros((2, 4, 3))).rf[0, 0, 0] == 0


def test_telemetry_is_frozen() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        telemetry().push_time = np.ones(2)  # type: ignore[misc]
    with pytest.raises(dataclasses.FrozenInstanceError):
        telemetry().pose = np.ones(2)


def test_a_world_is_read_only_and_nobody_elses() -> None:
    given = copy.deepcopy(WORLD)
    seen = Telemetry(0.1, np.zeros((2, 3)), np.zeros(2), world=given)
    given["box"]["size"] = (9, 9, 9)
    assert seen.world["box"]["size"] == (0.3, 0.2, 0.1)
    with pytest.raises(TypeError, match="does not support item assignment"):
        seen.world["box"]["size"] = (9, 9, 9)  # type: ignore[index]
    with pytest.raises(TypeError, match="does not support item assignment"):
        seen.world["box"] = {}  # type: ignore[index]


def test_telemetry_that_nobody_gave_a_world_has_an_empty_one() -> None:
    assert Telemetry(0.1, np.zeros((2, 3)), np.zeros(2)).world == {}


@pytest.mark.parametrize("duplicate", [copy.copy, copy.deepcopy, lambda seen: pickle.loads(pickle.dumps(seen))])
def test_telemetry_travels(duplicate: object) -> None:
    seen = duplicate(telemetry())  # type: ignore[operator]
    assert seen.control_period == 0.1
    assert np.array_equal(seen.pose, telemetry().pose)
    assert set(seen.channels) == {"pose", "rf"}
    assert seen.world == WORLD
    with pytest.raises(TypeError, match="does not support item assignment"):
        seen.world["box"]["size"] = 1


@pytest.mark.parametrize("duplicate", [copy.copy, copy.deepcopy, lambda seen: pickle.loads(pickle.dumps(seen))])
def test_a_scene_travels_and_is_read_only(duplicate: object) -> None:
    given = copy.deepcopy(WORLD)
    scene = SceneInfo(robots=2, control_steps=30, control_period=0.1, world=given)
    given["box"]["size"] = (9, 9, 9)
    other = duplicate(scene)  # type: ignore[operator]
    assert other == scene
    assert hash(other) == hash(scene)
    assert (other.horizon, other.world["box"]["size"]) == (3.0, (0.3, 0.2, 0.1))
    with pytest.raises(TypeError, match="does not support item assignment"):
        other.world["box"]["size"] = 1


def test_a_scene_names_what_a_controller_reads_and_says() -> None:
    scene = SceneInfo(1, 1, 0.1)
    assert scene.world == {}
    assert len(scene.observation_names) == scene.observations
    assert len(scene.command_names) == scene.commands


def test_a_channels_sizes() -> None:
    scene = SceneInfo(4, 10, 0.1, observation_names=("infrared_0", "infrared_1", "rf"), infrared=2)
    assert CHANNELS["pose"].sizes(scene) == (4, 3)
    assert CHANNELS["rf"].sizes(scene) == (4,)
    assert CHANNELS["box"].sizes(scene) == (3,)
    assert CHANNELS["box_contact"].sizes(scene) == ()
    assert CHANNELS["observation"].sizes(scene) == (4, 3)
    assert CHANNELS["infrared"].sizes(scene) == (4, 2)
    assert CHANNELS["touch"].sizes(scene) == (4, 4)
    assert CHANNELS["command"].sizes(scene) == (4, 2)

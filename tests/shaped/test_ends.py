# SPDX-License-Identifier: BSD-3-Clause
"""Where the box and the team are at the end."""

from __future__ import annotations

import numpy as np
import pytest

from swarmevo import config
from swarmevo.protocols import Descriptor, Telemetry
from swarmevo.testing import FitnessTests, SwitchCounter
from swarmevo_shaped.descriptors import BoxEnd, TeamEnd


class TestBoxEnd(FitnessTests):
    def create(self):
        return BoxEnd(self.scene)


class TestTeamEnd(FitnessTests):
    def create(self):
        return TeamEnd(self.scene)


def end(push_time, steps=4):
    """Return the end of the box in one episode with a horizon of 0.4 s, in which it goes 0.1 m north in each step."""
    scene = config.scene_info(config.load("paper", ["episode.horizon=0.4"]))
    box = np.zeros((1, steps, 3))
    box[0, :, 1] = 0.1 * np.arange(steps)
    telemetry = Telemetry(0.1, np.full((1, 5), np.nan), np.array([push_time]), box=box, world=scene.world)
    return BoxEnd(scene).describe(telemetry, np.zeros((1, 1)), SwitchCounter())[0].tolist()


def test_the_end_is_that_of_the_last_step():
    assert end(np.nan) == [0.0, 0.1 * 3]


def test_what_comes_after_the_push_does_not_count():
    """Whether the episode ends with it or not."""
    assert end(0.2) == end(0.2, steps=2) == [0.0, 0.1]
    assert end(0.0) == end(0.0, steps=1) == [0.0, 0.0]


def test_the_range_is_the_arena():
    fitness = BoxEnd(config.scene_info(config.load("paper", ["arena={shape: rectangle, sides: [2.5, 1]}"])))
    assert fitness.descriptors == (Descriptor("box_end_x", (-1.25, 1.25)), Descriptor("box_end_y", (-0.5, 0.5)))


def test_a_scene_without_anything_to_push_is_refused():
    with pytest.raises(ValueError, match=r"^scene: expected something to push, got no movables"):
        BoxEnd(config.scene_info(config.load("paper", ["scene.movables=[]"])))


@pytest.mark.parametrize(("push_time", "step"), [(np.nan, 3), (0.2, 1)])
def test_the_end_of_a_team_is_the_middle_of_its_robots(push_time, step):
    """Of three robots that go east at 1, 2 and 6 m/s."""
    scene = config.scene_info(config.load("paper", ["episode.horizon=0.4", "team.robots=3"]))
    pose = np.zeros((1, 4, 3, 3))
    pose[0, :, :, 0] = np.outer(0.1 * np.arange(4), [1.0, 2.0, 6.0])
    telemetry = Telemetry(0.1, np.full((1, 3), np.nan), np.array([push_time]), pose=pose, world=scene.world)
    found = TeamEnd(scene).describe(telemetry, np.zeros((1, 1)), SwitchCounter())
    np.testing.assert_allclose(found, [[0.3 * step, 0.0]])


def test_a_team_is_described_where_there_is_nothing_to_push():
    scene = config.scene_info(config.load("phototaxis"))
    assert [one.name for one in TeamEnd(scene).descriptors] == ["team_end_x", "team_end_y"]
    west, east, south, north = scene.arena
    assert [one.range for one in TeamEnd(scene).descriptors] == [(west, east), (south, north)]

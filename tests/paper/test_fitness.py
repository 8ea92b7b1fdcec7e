# SPDX-License-Identifier: BSD-3-Clause
"""The paper's objectives: numbers worked out by hand from eq. 1 and 2, and the conformance kit."""

from __future__ import annotations

import re
import tracemalloc

import numpy as np
import pytest

from swarmevo import config
from swarmevo.protocols import Objective, SceneInfo, Telemetry
from swarmevo.testing import FitnessTests, SwitchCounter, random_telemetry
from swarmevo_paper.fitness import BoxPushing, HiddenNeurons
from swarmevo_paper.network import FeedForwardNetwork

NO_GENOMES = np.zeros((0, 0))


class TestConformanceBoxPushing(FitnessTests):
    def create(self):
        return BoxPushing()


class TestConformanceMotion(FitnessTests):
    def create(self):
        return BoxPushing(sum_covers="motion")


class TestConformanceSingleRobot(FitnessTests):
    scene = SceneInfo(robots=1, control_steps=1800, control_period=0.1)

    def create(self):
        return BoxPushing()


class TestConformanceHiddenNeurons(FitnessTests):
    def create(self):
        return HiddenNeurons()

    def controller(self):
        return FeedForwardNetwork()


def episode(infrared=0.0, touch=0.0, rf=1.0, command=(0.0, 0.0), steps=4, robots=1):
    """Return one episode in which nothing changes."""
    return Telemetry(
        control_period=0.1,
        homing_time=np.full((1, robots), np.nan),
        push_time=np.full(1, np.nan),
        infrared=np.full((1, steps, robots, 8), infrared),
        touch=np.full((1, steps, robots, 4), touch),
        rf=np.full((1, steps, robots), rf),
        command=np.tile(np.array(command, dtype=float), (1, steps, robots, 1)),
    )


def test_without_anything_to_push_there_is_no_term_of_pushing():
    world = {"scene": {"emitters": [{"channel": "rf", "strength": [1.0, 50.0]}]}}
    nothing = SceneInfo(robots=1, control_steps=4, control_period=0.1, movables=0, world=world)
    assert list(BoxPushing(scene=nothing).terms(episode())) == ["homing"]
    assert list(BoxPushing().terms(episode())) == ["homing", "pushing"]


def f1(telemetry, **options):
    return BoxPushing(**options).evaluate(telemetry, NO_GENOMES, SwitchCounter())[:, 0].tolist()


@pytest.mark.parametrize(
    ("situation", "expected"),
    [
        ({}, 0.0),
        ({"command": (1, 1), "rf": 50.0, "touch": 1.0}, 100.0),
        ({"command": (1, 1)}, 1.0),
        ({"command": (1, 1), "rf": 20.0}, 20.0),
        ({"command": (1, 1), "infrared": 0.25, "rf": 20.0}, 15.0),
        ({"command": (1, 1), "infrared": 1.0}, 0.0),
        ({"command": (1, 0.5)}, 1 * 0.5 * 0.75),
        ({"command": (1, -1)}, 0.0),
        ({"command": (-1, -1)}, 0.0),
        ({"touch": 0.5, "rf": 30.0}, 15.0),
        ({"touch": 0.5, "rf": 30.0, "command": (1, 1), "infrared": 0.5}, 30.0),
    ],
)
def test_f1_by_hand(situation, expected):
    assert f1(episode(**situation)) == [expected]


def test_the_highest_sensor_counts():
    telemetry = episode(command=(1, 1), rf=10.0)
    telemetry.infrared[..., 3] = 0.5
    telemetry.touch[..., 2] = 0.25
    assert f1(telemetry) == [0.5 * 10 + 10 * 0.25]


def test_f1_is_the_mean_over_steps_and_robots():
    telemetry = episode(robots=2, steps=4)
    telemetry.command[0, :2, 0] = 1.0  # one of two robots moves in two of four steps
    assert f1(telemetry) == [0.25]


def test_a_sum_over_motion_adds_the_last_pushing():
    telemetry = episode(command=(1, 1), rf=10.0)
    telemetry.touch[0, -1] = 1.0
    assert f1(telemetry, sum_covers="both") == [10 + 10 / 4]
    assert f1(telemetry, sum_covers="motion") == [10 + 10]


def test_names_and_ranges():
    assert BoxPushing().objectives == (Objective("box_pushing", "maximise", (0.0, 100.0)),)
    assert BoxPushing(strength=10).objectives[0].range == (0.0, 20.0)


def test_the_range_of_f1_is_made_of_the_strength_in_its_scene():
    assert BoxPushing().objectives[0].range == (0.0, 100.0)
    scene = config.scene_info(config.load("paper", ["emitter.strength=[1, 300]"]))
    assert BoxPushing(scene=scene).objectives[0].range == (0.0, 600.0)
    several = ["scene.emitters=[{strength: [1, 20]}, {strength: [2, 70], channel: beacon}]"]
    assert BoxPushing(scene=config.scene_info(config.load("paper", several))).objectives[0].range == (0.0, 140.0)
    assert BoxPushing(strength=10, scene=scene).objectives[0].range == (0.0, 20.0)
    assert BoxPushing(scene=config.scene_info(config.load("paper", []))).objectives == BoxPushing().objectives
    assert HiddenNeurons(20).objectives == (Objective("hidden_neurons", "minimise", (0.0, 20.0)),)
    assert not HiddenNeurons().channels


@pytest.mark.parametrize("emitters", ["[]", "[{channel: light}]"])
def test_a_scene_without_a_signal_is_refused(emitters: str) -> None:
    nobody = config.scene_info(config.load("paper", [f"scene.emitters={emitters}"]))
    with pytest.raises(ValueError, match=r"scene\.emitters: expected one to home in on, got none but lights"):
        BoxPushing(scene=nobody)


def test_only_hidden_neurons_are_a_matter_of_the_genome():
    assert (BoxPushing().objectives[0].of, HiddenNeurons().objectives[0].of) == ("episode", "genome")


def test_no_episodes_no_values():
    telemetry = random_telemetry(BoxPushing.channels, episodes=0)
    assert BoxPushing().evaluate(telemetry, NO_GENOMES, SwitchCounter()).shape == (0, 1)


def test_needs_little_memory():
    telemetry = random_telemetry(BoxPushing.channels, episodes=30, steps=300)
    tracemalloc.start()
    f1(telemetry)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < telemetry.command.nbytes  # the smallest channel but one


def test_a_missing_channel_is_named():
    telemetry = random_telemetry(["infrared", "touch", "command"], episodes=1)
    with pytest.raises(AttributeError, match='rf was not recorded: add "rf" to the channels of the fitness'):
        f1(telemetry)


def test_f2_counts_hidden_neurons():
    controller = FeedForwardNetwork()
    genomes = np.zeros((2, controller.space(SceneInfo(5, 10, 0.1)).size))
    genomes[1, -4:] = 1.0
    values = HiddenNeurons().evaluate(random_telemetry([], episodes=2), genomes, controller)
    assert values.tolist() == [[0.0], [4.0]]


def test_f2_refuses_more_than_its_maximum():
    controller = FeedForwardNetwork()
    genomes = np.ones((1, controller.space(SceneInfo(5, 10, 0.1)).size))
    with pytest.raises(ValueError, match="expected at most 10 hidden neurons, a genome uses 15"):
        HiddenNeurons(10).evaluate(random_telemetry([], episodes=1), genomes, controller)


@pytest.mark.parametrize(
    ("factory", "options", "message"),
    [
        (BoxPushing, {"sum_covers": "all"}, "sum_covers: expected one of both, motion, got 'all'"),
        (BoxPushing, {"strength": 0}, "strength: expected a number above 0, got 0"),
        (BoxPushing, {"strength": float("nan")}, "strength: expected a number above 0, got nan"),
        (BoxPushing, {"strength": "50"}, "strength: expected a number above 0, got '50'"),
        (HiddenNeurons, {"maximum": 0}, "maximum: expected a whole number of at least 1, got 0"),
        (HiddenNeurons, {"maximum": 1.5}, "maximum: expected a whole number of at least 1, got 1.5"),
    ],
)
def test_wrong_options_are_one_clear_line(factory, options, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        factory(**options)

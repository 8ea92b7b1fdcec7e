# SPDX-License-Identifier: BSD-3-Clause
"""The paper's controller: its chromosome, its networks, and the conformance kit."""

from __future__ import annotations

import re

import numpy as np
import pytest

from swarmevo.protocols import NativeController, SceneInfo
from swarmevo.testing import ControllerTests, random_genomes
from swarmevo_paper.network import FeedForwardNetwork

SCENE = SceneInfo(robots=5, control_steps=10, control_period=0.1)


def made(**options):
    """Return the controller, which has been asked about the scene."""
    controller = FeedForwardNetwork(**options)
    controller.space(SCENE)
    return controller


class TestConformance(ControllerTests):
    def create(self):
        return FeedForwardNetwork()


class TestConformanceSmall(ControllerTests):
    def create(self):
        return FeedForwardNetwork(hidden=1, bias=False, activation="logistic")


def test_is_native():
    assert isinstance(FeedForwardNetwork(), NativeController)


def test_chromosome_has_the_papers_blocks():
    space = FeedForwardNetwork().space(SCENE)
    shapes = {block.name: (block.shape, block.kind) for block in space.blocks}
    assert shapes == {
        "input_hidden": ((15, 14), "real"),
        "hidden_output": ((2, 16), "real"),
        "hidden_switch": ((15,), "switch"),
    }
    assert space.size == 15 * 14 + 2 * 16 + 15


def test_hidden_neurons_mutate_as_wholes_and_cross_over_in_two_links():
    space = FeedForwardNetwork().space(SCENE)
    unit, link, part = (space.split(numbers) for numbers in (space.unit_of, space.link_of, space.part_of))
    for h in range(15):
        assert np.all(unit["input_hidden"][h] == unit["hidden_switch"][h])
        assert np.all(unit["hidden_output"][:, h] == unit["hidden_switch"][h])
        assert np.all(link["input_hidden"][h] == link["hidden_switch"][h])
        assert np.all(link["hidden_output"][:, h] != link["hidden_switch"][h])
    assert len(set(space.unit_of)) == 15 + 1  # and the outputs' bias
    assert len(set(space.link_of)) == 2 * 15 + 1
    assert len(set(space.part_of)) == 3 * 15 + 1
    assert not set(part["input_hidden"].ravel()) & set(part["hidden_switch"])


def test_policies_hold_the_genomes_weights():
    controller = FeedForwardNetwork(hidden=2)
    genomes = np.arange(2.0 * controller.space(SCENE).size).reshape(2, -1)
    genomes[:, -2:] = [[0.0, 1.0], [0.5, 0.49]]
    networks = controller.policies(genomes)
    np.testing.assert_array_equal(networks.input_hidden[0], np.arange(28.0).reshape(2, 14))
    np.testing.assert_array_equal(networks.hidden_output[0], np.arange(28.0, 34.0).reshape(2, 3))
    np.testing.assert_array_equal(networks.hidden_switch, [[False, True], [True, False]])
    assert networks.bias
    assert networks.activation == "tanh"


def test_without_bias_there_are_no_bias_weights():
    controller = FeedForwardNetwork(hidden=3, bias=False, activation="logistic")
    networks = controller.policies(random_genomes(controller.space(SCENE), 4))
    assert networks.input_hidden.shape == (4, 3, 13)
    assert networks.hidden_output.shape == (4, 2, 3)
    assert not networks.bias
    assert networks.activation == "logistic"


def test_complexity_counts_hidden_neurons_that_are_on():
    controller = FeedForwardNetwork()
    genomes = np.zeros((3, controller.space(SCENE).size))
    genomes[1, -15:] = 1.0
    genomes[2, [-15, -1]] = 0.5
    np.testing.assert_array_equal(controller.complexity(genomes), [0.0, 15.0, 2.0])


def test_genomes_of_another_size_are_refused():
    with pytest.raises(ValueError, match="expected 257 entries along the last axis, got 256"):
        made().policies(np.zeros((1, 256)))


def test_genomes_before_their_scene_are_refused():
    with pytest.raises(ValueError, match=r"expected space\(scene\) to be asked for first"):
        FeedForwardNetwork().policies(np.zeros((1, 257)))


def test_a_genome_is_as_long_as_robots_observe_and_are_told():
    scene = SceneInfo(5, 10, 0.1, observation_names=("a", "b"), command_names=("left", "right", "message_0"))
    controller = FeedForwardNetwork(hidden=4)
    assert controller.space(scene).size == 4 * 3 + 3 * 5 + 4
    networks = controller.policies(np.zeros((2, 31)))
    assert networks.input_hidden.shape == (2, 4, 3)
    assert networks.hidden_output.shape == (2, 3, 5)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"hidden": 0}, "hidden: expected a whole number from 1 to 1024, got 0"),
        ({"hidden": 1025}, "hidden: expected a whole number from 1 to 1024, got 1025"),
        ({"hidden": 1.5}, "hidden: expected a whole number from 1 to 1024, got 1.5"),
        ({"hidden": True}, "hidden: expected a whole number from 1 to 1024, got True"),
        ({"bias": 1}, "bias: expected true or false, got 1"),
        ({"activation": "relu"}, "activation: expected one of tanh, logistic, got 'relu'"),
    ],
)
def test_wrong_options_are_one_clear_line(options, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        FeedForwardNetwork(**options)

# SPDX-License-Identifier: BSD-3-Clause
"""What hidden neurons did in an episode, held against the commands that the library made of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarmevo.analysis import networks
from swarmevo.analysis.recording import Recording, record
from swarmevo.config import Config
from swarmevo.plugins.team import Team
from swarmevo.protocols import Compiled, FeedForward, Recurrent
from swarmevo.simulation import EpisodeKey
from swarmevo.views.replay import networks as replay_networks

NETWORKS: dict[str, dict[str, Any]] = {
    "feedforward": {"hidden": 4},
    "elman": {"hidden": 4, "activation": "logistic"},
    "jordan": {"hidden": 4},
    "ctrnn": {"hidden": 4},
}
OUTPUTS = {"tanh": np.tanh, "logistic": lambda x: 2 / (1 + np.exp(-x)) - 1}


def recorded(controller: str, **team: Any) -> Recording:
    settings = Config.model_validate(
        {
            "controller": {controller: NETWORKS.get(controller, {})},
            "team": {"robots": 3, **team},
            "episode": {"horizon": 6.0},
            "fitness": {"hidden_neurons": {}},
        }
    )
    genes = np.random.default_rng(7).normal(0, 1.5, Team(settings).space.size)
    return record(settings, genes, [EpisodeKey(1, 0, 0, 0)])


@pytest.mark.parametrize("controller", NETWORKS)
def test_activations_lead_to_the_library_s_commands(controller: str) -> None:
    """Whoever heard something else, or remembered it otherwise, would command something else."""
    film = recorded(controller)
    policies, telemetry = Team(film.config).policies(film.genes), film.telemetry
    assert policies is not None
    assert not isinstance(policies, Compiled)
    hidden = networks.activations(policies, 0, telemetry.observation[0], telemetry.command[0], 0.1)
    one = networks.network_of(policies, Team(film.config).scene.info)
    sums = hidden @ one.hidden_output.T + one.input_output[:, -1]
    commands = OUTPUTS[policies.activation](sums)
    assert 0 < hidden.shape[-1] <= 4
    assert np.ptp(telemetry.command[0], axis=0).max() > 1e-4  # they do not always do the same
    np.testing.assert_allclose(commands, telemetry.command[0], atol=1e-9)
    assert isinstance(policies, Recurrent) == (controller != "feedforward")


def test_a_linear_network_has_no_hidden_neurons() -> None:
    film = recorded("linear")
    assert replay_networks.activations(film).shape == (60, 3, 0)
    (drawn,) = replay_networks.drawn(film)
    assert drawn["hidden"] == []
    assert {(link[0], link[2]) for link in drawn["links"]} == {("inputs", "outputs")}


def test_robots_with_genomes_of_their_own_have_networks_of_their_own() -> None:
    film = recorded("feedforward", genomes="individual")
    policies = Team(film.config).policies(film.genes)
    assert policies is not None
    found, drawn = replay_networks.activations(film), replay_networks.drawn(film)
    assert len(drawn) == 3
    observation, command = film.telemetry.observation[0], film.telemetry.command[0]
    for robot, one in enumerate(drawn):
        own = networks.activations(policies, robot, observation[:, [robot]], command[:, [robot]], 0.1)[:, 0]
        assert own.shape[-1] == len(one["hidden"])
        np.testing.assert_array_equal(found[:, robot, : own.shape[-1]], own)


def test_compiled_functions_are_refused() -> None:
    with pytest.raises(ValueError, match="expected networks that the library runs, got compiled functions"):
        networks.activations(Compiled(1, np.zeros((1, 1))), 0, np.zeros((1, 1, 1)), np.zeros((1, 1, 2)), 0.1)


@pytest.mark.parametrize("activation", ["tanh", "logistic"])
def test_weights_of_any_size_are_no_warning(activation: str) -> None:
    huge = FeedForward(np.array([[[-1e6, 1e6]]]), np.zeros((1, 2, 2)), np.array([[True]]), True, activation)  # type: ignore[arg-type]
    found = networks.activations(huge, 0, np.array([[[2.0]], [[0.0]]]), np.zeros((2, 1, 2)), 0.1)
    assert found.ravel().tolist() == [-1.0 if activation == "tanh" else 0.0, 1.0]

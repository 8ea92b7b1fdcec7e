# SPDX-License-Identifier: BSD-3-Clause
"""The networks of an episode's robots, as the player draws them at work."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from swarmevo.analysis import networks
from swarmevo.analysis.recording import Recording
from swarmevo.plugins.team import Team
from swarmevo.protocols import Compiled, FeedForward, FloatArray, Linear, Recurrent
from swarmevo.views.text import number


def drawn(recording: Recording) -> list[dict[str, Any]]:
    """Return the names of each network's neurons, and its links; none: the controller is no network of the library.

    One network is all robots', several are those of the robots, in turn. A link is where it comes from and goes to, a
    kind of neurons and a number each, and its weight. Those of recurrent networks lead to hidden neurons, from hidden
    neurons or outputs: what these were a control step ago.
    """
    team = Team(recording.config)
    policies, info = _policies(recording), team.scene.info
    if policies is None:
        return []
    inputs = [*info.observation_names, *(["bias"] if policies.bias else [])]
    found = []
    for i in range(len(policies)):
        one = networks.network_of(policies, info, i)
        links = [
            *_links("inputs", "hidden", one.input_hidden),
            *_links("hidden", "outputs", one.hidden_output),
            *_links("inputs", "outputs", one.input_output),
            *_links("hidden", "hidden", one.remembered[:, : len(one.hidden)]),
            *_links("outputs", "hidden", one.remembered[:, len(one.hidden) :]),
        ]
        found.append(
            {"inputs": inputs, "hidden": list(one.hidden), "outputs": list(info.command_names), "links": links}
        )
    return found


def activations(recording: Recording) -> FloatArray:
    """Return ``(steps, robots, h)``: of the first of the episodes, what each robot's hidden neurons did.

    A network with fewer than the h hidden neurons of the largest has zeros behind them.
    """
    policies, telemetry = _policies(recording), recording.telemetry
    observation, command = telemetry.observation[0], telemetry.command[0]
    if policies is None:
        return np.zeros((*observation.shape[:2], 0))
    period, robots = recording.config.episode.control_period, observation.shape[1]
    each = [
        networks.activations(policies, i % len(policies), observation[:, [i]], command[:, [i]], period)
        for i in range(robots)
    ]
    found = np.zeros((len(observation), robots, max((one.shape[-1] for one in each), default=0)))
    for robot, one in enumerate(each):
        found[:, robot, : one.shape[-1]] = one[:, 0]
    return found


def _policies(recording: Recording) -> FeedForward | Linear | Recurrent | None:
    """Return the networks of an individual; None: it has none that the library runs."""
    policies = Team(recording.config).policies(recording.genes)
    return None if isinstance(policies, Compiled) else policies


def _links(source: str, target: str, weights: FloatArray) -> Iterator[tuple[str, int, str, int, float]]:
    for j, i in zip(*np.nonzero(weights), strict=True):
        yield source, int(i), target, int(j), float(number(weights[j, i]))

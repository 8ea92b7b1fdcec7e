# SPDX-License-Identifier: BSD-3-Clause
"""One world as PettingZoo sees it: each robot is an agent."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from gymnasium.spaces import Box
from pettingzoo import ParallelEnv

from swarmevo.env.worlds import Single, Source, Worlds
from swarmevo.errors import InvalidArgument
from swarmevo.protocols import SceneInfo
from swarmevo.simulation import EpisodeKey

Infos = dict[str, dict[str, Any]]


class SwarmParallelEnv(ParallelEnv[str, Single, Single]):
    """A world of which each robot is an agent, ``robot_0`` and so on, for PettingZoo.

    ::

        env = SwarmParallelEnv("aggregation", seed=1)
        observations, infos = env.reset()
        while env.agents:
            actions = {agent: my_policy(observations[agent]) for agent in env.agents}
            observations, rewards, terminations, truncations, infos = env.step(actions)

    An observation has the readings of ``robot.sensors``, an action a speed of the left and the right wheel in [-1, 1]
    and the bits of a message, if robots send some; both are float32. The reward is the team's: each robot gets all of
    it. All agents end together; then each one's info has the episode's ``objectives``, and ``failed`` where the physics
    did. What no robot knows, and a critic may: ``state()``, with where everything is.

    Args:
        config: Of the world and the fitness functions: the name of a packaged configuration, a YAML file, or a
            :class:`swarmevo.Config`.
        set: ``{"section.key": value}``, which win over it.
        weights: Of the objectives in the reward, by name; None: 1 for each that is measured in an episode.
        seed: Of everything random; None: ``evolution.seed`` of the configuration, or drawn. The n-th episode after the
            construction, or after ``reset(seed=...)``, is that of ``EpisodeKey(seed, 0, n, 0)``.

    Raises:
        ConfigError: The configuration cannot be used.
        EvaluationError: A fitness function is not what it should be, or gives no rewards.
        InvalidArgument: A weight or the seed is refused.
        PluginError: A fitness function cannot be made.
        SimulatorError: The library refuses the world.
    """

    metadata: ClassVar[dict[str, Any]] = {"name": "swarmevo_v0", "render_modes": [], "is_parallelizable": True}
    render_mode = None

    def __init__(
        self,
        config: Source,
        *,
        set: Mapping[str, Any] | None = None,
        weights: Mapping[str, float] | None = None,
        seed: int | None = None,
    ) -> None:
        self._world = Worlds(config, set, 1, weights, seed, threads=1)
        self.possible_agents = [f"robot_{i}" for i in range(self.info.robots)]
        self.agents: list[str] = []
        self.observation_spaces = {agent: self._world.observation_space() for agent in self.possible_agents}
        self.state_space = self._world.state_space()
        self.action_spaces = {agent: self._world.action_space() for agent in self.possible_agents}

    @property
    def info(self) -> SceneInfo:
        """Robots, control steps and control period of the world, and the names of observations and actions."""
        return self._world.info

    @property
    def key(self) -> EpisodeKey:
        """Of the present episode: with it and the same commands ``simulate`` gives the same bits."""
        return self._world.keys[0]

    @property
    def state_names(self) -> tuple[str, ...]:
        """Of what :meth:`state` returns, such as ``robot_0_x`` and ``movable_0_at_goal``."""
        return self._world.state_names

    def observation_space(self, agent: str) -> Box:
        """Return the space of an agent's observations, always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Box:
        """Return the space of an agent's actions, always the same object."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[dict[str, Single], Infos]:
        """Begin the first episode of a seed; None: the next episode.

        Args:
            seed: 0 to 2^64 - 1.
            options: Not read.

        Returns:
            By agent: observations, and infos, which are empty.
        """
        self._world.begin(seed)
        self.agents = self.possible_agents.copy()
        return self._observations(), {agent: {} for agent in self.agents}

    def step(
        self, actions: Mapping[str, Single]
    ) -> tuple[dict[str, Single], dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Let one action of each agent act for a control period.

        Returns:
            By agent: observations; rewards; whether the episode ended at its success; whether at the horizon; infos.

        Raises:
            EvaluationError: A fitness function failed.
            InvalidArgument: Actions are not of all agents, have a wrong shape or are not finite; nothing has moved.
        """
        outcome = self._world.advance(self._commands(actions))
        info: dict[str, Any] = {}
        if outcome.ended[0]:
            info = {"objectives": self._world.objectives(0)} | ({"failed": True} if outcome.failed[0] else {})
        agents, observations = self.agents, self._observations()
        rewards = dict.fromkeys(agents, float(outcome.rewards[0]))
        terminations = dict.fromkeys(agents, bool(outcome.terminated[0]))
        truncations = dict.fromkeys(agents, bool(outcome.truncated[0]))
        if outcome.ended[0]:
            self.agents = []
        return observations, rewards, terminations, truncations, {agent: dict(info) for agent in agents}

    def state(self) -> Single:
        """Return where everything is now, float32 in ``state_space``.

        Of each robot x, y [m], cosine and sine of the heading; of each movable the same, and 1 if it is at a goal; at
        last the share of the horizon that has gone by.
        """
        return np.asarray(self._world.state()[0])

    def close(self) -> None:
        """Free the world; again is fine."""
        self._world.close()

    def _observations(self) -> dict[str, Single]:
        return dict(zip(self.agents, self._world.observe()[0], strict=True))

    def _commands(self, actions: Mapping[str, Single]) -> Single:
        """Return ``(1, robots, commands)``."""
        if not self.agents:
            raise InvalidArgument("step: expected an episode that goes on, got none; call reset")
        if not isinstance(actions, Mapping) or actions.keys() != set(self.agents):
            got = list(actions) if isinstance(actions, Mapping) else type(actions).__name__
            raise InvalidArgument(
                f"actions: expected one of each agent, {self.agents[0]} to {self.agents[-1]}, got {got}"
            )
        try:
            return np.array([[actions[agent] for agent in self.agents]])
        except ValueError:
            raise InvalidArgument(
                f"actions: expected {self.info.commands} numbers of each agent, got arrays of several lengths"
            ) from None

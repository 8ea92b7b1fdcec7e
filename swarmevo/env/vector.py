# SPDX-License-Identifier: BSD-3-Clause
"""Many worlds side by side as Gymnasium sees them: each team is one learner with joint actions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import ArrayLike

from swarmevo.env.worlds import Outcome, Single, Source, Worlds
from swarmevo.errors import InvalidArgument
from swarmevo.protocols import BoolArray, FloatArray, SceneInfo
from swarmevo.simulation import EpisodeKey

Infos = dict[str, Any]


class SwarmVectorEnv(VectorEnv[Single, Single, FloatArray]):
    """Worlds side by side in one lockstep, for Gymnasium.

    ::

        envs = SwarmVectorEnv("aggregation", worlds=64, seed=1)
        observations, infos = envs.reset()                # (worlds, robots, observations)
        while learning:
            actions = my_policy(observations)             # (worlds, robots, commands) in [-1, 1]
            observations, rewards, terminations, truncations, infos = envs.step(actions)

    Observations and actions are those of :class:`SwarmParallelEnv`, of all robots of a world at once; a world's reward
    is its team's. A world that has ended begins its next episode on its own, whatever the others do. Where an episode
    has ended, ``infos`` has its ``objectives``, and ``failed`` where the physics did, laid out as by Gymnasium's own
    vector environments.

    Args:
        config: As in :class:`SwarmParallelEnv`.
        worlds: How many, 1 to 65,536.
        set: As in :class:`SwarmParallelEnv`.
        weights: As in :class:`SwarmParallelEnv`.
        seed: As in :class:`SwarmParallelEnv`; of world i the n-th episode is that of ``EpisodeKey(seed, 0, n, i)``.
        autoreset: When a world that has ended begins again, as Gymnasium defines it: with the next step, whose action
            it does not take; in the same step, where ``infos`` has ``final_obs`` and ``final_info``; or when it is
            reset by ``options={"reset_mask": mask}``. It is in ``metadata["autoreset_mode"]``.
        threads: Worker threads, up to 1024; 0: one for each processor. Results do not depend on it.

    Raises:
        ConfigError, EvaluationError, InvalidArgument, PluginError, SimulatorError: As :class:`SwarmParallelEnv`.
    """

    closed = True  # until there are worlds: Gymnasium closes what it drops

    def __init__(
        self,
        config: Source,
        worlds: int = 1,
        *,
        set: Mapping[str, Any] | None = None,
        weights: Mapping[str, float] | None = None,
        seed: int | None = None,
        autoreset: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int = 1,
    ) -> None:
        self._autoreset = _mode(autoreset)
        self.metadata = {"render_modes": [], "autoreset_mode": self._autoreset}
        self._worlds = Worlds(config, set, worlds, weights, seed, threads)
        self.num_envs, robots = worlds, self.info.robots
        self.single_observation_space = self._worlds.observation_space(robots)
        self.observation_space = self._worlds.observation_space(worlds, robots)
        self.single_action_space = self._worlds.action_space(robots)
        self.action_space = self._worlds.action_space(worlds, robots)
        self.state_space = self._worlds.state_space(worlds)
        self._ended = np.zeros(worlds, dtype=np.bool_)
        self.closed = False

    @property
    def info(self) -> SceneInfo:
        """Robots, control steps and control period of the worlds, and the names of observations and actions."""
        return self._worlds.info

    @property
    def keys(self) -> list[EpisodeKey]:
        """Of the worlds' present episodes: with one and the same commands ``simulate`` gives the same bits."""
        return self._worlds.keys

    def reset(self, *, seed: int | None = None, options: Mapping[str, Any] | None = None) -> tuple[Single, Infos]:
        """Begin the first episodes of a seed; None: the next episodes.

        Args:
            seed: 0 to 2^64 - 1.
            options: ``{"reset_mask": mask}``: only in these worlds, booleans ``(worlds,)``; the others go on.

        Returns:
            Observations ``(worlds, robots, observations)``, and infos, which are empty.

        Raises:
            InvalidArgument: The mask is none, or there is a seed beside it; nothing was reset.
        """
        mask = (options or {}).get("reset_mask")
        if mask is None:
            self._worlds.begin(seed)
            self._ended[:] = False
        else:
            self._reset_some(mask, seed)
        return self._worlds.observe(), {}

    def step(self, actions: ArrayLike) -> tuple[Single, FloatArray, BoolArray, BoolArray, Infos]:
        """Let actions ``(worlds, robots, commands)`` act for a control period.

        Returns:
            Observations; rewards; whether episodes ended at their success; whether at the horizon; infos.

        Raises:
            EvaluationError: A fitness function failed.
            InvalidArgument: The shape is wrong, a number is not finite, or a world has ended and does not begin again
                on its own; nothing has moved.
        """
        over, mode = self._ended.copy(), self._autoreset
        if mode is AutoresetMode.DISABLED and over.any():
            raise InvalidArgument(
                f"step: expected worlds whose episodes go on, got {np.flatnonzero(over)[0]}, which has ended; reset it "
                'by options={"reset_mask": mask}'
            )
        outcome = self._worlds.advance(actions)
        infos = self._infos(outcome)
        if mode is AutoresetMode.SAME_STEP:
            over = outcome.ended
            infos = self._final(infos, over) if over.any() else infos
        if over.any():
            self._worlds.reset(over)
        if mode is not AutoresetMode.SAME_STEP:
            self._ended = outcome.ended
        return self._worlds.observe(), outcome.rewards, outcome.terminated, outcome.truncated, infos

    @property
    def state_names(self) -> tuple[str, ...]:
        """Of a world's values in :meth:`state`, such as ``robot_0_x`` and ``movable_0_at_goal``."""
        return self._worlds.state_names

    def state(self) -> Single:
        """Return where everything is now, ``(worlds, values)``, as :meth:`SwarmParallelEnv.state` has it."""
        return self._worlds.state()

    def close_extras(self, **kwargs: Any) -> None:
        """Free the worlds."""
        self._worlds.close()

    def _reset_some(self, mask: Any, seed: int | None) -> None:
        chosen = np.asarray(mask)
        if chosen.dtype != np.bool_ or chosen.shape != (self.num_envs,) or not chosen.any():
            raise InvalidArgument(
                f"reset_mask: expected {self.num_envs} booleans of which one is True, got {chosen.dtype} of shape "
                f"{chosen.shape}{'' if chosen.any() else ' without a True'}"
            )
        if seed is not None:
            raise InvalidArgument(f"seed: expected None beside a reset_mask, got {seed}; it is that of all worlds")
        self._worlds.reset(chosen)
        self._ended[chosen] = False

    def _infos(self, outcome: Outcome) -> Infos:
        """Return what there is to tell of episodes that ended."""
        infos: Infos = {}
        for world in np.flatnonzero(outcome.ended).tolist():
            one: Infos = {"objectives": self._worlds.objectives(world)}
            infos = self._add_info(infos, one | ({"failed": True} if outcome.failed[world] else {}), world)
        return infos

    def _final(self, infos: Infos, ended: BoolArray) -> Infos:
        """Return the infos of a step in which worlds begin again at once: their own are final."""
        last = np.full(self.num_envs, None, dtype=object)
        for world, observation in zip(np.flatnonzero(ended), self._worlds.observe()[ended], strict=True):
            last[world] = observation
        return {"final_obs": last, "_final_obs": ended, "final_info": infos, "_final_info": ended}


def _mode(given: AutoresetMode | str) -> AutoresetMode:
    try:
        return AutoresetMode(given)
    except ValueError:
        names = ", ".join(mode.value for mode in AutoresetMode)
        raise InvalidArgument(f"autoreset: expected one of {names}, got {given!r}") from None

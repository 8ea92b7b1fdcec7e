# SPDX-License-Identifier: BSD-3-Clause
"""Worlds in one lockstep with their rewards and ends: what both interfaces step."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import ArrayLike, NDArray

from swarmevo import config as configuration
from swarmevo.config import Config
from swarmevo.env.rewards import Rewards
from swarmevo.errors import InvalidArgument, SimulatorError
from swarmevo.plugins.team import load_config
from swarmevo.protocols import BoolArray, FloatArray, Step, Telemetry
from swarmevo.simulation import EpisodeKey, Lockstep, Scene, State

Source: TypeAlias = Config | str | os.PathLike[str]
"""A configuration, the name of a packaged one, or the path of a YAML file."""
Single: TypeAlias = NDArray[np.float32]


@dataclass(frozen=True)
class Outcome:
    """What a control step brought, each ``(worlds,)``. Of worlds that had ended before: nothing."""

    rewards: FloatArray
    terminated: BoolArray
    """Whether the episode ended at its success (``episode.until``)."""
    truncated: BoolArray
    """Whether it ended at the horizon, or because its physics failed."""
    failed: BoolArray
    """Whether its physics failed."""

    @property
    def ended(self) -> BoolArray:
        """``(worlds,)``: whether the episode ended with this step."""
        return self.terminated | self.truncated


class Worlds:
    """Worlds of a configuration, side by side.

    Args:
        source: Of the worlds and of the fitness functions; ``worlds`` and ``vary`` are not read.
        set: ``{"section.key": value}``, which win over it.
        worlds: How many.
        weights: Of the objectives in the rewards; see :class:`Rewards`.
        seed: Of everything random; None: ``evolution.seed``, or drawn.
        threads: Worker threads; 0: one for each processor.

    Raises:
        ConfigError: The configuration cannot be used.
        EvaluationError, PluginError: A fitness function is not what it should be, or gives no rewards.
        InvalidArgument: A number, a weight or the seed is refused.
        SimulatorError: The library refuses the world.
    """

    def __init__(
        self,
        source: Source,
        set: Mapping[str, Any] | None,
        worlds: int,
        weights: Mapping[str, float] | None,
        seed: int | None,
        threads: int,
    ) -> None:
        self._config = _loaded(source, set or {})
        self._scene, self._threads = Scene(self._config), threads
        self.info = self._scene.info
        self._lockstep = Lockstep(self._scene, worlds, _seed(self._config) if seed is None else seed, threads)
        self._rewards = Rewards(self._config, self.info, worlds, weights)
        placed = ("x", "y", "cos", "sin")
        self.state_names = (
            *(f"robot_{i}_{end}" for i in range(self.info.robots) for end in placed),
            *(f"movable_{i}_{end}" for i in range(self.info.movables) for end in (*placed, "at_goal")),
            "time",
        )
        """Of what :meth:`state` returns: x, y [m], cosine and sine of the heading, 1: at a goal, time."""
        self._before = self._state()
        self._is_fresh = True

    def __len__(self) -> int:
        return len(self._lockstep)

    @property
    def keys(self) -> list[EpisodeKey]:
        """The key of each world's present episode: with it and the same commands ``simulate`` gives the same bits."""
        return self._lockstep.keys

    def observation_space(self, *shape: int) -> Box:
        """Return the space of observations, ``(*shape, observations)``."""
        low = np.array(configuration.smallest_observation(self._config), dtype=np.float32)
        whole = (*shape, len(low))
        return Box(np.broadcast_to(low, whole), np.ones(whole, dtype=np.float32), dtype=np.float32)

    def action_space(self, *shape: int) -> Box:
        """Return the space of commands, ``(*shape, commands)``."""
        return Box(-1.0, 1.0, (*shape, self.info.commands), dtype=np.float32)

    def state_space(self, *shape: int) -> Box:
        """Return the space of what :meth:`state` returns, ``(*shape, values)``."""
        x_from, x_to, y_from, y_to = self.info.arena
        low = {"x": x_from, "y": y_from, "cos": -1.0, "sin": -1.0}
        high = {"x": x_to, "y": y_to}
        ends = [name.rpartition("_")[2] for name in self.state_names]
        whole = (*shape, len(ends))
        return Box(
            np.broadcast_to(np.array([low.get(end, 0.0) for end in ends], dtype=np.float32), whole),
            np.broadcast_to(np.array([high.get(end, 1.0) for end in ends], dtype=np.float32), whole),
            dtype=np.float32,
        )

    def begin(self, seed: int | None) -> None:
        """Begin every world's first episode with a seed; None: its next episode, at first the first one."""
        if seed is not None:
            lockstep = Lockstep(self._scene, len(self), seed, self._threads)
            self._lockstep.close()
            self._lockstep = lockstep
        elif not self._is_fresh:
            self._lockstep.reset()
        self._is_fresh = False
        self._before = self._state()

    def reset(self, worlds: BoolArray) -> None:
        """Begin the next episode of some worlds; the others go on.

        Raises:
            SimulatorError: An episode cannot begin; all others have.
        """
        try:
            self._lockstep.reset(worlds)
        finally:
            self._before = self._state()

    def observe(self) -> Single:
        """Return what the robots sense now, ``(worlds, robots, observations)``; zeros where a world has failed."""
        return self._lockstep.observe().astype(np.float32)

    def state(self) -> Single:
        """Return where everything is now, ``(worlds, values)``, called by ``state_names``; zeros where one failed."""
        now = self._lockstep.state(["pose", "movables", "at_goal"])
        gone = now.step[:, np.newaxis] / self.info.control_steps
        poses = [_placed(now.pose), np.concatenate([_placed(now.movables), now.at_goal[..., np.newaxis]], axis=-1)]
        everything = np.concatenate([*(each.reshape(len(self), -1) for each in poses), gone], axis=1)
        everything[now.failed] = 0.0
        return everything.astype(np.float32)

    def advance(self, commands: ArrayLike) -> Outcome:
        """Let commands ``(worlds, robots, commands)`` act for one control period in each world that has not ended.

        Raises:
            EvaluationError: A fitness function failed.
            InvalidArgument: The shape is wrong or a number is not finite; no world has moved.
        """
        before, moving = self._before, ~self._before.done
        if moving.any():
            self._advance(commands)
        now = self._before = self._state()
        ended = moving & now.done
        rewards = self._rewards.of(self._step(before, now, ended), moving & ~now.failed)
        terminated = ended & np.isfinite(now.push_time) & ~now.failed & self._scene.ends_with_push
        return Outcome(rewards, terminated, ended & ~terminated, ended & now.failed)

    def objectives(self, world: int) -> dict[str, float]:
        """Return what each objective with a weight has come to in a world's episode."""
        return self._rewards.objectives(world)

    def close(self) -> None:
        """Free the worlds; again is fine."""
        self._lockstep.close()

    def _state(self) -> State:
        return self._lockstep.state(self._rewards.channels)

    def _advance(self, commands: ArrayLike) -> None:
        """Advance, where a world whose physics fails ends."""
        failed = self._lockstep.failed.sum()
        try:
            self._lockstep.advance(commands)
        except InvalidArgument:
            raise
        except SimulatorError:
            if self._lockstep.failed.sum() == failed:  # it was the library as a whole
                raise

    def _step(self, before: State, now: State, ended: BoolArray) -> Step:
        """Return a control step as telemetry has it: what there was before, and the command that acted."""
        failed = now.failed
        channels = {name: _without(failed, array) for name, array in before.channels.items() if name != "command"}
        if "command" in now.channels:
            channels["command"] = _without(failed, now.command)
        telemetry = Telemetry(
            self.info.control_period, now.homing_time, now.push_time, channels=channels, world=self.info.world
        )
        return Step(telemetry, before.step, ended, self.info.control_steps)


def _loaded(source: Source, set: Mapping[str, Any]) -> Config:
    overrides = configuration.as_overrides(set)
    if isinstance(source, Config):
        return configuration.changed(source, overrides)
    if not isinstance(source, str | os.PathLike):
        raise InvalidArgument(f"config: expected a Config, or a name or path of one, got {source!r}")
    return load_config(os.fspath(source), overrides)


def _seed(config: Config) -> int:
    """Return the configuration's seed, or draw one."""
    seed = configuration.seeded(config).evolution.seed
    assert seed is not None
    return seed


def _placed(poses: FloatArray) -> FloatArray:
    """Return ``(..., 4)``, x, y, cosine and sine of the heading: no number jumps where a robot turns."""
    heading = poses[..., 2:]
    return np.concatenate([poses[..., :2], np.cos(heading), np.sin(heading)], axis=-1)


def _without(failed: BoolArray, channel: FloatArray) -> FloatArray:
    """Return a channel ``(worlds, 1, ...)`` with zeros instead of what worlds that failed left there."""
    channel[failed] = 0.0
    return channel[:, np.newaxis]

# SPDX-License-Identifier: BSD-3-Clause
"""Many worlds at once, held against Gymnasium's own vector environment over the same worlds one by one."""

from __future__ import annotations

import re
import subprocess
import sys
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.utils.passive_env_checker import check_action_space, check_observation_space
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import RecordEpisodeStatistics

from swarmevo import config
from swarmevo.env import SwarmVectorEnv
from swarmevo.env.worlds import Worlds
from swarmevo.errors import InvalidArgument
from swarmevo.simulation import EpisodeKey
from swarmevo.simulation import lockstep as module

WORLDS, SEED = 4, 2
PLACES = [[x, 0.2, np.pi / 2] for x in (-0.11, 0.0, 0.11)]
AT_BOX = {
    "worlds": [],
    "team.robots": 3,
    "team.start": "poses",
    "team.start_poses": PLACES,
    "episode.horizon": 3.0,
    "episode.until": "push",
}
"""Worlds whose episodes end at different times, some at the horizon: robots push a box that is near its wall."""


class Single(gymnasium.Env[Any, Any]):
    """One of several worlds, with an interface of its own."""

    def __init__(self, world: int) -> None:
        self._worlds, self._world = Worlds("shaped", AT_BOX, WORLDS, None, SEED, 1), world
        self.observation_space, self.action_space = self._worlds.observation_space(3), self._worlds.action_space(3)
        self._mask = np.arange(WORLDS) == world
        self._begun = False

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        if self._begun:
            self._worlds.reset(self._mask)
        self._begun = True
        return self._worlds.observe()[self._world], {}

    def step(self, action: Any) -> Any:
        commands = np.zeros((WORLDS, 3, 2))
        commands[self._world] = action
        outcome, world = self._worlds.advance(commands), self._world
        info = {"objectives": self._worlds.objectives(world)} if outcome.ended[world] else {}
        ends = bool(outcome.terminated[world]), bool(outcome.truncated[world])
        return self._worlds.observe()[world], float(outcome.rewards[world]), *ends, info


def actions(step: int) -> Any:
    """Return commands by which some worlds push and others dither."""
    rng = np.random.default_rng(step)
    return (np.linspace(1.0, 0.3, WORLDS)[:, None, None] + rng.uniform(-0.3, 0.3, (WORLDS, 3, 2))).clip(-1, 1)


@pytest.mark.parametrize("mode", AutoresetMode)
def test_it_does_what_gymnasiums_own_does_with_single_worlds(mode: AutoresetMode) -> None:
    ours = SwarmVectorEnv("shaped", WORLDS, set=AT_BOX, seed=SEED, autoreset=mode)
    theirs = SyncVectorEnv([lambda i=i: Single(i) for i in range(WORLDS)], autoreset_mode=mode)
    assert ours.metadata["autoreset_mode"] is theirs.metadata["autoreset_mode"] is mode
    for name in ("observation_space", "action_space", "single_observation_space", "single_action_space", "num_envs"):
        assert getattr(ours, name) == getattr(theirs, name)
    assert data_equivalence(ours.reset()[0], theirs.reset()[0])
    ends = np.zeros((3, WORLDS), dtype=int)
    for step in range(150):
        found, expected = ours.step(actions(step)), theirs.step(actions(step))
        for one, other in zip(found, expected, strict=True):
            assert data_equivalence(one, other)
        terminated, truncated = found[2:4]
        ends += terminated, truncated, terminated & ~(terminated | truncated).all()
        if mode is AutoresetMode.DISABLED and (mask := terminated | truncated).any():
            for envs in (ours, theirs):
                envs.reset(options={"reset_mask": mask.copy()})
    assert (ends.sum(axis=1) > 0).all()  # some at their success, some at the horizon, some alone
    ours.close()
    theirs.close()


def test_its_spaces_are_what_gymnasium_wants() -> None:
    envs = SwarmVectorEnv("aggregation", 3)
    for space in (envs.single_observation_space, envs.observation_space):
        check_observation_space(space)
    for space in (envs.single_action_space, envs.action_space):
        check_action_space(space)
    observations, _ = envs.reset()
    assert envs.observation_space.contains(observations)
    assert envs.action_space.shape == (3, 8, 2)


def test_gymnasiums_statistics_are_the_sums_of_objectives() -> None:
    envs = RecordEpisodeStatistics(SwarmVectorEnv("phototaxis", 5, set={"episode.horizon": 2.0}, seed=1))
    envs.reset()
    for _ in range(20):
        *_, truncated, infos = envs.step(np.ones(envs.action_space.shape))
    assert truncated.all()
    assert infos["episode"]["r"] == pytest.approx(infos["objectives"]["nearness"] + infos["objectives"]["arrived"])
    assert infos["episode"]["l"].tolist() == [20] * 5


def rewards_of(envs: SwarmVectorEnv, steps: int = 30) -> Any:
    return np.array([envs.step(0.7 * np.ones(envs.action_space.shape))[1] for _ in range(steps)])


def test_a_world_depends_neither_on_the_others_nor_on_threads() -> None:
    made = [
        SwarmVectorEnv("aggregation", n, seed=3, set={"episode.horizon": 2.0}, threads=threads)
        for n, threads in ((6, 1), (6, 2), (2, 1))
    ]
    one, threaded, few = (rewards_of(envs) for envs in made)
    assert np.array_equal(one, threaded)
    assert np.array_equal(one[:, :2], few)
    assert len(np.unique(one[0])) == 6


def test_seeds_and_keys() -> None:
    envs = SwarmVectorEnv("phototaxis", 3, seed=9, set={"episode.horizon": 2.0})
    envs.reset()
    assert envs.keys == [EpisodeKey(9, 0, 0, world) for world in range(3)]
    first = rewards_of(envs, 21)  # with the beginning of the next episodes
    assert [key.generation for key in envs.keys] == [1, 1, 1]
    envs.reset()
    envs.reset(options={"reset_mask": np.array([False, True, False])})
    assert [key.generation for key in envs.keys] == [2, 3, 2]
    envs.reset(seed=9)
    assert np.array_equal(rewards_of(envs, 21), first)


def test_wrong_arguments_are_one_line() -> None:
    envs = SwarmVectorEnv("phototaxis", 2, set={"episode.horizon": 1.0}, seed=1, autoreset="Disabled")
    envs.reset()
    for options, seed, message in [
        ({"reset_mask": [True]}, None, "reset_mask: expected 2 booleans of which one is True, got bool of shape (1,)"),
        ({"reset_mask": [0, 1]}, None, "reset_mask: expected 2 booleans of which one is True, got int64 of shape (2,)"),
        ({"reset_mask": [False] * 2}, None, "reset_mask: expected 2 booleans of which one is True, got bool of shape"),
        ({"reset_mask": [True] * 2}, 3, "seed: expected None beside a reset_mask, got 3; it is that of all worlds"),
    ]:
        with pytest.raises(InvalidArgument, match=f"^{re.escape(message)}"):
            envs.reset(seed=seed, options=options)
    for wrong in (np.zeros((2, 3, 3)), np.full((2, 3, 2), np.nan), [[1.0]]):
        with pytest.raises(InvalidArgument, match=r"^commands: expected"):
            envs.step(wrong)
    rewards_of(envs, 10)
    with pytest.raises(InvalidArgument, match=r"^step: expected worlds whose episodes go on, got 0, which has ended; "):
        envs.step(np.zeros((2, 3, 2)))
    with pytest.raises(InvalidArgument, match=r"^autoreset: expected one of NextStep, SameStep, Disabled, got 'never'"):
        SwarmVectorEnv("phototaxis", autoreset="never")
    for worlds in (0, 65537):
        with pytest.raises(InvalidArgument, match=r"^worlds: expected 1 to 65536, got"):
            SwarmVectorEnv("phototaxis", worlds)
    envs.close()
    with pytest.raises(InvalidArgument, match="got one that was closed"):
        envs.reset()


def test_a_world_whose_physics_fails_is_truncated_and_the_others_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is not finite gets through: a world fails as it would where its physics fails."""
    advance = module._Worlds.advance
    monkeypatch.setattr(module._Worlds, "advance", lambda self, commands, finite: advance(self, commands))
    whole, broken = (SwarmVectorEnv("paper", 3, seed=1, set={"episode.horizon": 2.0}) for _ in range(2))
    commands = np.ones(whole.action_space.shape)
    wrong = np.where(np.arange(3)[:, None, None] == 1, np.nan, commands)
    whole.step(commands)
    _, rewards, terminated, truncated, infos = broken.step(wrong)
    assert (rewards[1], truncated.tolist(), terminated.any()) == (0.0, [False, True, False], False)
    assert infos["failed"].tolist() == infos["_failed"].tolist() == [False, True, False]
    for _ in range(5):
        expected, found = whole.step(commands), broken.step(commands)
        assert np.array_equal(found[0][[0, 2]], expected[0][[0, 2]])
        assert np.array_equal(found[1][[0, 2]], expected[1][[0, 2]])
    assert [key.generation for key in broken.keys] == [0, 1, 0]


def test_gymnasium_makes_each_packaged_configuration() -> None:
    made = {id.removeprefix("swarmevo/").removesuffix("-v0") for id in gymnasium.registry if id.startswith("swarmevo/")}
    assert made == set(config.packaged())
    for name in made:
        envs = gymnasium.make_vec(f"swarmevo/{name}-v0", 3, set={"episode.horizon": 1.0}, seed=5)
        same = SwarmVectorEnv(name, 3, set={"episode.horizon": 1.0}, seed=5)
        np.testing.assert_array_equal(envs.reset()[0], same.reset()[0])
        actions = same.action_space.sample()
        for one, other in zip(envs.step(actions)[:4], same.step(actions)[:4], strict=True):
            np.testing.assert_array_equal(one, other)
        assert envs.spec is not None
        assert envs.metadata["autoreset_mode"] is same.metadata["autoreset_mode"]
        np.testing.assert_array_equal(envs.unwrapped.state(), same.state())
        assert same.state_space.contains(same.state())
        envs.close()
        same.close()


def test_gymnasium_imports_them_by_the_name_of_the_module() -> None:
    program = "import gymnasium; print(gymnasium.make_vec('swarmevo.env:swarmevo/quick-v0', 2).num_envs)"
    assert subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout == "2\n"

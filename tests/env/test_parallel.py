# SPDX-License-Identifier: BSD-3-Clause
"""PettingZoo's own tests, and an environment's episode held against the same one in the batch simulator."""

from __future__ import annotations

import re
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from pettingzoo.test import parallel_api_test, parallel_seed_test, state_test
from pettingzoo.utils.conversions import parallel_to_aec

from swarmevo.config import Config
from swarmevo.config.observations import READINGS
from swarmevo.env import SwarmParallelEnv
from swarmevo.errors import ConfigError, InvalidArgument
from swarmevo.plugins.team import load_config
from swarmevo.protocols import FloatArray
from swarmevo.simulation import EpisodeKey, Scene, simulate_lockstep
from swarmevo.simulation import lockstep as module

TASKS = [
    "aggregation",
    "best",
    "clearing",
    "coverage",
    "foraging",
    "localisation",
    "paper",
    "phototaxis",
    "quick",
    "robust",
]
SHORT = {"episode.horizon": 3.0}


@pytest.mark.parametrize("task", [*TASKS, "shaped"])
def test_pettingzoos_own_tests_pass(task: str, capsys: pytest.CaptureFixture[str]) -> None:
    parallel_api_test(SwarmParallelEnv(task, set=SHORT), num_cycles=40)
    assert capsys.readouterr().out == "Passed Parallel API test\n"
    parallel_seed_test(lambda: SwarmParallelEnv(task, set=SHORT), num_cycles=20)


@pytest.mark.parametrize("task", TASKS)
def test_all_that_is_observed_is_in_its_space(task: str) -> None:
    env = SwarmParallelEnv(task, set=SHORT, seed=1)
    observations, _ = env.reset()
    while env.agents:
        assert all(env.observation_space(agent).contains(observations[agent]) for agent in env.agents)
        observations, *_ = env.step({agent: env.action_space(agent).sample() for agent in env.agents})


def test_every_device_has_its_bounds() -> None:
    """Those that tell a direction reach below 0, and do; the others do not."""
    sensors = list(READINGS)
    env = SwarmParallelEnv("paper", set={"robot.sensors": sensors, "episode.horizon": 20.0}, seed=1)
    low, names = env.observation_space("robot_0").low, env.info.observation_names
    signed = {name for name, least in zip(names, low, strict=True) if least < 0}
    assert signed == {name for name in names if name.startswith(("rf_bearing", "odometry", "movable_motion"))}
    env.reset()
    seen = []
    while env.agents:
        observations, *_ = env.step({agent: env.action_space(agent).sample() for agent in env.agents})
        seen += observations.values()
    assert (np.min(seen, axis=0) >= low).all()
    assert np.max(seen) <= 1
    assert {name for name, least in zip(names, np.min(seen, axis=0), strict=True) if least < 0} <= signed


class Tape:
    """Plays commands ``(steps, 1, robots, commands)`` again."""

    def __init__(self, commands: FloatArray) -> None:
        self._commands = commands

    def start(self, genomes: FloatArray) -> None:
        self._left = iter(self._commands)

    def act(self, observations: FloatArray) -> FloatArray:
        return next(self._left)


@pytest.mark.parametrize("episode", [0, 2])
def test_an_episode_has_the_bits_of_the_batch_simulators(episode: int) -> None:
    settings = load_config("paper", ["episode.horizon=4.0"])
    env = SwarmParallelEnv(settings, seed=5)
    for _ in range(episode + 1):
        observations, _ = env.reset()
    assert env.key == EpisodeKey(5, 0, episode, 0)
    rng, commands, observed = np.random.default_rng(episode), [], []
    while env.agents:
        observed.append([observations[agent] for agent in env.agents])
        actions = {agent: rng.uniform(-1, 1, 2).astype(np.float32) for agent in env.agents}
        commands.append([[actions[agent] for agent in env.agents]])
        observations, *_ = env.step(actions)
    again = simulate_lockstep(
        Scene(settings), Tape(np.array(commands, dtype=np.float64)), np.zeros((1, 5, 1)), [env.key], ["observation"]
    )
    assert np.array_equal(again.telemetry.observation[0].astype(np.float32), observed)
    assert again.hash == env._world._lockstep.state([]).hash


def episode_of(env: SwarmParallelEnv, action: float = 1.0, **reset: Any) -> tuple[float, dict[str, Any], int]:
    """Return the sum of the rewards of an episode of robots that drive on, how it ended, and its length."""
    env.reset(**reset)
    total, steps = 0.0, 0
    while agents := env.agents:
        _, rewards, terminations, truncations, infos = env.step({agent: np.full(2, action) for agent in agents})
        assert len(set(rewards.values())) == 1  # it is the team's
        total, steps = total + rewards["robot_0"], steps + 1
        ends = {"terminated": set(terminations.values()), "truncated": set(truncations.values())}
        if env.agents:
            assert ends == {"terminated": {False}, "truncated": {False}}
            assert infos == {agent: {} for agent in agents}
    return total, {**ends, **infos["robot_0"]}, steps


def test_it_ends_at_the_horizon_or_at_its_success() -> None:
    places = [[x, 0.2, np.pi / 2] for x in (-0.11, 0.0, 0.11)]
    at_box = {
        "worlds": [],
        "team.robots": 3,
        "team.start": "poses",
        "team.start_poses": places,
        "episode.horizon": 15.0,
    }
    env = SwarmParallelEnv("shaped", set={**at_box, "episode.until": "push"}, seed=1)
    total, end, steps = episode_of(env)
    assert (end["terminated"], end["truncated"]) == ({True}, {False})
    assert end["objectives"]["success"] == 1
    assert total == pytest.approx(sum(end["objectives"].values()))
    assert steps < 100
    _, end, steps = episode_of(env, action=-1.0)
    assert (end["terminated"], end["truncated"], steps) == ({False}, {True}, 150)
    assert end["objectives"]["success"] == 0
    with pytest.raises(InvalidArgument, match="step: expected an episode that goes on, got none; call reset"):
        env.step({})


def test_seeds_begin_anew_and_resets_without_one_go_on() -> None:
    env, other = (SwarmParallelEnv("phototaxis", set=SHORT, seed=seed) for seed in (3, 4))
    first, second = episode_of(env)[0], episode_of(env)[0]
    assert first != second
    assert episode_of(env, seed=3)[0] == first
    assert episode_of(env)[0] == second
    assert episode_of(other, seed=3)[0] == first
    assert episode_of(SwarmParallelEnv("phototaxis", set={**SHORT, "evolution.seed": 3}))[0] == first
    drawn = [SwarmParallelEnv("phototaxis").key.seed for _ in range(2)]
    assert drawn[0] != drawn[1]


def test_wrong_actions_are_one_line_and_nothing_moves() -> None:
    env = SwarmParallelEnv("phototaxis", set=SHORT, seed=1)
    with pytest.raises(InvalidArgument, match="step: expected an episode that goes on, got none; call reset"):
        env.step({agent: np.zeros(2) for agent in env.possible_agents})
    env.reset()
    good = {agent: np.zeros(2) for agent in env.agents}
    for wrong, message in [
        ({}, "actions: expected one of each agent, robot_0 to robot_2, got []"),
        (np.zeros((3, 2)), "actions: expected one of each agent, robot_0 to robot_2, got ndarray"),
        ({**good, "robot_3": np.zeros(2)}, "actions: expected one of each agent, robot_0 to robot_2, got ['robot_0', "),
        ({**good, "robot_1": np.zeros(3)}, "actions: expected 2 numbers of each agent, got arrays of several lengths"),
        ({**good, "robot_1": np.array([0, np.nan])}, "commands: expected finite numbers, got nan for robot 1 of world"),
        (dict.fromkeys(good, np.zeros(1)), "commands: expected shape (1, 3, 2), got (1, 3, 1)"),
        (dict.fromkeys(good, "left"), "commands: expected shape (1, 3, 2), got (1, 3)"),
    ]:
        with pytest.raises(InvalidArgument, match=f"^{re.escape(message)}"):
            env.step(wrong)
    assert episode_of(env, seed=1) == episode_of(SwarmParallelEnv("phototaxis", set=SHORT, seed=1))


def test_wrong_worlds_are_refused() -> None:
    with pytest.raises(InvalidArgument, match=r"^config: expected a Config, or a name or path of one, got None$"):
        SwarmParallelEnv(None)  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match=r"team\.robots"):
        SwarmParallelEnv("phototaxis", set={"team.robots": 0})
    for seed in (-1, 2**64):
        with pytest.raises(InvalidArgument, match=r"^seed: expected 0 to 18446744073709551615, got"):
            SwarmParallelEnv("phototaxis", seed=seed)
    env = SwarmParallelEnv(Config(), seed=1)
    env.reset()
    with pytest.raises(InvalidArgument, match=r"^seed: expected a whole number, got 1\.5"):
        env.reset(seed=1.5)  # type: ignore[arg-type]
    env.step({agent: np.zeros(2) for agent in env.agents})  # as if nothing had been asked


def test_a_world_whose_physics_fails_is_truncated(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is not finite gets through: a world fails as it would where its physics fails."""
    advance = module._Worlds.advance
    monkeypatch.setattr(module._Worlds, "advance", lambda self, commands, finite: advance(self, commands))
    env = SwarmParallelEnv("paper", seed=1)
    for _ in range(2):
        env.reset()
        observations, rewards, terminations, truncations, infos = env.step(
            dict.fromkeys(env.possible_agents, np.full(2, np.nan))
        )
        assert not np.array(list(observations.values())).any()
        assert set(rewards.values()) == {0.0}
        assert set(terminations.values()) == {False}
        assert set(truncations.values()) == {True}
        assert infos["robot_4"]["failed"]
        assert env.agents == []


@pytest.mark.parametrize("missing", ["gymnasium", "pettingzoo"])
def test_without_the_extra_the_import_is_one_line(missing: str) -> None:
    program = f"import sys; sys.modules[{missing!r}] = None; import swarmevo.env"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == (
        f"ImportError: swarmevo.env: expected PettingZoo and Gymnasium installed, got no {missing}; "
        "pip install 'swarmevo[rl]'"
    )


def test_the_state_says_where_everything_is() -> None:
    env = SwarmParallelEnv("foraging", set=SHORT, seed=1)
    env.reset()
    for _ in range(5):
        env.step({agent: env.action_space(agent).sample() for agent in env.agents})
    named = dict(zip(env.state_names, env.state(), strict=True))
    with module.Lockstep(load_config("foraging"), 1) as other:
        assert len(named) == 4 * other.info.robots + 5 * other.info.movables + 1
    truth = env._world._lockstep.state(["pose", "movables", "at_goal"])
    x, y, heading = truth.pose[0, 2]
    assert [named[f"robot_2_{end}"] for end in ("x", "y", "cos", "sin")] == pytest.approx(
        [x, y, np.cos(heading), np.sin(heading)], abs=1e-6
    )
    x, y, heading = truth.movables[0, 1]
    assert [named[f"movable_1_{end}"] for end in ("x", "y", "cos", "sin", "at_goal")] == pytest.approx(
        [x, y, np.cos(heading), np.sin(heading), truth.at_goal[0, 1]], abs=1e-6
    )
    assert named["time"] == pytest.approx(5 / env.info.control_steps)


@pytest.mark.parametrize("task", [*TASKS, "shaped"])
def test_the_state_is_in_its_space_to_the_end_and_pettingzoos_own_test_passes(task: str) -> None:
    env = SwarmParallelEnv(task, set=SHORT, seed=1)
    env.reset()
    while env.agents:
        env.step({agent: env.action_space(agent).sample() for agent in env.agents})
        assert env.state_space.contains(env.state())
    assert env.state()[-1] == 1
    state_test(parallel_to_aec(SwarmParallelEnv(task, set=SHORT)), SwarmParallelEnv(task, set=SHORT), num_cycles=10)

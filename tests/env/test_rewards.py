# SPDX-License-Identifier: BSD-3-Clause
"""Rewards held against what evolution measures: the same episode in the batch simulator, judged as a whole."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator, Mapping
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import pytest

# Examples are not installed. At the end of the path: the installed swarmevo comes first.
sys.path.append(str(Path(__file__).parents[2]))

from examples.baselines import BASELINES
from swarmevo import plugins
from swarmevo.config import Config
from swarmevo.env.worlds import Worlds
from swarmevo.errors import EvaluationError, InvalidArgument
from swarmevo.plugins.team import Team, load_config
from swarmevo.protocols import FloatArray, Objective
from swarmevo.simulation import EpisodeKey, Episodes, simulate_lockstep
from swarmevo_shaped.objectives import Nearness, Shaped

SEED, WORLDS = 11, 2


class Tape:
    """Plays commands ``(steps, worlds, robots, commands)`` again."""

    def __init__(self, commands: FloatArray) -> None:
        self._commands = commands

    def start(self, genomes: FloatArray) -> None:
        self._left = iter(self._commands)

    def act(self, observations: FloatArray) -> FloatArray:
        return next(self._left)


class Forwards:
    """Drives blindly forwards."""

    def start(self, genomes: FloatArray) -> None:
        self._robots = genomes.shape[:2]

    def act(self, observations: FloatArray) -> FloatArray:
        return np.ones((*self._robots, 2))


PLACES = [[-0.11, 0.2, np.pi / 2], [0.0, 0.2, np.pi / 2], [0.11, 0.2, np.pi / 2], [-0.3, -0.3, 0.0], [0.3, -0.3, 0.0]]
AT_BOX = [f"team.start_poses={PLACES}", "team.start=poses", "worlds=[]"]
"""Three of five robots stand before the paper's box and look at it."""


def play(settings: Config, actor: Any, weights: Mapping[str, float] | None = None) -> Iterator[tuple[Any, ...]]:
    """Yield of each step of the first episodes the commands, the rewards and the worlds."""
    worlds = Worlds(settings, None, WORLDS, weights, SEED, threads=1)
    worlds.begin(None)
    actor.start(np.zeros((WORLDS, worlds.info.robots, 1)))
    ended = np.zeros(WORLDS, dtype=bool)
    while not ended.all():
        commands = actor.act(worlds.observe().astype(np.float64))
        outcome = worlds.advance(commands)
        ended |= outcome.ended
        yield commands, outcome.rewards, worlds


def again(settings: Config, commands: FloatArray) -> tuple[Team, Episodes]:
    """Return the same episodes by the batch simulator, with what a team judges them by."""
    team = Team(settings)
    keys = [EpisodeKey(SEED, 0, 0, world) for world in range(WORLDS)]
    genomes = np.zeros((WORLDS, team.robots, 1))
    return team, simulate_lockstep(team.scene, Tape(commands), genomes, keys, team.channels)


SHOULD_GAIN = {
    "aggregation": {"aggregation", "largest_cluster"},
    "best": {"shaped"},
    "clearing": {"delivery", "transport"},
    "coverage": {"coverage"},
    "foraging": {"transport"},
    "localisation": {"box_pushing", "homing"},
    "paper": {"box_pushing"},
    "phototaxis": {"nearness", "arrived"},
    "quick": {"box_pushing"},
    "robust": {"shaped"},
    "shaped": {"togetherness", "success"},
}
"""Objectives of each configuration that comes with swarmevo, which are above 0 in the episodes below."""


def objectives_of(settings: Config) -> list[str]:
    return [one.name for one in Team(settings).objectives]


def check_sums(settings: Config, actor: Any) -> set[str]:
    """Hold rewards against what a team says of the same episodes; return which objectives were above 0."""
    commands, rewards, worlds = zip(*play(settings, actor), strict=True)
    team, episodes = again(settings, np.array(commands))
    genomes, seen = np.zeros((WORLDS, team.space.size)), set()
    for world, total in enumerate(np.sum(rewards, axis=0)):
        judged = dict(zip(objectives_of(settings), team.judge(episodes, genomes, world), strict=True))
        judged.pop("hidden_neurons", None)  # of the genome
        assert worlds[-1].objectives(world) == pytest.approx(judged, abs=1e-9)
        assert total == pytest.approx(sum(judged.values()), abs=1e-9)
        seen |= {name for name, value in judged.items() if value > 0}
    return seen


@pytest.mark.parametrize("until", ["push", "horizon"])
@pytest.mark.parametrize("task", SHOULD_GAIN)
def test_the_rewards_of_an_episode_sum_up_to_what_evolution_measures(task: str, until: str) -> None:
    by_hand = task in BASELINES
    settings = load_config(task, ["episode.horizon=12", f"episode.until={until}", *([] if by_hand else AT_BOX)])
    actor = BASELINES[task](Team(settings).scene.info) if by_hand else Forwards()
    assert check_sums(settings, actor) >= SHOULD_GAIN[task]


ON_THE_PAPERS_WORLD = [
    {"box_pushing": {"sum_covers": "motion"}, "progress": {"measured": "end"}, "shaped": {"displacement": -1.0}},
    dict.fromkeys(("progress", "displacement", "speed", "homing", "nearness", "coverage")),
    dict.fromkeys(("delivered", "delivery", "transport", "aggregation", "largest_cluster", "arrived")),
]


@pytest.mark.parametrize("until", ["push", "horizon"])
@pytest.mark.parametrize("fitness", ON_THE_PAPERS_WORLD, ids=" ".join)
def test_so_do_those_of_every_fitness_that_comes_with_it(fitness: dict[str, Any], until: str) -> None:
    chosen = json.dumps({name: options or {} for name, options in fitness.items()})
    settings = load_config("paper", [*AT_BOX, "episode.horizon=8", f"episode.until={until}", f"fitness={chosen}"])
    assert check_sums(settings, Forwards()) >= set(fitness) - {"arrived"}


def test_every_fitness_that_comes_with_it_gives_rewards_but_for_those_without_an_objective_of_an_episode() -> None:
    ours = {entry.name for entry in plugins.discover() if entry.kind == "fitness" and entry.distribution == "swarmevo"}
    tried = {name for fitness in ON_THE_PAPERS_WORLD for name in fitness} | {*SHOULD_GAIN["shaped"]}
    assert ours - tried == {"hidden_neurons", "box_end", "team_end"}


def test_weights_choose_and_scale() -> None:
    settings = load_config("phototaxis", ["episode.horizon=3"])
    given = {}
    for weights in (None, {"nearness": 1.0}, {"nearness": -2.0, "arrived": 0.0}, {"arrived": 1.0}):
        actor = BASELINES["phototaxis"](Team(settings).scene.info)
        given[str(weights)] = np.array([rewards for _, rewards, _ in play(settings, actor, weights)])
    everything, nearness, twice, arrived = given.values()
    assert nearness.all()
    assert everything == pytest.approx(nearness + arrived)
    assert twice == pytest.approx(-2 * nearness)


def test_a_minimised_objective_counts_with_the_opposite_sign(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = load_config("phototaxis", ["episode.horizon=1"])
    expected = [rewards for _, rewards, _ in play(settings, Forwards(), {"nearness": 1.0})]
    minimised = (Objective("nearness", "minimise", (0.0, 1.0)),)
    monkeypatch.setattr(Nearness, "objectives", minimised)
    found = [rewards for _, rewards, _ in play(settings, Forwards(), {"nearness": 1.0})]
    assert np.array_equal(found, -np.array(expected))


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        (["nearness"], "weights: expected a mapping of objectives to numbers, got list"),
        ({"homing": 1}, "weights: expected objectives among nearness, arrived, got 'homing'"),
        ({"hidden_neurons": 1}, "weights: expected objectives among nearness, arrived, got 'hidden_neurons'"),
        ({"nearness": nan}, "weights: expected a finite number for nearness, got nan"),
        ({"nearness": "1"}, "weights: expected a finite number for nearness, got '1'"),
        ({"nearness": 0}, "weights: expected one that is not 0 for an objective that is measured in an episode, of"),
        ({}, "weights: expected one that is not 0 for an objective that is measured in an episode, of"),
    ],
)
def test_wrong_weights_are_one_line(weights: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidArgument, match=f"^{re.escape(message)}"):
        Worlds("phototaxis", None, 1, weights, 1, 1)


def test_a_fitness_that_tells_nothing_before_the_end_is_refused_unless_it_is_left_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delattr(Shaped, "stepwise")
    with pytest.raises(EvaluationError) as refused:
        Worlds("localisation", None, 1, None, 1, 1)
    assert str(refused.value).startswith("fitness.homing (swarmevo")
    assert "expected stepwise, which tells homing at each control step, got a fitness without it" in str(refused.value)
    Worlds("localisation", None, 1, {"box_pushing": 1.0}, 1, 1)


def test_what_a_fitness_returns_is_checked_and_what_it_raises_is_explained(monkeypatch: pytest.MonkeyPatch) -> None:
    for wrong, message in [
        (lambda step: np.zeros((3, 1)), "stepwise: expected an array of shape (1, 1), got (3, 1)"),
        (lambda step: np.full((1, 1), nan), "stepwise: expected finite numbers, got nan"),
        (lambda step: 1 / 0, "stepwise raised ZeroDivisionError"),
    ]:
        monkeypatch.setattr(Nearness, "stepwise", lambda self, worlds, wrong=wrong: wrong)
        worlds = Worlds("phototaxis", None, 1, {"nearness": 1.0}, 1, 1)
        with pytest.raises(EvaluationError, match=re.escape(message)):
            worlds.advance(np.zeros((1, 3, 2)))

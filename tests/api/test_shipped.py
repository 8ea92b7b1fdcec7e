# SPDX-License-Identifier: BSD-3-Clause
"""The controller that comes with swarmevo."""

from __future__ import annotations

import dataclasses

import pytest

import swarmevo as se
from swarmevo.analysis import shipped
from swarmevo.plugins.team import Team
from swarmevo.runs.export import networks


@pytest.mark.parametrize("robots", [3, 4, 5])
def test_three_to_five_robots_push(robots: int) -> None:
    """Of 30 tests on seeds that nothing was chosen by: with a rate of 97 %, fewer than 26 have a chance below 1e-4."""
    rates = se.best().test(episodes=30, robots=robots, seed=20261126)
    assert rates.outcome.push_rate * 30 >= 26
    assert rates.outcome.homing_rate > 0.95
    assert rates.outcome.push_time is not None
    assert rates.outcome.push_time < 60


@pytest.mark.parametrize("robots", [1, 2])
def test_fewer_do_not(robots: int) -> None:
    assert se.best().test(episodes=10, robots=robots, seed=3).outcome.push_rate == 0


def test_its_tests_end_at_the_push_if_that_is_set() -> None:
    whole, ended = (se.best().test(1, robots=5, seed=5, set=given) for given in ({}, {"episode.until": "push"}))
    assert whole.outcome.push_time == ended.outcome.push_time
    assert whole.outcome.homing_rate == 1.0 > ended.outcome.homing_rate  # one comes after the push


@pytest.mark.parametrize("key", ["evolution.repeats", "controller.feedforward.hidden"])
def test_what_is_not_of_the_world_is_refused(key: str) -> None:
    with pytest.raises(se.ConfigError, match="expected a key of the world"):
        se.best().test(1, set={key: 7})


def test_a_whole_section_of_the_world_may_be_set() -> None:
    assert se.best().simulate(1, set={"episode": {"horizon": 1}}).config.episode.horizon == 1


def test_it_has_three_hidden_neurons_at_most() -> None:
    config, genes = shipped.best()
    (network,) = networks(Team(config), genes)
    assert 1 <= len(network.hidden_bias) <= 3


def test_it_acts_in_the_papers_world() -> None:
    paper = se.load_config("paper", {"evolution.seed": 1})
    config, _ = shipped.best()
    changed = {name for name in type(config).model_fields if getattr(config, name) != getattr(paper, name)}
    assert changed == {"controller"}


def test_it_is_simulated_and_replayed_like_any_other() -> None:
    best = se.best()
    assert best.simulate(episodes=2, robots=3, set={"episode.horizon": 2}).telemetry.pose.shape == (2, 20, 3, 3)
    assert "the controller that comes with swarmevo" in best.replay(set={"episode.horizon": 2}).html
    assert dataclasses.is_dataclass(best.test(episodes=1, set={"episode.horizon": 1}))
    with pytest.raises(se.ConfigError, match=r"box\.mass: expected a number"):
        best.simulate(set={"box.mass": -1})

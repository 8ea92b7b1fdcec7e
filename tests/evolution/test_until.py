# SPDX-License-Identifier: BSD-3-Clause
"""``episode.until: push``: an episode that ends at its success."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from swarmevo import config
from swarmevo.analysis.recording import record
from swarmevo.config import Config
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.plugins.team import Team
from swarmevo.protocols import FloatArray
from swarmevo.simulation import EpisodeKey, Lockstep
from swarmevo.testing import random_genomes
from swarmevo.views.replay.data import data
from swarmevo.views.replay.episode import stream

AHEAD = [
    "team.robots=3",
    "team.start=poses",
    "team.start_poses=[[-0.1, 0.2, 1.5708], [0, 0.2, 1.5708], [0.1, 0.2, 1.5708]]",
    "episode.horizon=10",
    "evolution.seed=1",
    "evolution.repeats=2",
]
"""Three robots before the box, which push it to the wall when they drive straight on."""


def settings(*overrides: str) -> Config:
    return config.load("paper", [*AHEAD, *overrides])


def straight(team: Team) -> FloatArray:
    """Return a genome of constant full speed."""
    genome = np.zeros(team.space.size)
    team.space.split(genome)["hidden_output"][:, -1] = 5.0
    return genome


KEYS = [EpisodeKey(1, 0, 0, 0), EpisodeKey(1, 0, 0, 1)]


def test_the_episode_is_the_beginning_of_the_one_that_goes_on() -> None:
    whole, short = settings(), settings("episode.until=push")
    genome = straight(Team(whole))
    longer, ended = record(whole, genome, KEYS), record(short, genome, KEYS)
    assert np.array_equal(longer.telemetry.push_time, ended.telemetry.push_time)
    assert np.array_equal(ended.episodes.steps, np.round(ended.telemetry.push_time / 0.1))
    for i, steps in enumerate(ended.episodes.steps):
        assert np.array_equal(longer.telemetry.pose[i, :steps], ended.telemetry.pose[i, :steps])
        assert np.isnan(ended.telemetry.pose[i, steps:]).all()
        assert np.array_equal(longer.terms["pushing"][i, :steps], ended.terms["pushing"][i, :steps])


def test_a_fitness_is_shown_the_steps_that_were_done() -> None:
    """F1 is a mean over the episode: of a shorter one it is another number, and a finite one."""
    short = settings("episode.until=push")
    team = Team(short)
    done = team.simulate(np.tile(straight(team), (2, 1)), KEYS)
    f1 = team.judge(done, np.tile(straight(team), (2, 1)), 0)[0]
    steps = int(done.steps[0])
    cut = dataclasses.replace(done.telemetry, channels={k: v[:, :steps] for k, v in done.telemetry.channels.items()})
    alone = dataclasses.replace(done, telemetry=cut)
    assert f1 == team.judge(alone, np.tile(straight(team), (2, 1)), 0)[0]
    assert np.isfinite(f1)


def test_evolution_gives_the_same_bits_on_any_workers() -> None:
    short = settings("episode.until=push")
    genomes = random_genomes(Team(short).space, 6)
    genomes[0] = straight(Team(short))
    found = []
    for workers in (1, 3):
        with Evaluator(short, workers) as evaluator:
            found.append(evaluator.evaluate(genomes, 0, 0))
    assert np.array_equal(found[0].costs, found[1].costs)
    assert np.array_equal(found[0].episodes["hash"], found[1].episodes["hash"])
    assert np.isfinite(found[0].episodes["push_time"][:2]).all()


def test_a_replay_ends_with_the_episode() -> None:
    short = settings("episode.until=push")
    genome = straight(Team(short))
    recording = record(short, genome, KEYS[:1])
    page = data(recording, "title")
    assert page["horizon"] == pytest.approx(float(recording.telemetry.push_time[0]))
    pieces = [piece for kind, piece in stream(short, genome, KEYS[0], "", "") if kind == "chunk"]
    assert sum(piece["steps"] for piece in pieces) == recording.episodes.steps[0]


def test_a_world_in_lockstep_is_done_at_its_push() -> None:
    with Lockstep(settings("episode.until=push"), worlds=1, seed=1) as world:
        steps = 0
        while not world.done.all():
            world.advance(np.ones((1, 3, 2)))
            steps += 1
        assert steps == round(float(world.state().push_time[0]) / 0.1) < 100

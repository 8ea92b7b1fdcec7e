# SPDX-License-Identifier: BSD-3-Clause
"""Which of an individual's stored episodes is shown, in runs whose results are made up."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import grids
from swarmevo import config
from swarmevo.config import Config
from swarmevo.errors import ReplayError
from swarmevo.evolution.results import Generation
from swarmevo.protocols import Objective
from swarmevo.runs.store import Store
from swarmevo.views.replay import episode as replay_episode

ROBOTS = 2
PAPER = Config.model_validate({"team": {"robots": ROBOTS}, "evolution": {"population": 1, "repeats": 3, "seed": 5}})
NOTHING_TO_PUSH = Config.model_validate({**PAPER.model_dump(exclude_unset=True), "scene": {"movables": []}})
GATHERED = Objective("gathered", "maximise", (0.0, 1.0), success=0.9)


class Told(NamedTuple):
    """What an episode was like."""

    pushed: bool = False
    homed: int = 0
    gathered: float = 0.0
    fault: str = ""


def stored(folder: Path, settings: Config, generations: Sequence[Sequence[Told]], copies: int = 1) -> Store:
    """Store episodes of one genome, which may be in each generation several times."""
    store = Store.create(folder / "run", config.dump(settings), {}, [GATHERED], ROBOTS, 5)
    for number, episodes in enumerate(generations):
        push = np.array([[4.0 if one.pushed else np.nan for one in episodes]] * copies)
        homing = np.array([[[2.0 if j < one.homed else np.nan for j in range(ROBOTS)] for one in episodes]] * copies)
        results = grids.results(
            objective=np.array([[[one.gathered] for one in episodes]] * copies),
            hash=np.array([range(10 * number, 10 * number + len(episodes))] * copies, dtype=np.uint64),
            push_time=push,
            homing_time=homing,
            ode_messages=np.zeros(push.shape, dtype=np.uint32),
            unsolved_steps=np.zeros(push.shape, dtype=np.uint32),
            seconds=0.5,
        )
        results = grids.replace(results, faults=tuple(one.fault for one in episodes) * copies)
        store.append(0, number, Generation(np.array([[1.0]] * copies), results), "{}")
    return store


FAILED, NOTHING = Told(fault="it broke"), Told()
PUSHED, PUSHED_AND_HOMED = Told(pushed=True), Told(pushed=True, homed=2)


@pytest.mark.parametrize(
    ("generations", "expected"),
    [
        ([[NOTHING, PUSHED]], (0, 1)),
        ([[PUSHED, PUSHED_AND_HOMED]], (0, 1)),
        ([[PUSHED], [Told(homed=2)]], (0, 0)),  # what matters most in this task is the box
        ([[PUSHED, PUSHED], [NOTHING, PUSHED], [NOTHING, NOTHING]], (1, 1)),  # of equals the last generation's
        ([[NOTHING, NOTHING], [NOTHING, NOTHING]], (1, 0)),
        ([[Told(homed=1), Told(homed=2)]], (0, 1)),
        ([[FAILED, NOTHING]], (0, 1)),
        ([[NOTHING], [FAILED]], (0, 0)),
        ([[FAILED, FAILED]], (0, 0)),
    ],
)
def test_the_most_successful_episode_is_shown(
    tmp_path: Path, generations: list[list[Told]], expected: tuple[int, int]
) -> None:
    with stored(tmp_path, PAPER, generations) as store:
        chosen = replay_episode.choose(store)
    assert (chosen.key.generation, chosen.key.repeat) == expected
    assert chosen.hash == 10 * expected[0] + expected[1]
    assert chosen.fault == generations[expected[0]][expected[1]].fault


def test_a_task_says_itself_what_a_success_is(tmp_path: Path) -> None:
    episodes = [Told(gathered=0.5, homed=2), Told(gathered=0.95, homed=1), Told(gathered=0.9, homed=2)]
    with stored(tmp_path, NOTHING_TO_PUSH, [episodes]) as store:
        assert replay_episode.choose(store).key.repeat == 2


def test_a_genome_that_is_twice_in_a_generation_has_its_repeats_once(tmp_path: Path) -> None:
    with stored(tmp_path, PAPER, [[PUSHED, NOTHING, PUSHED]], copies=2) as store:
        assert store.lives(1, 0).episodes.repeat.tolist() == [0, 1, 2]
        with pytest.raises(ReplayError, match="expected a repeat from 0 to 2, got 3"):
            replay_episode.choose(store, repeat=3)


def test_who_asks_for_one_gets_it(tmp_path: Path) -> None:
    with stored(tmp_path, PAPER, [[PUSHED, NOTHING, PUSHED], [NOTHING, PUSHED, NOTHING]]) as store:
        asked = [
            replay_episode.choose(store, **wanted).key[2:]
            for wanted in ({"generation": 0}, {"repeat": 2}, {"generation": 0, "repeat": 1})
        ]
        assert asked == [(0, 0), (1, 2), (0, 1)]
        with pytest.raises(ReplayError, match="individual 1 was not evaluated in generation 2, but in 1"):
            replay_episode.choose(store, generation=2)
        with pytest.raises(ReplayError, match="expected a repeat from 0 to 2, got 3"):
            replay_episode.choose(store, repeat=3)

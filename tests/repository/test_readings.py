# SPDX-License-Identifier: BSD-3-Clause
"""The comparison of readings of the paper: what can be wrong without evolving anything."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import small_runs
from swarmevo import simulation
from swarmevo.errors import StoreError
from swarmevo.runs import other_world

# The benchmarks are not installed. At the end of the path: the installed swarmevo comes first.
sys.path.append(str(Path(__file__).parents[2]))

from benchmarks import readings
from benchmarks.readings_page import PAPER_RATES, Found, distance, fall, interval, mean, page, resampled


def found(name: str, *trials: list[list[float]]) -> Found:
    return Found(name, tuple(np.array(rates) for rates in trials), tests=5, budget="seed 1")


def with_pushing(*rates: float) -> list[float]:
    return [*PAPER_RATES[:5], *rates]


def test_distance_is_the_root_mean_square_over_ten_rates_in_per_cent() -> None:
    assert distance(PAPER_RATES) == 0
    assert distance(PAPER_RATES + 0.1) == pytest.approx(10)
    one_rate_off = np.where(np.arange(10) == 7, PAPER_RATES - 0.5, PAPER_RATES)
    assert distance(one_rate_off) == pytest.approx(50 / np.sqrt(10))
    assert distance(np.array([PAPER_RATES, PAPER_RATES + 0.1])).shape == (2,)


def test_the_papers_rate_of_pushing_falls_by_66_from_three_robots_to_five() -> None:
    assert fall(PAPER_RATES) == pytest.approx(-66)


def test_each_controller_counts_the_same_in_the_mean_and_in_every_resample() -> None:
    trials = [np.full((3, 10), 0.0), np.full((1, 10), 1.0)]
    assert mean(trials) == pytest.approx(0.25)
    drawn = resampled(trials)
    assert {round(value, 6) for value in drawn[:, 0]} == {0.0, 0.25, 1.0}
    assert interval(drawn[:, 0]) == (0.0, 1.0)


def test_trials_are_drawn_alike_for_all_readings() -> None:
    trials = [np.full((1, 10), rate) for rate in (0.1, 0.4, 0.9)]
    worse = [rates - 0.1 for rates in trials]
    assert resampled(trials) - resampled(worse) == pytest.approx(0.1)


def test_the_page_sorts_by_distance_and_tells_who_falls_and_what_is_not_finished() -> None:
    rising = found("paper", [with_pushing(0, 0, 0.1, 0.2, 0.3)], [with_pushing(0, 0, 0.1, 0.2, 0.4)])
    falling = found("falls", [with_pushing(0, 0, 0.9, 0.6, 0.3)], [with_pushing(0, 0, 0.9, 0.6, 0.2)])
    meanings = {"paper": ("as it is", ()), "falls": ("it falls", ("a.b=1",)), "open": ("elsewhere", ("c.d=2",))}
    shown = page([rising, falling], meanings)
    lines = [line for line in shown.splitlines() if line.startswith("| ")]
    assert [line.split(" | ")[0] for line in lines[:5]] == ["| reading", "| ---", "| *the paper*", "| falls", "| paper"]
    assert "Nearest is falls" in shown
    assert "surely nearer than any other" in shown
    assert "It falls surely with falls (-65)." in shown
    assert "| open | elsewhere | `c.d=2` | not finished |" in shown


def test_a_nearest_reading_that_may_be_chance_is_not_called_sure() -> None:
    near = found("paper", [with_pushing(0, 0, 0.9, 0.5, 0.3)], [with_pushing(0, 0, 0.1, 0.5, 0.3)])
    other = found("other", [with_pushing(0, 0, 0.1, 0.5, 0.3)], [with_pushing(0, 0, 0.8, 0.5, 0.3)])
    shown = page([near, other], {"paper": ("as it is", ()), "other": ("else", ())})
    assert "Nearest is paper" in shown
    assert "not surely nearer than other" in shown
    assert "With none it surely falls." in shown


@pytest.mark.parametrize("reading", readings.READINGS, ids=lambda one: one.name)
def test_every_readings_world_takes_its_teams(reading: readings.Reading) -> None:
    settings = readings.settings_of(reading, seed=1, trials=10, episodes=900)
    teams = [other_world.of_size(settings, robots) for robots in range(1, settings.team.robots + 1)]
    assert [simulation.scene_errors(team) for team in teams] == [[]] * len(teams)


def test_readings_differ_from_each_other() -> None:
    every = [readings.settings_of(one, seed=1, trials=10, episodes=900) for one in readings.READINGS]
    assert len({one.model_dump_json() for one in every}) == len(every)


def test_the_run_of_another_reading_is_refused(tmp_path: Path) -> None:
    folder = small_runs.make(tmp_path / "run")
    with pytest.raises(StoreError, match="expected a run of this reading with seed 1, 10 trials and 900 episodes each"):
        readings.opened(folder, readings.settings_of(readings.READINGS[0], seed=1, trials=10, episodes=900))

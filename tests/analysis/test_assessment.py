# SPDX-License-Identifier: BSD-3-Clause
"""Tests of controllers: what is counted, that it is repeatable, and the file that holds it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import small_runs
from swarmevo import config
from swarmevo.analysis import assessment, fronts, table_ii
from swarmevo.analysis.table_ii import PAPER, Outcome
from swarmevo.errors import ConfigError, Interrupted, StoreError
from swarmevo.runs.store import Store


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_runs.make(tmp_path_factory.mktemp("runs") / "run")


def assess(run: Path, **options: object) -> table_ii.Assessment:
    with Store.open(run) as store:
        return assessment.assess(store, **{"sizes": (1, 3), "repeats": 2, "workers": 1} | options)  # type: ignore[arg-type]


# ---- what is counted -------------------------------------------------------------------------------------------------


def test_an_outcome_by_hand() -> None:
    homing = np.array([[1.0, np.nan], [3.0, 5.0], [np.nan, np.nan]])
    outcome = table_ii.outcome(2, homing, np.array([np.nan, 7.0, np.nan]))
    assert outcome == Outcome(2, 3, 0.5, pytest.approx(2 / 3), pytest.approx(1 / 3), 3.0, pytest.approx(1 / 3), 7.0)


def test_never_is_none() -> None:
    outcome = table_ii.outcome(1, np.full((4, 1), np.nan), np.full(4, np.nan))
    assert (outcome.homing_rate, outcome.homing_time, outcome.push_rate, outcome.push_time) == (0, None, 0, None)


def test_the_papers_table() -> None:
    assert [row.robots for row in PAPER] == [1, 2, 3, 4, 5]
    assert [row.push_rate for row in PAPER] == [0, 0, 0.96, 0.56, 0.3]
    assert [row.push_time for row in PAPER] == [None, None, 43.44, 37.42, 30.67]
    assert [round(100 * row.homing_rate, 2) for row in PAPER] == [13.33, 26.67, 97.67, 93.33, 88.67]


# ---- tests -----------------------------------------------------------------------------------------------------------


def test_every_controller_of_every_front_is_tested(run: Path) -> None:
    found = assess(run)
    with Store.open(run) as store:
        points = [(trial, point.genome) for trial in (0, 1) for point in fronts.front(store, trial)]
    assert [(one.trial, one.genome) for one in found.controllers] == points
    assert [row.robots for row in found.rows] == [1, 3]
    assert all(row.tests == 2 * len(points) for row in found.rows)
    assert all([outcome.robots for outcome in one.outcomes] == [1, 3] for one in found.controllers)
    assert found.generations == {0: 2, 1: 2}
    assert found.robustness == []


def test_tests_meet_noise_that_evolution_did_not(run: Path) -> None:
    with Store.open(run) as store:
        settings = assessment._tested_config(store, 2)
        keys = assessment.test_keys(settings, 1)
    assert [tuple(key) for key in keys] == [(5, 1, 2**32 - 1, 0), (5, 1, 2**32 - 1, 1)]
    most = next(limit.le for limit in config.Evolution.model_fields["generations"].metadata if hasattr(limit, "le"))
    assert most < assessment.GENERATION


def test_again_is_the_same_on_any_workers(run: Path) -> None:
    assert assess(run, workers=1) == assess(run, workers=2)


def test_the_evolved_team_is_tested_whatever_the_sizes(run: Path) -> None:
    by_one, by_three = assess(run, sizes=(1,)), assess(run, sizes=(3,))
    assert [one.tested for one in by_one.controllers] == [one.tested for one in by_three.controllers]
    assert all(one.tested.keys() == one.evolved.keys() for one in by_one.controllers)


def test_robustness_changes_the_world(run: Path) -> None:
    found = assess(run, robustness=True)
    names = [condition.name for condition in found.robustness]
    assert names[0] == "as evolved"
    assert {"no noise", "double noise", "exact starts", "turned starts", "rigid bumpers"} < set(names)
    assert found.robustness[0].outcome == found.rows[1]


def test_a_world_without_room_is_left_out(run: Path) -> None:
    with Store.open(run) as store:
        settings = config.load(store.config_path, ["team.start_region=[-0.04, 0.04, -0.04, 0.04]"])
    assert "starts anywhere" not in assessment._worlds(settings)


def test_the_other_bumpers_are_those_that_evolution_did_not_have(run: Path) -> None:
    with Store.open(run) as store:
        settings = config.load(store.config_path, ["robot.bumper=rigid"])
    changes, world = assessment._worlds(settings)["sprung bumpers"]
    assert (changes, world.robot.bumper) == ("robot.bumper sprung", "sprung")


def test_progress_reaches_its_end(run: Path) -> None:
    seen: list[tuple[int, int]] = []
    assess(run, robustness=True, observe=lambda done, total: seen.append((done, total)))
    assert seen[-1][0] == seen[-1][1]
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)


def test_it_can_be_stopped(run: Path) -> None:
    with pytest.raises(Interrupted):
        assess(run, stop=lambda: True)


# ---- teams of individuals --------------------------------------------------------------------------------------------


def test_individuals_are_tested_in_smaller_teams_only(tmp_path: Path) -> None:
    run = small_runs.make(tmp_path / "run", "team.genomes=individual", "evolution.trials=1")
    found = assess(run, sizes=(2, 3))
    assert [row.robots for row in found.rows] == [2, 3]
    with pytest.raises(ConfigError, match="at most 3"):
        assess(run, sizes=(4,))


# ---- watching --------------------------------------------------------------------------------------------------------


def test_watching_shows_the_tests(run: Path) -> None:
    found = assess(run, sizes=(3,), repeats=assessment.REPEATS)
    with Store.open(run) as store:
        seen = assessment.watch(store)
        best = fronts.front(store)[0]
    assert [key.trial for key in seen.keys] == [best.trial] * assessment.REPEATS
    homing = np.isfinite(seen.telemetry.homing_time).mean()
    (tested,) = [one for one in found.controllers if (one.trial, one.genome) == (best.trial, best.genome)]
    assert tested.outcomes[0].homing_rate == homing
    assert seen.telemetry.pose.shape == (assessment.REPEATS, 20, 3, 3)


def test_watching_somebody_unknown(run: Path) -> None:
    with Store.open(run) as store, pytest.raises(StoreError, match="there is no genome 999"):
        assessment.watch(store, 999)


# ---- the file --------------------------------------------------------------------------------------------------------


def test_saved_is_loaded(run: Path, tmp_path: Path) -> None:
    found = assess(run, robustness=True)
    assert table_ii.load(tmp_path) is None
    file = table_ii.save(found, tmp_path)
    assert table_ii.load(tmp_path) == found
    assert [path.name for path in tmp_path.iterdir()] == ["table_ii.json"]
    assert json.loads(file.read_text())["paper"][2]["push_rate"] == 0.96


@pytest.mark.parametrize("content", ["", "{}", "[1]"])
def test_a_damaged_file_is_named(tmp_path: Path, content: str) -> None:
    (tmp_path / table_ii.FILE).write_text(content)
    with pytest.raises(StoreError, match="is damaged; make it again with swarmevo test"):
        table_ii.load(tmp_path)


def test_a_number_that_was_changed_is_found(run: Path, tmp_path: Path) -> None:
    """Case 54."""
    file = table_ii.save(assess(run), tmp_path)
    file.write_text(file.read_text().replace('"repeats": 2', '"repeats": 3'))
    with pytest.raises(StoreError, match="is damaged; make it again with swarmevo test"):
        table_ii.load(tmp_path)


def test_another_format_is_refused(run: Path, tmp_path: Path) -> None:
    file = table_ii.save(assess(run), tmp_path)
    file.write_text(file.read_text().replace('"format": 1', '"format": 2'))
    with pytest.raises(StoreError, match="expected format 1, got 2"):
        table_ii.load(tmp_path)


def test_who_went_on_is_stale(tmp_path: Path) -> None:
    short = small_runs.make(tmp_path / "short", "evolution.trials=1")
    found = assess(short, sizes=(1,))
    with Store.open(short) as store:
        assert not found.is_stale(store)
    longer = small_runs.make(tmp_path / "longer", "evolution.trials=1", "evolution.generations=3")
    with Store.open(longer) as store:
        assert found.is_stale(store)

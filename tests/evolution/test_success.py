# SPDX-License-Identifier: BSD-3-Clause
"""Objectives that say what a success is, and fitness functions that know behaviours: stored, counted, told, refused."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import seals
import toy_plugins
from swarmevo import cli
from swarmevo.analysis import assessment, fronts
from swarmevo.analysis.statistics import wilson
from swarmevo.api.runs import Run
from swarmevo.config import Config
from swarmevo.errors import EvaluationError, StoreError
from swarmevo.plugins.team import Team
from swarmevo.protocols import Objective
from swarmevo.runs import driver, export
from swarmevo.runs.schema import DESCRIBED, SCHEMA_VERSION, SUCCEEDING
from swarmevo.runs.store import Store
from swarmevo.runs.verification import verify


@pytest.fixture(autouse=True)
def _toys(distribution: Any) -> None:
    toy_plugins.install(distribution)


def reaching(*more: str, **options: Any) -> Config:
    return toy_plugins.config(fitness={"toy_travel": {}, "toy_reach": options, **{name: {} for name in more}})


def run(folder: Path, config: Config) -> Path:
    driver.begin(folder, config)
    with Store.open(folder, readonly=False) as store:
        driver.evolve(store, 1, lambda now: None)
    return folder


def test_a_success_is_stored_and_counted(tmp_path: Path) -> None:
    with Store.open(run(tmp_path / "run", reaching())) as store:
        assert [one.success for one in store.objectives] == [None, None, 0.0]
        found = store.individuals()
        values: dict[tuple[int, int], list[float]] = {}
        for trial in store.trials():
            for number in range(store.generations(trial)):
                reach = store.generation(trial, number).episodes.grid("objective")[:, :, 2]
                for id, one in zip(store.genome_ids(trial, number).tolist(), reach.tolist(), strict=True):
                    values.setdefault((trial, id), []).extend(one)
        rates = [np.mean(np.array(values[t, g]) >= 0) for t, g in zip(found.trial, found.genome, strict=True)]
        assert found.success_rates[:, 2].tolist() == rates
        assert 0 < np.mean(rates) < 1
        assert not found.success_rates[:, :2].any()
        for point in fronts.front(store):
            (rate,) = point.success_rates.values()
            assert point.success_intervals == {"reach": wilson(rate * point.episodes, point.episodes)}
        assert verify(store, 1).is_sound


@pytest.mark.parametrize(
    ("fitness", "more"),
    [
        (["toy_travel"], 0),
        (["toy_travel", "toy_places"], DESCRIBED),
        (["toy_travel", "toy_reach"], SUCCEEDING),
        (["toy_travel", "toy_reach", "toy_places"], SUCCEEDING + DESCRIBED),
    ],
)
def test_only_a_run_with_successes_is_of_another_version(fitness: list[str], more: int, tmp_path: Path) -> None:
    driver.begin(tmp_path / "run", toy_plugins.config(fitness=fitness))
    with Store.open(tmp_path / "run") as store:
        assert store._rows("PRAGMA user_version") == [(SCHEMA_VERSION + more,)]
        tables = {table for (table,) in store._rows("SELECT name FROM sqlite_schema")}
    assert ("success" in tables) == bool(more & SUCCEEDING)


def test_a_damaged_success_is_refused(tmp_path: Path) -> None:
    folder = run(tmp_path / "run", reaching())
    seals.change(folder, "UPDATE success SET value = 0.5")
    with Store.open(folder) as store:  # whoever gives it its checksum may
        assert store.objectives[2].success == 0.5
    with closing(sqlite3.connect(folder / "run.sqlite")) as database:
        database.execute("UPDATE success SET value = 0.25")
        database.commit()
    with pytest.raises(StoreError, match="what is known of the whole run"):
        Store.open(folder)


@pytest.mark.parametrize("success", [2.0, -1.5, "much", [0.0, 0.5]])
def test_a_success_out_of_the_range_is_refused(success: object) -> None:
    with pytest.raises(EvaluationError, match=r"reach: expected as success a number in its range from -1 to 1, got"):
        Team(reaching(success=success))


def test_less_may_be_a_success() -> None:
    error = Objective("error", "minimise", (0.0, 1.0), success=0.25)
    assert error.is_success(np.array([0.0, 0.25, 0.3])).tolist() == [True, True, False]
    assert not Objective("error", "minimise", (0.0, 1.0)).is_success(np.zeros(3)).any()


def test_tests_tell_successes_means_and_behaviours(tmp_path: Path) -> None:
    folder = run(tmp_path / "run", reaching())
    with Store.open(folder) as store:
        found = assessment.assess(store, [2], 4)
        again = assessment.stored(store)
    assert again is not None
    assert again.behaviours == found.behaviours
    for one in found.controllers:
        episodes = Run(folder).front(one.trial)
        chosen = next(member for member in episodes if member.id == one.genome).simulate(4)
        x = chosen.telemetry.pose[:, -1, :, 0]
        assert one.behaviours["in the west"] == pytest.approx((x < 0).mean())
        assert one.behaviours["everybody"] == 1.0
        assert list(one.behaviours)[:2] == ["static near a wall", "circling together"]
    (row,) = found.rows
    assert list(row.success_rates) == ["reach"]
    assert list(row.objectives) == ["travel", "distance", "reach"]


def test_an_individual_is_tested_without_the_store(tmp_path: Path) -> None:
    folder = run(tmp_path / "run", reaching())
    first = Run(folder).front()[0]
    rates, seen = first.test(6), first.simulate(6)
    reach = seen.values[:, 2]
    assert rates.outcome.success_rates == {"reach": np.mean(reach >= 0)}
    assert rates.outcome.objectives["reach"] == (pytest.approx(reach.mean()), pytest.approx(reach.std(ddof=1) / 6**0.5))
    assert rates.successes == {"reach": wilson((reach >= 0).sum(), 6)}
    assert "reach >= 0" in repr(rates)


def test_the_commands_tell_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = run(tmp_path / "run", reaching())
    said = {}
    for name, command in {
        "show": ["show", folder],
        "decided": ["test", folder, "--robots", "2", "--repeats", "30", "--until", "0.5", "--rate", "reach"],
        "json": ["test", folder, "--robots", "2", "--json"],
    }.items():
        with pytest.raises(SystemExit) as exit:
            cli.main([str(word) for word in command])
        out, errors = capsys.readouterr()
        assert not exit.value.code, errors
        said[name] = out
    assert "reach >= 0" in said["show"]
    assert "Is the reach rate above 0.5?" in said["decided"]
    assert "in the west" in said["decided"]
    (row,) = json.loads(said["json"])["rows"]
    assert row.keys() >= {"success_rates", "objectives"}
    (success,) = json.loads(said["json"])["measures"]["successes"]
    assert (success["name"], success["success"]) == ("reach", 0.0)
    with Store.open(folder) as store, (tmp_path / "run.json").open("w") as out:
        export.write_json(store, out)
    assert json.loads((tmp_path / "run.json").read_text())["objectives"][2]["success"] == 0.0


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("shape", r"behaviours: in the west: expected an array of shape \(1, 2\), got \(1, 1\)"),
        ("numbers", "behaviours: in the west: expected True or False of each, got other numbers"),
        ("text", "behaviours: in the west: expected an array of numbers, got str"),
        ("raises", "behaviours raised RuntimeError: no eyes"),
    ],
)
def test_wrong_behaviours_are_refused(fault: str, message: str, tmp_path: Path) -> None:
    folder = run(tmp_path / "run", reaching(fault=fault))
    with Store.open(folder) as store, pytest.raises(EvaluationError, match=rf"^fitness\.toy_reach .*{message}"):
        assessment.assess(store, [2], 1)

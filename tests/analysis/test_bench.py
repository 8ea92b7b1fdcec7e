# SPDX-License-Identifier: BSD-3-Clause
"""Tests that add up with controllers of every kind, with failed episodes, and with changed plugins."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

import small_runs
import toy_plugins
from conftest import Distribution
from swarmevo.analysis import assessment
from swarmevo.errors import StoreError
from swarmevo.evolution.evaluation import LOCKSTEP_WORLDS
from swarmevo.protocols import FloatArray
from swarmevo.runs import checksums, verification
from swarmevo.runs.driver import begin, evolve
from swarmevo.runs.store import Store
from swarmevo.runs.tests_file import TESTS_FILE


def made(folder: Path, **sections: object) -> Path:
    begin(folder, toy_plugins.config(**sections))
    with Store.open(folder, readonly=False) as store:
        evolve(store, 1, lambda progress: None)
    return folder


def contents(run: Path) -> list[tuple[object, ...]]:
    columns = "kind, world, trial, genome, repeat, content"
    query = f"SELECT {columns} FROM test JOIN tested ON id = tested ORDER BY 1, 2, 3, 4, 5"
    with closing(sqlite3.connect(run / TESTS_FILE)) as database:
        return database.execute(query).fetchall()


@pytest.mark.parametrize("controller", ["toy_network", "toy_linear"])
def test_what_adds_up_is_what_one_test_gives(tmp_path: Path, distribution: Distribution, controller: str) -> None:
    toy_plugins.install(distribution)
    run = made(tmp_path / "run", controller=controller, evolution={"trials": 1})
    with Store.open(run) as store:
        for repeats in (1, 3, 12):
            assessment.assess(store, (2,), repeats, workers=2)
        pieces = contents(run)
        (run / TESTS_FILE).unlink()
        found = assessment.assess(store, (2,), 12, workers=1)
        assert contents(run) == pieces
        assert verification.verify(store, 2).is_sound
    tests = 12 if controller == "toy_network" else 2 * LOCKSTEP_WORLDS  # in Python always the same ones together
    assert {one.outcomes[0].tests for one in found.controllers} == {tests}


def test_teams_of_individuals(tmp_path: Path) -> None:
    run = small_runs.make(tmp_path / "run", "team.genomes=individual", "evolution.trials=1")
    with Store.open(run) as store:
        assessment.assess(store, (2, 3), 2, workers=1)
        found = assessment.stored(store)
        assert found is not None
        assert [row.robots for row in found.rows] == [2, 3]
        assert verification.verify(store, 1).is_sound


def test_an_episode_that_fails_is_stored_with_its_reason(
    tmp_path: Path, distribution: Distribution, monkeypatch: pytest.MonkeyPatch
) -> None:
    toy_plugins.install(distribution)
    run = made(tmp_path / "run", evolution={"trials": 1, "on_fault": "worst"})
    evaluate = toy_plugins.Travel.evaluate

    def fail_sometimes(*given: Any) -> FloatArray:
        found = evaluate(*given)
        if int(found[0, 0] * 1e9) % 2:
            raise ValueError("an odd way")
        return found

    monkeypatch.setattr(toy_plugins.Travel, "evaluate", fail_sometimes)
    with Store.open(run) as store:
        found = assessment.assess(store, (2,), 9, workers=1)
        faults = [json.loads(str(content))[0] for kind, *_, content in contents(run) if kind == "episode"]
        assert {one.outcomes[0].tests for one in found.controllers} == {9}
        assert 0 < len([fault for fault in faults if fault and "an odd way" in fault]) < len(faults)
        assert assessment.stored(store) == found
        before = contents(run)
        assert assessment.assess(store, (2,), 9, workers=1) == found
    assert contents(run) == before


def test_tests_of_changed_plugins_are_not_mixed(tmp_path: Path) -> None:
    """What is stored is still shown; more of it is refused, until the change is undone or the tests are moved away."""
    run = small_runs.make(tmp_path / "run", "evolution.trials=1", "evolution.generations=1")
    with Store.open(run) as store:
        few = assessment.assess(store, (3,), 1, workers=1)
        _change_plugin(run, "fitness.box_pushing")
        assert assessment.assess(store, (3,), 1, workers=1) == few
        with pytest.raises(StoreError, match=r"of fitness\.box_pushing was changed since these tests"):
            assessment.assess(store, (3,), 2, workers=1)
        (run / TESTS_FILE).rename(tmp_path / "kept.sqlite")
        assert assessment.assess(store, (3,), 2, workers=1).repeats == 2


def _change_plugin(run: Path, plugin: str) -> None:
    """Make a plugin of the tests' session another one than what is installed."""
    with closing(sqlite3.connect(run / TESTS_FILE)) as database:
        ((text,),) = database.execute("SELECT provenance FROM session").fetchall()
        origin = json.loads(text)
        origin["plugin_files"][plugin] = dict.fromkeys(origin["plugin_files"][plugin], "0" * 64)
        text = json.dumps(origin)
        database.execute("UPDATE session SET provenance = ?, sha256 = ?", (text, checksums.of_rows([[text]])))
        database.commit()

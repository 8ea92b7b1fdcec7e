# SPDX-License-Identifier: BSD-3-Clause
"""Runs that are followed: what is told of them, and that each look reads only what is new."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

import grids
import small_runs
from swarmevo import config
from swarmevo.analysis import course, fronts
from swarmevo.analysis.following import Following
from swarmevo.config import Config
from swarmevo.evolution.results import Generation
from swarmevo.protocols import Objective
from swarmevo.runs import store as run_store
from swarmevo.runs.database import DATABASE_FILE
from swarmevo.runs.store import Store

OBJECTIVES = [Objective("score", "maximise", (0.0, 1.0)), Objective("neurons", "minimise", (0.0, 15.0))]
INDIVIDUALS = 5
EVERYTHING = 10**9


class Writing:
    """A run that is written by hand, of three trials of forty generations, without simulating anything."""

    def __init__(self, folder: Path) -> None:
        evolution = {"generations": 40, "population": INDIVIDUALS, "trials": 3}
        settings = Config.model_validate({"team": {"robots": 1}, "evolution": evolution})
        self.store = Store.create(folder, config.dump(settings), {}, OBJECTIVES, 1, 5)
        self._rng = np.random.default_rng(3)

    def append(self, trial: int, generations: int = 1, seconds: float = 1.0, fault: str = "") -> None:
        for _ in range(generations):
            genomes = self._rng.integers(300, size=(INDIVIDUALS, 1)).astype(float)
            episodes = grids.scored(self._rng.random((INDIVIDUALS, 2, 2)))
            episodes = grids.replace(episodes, seconds=seconds, faults=(fault, *episodes.faults[1:]))
            self.store.append(trial, self.store.generations(trial), Generation(genomes, episodes), "{}")


@pytest.fixture
def writing(tmp_path: Path) -> Iterator[Writing]:
    writing = Writing(tmp_path / "run")
    yield writing
    writing.store.close()


def test_the_time_left_counts_the_optimisers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each generation is evaluated in 1 s, and stored 3 s after the one before."""
    now = datetime(2026, 1, 1, tzinfo=UTC)

    class Clock:
        @staticmethod
        def now(_: object) -> datetime:
            nonlocal now
            now += timedelta(seconds=3)
            return now

    monkeypatch.setattr(run_store, "datetime", Clock)
    writing = Writing(tmp_path / "run")
    writing.append(0, 30)
    run = Following(writing.store.folder)
    assert run.look().eta_seconds == pytest.approx(90 * 3.0)
    now += timedelta(days=1)  # until it is resumed
    writing.append(0, 10)
    assert run.look().eta_seconds == pytest.approx(80 * 3.0)
    writing.store.close()


def test_a_run_is_followed_from_its_first_generation_to_its_last(writing: Writing) -> None:
    run = Following(writing.store.folder)
    assert run.look().state == "running"
    assert (run.progress.share, run.progress.eta_seconds, run.take(EVERYTHING), run.global_front()) == (
        0,
        None,
        False,
        set(),
    )
    writing.append(0, 20, seconds=3.0)
    assert run.look().generations == (20, 0, 0)
    assert run.progress.eta_seconds == pytest.approx(100 * 3.0)
    writing.append(0, 20, seconds=1.0)
    writing.append(1, 10, seconds=2.0)
    assert run.look().eta_seconds == pytest.approx(70 * 1.5)  # by the last twenty generations
    assert run.progress.share == pytest.approx(50 / 120)
    assert run.progress.episodes == 50 * INDIVIDUALS * 2
    assert run.look() is run.progress
    writing.append(1, 30)
    writing.append(2, 40)
    assert (run.look().state, run.progress.share) == ("running", 1.0)
    writing.store.close()
    assert (run.look().state, run.progress.eta_seconds) == ("finished", None)


def test_what_was_found_is_what_a_whole_reading_finds(writing: Writing) -> None:
    run = Following(writing.store.folder)
    for trial, generations in ((0, 7), (0, 33), (1, 40), (2, 3)):
        writing.append(trial, generations)
        run.look()
        assert run.take(EVERYTHING) is False
        with Store.open(writing.store.folder) as store:
            assert run.steps[trial] == pytest.approx(course.history(store, trial))
            assert [one.genome for one in run.fronts[trial]] == [one.genome for one in fronts.front(store, trial)]
            assert run.global_front() == {(one.trial, one.genome) for one in fronts.front(store)}


def test_a_long_run_is_taken_in_pieces(writing: Writing) -> None:
    writing.append(0, 8)
    writing.append(1, 1)
    run = Following(writing.store.folder)
    run.look()
    pieces = []
    while run.take(3 * INDIVIDUALS * 2):
        pieces.append([len(steps) for steps in run.steps])
    assert pieces == [[3, 0, 0], [6, 0, 0]]
    assert [len(steps) for steps in run.steps] == [8, 1, 0]


@pytest.fixture
def worked(monkeypatch: pytest.MonkeyPatch) -> Callable[[], int]:
    """Return a function that tells how many hundreds of SQLite's instructions readers took since it was last asked."""
    counted = 0

    def count() -> int:
        nonlocal counted
        counted += 1
        return 0

    def connect(folder: Path, readonly: bool) -> sqlite3.Connection:
        database = unwatched(folder, readonly)
        database.set_progress_handler(count, 100)
        return database

    def since() -> int:
        nonlocal counted
        found, counted = counted, 0
        return found

    unwatched = run_store.connect
    monkeypatch.setattr(run_store, "connect", connect)
    return since


def test_a_look_at_a_long_run_reads_no_more_than_at_a_short_one(writing: Writing, worked: Callable[[], int]) -> None:
    run = Following(writing.store.folder)
    work = []
    for generations in (3, 37):
        writing.append(0, generations - 1)
        run.look()
        run.take(EVERYTHING)
        writing.append(0, 1)
        worked()
        run.look()
        run.take(EVERYTHING)
        work.append(worked())
        run.look()
        assert worked() == 0
    assert 0 < work[1] < 1.2 * work[0]
    with Store.open(writing.store.folder) as store:
        store.individuals()
    assert worked() > 5 * work[1]  # as would be if all were read


def test_failed_episodes_are_counted_and_told(writing: Writing) -> None:
    writing.append(0, 2, fault="PluginError: no")
    run = Following(writing.store.folder)
    assert run.look().faults == 2
    run.take(EVERYTHING)
    with Store.open(writing.store.folder) as store:
        genomes = [int(store.genome_ids(0, number)[0]) for number in (0, 1)]
    assert run.faults == [(0, number, genomes[number], 0, "PluginError: no") for number in (0, 1)]


def test_how_a_run_was_left_is_told(tmp_path: Path) -> None:
    folder = small_runs.make(tmp_path / "run", "evolution.trials=1")
    (folder / "run.lock").write_text("process 1 on host")
    run = Following(folder)
    assert (run.look().state, run.progress.said) == ("finished", "process 1 on host")
    (tmp_path / "longer").mkdir()
    longer = Writing(tmp_path / "longer" / "run")
    longer.append(0)
    longer.store.close()
    run = Following(longer.store.folder)
    assert run.look().state == "stopped"
    (longer.store.folder / "run.lock").write_text("process 1 on host")
    assert (run.look().state, run.progress.said) == ("killed", "process 1 on host")


def test_a_folder_that_cannot_be_read_is_broken_in_one_line_until_it_can(writing: Writing, tmp_path: Path) -> None:
    writing.append(0, 2)
    writing.store.close()
    folder = writing.store.folder
    copy = shutil.copytree(folder, tmp_path / "copy")
    run = Following(folder)
    assert run.look().state == "stopped"
    (folder / DATABASE_FILE).write_bytes(b"no database, but as long as one " * 1000)
    assert run.look().state == "stopped"  # once may be a folder that is just being made
    assert (run.look().state, run.progress.said) == (
        "broken",
        f"{folder / DATABASE_FILE}: is damaged, or no run of swarmevo",
    )
    shutil.copy(copy / DATABASE_FILE, folder)
    assert run.look().state == "stopped"
    (folder / "config.yaml").write_text("team: {}\n")
    run.look()
    assert "was changed since the run began" in run.look().said


def test_a_changed_generation_is_never_shown(writing: Writing) -> None:
    writing.append(0, 3)
    writing.store.close()
    with closing(sqlite3.connect(writing.store.folder / DATABASE_FILE)) as database, database:
        database.execute("UPDATE episode SET objective_0 = 1 WHERE generation = 1 AND individual = 0")
    run = Following(writing.store.folder)
    run.look()
    assert run.take(EVERYTHING) is False
    assert "generation 1 of trial 0 is not as it was stored" in run.progress.said
    assert (run.progress.state, run.fronts) == ("broken", [])


def test_another_run_in_the_same_place_begins_anew(writing: Writing) -> None:
    writing.append(0, 3)
    writing.store.close()
    run = Following(writing.store.folder)
    run.look()
    run.take(EVERYTHING)
    shutil.rmtree(writing.store.folder)
    other = Writing(writing.store.folder)
    other.append(0, 2, seconds=9.0)
    assert run.look().generations == (2, 0, 0)
    run.take(EVERYTHING)
    assert [len(steps) for steps in run.steps] == [2, 0, 0]
    other.append(0, 4)
    assert run.look().generations == (6, 0, 0)
    other.store.close()

# SPDX-License-Identifier: BSD-3-Clause
"""Runs that are killed, extended, locked, full, read-only, damaged or old: nothing that was stored is ever lost."""

from __future__ import annotations

import json
import multiprocessing
import os
import random
import resource
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import seals
import toy_plugins
from conftest import installer
from swarmevo import config as configuration
from swarmevo.errors import ConfigError, Interrupted, StoreError
from swarmevo.evolution import threads
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.evolution.jobs import Job, run_job
from swarmevo.evolution.loop import Progress
from swarmevo.evolution.results import Results, joined
from swarmevo.evolution.threads import MakeBackend, ThreadBackend
from swarmevo.plugins.team import never
from swarmevo.runs import driver, files, provenance
from swarmevo.runs.database import DATABASE_FILE
from swarmevo.runs.driver import begin, evolve, extend
from swarmevo.runs.folder import CONFIG_FILE
from swarmevo.runs.store import Store

BUDGET = {"generations": 6, "population": 6, "trials": 2, "repeats": 2, "seed": 7}
KILLS = 20
TABLES = ("run", "genome", "individual", "episode", "optimiser", "in_flight")

Content = dict[str, list[tuple[Any, ...]]]


@pytest.fixture(autouse=True)
def _toys(distribution: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    toy_plugins.install(distribution)
    monkeypatch.setattr(threads, "JOB_SECONDS", 0.0)  # one episode a job: as many moments to be killed as there are


def ignore(progress: Progress) -> None:
    pass


def start(folder: Path, **sections: Any) -> Path:
    begin(folder, toy_plugins.config(evolution=BUDGET, **sections))
    return folder


def go_on(
    folder: Path,
    workers: int = 2,
    stop: Callable[[], bool] = never,
    backend: MakeBackend = ThreadBackend,
) -> None:
    with Store.open(folder, readonly=False) as opened:
        evolve(opened, workers, ignore, stop, backend)


class OneByOne:
    """A backend that runs no job before the last one is stored."""

    slots, job_seconds = 1, 0.0

    def __init__(self, config_json: str, workers: int) -> None:
        self._config_json = config_json
        self.machines: dict[str, Any] = {}

    def run(self, jobs: Sequence[Job], stop: Callable[[], bool]) -> Generator[Results, None, None]:
        for job in jobs:
            yield run_job(self._config_json, job)
            if stop():
                raise Interrupted

    def close(self) -> None:
        pass


class Keeper:
    """Keeps results in a list."""

    def __init__(self, results: list[Results]) -> None:
        self._results = results

    def __call__(self, result: Results, seconds: float) -> None:
        self._results.append(result)


class StopAt:
    """Says yes when asked for the so-manieth time."""

    def __init__(self, times: int) -> None:
        self._left = times

    def __call__(self) -> bool:
        self._left -= 1
        return self._left == 0


def content(folder: Path) -> Content:
    """Return all that a run stored, but times."""
    with closing(sqlite3.connect(folder / DATABASE_FILE)) as database:
        queries = {table: f"SELECT * FROM {table}" for table in TABLES}
        queries["generation"] = "SELECT trial, number FROM generation"
        return {table: database.execute(query).fetchall() for table, query in queries.items()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Content:
    """What a run that was never interrupted stored."""
    folder = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as monkeypatch:
        toy_plugins.install(installer(folder, monkeypatch))
        go_on(start(folder / "run"))
    return content(folder / "run")


@contextmanager
def in_child(action: Callable[[], None]) -> Iterator[multiprocessing.process.BaseProcess]:
    child = multiprocessing.get_context("fork").Process(target=action)
    child.start()
    try:
        yield child
    finally:
        child.kill()
        child.join(60)


def exit_code(action: Callable[[], None]) -> int:
    with in_child(action) as child:
        child.join(60)
        assert child.exitcode is not None
        return child.exitcode


# ---- killed ----------------------------------------------------------------------------------------------------------


def rows(folder: Path) -> int:
    """Return how many episodes are stored or kept."""
    with closing(sqlite3.connect(folder / DATABASE_FILE)) as database:
        counts = [database.execute(f"SELECT COUNT(*) FROM {name}").fetchone() for name in ("episode", "in_flight")]
    return sum(count for (count,) in counts)


def kill_at_a_random_moment(folder: Path, rng: random.Random) -> bool:
    """Go on with a run and kill that; return False if it came to its end before."""
    here, there = os.pipe()

    def go_on_and_tell() -> None:
        os.close(here)
        go_on(folder, stop=lambda: os.write(there, b".") != 1)

    try:
        with in_child(go_on_and_tell) as child:
            os.close(there)  # so that reading ends with the child
            for _ in range(rng.randrange(16)):  # questions whether to stop: one after each episode
                os.read(here, 1)
            time.sleep(rng.uniform(0.0, 0.01))
            return child.is_alive()
    finally:
        os.close(here)


def test_a_run_killed_at_random_moments_gives_the_bits_of_one_that_was_not(tmp_path: Path, whole: Content) -> None:
    rng = random.Random(1)
    seen: list[int] = []
    kills, runs = 0, 0
    while kills < KILLS:
        folder = start(tmp_path / f"run-{runs}")
        seen = [0]
        while kills < KILLS and kill_at_a_random_moment(folder, rng):
            kills += 1
            seen.append(rows(folder))
        go_on(folder)
        assert content(folder) == whole
        assert seen == sorted(seen)  # nothing is ever lost
        runs += 1


@pytest.mark.parametrize("controller", ["toy_network", "toy_linear"])
def test_what_was_in_flight_is_not_run_again(tmp_path: Path, controller: str, monkeypatch: pytest.MonkeyPatch) -> None:
    go_on(start(tmp_path / "whole", controller=controller))
    ran: list[int] = []
    run_job = threads.run_job

    def counted(config_json: str, job: Job, cancelled: Any) -> Results:
        result = run_job(config_json, job, cancelled)
        ran.extend(range(len(result)))
        return result

    folder = start(tmp_path / "run", controller=controller)
    monkeypatch.setattr(threads, "run_job", counted)
    with pytest.raises(Interrupted):
        go_on(folder, workers=1, stop=StopAt(2))
    assert rows(folder) == len(ran) > 0
    go_on(folder)
    assert content(folder) == content(tmp_path / "whole")
    assert len(ran) == len(content(folder)["episode"])


def test_a_kept_episode_of_another_genome_is_not_used(tmp_path: Path, whole: Content) -> None:
    folder = start(tmp_path / "run")
    with pytest.raises(Interrupted):
        go_on(folder, stop=StopAt(5), backend=OneByOne)
    seals.change(folder, "UPDATE in_flight SET genome = x'00', objective_0 = 1e9")
    go_on(folder)
    assert content(folder) == whole


def test_a_kept_episode_that_is_damaged_is_run_again(tmp_path: Path, whole: Content) -> None:
    """Case 3."""
    folder = start(tmp_path / "run")
    with pytest.raises(Interrupted):
        go_on(folder, stop=StopAt(5), backend=OneByOne)
    with closing(sqlite3.connect(folder / DATABASE_FILE)) as database:
        database.execute("UPDATE in_flight SET objective_0 = 1e9")
        database.commit()
    go_on(folder)
    assert content(folder) == whole


def test_a_process_that_is_told_to_terminate_can_be_resumed(tmp_path: Path) -> None:
    (tmp_path / "small.yaml").write_text(
        "episode: {horizon: 2}\nevolution: {population: 4, generations: 200, trials: 1, repeats: 2, seed: 1}\n"
    )
    command = [sys.executable, "-m", "swarmevo"]
    process = subprocess.Popen(
        [*command, "evolve", "small.yaml", "--out", "run"], cwd=tmp_path, stderr=subprocess.PIPE, text=True
    )
    assert process.stderr is not None
    for line in process.stderr:
        if "generation 1/" in line:
            process.send_signal(signal.SIGTERM)
    assert process.wait(60) == 130
    process.stderr.close()
    with Store.open(tmp_path / "run") as left:
        done = left.generations(0)
    assert 2 <= done < 200
    resumed = [*command, "resume", "run", "--generations", str(done + 1)]
    subprocess.run(resumed, cwd=tmp_path, check=True, capture_output=True, timeout=120)
    with Store.open(tmp_path / "run") as left:
        assert left.generations(0) == done + 1


# ---- extended --------------------------------------------------------------------------------------------------------


def extended(folder: Path, generations: str) -> int:
    with Store.open(folder, readonly=False) as opened:
        return extend(opened, generations)


@pytest.mark.parametrize("more", ["+2", "6"])
def test_a_finished_run_is_extended_to_what_a_longer_one_gives(tmp_path: Path, whole: Content, more: str) -> None:
    begin(tmp_path / "run", toy_plugins.config(evolution=BUDGET | {"generations": 4}))
    go_on(tmp_path / "run")
    assert extended(tmp_path / "run", more) == 6
    go_on(tmp_path / "run")
    long, short = content(tmp_path / "run"), whole
    # Ids of genomes count in the order of storing, which differs when there are several trials.
    for table in ("run", "episode", "optimiser"):
        assert long[table] == short[table]
    assert sorted(row[1:] for row in long["genome"]) == sorted(row[1:] for row in short["genome"])
    assert configuration.load(tmp_path / "run" / CONFIG_FILE).evolution.generations == 6


def test_an_open_run_knows_its_new_length(tmp_path: Path) -> None:
    with Store.open(start(tmp_path / "run"), readonly=False) as opened:
        assert opened.config.evolution.generations == 6
        extend(opened, "+2")
        assert opened.config.evolution.generations == 8


@pytest.mark.parametrize(
    ("generations", "told"),
    [
        ("many", r"generations: expected a whole number, or \+N for so many more, got 'many'"),
        ("-3", "got '-3'"),
        ("5", "generations: expected at least the 6 that are stored, got 5"),
        ("99999999", r"evolution\.generations: expected a whole number from 1 to 1000000, got 99999999"),
    ],
)
def test_a_wrong_number_of_generations_changes_nothing(tmp_path: Path, generations: str, told: str) -> None:
    folder = start(tmp_path / "run")
    go_on(folder)
    before = (folder / CONFIG_FILE).read_bytes(), content(folder)
    with pytest.raises(ConfigError, match=told):
        extended(folder, generations)
    assert ((folder / CONFIG_FILE).read_bytes(), content(folder)) == before


def test_the_same_number_of_generations_writes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = start(tmp_path / "run")
    monkeypatch.setattr(Store, "replace_config", None)
    assert extended(folder, "6") == extended(folder, "+0") == 6


def die(*_: object) -> Any:
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.parametrize("moment", ["before the file", "in the file", "before the rename", "after the file"])
def test_a_kill_while_a_run_is_extended_leaves_the_old_length_or_the_new(
    tmp_path: Path, moment: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = start(tmp_path / "run")

    def extend_and_die() -> None:
        if moment == "before the file":
            monkeypatch.setattr(files, "write", die)
        elif moment == "in the file":
            monkeypatch.setattr(os, "fsync", die)
        elif moment == "before the rename":
            monkeypatch.setattr(Path, "replace", die)
        with Store.open(folder, readonly=False) as opened:
            if moment == "after the file":
                monkeypatch.setattr(Store, "_settle_config", die)
            extend(opened, "+1")

    assert exit_code(extend_and_die) == -signal.SIGKILL
    expected = 7 if moment == "after the file" else 6
    with Store.open(folder, readonly=False):
        assert configuration.load(folder / CONFIG_FILE).evolution.generations == expected
    assert extended(folder, "7") == 7
    with Store.open(folder) as opened:
        assert opened.config.evolution.generations == 7


# ---- somebody else, no room, no right --------------------------------------------------------------------------------


def test_a_second_writer_is_refused_while_the_first_is_alive(tmp_path: Path) -> None:
    folder = start(tmp_path / "run")
    told: list[str] = []

    def look(progress: Progress) -> None:
        with pytest.raises(StoreError) as error:
            extended(folder, "+1")
        told.append(str(error.value))

    with Store.open(folder, readonly=False) as opened:
        evolve(opened, 1, look)
    assert len(told) == 12
    assert all(f"process {os.getpid()} on" in line and "\n" not in line for line in told)


def test_a_full_disk_ends_the_run_with_one_line_and_loses_nothing(tmp_path: Path, whole: Content) -> None:
    folder = start(tmp_path / "run")
    said = tmp_path / "said"

    def on_a_full_disk() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, 150_000))
        try:
            go_on(folder)
        except StoreError as error:
            said.write_text(str(error))

    assert exit_code(on_a_full_disk) == 0
    assert "\n" not in said.read_text()
    assert "is the disk full" in said.read_text()
    before = rows(folder)
    assert 0 < before < len(whole["episode"])
    go_on(folder)
    assert content(folder) == whole


def test_a_tiny_file_system_ends_the_run_with_one_line_and_loses_nothing(tmp_path: Path, whole: Content) -> None:
    place = tmp_path / "tiny"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=320k", "tmpfs", str(place)]
    if subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("needs the right to mount")
    try:
        folder = start(place / "run")
        with pytest.raises(StoreError, match=r"is the disk full|the disk is full") as error:
            go_on(folder)
        assert "\n" not in str(error.value)
        subprocess.run(["mount", "-o", "remount,size=20m", str(place)], check=True)
        go_on(folder)
        assert content(folder) == whole
    finally:
        subprocess.run(["umount", str(place)], check=True)


def test_a_run_of_an_older_schema_is_told_so_and_left_alone(tmp_path: Path) -> None:
    folder = start(tmp_path / "run")
    with closing(sqlite3.connect(folder / DATABASE_FILE)) as database:
        database.execute("PRAGMA user_version = 3")
    before = (folder / DATABASE_FILE).read_bytes()
    for readonly in (True, False):
        with pytest.raises(
            StoreError, match="expected schema version 4 to 7, got 3; use an older swarmevo for this run"
        ):
            Store.open(folder, readonly=readonly)
    assert (folder / DATABASE_FILE).read_bytes() == before


# ---- with what it was run --------------------------------------------------------------------------------------------


def test_a_run_that_goes_on_with_the_same_has_one_session(tmp_path: Path) -> None:
    folder = start(tmp_path / "run")
    with pytest.raises(Interrupted):
        go_on(folder, stop=StopAt(30))
    go_on(folder)
    with Store.open(folder) as opened:
        assert (opened.sessions(1, 5) == 1).all()
        assert opened.session(1) == json.loads((folder / "provenance.json").read_text())
        with pytest.raises(StoreError, match="provenance of session 2 is missing"):
            opened.session(2)


def test_episodes_know_the_session_that_ran_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = start(tmp_path / "run")
    with pytest.raises(Interrupted):
        go_on(folder, stop=StopAt(6), backend=OneByOne)
    origin = provenance.provenance
    monkeypatch.setattr(driver, "provenance", lambda *given: origin(*given) | {"cpu": "Another One"})
    go_on(folder)
    with Store.open(folder) as opened:
        first = opened.sessions(0, 0).ravel()
        assert first.tolist() == [1] * 5 + [2] * 7
        assert (opened.sessions(0, 1) == 2).all()
        assert opened.session(2)["cpu"] == "Another One"


def test_seconds_are_those_of_all_sessions(tmp_path: Path) -> None:
    folder = start(tmp_path / "run")
    with pytest.raises(Interrupted):
        go_on(folder, stop=StopAt(6), backend=OneByOne)
    seals.change(folder, "UPDATE in_flight SET seconds = 1000.0")
    go_on(folder)
    with Store.open(folder) as opened:
        assert opened.generation(0, 0).episodes.seconds > 1000
        assert 0 < opened.generation(0, 1).episodes.seconds < 1000


def test_an_evaluator_takes_what_is_known_and_runs_the_rest() -> None:
    settings = toy_plugins.config()
    kept: list[Results] = []
    with Evaluator(settings, 2) as evaluator:
        genomes = np.random.default_rng(0).standard_normal((5, evaluator.space.size))
        first = evaluator.evaluate(genomes, 0, 0, keep=Keeper(kept))
        known = joined(kept)
        places = np.arange(len(known))
        for wanted in (places % 3 == 0, places >= 7, places < 0, places >= 0):
            anew: list[Results] = []
            again = evaluator.evaluate(genomes, 0, 0, known=known.only(wanted), keep=Keeper(anew))
            assert sum(map(len, anew)) == np.count_nonzero(~wanted)
            np.testing.assert_array_equal(again.costs, first.costs)
            for name in first.episodes.values:
                np.testing.assert_array_equal(again.episodes[name], first.episodes[name], err_msg=name)

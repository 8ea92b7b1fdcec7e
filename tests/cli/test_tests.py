# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo test``: what becomes of what it found."""

from __future__ import annotations

import errno
import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path
from typing import NoReturn

import pytest

import small_runs
import swarmevo
from cli.conftest import Swarmevo
from swarmevo.runs.lock import WriterLock
from swarmevo.runs.store import Store
from swarmevo.runs.tests import StoredTests
from swarmevo.runs.tests_file import LOCK_FILE, TESTS_FILE

SMALLEST = ("--robots", "3", "--repeats", 1, "--workers", 1)


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return small_runs.make(tmp_path / "run", "evolution.trials=1", "evolution.generations=1")


def stored(run: Path) -> list[tuple[object, ...]]:
    """Return what is stored of each test but the session."""
    query = (
        "SELECT kind, world, trial, genome, repeat, content FROM test JOIN tested ON id = tested ORDER BY 1, 2, 3, 4, 5"
    )
    with closing(sqlite3.connect(run / TESTS_FILE)) as database:
        return database.execute(query).fetchall()


@pytest.mark.parametrize("form", [(), ("--json",)])
def test_tests_of_a_read_only_run_are_printed(
    run: Path, form: tuple[str, ...], swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 57: then one line says what was not stored, and why. What is stored already is used all the same."""
    assert swarmevo_("test", run, *SMALLEST).code == 0
    before = stored(run)

    def refuse(*_: object, **__: object) -> NoReturn:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr("swarmevo.runs.tests.WriterLock", refuse)
    done = swarmevo_("test", run, "--robots", "3", "--repeats", 2, "--workers", 1, *form)
    assert (done.code, done.err) == (0, f"not stored: {run / TESTS_FILE}: Read-only file system\n")
    if form:
        assert [row["robots"] for row in json.loads(done.out)["rows"]] == [3]
        assert json.loads(done.out)["repeats"] == 2
    else:
        assert "(98%)" in done.out
    assert stored(run) == before


def test_tests_that_nobody_reads_are_stored(run: Path, swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 57: where what is printed is refused, as by a closed pipe, the tests are stored all the same."""

    def refuse(*_: object) -> NoReturn:
        raise SystemExit(141)

    monkeypatch.setattr("swarmevo.views.console.show_assessment", refuse)
    assert swarmevo_("test", run, *SMALLEST).code == 141
    assert stored(run)


@pytest.mark.parametrize(
    "poorer",
    [
        ("--robots", "1-3", "--repeats", 1, "--robustness"),
        ("--robots", "2", "--repeats", 2, "--robustness"),
        ("--robots", "1-3", "--repeats", 2),
    ],
)
def test_poorer_tests_destroy_nothing(run: Path, poorer: tuple[object, ...], swarmevo_: Swarmevo) -> None:
    """Case 11."""
    rich = ("test", run, "--robots", "1-3", "--repeats", 2, "--robustness", "--workers", 1)
    assert swarmevo_(*rich).err.splitlines()[-1] == f"stored in {run / TESTS_FILE}"
    before = stored(run)
    done = swarmevo_("test", run, *poorer, "--workers", 1, "--json")
    assert (done.code, done.err.splitlines()[-1]) == (0, f"all of it was stored before, in {run / TESTS_FILE}")
    assert json.loads(done.out)["repeats"] == 2
    assert stored(run) == before


def test_a_second_test_at_once_is_refused(run: Path, swarmevo_: Swarmevo) -> None:
    lock = WriterLock(run / LOCK_FILE)
    done = swarmevo_("test", run, *SMALLEST)
    lock.release()
    assert done.code == 1
    assert done.errors == [
        f"{run}: process {os.getpid()} on {os.uname().nodename} is writing it; wait for that, or stop it"
    ]
    assert not (run / TESTS_FILE).exists()


def test_what_a_killed_test_did_is_kept(run: Path, swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch) -> None:
    """As after SIGKILL, the file is whole; once more goes on from there, to the same tests."""
    command = ["test", str(run), "--robots", "1-5", "--repeats", "150", "--workers", "1"]
    started = subprocess.Popen([sys.executable, "-m", "swarmevo", *command], stderr=subprocess.PIPE)
    while not (run / TESTS_FILE).exists() or not _count(run):
        assert started.poll() is None
        time.sleep(0.05)
    started.send_signal(signal.SIGKILL)
    started.communicate()
    kept = stored(run)
    assert swarmevo_(*command).code == 0
    assert set(kept) < set(stored(run))
    whole = stored(run)
    (run / TESTS_FILE).unlink()
    assert swarmevo_(*command).code == 0
    assert stored(run) == whole


def _count(run: Path) -> int:
    try:
        return len(stored(run))
    except sqlite3.OperationalError:  # it is just being made
        return 0


def test_an_interrupted_test_says_what_is_kept(run: Path, swarmevo_: Swarmevo) -> None:
    command = [sys.executable, "-m", "swarmevo", "test", str(run), "--repeats", "3000", "--workers", "1"]
    started = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    while not (run / TESTS_FILE).exists() or not _count(run):
        time.sleep(0.05)
    started.send_signal(signal.SIGTERM)  # SIGINT is ignored where the tests run in the background
    _, err = started.communicate()
    assert started.returncode == 130
    assert err.splitlines()[-1] == "interrupted; what was tested is stored; once more goes on from there"
    assert not (run / LOCK_FILE).exists()


def test_a_run_without_generations_is_refused_and_gets_no_file(tmp_path: Path, swarmevo_: Swarmevo) -> None:
    done = swarmevo_("test", tmp_path)
    assert done.errors == [f"{tmp_path}: expected a run folder, but there is no run.sqlite in it"]


# ---- damage ----------------------------------------------------------------------------------------------------------


def test_a_damaged_test_is_run_again(run: Path, swarmevo_: Swarmevo) -> None:
    assert swarmevo_("test", run, *SMALLEST).code == 0
    sound = stored(run)
    with closing(sqlite3.connect(run / TESTS_FILE)) as database:
        database.execute("UPDATE test SET content = replace(content, '0', '1') WHERE repeat = 0")
        database.commit()
    with Store.open(run) as store, pytest.raises(Exception, match="is damaged: a test of trial 0"):
        StoredTests.open(store)
    assert swarmevo_("report", run, "--html", run.parent / "page.html").code == 1
    done = swarmevo_("verify", run)
    assert done.code == 1
    assert "damaged: tests.sqlite: a test of trial 0" in done.out
    done = swarmevo_("test", run, *SMALLEST)
    assert done.err.splitlines()[0].startswith(f"warning: {run / TESTS_FILE}: ")
    assert stored(run) == sound
    assert swarmevo_("verify", run).code == 0


def test_tests_that_vanished_are_noticed(run: Path, swarmevo_: Swarmevo) -> None:
    assert swarmevo_("test", run, *SMALLEST).code == 0
    sound = stored(run)
    with closing(sqlite3.connect(run / TESTS_FILE)) as database:
        database.execute("DELETE FROM test WHERE tested = 1")
        database.commit()
    assert "is damaged" in swarmevo_("report", run, "--html", run.parent / "page.html").errors[0]
    assert swarmevo_("test", run, *SMALLEST).code == 0
    assert stored(run) == sound


def test_tests_of_another_run_are_refused(run: Path, tmp_path: Path, swarmevo_: Swarmevo) -> None:
    other = small_runs.make(tmp_path / "other", "evolution.trials=1", "evolution.seed=6")
    assert swarmevo_("test", run, *SMALLEST).code == 0
    (run / TESTS_FILE).rename(other / TESTS_FILE)
    done = swarmevo_("test", other, *SMALLEST)
    line = f"{other / TESTS_FILE}: expected the tests of this run, got those of another one; move it away"
    assert (done.code, done.errors) == (1, [line])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("PRAGMA user_version = 3", "expected version 2, got 3; use a newer swarmevo"),
        ("PRAGMA application_id = 1", "expected tests of swarmevo, got another SQLite file"),
        ("CREATE VIEW more AS SELECT 1", "expected the tables of tests and nothing else, but its view 'more'"),
        ("UPDATE session SET provenance = '{}'", "the provenance of session 1 is not as it was stored"),
        ("UPDATE world SET changes = '{\"arena.size\":2}'", "world 1 is not as it was stored"),
    ],
)
def test_what_is_no_file_of_ours_is_refused(run: Path, change: str, message: str, swarmevo_: Swarmevo) -> None:
    assert swarmevo_("test", run, *SMALLEST).code == 0
    with closing(sqlite3.connect(run / TESTS_FILE)) as database:
        database.execute(change)
        database.commit()
    for command in (("test", run, *SMALLEST), ("report", run, "--html", run.parent / "page.html")):
        done = swarmevo_(*command)
        assert (done.code, len(done.errors)) == (1, 1)
        assert message in done.errors[0]


# ---- verifying -------------------------------------------------------------------------------------------------------


def test_tests_are_verified_too(run: Path, swarmevo_: Swarmevo) -> None:
    assert swarmevo_("test", run, "--robots", "2-3", "--repeats", 3, "--workers", 1, "--robustness").code == 0
    episodes = len([row for row in stored(run) if row[0] == "episode"])
    done = swarmevo_("verify", run)
    assert done.code == 0
    assert f"{episodes} of {episodes} tests of controllers simulated anew" in done.out
    assert f"1 of {episodes} tests of controllers simulated anew" in swarmevo_("verify", run, "--sample", 1).out


def test_a_test_that_differs_is_named(run: Path, swarmevo_: Swarmevo) -> None:
    """Its checksum is right: it was stored like that."""
    assert swarmevo_("test", run, *SMALLEST).code == 0
    with Store.open(run) as store, StoredTests.open(store, readonly=False) as tests:
        place = tests.places()[0]
        tests.begin_session(tests.session(1))
        tests.add_episodes([place], _changed(tests.episodes(place, 3)))
    done = swarmevo_("verify", run)
    assert done.code == 1
    assert "differs: test 0 of individual" in done.out
    assert "trajectory" in done.out
    (different,) = json.loads(swarmevo_("verify", run, "--json").out)["different_tests"]
    assert (different["world"], different["repeat"], different["what"]) == ("{}", 0, ["trajectory"])


def _changed(results):  # type: ignore[no-untyped-def]
    results.values["hash"][:] += 1
    return results


# ---- until it is decided ---------------------------------------------------------------------------------------------


def test_the_table_says_who_was_decided(run: Path, swarmevo_: Swarmevo) -> None:
    done = swarmevo_("test", run, "--robots", "3", "--until", 0.97, "--workers", 1)
    assert "Is the push rate above 0.97?" in done.out
    (row,) = {tuple(line.split()[3:6]) for line in done.out.splitlines() if "% to " in line}
    assert row == ("no", "25", "0.0%")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("--until", 1), "--until: expected a rate between 0 and 1, got 1"),
        (("--until", 0.9, "--rate", "speed"), "--rate: expected push or homing, got 'speed'"),
        (("--rate", "homing"), "--rate: has no effect without --until; leave it out"),
    ],
)
def test_what_cannot_be_decided_is_refused(
    run: Path, given: tuple[object, ...], message: str, swarmevo_: Swarmevo
) -> None:
    done = swarmevo_("test", run, *given)
    assert (done.code, done.errors) == (2, [message])


def test_an_individual_of_the_run(run: Path, swarmevo_: Swarmevo) -> None:
    done = swarmevo_("test", f"{run}:2", *SMALLEST, "--json")
    assert [one["genome"] for one in json.loads(done.out)["controllers"]] == [2]
    done = swarmevo_("test", f"{run}:999", *SMALLEST)
    assert (done.code, done.errors) == (1, [f"{run}: there is no genome 999"])


# ---- controllers of no run -------------------------------------------------------------------------------------------


def test_a_controller_from_a_file(run: Path, tmp_path: Path, swarmevo_: Swarmevo) -> None:
    """An exported one does in its run's world what it does there, to the last digit."""
    assert swarmevo_("export", run, "--controller", 2, "--out", "two.json").code == 0
    world = ("--set", "episode.horizon=2", "evolution.seed=5")
    done = swarmevo_("test", "--genome", "two.json", "quick", "--json", *SMALLEST, *world)
    assert (done.code, done.err) == (0, "not stored, being of no run; seed 5\n")
    (alone,) = json.loads(done.out)["controllers"]
    (in_run,) = json.loads(swarmevo_("test", f"{run}:2", "--json", *SMALLEST).out)["controllers"]
    assert (alone["tested"], alone["outcomes"]) == (in_run["tested"], in_run["outcomes"])
    assert swarmevo_("test", "--genome", run, *SMALLEST, *world).out.startswith("2 controllers of ")


@pytest.mark.parametrize("setting", ["episode.until=push", "episode={until: push}"])
def test_a_controller_from_a_file_is_tested_until_the_push_if_that_is_set(swarmevo_: Swarmevo, setting: str) -> None:
    """Its configuration's own is left out: ``best.yaml`` says push."""
    best = Path(swarmevo.__file__).parent / "shipped" / "best.json"
    arguments = ("test", "--genome", best, "best", "--json", "--repeats", 1, "--robots", 5, "--set", "evolution.seed=5")
    whole, ended = (json.loads(swarmevo_(*arguments, *more).out) for more in ((), (setting,)))
    (of_whole,), (of_ended,) = whole["controllers"], ended["controllers"]
    (at_horizon,), (at_push,) = of_whole["outcomes"], of_ended["outcomes"]
    assert at_horizon["push_time"] == at_push["push_time"]
    assert at_horizon["homing_rate"] == 1.0 > at_push["homing_rate"]  # one comes after the push


@pytest.mark.parametrize(
    "setting", ["vary={box.mass: {uniform: [0.2, 0.28]}}", "worlds=[{}]", "optimiser=pde", "evolution.repeats=7"]
)
def test_what_has_no_effect_on_a_controller_from_a_file_is_refused(swarmevo_: Swarmevo, setting: str) -> None:
    best = Path(swarmevo.__file__).parent / "shipped" / "best.json"
    done = swarmevo_("test", "--genome", best, "paper", "--set", setting, "evolution.seed=5")
    (error,) = done.errors
    assert error.startswith(f"--set {setting}: expected a key of the world (")
    assert error.endswith("nothing else has an effect on tests")


def test_neither_run_nor_genome(swarmevo_: Swarmevo) -> None:
    done = swarmevo_("test")
    assert (done.code, done.errors) == (2, ["test: expected a run folder, or --genome FILE; got neither"])
    done = swarmevo_("test", "--genome", "none.json")
    assert (done.code, done.errors) == (2, ["none.json: expected a file of genomes or a run, but there is none"])

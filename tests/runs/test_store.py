# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import dataclasses
import errno
import fcntl
import json
import mmap
import multiprocessing
import os
import shutil
import signal
import sqlite3
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import grids
from swarmevo.errors import StoreError
from swarmevo.evolution.results import Generation
from swarmevo.evolution.state import decode_state, encode_state
from swarmevo.protocols import Objective
from swarmevo.runs.database import DATABASE_FILE
from swarmevo.runs.folder import CONFIG_FILE
from swarmevo.runs.schema import DESCRIBED, SCHEMA_VERSION, SUCCEEDING, VERSIONS
from swarmevo.runs.store import PROVENANCE_FILE, Store

OBJECTIVES = (Objective("speed", "maximise", (0.0, 2.0)), Objective('size "of" it', "minimise", (-1.0, 1e9)))
LOCK_FILE = "run.lock"
ROBOTS = 3
SEED = 2**63 - 1


def make(folder: Path) -> Store:
    return Store.create(folder, "evolution: {seed: 1}\n", {"made": "here"}, OBJECTIVES, ROBOTS, SEED)


def generation(n: int = 4, repeats: int = 2, seed: int = 0) -> Generation:
    rng = np.random.default_rng(seed)
    times = rng.random((n, repeats, 1 + ROBOTS)) * 180
    times[times > 120] = np.nan
    genomes = rng.standard_normal((n, 5))
    episodes = grids.results(
        objective=rng.standard_normal((n, repeats, 2)),
        hash=rng.integers(0, 2**64, (n, repeats), dtype=np.uint64, endpoint=False),
        push_time=times[..., 0],
        homing_time=times[..., 1:],
        ode_messages=rng.integers(0, 2**32, (n, repeats), dtype=np.uint32),
        unsolved_steps=rng.integers(0, 2**32, (n, repeats), dtype=np.uint32),
        seconds=float(rng.random()),
    )
    return Generation(genomes, episodes)


def assert_equal(a: Generation, b: Generation) -> None:
    np.testing.assert_array_equal(a.genomes, b.genomes)
    one, two = a.episodes, b.episodes
    assert (one.seconds, one.faults, one.values.keys()) == (two.seconds, two.faults, two.values.keys())
    for name, left, right in [
        ("individual", one.individual, two.individual),
        ("repeat", one.repeat, two.repeat),
        *((column, one[column], two[column]) for column in one.values),
    ]:
        np.testing.assert_array_equal(left, right, err_msg=name)
        assert left.dtype == right.dtype


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with make(tmp_path / "run") as store:
        yield store


Connections = list[sqlite3.Connection]


def remember_connections(monkeypatch: pytest.MonkeyPatch) -> Connections:
    """Return a list that gets each connection to a database which is made from now on."""
    made: Connections = []
    connect = sqlite3.connect

    def connect_and_remember(*arguments: Any, **options: Any) -> sqlite3.Connection:
        made.append(connect(*arguments, **options))
        return made[-1]

    monkeypatch.setattr(sqlite3, "connect", connect_and_remember)
    return made


@pytest.fixture
def connections(monkeypatch: pytest.MonkeyPatch) -> Connections:
    """The connections that a test makes; to be named before ``store``, whose own is the last one then."""
    return remember_connections(monkeypatch)


def dump(folder: Path) -> list[str]:
    with closing(sqlite3.connect(folder / DATABASE_FILE)) as database:
        return list(database.iterdump())


def in_child(action: Callable[[], None]) -> int:
    """Run ``action`` in a forked process; return its exit code, negative: the signal that ended it."""
    child = multiprocessing.get_context("fork").Process(target=action)
    child.start()
    child.join(60)
    assert child.exitcode is not None
    return child.exitcode


# ---- making a folder -------------------------------------------------------------------------------------------------


def test_a_new_folder_holds_config_provenance_and_database(tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "run"
    with make(folder) as store:
        assert (folder / LOCK_FILE).exists()
        assert store.objectives == OBJECTIVES
        assert (store.seed, store.robots) == (SEED, ROBOTS)
        assert store.trials() == []
        assert store.generations(0) == 0
        assert store.state(0) is None
    assert sorted(path.name for path in folder.iterdir()) == [CONFIG_FILE, PROVENANCE_FILE, DATABASE_FILE]
    assert (folder / CONFIG_FILE).read_text() == "evolution: {seed: 1}\n"
    assert json.loads((folder / PROVENANCE_FILE).read_text()) == {"made": "here"}


@pytest.mark.parametrize("inhabited", [True, False])
def test_a_folder_is_never_overwritten(tmp_path: Path, inhabited: bool) -> None:
    if inhabited:
        (tmp_path / "thesis.tex").write_text("mine")
    with pytest.raises(StoreError, match="exists already and is never overwritten; choose another name"):
        make(tmp_path)
    assert [path.read_text() for path in tmp_path.iterdir()] == (["mine"] if inhabited else [])


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(StoreError, match=r"^[^\n]*file[^\n]*: Not a directory$"):
        make(tmp_path / "file" / "run")


def test_a_folder_that_cannot_be_filled_is_removed(tmp_path: Path) -> None:
    twins = (OBJECTIVES[0], OBJECTIVES[0])
    with pytest.raises(StoreError, match="UNIQUE"):
        Store.create(tmp_path / "run", "", {}, twins, ROBOTS, 0)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["x" * 300, "new/" + "x" * 300, "new/" + "x" * 300 + "/run"])
def test_a_name_that_is_too_long_is_one_line_and_leaves_nothing(tmp_path: Path, name: str) -> None:
    """Case 69: it was a traceback, and parent folders stayed."""
    with pytest.raises(StoreError, match=r"^[^\n]*: File name too long$"):
        make(tmp_path / name)
    assert list(tmp_path.iterdir()) == []
    for readonly in (True, False):
        with pytest.raises(StoreError, match=r"^[^\n]*: expected a run folder, but there is no run.sqlite in it$"):
            Store.open(tmp_path / name, readonly=readonly)


def deep(folder: Path, size: int) -> Path:
    """Return a path of so many bytes in a folder."""
    left = size - len(os.fsencode(folder)) - 1
    return folder / "/".join(["x" * 99] * ((left - 2) // 100) + ["y" * ((left - 2) % 100 + 2)])


def test_a_path_that_is_too_long_for_sqlite_is_one_line_and_leaves_nothing(tmp_path: Path) -> None:
    """Case 69: it was "is the folder readable, and writable if the run was killed?"."""
    told = r"^[^\n]*y: expected a run folder whose whole path has at most 493 bytes, .* got 494; "
    folder = deep(tmp_path, 494)
    with pytest.raises(StoreError, match=told):
        make(folder)
    assert list(tmp_path.iterdir()) == []
    with make(deep(tmp_path, 493)) as store:
        store.append(0, 0, generation(), "{}")
    store.folder.rename(folder)
    for readonly in (True, False):
        with pytest.raises(StoreError, match=told):
            Store.open(folder, readonly=readonly)
    (tmp_path / "link").symlink_to(store.folder)
    folder.rename(store.folder)
    with Store.open(tmp_path / "link") as store:
        assert_equal(store.generation(0, 0), generation())


def test_a_path_that_is_no_utf_8_is_a_path_like_any_other(tmp_path: Path) -> None:
    """Case 28: it was a traceback."""
    folder = tmp_path / os.fsdecode(b"caf\xe9 %41?#&=")
    with make(folder) as store:
        store.append(0, 0, generation(), "{}")
    for readonly in (True, False):
        with Store.open(folder, readonly=readonly) as store:
            assert_equal(store.generation(0, 0), generation())
    assert os.listdir(os.fsencode(tmp_path)) == [os.fsencode(folder.name)]


# ---- generations -----------------------------------------------------------------------------------------------------


def test_generations_come_back_bit_by_bit(store: Store) -> None:
    written = {(trial, number): generation(seed=10 * trial + number) for trial in (0, 2) for number in range(3)}
    for (trial, number), content in written.items():
        store.append(trial, number, content, encode_state({"number": number}))
    store.close()
    with Store.open(store.folder) as again:
        assert again.trials() == [0, 2]
        assert [again.generations(trial) for trial in range(3)] == [3, 0, 3]
        assert again.state(2) == {"number": 2}
        for (trial, number), content in written.items():
            assert_equal(again.generation(trial, number), content)


def test_the_size_of_generations_may_vary(store: Store) -> None:
    for number, n in enumerate((1, 7, 2)):
        store.append(0, number, generation(n, repeats=n), "{}")
    assert [store.generation(0, number).genomes.shape for number in range(3)] == [(1, 5), (7, 5), (2, 5)]


def test_equal_genomes_are_stored_once(store: Store) -> None:
    content = generation()
    content.genomes[3] = content.genomes[1]
    store.append(0, 0, content, "{}")
    store.append(0, 1, content, "{}")
    np.testing.assert_array_equal([summary.genomes for summary in store.summaries(0)], [[1, 2, 3, 2]] * 2)
    np.testing.assert_array_equal(store.genome(2), content.genomes[1])
    with pytest.raises(StoreError, match="there is no genome 4"):
        store.genome(4)


def test_genomes_leave_little_of_their_pages_empty(store: Store) -> None:
    """Case 14: one genome of the paper's size a page, 4,228 bytes for each individual, of which 2,648 are genes."""
    content = generation(600, repeats=1)
    genomes = np.random.default_rng(0).standard_normal((600, 331))
    before = (store.folder / DATABASE_FILE).stat().st_size
    store.append(0, 0, Generation(genomes, content.episodes), "{}")
    assert (store.folder / DATABASE_FILE).stat().st_size - before < 600 * 3100


@pytest.mark.parametrize("number", [0, 2])
def test_generations_follow_one_another(store: Store, number: int) -> None:
    store.append(0, 0, generation(), "{}")
    with pytest.raises(StoreError, match=f"expected generation 1 of trial 0, got {number}"):
        store.append(0, number, generation(), "{}")


def test_a_generation_is_stored_as_a_whole_or_not_at_all(store: Store) -> None:
    first, bad = generation(), generation(seed=1)
    bad.episodes.grid("objective")[-1, -1, -1] = np.nan
    store.append(0, 0, first, encode_state({"after": 0}))
    before = dump(store.folder)
    with pytest.raises(StoreError, match=r"NOT NULL constraint failed: episode\.objective_1"):
        store.append(0, 1, bad, encode_state({"after": 1}))
    assert dump(store.folder) == before
    store.append(0, 1, generation(seed=1), encode_state({"after": 1}))


@contextmanager
def traced(database: sqlite3.Connection) -> Iterator[list[str]]:
    """Collect the statements that are executed."""
    statements: list[str] = []
    database.set_trace_callback(statements.append)
    yield statements
    database.set_trace_callback(None)


def test_a_generation_is_stored_without_reading_all_before_it(connections: Connections, store: Store) -> None:
    """Else each would cost more the longer the run is."""
    database = connections[-1]
    with traced(database) as statements:
        store.append(0, 0, generation(), encode_state({}))
    said = [s for s in statements if s.startswith(("SELECT", "INSERT", "UPDATE", "DELETE", "REPLACE"))]
    plans = [row[3] for s in said for row in database.execute(f"EXPLAIN QUERY PLAN {s}")]
    assert any("SEARCH genome" in plan for plan in plans)
    assert not any(plan.startswith("SCAN") and "in_flight" not in plan for plan in plans)


def test_the_next_generation_is_known_without_counting_those_before_it(connections: Connections, store: Store) -> None:
    """Case 64: it is asked for with every job whose episodes are kept."""
    store.append(0, 0, generation(), "{}")
    with traced(connections[-1]) as statements:
        assert store.generations(0) == 1
    (query,) = statements
    assert "MAX(number)" in query  # of a primary key, which SQLite looks up
    assert store.generations(1) == 0


def test_a_generation_survives_a_power_failure_and_what_is_kept_need_not(
    connections: Connections, store: Store
) -> None:
    first = generation()
    with traced(connections[-1]) as statements:
        store.keep(0, 0, first.genomes, first.episodes)
        store.append(0, 0, first, "{}")
    assert [s.split(" = ")[1] for s in statements if s.startswith("PRAGMA synchronous")] == ["NORMAL", "FULL"]


def test_episodes_are_kept_of_the_next_generation_only(store: Store) -> None:
    store.append(0, 0, generation(), "{}")
    for number in (0, 2):
        with pytest.raises(StoreError, match=f"expected generation 1 of trial 0, got {number}"):
            store.keep(0, number, generation().genomes, generation().episodes)


def test_a_kept_episode_stays_its_session_s_unless_it_ran_again(store: Store) -> None:
    kept = generation()
    store.keep(0, 0, kept.genomes, kept.episodes)
    store.begin_session({"made": "elsewhere"})
    again = dataclasses.replace(kept.episodes, values={**kept.episodes.values, "hash": kept.episodes["hash"].copy()})
    again.grid("hash")[2, 1] += np.uint64(1)
    store.append(0, 0, Generation(kept.genomes, again), "{}")
    expected = np.ones((4, 2), dtype=int)
    expected[2, 1] = 2
    assert store.sessions(0, 0).tolist() == expected.ravel().tolist()


def test_what_is_not_stored_is_an_error(store: Store) -> None:
    with pytest.raises(StoreError, match="there is no generation 0 of trial 5"):
        store.generation(5, 0)


# ---- what analysis reads ---------------------------------------------------------------------------------------------


@pytest.fixture
def two_trials(store: Store) -> tuple[Store, list[Generation]]:
    """A genome of trial 0 lives for two generations; trial 1 has one."""
    first, second, other = (generation(seed=seed) for seed in range(3))
    second.genomes[0] = first.genomes[2]
    for trial, number, content in ((0, 0, first), (0, 1, second), (1, 0, other)):
        store.append(trial, number, content, "{}")
    return store, [first, second, other]


def test_a_genome_is_judged_by_all_its_episodes(two_trials: tuple[Store, list[Generation]]) -> None:
    store, (first, second, _) = two_trials
    found = store.individuals(0)
    (at,) = np.flatnonzero(found.genome == 3)
    assert (found.first_generation[at], found.last_generation[at], found.episodes[at]) == (0, 1, 4)
    objectives = np.concatenate([first.episodes.grid("objective")[2], second.episodes.grid("objective")[0]])
    np.testing.assert_allclose(found.objectives[at], objectives.mean(axis=0))
    homing = np.concatenate([first.episodes.grid("homing_time")[2], second.episodes.grid("homing_time")[0]])
    assert found.homing_rate[at] == pytest.approx(np.isfinite(homing).mean())
    assert found.homing_time[at] == pytest.approx(np.nanmean(homing))
    push = np.concatenate([first.episodes.grid("push_time")[2], second.episodes.grid("push_time")[0]])
    assert found.push_rate[at] == pytest.approx(np.isfinite(push).mean())
    assert found.push_time[at] == pytest.approx(np.nanmean(push))


def test_individuals_are_of_one_trial_or_of_all(two_trials: tuple[Store, list[Generation]]) -> None:
    store, _ = two_trials
    assert store.individuals(0).genome.tolist() == [1, 2, 3, 4, 5, 6, 7]
    assert store.individuals(1).trial.tolist() == [1] * 4
    assert store.individuals().trial.tolist() == [0] * 7 + [1] * 4
    nobody = store.individuals(9)
    assert nobody.objectives.shape == (0, 2)
    assert nobody.homing_rate.shape == (0,)


def test_a_time_that_nobody_made_is_nan(store: Store) -> None:
    content = generation()
    content.episodes.grid("push_time")[:] = np.nan
    content.episodes.grid("homing_time")[:] = np.nan
    store.append(0, 0, content, "{}")
    found = store.individuals()
    assert np.isnan(found.push_time).all()
    assert np.isnan(found.homing_time).all()
    assert not found.push_rate.any()
    assert not found.homing_rate.any()


def test_summaries_tell_each_generation_in_short(two_trials: tuple[Store, list[Generation]]) -> None:
    store, (first, second, _) = two_trials
    for number, (summary, content) in enumerate(zip(store.summaries(0), (first, second), strict=True)):
        assert (summary.trial, summary.number, summary.episodes) == (0, number, 8)
        assert summary.seconds == content.episodes.seconds
        assert summary.ode_messages == content.episodes.grid("ode_messages").sum(dtype=np.uint64)
        assert summary.unsolved_steps == content.episodes.grid("unsolved_steps").sum(dtype=np.uint64)
        np.testing.assert_allclose(summary.means[:, 0], content.episodes.grid("objective").mean(axis=1))


def test_totals_are_of_one_trial_or_of_all(two_trials: tuple[Store, list[Generation]]) -> None:
    store, (first, second, other) = two_trials
    of_run, of_trial, of_none = store.totals(), store.totals(0), store.totals(9)
    assert (of_run.generations, of_run.individuals, of_run.genomes, of_run.episodes) == (3, 12, 11, 24)
    assert (of_trial.generations, of_trial.individuals, of_trial.genomes, of_trial.episodes) == (2, 8, 7, 16)
    assert of_run.seconds == pytest.approx(sum(one.episodes.seconds for one in (first, second, other)))
    assert dataclasses.astuple(of_none) == (0, 0, 0, 0, 0, 0, 0, 0.0, 0)


# ---- one writer ------------------------------------------------------------------------------------------------------


def test_a_second_writer_is_told_who_is_the_first(store: Store) -> None:
    with pytest.raises(StoreError, match=f"process {os.getpid()} on .* is writing it; wait for that, or stop it"):
        Store.open(store.folder, readonly=False)


def test_the_next_writer_may_come_when_the_first_is_gone(store: Store) -> None:
    store.close()
    with Store.open(store.folder, readonly=False) as again:
        again.append(0, 0, generation(), "{}")


def test_a_killed_writer_keeps_nobody_out(tmp_path: Path) -> None:
    folder = tmp_path / "run"

    def write_and_die() -> None:
        with make(folder) as store:
            store.append(0, 0, generation(), encode_state({"after": 0}))
            os.kill(os.getpid(), signal.SIGKILL)

    assert in_child(write_and_die) == -signal.SIGKILL
    assert (folder / LOCK_FILE).exists()
    with Store.open(folder) as reader:
        assert_equal(reader.generation(0, 0), generation())
        assert reader.left_by.startswith("process ")
        left_by = reader.left_by
    with Store.open(folder, readonly=False) as writer:
        assert writer.left_by == left_by
        with Store.open(folder) as reader:
            assert reader.left_by == ""  # somebody writes
        assert writer.state(0) == {"after": 0}
        writer.append(0, 1, generation(seed=1), "{}")


def test_a_writer_that_closed_its_run_is_not_told(store: Store) -> None:
    store.close()
    for readonly in (True, False):
        with Store.open(store.folder, readonly=readonly) as again:
            assert again.left_by == ""


def test_a_reader_that_looks_at_the_lock_keeps_no_writer_out(store: Store) -> None:
    store.close()
    looking = os.open(store.folder / LOCK_FILE, os.O_RDONLY | os.O_CREAT)
    fcntl.flock(looking, fcntl.LOCK_SH)
    threading.Timer(0.05, os.close, [looking]).start()
    with Store.open(store.folder, readonly=False):
        pass


def test_a_writer_killed_within_a_transaction_leaves_the_one_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "run"

    def die_in_the_end(statement: str) -> None:
        if statement.startswith("REPLACE INTO optimiser"):
            os.kill(os.getpid(), signal.SIGKILL)

    def die_while_writing() -> None:
        connections = remember_connections(monkeypatch)
        with make(folder) as store:
            store.append(0, 0, generation(), encode_state({"after": 0}))
            connections[-1].set_trace_callback(die_in_the_end)
            store.append(0, 1, generation(5000, seed=1), encode_state({"after": 1}))

    assert in_child(die_while_writing) == -signal.SIGKILL
    with Store.open(folder, readonly=False) as store:
        assert store.generations(0) == 1
        assert store.totals().genomes == 4
        store.append(0, 1, generation(seed=1), "{}")


def test_the_lock_of_a_file_that_was_removed_is_not_taken(store: Store) -> None:
    """Somebody waits at the lock's file while its owner removes it; the lock to be had is the new file's."""
    path = store.folder / LOCK_FILE
    stale = os.open(path, os.O_RDWR)
    store.close()
    with Store.open(store.folder, readonly=False):
        fcntl.flock(stale, fcntl.LOCK_EX | fcntl.LOCK_NB)
        with pytest.raises(StoreError, match="is writing it"):
            Store.open(store.folder, readonly=False)
    os.close(stale)


def test_folders_with_links_to_one_database_have_one_writer(store: Store, tmp_path: Path) -> None:
    """Case 12: the lock lay beside the link."""
    store.close()
    linked = tmp_path / "linked"
    linked.mkdir()
    for name in (CONFIG_FILE, PROVENANCE_FILE, DATABASE_FILE):
        (linked / name).symlink_to(store.folder / name)
    for one, other in ((store.folder, linked), (linked, store.folder)):
        with Store.open(one, readonly=False), pytest.raises(StoreError, match="is writing it"):
            Store.open(other, readonly=False)
    with Store.open(linked, readonly=False) as longer:
        longer.replace_config("seed: 2\n")
    assert (linked / CONFIG_FILE).is_symlink()
    assert (store.folder / CONFIG_FILE).read_text() == "seed: 2\n"
    assert not (linked / LOCK_FILE).exists()


def test_databases_in_one_place_have_a_lock_each(tmp_path: Path) -> None:
    """Case 12."""
    with ExitStack() as opened:
        for name in ("a.sqlite", "b.sqlite", "b.lock"):
            make(tmp_path / name[::-1]).close()
            database = tmp_path / name[::-1] / DATABASE_FILE
            database.rename(tmp_path / name)
            database.symlink_to(tmp_path / name)
            opened.enter_context(Store.open(database.parent, readonly=False)).append(0, 0, generation(), "{}")
    assert {path.name for path in tmp_path.iterdir() if path.is_file()} == {"a.sqlite", "b.sqlite", "b.lock"}


def test_readers_and_the_writer_do_not_wait_for_each_other(connections: Connections, store: Store) -> None:
    store.append(0, 0, generation(), "{}")
    with Store.open(store.folder) as reader:
        cursor = connections[-1].execute("SELECT * FROM episode")
        cursor.fetchone()  # the reader is in the middle of its reading
        store.append(0, 1, generation(seed=1), "{}")
        assert len(cursor.fetchall()) == 7  # and sees what was there when it began
        assert reader.generations(0) == 2
        store.close()  # the journal stays until the reader is gone
    with Store.open(store.folder) as reader:
        assert reader.generations(0) == 2


def test_a_reader_cannot_write(store: Store) -> None:
    with Store.open(store.folder) as reader, pytest.raises(StoreError, match="opened to be read only"):
        reader.append(0, 0, generation(), "{}")


def test_where_nothing_can_be_mapped_the_rollback_journal_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, connections: Connections
) -> None:
    """Case 56: SQLite takes WAL for chosen there, and the next transaction fails."""

    def refuse(*_: object) -> None:
        raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))

    monkeypatch.setattr(mmap, "mmap", refuse)
    with make(tmp_path / "run") as store:
        store.append(0, 0, generation(), "{}")
        assert connections[-1].execute("PRAGMA journal_mode").fetchone() == ("delete",)
        with Store.open(store.folder) as reader:
            assert_equal(reader.generation(0, 0), generation())


@pytest.mark.parametrize("code", [errno.ENOSYS, errno.ENOTSUP, errno.ENOLCK])
def test_a_file_system_without_locks_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int) -> None:
    """Case 56: it was "Function not implemented"."""

    def refuse(*_: object) -> None:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(fcntl, "flock", refuse)
    with pytest.raises(StoreError, match=r"^[^\n]*run: expected a file system with locks \(flock\)"):
        make(tmp_path / "run")
    assert list(tmp_path.iterdir()) == []


# ---- folders that are not as they should be --------------------------------------------------------------------------


@pytest.fixture
def folder(store: Store) -> Path:
    """A closed run of three generations."""
    for number in range(3):
        store.append(0, number, generation(200, seed=number), "{}")
    store.close()
    return store.folder


def assert_refused(folder: Path, match: str, readonly: bool) -> None:
    before = (folder / DATABASE_FILE).read_bytes()
    with pytest.raises(StoreError, match=match) as error:
        Store.open(folder, readonly=readonly)
    assert "\n" not in str(error.value)
    assert (folder / DATABASE_FILE).read_bytes() == before
    assert not (folder / LOCK_FILE).exists()


@pytest.mark.parametrize("readonly", [True, False])
def test_a_folder_that_is_no_run_is_refused(tmp_path: Path, readonly: bool) -> None:
    for path in (tmp_path, tmp_path / "nowhere"):
        with pytest.raises(StoreError, match=r"expected a run folder, but there is no run\.sqlite in it"):
            Store.open(path, readonly=readonly)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("readonly", [True, False])
@pytest.mark.parametrize(
    ("version", "advice"), [(VERSIONS[-1] + 1, "a newer swarmevo"), (SCHEMA_VERSION - 1, "an older swarmevo")]
)
def test_another_schema_is_refused(folder: Path, version: int, advice: str, readonly: bool) -> None:
    _execute(folder, f"PRAGMA user_version = {version}")
    assert_refused(folder, f"expected schema version 4 to 7, got {version}; use {advice}", readonly)


@pytest.mark.parametrize("readonly", [True, False])
def test_a_run_of_the_version_with_descriptors_has_some(folder: Path, readonly: bool) -> None:
    _execute(folder, f"PRAGMA user_version = {SCHEMA_VERSION + DESCRIBED}")
    assert_refused(folder, "expected descriptors in a run of schema version 5, got 0 of them", readonly)


@pytest.mark.parametrize("readonly", [True, False])
def test_a_run_of_the_version_with_successes_has_their_table(folder: Path, readonly: bool) -> None:
    _execute(folder, f"PRAGMA user_version = {SCHEMA_VERSION + SUCCEEDING}")
    assert_refused(folder, "expected the tables of a run", readonly)


@pytest.mark.parametrize("readonly", [True, False])
def test_another_database_is_refused(folder: Path, readonly: bool) -> None:
    _execute(folder, "PRAGMA application_id = 0")
    assert_refused(folder, "is not a run of swarmevo", readonly)


@pytest.mark.parametrize("readonly", [True, False])
@pytest.mark.parametrize("content", [b"", b"no database", bytes(range(256)) * 64])
def test_what_is_no_database_is_refused(folder: Path, content: bytes, readonly: bool) -> None:
    (folder / DATABASE_FILE).write_bytes(content)
    assert_refused(folder, "no(t a)? run of swarmevo", readonly)


@pytest.mark.parametrize("readonly", [True, False])
def test_a_folder_whose_making_was_cut_short_is_refused(folder: Path, readonly: bool) -> None:
    _execute(folder, "DELETE FROM run")
    assert_refused(folder, "is incomplete", readonly)


def test_a_damaged_database_is_not_written(folder: Path) -> None:
    _damage(folder)
    assert_refused(folder, "is damaged", readonly=False)


def test_reading_a_damaged_database_is_one_line(folder: Path) -> None:
    _damage(folder)
    with Store.open(folder) as store, pytest.raises(StoreError, match="is damaged; restore it from a copy"):
        store.individuals()


def test_a_truncated_database_is_refused(folder: Path) -> None:
    path = folder / DATABASE_FILE
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert_refused(folder, "is damaged", readonly=False)


@pytest.mark.parametrize(
    ("statement", "told"),
    [
        ("UPDATE optimiser SET state = '{\"after\": 1}'", "the optimiser's state of trial 0"),
        ("UPDATE optimiser SET generation = 1", "the optimiser's state of trial 0"),
        ("UPDATE episode SET hash = hash + 1 WHERE (generation, individual, repeat) = (1, 7, 0)", "generation 1 of"),
        ("UPDATE episode SET push_time = NULL WHERE generation = 2", "generation 2 of trial 0"),
        ("UPDATE episode SET session = 2 WHERE generation = 2", "generation 2 of trial 0"),
        ("UPDATE genome SET sha256 = randomblob(32) WHERE id = 300", "generation 1 of trial 0"),
        ("UPDATE generation SET number = 3 WHERE number = 2", "generation 2 of trial 0"),
        ("UPDATE session SET provenance = '{}'", "the provenance of session 1"),
    ],
)
def test_what_is_not_as_it_was_stored_is_refused_where_it_is_read(folder: Path, statement: str, told: str) -> None:
    """Cases 3 and 4: a checksum over all of a generation, and one over each state, that every reader checks."""
    _execute(folder, statement)
    for read in (Store.state, Store.totals, Store.individuals, lambda store, trial: store.generation(trial, 0)):
        with Store.open(folder) as store, pytest.raises(StoreError, match=f"is damaged: {told}") as error:
            read(store, 0)
        assert "\n" not in str(error.value)
    assert_refused(folder, "is damaged", readonly=False)


@pytest.mark.parametrize("readonly", [True, False])
@pytest.mark.parametrize(
    "statement", ["UPDATE run SET seed = seed - 1", "UPDATE objective SET high = 3.0", "UPDATE run SET robots = 2"]
)
def test_a_run_with_another_seed_or_range_is_refused(folder: Path, statement: str, readonly: bool) -> None:
    """Case 3."""
    _execute(folder, statement)
    assert_refused(folder, "is damaged: what is known of the whole run is not as it was stored", readonly)


def test_a_genome_that_was_changed_is_refused_where_it_is_read(folder: Path) -> None:
    """Case 4: each genome has its SHA-256; whoever reads no genes need not read them all."""
    _execute(folder, "UPDATE genome SET genes = zeroblob(40) WHERE id = 7")
    with Store.open(folder) as store:
        assert store.totals().genomes == 600
        assert store.genome(8).any()
        for read in (lambda: store.genome(7), lambda: store.generation(0, 0)):
            with pytest.raises(StoreError, match="is damaged: genome 7 is not as it was stored"):
                read()
        assert store.damage() == ["genome 7"]


def test_checksums_have_no_sign_of_zero(store: Store) -> None:
    """SQLite stores -0.0 as 0."""
    content = generation()
    content.episodes["objective"][:] = -0.0
    store.append(0, 0, content, "{}")
    store.close()
    with Store.open(store.folder) as again:
        assert again.damage() == []
        assert not again.individuals().objectives.any()


@pytest.mark.parametrize("readonly", [True, False])
def test_a_run_whose_configuration_was_changed_is_refused(folder: Path, readonly: bool) -> None:
    """Case 54: nobody reads a configuration that is not the run's."""
    (folder / CONFIG_FILE).write_text("seed: 2\n")
    assert_refused(folder, r"config\.yaml: was changed since the run began; undo that, or restore it", readonly)
    (folder / CONFIG_FILE).unlink()
    assert_refused(folder, r"config\.yaml: No such file", readonly)


@pytest.mark.parametrize("readonly", [True, False])
@pytest.mark.parametrize(
    ("statement", "named"),
    [
        ("CREATE VIEW evil AS SELECT 1", "view 'evil'"),
        ("CREATE TRIGGER evil AFTER INSERT ON generation BEGIN DELETE FROM episode; END", "trigger 'evil'"),
        ("CREATE INDEX evil ON episode (hash)", "index 'evil'"),
        ("CREATE TABLE evil (a)", "table 'evil'"),
        ("DROP TABLE session", "table 'session'"),
        ("ALTER TABLE episode DROP COLUMN push_time", "table 'episode'"),
    ],
)
def test_other_tables_than_ours_are_refused(folder: Path, statement: str, named: str, readonly: bool) -> None:
    """Case 13."""
    with closing(sqlite3.connect(folder / DATABASE_FILE)) as database:  # foreign keys are off
        database.execute(statement)
    assert_refused(folder, f"{named} is missing, foreign or damaged", readonly)


@pytest.mark.parametrize("table", ["run", "objective", "session", "generation", "episode", "genome"])
def test_a_view_without_an_end_is_never_read(folder: Path, table: str) -> None:
    """Case 13: every command hung."""
    endless = "WITH RECURSIVE n (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i FROM n"
    with closing(sqlite3.connect(folder / DATABASE_FILE)) as database:
        database.execute("PRAGMA legacy_alter_table = ON")
        database.execute(f"ALTER TABLE {table} RENAME TO hidden")
        database.execute(f"CREATE VIEW {table} AS {endless}")
    for readonly in (True, False):
        with pytest.raises(StoreError, match="is missing, foreign or damaged"):
            Store.open(folder, readonly=readonly)


@pytest.mark.parametrize("number", [10**20, -(10**20), 2**63])
def test_a_number_that_is_too_large_is_just_not_there(folder: Path, number: int) -> None:
    """Case 66: it was called damage."""
    with Store.open(folder) as store:
        with pytest.raises(StoreError, match=f"there is no genome {number}"):
            store.genome(number)
        with pytest.raises(StoreError, match=f"there is no generation {number} of trial 0"):
            store.generation(0, number)
        with pytest.raises(StoreError, match=f"there is no generation 0 of trial {number}"):
            store.sessions(number, 0)
        assert store.totals(number).generations == 0


# ---- folders that are lost while they are written --------------------------------------------------------------------


@pytest.mark.parametrize("lost", ["deleted", "moved", "replaced", "folder deleted", "folder moved"])
def test_a_database_that_is_gone_is_noticed(store: Store, lost: str) -> None:
    """Cases 2 and 73: the operating system lets a process write a file that has no name any more."""
    store.append(0, 0, generation(), "{}")
    path, elsewhere = store.folder / DATABASE_FILE, store.folder.with_name("elsewhere")
    if lost == "deleted":
        path.unlink()
    elif lost == "moved":
        path.rename(elsewhere)
    elif lost == "replaced":
        shutil.copy(path, elsewhere)
        elsewhere.replace(path)
    elif lost == "folder deleted":
        shutil.rmtree(store.folder)
    else:
        store.folder.rename(elsewhere)
    told = r"run\.sqlite was deleted, moved or replaced while the run was writing it; if it was moved, resume it there$"
    for write in (store.append, store.keep):
        with pytest.raises(StoreError, match=told):
            write(
                0,
                1,
                *((generation(), "{}") if write == store.append else (generation().genomes, generation().episodes)),
            )
    store.close()
    if lost == "folder moved":
        with Store.open(elsewhere, readonly=False) as moved:
            assert_equal(moved.generation(0, 0), generation())
            moved.append(0, 1, generation(), "{}")


def test_a_folder_that_became_a_file_is_one_line(store: Store) -> None:
    """Case 2."""
    store.folder.rename(store.folder.with_name("elsewhere"))
    store.folder.write_text("")
    with pytest.raises(StoreError, match=r"run\.sqlite cannot be reached any more: Not a directory$"):
        store.append(0, 0, generation(), "{}")


def test_a_database_that_was_truncated_is_noticed(store: Store) -> None:
    """Case 2."""
    store.append(0, 0, generation(), "{}")
    os.truncate(store.folder / DATABASE_FILE, 20_000)
    with pytest.raises(StoreError, match=r"run\.sqlite was truncated while the run was writing it; restore it"):
        store.append(0, 1, generation(), "{}")


def test_the_lock_of_a_run_at_the_old_place_stays(store: Store) -> None:
    """Case 73: the folder was moved away, and another run was begun in its place."""
    store.folder.rename(store.folder.with_name("elsewhere"))
    with make(store.folder) as other:
        store.close()
        with pytest.raises(StoreError, match="is writing it"):
            Store.open(other.folder, readonly=False)


def test_the_database_alone_holds_all_generations(store: Store, tmp_path: Path) -> None:
    """Case 5: a killed run was copied without its write-ahead log."""
    store.append(0, 0, generation(), "{}")
    store.append(0, 1, generation(seed=1), "{}")
    third = generation(seed=2)
    store.keep(0, 2, third.genomes, third.episodes)
    assert Path(f"{store.folder / DATABASE_FILE}-wal").stat().st_size > 0
    copy = tmp_path / "copy"
    copy.mkdir()
    for name in (CONFIG_FILE, PROVENANCE_FILE, DATABASE_FILE):
        shutil.copy(store.folder / name, copy)
    with Store.open(copy) as found:
        assert found.generations(0) == 2
        assert_equal(found.generation(0, 1), generation(seed=1))
        assert len(found.in_flight(0, 2, third.genomes)) == 0


def test_a_reader_in_the_way_keeps_the_log_only_until_it_is_gone(
    connections: Connections, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 5."""
    monkeypatch.setattr("swarmevo.runs.store._PATIENCE", 0.0)
    log = Path(f"{store.folder / DATABASE_FILE}-wal")
    store.append(0, 0, generation(), "{}")
    assert log.stat().st_size == 0
    with Store.open(store.folder):
        cursor = connections[-1].execute("SELECT * FROM episode")
        cursor.fetchone()
        store.append(0, 1, generation(seed=1), "{}")
        assert log.stat().st_size > 0
        cursor.fetchall()
        content = generation(seed=2)
        store.keep(0, 2, content.genomes, content.episodes)
        assert log.stat().st_size == 0


def test_a_short_look_while_a_run_is_closed_leaves_one_file_all_the_same(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A dashboard looks once a second."""
    store.append(0, 0, generation(), "{}")
    reader, waited = Store.open(store.folder), []

    def wait(seconds: float) -> None:
        waited.append(seconds)
        if len(waited) == 2:
            reader.close()

    monkeypatch.setattr("swarmevo.runs.database.time.sleep", wait)
    assert reader.generations(0) == 1
    store.close()
    assert len(waited) == 2
    assert not Path(f"{store.folder / DATABASE_FILE}-wal").exists()


def test_a_run_that_was_killed_is_brought_into_its_database_when_it_goes_on(tmp_path: Path) -> None:
    """Case 5."""

    def write_and_die() -> None:
        with make(tmp_path / "run") as store:
            store._settle_wal = lambda patience: os.kill(os.getpid(), signal.SIGKILL)  # type: ignore[method-assign]
            store.append(0, 0, generation(), "{}")

    assert in_child(write_and_die) == -signal.SIGKILL
    log = Path(f"{tmp_path / 'run' / DATABASE_FILE}-wal")
    assert log.stat().st_size > 0
    with Store.open(tmp_path / "run", readonly=False) as store:
        assert store.generations(0) == 1
        assert log.stat().st_size == 0


def test_a_full_disk_costs_one_generation(connections: Connections, store: Store) -> None:
    store.append(0, 0, generation(), "{}")
    disk = connections[-1]
    (pages,) = disk.execute("PRAGMA page_count").fetchone()
    disk.execute(f"PRAGMA max_page_count = {pages}")
    with pytest.raises(StoreError, match="the disk is full; free some space, then go on"):
        store.append(0, 1, generation(500, seed=1), "{}")
    disk.execute("PRAGMA max_page_count = 1000000")
    assert store.generations(0) == 1
    store.append(0, 1, generation(500, seed=1), "{}")


def test_a_folder_that_is_read_only_can_be_read(folder: Path) -> None:
    def look() -> None:
        with Store.open(place) as store:
            assert_equal(store.generation(0, 0), generation(200))
        with pytest.raises(StoreError, match=r"is not writable|Permission denied"):
            Store.open(place, readonly=False)
        with pytest.raises(StoreError, match="Permission denied"):
            make(place.parent / "other")

    with tempfile.TemporaryDirectory() as parent:
        place = Path(parent) / "run"
        folder.rename(place)
        for path in (*place.iterdir(), place, Path(parent)):
            path.chmod(0o555 if path.is_dir() else 0o444)
        try:
            assert in_child(lambda: _as_nobody(look)) == 0
        finally:
            place.chmod(0o755)
            Path(parent).chmod(0o755)


def _as_nobody(action: Callable[[], None]) -> None:
    """Run ``action`` without the right to ignore permissions."""
    if os.geteuid() == 0:
        os.setuid(65534)
    action()


def _execute(folder: Path, statement: str) -> None:
    database = sqlite3.connect(folder / DATABASE_FILE)
    with database:
        database.execute(statement)
    database.close()


def _damage(folder: Path) -> None:
    """Overwrite the second half of the database, but not its header and schema."""
    path = folder / DATABASE_FILE
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2] + b"\x5a" * (len(content) - len(content) // 2))


# ---- the optimiser's state -------------------------------------------------------------------------------------------


def test_a_state_comes_back_as_it_was() -> None:
    state = {
        "rng": np.random.default_rng(5).bit_generator.state,
        "mersenne": np.random.Generator(np.random.MT19937(3)).bit_generator.state,
        "big": -(2**200),
        "floats": [0.1, -0.0, 5e-324, 1e308, float("inf")],
        "text": '\u00e4\n"',
        "nothing": None,
        "yes": True,
        "nested": [{"a": [np.arange(3)]}],
        "arrays": {
            "empty": np.empty((0, 4)),
            "scalar": np.array(7),
            "flags": np.array([True, False]),
            "small": np.arange(6, dtype=np.int8).reshape(2, 3),
            "fortran": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
            "big-endian": np.arange(3, dtype=">f4"),
            "nan": np.array([np.nan, -np.inf, -0.0]),
        },
    }
    back = decode_state(encode_state(state))
    _assert_same(back, state)
    assert back["arrays"]["nan"].tobytes() == state["arrays"]["nan"].tobytes()  # type: ignore[index]
    assert np.signbit(back["floats"][1])
    back["arrays"]["small"][0, 0] = 1  # ours to write


def _assert_same(a: Any, b: Any) -> None:
    if isinstance(b, dict):
        assert list(a) == list(b)
        for key in b:
            _assert_same(a[key], b[key])
    elif isinstance(b, list):
        assert len(a) == len(b)
        for left, right in zip(a, b, strict=True):
            _assert_same(left, right)
    elif isinstance(b, np.ndarray):
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)
    else:
        assert type(a) is type(b)
        assert a == b


def test_a_state_s_numpy_numbers_become_plain_ones() -> None:
    back = decode_state(encode_state({"i": np.int64(2**62), "f": np.float64(0.1), "b": np.bool_(True)}))
    assert back == {"i": 2**62, "f": 0.1, "b": True}


@pytest.mark.parametrize(
    ("state", "told"),
    [
        ({"a": {"b": [1, {2}]}}, r"state\['a'\]\['b'\]\[1\]: expected a number, .* got set"),
        ({"a": {1: 2}}, r"state\['a'\]: expected strings as keys"),
        ({"dtype": 0, "shape": 0, "base64": 0}, "state: expected strings as keys, other than those of an array"),
        ({"a": np.array([None])}, r"state\['a'\]: expected an array of numbers, got dtype object"),
        ({"a": b"bytes"}, r"state\['a'\]: .* got bytes"),
        ([1], "expected a mapping, got list"),
    ],
)
def test_a_state_that_cannot_be_stored_is_refused_with_its_place(state: Any, told: str) -> None:
    with pytest.raises(TypeError, match=told):
        encode_state(state)


@pytest.mark.parametrize("text", ["", "[1]", '{"a": {"dtype": "<f8", "shape": [2], "base64": "AAAA"}}'])
def test_text_that_is_no_state_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r".+"):
        decode_state(text)

# SPDX-License-Identifier: BSD-3-Clause
"""The file of a run's tests: its tables, opening it, and whether it is as it was stored.

What is stored of a test is found by what decides it: the controller's genome, the world, and the key of the episode.
Hence tests add up, whoever asked for them, and none is run twice.

Its tables (``PRAGMA user_version`` is their version):

- ``run``, one row: ``origin``, the SHA-256 of the provenance of the run's first session: whose tests these are; and its
  ``sha256``.
- ``session``: as in ``run.sqlite``: with what tests were run.
- ``world``: ``id``, ``changes``: as JSON, each key of the world that is not as in the run's configuration, with its
  value; ``{}`` is the run's own world; ``sha256`` of these.
- ``tested``: ``id``, ``kind`` (``episode``, ``census``), ``world``, ``trial``, SHA-256 of the ``genome``, ``count`` of
  its rows in ``test``; ``sha256`` of these.
- ``test``: ``tested``, ``repeat``, ``session`` that ran it, ``content`` as JSON, ``sha256`` of these. The content of an
  episode is why it failed, or null, then the cells of ``COLUMNS`` (``evolution/results.py``); that of a census the
  share of robots with each label, then pairs of a fitness function's label and its share. Random streams are keyed by
  (seed of the run, trial, ``GENERATION``, repeat).
"""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

from swarmevo.errors import StoreError
from swarmevo.runs import checksums
from swarmevo.runs.database import check_tables, open_database, schema_of

TESTS_FILE: Final = "tests.sqlite"
LOCK_FILE: Final = "tests.lock"
TESTS_VERSION: Final = 2
"""Of the tables; a file with another one is refused."""
TESTS_APPLICATION: Final = 0x53574554
"""``SWET``: tells tests from any other SQLite file."""

TABLES: Final = f"""
PRAGMA application_id = {TESTS_APPLICATION};
PRAGMA user_version = {TESTS_VERSION};
CREATE TABLE run (
    origin TEXT NOT NULL,
    sha256 BLOB NOT NULL
) STRICT;
CREATE TABLE session (
    id INTEGER PRIMARY KEY,
    provenance TEXT NOT NULL,
    sha256 BLOB NOT NULL
) STRICT;
CREATE TABLE world (
    id INTEGER PRIMARY KEY,
    changes TEXT NOT NULL UNIQUE,
    sha256 BLOB NOT NULL
) STRICT;
CREATE TABLE tested (
    id INTEGER PRIMARY KEY,
    kind TEXT NOT NULL,
    world INTEGER NOT NULL REFERENCES world (id),
    trial INTEGER NOT NULL,
    genome BLOB NOT NULL,
    count INTEGER NOT NULL,
    sha256 BLOB NOT NULL,
    UNIQUE (kind, world, trial, genome)
) STRICT;
CREATE TABLE test (
    tested INTEGER NOT NULL REFERENCES tested (id),
    repeat INTEGER NOT NULL,
    session INTEGER NOT NULL REFERENCES session (id),
    content TEXT NOT NULL,
    sha256 BLOB NOT NULL,
    PRIMARY KEY (tested, repeat)
) STRICT, WITHOUT ROWID;
"""
_TESTED: Final = "SELECT id, kind, world, trial, genome, count, sha256 FROM tested"


def open_tests(file: Path, readonly: bool, to_forget: bool) -> sqlite3.Connection:
    """Open the tests that are there, or a copy of them to forget; where there are none, room for some."""
    if not file.exists():
        return in_memory()
    database = open_database(file, readonly, lambda found: _check_schema(file, found))
    if not to_forget and (schema_of(database) or not readonly):
        return database
    with contextlib.closing(database):
        copy = in_memory()
        database.backup(copy)
        return copy


def in_memory() -> sqlite3.Connection:
    """Return room for tests that are forgotten when it is closed."""
    return sqlite3.connect(":memory:", isolation_level=None)


def create(database: sqlite3.Connection, origin: str) -> None:
    """Make the tables for the tests of a run."""
    database.executescript(f"BEGIN; {TABLES}")
    database.execute("INSERT INTO run VALUES (?, ?)", (origin, checksums.of_rows([[origin]])))
    database.execute("COMMIT")


def _check_schema(file: Path, database: sqlite3.Connection) -> None:
    if not schema_of(database):
        return  # just made, or its maker was killed
    (application,) = database.execute("PRAGMA application_id").fetchone()
    (version,) = database.execute("PRAGMA user_version").fetchone()
    if application != TESTS_APPLICATION:
        raise StoreError(f"{file}: expected tests of swarmevo, got another SQLite file; move it away")
    if version != TESTS_VERSION:
        needed = "a newer" if version > TESTS_VERSION else "an older"
        raise StoreError(
            f"{file}: expected version {TESTS_VERSION}, got {version}; use {needed} swarmevo, or move it away"
        )
    check_tables(database, TABLES, f"{file}: expected the tables of tests")


# ---- whether it is as it was stored ----------------------------------------------------------------------------------


def broken(database: sqlite3.Connection, origin: str) -> Iterator[str]:
    """Yield what is not as it was stored and more than some tests, in words; ``origin``: of the run."""
    if database.execute("PRAGMA integrity_check(1)").fetchall() != [("ok",)]:
        yield "its structure"
        return
    if database.execute("SELECT * FROM run").fetchall() != [(origin, checksums.of_rows([[origin]]))]:
        yield "whose tests these are"
    for id, text, digest in database.execute("SELECT id, provenance, sha256 FROM session ORDER BY id"):
        if digest != checksums.of_rows([[text]]):
            yield f"the provenance of session {id}"
    for id, changes, digest in database.execute("SELECT id, changes, sha256 FROM world ORDER BY id"):
        if digest != checksums.of_rows([[id, changes]]):
            yield f"world {id}"


def is_of_another(database: sqlite3.Connection, origin: str) -> bool:
    """Whether these are sound tests of another run than that of ``origin``."""
    rows = database.execute("SELECT origin, sha256 FROM run").fetchall()
    return any(found != origin and digest == checksums.of_rows([[found]]) for found, digest in rows)


def damaged_tests(database: sqlite3.Connection) -> Iterator[tuple[int, str]]:
    """Yield which tests are not as they were stored: an id of ``tested``, and what it is in words."""
    counts: dict[int, int] = {}
    damaged = set()
    for *row, digest in database.execute("SELECT tested, repeat, session, content, sha256 FROM test"):
        counts[row[0]] = counts.get(row[0], 0) + 1
        if digest != checksums.of_rows([row]):
            damaged.add(row[0])
    for *row, digest in database.execute(_TESTED):
        id, _, _, trial, _, count = row
        if digest != checksums.of_rows([row]):
            yield id, f"whose tests are those with the id {id}"
        elif counts.pop(id, 0) != count or id in damaged:
            yield id, f"a test of trial {trial}, of those with the id {id},"
    yield from ((id, f"whose tests are those with the id {id}") for id in counts)


def drop_damaged(database: sqlite3.Connection, ids: Iterable[int]) -> int:
    """Drop what is damaged of the tests with some ids of ``tested``, in a transaction; return how many are gone."""
    gone = 0
    for id in dict.fromkeys(ids):
        tested = database.execute(f"{_TESTED} WHERE id = ?", (id,)).fetchall()
        sound = [digest == checksums.of_rows([row]) for *row, digest in tested] == [True]
        rows = database.execute("SELECT tested, repeat, session, content, sha256 FROM test WHERE tested = ?", (id,))
        stored = rows.fetchall()
        bad = [row[1] for *row, digest in stored if not sound or digest != checksums.of_rows([row])]
        database.executemany("DELETE FROM test WHERE tested = ? AND repeat = ?", [(id, repeat) for repeat in bad])
        if sound:
            gone += max(0, tested[0][5] - len(stored)) + len(bad)
            count(database, [id])
        else:
            gone += len(bad)
            database.execute("DELETE FROM tested WHERE id = ?", (id,))
    return gone


def count(database: sqlite3.Connection, ids: Iterable[int]) -> None:
    """Write down how many tests with some ids of ``tested`` there are, in a transaction."""
    for id in ids:
        database.execute("UPDATE tested SET count = (SELECT COUNT(*) FROM test WHERE tested = id) WHERE id = ?", (id,))
        row = database.execute(f"{_TESTED} WHERE id = ?", (id,)).fetchone()[:-1]
        database.execute("UPDATE tested SET sha256 = ? WHERE id = ?", (checksums.of_rows([row]), id))

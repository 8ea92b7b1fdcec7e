# SPDX-License-Identifier: BSD-3-Clause
"""Opening a run's database, and what to say when it fails."""

from __future__ import annotations

import contextlib
import json
import mmap
import os
import re
import sqlite3
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple
from urllib.parse import quote

from swarmevo.errors import OutputError, StoreError
from swarmevo.evolution.results import Sizes
from swarmevo.protocols import Descriptor, Objective
from swarmevo.runs import checksums
from swarmevo.runs.files import refusal
from swarmevo.runs.schema import (
    APPLICATION_ID,
    SCHEMA_VERSION,
    VERSIONS,
    has_descriptors,
    has_successes,
    tables,
    version_of,
)

DATABASE_FILE: Final = "run.sqlite"

RUN: Final = "SELECT seed, robots, config_sha256, next_config_sha256, sha256 FROM run"
OBJECTIVES: Final = "SELECT name, direction, low, high, basis FROM objective ORDER BY number"
DESCRIPTORS: Final = "SELECT name, low, high FROM descriptor ORDER BY number"
SUCCESSES: Final = "SELECT objective, value FROM success ORDER BY objective"

_PAGE_SIZE: Final = 16384  # [bytes]: six of the paper's genomes; of the usual 4 KiB one would leave a third empty
_LONGEST_PATH: Final = 504  # [bytes] that SQLite takes
_GLANCE_SECONDS: Final = 0.01
_BUSY_SECONDS: Final = 30.0  # longer than any transaction takes


def create_database(
    path: Path,
    config_sha256: str,
    provenance: Mapping[str, Any],
    objectives: Sequence[Objective],
    robots: int,
    seed: int,
    descriptors: Sequence[Descriptor] = (),
) -> None:
    """Make the database of a new run, which has no generation yet.

    Args:
        path: Of the file to make.
        config_sha256: Of the resolved configuration.
        provenance: Of the first session.
        objectives: In the order of the objectives' axis.
        robots: In the team.
        seed: Of everything random in the run.
        descriptors: In the order of the descriptors' axis.
    """
    sizes = Sizes(len(objectives), robots, len(descriptors))
    successes = [(k, o.success) for k, o in enumerate(objectives) if o.success is not None]
    with contextlib.closing(sqlite3.connect(_place(path), isolation_level=None)) as database:
        database.execute(f"PRAGMA page_size = {_PAGE_SIZE}")
        database.executescript(f"BEGIN; {tables(sizes, bool(successes))}")
        database.executemany(
            "INSERT INTO objective VALUES (?, ?, ?, ?, ?, ?)",
            [(k, o.name, o.direction, *o.range, o.of) for k, o in enumerate(objectives)],
        )
        if successes:
            database.executemany("INSERT INTO success VALUES (?, ?)", successes)
        if descriptors:
            rows = [(k, one.name, *one.range) for k, one in enumerate(descriptors)]
            database.executemany("INSERT INTO descriptor VALUES (?, ?, ?, ?)", rows)
        insert_session(database, provenance)
        database.execute("INSERT INTO run VALUES (?, ?, ?, NULL, x'')", (seed, robots, config_sha256))
        seal_run(database)
        database.execute("COMMIT")


def insert_session(database: sqlite3.Connection, provenance: Mapping[str, Any]) -> None:
    """Insert a session; its id is the next."""
    text = json.dumps(provenance)
    database.execute("INSERT INTO session (provenance, sha256) VALUES (?, ?)", (text, checksums.of_rows([[text]])))


class Measured(NamedTuple):
    """What is measured in a run, as rows."""

    objectives: list[tuple[Any, ...]]
    """Of :data:`OBJECTIVES`."""
    successes: list[tuple[Any, ...]]
    """Of :data:`SUCCESSES`, of which there may be none."""
    descriptors: list[tuple[Any, ...]]
    """Of :data:`DESCRIPTORS`, likewise."""


def measured(database: sqlite3.Connection) -> Measured:
    """Return what is measured in a run."""
    (version,) = database.execute("PRAGMA user_version").fetchone()
    return Measured(
        database.execute(OBJECTIVES).fetchall(),
        database.execute(SUCCESSES).fetchall() if has_successes(version) else [],
        database.execute(DESCRIPTORS).fetchall() if has_descriptors(version) else [],
    )


def seal_run(database: sqlite3.Connection) -> None:
    """Give what is known of the whole run its checksum."""
    *run, _ = database.execute(RUN).fetchone()
    database.execute("UPDATE run SET sha256 = ?", (checksums.of_run(run, *measured(database)),))


# ---- opening ---------------------------------------------------------------------------------------------------------


_NEEDS_RECOVERY: Final = ("SQLITE_READONLY_ROLLBACK", "SQLITE_READONLY_RECOVERY")


def connect(folder: Path, readonly: bool) -> sqlite3.Connection:
    """Open the database of a run folder.

    Raises:
        StoreError: It is not writable, no run of swarmevo, or of another schema version.
    """
    return open_database(folder / DATABASE_FILE, readonly, lambda database: _check_schema(folder, database))


def open_database(path: Path, readonly: bool, check: Callable[[sqlite3.Connection], None]) -> sqlite3.Connection:
    """Open a database that is there.

    Args:
        path: Of its file.
        readonly: Only read.
        check: Refuses what is not one of ours, before anything else is read.

    Raises:
        StoreError: It is not writable, or ``check`` refused it.
    """
    place = _place(path)
    if not readonly and not os.access(path, os.W_OK):  # SQLite would open it all the same, to be read only
        raise StoreError(f"{path}: is not writable")
    # mode=rw never makes a file; isolation_level=None leaves the transactions to us.
    uri = f"file:{quote(os.fsencode(place))}?mode={'ro' if readonly else 'rw'}"
    database = sqlite3.connect(uri, uri=True, isolation_level=None, timeout=_BUSY_SECONDS)
    try:
        database.execute("PRAGMA trusted_schema = OFF")  # a run may come from a stranger
        check(database)
    except sqlite3.OperationalError as error:
        database.close()
        if not readonly or _errorname(error) not in _NEEDS_RECOVERY:
            raise
        open_database(path, False, check).close()  # rolls back what a killed writer left half done
        return open_database(path, readonly, check)
    except BaseException:
        database.close()
        raise
    return database


def _place(path: Path) -> str:
    """Return where a database lies, which SQLite must be able to name.

    Raises:
        StoreError: The path is too long.
    """
    place = os.path.realpath(path)
    size, name = len(os.fsencode(place)), len(os.fsencode(os.path.basename(place))) + 1
    if size > _LONGEST_PATH:
        raise StoreError(
            f"{path.parent}: expected a run folder whose whole path has at most {_LONGEST_PATH - name} bytes, which is "
            f"what SQLite takes, got {size - name}; choose a shorter one"
        )
    return place


def prepare_to_write(folder: Path, database: sqlite3.Connection) -> None:
    """Choose how transactions are made, and what is checked in them."""
    # WAL: a reader never makes the writer wait.
    if _can_map(Path(_place(folder / DATABASE_FILE)).parent):
        with contextlib.suppress(sqlite3.OperationalError):
            database.execute("PRAGMA journal_mode = WAL")
    database.execute(RUN).fetchall()  # SQLite empties no log before something was read
    database.execute("PRAGMA foreign_keys = ON")  # off by default


def _can_map(folder: Path) -> bool:
    """Return whether files in a folder can be mapped for several processes; SQLite finds out in a transaction only."""
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            file.truncate(mmap.PAGESIZE)
            mmap.mmap(file.fileno(), mmap.PAGESIZE).close()
    except OSError:
        return False
    return True


def empty_wal(database: sqlite3.Connection, patience: float) -> bool:
    """Move what is in the write-ahead log into the database's file; return whether all of it is there now.

    Args:
        database: Open for writing.
        patience: How long to wait for readers [s].
    """
    database.execute(f"PRAGMA busy_timeout = {round(1000 * patience)}")
    busy, *_ = database.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()
    database.execute(f"PRAGMA busy_timeout = {round(1000 * _BUSY_SECONDS)}")
    return not busy


def leave_one_file(database: sqlite3.Connection, patience: float) -> None:
    """Do without a write-ahead log from here on.

    Args:
        database: Open for writing.
        patience: How long to wait for readers [s]; SQLite itself does not wait here.

    Raises:
        sqlite3.Error: Somebody reads it all the while.
    """
    database.execute("PRAGMA busy_timeout = 0")
    deadline = time.monotonic() + patience
    while True:
        try:
            database.execute("PRAGMA journal_mode = DELETE")
            return
        except sqlite3.OperationalError:
            if time.monotonic() >= deadline:
                raise
            time.sleep(_GLANCE_SECONDS)


def _check_schema(folder: Path, database: sqlite3.Connection) -> None:
    (application,) = database.execute("PRAGMA application_id").fetchone()
    (version,) = database.execute("PRAGMA user_version").fetchone()
    if application != APPLICATION_ID:
        raise StoreError(f"{folder}: {DATABASE_FILE} is not a run of swarmevo")
    if version not in VERSIONS:
        needed = "a newer" if version > SCHEMA_VERSION else "an older"
        raise StoreError(
            f"{folder}: expected schema version {VERSIONS[0]} to {VERSIONS[-1]}, got {version}; "
            f"use {needed} swarmevo for this run"
        )
    episode = next((str(sql) for _, name, _, sql in schema_of(database) if name == "episode"), "")
    cells = ("objective", "homing_time", "descriptor")
    sizes = Sizes(*(len(re.findall(rf"^ +{cell}_\d+ ", episode, re.M)) for cell in cells))
    if version != version_of(sizes, has_successes(version)):
        raise StoreError(
            f"{folder}: expected {'' if has_descriptors(version) else 'no '}descriptors in a run of schema version "
            f"{version}, got {sizes.descriptors} of them; restore it from a copy"
        )
    check_tables(
        database, tables(sizes, has_successes(version)), f"{folder}: expected the tables of a run in {DATABASE_FILE}"
    )


def schema_of(database: sqlite3.Connection) -> list[tuple[str, str, str, str]]:
    """Return of each table, index, view and trigger that somebody made its kind, name, table and definition."""
    return database.execute("SELECT type, name, tbl_name, sql FROM sqlite_schema WHERE sql IS NOT NULL").fetchall()


def check_tables(database: sqlite3.Connection, definition: str, expectation: str) -> None:
    """Refuse other tables than ours before any is read: a view in place of one is a program, which need not end.

    Args:
        database: Just opened.
        definition: Of the tables, in SQL.
        expectation: What was expected where, in words: the message begins with it.

    Raises:
        StoreError: There are others.
    """
    found = schema_of(database)
    created = re.findall(r"^(CREATE TABLE (\w+) .*?);$", definition, re.M | re.S)
    expected = [("table", name, name, sql) for sql, name in created]
    if set(found) != set(expected):
        kind, name, *_ = min({*found} ^ {*expected}, key=repr)
        raise StoreError(
            f"{expectation} and nothing else, but its {kind} {name!r} is missing, foreign or damaged; restore it from "
            "a copy, or drop what was added"
        )


# ---- what went wrong -------------------------------------------------------------------------------------------------

ADVICE: Final = {
    "SQLITE_IOERR": "cannot be read or written; is the disk full or failing? Everything before is stored",
    "SQLITE_FULL": "the disk is full; free some space, then go on: everything before is stored",
    "SQLITE_READONLY": "is not writable",
    "SQLITE_NOTADB": "is damaged, or no run of swarmevo",
    "SQLITE_CORRUPT": "is damaged; restore it from a copy",
    "SQLITE_BUSY": "is in use by another process; wait for it, or stop it",
    "SQLITE_CANTOPEN": "cannot be opened; is the folder readable, and writable if the run was killed?",
}


def _errorname(error: sqlite3.Error) -> str:
    undecodable = isinstance(error, sqlite3.OperationalError)  # the one that SQLite itself does not raise
    return getattr(error, "sqlite_errorname", "SQLITE_CORRUPT" if undecodable else "")


def damaged(folder: Path, what: str) -> StoreError:
    """Return the error that says what is not as it was stored."""
    return StoreError(f"{folder / DATABASE_FILE}: is damaged: {what} is not as it was stored; restore it from a copy")


@contextlib.contextmanager
def explained(folder: Path, file: str = DATABASE_FILE) -> Iterator[None]:
    """Turn what SQLite, in a file of a run folder, and the file system report into a StoreError of one line."""
    try:
        yield
    except sqlite3.Error as error:
        code = "_".join(_errorname(error).split("_")[:2])  # without its extension
        advice = ADVICE.get(code, f"failed: {error}")
        raise StoreError(f"{folder / file}: {advice}") from error
    except UnicodeDecodeError as error:
        raise StoreError(f"{folder / file}: {ADVICE['SQLITE_CORRUPT']}") from error
    except OSError as error:
        raise StoreError(refusal(error, error.filename or folder)) from error
    except OutputError as error:
        raise StoreError(*error.errors) from error

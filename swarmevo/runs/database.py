# SPDX-License-Identifier: BSD-3-Clause
"""Opening a run's database, and what to say when it fails."""

from __future__ import annotations

import contextlib
import json
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from swarmevo.errors import StoreError
from swarmevo.protocols import Objective
from swarmevo.runs.schema import APPLICATION_ID, SCHEMA_VERSION, tables

DATABASE_FILE: Final = "run.sqlite"

_BUSY_SECONDS: Final = 30.0  # longer than any transaction takes


def create_database(
    path: Path,
    config_sha256: str,
    provenance: Mapping[str, Any],
    objectives: Sequence[Objective],
    robots: int,
    seed: int,
) -> None:
    """Make the database of a new run, which has no generation yet.

    Args:
        path: Of the file to make.
        config_sha256: Of the resolved configuration.
        provenance: Of the first session.
        objectives: In the order of the objectives' axis.
        robots: In the team.
        seed: Of everything random in the run.
    """
    with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as database:
        database.executescript(f"BEGIN; {tables(len(objectives), robots)}")
        database.execute("INSERT INTO run VALUES (?, ?, ?, NULL)", (seed, robots, config_sha256))
        database.execute("INSERT INTO session (provenance) VALUES (?)", (json.dumps(provenance),))
        database.executemany(
            "INSERT INTO objective VALUES (?, ?, ?, ?, ?)",
            [(k, o.name, o.direction, *o.range) for k, o in enumerate(objectives)],
        )
        database.execute("COMMIT")


# ---- opening ---------------------------------------------------------------------------------------------------------


_NEEDS_RECOVERY: Final = ("SQLITE_READONLY_ROLLBACK", "SQLITE_READONLY_RECOVERY")


def connect(folder: Path, readonly: bool) -> sqlite3.Connection:
    """Open the database of a run folder.

    Raises:
        StoreError: It is not writable, no run of swarmevo, or of another schema version.
    """
    path = folder / DATABASE_FILE
    if not readonly and not os.access(path, os.W_OK):  # SQLite would open it all the same, to be read only
        raise StoreError(f"{path}: is not writable")
    # mode=rw never makes a file; isolation_level=None leaves the transactions to us.
    uri = f"file:{quote(str(path.absolute()))}?mode={'ro' if readonly else 'rw'}"
    database = sqlite3.connect(uri, uri=True, isolation_level=None, timeout=_BUSY_SECONDS)
    try:
        database.execute("PRAGMA trusted_schema = OFF")  # a run may come from a stranger
        _check_schema(folder, database)
    except sqlite3.OperationalError as error:
        database.close()
        if not readonly or error.sqlite_errorname not in _NEEDS_RECOVERY:
            raise
        connect(folder, readonly=False).close()  # rolls back what a killed writer left half done
        return connect(folder, readonly)
    except BaseException:
        database.close()
        raise
    return database


def prepare_to_write(database: sqlite3.Connection) -> None:
    """Choose how transactions are made, and what is checked in them."""
    # WAL: a reader never makes the writer wait. Where the file system cannot, SQLite keeps its other journal.
    with contextlib.suppress(sqlite3.OperationalError):
        database.execute("PRAGMA journal_mode = WAL")
    database.execute("PRAGMA foreign_keys = ON")  # off by default


def _check_schema(folder: Path, database: sqlite3.Connection) -> None:
    (application,) = database.execute("PRAGMA application_id").fetchone()
    (version,) = database.execute("PRAGMA user_version").fetchone()
    if application != APPLICATION_ID:
        raise StoreError(f"{folder}: {DATABASE_FILE} is not a run of swarmevo")
    if version != SCHEMA_VERSION:
        needed = "a newer" if version > SCHEMA_VERSION else "an older"
        raise StoreError(
            f"{folder}: expected schema version {SCHEMA_VERSION}, got {version}; use {needed} swarmevo for this run"
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


@contextlib.contextmanager
def explained(folder: Path) -> Iterator[None]:
    """Turn what SQLite and the file system report into a StoreError of one line."""
    try:
        yield
    except sqlite3.Error as error:
        code = "_".join(getattr(error, "sqlite_errorname", "").split("_")[:2])  # without its extension
        advice = ADVICE.get(code, f"failed: {error}")
        raise StoreError(f"{folder / DATABASE_FILE}: {advice}") from error
    except UnicodeDecodeError as error:
        raise StoreError(f"{folder / DATABASE_FILE}: {ADVICE['SQLITE_CORRUPT']}") from error
    except OSError as error:
        raise StoreError(f"{error.filename or folder}: {error.strerror or error}") from error

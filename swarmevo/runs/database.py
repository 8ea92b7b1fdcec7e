# SPDX-License-Identifier: BSD-3-Clause
"""The database of a run folder: its tables, opening it, and what to say when it fails.

Tables of ``run.sqlite`` (``PRAGMA user_version`` is the schema's version):

- ``run``, one row: ``seed``, ``robots``, ``config_sha256``; ``next_config_sha256`` while ``config.yaml`` is replaced.
- ``session``: ``id`` (from 1), ``provenance`` as JSON. A new one when the run goes on with anything else than before.
- ``objective``: ``number`` (from 0), ``name``, ``direction``, ``low`` and ``high`` end of its range.
- ``generation``: ``trial``, ``number`` (both from 0), ``seconds`` that its evaluation took, time when ``stored``.
- ``genome``: ``id`` (from 1), ``sha256`` of ``genes``, ``genes`` as little-endian float64. Equal genomes are one row.
- ``individual``: ``trial``, ``generation``, ``number`` (its place in the generation, from 0), ``genome``. A genome that
  stays in the population is an individual of every generation in which it was evaluated.
- ``episode``: ``trial``, ``generation``, ``individual``, ``repeat``; ``hash`` of its trajectory (64 bits, as a signed
  integer); ``push_time`` [s] and, for each robot ``j``, ``homing_time_j`` [s], NULL: never; ``ode_messages`` and
  ``unsolved_steps`` of the physics library; for each objective ``k``, ``objective_k`` as measured, in its own
  direction; ``session`` that ran it; ``fault``: why it failed, NULL: it did not. A failed episode has the worst
  objectives and the hash 0. Its random streams are keyed by the run's seed and (trial, generation, repeat).
- ``optimiser``: ``trial``, ``generation`` after which it was taken, ``state`` as JSON (``evolution/state.py``).
- ``in_flight``: episodes of the generation in work, as in ``episode``, with the SHA-256 of the ``genome`` and the
  ``seconds`` that the generation had taken by then. Empty when no run was cut short.

A generation and the optimiser's state after it are stored in one transaction, which empties ``in_flight``: all of it
happens, or nothing.
"""

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

SCHEMA_VERSION: Final = 2
"""Of the tables; a folder written with another one is refused."""
APPLICATION_ID: Final = 0x53574556
"""``SWEV``: tells a run from any other SQLite file."""
DATABASE_FILE: Final = "run.sqlite"

_BUSY_SECONDS: Final = 30.0  # longer than any transaction takes


# ---- the tables ------------------------------------------------------------------------------------------------------


def _schema(objectives: int, robots: int) -> str:
    """Return the tables' definition. STRICT: a column holds what its type says, not what SQLite makes of it."""
    measured = "".join(f"    objective_{k} REAL NOT NULL,\n" for k in range(objectives))
    homing = "".join(f"    homing_time_{j} REAL,\n" for j in range(robots))
    outcome = f"""\
    individual INTEGER NOT NULL,
    repeat INTEGER NOT NULL,
    hash INTEGER NOT NULL,
    push_time REAL,
    ode_messages INTEGER NOT NULL,
    unsolved_steps INTEGER NOT NULL,
{measured}{homing}\
    PRIMARY KEY (trial, generation, individual, repeat)"""
    return f"""
PRAGMA application_id = {APPLICATION_ID};
PRAGMA user_version = {SCHEMA_VERSION};
CREATE TABLE run (
    seed INTEGER NOT NULL,
    robots INTEGER NOT NULL,
    config_sha256 TEXT NOT NULL,
    next_config_sha256 TEXT
) STRICT;
CREATE TABLE session (
    id INTEGER PRIMARY KEY,
    provenance TEXT NOT NULL
) STRICT;
CREATE TABLE objective (
    number INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE,
    direction TEXT NOT NULL CHECK (direction IN ('maximise', 'minimise')),
    low REAL NOT NULL,
    high REAL NOT NULL
) STRICT;
CREATE TABLE generation (
    trial INTEGER NOT NULL,
    number INTEGER NOT NULL,
    seconds REAL NOT NULL,
    stored TEXT NOT NULL,
    PRIMARY KEY (trial, number)
) STRICT, WITHOUT ROWID;
CREATE TABLE genome (
    id INTEGER PRIMARY KEY,
    sha256 BLOB NOT NULL UNIQUE,
    genes BLOB NOT NULL
) STRICT;
CREATE TABLE individual (
    trial INTEGER NOT NULL,
    generation INTEGER NOT NULL,
    number INTEGER NOT NULL,
    genome INTEGER NOT NULL REFERENCES genome (id),
    PRIMARY KEY (trial, generation, number),
    FOREIGN KEY (trial, generation) REFERENCES generation (trial, number)
) STRICT, WITHOUT ROWID;
CREATE INDEX individual_genome ON individual (genome);
CREATE TABLE episode (
    trial INTEGER NOT NULL,
    generation INTEGER NOT NULL,
    session INTEGER NOT NULL REFERENCES session (id),
    fault TEXT,
{outcome},
    FOREIGN KEY (trial, generation, individual) REFERENCES individual (trial, generation, number)
) STRICT, WITHOUT ROWID;
CREATE TABLE optimiser (
    trial INTEGER PRIMARY KEY,
    generation INTEGER NOT NULL,
    state TEXT NOT NULL,
    FOREIGN KEY (trial, generation) REFERENCES generation (trial, number)
) STRICT;
CREATE TABLE in_flight (
    trial INTEGER NOT NULL,
    generation INTEGER NOT NULL,
    session INTEGER NOT NULL REFERENCES session (id),
    seconds REAL NOT NULL,
    genome BLOB NOT NULL,
{outcome}
) STRICT, WITHOUT ROWID;
"""


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
        database.executescript(f"BEGIN; {_schema(len(objectives), robots)}")
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
    # WAL: who looks at a run never makes its writer wait. Where the file system cannot, SQLite keeps its other journal.
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

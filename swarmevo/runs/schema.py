# SPDX-License-Identifier: BSD-3-Clause
"""The tables of a run's database, and how results become rows and rows results.

Tables of ``run.sqlite`` (``PRAGMA user_version`` is the schema's version):

- ``run``, one row: ``seed``, ``robots`` of the largest team, ``config_sha256``; ``next_config_sha256`` while
  ``config.yaml`` is replaced;
  ``sha256`` of all these, of the objectives and of the descriptors.
- ``session``: ``id`` (from 1), ``provenance`` as JSON and its ``sha256``. A new one when the run goes on with anything
  else than before.
- ``objective``: ``number`` (from 0), ``name``, ``direction``, ``low`` and ``high`` end of its range, and its ``basis``:
  the ``episode`` that it is measured in, or the ``genome`` alone.
- ``success``, only in a run that has some, which is of a version of its own: ``objective`` by its number, and ``value``
  from which on an episode is a success.
- ``descriptor``, only in a run that has some, which is of a version of its own: ``number`` (from 0), ``name``, ``low``
  and ``high`` end of its range.
- ``generation``: ``trial``, ``number`` (both from 0), ``seconds`` that its evaluation took, time when ``stored``,
  ``sha256`` of this row, its individuals and its episodes.
- ``genome``: ``id`` (from 1), ``sha256`` of ``genes``, ``genes`` as little-endian float64. Equal genomes are one row.
- ``individual``: ``trial``, ``generation``, ``number`` (its place in the generation, from 0), ``genome``. A genome that
  stays in the population is an individual of every generation in which it was evaluated.
- ``episode``: ``trial``, ``generation``, ``individual``, ``repeat``; the cells of ``COLUMNS``
  (``evolution/results.py``), NULL for empty ones, the hash as a signed integer; ``session`` that ran it; ``fault``: why
  it failed, NULL: it did not. A failed episode has the worst objectives, no descriptors and the hash 0. Its random
  streams are keyed by the run's seed and (trial, generation, repeat).
- ``optimiser``: ``trial``, ``generation`` after which it was taken, ``state`` as JSON (``evolution/state.py``),
  ``sha256`` of these.
- ``in_flight``: episodes of the generation in work, as in ``episode``, with the SHA-256 of the ``genome``, the
  ``seconds`` that the generation had taken by then, and the ``sha256`` of the row. Empty when no run was cut short.

A generation and the optimiser's state after it are stored in one transaction, which empties ``in_flight``: all of it
happens, or nothing. How each ``sha256`` is made is in ``checksums.py``; every reader checks them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from swarmevo.evolution.results import COLUMNS, Column, Results, Sizes

SCHEMA_VERSION: Final = 4
"""Of the tables, their text included; a folder written with another one is refused."""
DESCRIBED: Final = 1
"""More, of a run with descriptors."""
SUCCEEDING: Final = 2
"""More, of a run with objectives that say what a success is."""
VERSIONS: Final = range(SCHEMA_VERSION, SCHEMA_VERSION + DESCRIBED + SUCCEEDING + 1)
APPLICATION_ID: Final = 0x53574556
"""``SWEV``: tells a run from any other SQLite file."""


def has_descriptors(version: int) -> bool:
    """Return whether tables of a version have that of descriptors."""
    return bool(version - SCHEMA_VERSION & DESCRIBED)


def has_successes(version: int) -> bool:
    """Return whether tables of a version have that of successes."""
    return bool(version - SCHEMA_VERSION & SUCCEEDING)


def version_of(sizes: Sizes, successes: bool) -> int:
    """Return the version of a run's tables."""
    return SCHEMA_VERSION + DESCRIBED * bool(sizes.descriptors) + SUCCEEDING * successes


def tables(sizes: Sizes, successes: bool = False) -> str:
    """Return the tables' definition. STRICT: a column holds what its type says, not what SQLite makes of it.

    Args:
        sizes: Of what an episode leaves.
        successes: Whether any objective says what a success is.
    """
    cells = "".join(f"    {cell} {_sql_type(column)},\n" for column in COLUMNS for cell in column.cells(sizes))
    outcome = f"""\
    individual INTEGER NOT NULL,
    repeat INTEGER NOT NULL,
{cells}\
    PRIMARY KEY (trial, generation, individual, repeat)"""
    return f"""
PRAGMA application_id = {APPLICATION_ID};
PRAGMA user_version = {version_of(sizes, successes)};
CREATE TABLE run (
    seed INTEGER NOT NULL,
    robots INTEGER NOT NULL,
    config_sha256 TEXT NOT NULL,
    next_config_sha256 TEXT,
    sha256 BLOB NOT NULL
) STRICT;
CREATE TABLE session (
    id INTEGER PRIMARY KEY,
    provenance TEXT NOT NULL,
    sha256 BLOB NOT NULL
) STRICT;
CREATE TABLE objective (
    number INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE,
    direction TEXT NOT NULL CHECK (direction IN ('maximise', 'minimise')),
    low REAL NOT NULL,
    high REAL NOT NULL,
    basis TEXT NOT NULL CHECK (basis IN ('episode', 'genome'))
) STRICT;
{_SUCCESS_TABLE if successes else ""}\
{_DESCRIPTOR_TABLE if sizes.descriptors else ""}\
CREATE TABLE generation (
    trial INTEGER NOT NULL,
    number INTEGER NOT NULL,
    seconds REAL NOT NULL,
    stored TEXT NOT NULL,
    sha256 BLOB NOT NULL,
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
    sha256 BLOB NOT NULL,
    FOREIGN KEY (trial, generation) REFERENCES generation (trial, number)
) STRICT;
CREATE TABLE in_flight (
    trial INTEGER NOT NULL,
    generation INTEGER NOT NULL,
    session INTEGER NOT NULL REFERENCES session (id),
    seconds REAL NOT NULL,
    genome BLOB NOT NULL,
    sha256 BLOB NOT NULL,
{outcome}
) STRICT, WITHOUT ROWID;
"""


_SUCCESS_TABLE: Final = """\
CREATE TABLE success (
    objective INTEGER PRIMARY KEY REFERENCES objective (number),
    value REAL NOT NULL
) STRICT;
"""

_DESCRIPTOR_TABLE: Final = """\
CREATE TABLE descriptor (
    number INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE,
    low REAL NOT NULL,
    high REAL NOT NULL
) STRICT;
"""


def _sql_type(column: Column) -> str:
    kind = "REAL" if column.dtype is np.float64 else "INTEGER"
    return kind if column.may_be_empty else f"{kind} NOT NULL"


# ---- rows ------------------------------------------------------------------------------------------------------------


def cells(sizes: Sizes) -> list[str]:
    """Return the names of all cells of an episode, in the order of :func:`to_rows`."""
    return [cell for column in COLUMNS for cell in column.cells(sizes)]


def episode_columns(sizes: Sizes) -> list[str]:
    """Return the columns of ``episode`` after its place, in the order in which they are stored, read and checked."""
    return ["session", "fault", "individual", "repeat", *cells(sizes)]


def in_flight_columns(sizes: Sizes) -> list[str]:
    """Return the columns of ``in_flight`` after its place, but for the checksum, in that order."""
    return ["session", "seconds", "genome", "individual", "repeat", *cells(sizes)]


def to_rows(results: Results) -> list[tuple[Any, ...]]:
    """Return individual, repeat and cells of each episode, as SQLite gives them back."""
    return list(replace(results, values={name: _storable(array) for name, array in results.values.items()}).rows())


def _storable(array: NDArray[Any]) -> NDArray[Any]:
    """Return numbers that SQLite has: none is unsigned, and zero has no sign."""
    return array.view(np.int64) if array.dtype == np.uint64 else array + array.dtype.type(0)


def from_rows(rows: Sequence[Sequence[Any]], sizes: Sizes) -> dict[str, NDArray[Any]]:
    """Return the cells of k rows as :class:`Results` has them; NULL becomes NaN."""
    values, start = {}, 0
    for column in COLUMNS:
        width = len(column.cells(sizes))
        part = [row[start : start + width] for row in rows]
        kind: type[np.generic] = np.float64 if column.dtype is np.float64 else np.int64
        array = np.array(part, dtype=kind).reshape(len(rows), width).astype(column.dtype)
        values[column.name] = array if column.axis else array[:, 0]
        start += width
    return values

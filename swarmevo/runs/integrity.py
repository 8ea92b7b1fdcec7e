# SPDX-License-Identifier: BSD-3-Clause
"""Whether a run's database holds what was stored: its rows are held against their checksums."""

from __future__ import annotations

import hashlib
import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from operator import itemgetter
from typing import Any, TypeAlias

from swarmevo.runs import checksums

Place: TypeAlias = tuple[int, int]
"""A trial and the number of a generation."""


def damaged_rows(database: sqlite3.Connection, episode_columns: Sequence[str]) -> Iterator[str]:
    """Yield what is not as it was stored, in words: generations, optimisers' states, sessions.

    Genes are left out: most readers need none, and they are most of what is stored.

    Args:
        database: Of the run, in a transaction: somebody may be writing it.
        episode_columns: As in ``schema.py``.
    """
    for (trial, number), stored, found in generations(database, episode_columns):
        if found != stored:
            yield f"generation {number} of trial {trial}"
    yield from _damaged_states(database)
    yield from _damaged_sessions(database)


def damaged_genomes(database: sqlite3.Connection) -> Iterator[str]:
    """Yield genomes that are not as they were stored, in words."""
    for id, digest, genes in database.execute("SELECT id, sha256, genes FROM genome ORDER BY id"):
        if hashlib.sha256(genes).digest() != digest:
            yield f"genome {id}"


def generations(
    database: sqlite3.Connection, episode_columns: Sequence[str], place: Place | None = None
) -> Iterator[tuple[Place, bytes | None, bytes]]:
    """Yield the place of each generation, its stored checksum, None if it has none, and the one that its rows have.

    With a ``place``, only that generation is read.
    """

    def only(number: str) -> str:
        return "" if place is None else f" WHERE (trial, {number}) = ({place[0]:d}, {place[1]:d})"

    rows = database.execute(f"SELECT trial, number, seconds, stored, sha256 FROM generation{only('number')}")
    stored = {(trial, number): (seconds, at, digest) for trial, number, seconds, at, digest in rows}
    individuals = _by_generation(
        database.execute(
            "SELECT trial, generation, number, genome, genome.sha256"
            f" FROM individual LEFT JOIN genome ON genome.id = individual.genome{only('generation')}"
            " ORDER BY trial, generation, number"
        )
    )
    episodes = _by_generation(
        database.execute(
            f"SELECT trial, generation, {', '.join(episode_columns)}"
            f" FROM episode{only('generation')} ORDER BY trial, generation, individual, repeat"
        )
    )
    for found in sorted(stored.keys() | individuals.keys() | episodes.keys()):
        seconds, at, digest = stored.get(found, (None, None, None))
        parts = individuals.get(found, b""), episodes.get(found, b"")
        yield found, digest, checksums.of_generation((*found, seconds, at), *parts)


def _by_generation(rows: Iterable[tuple[Any, ...]]) -> dict[Place, bytes]:
    """Return the checksum of each generation's rows, which begin with its place; none if they are not in one piece."""
    found: dict[Place, bytes] = {}
    for place, group in groupby(rows, key=itemgetter(0, 1)):
        found[place] = b"" if place in found else checksums.of_rows([row[2:] for row in group])
    return found


def _damaged_states(database: sqlite3.Connection) -> Iterator[str]:
    rows = database.execute("SELECT trial, generation, state, sha256 FROM optimiser")
    states = {row[0]: row for *row, digest in rows if digest == checksums.of_rows([row])}
    for trial, last in database.execute("SELECT trial, MAX(number) FROM generation GROUP BY trial"):
        if trial not in states or states[trial][1] != last:
            yield f"the optimiser's state of trial {trial}"


def _damaged_sessions(database: sqlite3.Connection) -> Iterator[str]:
    rows = database.execute("SELECT id, provenance, sha256 FROM session ORDER BY id").fetchall()
    for number, (id, provenance, digest) in enumerate(rows, start=1):
        if id != number or digest != checksums.of_rows([[provenance]]):
            yield f"the provenance of session {number}"

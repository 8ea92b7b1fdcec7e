# SPDX-License-Identifier: BSD-3-Clause
"""Runs that were changed and have the checksums of what they hold now, as a stranger's may: what no checksum finds."""

from __future__ import annotations

import hashlib
import sqlite3
from contextlib import closing
from pathlib import Path

from swarmevo.evolution.results import Sizes
from swarmevo.runs import checksums, integrity
from swarmevo.runs.database import DATABASE_FILE, RUN, measured, seal_run
from swarmevo.runs.folder import CONFIG_FILE
from swarmevo.runs.schema import episode_columns, in_flight_columns


def change(folder: Path, statement: str, *values: object) -> None:
    """Change a run's database, and give everything its checksum."""
    with closing(sqlite3.connect(folder / DATABASE_FILE)) as database:
        assert database.execute(statement, values).rowcount
        database.commit()
    seal(folder)


def seal(folder: Path) -> None:
    """Give everything in a run its checksum."""
    with closing(sqlite3.connect(folder / DATABASE_FILE)) as database:
        _, robots, *_ = database.execute(RUN).fetchone()
        objectives, _, descriptors = measured(database)
        sizes = Sizes(len(objectives), robots, len(descriptors))
        for id, genes in database.execute("SELECT id, genes FROM genome").fetchall():
            digest = hashlib.sha256(genes).digest()
            database.execute("UPDATE genome SET sha256 = ? WHERE id = ?", (digest, id))
        for place, _, digest in list(integrity.generations(database, episode_columns(sizes))):
            database.execute("UPDATE generation SET sha256 = ? WHERE (trial, number) = (?, ?)", (digest, *place))
        _seal_rows(database, "optimiser", ["trial", "generation", "state"], ["trial"])
        _seal_rows(database, "session", ["provenance"], ["id"])
        key = ["trial", "generation", "individual", "repeat"]
        _seal_rows(database, "in_flight", ["trial", "generation", *in_flight_columns(sizes)], key)
        config = (folder / CONFIG_FILE).read_bytes()
        database.execute("UPDATE run SET config_sha256 = ?", (checksums.sha256(config),))
        seal_run(database)
        database.commit()


def _seal_rows(database: sqlite3.Connection, table: str, columns: list[str], key: list[str]) -> None:
    for row in database.execute(f"SELECT {', '.join([*key, *columns])} FROM {table}").fetchall():
        digest = checksums.of_rows([row[len(key) :]])
        where = " AND ".join(f"{name} = ?" for name in key)
        database.execute(f"UPDATE {table} SET sha256 = ? WHERE {where}", (digest, *row[: len(key)]))

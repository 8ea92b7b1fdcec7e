# SPDX-License-Identifier: BSD-3-Clause
"""The run folder: what a run was, did and found.

A run folder holds

- ``config.yaml``: the resolved configuration, every key with its value;
- ``provenance.json``: what made the run: versions, machine, git revision;
- ``run.sqlite``: every individual of every generation, each of its episodes, and the optimisers' state; its tables are
  described in ``schema.py``;
- ``start.json``, only of a run that began from given genomes: these;
- ``run.lock``, while somebody writes: held by the operating system, so it opens with the end of its process. The file
  that stays tells that this did not close the run.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from swarmevo.errors import FolderExistsError, StoreError
from swarmevo.evolution.results import Generation, Results
from swarmevo.protocols import Descriptor, FloatArray, Objective
from swarmevo.runs import checksums, files
from swarmevo.runs.database import (
    ADVICE,
    DATABASE_FILE,
    connect,
    create_database,
    empty_wal,
    explained,
    insert_session,
    leave_one_file,
    prepare_to_write,
    seal_run,
)
from swarmevo.runs.files import WatchedFile
from swarmevo.runs.folder import CONFIG_FILE, PROVENANCE_FILE, START_FILE
from swarmevo.runs.lock import WriterLock, left_by
from swarmevo.runs.provenance import lasting
from swarmevo.runs.reader import StoreReader
from swarmevo.runs.schema import to_rows

_PATIENCE: Final = 2.0  # [s] for readers to finish, after a generation
_LAST_PATIENCE: Final = 0.3  # [s] likewise, when the run is closed: a look of the dashboard is over by then


class Store(StoreReader):
    """An open run folder. Use as a context manager; belongs to one thread.

    Make one with :meth:`create` or :meth:`open`. Every method raises StoreError if the database cannot be read or
    written.
    """

    def __init__(self, folder: Path, database: sqlite3.Connection, lock: WriterLock | None) -> None:
        super().__init__(folder, database)
        self._lock = lock
        self._file = WatchedFile(folder / DATABASE_FILE)
        self._is_settled = False
        self._is_durable: bool | None = None  # whether commits wait for the disk; not chosen yet
        with explained(folder):
            self._session = self._last_session()

    @classmethod
    def create(
        cls,
        folder: str | os.PathLike[str],
        config_yaml: str,
        provenance: Mapping[str, Any],
        objectives: Sequence[Objective],
        robots: int,
        seed: int,
        start: FloatArray | None = None,
        descriptors: Sequence[Descriptor] = (),
    ) -> Self:
        """Make a run folder and open it for writing.

        Args:
            folder: Must not exist; its parents are made.
            config_yaml: The resolved configuration.
            provenance: See :func:`swarmevo.runs.provenance.provenance`.
            objectives: In the order of the objectives' axis.
            robots: In the team.
            seed: Of everything random in the run.
            start: Genomes ``(k, size)`` that the optimisers begin from; the configuration has their SHA-256.
            descriptors: In the order of the descriptors' axis.

        Raises:
            FolderExistsError: The folder exists.
            StoreError: It cannot be written; nothing is left behind.
        """
        folder = Path(folder)
        with explained(folder), files.folder_made(folder.parent):
            try:
                folder.mkdir()
            except FileExistsError as error:
                raise FolderExistsError(
                    f"{folder}: exists already and is never overwritten; choose another name"
                ) from error
            try:
                files.write(folder / CONFIG_FILE, config_yaml)
                files.write(folder / PROVENANCE_FILE, json.dumps(provenance, indent=2) + "\n")
                if start is not None:
                    files.write(folder / START_FILE, json.dumps({"genomes": start.tolist()}) + "\n")
                digest = checksums.sha256(config_yaml.encode())
                create_database(folder / DATABASE_FILE, digest, provenance, objectives, robots, seed, descriptors)
                return cls.open(folder, readonly=False)
            except BaseException:
                shutil.rmtree(folder, ignore_errors=True)
                raise

    @classmethod
    def open(cls, folder: str | os.PathLike[str], *, readonly: bool = True) -> Self:
        """Open a run folder.

        Args:
            folder: Made by :meth:`create`.
            readonly: Only read; possible at any time. Otherwise be its one writer.

        Raises:
            StoreError: It is no run folder, of another schema version, damaged, or, to write, not writable, written by
                somebody else, or its configuration was changed.
        """
        folder = Path(folder)
        if not os.path.isfile(folder / DATABASE_FILE):
            raise StoreError(f"{folder}: expected a run folder, but there is no {DATABASE_FILE} in it")
        with contextlib.ExitStack() as undo, explained(folder):
            lock = None
            if not readonly:
                lock = WriterLock(lock_file(folder))
                undo.callback(lock.release)
            database = undo.enter_context(contextlib.closing(connect(folder, readonly)))
            store = cls(folder, database, lock)
            if not readonly:
                store._check_intact()
                prepare_to_write(folder, database)
                store._settle_config()
                store._settle_wal(patience=0.0)
            undo.pop_all()
        return store

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the folder. A writer leaves the database as one file, which can be read from read-only media too."""
        if self._lock and self.is_in_place:
            with contextlib.suppress(sqlite3.Error):  # somebody goes on reading: SQLite tidies up later
                leave_one_file(self._database, _LAST_PATIENCE)
        self._database.close()
        if self._lock:
            self._lock.release()
            self._lock = None

    @property
    def provenance(self) -> dict[str, Any]:
        """Of the last session: with what the run went on so far."""
        return self.session(self._session)

    @property
    def left_by(self) -> str:
        """The process that wrote the run last, if it ended without closing it; else, or while one writes, ""."""
        return self._lock.left_by if self._lock else left_by(lock_file(self.folder))

    # ---- writing

    @property
    def is_in_place(self) -> bool:
        """Whether the database is where it was opened, and not shorter."""
        return not self._file.trouble()

    def append(self, trial: int, number: int, generation: Generation, state: str) -> None:
        """Store a generation of a trial and the optimiser's state after it, both or neither.

        Args:
            trial: From 0.
            number: Of the generation, from 0; the next one of its trial.
            generation: As evaluated.
            state: See :func:`swarmevo.evolution.state.encode_state`. It replaces the trial's last one.
        """
        with self._transaction():
            self._check_next(trial, number)
            individuals = self._insert_genomes(generation.genomes)
            episodes = self._episodes(trial, number, generation.episodes)
            row = trial, number, float(generation.episodes.seconds), datetime.now(UTC).isoformat(timespec="seconds")
            digest = checksums.of_generation(row, checksums.of_rows(individuals), checksums.of_rows(episodes))
            self._insert("generation", [(*row, digest)])
            self._insert("individual", [(trial, number, place, id) for place, id, _ in individuals])
            self._insert("episode", [(trial, number, *row) for row in episodes], self._episode_columns)
            last = trial, number, state
            self._database.execute("REPLACE INTO optimiser VALUES (?, ?, ?, ?)", (*last, checksums.of_rows([last])))
            self._database.execute("DELETE FROM in_flight")
        self._settle_wal(_PATIENCE)

    def keep(self, trial: int, number: int, genomes: FloatArray, episodes: Results) -> None:
        """Store episodes of the generation in work, to have them if the run is cut short.

        Unlike a generation they may be lost when the machine loses power; a killed process does not lose them.

        Args:
            trial: From 0.
            number: Of the generation, from 0; the next one of its trial.
            genomes: ``(n, size)``, of the whole generation.
            episodes: Any of its episodes, none of which failed.
        """
        digests = {i: checksums.of_genes(genomes[i]) for i in set(episodes.individual.tolist())}
        with self._transaction(durable=False):
            self._check_next(trial, number)
            before = trial, number, self._session, float(episodes.seconds)
            rows = [(*before, digests[row[0]], *row) for row in to_rows(episodes)]
            sealed = [(*row, checksums.of_rows([row])) for row in rows]
            self._insert("in_flight", sealed, [*self._in_flight_columns, "sha256"], "REPLACE")
        if not self._is_settled:  # a reader was in the way
            self._settle_wal(patience=0.0)

    def begin_session(self, provenance: Mapping[str, Any]) -> None:
        """Note with what the run goes on; nothing is written if it is the same as before.

        Args:
            provenance: See :func:`swarmevo.runs.provenance.provenance`.
        """
        if lasting(self.provenance) == lasting(provenance):
            return
        with self._transaction():
            insert_session(self._database, provenance)
        self._session = self._last_session()

    def replace_config(self, config_yaml: str) -> None:
        """Replace the configuration. Whenever the process is killed, the old one or the new one is in force.

        Args:
            config_yaml: The resolved configuration. That the stored generations fit it is the caller's to know.
        """
        digest = checksums.sha256(config_yaml.encode())
        with self._transaction():  # from here on both are accepted
            self._database.execute("UPDATE run SET next_config_sha256 = ?", (digest,))
            seal_run(self._database)
        with explained(self.folder):
            files.write(self.config_path, config_yaml)
        self._next_config_sha256 = digest
        self.__dict__.pop("config", None)  # it was cached
        self._settle_config()

    def _settle_config(self) -> None:
        """Accept no other configuration than the one that is there."""
        if self._next_config_sha256 is None:
            return
        digest = checksums.sha256(self.config_path.read_bytes())
        with self._transaction():
            self._database.execute("UPDATE run SET config_sha256 = ?, next_config_sha256 = NULL", (digest,))
            seal_run(self._database)
        self._config_sha256, self._next_config_sha256 = digest, None

    def _check_next(self, trial: int, number: int) -> None:
        if number != (expected := self.generations(trial)):
            raise StoreError(f"{self.folder}: expected generation {expected} of trial {trial}, got {number}")

    def _insert_genomes(self, genomes: FloatArray) -> list[tuple[int, int, bytes]]:
        """Store genomes that are new; return for each its place, its id and its SHA-256."""
        genes = [row.tobytes() for row in genomes.astype("<f8")]
        digests = [checksums.of_genes(row) for row in genomes]
        self._database.executemany(
            "INSERT INTO genome (sha256, genes) VALUES (?, ?) ON CONFLICT (sha256) DO NOTHING",
            zip(digests, genes, strict=True),
        )
        query = "SELECT id FROM genome WHERE sha256 = ?"
        ids = [self._database.execute(query, (digest,)).fetchone()[0] for digest in digests]
        return list(zip(range(len(ids)), ids, digests, strict=True))

    def _episodes(self, trial: int, number: int, episodes: Results) -> list[tuple[Any, ...]]:
        """Return episodes as rows of ``episode_columns``; one kept from an earlier session stays that session's."""
        # They are the same where all that they left is.
        kept = {row[3:]: row[0] for row in self._kept(trial, number)}
        return [
            (kept.get(row, self._session), fault or None, *row)
            for row, fault in zip(to_rows(episodes), episodes.faults, strict=True)
        ]

    def _insert(
        self, table: str, rows: Sequence[Sequence[Any]], columns: Sequence[str] = (), how: str = "INSERT"
    ) -> None:
        """Insert rows of all columns of a table, or of its place and ``columns``."""
        named = f" ({', '.join(['trial', 'generation', *columns])})" if columns else ""
        holders = ", ".join("?" * len(rows[0]))
        self._database.executemany(f"{how} INTO {table}{named} VALUES ({holders})", rows)

    @contextlib.contextmanager
    def _transaction(self, durable: bool = True) -> Iterator[None]:
        """Commit what is done inside, or nothing of it; if ``durable``, so that it survives a power failure."""
        if not self._lock:
            raise StoreError(f"{self.folder}: was opened to be read only; open it with readonly=False")
        if trouble := self._file.trouble():
            raise StoreError(f"{self.folder}: {DATABASE_FILE} {trouble}")
        with explained(self.folder):
            if durable != self._is_durable:
                self._database.execute(f"PRAGMA synchronous = {'FULL' if durable else 'NORMAL'}")
                self._is_durable = durable
            self._database.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._database.execute("COMMIT")
            except BaseException:
                if self._database.in_transaction:  # SQLite itself rolls back when the disk is full
                    self._database.execute("ROLLBACK")
                raise

    def _settle_wal(self, patience: float) -> None:
        """Bring all that is stored into the database's file, so that this file alone is the run; wait so long [s]."""
        with explained(self.folder):
            self._is_settled = empty_wal(self._database, patience)

    def _last_session(self) -> int:
        ((last,),) = self._rows("SELECT MAX(id) FROM session")
        if last is None:
            raise StoreError(f"{self.folder}: {DATABASE_FILE} is incomplete; it cannot be used")
        return int(last)

    def _check_intact(self) -> None:
        """Refuse to write into a folder that would not hold together."""
        ((verdict,),) = self._rows("PRAGMA integrity_check(1)")
        if verdict != "ok" or self._rows("PRAGMA foreign_key_check"):
            raise StoreError(f"{self.folder / DATABASE_FILE}: {ADVICE['SQLITE_CORRUPT']}")
        self.check()


def lock_file(folder: Path) -> Path:
    """Return the place of the lock: beside the database itself, which several folders may have links to."""
    place = Path(os.path.realpath(folder / DATABASE_FILE))
    return place.with_name(f"{place.name.removesuffix('.sqlite')}.lock")

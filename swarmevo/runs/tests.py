# SPDX-License-Identifier: BSD-3-Clause
"""Tests of a run's controllers, each stored once: ``tests.sqlite`` in the run folder.

What is stored of a test is found by what decides it: the controller's genome, the world, and the key of the episode.
Hence tests add up, whoever asked for them, and none is run twice. The tables are described in ``tests_file.py``.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Final, NamedTuple, Self

import numpy as np

from swarmevo.config import WORLD, Config
from swarmevo.errors import StoreError
from swarmevo.evolution.results import Results, Sizes
from swarmevo.runs import checksums, other_world
from swarmevo.runs.database import explained, insert_session, schema_of
from swarmevo.runs.files import WatchedFile
from swarmevo.runs.lock import WriterLock
from swarmevo.runs.provenance import changed_files, lasting
from swarmevo.runs.schema import from_rows, to_rows
from swarmevo.runs.store import Store
from swarmevo.runs.tests_file import (
    LOCK_FILE,
    TESTS_FILE,
    broken,
    count,
    create,
    damaged_tests,
    drop_damaged,
    in_memory,
    is_of_another,
    open_tests,
)

GENERATION: Final = 2**32 - 1
"""Of the tests' episode keys; a run has at most a million generations."""
_READ_ONLY: Final = (errno.EROFS, errno.EACCES, errno.EPERM)


class Place(NamedTuple):
    """Whose tests, and where."""

    world: str
    """As :func:`world_of` has it."""
    trial: int
    genome: bytes
    """SHA-256 of the individual's genes (:func:`swarmevo.runs.checksums.of_genes`)."""


class _Run(NamedTuple):
    """What tests know of their run."""

    origin: str
    """What tells it from others."""
    measured: tuple[int, int]
    """How many objectives and descriptors an episode has."""

    @classmethod
    def of(cls, store: Store) -> _Run:
        first = json.dumps(store.session(1), sort_keys=True)
        return cls(checksums.sha256(first.encode()), (len(store.objectives), len(store.descriptors)))


def world_of(run: Config, settings: Config) -> str:
    """Return what tells a world from all others that a run's controllers may meet: what it changes, as JSON."""
    evolved, here = other_world.test_world(run).model_dump(mode="json"), settings.model_dump(mode="json")
    changes = {
        f"{section}.{key}": value
        for section in WORLD
        for key, value in here[section].items()
        if value != evolved[section][key]
    }
    return json.dumps(changes, sort_keys=True, separators=(",", ":"))


class StoredTests:
    """The tests of a run, open. Use as a context manager; belongs to one thread.

    Make one with :meth:`open`. Every method raises StoreError if the file cannot be read or written, or was changed.
    """

    def __init__(
        self, file: Path, run: _Run, database: sqlite3.Connection, lock: WriterLock | None = None, refused: str = ""
    ) -> None:
        self.file: Final = file
        self.not_stored: Final = refused
        """Why what is added is forgotten with this object; "": it is stored."""
        self.rerun = 0
        """Tests that were damaged, and are not there any more: to be run again."""
        self.added = 0
        """Tests, since it was opened."""
        self._run, self._database, self._lock = run, database, lock
        self._watched = WatchedFile(self.file) if lock else None
        self._session: int | None = None
        with self._explained():
            if not schema_of(database):
                create(database, run.origin)

    @classmethod
    def open(cls, store: Store, *, readonly: bool = True, check: bool = True) -> Self:
        """Open the tests of a run, of which there may be none yet.

        Args:
            store: The run.
            readonly: Only read. Otherwise be the one who adds some; where the folder cannot be written, they are
                forgotten, and ``not_stored`` says why.
            check: Refuse what is not as it was stored; to write, tests that are not are dropped, to be run again.

        Raises:
            StoreError: The file is damaged, of another version, of another run, or, to write, written by somebody else.
        """
        file = store.folder / TESTS_FILE
        with contextlib.ExitStack() as undo, explained(store.folder, TESTS_FILE):
            lock, refused = None, ""
            if not readonly:
                try:
                    lock = WriterLock(store.folder / LOCK_FILE)
                    undo.callback(lock.release)
                    file.touch()
                except OSError as error:
                    if error.errno not in _READ_ONLY:
                        raise
                    refused = f"{file}: {os.strerror(error.errno)}"
                    if lock:
                        undo.pop_all().close()
                        lock = None
            database = undo.enter_context(contextlib.closing(open_tests(file, lock is None, bool(refused))))
            tests = cls(file, _Run.of(store), database, lock, refused)
            if check:
                tests._check(repair=not readonly)
            undo.pop_all()
        return tests

    @classmethod
    def forgotten(cls, objectives: int, descriptors: int) -> Self:
        """Return room for tests that are of no run, and are kept until it is closed.

        Args:
            objectives: Their number.
            descriptors: Their number.
        """
        return cls(Path(TESTS_FILE), _Run("", (objectives, descriptors)), in_memory(), refused="of no run")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file, which is removed where it holds no test, and let the next writer in."""
        is_empty = self._lock and self.added == 0 and not self.worlds()
        self._database.close()
        if self._lock:
            if is_empty:
                self.file.unlink(missing_ok=True)
            self._lock.release()
            self._lock = None

    # ---- reading

    def worlds(self) -> list[str]:
        """Return the worlds in which something was tested, as :func:`world_of` has them."""
        with self._explained():
            rows = self._database.execute("SELECT changes FROM world ORDER BY id").fetchall()
        return [changes for (changes,) in rows]

    def places(self) -> list[Place]:
        """Return whose episodes are stored, and where, in the order in which they were first tested."""
        query = (
            "SELECT changes, trial, genome FROM tested JOIN world ON world.id = world"
            " WHERE kind = 'episode' AND count > 0 ORDER BY tested.id"
        )
        with self._explained():
            return [Place(*row) for row in self._database.execute(query)]

    def episodes(self, place: Place, robots: int) -> Results:
        """Return all that is stored of a controller in a world, by repeat; the individual is 0.

        Args:
            place: Whose, and where.
            robots: In that world.
        """
        repeats, contents = self._contents("episode", place)
        objectives, descriptors = self._run.measured
        with self._sensible():
            return Results(
                individual=np.zeros(len(repeats), dtype=np.intp),
                repeat=np.array(repeats, dtype=np.intp),
                values=from_rows([cells for _, *cells in contents], Sizes(objectives, robots, descriptors)),
                faults=tuple(fault or "" for fault, *_ in contents),
                seconds=0.0,
            )

    def sessions(self, place: Place) -> list[int]:
        """Return the session that ran each episode of :meth:`episodes`."""
        return [session for _, session, _ in self._rows("episode", place)]

    def session(self, id: int) -> dict[str, Any]:
        """Return with what tests were run: the provenance of a session."""
        with self._explained(), self._sensible():
            ((text,),) = self._database.execute("SELECT provenance FROM session WHERE id = ?", (id,))
            found: dict[str, Any] = json.loads(text)
        return found

    def shares(self, place: Place) -> dict[int, list[Any]]:
        """Return of a controller's census, for each repeat, the share of robots with each label of the census.

        Then come pairs of label and share: those of the fitness functions.
        """
        return dict(zip(*self._contents("census", place), strict=True))

    def _contents(self, kind: str, place: Place) -> tuple[list[int], list[Any]]:
        rows = self._rows(kind, place)
        with self._sensible():
            return [repeat for repeat, _, _ in rows], [json.loads(content) for _, _, content in rows]

    def _rows(self, kind: str, place: Place) -> list[tuple[int, int, str]]:
        with self._explained():
            return self._database.execute(
                "SELECT repeat, session, content FROM test JOIN tested ON tested.id = tested"
                " JOIN world ON world.id = world"
                " WHERE kind = ? AND changes = ? AND trial = ? AND genome = ? ORDER BY repeat",
                (kind, *place),
            ).fetchall()

    # ---- writing

    def begin_session(self, provenance: Mapping[str, Any]) -> None:
        """Note with what tests are run from here on.

        Args:
            provenance: See :func:`swarmevo.runs.provenance.provenance`.

        Raises:
            StoreError: A controller or a fitness plugin is not what it was in the last session.
        """
        with self._explained():
            rows = self._database.execute("SELECT id, provenance FROM session ORDER BY id DESC LIMIT 1").fetchall()
        for id, text in rows:
            then = json.loads(text)
            self._check_plugins(then, provenance)
            if lasting(then) == lasting(provenance):
                self._session = id
                return
        with self._transaction():
            insert_session(self._database, provenance)
            ((self._session,),) = self._database.execute("SELECT MAX(id) FROM session")

    def _check_plugins(self, then: Mapping[str, Any], now: Mapping[str, Any]) -> None:
        for file, plugins in changed_files(then, now).items():
            if judging := [name for name in plugins if not name.startswith("optimiser.")]:
                raise StoreError(
                    f"{self.file}: {file} of {', '.join(judging)} was changed since these tests; undo that, or move "
                    "the tests away to begin others"
                )

    def add_episodes(self, places: Sequence[Place], episodes: Results) -> None:
        """Store episodes, in place of those that are there already.

        Args:
            places: Of each individual: whose episodes these are, and where.
            episodes: Any of them.
        """
        rows = zip(to_rows(episodes), episodes.faults, strict=True)
        self._add("episode", [(places[i], repeat, [fault or None, *cells]) for (i, repeat, *cells), fault in rows])

    def add_shares(self, place: Place, shares: Mapping[int, Sequence[Any]]) -> None:
        """Store what a census found, by repeat (:meth:`shares`)."""
        self._add("census", [(place, repeat, list(found)) for repeat, found in shares.items()])

    def _add(self, kind: str, tests: Sequence[tuple[Place, int, list[Any]]]) -> None:
        assert self._session is not None, "begin_session comes first"
        with self._transaction():
            ids = {place: self._id(kind, place) for place, _, _ in tests}
            rows = [(ids[place], repeat, self._session, json.dumps(content)) for place, repeat, content in tests]
            self._database.executemany(
                "REPLACE INTO test VALUES (?, ?, ?, ?, ?)", [(*row, checksums.of_rows([row])) for row in rows]
            )
            count(self._database, ids.values())
        self.added += len(tests)

    def _id(self, kind: str, place: Place) -> int:
        """Return the id of a row of ``tested``, made if it is new, and its world as well."""
        query = "SELECT id FROM world WHERE changes = ?"
        if not (worlds := self._database.execute(query, (place.world,)).fetchall()):
            self._insert("world", [place.world])
            worlds = self._database.execute(query, (place.world,)).fetchall()
        row = kind, worlds[0][0], place.trial, place.genome
        query = "SELECT id FROM tested WHERE (kind, world, trial, genome) = (?, ?, ?, ?)"
        if not (found := self._database.execute(query, row).fetchall()):
            self._insert("tested", [*row, 0])
            found = self._database.execute(query, row).fetchall()
        return int(found[0][0])

    def _insert(self, table: str, values: Sequence[Any]) -> None:
        """Insert a row with the next id and its checksum."""
        ((id,),) = self._database.execute(f"SELECT IFNULL(MAX(id), 0) + 1 FROM {table}")
        row = [id, *values]
        holders = ", ".join("?" * (len(row) + 1))
        self._database.execute(f"INSERT INTO {table} VALUES ({holders})", (*row, checksums.of_rows([row])))

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[None]:
        """Commit what is done inside, or nothing of it."""
        if self._watched and (trouble := self._watched.trouble()):
            raise StoreError(f"{self.file} {trouble}")
        with self._explained():
            self._database.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._database.execute("COMMIT")
            except BaseException:
                if self._database.in_transaction:  # SQLite itself rolls back when the disk is full
                    self._database.execute("ROLLBACK")
                raise

    def damage(self) -> list[str]:
        """Return all that is not as it was stored, in words."""
        with self._explained():
            found = list(broken(self._database, self._run.origin))
            if not found:
                found = [what for _, what in damaged_tests(self._database)]
        return [f"{TESTS_FILE}: {what}" for what in found]

    def _check(self, repair: bool) -> None:
        """Refuse what is not as it was stored; or, to ``repair`` it, drop the tests that are not."""
        with self._explained():
            if is_of_another(self._database, self._run.origin):
                raise StoreError(f"{self.file}: expected the tests of this run, got those of another one; move it away")
            what = next(broken(self._database, self._run.origin), "")
            wrong = [] if what else list(damaged_tests(self._database))
        if what:
            raise StoreError(
                f"{self.file}: is damaged: {what} is not as it was stored; restore it from a copy, or move it away: "
                "all tests can be run again, to the same bits"
            )
        if wrong and not repair:
            raise StoreError(
                f"{self.file}: is damaged: {wrong[0][1]} is not as it was stored; swarmevo test runs again what is, or "
                "restore it from a copy"
            )
        if wrong:
            with self._transaction():
                self.rerun = drop_damaged(self._database, [id for id, _ in wrong])

    def _explained(self) -> contextlib.AbstractContextManager[None]:
        return explained(self.file.parent, TESTS_FILE)

    @contextlib.contextmanager
    def _sensible(self) -> Iterator[None]:
        try:
            yield
        except (ValueError, TypeError, LookupError, ArithmeticError, RecursionError) as error:
            raise StoreError(f"{self.file}: is damaged; restore it from a copy, or move it away") from error

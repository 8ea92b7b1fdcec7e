# SPDX-License-Identifier: BSD-3-Clause
"""The run folder: what a run was, did and found.

A run folder holds

- ``config.yaml``: the resolved configuration, every key with its value;
- ``provenance.json``: what made the run: versions, machine, git revision;
- ``run.sqlite``: every individual of every generation, each of its episodes, and the optimisers' state;
- ``run.lock``, only while somebody writes: held by the operating system, so it vanishes with its process.

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
- ``optimiser``: ``trial``, ``generation`` after which it was taken, ``state`` as JSON (:func:`encode_state`).
- ``in_flight``: episodes of the generation in work, as in ``episode``, with the SHA-256 of the ``genome`` and the
  ``seconds`` that the generation had taken by then. Empty when no run was cut short.

A generation and the optimiser's state after it are stored in one transaction, which empties ``in_flight``: all of it
happens, or nothing.
"""

from __future__ import annotations

import base64
import contextlib
import fcntl
import functools
import hashlib
import json
import math
import os
import shutil
import socket
import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Concatenate, Final, ParamSpec, Self, TypeVar
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from swarmevo.protocols import FloatArray, Objective

SCHEMA_VERSION: Final = 2
"""Of the tables; a folder written with another one is refused."""
APPLICATION_ID: Final = 0x53574556
"""``SWEV``: tells a run from any other SQLite file."""

CONFIG_FILE: Final = "config.yaml"
PROVENANCE_FILE: Final = "provenance.json"
DATABASE_FILE: Final = "run.sqlite"
LOCK_FILE: Final = "run.lock"

_ARRAY_KEYS: Final = {"dtype", "shape", "base64"}
_MOST_ROBOTS: Final = 64  # as in swarmevo.h; more are not in a sound file
_BUSY_SECONDS: Final = 30.0  # longer than any transaction takes


class StoreError(Exception):
    """A run folder cannot be made, read or written. One line; what was stored before is intact."""


# ---- what is stored --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Generation:
    """One generation as evaluated: n individuals, r repeats, m objectives."""

    genomes: FloatArray
    """``(n, size)``"""
    objectives: FloatArray
    """``(n, r, m)``, as measured, each in its own direction."""
    hash: NDArray[np.uint64]
    """``(n, r)``: of each episode's trajectory."""
    push_time: FloatArray
    """``(n, r)`` [s]; NaN: never."""
    homing_time: FloatArray
    """``(n, r, robots)`` [s]; NaN: never."""
    ode_messages: NDArray[np.uint32]
    """``(n, r)``: warnings of the physics library."""
    unsolved_steps: NDArray[np.uint32]
    """``(n, r)``: time steps that it could not solve."""
    seconds: float
    """That the evaluation took."""
    faults: Mapping[tuple[int, int], str] = field(default_factory=dict)
    """Why episodes failed, by individual and repeat; theirs are the worst objectives."""


@dataclass(frozen=True)
class InFlight:
    """Episodes of a generation that is not complete; fields as in :class:`Generation`. First axis: k episodes."""

    individual: NDArray[np.int64]
    """``(k,)``: place in the generation, from 0."""
    repeat: NDArray[np.int64]
    """``(k,)``: from 0."""
    objectives: FloatArray
    hash: NDArray[np.uint64]
    push_time: FloatArray
    homing_time: FloatArray
    ode_messages: NDArray[np.uint32]
    unsolved_steps: NDArray[np.uint32]
    seconds: float
    """That the generation had taken when the last of them came."""


@dataclass(frozen=True)
class Summary:
    """One generation in short, as hypervolume and cost need it."""

    trial: int
    number: int
    """From 0."""
    genomes: NDArray[np.int64]
    """``(n,)``: id of each individual's genome."""
    objectives: FloatArray
    """``(n, m)``: mean over the generation's repeats, each in its own direction."""
    episodes: int
    ode_messages: int
    unsolved_steps: int
    seconds: float
    """That the evaluation took."""


@dataclass(frozen=True)
class Individuals:
    """Genomes, judged by all the episodes that they ran in one trial. First axis: k genomes."""

    genome: NDArray[np.int64]
    """``(k,)``: id of the genome."""
    trial: NDArray[np.int64]
    """``(k,)``"""
    first_generation: NDArray[np.int64]
    """``(k,)``: in which it appeared."""
    last_generation: NDArray[np.int64]
    """``(k,)``: in which it was last evaluated."""
    episodes: NDArray[np.int64]
    """``(k,)``: number of episodes behind the means, over all generations and repeats."""
    objectives: FloatArray
    """``(k, m)``: mean over those episodes, each in its own direction."""
    homing_rate: FloatArray
    """``(k,)``: share of robots that came within the emitter's range, over those episodes."""
    homing_time: FloatArray
    """``(k,)``: mean over the robots that did [s]; NaN: none did."""
    push_rate: FloatArray
    """``(k,)``: share of those episodes in which the box touched the target wall."""
    push_time: FloatArray
    """``(k,)``: mean over the episodes in which it did [s]; NaN: in none."""


@dataclass(frozen=True)
class Totals:
    """What a run, or one of its trials, has cost so far."""

    generations: int
    individuals: int
    """Evaluated, one for each generation that a genome was in."""
    genomes: int
    """Distinct."""
    episodes: int
    ode_messages: int
    unsolved_steps: int
    seconds: float
    """That the evaluations took."""
    faults: int
    """Episodes that failed."""


# ---- the optimiser's state as text -----------------------------------------------------------------------------------


def encode_state(state: Mapping[str, Any]) -> str:
    """Return ``state`` as JSON.

    Args:
        state: Numbers, strings, None, arrays, and dicts (with strings as keys) and lists of these. An array becomes
            ``{"dtype", "shape", "base64"}``; whole numbers keep all their digits, floats all their bits.

    Raises:
        TypeError: Anything else is in it; the message says where.
    """
    if not isinstance(state, Mapping):
        raise TypeError(f"expected a mapping, got {type(state).__name__}")
    return json.dumps(_plain(state, "state"))


def decode_state(text: str) -> dict[str, Any]:
    """Return what :func:`encode_state` was given, tuples as lists.

    Raises:
        ValueError: It is no such text.
    """
    try:
        state = json.loads(text, object_hook=_array_or_dict)
    except (TypeError, RecursionError) as error:
        raise ValueError(f"expected what encode_state returns: {error}") from error
    if not isinstance(state, dict):
        raise ValueError(f"expected a JSON object, got {type(state).__name__}")
    return state


def _plain(value: Any, where: str) -> Any:
    """Return ``value`` made of what JSON knows."""
    if isinstance(value, np.ndarray):
        return _plain_array(value, where)
    if isinstance(value, np.generic):
        return _plain(value.item(), where)
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Mapping):
        if not all(isinstance(key, str) for key in value) or set(value) == _ARRAY_KEYS:
            raise TypeError(f"{where}: expected strings as keys, other than those of an array, got {list(value)}")
        return {key: _plain(entry, f"{where}[{key!r}]") for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry, f"{where}[{i}]") for i, entry in enumerate(value)]
    raise TypeError(f"{where}: expected a number, string, None, array, dict or list, got {type(value).__name__}")


def _plain_array(array: NDArray[Any], where: str) -> dict[str, Any]:
    if array.dtype.kind not in "biufc":
        raise TypeError(f"{where}: expected an array of numbers, got dtype {array.dtype}")
    content = base64.b64encode(array.tobytes()).decode("ascii")
    return {"dtype": array.dtype.str, "shape": list(array.shape), "base64": content}


def _array_or_dict(value: dict[str, Any]) -> Any:
    if set(value) != _ARRAY_KEYS:
        return value
    content = base64.b64decode(value["base64"], validate=True)
    return np.frombuffer(content, dtype=value["dtype"]).reshape(value["shape"]).copy()


# ---- the lock --------------------------------------------------------------------------------------------------------


class _WriterLock:
    """Keeps a second writer out of a run folder.

    The lock is the operating system's (``flock``) and ends with its process, however that ends. It is taken on a file
    of its own: closing any handle of the database's file would drop SQLite's own locks.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._handle = self._acquire()
        with contextlib.suppress(OSError):  # only who we are; on a full disk the lock holds all the same
            os.ftruncate(self._handle, 0)
            os.write(self._handle, f"process {os.getpid()} on {socket.gethostname()}".encode())

    def _acquire(self) -> int:
        while True:
            handle = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o644)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                owner = os.read(handle, 200).decode(errors="replace") or "another process"
                os.close(handle)
                raise StoreError(f"{self._path.parent}: {owner} is writing it; wait for that, or stop it") from error
            except OSError:
                os.close(handle)
                raise
            if self._is_still_there(handle):
                return handle
            os.close(handle)  # its last owner removed the file while we waited at it: try the new one

    def _is_still_there(self, handle: int) -> bool:
        try:
            return os.path.samestat(os.fstat(handle), os.stat(self._path))
        except FileNotFoundError:
            return False

    def release(self) -> None:
        with contextlib.suppress(OSError):
            self._path.unlink()
        os.close(self._handle)


# ---- the store -------------------------------------------------------------------------------------------------------

_Returned = TypeVar("_Returned")
_Given = ParamSpec("_Given")


def _readable(
    method: Callable[Concatenate[Store, _Given], _Returned],
) -> Callable[Concatenate[Store, _Given], _Returned]:
    """Make a method of a store that reads say so when what it reads makes no sense."""

    @functools.wraps(method)
    def read(store: Store, /, *arguments: _Given.args, **named: _Given.kwargs) -> _Returned:
        try:
            return method(store, *arguments, **named)
        except (ValueError, TypeError, LookupError, ArithmeticError, RecursionError) as error:
            raise StoreError(f"{store.folder / DATABASE_FILE}: {_ADVICE['SQLITE_CORRUPT']}") from error

    return read


class Store:
    """An open run folder. Use as a context manager; belongs to one thread.

    Make one with :meth:`create` or :meth:`open`. Every method raises StoreError if the database cannot be read or
    written.
    """

    def __init__(self, folder: Path, database: sqlite3.Connection, lock: _WriterLock | None) -> None:
        self.folder: Final = folder
        self._database: Final = database
        self._lock = lock
        with _explained(folder):
            self.seed, self.robots, self._config_sha256, self._next_config_sha256 = self._run()
            self.objectives = self._objectives()
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
    ) -> Self:
        """Make a run folder and open it for writing.

        Args:
            folder: Must not exist; its parents are made.
            config_yaml: The resolved configuration.
            provenance: See :func:`swarmevo.provenance.provenance`.
            objectives: In the order of the objectives' axis.
            robots: In the team.
            seed: Of everything random in the run.

        Raises:
            StoreError: The folder exists or cannot be written; nothing is left behind.
        """
        folder = Path(folder)
        with _explained(folder):
            try:
                folder.mkdir(parents=True)
            except FileExistsError as error:
                raise StoreError(f"{folder}: exists already and is never overwritten; choose another name") from error
        try:
            with _explained(folder):
                (folder / CONFIG_FILE).write_text(config_yaml, encoding="utf-8")
                (folder / PROVENANCE_FILE).write_text(json.dumps(provenance, indent=2) + "\n", encoding="utf-8")
                digest = _sha256(config_yaml.encode())
                _create_database(folder / DATABASE_FILE, digest, provenance, objectives, robots, seed)
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
        if not (folder / DATABASE_FILE).is_file():
            raise StoreError(f"{folder}: expected a run folder, but there is no {DATABASE_FILE} in it")
        with contextlib.ExitStack() as undo, _explained(folder):
            lock = None
            if not readonly:
                lock = _WriterLock(folder / LOCK_FILE)
                undo.callback(lock.release)
            database = undo.enter_context(contextlib.closing(_connect(folder, readonly)))
            store = cls(folder, database, lock)
            if not readonly:
                store._check_intact()
                _prepare_to_write(database)
                store._settle_config()
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
        if self._lock:
            with contextlib.suppress(sqlite3.Error):  # somebody is reading: SQLite tidies up later
                self._database.execute("PRAGMA busy_timeout = 0")
                self._database.execute("PRAGMA journal_mode = DELETE")
        self._database.close()
        if self._lock:
            self._lock.release()
            self._lock = None

    # ---- writing

    def append(self, trial: int, number: int, generation: Generation, state: str) -> None:
        """Store a generation of a trial and the optimiser's state after it, both or neither.

        Args:
            trial: From 0.
            number: Of the generation, from 0; the next one of its trial.
            generation: As evaluated.
            state: See :func:`encode_state`. It replaces the trial's last one.
        """
        with self._transaction():
            self._check_next(trial, number)
            self._database.execute(
                "INSERT INTO generation VALUES (?, ?, ?, ?)",
                (trial, number, generation.seconds, datetime.now(UTC).isoformat(timespec="seconds")),
            )
            self._insert_individuals(trial, number, generation.genomes)
            self._insert_episodes(trial, number, generation)
            self._database.execute("REPLACE INTO optimiser VALUES (?, ?, ?)", (trial, number, state))
            self._database.execute(_KEEP_SESSIONS)
            self._database.execute("DELETE FROM in_flight")

    def keep(self, trial: int, number: int, genomes: FloatArray, episodes: InFlight) -> None:
        """Store episodes of the generation in work, to have them if the run is cut short.

        Unlike a generation they may be lost when the machine loses power; a killed process does not lose them.

        Args:
            trial: From 0.
            number: Of the generation, from 0; the next one of its trial.
            genomes: ``(n, size)``, of the whole generation.
            episodes: Any of its episodes.
        """
        digests = [_sha256_of_genes(genomes[individual]) for individual in episodes.individual]
        columns = [
            *(episodes.individual, episodes.repeat, episodes.hash.view(np.int64), episodes.push_time),
            *(episodes.ode_messages, episodes.unsolved_steps, *episodes.objectives.T, *episodes.homing_time.T),
        ]
        rows = zip(digests, *(column.tolist() for column in columns), strict=True)
        before = f"{trial:d}, {number:d}, {self._session:d}, {float(episodes.seconds)!r}"
        with self._transaction(durable=False):
            self._check_next(trial, number)
            self._database.executemany(
                f"REPLACE INTO in_flight VALUES ({before}, {', '.join('?' * (1 + len(columns)))})", rows
            )

    def begin_session(self, provenance: Mapping[str, Any]) -> None:
        """Note with what the run goes on; nothing is written if it is the same as before.

        Args:
            provenance: See :func:`swarmevo.provenance.provenance`.
        """
        if _lasting(self.session(self._session)) == _lasting(provenance):
            return
        with self._transaction():
            self._database.execute("INSERT INTO session (provenance) VALUES (?)", (json.dumps(provenance),))
        self._session = self._last_session()

    def replace_config(self, config_yaml: str) -> None:
        """Replace the configuration. Whenever the process is killed, the old one or the new one is in force.

        Args:
            config_yaml: The resolved configuration. That the stored generations fit it is the caller's to know.
        """
        digest = _sha256(config_yaml.encode())
        with self._transaction():  # from here on both are accepted
            self._database.execute("UPDATE run SET next_config_sha256 = ?", (digest,))
        with _explained(self.folder):
            _write_atomically(self.config_path, config_yaml)
        self._next_config_sha256 = digest
        self._settle_config()

    def _settle_config(self) -> None:
        """Accept no other configuration than the one that is there."""
        if self._next_config_sha256 is None:
            return
        digest = _sha256(self.config_path.read_bytes())
        with self._transaction():
            self._database.execute("UPDATE run SET config_sha256 = ?, next_config_sha256 = NULL", (digest,))
        self._config_sha256, self._next_config_sha256 = digest, None

    def _check_next(self, trial: int, number: int) -> None:
        if number != (expected := self.generations(trial)):
            raise StoreError(f"{self.folder}: expected generation {expected} of trial {trial}, got {number}")

    def _insert_individuals(self, trial: int, number: int, genomes: FloatArray) -> None:
        genes = [row.tobytes() for row in genomes.astype("<f8")]
        digests = [_sha256_of_genes(row) for row in genomes]
        self._database.executemany(
            "INSERT INTO genome (sha256, genes) VALUES (?, ?) ON CONFLICT (sha256) DO NOTHING",
            zip(digests, genes, strict=True),
        )
        self._database.executemany(
            f"INSERT INTO individual SELECT {trial:d}, {number:d}, ?, id FROM genome WHERE sha256 = ?",
            enumerate(digests),
        )

    def _insert_episodes(self, trial: int, number: int, generation: Generation) -> None:
        individuals, repeats, objectives = generation.objectives.shape
        columns = [
            *np.indices((individuals, repeats)).reshape(2, -1),
            generation.hash.view(np.int64).ravel(),  # SQLite has no unsigned integers
            generation.push_time.ravel(),  # NaN becomes NULL
            generation.ode_messages.ravel(),
            generation.unsolved_steps.ravel(),
            *generation.objectives.reshape(-1, objectives).T,
            *generation.homing_time.reshape(-1, self.robots).T,
        ]
        faults = [generation.faults.get(place) for place in np.ndindex(individuals, repeats)]
        before, places = f"{trial:d}, {number:d}, {self._session:d}", ", ".join("?" * (1 + len(columns)))
        self._database.executemany(
            f"INSERT INTO episode VALUES ({before}, {places})",
            zip(faults, *(column.tolist() for column in columns), strict=True),
        )

    @contextlib.contextmanager
    def _transaction(self, durable: bool = True) -> Iterator[None]:
        """Commit what is done inside, or nothing of it; if ``durable``, so that it survives a power failure."""
        if not self._lock:
            raise StoreError(f"{self.folder}: was opened to be read only; open it with readonly=False")
        with _explained(self.folder):
            self._database.execute(f"PRAGMA synchronous = {'FULL' if durable else 'NORMAL'}")
            self._database.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._database.execute("COMMIT")
            except BaseException:
                if self._database.in_transaction:  # SQLite itself rolls back when the disk is full
                    self._database.execute("ROLLBACK")
                raise

    # ---- reading

    @property
    def config_path(self) -> Path:
        """The resolved configuration."""
        return self.folder / CONFIG_FILE

    @property
    def config_is_intact(self) -> bool:
        """Whether the configuration is the one that the run was made with."""
        with _explained(self.folder):
            digest = _sha256(self.config_path.read_bytes())
        return digest in (self._config_sha256, self._next_config_sha256)

    @_readable
    def session(self, id: int) -> dict[str, Any]:
        """Return with what episodes were run: the provenance of a session.

        Raises:
            StoreError: There is no such session, or it is damaged.
        """
        rows = self._rows("SELECT provenance FROM session WHERE id = ?", id)
        try:
            found = json.loads(rows[0][0])
        except (IndexError, ValueError) as error:
            raise StoreError(f"{self.folder}: the provenance of session {id} is missing or damaged") from error
        if not isinstance(found, dict):
            raise StoreError(f"{self.folder}: the provenance of session {id} is damaged")
        return found

    @_readable
    def sessions(self, trial: int, number: int) -> NDArray[np.int64]:
        """Return ``(n, r)``: the session that ran each episode of a generation."""
        rows = self._rows(
            "SELECT session, individual FROM episode WHERE trial = ? AND generation = ? ORDER BY individual, repeat",
            trial,
            number,
        )
        if not rows:
            raise StoreError(f"{self.folder}: there is no generation {number} of trial {trial}")
        individuals = len({individual for _, individual in rows})
        return np.array([session for session, _ in rows], dtype=np.int64).reshape(individuals, -1)

    @_readable
    def genome_ids(self, trial: int, number: int) -> NDArray[np.int64]:
        """Return ``(n,)``: the id of each individual's genome in a generation."""
        rows = self._rows(
            "SELECT genome FROM individual WHERE trial = ? AND generation = ? ORDER BY number", trial, number
        )
        return np.array([id for (id,) in rows], dtype=np.int64)

    @_readable
    def damaged_genomes(self) -> list[int]:
        """Return the ids of genomes that are not what was stored."""
        rows = self._rows("SELECT id, sha256, genes FROM genome ORDER BY id")
        return [id for id, digest, genes in rows if hashlib.sha256(genes).digest() != digest]

    @_readable
    def in_flight(self, trial: int, number: int, genomes: FloatArray) -> InFlight:
        """Return the kept episodes of a generation that is not complete.

        Args:
            trial: From 0.
            number: Of the generation, from 0.
            genomes: ``(n, size)``: the generation's; episodes of others are left out.
        """
        names = ["push_time", *self._objective_columns(), *self._homing_columns()]
        found = self._rows(
            f"SELECT genome, seconds, individual, repeat, hash, ode_messages, unsolved_steps, {', '.join(names)}"
            " FROM in_flight WHERE trial = ? AND generation = ? ORDER BY individual, repeat",
            trial,
            number,
        )
        digests = dict(enumerate(map(_sha256_of_genes, genomes)))
        rows = [row for row in found if digests.get(row[2]) == row[0]]
        integers = np.array([row[2:7] for row in rows], dtype=np.int64).reshape(-1, 5).T
        reals = np.array([row[7:] for row in rows], dtype=np.float64).reshape(-1, len(names))
        m = len(self.objectives)
        return InFlight(
            individual=integers[0],
            repeat=integers[1],
            hash=integers[2].astype(np.uint64),
            ode_messages=integers[3].astype(np.uint32),
            unsolved_steps=integers[4].astype(np.uint32),
            push_time=reals[:, 0],
            objectives=reals[:, 1 : 1 + m],
            homing_time=reals[:, 1 + m :],
            seconds=max((row[1] for row in rows), default=0.0),
        )

    @_readable
    def trials(self) -> list[int]:
        """Return the trials that have at least one generation, in order."""
        return [trial for (trial,) in self._rows("SELECT DISTINCT trial FROM generation ORDER BY trial")]

    @_readable
    def generations(self, trial: int) -> int:
        """Return how many generations of a trial are stored: 0 to this less one."""
        return int(self._rows("SELECT COUNT(*) FROM generation WHERE trial = ?", trial)[0][0])

    @_readable
    def state(self, trial: int) -> dict[str, Any] | None:
        """Return the optimiser's state after a trial's last stored generation; None: it has none."""
        rows = self._rows("SELECT state FROM optimiser WHERE trial = ?", trial)
        try:
            return decode_state(rows[0][0]) if rows else None
        except ValueError as error:
            raise StoreError(f"{self.folder}: the optimiser's state of trial {trial} is damaged: {error}") from error

    @_readable
    def generation(self, trial: int, number: int) -> Generation:
        """Return a generation as it was appended.

        Raises:
            StoreError: It is not stored.
        """
        seconds = self._rows("SELECT seconds FROM generation WHERE trial = ? AND number = ?", trial, number)
        if not seconds:
            raise StoreError(f"{self.folder}: there is no generation {number} of trial {trial}")
        genes = self._rows(
            "SELECT genes FROM individual JOIN genome ON genome.id = individual.genome"
            " WHERE trial = ? AND generation = ? ORDER BY number",
            trial,
            number,
        )
        names = ["push_time", *self._objective_columns(), *self._homing_columns()]
        rows = self._rows(
            f"SELECT fault, hash, ode_messages, unsolved_steps, {', '.join(names)} FROM episode"
            " WHERE trial = ? AND generation = ? ORDER BY individual, repeat",
            trial,
            number,
        )
        shape = (len(genes), len(rows) // len(genes))
        integers = np.array([row[1:4] for row in rows], dtype=np.int64)
        reals = np.array([row[4:] for row in rows], dtype=np.float64).reshape(*shape, len(names))
        m = len(self.objectives)
        return Generation(
            genomes=np.array([_genes(row) for (row,) in genes]),
            objectives=reals[..., 1 : 1 + m],
            hash=integers[:, 0].astype(np.uint64).reshape(shape),
            push_time=reals[..., 0],
            homing_time=reals[..., 1 + m :],
            ode_messages=integers[:, 1].astype(np.uint32).reshape(shape),
            unsolved_steps=integers[:, 2].astype(np.uint32).reshape(shape),
            seconds=seconds[0][0],
            faults={place: row[0] for place, row in zip(np.ndindex(shape), rows, strict=True) if row[0] is not None},
        )

    def summaries(self, trial: int) -> Iterator[Summary]:
        """Yield every stored generation of a trial in short, in order."""
        for number in range(self.generations(trial)):
            yield self._summary(trial, number)

    @_readable
    def _summary(self, trial: int, number: int) -> Summary:
        means = ", ".join(f"AVG({column})" for column in self._objective_columns())
        rows = self._rows(
            f"SELECT genome, COUNT(*), SUM(ode_messages), SUM(unsolved_steps), {means} FROM individual JOIN episode"
            " ON episode.trial = individual.trial AND episode.generation = individual.generation"
            " AND episode.individual = individual.number"
            " WHERE individual.trial = ? AND individual.generation = ?"
            " GROUP BY individual.number ORDER BY individual.number",
            trial,
            number,
        )
        seconds = self._rows("SELECT seconds FROM generation WHERE trial = ? AND number = ?", trial, number)
        counts = np.array([row[:4] for row in rows], dtype=np.int64)
        return Summary(
            trial=trial,
            number=number,
            genomes=counts[:, 0],
            objectives=np.array([row[4:] for row in rows], dtype=np.float64),
            episodes=int(counts[:, 1].sum()),
            ode_messages=int(counts[:, 2].sum()),
            unsolved_steps=int(counts[:, 3].sum()),
            seconds=seconds[0][0],
        )

    @_readable
    def individuals(self, trial: int | None = None) -> Individuals:
        """Return every genome of a trial, or of all trials, with its means over all its episodes.

        They come ordered by trial and genome id; a genome met in two trials comes twice.
        """
        homing, means = self._homing_columns(), ", ".join(f"AVG({column})" for column in self._objective_columns())
        came = " + ".join(f"COUNT({column})" for column in homing)
        time = " + ".join(f"TOTAL({column})" for column in homing)
        rows = self._rows(
            "SELECT genome, individual.trial, MIN(individual.generation), MAX(individual.generation), COUNT(*),"
            f" {came}, COUNT(push_time), {time}, TOTAL(push_time), {means}"
            " FROM individual JOIN episode"
            " ON episode.trial = individual.trial AND episode.generation = individual.generation"
            " AND episode.individual = individual.number"
            " WHERE ?1 IS NULL OR individual.trial = ?1"
            " GROUP BY individual.trial, genome ORDER BY individual.trial, genome",
            trial,
        )
        counts = np.array([row[:7] for row in rows], dtype=np.int64).reshape(-1, 7).T
        reals = np.array([row[7:] for row in rows], dtype=np.float64).reshape(-1, 2 + len(self.objectives))
        genome, trials, first, last, episodes, homings, pushes = counts
        return Individuals(
            genome=genome,
            trial=trials,
            first_generation=first,
            last_generation=last,
            episodes=episodes,
            objectives=reals[:, 2:],
            homing_rate=homings / (episodes * self.robots),
            homing_time=_mean(reals[:, 0], homings),
            push_rate=pushes / episodes,
            push_time=_mean(reals[:, 1], pushes),
        )

    @_readable
    def all_genomes(self) -> list[int]:
        """Return the ids of all genomes, in order."""
        return [id for (id,) in self._rows("SELECT id FROM genome ORDER BY id")]

    @_readable
    def genome(self, id: int) -> FloatArray:
        """Return the genome ``(size,)`` with an id.

        Raises:
            StoreError: There is none.
        """
        rows = self._rows("SELECT genes FROM genome WHERE id = ?", id)
        if not rows:
            raise StoreError(f"{self.folder}: there is no genome {id}")
        return _genes(rows[0][0])

    @_readable
    def totals(self, trial: int | None = None) -> Totals:
        """Return what a trial, or the run, has cost so far."""
        where = "WHERE ?1 IS NULL OR trial = ?1"
        generations, seconds = self._rows(f"SELECT COUNT(*), TOTAL(seconds) FROM generation {where}", trial)[0]
        individuals, genomes = self._rows(f"SELECT COUNT(*), COUNT(DISTINCT genome) FROM individual {where}", trial)[0]
        episodes, messages, unsolved, faults = self._rows(
            f"SELECT COUNT(*), TOTAL(ode_messages), TOTAL(unsolved_steps), COUNT(fault) FROM episode {where}", trial
        )[0]
        return Totals(generations, individuals, genomes, episodes, int(messages), int(unsolved), seconds, faults)

    def _rows(self, query: str, *parameters: int | None) -> list[tuple[Any, ...]]:
        with _explained(self.folder):
            return self._database.execute(query, parameters).fetchall()

    def _objective_columns(self) -> list[str]:
        return [f"objective_{k}" for k in range(len(self.objectives))]

    def _homing_columns(self) -> list[str]:
        return [f"homing_time_{j}" for j in range(self.robots)]

    def _run(self) -> tuple[int, int, str, str | None]:
        rows = self._rows("SELECT seed, robots, config_sha256, next_config_sha256 FROM run")
        if len(rows) != 1 or not isinstance(rows[0][1], int) or not 1 <= rows[0][1] <= _MOST_ROBOTS:
            raise StoreError(f"{self.folder}: {DATABASE_FILE} is incomplete; it cannot be used")
        return rows[0]

    def _last_session(self) -> int:
        ((last,),) = self._rows("SELECT MAX(id) FROM session")
        if last is None:
            raise StoreError(f"{self.folder}: {DATABASE_FILE} is incomplete; it cannot be used")
        return int(last)

    def _objectives(self) -> tuple[Objective, ...]:
        rows = self._rows("SELECT name, direction, low, high FROM objective ORDER BY number")
        return tuple(Objective(name, direction, (low, high)) for name, direction, low, high in rows)

    def _check_intact(self) -> None:
        """Refuse to write into a folder that would not hold together."""
        ((verdict,),) = self._rows("PRAGMA quick_check(1)")
        if verdict != "ok":
            raise StoreError(f"{self.folder / DATABASE_FILE}: {_ADVICE['SQLITE_CORRUPT']}")
        if not self.config_is_intact:
            raise StoreError(
                f"{self.folder}: {CONFIG_FILE} was changed since the run began; undo that, or begin another run"
            )


def _genes(content: bytes) -> FloatArray:
    genes: FloatArray = np.frombuffer(content, dtype="<f8").astype(np.float64)
    return genes


def _sha256_of_genes(genome: FloatArray) -> bytes:
    return hashlib.sha256(genome.astype("<f8").tobytes()).digest()


def _lasting(provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Return a provenance without what changes from session to session though nothing else does."""
    return {key: value for key, value in provenance.items() if key not in ("created", "config_sha256")}


def _write_atomically(path: Path, text: str) -> None:
    """Replace a file: whenever the process or the machine stops, the old or the new one is there, whole."""
    fresh = path.with_name(f"{path.name}.new")
    with fresh.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    fresh.replace(path)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def _mean(total: FloatArray, count: NDArray[np.int64]) -> FloatArray:
    """Return ``total / count``, NaN where nothing was counted."""
    mean: FloatArray = np.divide(total, count, out=np.full(len(total), math.nan), where=count > 0)
    return mean


# ---- the database ----------------------------------------------------------------------------------------------------


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


_KEEP_SESSIONS: Final = """\
UPDATE episode SET session = in_flight.session FROM in_flight
WHERE (episode.trial, episode.generation, episode.individual, episode.repeat, episode.hash)
    = (in_flight.trial, in_flight.generation, in_flight.individual, in_flight.repeat, in_flight.hash)"""
"""An episode kept from an earlier session stays that session's."""


def _create_database(
    path: Path,
    config_sha256: str,
    provenance: Mapping[str, Any],
    objectives: Sequence[Objective],
    robots: int,
    seed: int,
) -> None:
    with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as database:
        database.executescript(f"BEGIN; {_schema(len(objectives), robots)}")
        database.execute("INSERT INTO run VALUES (?, ?, ?, NULL)", (seed, robots, config_sha256))
        database.execute("INSERT INTO session (provenance) VALUES (?)", (json.dumps(provenance),))
        database.executemany(
            "INSERT INTO objective VALUES (?, ?, ?, ?, ?)",
            [(k, o.name, o.direction, *o.range) for k, o in enumerate(objectives)],
        )
        database.execute("COMMIT")


def _connect(folder: Path, readonly: bool) -> sqlite3.Connection:
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
        _connect(folder, readonly=False).close()  # rolls back what a killed writer left half done
        return _connect(folder, readonly)
    except BaseException:
        database.close()
        raise
    return database


def _prepare_to_write(database: sqlite3.Connection) -> None:
    # WAL: who looks at a run never makes its writer wait. Where the file system cannot, SQLite keeps its other journal.
    with contextlib.suppress(sqlite3.OperationalError):
        database.execute("PRAGMA journal_mode = WAL")
    database.execute("PRAGMA foreign_keys = ON")  # off by default


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


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


_NEEDS_RECOVERY: Final = ("SQLITE_READONLY_ROLLBACK", "SQLITE_READONLY_RECOVERY")

_ADVICE: Final = {
    "SQLITE_IOERR": "cannot be read or written; is the disk full or failing? Everything before is stored",
    "SQLITE_FULL": "the disk is full; free some space, then go on: everything before is stored",
    "SQLITE_READONLY": "is not writable",
    "SQLITE_NOTADB": "is damaged, or no run of swarmevo",
    "SQLITE_CORRUPT": "is damaged; restore it from a copy",
    "SQLITE_BUSY": "is in use by another process; wait for it, or stop it",
    "SQLITE_CANTOPEN": "cannot be opened; is the folder readable, and writable if the run was killed?",
}


@contextlib.contextmanager
def _explained(folder: Path) -> Iterator[None]:
    """Turn what SQLite and the file system report into a StoreError of one line."""
    try:
        yield
    except sqlite3.Error as error:
        code = "_".join(getattr(error, "sqlite_errorname", "").split("_")[:2])  # without its extension
        advice = _ADVICE.get(code, f"failed: {error}")
        raise StoreError(f"{folder / DATABASE_FILE}: {advice}") from error
    except UnicodeDecodeError as error:
        raise StoreError(f"{folder / DATABASE_FILE}: {_ADVICE['SQLITE_CORRUPT']}") from error
    except OSError as error:
        raise StoreError(f"{error.filename or folder}: {error.strerror or error}") from error

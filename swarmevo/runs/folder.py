# SPDX-License-Identifier: BSD-3-Clause
"""A run folder that is open, and held against its checksums before anything is read from it."""

from __future__ import annotations

import contextlib
import functools
import json
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Concatenate, Final, ParamSpec, TypeVar

import numpy as np

from swarmevo.config import Config, load
from swarmevo.errors import StoreError
from swarmevo.evolution.results import Sizes
from swarmevo.protocols import Descriptor, FloatArray, Objective
from swarmevo.runs import checksums, integrity
from swarmevo.runs.database import ADVICE, DATABASE_FILE, RUN, damaged, explained, measured
from swarmevo.runs.schema import episode_columns, in_flight_columns

CONFIG_FILE: Final = "config.yaml"
PROVENANCE_FILE: Final = "provenance.json"
START_FILE: Final = "start.json"

_MOST_ROBOTS: Final = 64  # as in swarmevo.h; more are not in a sound file
_LARGEST: Final = 2**63 - 1  # that SQLite has

_Folder = TypeVar("_Folder", bound="RunFolder")
_Returned = TypeVar("_Returned")
_Given = ParamSpec("_Given")


def readable(
    method: Callable[Concatenate[_Folder, _Given], _Returned],
) -> Callable[Concatenate[_Folder, _Given], _Returned]:
    """Make a method of a store say so when what it reads makes no sense, or is not what was stored."""

    @functools.wraps(method)
    def read(store: _Folder, /, *arguments: _Given.args, **named: _Given.kwargs) -> _Returned:
        store.check()
        with sensible(store.folder):
            return method(store, *arguments, **named)

    return read


@contextlib.contextmanager
def sensible(folder: Path) -> Iterator[None]:
    """Turn the errors of what makes no sense into a StoreError of one line."""
    try:
        yield
    except (ValueError, TypeError, LookupError, ArithmeticError, RecursionError) as error:
        raise StoreError(f"{folder / DATABASE_FILE}: {ADVICE['SQLITE_CORRUPT']}") from error


class RunFolder:
    """A run folder, the configuration of which is the run's.

    What was changed since it was stored is never returned: the first question goes through all generations.
    """

    def __init__(self, folder: Path, database: sqlite3.Connection) -> None:
        self.folder: Final = folder
        self._database: Final = database
        self._is_checked = False
        with explained(folder):
            run, self.objectives, self.descriptors = self._run()
            self.seed, self.robots, self._config_sha256, self._next_config_sha256 = run
            self._check_config()

    @property
    def config_path(self) -> Path:
        """The resolved configuration."""
        return self.folder / CONFIG_FILE

    @functools.cached_property
    def config(self) -> Config:
        """The resolved configuration.

        Raises:
            ConfigError: It was damaged.
        """
        return load(self.config_path)

    def _check_config(self) -> None:
        """Refuse a configuration that is not the one that the run was made with."""
        for _ in range(2):  # a writer may just be replacing it
            digest = checksums.sha256(self.config_path.read_bytes())
            if digest in (self._config_sha256, self._next_config_sha256):
                return
            (*_, self._config_sha256, self._next_config_sha256), *_ = self._run()
        raise StoreError(
            f"{self.config_path}: was changed since the run began; undo that, or restore it from a copy. "
            "Another world is tried with --set"
        )

    def check(self) -> None:
        """Hold what is stored against its checksums, but for genes, which are when they are read; once.

        Raises:
            StoreError: Something is not as it was stored.
        """
        if not self._is_checked:
            with self._snapshot(), sensible(self.folder):
                what = next(integrity.damaged_rows(self._database, self._episode_columns), "")
            if what:
                raise damaged(self.folder, what)
            self._is_checked = True

    def damage(self) -> list[str]:
        """Return all that is not as it was stored, in words."""
        with self._snapshot(), sensible(self.folder):
            verdicts = [text for (text,) in self._database.execute("PRAGMA integrity_check(1)")]
            if verdicts != ["ok"]:
                return [f"the structure of {DATABASE_FILE}"]
            rows = list(integrity.damaged_rows(self._database, self._episode_columns))
            return [*rows, *integrity.damaged_genomes(self._database), *self._damaged_provenance()]

    def _damaged_provenance(self) -> Iterator[str]:
        ((text,),) = self._database.execute("SELECT provenance FROM session WHERE id = 1")
        try:
            same = json.loads((self.folder / PROVENANCE_FILE).read_bytes()) == json.loads(text)
        except (OSError, ValueError):
            same = False
        if not same:
            yield PROVENANCE_FILE

    def start(self) -> FloatArray | None:
        """Return the genomes ``(k, size)`` that the optimisers begin from; None: they begin on their own.

        Raises:
            StoreError: They are not those that the run was begun with.
        """
        if self.config.evolution.start_sha256 is None:
            return None
        for what in self.damaged_start():
            raise StoreError(f"{self.folder / what}: is damaged; restore it from a copy")
        return self._start()

    def _start(self) -> FloatArray:
        return np.array(json.loads((self.folder / START_FILE).read_bytes())["genomes"], dtype=np.float64)

    def damaged_start(self) -> list[str]:
        """Return the name of the file with these genomes, if they are not those that the run was begun with."""
        digest = self.config.evolution.start_sha256
        try:
            same = digest is None or checksums.of_genes(self._start()).hex() == digest
        except (OSError, ValueError, TypeError, LookupError, RecursionError):
            same = False
        return [] if same else [START_FILE]

    @contextlib.contextmanager
    def _snapshot(self) -> Iterator[None]:
        """Read as if nobody wrote meanwhile."""
        with explained(self.folder):
            self._database.execute("BEGIN")
            try:
                yield
            finally:
                if self._database.in_transaction:
                    self._database.execute("ROLLBACK")

    # ---- reading

    def _rows(self, query: str, *parameters: int | None) -> list[tuple[Any, ...]]:
        # What is beyond SQLite's numbers is not stored either.
        given = [None if value is None else max(-_LARGEST, min(value, _LARGEST)) for value in parameters]
        with explained(self.folder):
            return self._database.execute(query, given).fetchall()

    @property
    def _episode_columns(self) -> list[str]:
        return episode_columns(self.sizes)

    @property
    def _in_flight_columns(self) -> list[str]:
        return in_flight_columns(self.sizes)

    @property
    def sizes(self) -> Sizes:
        """Of what an episode leaves."""
        return Sizes(len(self.objectives), self.robots, len(self.descriptors))

    def _run(self) -> tuple[tuple[int, int, str, str | None], tuple[Objective, ...], tuple[Descriptor, ...]]:
        """Return what is known of the whole run: seed, robots and digests of the configuration; what is measured."""
        runs = self._rows(RUN)
        with explained(self.folder):
            found = measured(self._database)
        if len(runs) != 1:
            raise StoreError(f"{self.folder}: {DATABASE_FILE} is incomplete; it cannot be used")
        seed, robots, digest_of_config, next_digest, digest = runs[0]
        run = seed, robots, digest_of_config, next_digest
        if digest != checksums.of_run(run, *found) or not 1 <= robots <= _MOST_ROBOTS:
            raise damaged(self.folder, "what is known of the whole run")
        successes = dict(found.successes)
        return (
            run,
            tuple(
                Objective(name, direction, (low, high), of=basis, success=successes.get(k))
                for k, (name, direction, low, high, basis) in enumerate(found.objectives)
            ),
            tuple(Descriptor(name, (low, high)) for name, low, high in found.descriptors),
        )

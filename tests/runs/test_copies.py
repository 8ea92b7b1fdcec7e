# SPDX-License-Identifier: BSD-3-Clause
"""Case 5: files of a run that is being written, copied one after the other, or only some of them.

A copy may lack the last generations, and then says that it has fewer. It never holds what no run has held.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from runs.test_store import generation, make
from swarmevo.errors import StoreError
from swarmevo.runs.database import DATABASE_FILE
from swarmevo.runs.folder import CONFIG_FILE
from swarmevo.runs.store import PROVENANCE_FILE, Store

GENERATIONS = 4
PAGE = 16384
WAL = f"{DATABASE_FILE}-wal"


class Moment(NamedTuple):
    """What the files of a run held."""

    generations: int
    """Stored by then."""
    database: bytes
    log: bytes


class Watched(NamedTuple):
    folder: Path
    moments: list[Moment]
    """Two for each generation: before it is brought into the database, and after that."""
    content: list[bytes]
    """Of each generation: genomes and objectives."""


def content(folder: Path) -> list[bytes]:
    with Store.open(folder) as store:
        assert not store.damage()
        kept = [store.generation(0, number) for number in range(store.generations(0))]
    return [one.genomes.tobytes() + one.episodes["objective"].tobytes() for one in kept]


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory) -> Watched:
    """A run, and its files at every moment."""
    folder = tmp_path_factory.mktemp("watched") / "run"
    moments: list[Moment] = []
    with pytest.MonkeyPatch.context() as patch, make(folder) as store:
        settle = Store._settle_wal

        def note(number: int) -> None:
            moments.append(Moment(number, *((folder / name).read_bytes() for name in (DATABASE_FILE, WAL))))

        def settle_and_note(self: Store, patience: float) -> None:
            note(self.generations(0))
            settle(self, patience)
            note(self.generations(0))

        patch.setattr(Store, "_settle_wal", settle_and_note)
        for number in range(GENERATIONS):
            store.append(0, number, generation(30, seed=number), "{}")
    return Watched(folder, moments, content(folder))


def copied(watched: Watched, folder: Path, database: bytes, log: bytes | None = None) -> Path:
    """Return a copy of the run with these files."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for name in (CONFIG_FILE, PROVENANCE_FILE):
        shutil.copy(watched.folder / name, folder)
    (folder / DATABASE_FILE).write_bytes(database)
    if log is not None:
        (folder / WAL).write_bytes(log)
    return folder


def test_the_database_alone_is_a_generation_behind_for_a_moment(watched: Watched, tmp_path: Path) -> None:
    for moment in watched.moments:
        is_behind = len(moment.log) > 0
        alone = content(copied(watched, tmp_path / "copy", moment.database))
        assert alone == watched.content[: moment.generations - is_behind]
    assert sum(len(moment.log) > 0 for moment in watched.moments) == GENERATIONS


def test_a_copy_that_is_behind_goes_on_to_the_same_bits(watched: Watched, tmp_path: Path) -> None:
    behind = watched.moments[4]
    assert behind.log
    with Store.open(copied(watched, tmp_path / "copy", behind.database), readonly=False) as store:
        for number in range(store.generations(0), GENERATIONS):
            store.append(0, number, generation(30, seed=number), "{}")
    assert content(tmp_path / "copy") == watched.content


def assert_sound_or_refused(watched: Watched, folder: Path) -> str:
    """Assert that a copy is a run's beginning, or refused, or found to be damaged; return which."""
    try:
        with Store.open(folder) as store:
            if store.damage():
                return "damaged"
        assert content(folder) == watched.content[: len(content(folder))]
    except StoreError:
        return "refused"
    return "sound"


def test_a_log_and_a_database_of_other_moments_are_never_mixed(watched: Watched, tmp_path: Path) -> None:
    found = set()
    for one in watched.moments:
        for other in watched.moments:
            copy = copied(watched, tmp_path / "copy", one.database, other.log)
            found.add(assert_sound_or_refused(watched, copy))
    assert "sound" in found


def test_a_database_that_was_copied_while_it_was_written_is_never_half_old(watched: Watched, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    found = set()
    for before, after in zip(watched.moments[::2], watched.moments[1::2], strict=True):
        pages = [after.database[start : start + PAGE] for start in range(0, len(after.database), PAGE)]
        old = [before.database[start : start + PAGE] for start in range(0, len(before.database), PAGE)]
        for _ in range(25):
            mixed = [old[i] if i < len(old) and rng.random() < 0.3 else page for i, page in enumerate(pages)]
            copy = copied(watched, tmp_path / "copy", b"".join(mixed))
            found.add(assert_sound_or_refused(watched, copy))
    assert found > {"refused"} or found > {"damaged"}

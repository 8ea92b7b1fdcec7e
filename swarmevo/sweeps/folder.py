# SPDX-License-Identifier: BSD-3-Clause
"""The folder of a sweep.

It holds ``sweep.json``, what is swept with the resolved configuration of each setting; for each setting a folder, and
in it a run folder ``seed-N`` for each seed; ``sweep.html``, the page about it; and ``sweep.lock`` while somebody runs
it. What is done and what is missing is known from the runs alone.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Final, Literal

import pydantic

from swarmevo.config import WORLD, Config
from swarmevo.errors import ConfigError, StoreError
from swarmevo.runs import files
from swarmevo.runs.database import DATABASE_FILE
from swarmevo.runs.lock import WriterLock
from swarmevo.sweeps.grid import Setting

FILE: Final = "sweep.json"
PAGE: Final = "sweep.html"
LOCK: Final = "sweep.lock"
_LEFT: Final = re.compile(rf"\.new-|{re.escape(LOCK)}\Z")
"""What may be there before anything is: of a process that was killed."""
_TASK: Final = (*WORLD, "fitness", "worlds", "vary")
"""Of a configuration: what its episodes are, and what they are judged by."""


class _Setting(pydantic.BaseModel):
    name: str = pydantic.Field(pattern=r"^[A-Za-z0-9_+=,-][A-Za-z0-9_.+=,-]*$")
    values: dict[str, str]
    config: Config


class _Manifest(pydantic.BaseModel):
    format: Literal[1] = 1
    grid: dict[str, list[str]]
    seeds: list[int] = pydantic.Field(min_length=1)
    settings: list[_Setting] = pydantic.Field(min_length=1)


@dataclass(frozen=True)
class Cell:
    """A run of a sweep."""

    setting: Setting
    seed: int
    folder: Path
    """Of the run; not there before it is begun."""

    @property
    def config(self) -> Config:
        """Of the run."""
        return self.setting.seeded(self.seed)

    @property
    def name(self) -> str:
        """In the sweep's folder."""
        return f"{self.setting.name}/{self.folder.name}"


class Sweep:
    """What is swept, and where."""

    def __init__(self, folder: Path, settings: Sequence[Setting], seeds: Sequence[int]) -> None:
        self.folder: Final = folder
        self.settings: Final = list(settings)
        self.seeds: Final = list(seeds)

    @property
    def keys(self) -> list[str]:
        """Of the grid."""
        return list(self.settings[0].values)

    @property
    def grid(self) -> dict[str, list[str]]:
        """The values of each key, as they were given."""
        return {key: list(dict.fromkeys(one.values[key] for one in self.settings)) for key in self.keys}

    @functools.cached_property
    def cells(self) -> list[Cell]:
        """All runs: those of the first seed first, so that each setting soon has one."""
        return [
            Cell(setting, seed, self.folder / setting.name / f"seed-{seed}")
            for seed in self.seeds
            for setting in self.settings
        ]

    @property
    def is_of_one_task(self) -> bool:
        """Whether the world and the fitness are the same in all settings: else their runs are not to be compared."""
        first, *others = (one.config for one in self.settings)
        return all(getattr(one, part) == getattr(first, part) for one in others for part in _TASK)

    def create(self, there: Sweep | None = None) -> None:
        """Make the folder; or make this sweep of one that is there already, whose runs stay as they are.

        Args:
            there: As it was found.

        Raises:
            ConfigError: There is something else.
            OutputError: It cannot be written.
            StoreError: Somebody else makes, extends or runs the sweep.
        """
        wanted, before = self._text(), there and there._text()
        if wanted == before:
            return
        with files.folder_made(self.folder), self.locked():
            now = begun(self.folder)
            if (now and now._text()) != before:
                raise StoreError(f"{self.folder}: somebody else has just made or extended it; give the command again")
            files.write(self.folder / FILE, wanted)

    @classmethod
    def open(cls, folder: Path) -> Sweep:
        """Return the sweep of a folder.

        Raises:
            StoreError: It is none, or is damaged.
        """
        file = folder / FILE
        try:
            found = _Manifest.model_validate_json(file.read_bytes())
            settings = [Setting(one.name, one.values, one.config) for one in found.settings]
            if any(list(one.values) != list(found.grid) for one in settings):
                raise ValueError
        except OSError as error:
            raise StoreError(f"{file}: cannot be read: {error.strerror}") from error
        except ValueError as error:
            raise StoreError(
                f"{file}: expected what swarmevo sweep of this version wrote, got something else; restore a copy"
            ) from error
        return cls(folder, settings, found.seeds)

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Keep others from running the sweep.

        Raises:
            StoreError: Somebody does.
        """
        lock = WriterLock(self.folder / LOCK)
        try:
            yield
        finally:
            lock.release()

    def _text(self) -> str:
        """Return what is in the file."""
        settings = [_Setting(name=one.name, values=dict(one.values), config=one.config) for one in self.settings]
        return _Manifest(grid=self.grid, seeds=self.seeds, settings=settings).model_dump_json(indent=2) + "\n"


def begun(folder: Path | None) -> Sweep | None:
    """Return the sweep that was begun in a folder; None: nothing was.

    Raises:
        ConfigError: There is something else.
        StoreError: The sweep is damaged.
    """
    if folder is None or not os.path.lexists(folder):
        return None
    if is_sweep(folder):
        return Sweep.open(folder)
    if not os.path.isdir(folder) or not all(_LEFT.match(name) for name in os.listdir(folder)):
        raise ConfigError(f"--out {folder}: exists already and is no sweep; choose another name")
    return None


def fresh(name: str) -> Path:
    """Make an empty folder in ``runs`` for a sweep of a configuration with this name, which no other sweep takes.

    Raises:
        OutputError: It cannot be made.
    """
    first = f"{name}-sweep-{datetime.now():%Y%m%d-%H%M%S}"
    for i in itertools.count(1):
        folder = Path("runs") / (f"{first}-{i}" if i > 1 else first)
        with files.naming(folder), contextlib.suppress(FileExistsError):
            folder.mkdir(parents=True)
            break
    return folder


def is_sweep(folder: Path) -> bool:
    """Whether a folder is that of a sweep."""
    return os.path.isfile(folder / FILE)


def groups(folders: Sequence[Path]) -> list[Path]:
    """Return folders with the folders of its settings in place of each sweep."""
    found: list[Path] = []
    for folder in folders:
        found += [folder / one.name for one in Sweep.open(folder).settings] if is_sweep(folder) else [folder]
    return found


def runs_of(folder: Path) -> list[Path]:
    """Return the runs in a folder of runs, such as that of a setting; the folder itself if it is a run or has none."""
    if os.path.isfile(folder / DATABASE_FILE):
        return [folder]
    within = sorted(folder.glob(f"*/{DATABASE_FILE}"), key=lambda file: (len(file.parent.name), file.parent.name))
    return [file.parent for file in within if not file.parent.name.startswith(".")] or [folder]

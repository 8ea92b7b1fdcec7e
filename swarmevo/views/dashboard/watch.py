# SPDX-License-Identifier: BSD-3-Clause
"""The runs in a folder, looked at again and again: those that appear, go on, end or vanish."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from swarmevo.analysis.following import Following, Progress
from swarmevo.plugins.calls import one_line
from swarmevo.printable import printable
from swarmevo.runs.database import DATABASE_FILE
from swarmevo.runs.folder import CONFIG_FILE, PROVENANCE_FILE
from swarmevo.views.dashboard import facts

DEPTH: Final = 3
"""Folders that a run may be below the one that is watched."""
MOST_FOLDERS: Final = 2000
"""That are looked into for runs."""
FIRST_LOOKS_AT_ONCE: Final = 20
"""At runs that nobody has opened, before the page is told of them: half a second if they are large."""
EPISODES_AT_ONCE: Final = 10_000
"""That are read of a run before the page is told: about half a second."""


@dataclass(frozen=True)
class Snapshot:
    """What the page is told: JSON."""

    runs: str = ""
    """All of them in short; "": nobody has looked yet."""
    details: Mapping[str, str] = field(default_factory=dict)
    """Of the runs that somebody looks at, by id."""


class _Watched:
    def __init__(self, name: str, folder: Path) -> None:
        self.name, self.run = name, Following(folder)
        self.detail = ""
        self.is_new = True
        self.shown: tuple[Progress, int] | None = None  # what ``detail`` is of: the progress, and what is left to read


class Watch:
    """A folder of runs. Belongs to one thread at a time.

    Args:
        place: The folder, or a run's own.
    """

    def __init__(self, place: Path) -> None:
        self.place: Final = place
        self._runs: dict[str, _Watched] = {}

    @property
    def ids(self) -> list[str]:
        """Of the runs that were there at the last look."""
        return list(self._runs)

    def folder(self, id: str) -> Path | None:
        """Return the folder of a run; None: there is no such run."""
        watched = self._runs.get(id)
        return watched.run.folder if watched else None

    def look(self, opened: Collection[str] = ()) -> tuple[Snapshot, bool]:
        """Look at all runs, and read what is new of those that somebody has opened.

        Returns:
            What there is, and whether there is more to read at once.
        """
        found, is_all = _find(self.place)
        runs = {id: self._runs.get(id, _Watched(*place)) for id, place in found.items()}
        self._runs = runs
        new = [id for id, watched in runs.items() if watched.is_new and id not in opened]
        later = set(new[FIRST_LOOKS_AT_ONCE:])
        listed = [_listed(id, watched, is_looked_at=id not in later) for id, watched in runs.items()]
        listed.sort(key=lambda entry: facts.order(entry["name"], runs[entry["id"]].run.progress))
        details = {id: _detail(id, runs[id]) for id in opened if id in runs}
        note = "" if is_all else f"There are more than {MOST_FOLDERS} folders here; not all were looked into."
        every = _json(
            {
                "name": printable(self.place.resolve().name),
                "place": printable(str(self.place)),
                "runs": listed,
                "note": note,
            }
        )
        return Snapshot(every, details), bool(later) or any(runs[id].run.untaken for id in details)


def _listed(id: str, watched: _Watched, is_looked_at: bool) -> dict[str, Any]:
    """Return a run in short. What makes no sense to us, of whatever a folder holds, is that run's fault alone."""
    try:
        if is_looked_at:
            watched.is_new = False
            watched.run.look()
        return facts.listed(id, watched.name, watched.run)
    except Exception as error:
        watched.run.progress = Progress("broken", one_line(error))
        return facts.listed(id, watched.name, watched.run)


def _detail(id: str, watched: _Watched) -> str:
    """Return all that the page shows of a run, after some more of it was read; made anew if something has changed."""
    try:
        watched.run.take(EPISODES_AT_ONCE)
        state = watched.run.progress, watched.run.untaken
        if watched.shown != state:
            watched.shown, watched.detail = state, _json(facts.detail(id, watched.name, watched.run))
    except Exception as error:
        watched.run.progress = Progress("broken", one_line(error))
        watched.detail = _json({**facts.listed(id, watched.name, watched.run), "untaken": 0})
    return watched.detail


def _json(content: Mapping[str, Any]) -> str:
    return json.dumps(content, allow_nan=False, separators=(",", ":"))


# ---- which runs there are --------------------------------------------------------------------------------------------


def _find(place: Path) -> tuple[dict[str, tuple[str, Path]], bool]:
    """Return the name and folder of each run by its id, which it keeps; and whether all folders were looked into."""
    if _is_run(place):
        return {_id(""): (place.resolve().name, place)}, True
    left = MOST_FOLDERS

    def runs(folder: Path, depth: int) -> Iterator[Path]:
        nonlocal left
        for path, is_link in _folders(folder):
            if (left := left - 1) < 0:
                return
            if _is_run(path):
                yield path
            elif depth < DEPTH and not is_link:
                yield from runs(path, depth + 1)

    found = {_id(path.relative_to(place)): (str(path.relative_to(place)), path) for path in runs(place, 1)}
    return found, left >= 0


def _folders(folder: Path) -> list[tuple[Path, bool]]:
    """Return the folders in a folder, and whether each is a link; none if it cannot be read, or has just gone."""
    try:
        with os.scandir(folder) as entries:
            kept = [entry for entry in entries if not entry.name.startswith(".") and entry.is_dir()]
            return sorted((folder / entry.name, entry.is_symlink()) for entry in kept)
    except OSError:
        return []


def _is_run(folder: Path) -> bool:
    """Return whether a folder is a run, or what is left of one."""
    database, *others = (os.path.lexists(folder / name) for name in (DATABASE_FILE, CONFIG_FILE, PROVENANCE_FILE))
    return database or all(others)


def _id(path: Path | str) -> str:
    """Return what names a run in an address, whatever its folder is called."""
    return hashlib.sha256(os.fsencode(path)).hexdigest()[:16]

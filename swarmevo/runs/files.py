# SPDX-License-Identifier: BSD-3-Clause
"""Files that are whole, whenever a process or a machine stops."""

from __future__ import annotations

import os
from pathlib import Path


def write_atomically(path: Path, text: str) -> None:
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


class WatchedFile:
    """A file that is being written, and could be lost meanwhile without any error of the operating system.

    A process can go on writing a file that has no name any more, or that somebody made shorter.
    """

    def __init__(self, path: Path) -> None:
        self._path = path.absolute()
        self._known = self._path.stat()

    def trouble(self) -> str:
        """Return what has happened to the file, in words; "": nothing."""
        try:
            now = self._path.stat()
        except FileNotFoundError:
            now = None
        except OSError as error:
            return f"cannot be reached any more: {error.strerror}"
        if now is None or not os.path.samestat(now, self._known):
            return "was deleted, moved or replaced while the run was writing it; if it was moved, resume it there"
        if now.st_size < self._known.st_size:
            return "was truncated while the run was writing it; restore it from a copy"
        self._known = now
        return ""

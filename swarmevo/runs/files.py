# SPDX-License-Identifier: BSD-3-Clause
"""Every file that we write is whole or not there, whenever a process or a machine stops or a disk is full."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final, TextIO

from swarmevo.errors import OutputError

_FULL: Final = {errno.ENOSPC: "no space left on", errno.EDQUOT: "no quota left on"}


@contextmanager
def written(file: Path, fresh_only: bool = False) -> Iterator[Path]:
    """Give a path to write to, and put what was written there in the place of a file once it is complete.

    It has the file's name, in a folder beside it that does not outlive the block. Behind a symbolic link, the file that
    it leads to is replaced. A device or a pipe is written to directly.

    Args:
        file: To make or to replace. Untouched if anything fails.
        fresh_only: Refuse to replace it.

    Raises:
        OutputError: It is there and not to be replaced, or cannot be written.
    """
    place = Path(os.path.realpath(file))
    with naming(file):
        if fresh_only and os.path.lexists(file):
            raise FileExistsError(errno.EEXIST, "exists already and is never overwritten; choose another name")
        if os.path.exists(place) and not os.path.isfile(place):
            yield place
            return
        if os.path.exists(place) and not os.access(place, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        with tempfile.TemporaryDirectory(prefix=".new-", dir=place.parent, ignore_cleanup_errors=True) as folder:
            fresh = Path(folder) / place.name
            yield fresh
            _sync(fresh)
            if os.path.exists(place):
                shutil.copymode(place, fresh)
            fresh.replace(place)
        with suppress(OSError):  # some network file systems cannot
            _sync(place.parent)


@contextmanager
def opened(file: Path, fresh_only: bool = False) -> Iterator[TextIO]:
    """Give a stream of text in UTF-8, which is kept as :func:`written` does; escapes stand for what is no Unicode.

    Raises:
        OutputError: As :func:`written`.
    """
    with written(file, fresh_only) as fresh, fresh.open("w", encoding="utf-8", errors="backslashreplace") as stream:
        yield stream


def write(file: Path, text: str) -> None:
    """Make or replace a file of text, as :func:`opened` does.

    Raises:
        OutputError: As :func:`written`.
    """
    with opened(file) as stream:
        stream.write(text)


@contextmanager
def folder_made(folder: Path) -> Iterator[None]:
    """Make a folder and those above it, where they are missing; if the block fails, remove what was made and is empty.

    Raises:
        OutputError: It cannot be made.
    """
    made = [path for path in (folder, *folder.parents) if not os.path.lexists(path)]
    try:
        with naming(folder):
            if os.path.lexists(folder) and not os.path.isdir(folder):
                raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR))
            folder.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        for path in made:
            with suppress(OSError):  # not all of them need have been made
                path.rmdir()
        raise


@contextmanager
def naming(place: Path | str) -> Iterator[None]:
    """Turn what the system refuses into an OutputError of one line that names the place.

    Raises:
        OutputError: The system refused something.
    """
    try:
        yield
    except OSError as error:
        raise OutputError(refusal(error, place)) from error


def refusal(error: OSError, place: Path | str) -> str:
    """Return what the system said of a file or folder, in one line."""
    if error.errno in _FULL:
        folder = place if os.path.isdir(place) else os.path.dirname(os.path.abspath(place))
        return f"{_FULL[error.errno]} {folder}; free some, then try again"
    return f"{place}: {error.strerror or error}"


def _sync(path: Path) -> None:
    """Have a file, or the names in a folder, on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


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

# SPDX-License-Identifier: BSD-3-Clause
"""One writer at a time."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import socket
import time
from pathlib import Path
from typing import Final, NamedTuple

from swarmevo.errors import StoreError

_NO_LOCKS: Final = {errno.ENOSYS, errno.ENOTSUP, errno.ENOLCK}
_LONGEST_OWNER: Final = 200  # [bytes]
_LOOK_SECONDS: Final = 0.5  # that a reader's look at the lock may take
_GLANCE_SECONDS: Final = 0.05


class WriterLock:
    """Keeps a second writer out of a run folder.

    The lock is the operating system's (``flock``) and ends with its process, however that ends. It is taken on a file
    of its own: closing any handle of the database's file would drop SQLite's own locks. The file is removed by a writer
    that ends as it should: one that is left tells of a writer that did not.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._handle = self._acquire()
        self.left_by: Final = _owner(self._handle)
        """The writer that was there before and ended without removing its lock; "": none."""
        with contextlib.suppress(OSError):  # only who we are; on a full disk the lock holds all the same
            os.ftruncate(self._handle, 0)
            os.write(self._handle, f"process {os.getpid()} on {socket.gethostname()}".encode())

    def _acquire(self) -> int:
        deadline = time.monotonic() + _LOOK_SECONDS
        while True:
            handle = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o644)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                owner = _owner(handle) or "another process"
                os.close(handle)
                if time.monotonic() < deadline:
                    time.sleep(_GLANCE_SECONDS)
                    continue
                raise StoreError(f"{self._path.parent}: {owner} is writing it; wait for that, or stop it") from error
            except OSError as error:
                os.close(handle)
                if error.errno not in _NO_LOCKS:
                    raise
                raise StoreError(
                    f"{self._path.parent}: expected a file system with locks (flock), to keep a second writer out, but "
                    "this one has none; mount it with locks, or put the run on another one"
                ) from error
            if self._is_still_there(handle):
                return handle
            os.close(handle)  # its last owner removed the file while we waited at it: try the new one

    def _is_still_there(self, handle: int) -> bool:
        try:
            return os.path.samestat(os.fstat(handle), os.stat(self._path))
        except FileNotFoundError:
            return False

    def release(self) -> None:
        """Let the next writer in."""
        with contextlib.suppress(OSError):
            if self._is_still_there(self._handle):  # else it is another run's, where this one was moved away
                self._path.unlink()
        os.close(self._handle)


class Writer(NamedTuple):
    """Who writes, or wrote, a run."""

    name: str
    """Of the process; "": nobody, or the last one ended as it should."""
    is_there: bool
    """Whether it writes now; else it ended without removing its lock."""


def writer(path: Path) -> Writer:
    """Return who has the lock of a file, or has left it."""
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError:
        return Writer("", False)
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)  # for a moment, in which a writer waits
        return Writer(_owner(handle), False)
    except BlockingIOError:
        return Writer(_owner(handle), True)
    except OSError:
        return Writer("", False)
    finally:
        os.close(handle)


def left_by(path: Path) -> str:
    """Return the writer that ended without removing its lock; "": there is none, or somebody writes now."""
    name, is_there = writer(path)
    return "" if is_there else name


def _owner(handle: int) -> str:
    return os.pread(handle, _LONGEST_OWNER, 0).decode(errors="replace")

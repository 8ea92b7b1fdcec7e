# SPDX-License-Identifier: BSD-3-Clause
"""What the processes of a sweep tell each other: whether to stop, how many threads each has, how far each run is.

Some numbers in memory that all of them have mapped; it is gone with the process that made it.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

import numpy as np

_STOP, _SHARE, _FIRST_RUN = 0, 1, 2
_BYTES: Final = np.dtype(np.int64).itemsize


class Board:
    """The numbers, in the memory at ``path``."""

    def __init__(self, path: str) -> None:
        self.path: Final = path
        self._numbers = np.memmap(path, dtype=np.int64, mode="r+")

    @property
    def stop(self) -> bool:
        """Whether all are to stop."""
        return bool(self._numbers[_STOP])

    @stop.setter
    def stop(self, wanted: bool) -> None:
        self._numbers[_STOP] = wanted

    @property
    def share(self) -> int:
        """How many threads each process has, at least 1."""
        return max(1, int(self._numbers[_SHARE]))

    @share.setter
    def share(self, threads: int) -> None:
        self._numbers[_SHARE] = threads

    def note(self, run: int, stored: int, made: int) -> None:
        """Say how many generations of a run are stored, and how many of them this session made; runs count from 0."""
        place = _FIRST_RUN + 2 * run
        self._numbers[place : place + 2] = stored, made

    @property
    def stored(self) -> int:
        """How many generations are stored, of all runs that were looked at."""
        return int(self._numbers[_FIRST_RUN::2].sum())

    @property
    def made(self) -> int:
        """How many of them this session made."""
        return int(self._numbers[_FIRST_RUN + 1 :: 2].sum())


@contextmanager
def new(runs: int) -> Iterator[Board]:
    """Make a board for so many runs, which is there within the block."""
    memory = os.memfd_create("swarmevo-sweep")
    try:
        os.ftruncate(memory, _BYTES * (_FIRST_RUN + 2 * runs))
        yield Board(f"/proc/{os.getpid()}/fd/{memory}")
    finally:
        os.close(memory)

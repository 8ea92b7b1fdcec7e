# SPDX-License-Identifier: BSD-3-Clause
"""The process of the command ``swarmevo``: stdout is ours, and no plugin ends it or keeps it alive.

What plugins print goes to stderr, so that results can be piped. Python's ``print`` is told apart by the thread that
calls it; what writes to the file descriptor itself, such as compiled code, finds stderr there.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import IO, Any, NoReturn


class _Stdout:
    """Writes to stdout, and what a plugin or another thread than the main one writes, to stderr."""

    def __init__(self, ours: IO[str]) -> None:
        self._ours = ours

    def __getattr__(self, name: str) -> Any:
        is_main = threading.current_thread() is threading.main_thread()
        return getattr(self._ours if is_main and not _in_plugin() else sys.stderr, name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._ours)


def _in_plugin() -> bool:
    calls = sys.modules.get("swarmevo.plugins.calls")  # --help needs no plugins and does not wait for their import
    return calls is not None and calls.in_plugin()


@contextmanager
def own_stdout() -> Iterator[None]:
    """Keep plugins from printing to stdout."""
    before = sys.stdout
    if before is None:  # it was closed when Python started
        yield
        return
    sys.stdout = _Stdout(before)  # all that is asked of it, it asks of a real one
    try:
        yield
    finally:
        sys.stdout = before


@contextmanager
def own_exit() -> Iterator[None]:
    """Have ``os._exit`` in a plugin raise ``SystemExit``, which is its fault: it would end a run as if all were well.

    A process that a plugin forks may end like that, and what is no plugin.
    """
    end, process = os._exit, os.getpid()

    def refuse(status: int) -> NoReturn:
        if _in_plugin() and os.getpid() == process:
            raise SystemExit(f"os._exit({status})")
        end(status)

    os._exit = refuse
    try:
        yield
    finally:
        os._exit = end


def run(main: Callable[[], NoReturn]) -> NoReturn:
    """Be the process of ``main``."""
    _own_descriptor()
    try:
        main()
    except SystemExit as end:
        _leave(end.code if isinstance(end.code, int) else int(end.code is not None))
        raise


def _own_descriptor() -> None:
    """Keep file descriptor 1 from whatever writes to it directly."""
    if sys.stderr is None:  # descriptor 2 is free: a copy of stdout would get it
        return
    with suppress(OSError, AttributeError):  # stdout is closed
        encoding, errors = sys.stdout.encoding, sys.stdout.errors
        sys.stdout = open(  # noqa: SIM115 - for the rest of the process
            os.dup(1), "w", encoding=encoding, errors=errors, buffering=1 if sys.stdout.isatty() else -1
        )
        os.dup2(2, 1)


def _leave(code: int) -> None:
    """End the process at once if threads or processes would keep it: those that a plugin left, or that hang."""
    others = [thread for thread in threading.enumerate() if thread is not threading.main_thread()]
    processes = sys.modules.get("multiprocessing")
    children = processes.active_children() if processes else []
    if not children and all(thread.daemon for thread in others):
        return
    for child in children:
        child.terminate()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(code)

# SPDX-License-Identifier: BSD-3-Clause
"""Calls of a stranger's code: whatever it raises is its fault, and what it does to the process is undone.

What raises nothing, because it hangs or ends the process, is told by the names of the calls in work: :func:`in_work` in
this process, :func:`note_on` for another one.

Exceptions that are meant to end a process or a generator (``SystemExit``, ``KeyboardInterrupt``, ``GeneratorExit``) are
faults like any other, or ``sys.exit(0)`` in a fitness function would end a run as if all were well.
"""

from __future__ import annotations

import mmap
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Final

from swarmevo.errors import SwarmevoError

LONGEST_MESSAGE: Final = 2000
"""Characters of an exception's message that are shown and stored."""


class StopNow(KeyboardInterrupt):
    """A signal asked to stop while a plugin worked in the main thread, in the call that it names. No fault of it."""

    def __init__(self) -> None:
        super().__init__(*_CALLS.names[-1:])


class _Calls(threading.local):
    def __init__(self) -> None:
        self.names: list[str] = []
        """Plugin calls that this thread is in, the innermost last."""


_CALLS = _Calls()
_LOCK = threading.Lock()
_in_work: list[str] = []  # plugin calls, of all threads
_home: str | None = None  # where the process was before the first of them
_slate: mmap.mmap | None = None  # where the main thread's innermost call is noted


def _forked() -> None:
    global _LOCK, _slate
    _LOCK = threading.Lock()  # a thread of the parent may hold the other one
    _slate = None  # it is the parent's


os.register_at_fork(after_in_child=_forked)


def in_plugin() -> bool:
    """Return whether this thread is in a plugin's code."""
    return bool(_CALLS.names)


def in_work() -> list[str]:
    """Return the plugin calls that the process is in, of all threads."""
    with _LOCK:
        return _in_work.copy()


def note_on(slate: mmap.mmap) -> None:
    """Note the call that the main thread is in, from now on, where another process can read it (:func:`noted`)."""
    global _slate
    _slate = slate


def noted(slate: mmap.mmap) -> str:
    """Return the call that another process is, or was, in; "": none."""
    return slate[:].rstrip(b"\0").decode(errors="replace")


def _note() -> None:
    if _slate is not None and threading.current_thread() is threading.main_thread():
        name = _CALLS.names[-1] if _CALLS.names else ""
        _slate[:] = name.encode(errors="replace")[: len(_slate)].ljust(len(_slate), b"\0")


@contextmanager
def blamed(explain: Callable[[BaseException], SwarmevoError], call: str = "a plugin") -> Iterator[None]:
    """Turn whatever is raised here into the error that ``explain`` makes of it.

    The working directory is what it was afterwards. A fork that comes out of here, not its parent, ends.

    Args:
        explain: Makes the error.
        call: The name of what is called, with its plugin.

    Raises:
        StopNow: A signal asked to stop.
        KeyboardInterrupt: Ctrl-C, where nobody but Python listens to it.
    """
    process = os.getpid()
    _enter(call)
    try:
        yield
    except StopNow:
        raise
    except BaseException as error:
        if _is_ctrl_c(error):
            raise
        told = explain(error)
        if told is error:
            raise
        raise told from error
    finally:
        _leave(call)
        if os.getpid() != process:
            _end_fork(explain)


def _enter(call: str) -> None:
    global _home
    with _LOCK:
        if not _in_work:
            _home = _directory()
        _in_work.append(call)
    _CALLS.names.append(call)
    _note()


def _leave(call: str) -> None:
    _CALLS.names.pop()
    _note()
    with _LOCK:
        _in_work.remove(call)
        if _home is not None and _directory() != _home:
            with suppress(OSError):
                os.chdir(_home)


def _directory() -> str | None:
    with suppress(OSError):  # it was deleted
        return os.getcwd()
    return None


def _is_ctrl_c(error: BaseException) -> bool:
    """Return whether this is Python's own answer to SIGINT; elsewhere and otherwise a plugin made it."""
    return (
        isinstance(error, KeyboardInterrupt)
        and threading.current_thread() is threading.main_thread()
        and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    )


def _end_fork(explain: Callable[[BaseException], SwarmevoError]) -> None:
    """End a process that a plugin forked and let out of its code: two must not go on with one run."""
    with suppress(Exception):
        returned = explain(RuntimeError("a fork came out of the plugin; it was ended, the run goes on"))
        os.write(2, f"warning: {returned}\n".encode())  # not print: a thread of the parent may hold its lock
    os._exit(1)


def one_line(error: BaseException) -> str:
    """Return an exception's type and message as one line, which can be printed and stored."""
    return f"{type(error).__name__}: {message(error)}".rstrip(": ")


def message(error: BaseException) -> str:
    """Return an exception's message as one line, which can be printed and stored: what has no UTF-8 is escaped."""
    try:
        text = str(error)
    except BaseException as second:  # a stranger's __str__
        text = f"its message cannot be read, {type(second).__name__}"
    line = " ".join(text.encode("utf-8", "backslashreplace").decode().replace("\0", "\\x00").split())
    return line if len(line) <= LONGEST_MESSAGE else f"{line[:LONGEST_MESSAGE]}..."

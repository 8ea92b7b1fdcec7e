# SPDX-License-Identifier: BSD-3-Clause
"""Calls in another process, which can be killed when it hangs and may crash without harm.

A thread that hangs inside a stranger's code cannot be ended; a process can. Each call borrows an idle child process or
starts one. What goes to and fro is pickled, between this process and children that it started itself. In memory that
both have mapped, a child notes the plugin call that it is in: what hangs or crashes there can be named.
"""

from __future__ import annotations

import mmap
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import Any, Final, TypeVar

from swarmevo.plugins import calls

T = TypeVar("T")

_GLANCE_SECONDS: Final = 0.1  # between two looks whether the call was cancelled
_SLATE_BYTES: Final = 256

_idle: list[_Child] = []  # a cache: children that wait for their next call
_idle_lock = threading.Lock()


class Lost(Exception):  # noqa: N818 - what became of the call
    """The child gave no answer: it took too long, or it died. The message goes on after what was called."""


class Cancelled(Exception):  # noqa: N818 - asked for, not an error
    """The call was cancelled."""


@contextmanager
def child() -> Iterator[_Child]:
    """Borrow a child process."""
    with _idle_lock:
        borrowed = _idle.pop() if _idle else None
    borrowed = borrowed or _Child()
    try:
        yield borrowed
    finally:
        if borrowed.is_sound:
            with _idle_lock:
                _idle.append(borrowed)
        else:
            borrowed.kill()


def dismiss() -> None:
    """End the idle children."""
    with _idle_lock:
        dismissed = _idle.copy()
        _idle.clear()
    for one in dismissed:
        one.kill()


def _forget() -> None:
    """Leave the children to the parent: two processes must not talk to one."""
    global _idle_lock
    _idle.clear()
    _idle_lock = threading.Lock()  # a thread of the parent may hold the other one


os.register_at_fork(after_in_child=_forget)


class _Child:
    """A process that does what it is told, one call after the other."""

    def __init__(self) -> None:
        here, there = socket.socketpair()
        self.is_sound = True
        self._connection = Connection(here.detach())
        memory = os.memfd_create("swarmevo")
        os.ftruncate(memory, _SLATE_BYTES)
        self._slate = mmap.mmap(memory, _SLATE_BYTES)
        handles = there.fileno(), memory
        with there, open(memory, "rb"):
            command = f"from swarmevo.evolution.processes import serve; serve{handles}"
            self._process = subprocess.Popen(
                [sys.executable, "-c", command], pass_fds=handles, env=_environment(), stdin=subprocess.DEVNULL
            )

    def call(
        self, function: Callable[..., T], arguments: tuple[object, ...], limit: float, cancelled: Callable[[], bool]
    ) -> T:
        """Return ``function(*arguments)``.

        Args:
            function: Of a module; it, its arguments and what it returns can be pickled.
            arguments: Of the function.
            limit: [s] that it may take.
            cancelled: Asked now and then.

        Raises:
            Cancelled: ``cancelled`` said so.
            Lost: It took too long, or the process died.
            Exception: Whatever ``function`` raises.
        """
        self.is_sound = False  # until the answer is there
        deadline = time.monotonic() + limit
        try:
            self._connection.send((function, arguments))
            while not self._connection.poll(max(0.0, min(_GLANCE_SECONDS, deadline - time.monotonic()))):
                if cancelled():
                    raise Cancelled
                if time.monotonic() >= deadline:
                    raise Lost(f"took longer than its time limit of {limit:g} s{self._place()}")
            value, error = self._connection.recv()
        except (EOFError, OSError) as gone:
            raise Lost(f"ended its process: {_how_it_ended(self._process)}{self._place()}") from gone
        self.is_sound = True
        if error is not None:
            raise error
        result: T = value
        return result

    def _place(self) -> str:
        """Return in which plugin call the process is, or ended."""
        call = calls.noted(self._slate)
        return f", in {call}" if call else ""

    def kill(self) -> None:
        """End the process at once."""
        self._connection.close()
        self._process.kill()
        self._process.wait()
        self._slate.close()


def _environment() -> Mapping[str, str]:
    """Return the environment of a child that finds the same modules and plugins."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


def _how_it_ended(process: subprocess.Popen[bytes]) -> str:
    with suppress(subprocess.TimeoutExpired):
        code = process.wait(1.0)
        return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
    return "no answer"


# ---- in the child ----------------------------------------------------------------------------------------------------


def serve(handle: int, memory: int) -> None:
    """Do what the parent asks through the socket ``handle``, until it is gone; note plugin calls in ``memory``."""
    with open(memory, "r+b") as file:
        calls.note_on(mmap.mmap(file.fileno(), 0))
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent decides
    threading.Thread(target=_follow_parent, args=(handle,), daemon=True).start()
    connection = Connection(handle)
    while True:
        try:
            function, arguments = connection.recv()
        except EOFError:
            return
        connection.send(_outcome(function, arguments))


def _outcome(function: Callable[..., Any], arguments: tuple[object, ...]) -> tuple[Any, Exception | None]:
    try:
        return function(*arguments), None
    except Exception as error:  # whatever it is, it is raised in the parent
        return None, error


def _follow_parent(handle: int) -> None:
    """End this process when the parent is gone, whatever it is doing."""
    poll = select.poll()
    poll.register(handle, 0)  # hanging up is always told
    poll.poll()
    os._exit(1)

# SPDX-License-Identifier: BSD-3-Clause
"""Standard output and error that may be closed, full, not of UTF-8, or a pipe that nobody reads any more."""

from __future__ import annotations

import errno
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final, TextIO

FAILED: Final = 1
PIPE_CLOSED: Final = 141
"""What a shell tells of a program that SIGPIPE ended: the usual end of what writes into a pipe that nobody reads."""

_STDOUT, _STDERR = 1, 2  # descriptors


@contextmanager
def guarded() -> Iterator[None]:
    """End the program when standard output or error refuses what is written: with a line, or quietly if it is a pipe.

    A character that the stream's encoding does not have is written as an escape.

    Raises:
        SystemExit: A stream refused something, by the end of the block at the latest.
    """
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = _checked(sys.stdout, _STDOUT), _checked(sys.stderr, _STDERR)
    try:
        try:
            yield
        finally:
            sys.stdout.flush()
    except _Refused as refused:
        raise SystemExit(refused.end()) from None
    finally:
        sys.stdout, sys.stderr = before


def data() -> TextIO:
    """Return standard output for data: UTF-8 whatever the locale, so that it has the bytes of a file."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(encoding="utf-8", errors="backslashreplace")
    return sys.stdout


class _Refused(Exception):  # noqa: N818 - no OSError, which typer would take for its own
    """The system did not take what was written."""

    def __init__(self, descriptor: int, error: OSError) -> None:
        super().__init__(descriptor, error)
        self._descriptor, self._error = descriptor, error

    def end(self) -> int:
        """Drop what is still to be written; say why, unless it is as usual; return the exit code."""
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self._descriptor)
        os.close(nowhere)
        if self._error.errno == errno.EPIPE:
            return PIPE_CLOSED
        if self._descriptor != _STDERR:
            print(f"error: stdout: cannot be written: {self._error.strerror}", file=sys.stderr)
        return FAILED


class _Descriptor(io.FileIO):
    """An open descriptor, whose refusals can be told from those of any other file."""

    def __init__(self, descriptor: int) -> None:
        super().__init__(descriptor, "wb", closefd=False)

    def write(self, content: Any) -> int:
        try:
            return super().write(content)
        except OSError as error:
            raise _Refused(self.fileno(), error) from error


def _checked(stream: TextIO | None, descriptor: int) -> TextIO:
    """Return a stream that raises :class:`_Refused`; one that is no descriptor of the system as it is."""
    if stream is None:
        _occupy(descriptor)
        return _text(descriptor, "utf-8")
    try:
        descriptor = stream.fileno()
    except io.UnsupportedOperation:  # a test's, say
        return stream
    stream.flush()
    return _text(descriptor, stream.encoding)


def _text(descriptor: int, encoding: str) -> TextIO:
    buffer, at_once = io.BufferedWriter(_Descriptor(descriptor)), descriptor == _STDERR or os.isatty(descriptor)
    return io.TextIOWrapper(buffer, encoding, errors="backslashreplace", line_buffering=at_once)


def _occupy(descriptor: int) -> None:
    """Open a closed descriptor, which the next file would get else: stdout to refuse, stderr to take what comes."""
    opened = os.open(os.devnull, os.O_RDONLY if descriptor == _STDOUT else os.O_WRONLY)
    if opened != descriptor:
        os.dup2(opened, descriptor)
        os.close(opened)

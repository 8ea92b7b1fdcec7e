# SPDX-License-Identifier: BSD-3-Clause
"""Calls in a fork of the tests' process, which has none of its threads."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable


def in_a_fork(function: Callable[[], object]) -> str:
    """Return what ``function`` returns in a fork, as text, or the error that it raises; "" if it takes a minute."""
    there, here = os.pipe()
    child = os.fork()
    if child == 0:
        signal.alarm(60)
        try:
            said = repr(function())
        except Exception as error:
            said = f"{type(error).__name__}: {error}"
        os.write(here, said.encode())
        os._exit(0)
    os.close(here)
    with os.fdopen(there) as answer:
        said = answer.read()
    os.waitpid(child, 0)
    return said

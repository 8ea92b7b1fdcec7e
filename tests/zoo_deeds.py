# SPDX-License-Identifier: BSD-3-Clause
"""What plugins do that they should not: raise, exit, return what is none of theirs, print, fork, move, hang."""

from __future__ import annotations

import ctypes
import dataclasses
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from typing import Any, NoReturn

import numpy as np

from swarmevo.errors import Interrupted
from swarmevo.protocols import FeedForward, GenomeSpace

Deed = Callable[[Any], Any]
"""What a method does instead, given what it would return."""

# ---- what raises -----------------------------------------------------------------------------------------------------


class Unspeakable(Exception):  # noqa: N818 - the plugin's
    def __str__(self) -> str:
        raise SystemExit(0)


def raising(error: BaseException) -> Deed:
    def deed(sound: Any) -> NoReturn:
        raise error

    return deed


def deep(sound: Any) -> Any:
    return deep(sound)


RAISED: dict[str, tuple[Deed, str]] = {
    "error": (raising(KeyError("nobody\nhome")), "KeyError: 'nobody\\nhome'"),
    "sys.exit(0)": (lambda sound: sys.exit(0), "SystemExit: 0"),
    "KeyboardInterrupt": (raising(KeyboardInterrupt()), "KeyboardInterrupt"),
    "GeneratorExit": (raising(GeneratorExit("late")), "GeneratorExit: late"),
    "StopIteration": (raising(StopIteration()), "StopIteration"),
    "BaseException": (raising(BaseException("base")), "BaseException: base"),
    "our own Interrupted": (raising(Interrupted("now")), "Interrupted: now"),
    "recursion": (deep, "RecursionError"),
    "undecodable": (raising(RuntimeError("\udcff\0")), "\\udcff\\x00"),
    "unspeakable": (raising(Unspeakable()), "Unspeakable"),
}


# ---- what is returned ------------------------------------------------------------------------------------------------


def too_few(sound: FeedForward) -> Any:
    parts = {field: getattr(sound, field)[:0] for field in ("input_hidden", "hidden_output", "hidden_switch")}
    return dataclasses.replace(sound, **parts)


def cyclic(sound: Any) -> Any:
    sound["self"] = [sound]
    return sound


def nested(sound: Any) -> Any:
    for _ in range(100_000):
        sound = {"in": sound}
    return sound


class Sulky(dict[str, Any]):
    def items(self) -> Any:
        raise SystemExit(0)


RETURNED: list[tuple[str, str, str, Deed, str]] = [
    ("nothing", "zoo_network", "space", lambda sound: None, "expected a GenomeSpace, got NoneType"),
    ("no genes", "zoo_network", "space", lambda sound: GenomeSpace(()), ""),
    (
        "nothing",
        "zoo_network",
        "policies",
        lambda sound: None,
        "expected FeedForward, Linear, Recurrent or Compiled, got NoneType",
    ),
    ("too few", "zoo_network", "policies", too_few, "expected 1 policies, got 0"),
    ("nothing", "zoo_network", "complexity", lambda sound: None, "expected"),
    ("text", "zoo_network", "complexity", lambda sound: "many", "expected an array of numbers, got str"),
    ("a column", "zoo_network", "complexity", lambda sound: sound[:, np.newaxis], "expected an array of shape (1,)"),
    ("NaN", "zoo_network", "complexity", lambda sound: sound * np.nan, "nan"),
    ("text", "zoo_linear", "act", lambda sound: "left", "expected an array of numbers, got str"),
    ("too few", "zoo_linear", "act", lambda sound: sound[..., :1], "expected an array of shape"),
    ("nothing", "zoo_travel", "objectives", lambda sound: None, "TypeError"),
    ("none", "zoo_travel", "objectives", lambda sound: (), "expected at least one, got none"),
    ("a number", "zoo_travel", "channels", lambda sound: 5, "TypeError"),
    ("unknown", "zoo_travel", "channels", lambda sound: ("sonar",), "'sonar'"),
    ("nothing", "zoo_travel", "evaluate", lambda sound: None, "expected"),
    ("too few", "zoo_travel", "evaluate", lambda sound: sound[:, :1], "expected an array of shape (1, 2), got (1, 1)"),
    (
        "out of range",
        "zoo_travel",
        "evaluate",
        lambda sound: sound + 7,
        "expected travel in its range from 0 to 1, got 7.",
    ),
    ("NaN", "zoo_travel", "evaluate", lambda sound: sound * np.nan, "nan"),
    ("nothing", "zoo_places", "descriptors", lambda sound: None, "TypeError"),
    ("text", "zoo_places", "descriptors", lambda sound: ("x", "y"), "expected a Descriptor, got str"),
    ("nothing", "zoo_places", "describe", lambda sound: None, "expected"),
    ("too few", "zoo_places", "describe", lambda sound: sound[:, :1], "expected an array of shape (1, 2), got (1, 1)"),
    ("NaN", "zoo_places", "describe", lambda sound: sound * np.nan, "nan"),
    (
        "out of range",
        "zoo_places",
        "describe",
        lambda sound: sound * 0 + 7,
        "expected end_x in its range from -0.5 to 0.5, got 7",
    ),
    ("nothing", "zoo_search", "ask", lambda sound: None, "expected a NumPy array, got NoneType"),
    ("masked", "zoo_search", "ask", np.ma.masked_array, "expected a NumPy array, got MaskedArray"),
    ("a vector", "zoo_search", "ask", lambda sound: sound[0], "expected the shape"),
    ("nobody", "zoo_search", "ask", lambda sound: sound[:0], "expected the shape"),
    ("complex", "zoo_search", "ask", lambda sound: sound + 1j, "expected dtype float64, got complex128"),
    ("infinite", "zoo_search", "ask", lambda sound: sound * np.inf, "expected finite numbers"),
    ("nothing", "zoo_answering", "answer", lambda sound: None, "expected a NumPy array, got NoneType"),
    ("too few", "zoo_answering", "answer", lambda sound: sound[:, 1:], "expected the shape"),
    ("NaN", "zoo_answering", "answer", lambda sound: sound * np.nan, "expected finite numbers, got nan"),
    ("nothing", "zoo_search", "state", lambda sound: None, "expected a mapping, got NoneType"),
    ("cyclic", "zoo_search", "state", cyclic, "it is in itself"),
    ("deep", "zoo_search", "state", nested, "expected at most 100"),
    ("long", "zoo_search", "state", lambda sound: {"n": 10**5000}, "4300 digits"),
    ("object", "zoo_search", "state", lambda sound: {"n": object()}, "got object"),
    ("exits", "zoo_search", "state", lambda sound: Sulky(a=1), "SystemExit"),
]


# ---- what does no harm -----------------------------------------------------------------------------------------------


def prints(sound: Any) -> Any:
    print("plugin says hello")
    return sound


def moves(sound: Any) -> Any:
    os.chdir("/")
    return sound


def starts_a_daemon(sound: Any) -> Any:
    threading.Thread(target=time.sleep, args=(5,), daemon=True).start()
    return sound


def forks_and_exits(sound: Any) -> Any:
    child = os.fork()
    if child == 0:
        os._exit(0)
    os.waitpid(child, 0)
    return sound


def forks_and_returns(sound: Any) -> Any:
    child = os.fork()
    if child != 0:
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 1
    return sound


def forks_and_raises(sound: Any) -> Any:
    child = os.fork()
    if child == 0:
        raise SystemExit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 1
    return sound


def is_killed(sound: Any) -> Any:
    """Case 53: a child ends when it is asked to."""
    child = os.fork()
    if child == 0:
        time.sleep(60)
        os._exit(9)
    os.kill(child, signal.SIGTERM)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGTERM
    return sound


def has_a_pool(sound: Any) -> Any:
    """Case 53: leaving the pool sends its processes SIGTERM, and waits for them."""
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert pool.map(abs, [-1, -2]) == [1, 2]
    return sound


HARMLESS = [prints, moves, starts_a_daemon, forks_and_exits, forks_and_returns, forks_and_raises, is_killed, has_a_pool]


# ---- what raises nothing ---------------------------------------------------------------------------------------------


def hangs(sound: Any) -> Any:
    time.sleep(600)


def dies(sound: Any) -> Any:
    os.kill(os.getpid(), signal.SIGSEGV)


def exits_in_c(sound: Any) -> Any:
    ctypes.CDLL(None)._exit(0)


NAMED: dict[str, Deed] = {name: deed for name, (deed, _) in RAISED.items()} | {
    "hangs": hangs,
    "dies": dies,
    "os._exit(0)": lambda sound: os._exit(0),
    "_exit(0) in C": exits_in_c,
}

# SPDX-License-Identifier: BSD-3-Clause
"""Whether this installation is sound."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from swarmevo import __version__, plugins
from swarmevo.config import Config

REINSTALL = "reinstall swarmevo; in a checkout: make evolve"


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at."""

    subject: str
    text: str
    """What was found, one line."""
    advice: str = ""
    """What to do; "" if it is sound."""


def examine() -> list[Finding]:
    """Look at everything that a run needs."""
    return [
        Finding("swarmevo", f"{__version__}, {os.path.dirname(__file__)}"),
        Finding("Python", f"{platform.python_version()} on {platform.platform()}"),
        Finding("cores", f"{len(os.sched_getaffinity(0))} usable of {os.cpu_count()}"),
        _look("library", _library),
        _look("ODE", _ode),
        _look("world", _world),
        *_plugins(),
    ]


def _look(subject: str, look: Callable[[], str]) -> Finding:
    try:
        return Finding(subject, look())
    except Exception as error:  # the doctor must not fall ill
        return Finding(subject, " ".join(f"{type(error).__name__}: {error}".split()), REINSTALL)


def _library() -> str:
    from swarmevo import simulator

    return ", ".join(f"{key} {value}" for key, value in simulator.library_info().items())


def _ode() -> str:
    from swarmevo import simulator

    simulator.selftest()
    return "an assertion inside it is caught"


def _world() -> str:
    from swarmevo import simulator

    errors = simulator.scene_errors(Config())
    if errors:
        raise RuntimeError("; ".join(errors))
    return "the default configuration is accepted"


def _plugins() -> Iterator[Finding]:
    """Look at every plugin installed, and for those of the default configuration."""
    entries = plugins.discover()
    for name in sorted({entry.name for entry in entries}):
        for report in plugins.check(name):
            entry = report.entry
            text, advice = entry.origin, ""
            if report.error:
                text, advice = report.error, f"repair or uninstall {entry.distribution}"
            yield Finding(f"{entry.kind} {entry.name}", text, advice)
    found = {(entry.kind, entry.name) for entry in entries}
    for kind in plugins.GROUPS:
        for name in getattr(Config(), kind):
            if (kind, name) not in found:
                yield Finding(f"{kind} {name}", "not installed", REINSTALL)

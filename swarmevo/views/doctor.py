# SPDX-License-Identifier: BSD-3-Clause
"""Whether this installation is sound."""

from __future__ import annotations

import hashlib
import os
import platform
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from swarmevo import plugins
from swarmevo._version import __version__
from swarmevo.config import Config, load, packaged
from swarmevo.plugins.calls import one_line
from swarmevo.simulation.library import libm

REINSTALL = "reinstall swarmevo; in a checkout: make evolve"


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at."""

    subject: str
    text: str
    """What was found, one line."""
    advice: str = ""
    """What to do; "" if it is sound."""
    is_fault: bool = True
    """Whether it should not stay so, if it is not sound."""


def examine() -> list[Finding]:
    """Look at everything that a run needs."""
    return [
        Finding("swarmevo", f"{__version__}, {Path(__file__).parents[1]}"),
        Finding("Python", f"{platform.python_version()} on {platform.platform()}"),
        Finding("cores", f"{len(os.sched_getaffinity(0))} usable of {os.cpu_count()}"),
        Finding("libm", f"{' '.join(platform.libc_ver())}, rounds as {libm()}"),
        _look("library", _library),
        *_sources(Path(__file__).resolve().parents[2]),
        _look("ODE", _ode),
        _look("world", _world),
        *_plugins(),
        *_rivals(),
    ]


def _look(subject: str, look: Callable[[], str]) -> Finding:
    try:
        return Finding(subject, look())
    except Exception as error:  # whatever is broken is a finding
        found, _, advice = one_line(error).partition("; install ")
        return Finding(subject, found, f"install {advice}" if advice else REINSTALL)


def _library() -> str:
    from swarmevo import simulation

    return ", ".join(f"{key} {value}" for key, value in simulation.library_info().items())


def _sources(checkout: Path) -> Iterator[Finding]:
    """Compare the library with the sources beside it; say nothing where there are none, or no library."""
    library = _look("library", _library)
    if not (checkout / "native" / "src").is_dir() or library.advice:
        return
    match = re.search(r"sources ([0-9a-f]{16})", library.text)
    built, found = match[1] if match else "older ones", sources_hash(checkout)
    if built != found:
        text = f"{checkout / 'native'} is {found}, the library was built from {built}"
        yield Finding("sources", text, REINSTALL, is_fault=False)


def sources_hash(checkout: Path) -> str:
    """Return what CMakeLists.txt puts into the library's description: a hash of the sources that it is made of."""
    patterns = ("native/src/**/*.cpp", "native/src/**/*.hpp", "native/include/**/*.h")
    files = sorted(file.relative_to(checkout).as_posix() for pattern in patterns for file in checkout.glob(pattern))
    lines = [f"{hashlib.sha256((checkout / file).read_bytes()).hexdigest()}  {file}\n" for file in files]
    return hashlib.sha256("".join(lines).encode()).hexdigest()[:16]


def _ode() -> str:
    from swarmevo import simulation

    simulation.selftest()
    return "an assertion inside it is caught"


def _world() -> str:
    from swarmevo import simulation

    errors = simulation.scene_errors(Config())
    if errors:
        raise RuntimeError("; ".join(errors))
    return "the default configuration is accepted"


def _plugins() -> Iterator[Finding]:
    """Look at every plugin installed, and for those of the default configuration."""
    entries = plugins.discover()
    for name in sorted({entry.name for entry in entries}):
        for report in plugins.check(name):
            entry = report.entry
            text, advice = report.error or entry.origin, ""
            if report.lacks_library:  # its distribution can do without
                advice = f"if you want {entry.name}, install what it needs"
            elif report.error:
                advice = f"repair or uninstall {entry.distribution}"
            yield Finding(f"{entry.kind} {entry.name}", text, advice, is_fault=not report.lacks_library)
    found = {(entry.kind, entry.name) for entry in entries}
    for kind in plugins.GROUPS:
        for name in getattr(Config(), kind):
            if (kind, name) not in found:
                yield Finding(f"{kind} {name}", "not installed", REINSTALL)


def _rivals() -> Iterator[Finding]:
    """Look for the configurations that come with swarmevo whose optimiser does not."""
    installed = {entry.name for entry in plugins.discover() if entry.kind == "optimiser"}
    for name in packaged():
        for lacking in sorted(plugins.RIVALS.intersection(load(name).optimiser) - installed):
            text = f"optimiser.{lacking} of swarmevo-rivals is not installed"
            yield Finding(f"configuration {name}", text, plugins.INSTALL_RIVALS, is_fault=False)

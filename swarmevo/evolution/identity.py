# SPDX-License-Identifier: BSD-3-Clause
"""What must be the same wherever a run's episodes run, for the same bits."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import TypeAlias

import numpy as np

from swarmevo import plugins, simulation
from swarmevo._version import __version__
from swarmevo.config import Config

Identity: TypeAlias = Mapping[str, str]
"""Versions of swarmevo, its library, NumPy and the plugins that episodes need, and which files these are made of."""


def identity(config: Config) -> Identity:
    """Return what this process is.

    Raises:
        PluginError: A configured plugin is not installed.
        SimulatorError: The library cannot be loaded.
    """
    chosen = {"controller": config.controller, "fitness": config.fitness}
    entries = [plugins.find(kind, name) for kind, names in chosen.items() for name in names]
    found = {f"{entry.kind}.{entry.name}": f"{entry.origin} (files {_digest(entry.files)})" for entry in entries}
    return {"swarmevo": __version__, "library": simulation.library_info()["build"], "NumPy": np.__version__, **found}


def difference(found: Identity, expected: Identity) -> str:
    """Return in what another process is not what it should be; "" where it is."""
    return ", ".join(
        f"{key} {found.get(key, 'none')} instead of {value}"
        for key, value in expected.items()
        if found.get(key) != value
    )


def _digest(files: Mapping[str, str]) -> str:
    lines = "".join(f"{sha256}  {path}\n" for path, sha256 in sorted(files.items()))
    return hashlib.sha256(lines.encode()).hexdigest()[:12]

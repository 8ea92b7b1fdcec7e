# SPDX-License-Identifier: BSD-3-Clause
"""What makes a run what it is, besides its configuration: versions, machine, time.

On another machine or build the same run may round differently; this tells what to look for when it does.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import platform
import sqlite3
import subprocess
import sys
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from swarmevo._version import __version__
from swarmevo.plugins import PluginEntry
from swarmevo.simulation.library import cpu, libm


def provenance(config_yaml: str, plugins: Sequence[PluginEntry], library: Mapping[str, str]) -> dict[str, Any]:
    """Return the content of a run's ``provenance.json``.

    Args:
        config_yaml: The resolved configuration, as stored.
        plugins: The configured ones.
        library: What the simulator says about itself (``simulation.library_info``).
    """
    return {
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "swarmevo": __version__,
        "git_revision": _git_revision(),
        "config_sha256": hashlib.sha256(config_yaml.encode()).hexdigest(),
        "plugins": list(map(str, plugins)),
        "plugin_files": plugin_files(plugins),
        "library": {**library, "sha256": _sha256_of_file(library.get("path"))},
        "python": sys.version,
        "numpy": np.__version__,
        "sqlite": sqlite3.sqlite_version,
        "platform": platform.platform(),
        "libc": " ".join(platform.libc_ver()),
        "libm": libm(),
        "cpu": cpu(),
        "cores": os.cpu_count(),
    }


def lasting(origin: Mapping[str, Any]) -> dict[str, Any]:
    """Return a provenance without what changes from session to session though nothing else does."""
    return {key: value for key, value in origin.items() if key not in ("created", "config_sha256")}


def plugin_files(plugins: Sequence[PluginEntry]) -> dict[str, dict[str, str]]:
    """Return the SHA-256 of each plugin's files: what a version number does not tell while a plugin is written."""
    return {f"{plugin.kind}.{plugin.name}": dict(plugin.files) for plugin in plugins}


def changed_files(then: Mapping[str, Any], now: Mapping[str, Any]) -> dict[str, list[str]]:
    """Return the files that differ between two sessions' plugins, or that only one has, each with its plugins.

    Args:
        then: A provenance, from whomever; one without ``plugin_files`` differs in none.
        now: Another one.
    """
    before, after = _noted_files(then), _noted_files(now)
    changed: dict[str, list[str]] = {}
    for plugin in before.keys() & after.keys():
        for file in before[plugin].keys() | after[plugin].keys():
            if before[plugin].get(file) != after[plugin].get(file):
                changed.setdefault(file, []).append(plugin)
    return {file: sorted(changed[file]) for file in sorted(changed)}


def _noted_files(origin: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    noted = origin.get("plugin_files")
    if not isinstance(noted, dict):
        return {}
    return {plugin: files for plugin, files in noted.items() if isinstance(files, dict)}


def _git_revision() -> str | None:
    """Return the revision of the checkout that this file is in, ``-dirty`` if changed; None if it is in none."""
    checkout = Path(__file__).resolve().parents[2]
    if not (checkout / ".git").exists():  # installed: a repository further up would be somebody else's
        return None
    command = ["git", "-C", str(checkout), "describe", "--always", "--dirty", "--abbrev=40"]
    try:
        return subprocess.run(command, capture_output=True, check=True, text=True, timeout=10).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return None


def _sha256_of_file(path: str | None) -> str | None:
    """Return what tells two builds of the same version apart; None if there is no such file."""
    with contextlib.suppress(OSError):
        return hashlib.sha256(Path(path).read_bytes()).hexdigest() if path else None
    return None

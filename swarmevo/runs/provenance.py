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
from swarmevo.simulation.library import cpu


def provenance(config_yaml: str, plugins: Sequence[str], library: Mapping[str, str]) -> dict[str, Any]:
    """Return the content of a run's ``provenance.json``.

    Args:
        config_yaml: The resolved configuration, as stored.
        plugins: The configured plugins, each with its distribution and version.
        library: What the simulator says about itself (``simulation.library_info``).
    """
    return {
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "swarmevo": __version__,
        "git_revision": _git_revision(),
        "config_sha256": hashlib.sha256(config_yaml.encode()).hexdigest(),
        "plugins": list(plugins),
        "library": {**library, "sha256": _sha256_of_file(library.get("path"))},
        "python": sys.version,
        "numpy": np.__version__,
        "sqlite": sqlite3.sqlite_version,
        "platform": platform.platform(),
        "libc": " ".join(platform.libc_ver()),
        "cpu": cpu(),
        "cores": os.cpu_count(),
    }


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

# SPDX-License-Identifier: BSD-3-Clause
"""Distributions of other authors: copied, built and installed as they would do it, without the network."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

BUILD_PRODUCTS = shutil.ignore_patterns("build", "*.egg-info", "__pycache__", ".*")
PIP = ("-m", "pip", "--quiet", "--disable-pip-version-check")
OFFLINE = ("--no-index", "--no-deps", "--no-build-isolation")


def python(*arguments: object, path: Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run this Python with ``path`` before its own."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(path), *filter(None, sys.path)])}
    return subprocess.run(
        [sys.executable, *map(str, arguments)], env=environment, cwd=cwd, capture_output=True, text=True, check=False
    )


def install(source: Path, target: Path) -> Path:
    """Install a folder or a wheel into ``target``, and return it."""
    done = python(*PIP, "install", *OFFLINE, "--target", target, source, path=target, cwd=target)
    assert done.returncode == 0, done.stdout + done.stderr
    return target

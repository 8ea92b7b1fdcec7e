# SPDX-License-Identifier: BSD-3-Clause
"""A user whom the system does not know, as in a container: no name, no home."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from cli.conftest import SMALL

NOBODY = """
import pwd, sys
def unknown(*who): raise KeyError(f"uid not found: {who}")
pwd.getpwuid = pwd.getpwnam = unknown
from swarmevo.cli import main
main(sys.argv[1:])
"""
VERBS = (
    "evolve small.yaml --seed 1 --out run",
    "resume run --generations +1",
    "show run",
    "verify run --sample 1",
    "test run --robots 1 --repeats 1",
    "export run --csv",
    "replay run --html replay.html",
    "report run --figures figures",
    "plugins",
)


def test_every_verb_works_for_an_unknown_user(tmp_path: Path) -> None:
    """Case 61."""
    (tmp_path / "small.yaml").write_text(SMALL)
    names = ("HOME", "USER", "LOGNAME", "LNAME", "USERNAME", "XDG_CONFIG_HOME", "XDG_CACHE_HOME", "MPLCONFIGDIR")
    environment = {name: value for name, value in os.environ.items() if name not in names}
    for verb in VERBS:
        command = [sys.executable, "-c", NOBODY, *verb.split()]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert (done.returncode, "Traceback" in done.stderr) == (0, False), f"{verb}: {done.stderr}"
    hint = "from swarmevo.views.replay import server; print(server.hint(80))"
    command = [sys.executable, "-c", NOBODY.partition("from swarmevo")[0] + hint]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert "ssh -L 80:127.0.0.1:80 " in done.stdout
    assert "@" not in done.stdout

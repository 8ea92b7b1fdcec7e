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
"""
ALL_VERBS = """
from swarmevo.cli import main
for verb in sys.argv[1:]:
    try: main(verb.split())
    except SystemExit as ended:
        if ended.code: sys.exit(f"{verb}: {ended.code}")
"""
HINT = "from swarmevo.views.replay import server; print(server.hint(80))"
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
    everything = [sys.executable, "-c", NOBODY + ALL_VERBS, *VERBS]
    done = subprocess.run(everything, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr
    assert (tmp_path / "replay.html").exists()
    hint = [sys.executable, "-c", NOBODY + HINT]
    done = subprocess.run(hint, env=environment, capture_output=True, text=True, check=True)
    assert "ssh -L 80:127.0.0.1:80 " in done.stdout
    assert "@" not in done.stdout

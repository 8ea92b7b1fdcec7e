# SPDX-License-Identifier: BSD-3-Clause
"""What is left when the command ends: it ends all the same, with its exit code."""

from __future__ import annotations

import subprocess
import sys

import pytest

LEFT = {
    "thread": "import threading, time; threading.Thread(target=time.sleep, args=(60,)).start()",
    "process": "import multiprocessing, time; multiprocessing.Process(target=time.sleep, args=(60,)).start()",
}


@pytest.mark.parametrize("left", LEFT.values(), ids=LEFT)
def test_what_a_plugin_left_does_not_keep_the_process(left: str) -> None:
    """Case 30: a thread that is no daemon kept the process for as long as it ran."""
    program = f"import sys; from swarmevo.cli import process; {left}; print('told'); process.run(lambda: sys.exit(3))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=30)
    assert (done.returncode, done.stdout, done.stderr) == (3, "told\n", "")

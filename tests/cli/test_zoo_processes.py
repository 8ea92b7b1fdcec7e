# SPDX-License-Identifier: BSD-3-Clause
"""Whole commands with plugins that misbehave: exit codes, what is printed, and what ends the process at once.

What the command does before it ends is tried for every method, in one process, by ``evolution/test_zoo.py``.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import zoo_plugins
from conftest import installer
from swarmevo.runs import driver, verification
from swarmevo.runs.store import Store

Outcome = tuple[int, list[str]]


@pytest.fixture(autouse=True, scope="module")
def _plugins(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        zoo_plugins.install(installer(tmp_path_factory.mktemp("zoo"), patch))
        yield


@pytest.fixture(scope="module")
def begun(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Runs of one generation that are to have three."""
    folders = {}
    for plugin in zoo_plugins.PLUGINS:
        folder = tmp_path_factory.mktemp("begun") / "run"
        driver.begin(folder, zoo_plugins.config(plugin, generations=1))
        with Store.open(folder, readonly=False) as store:
            driver.evolve(store, 1, lambda now: None)
            driver.extend(store, "3")
        folders[plugin] = folder
    return folders


def start(folder: Path, *arguments: str, deed: str = "") -> subprocess.Popen[str]:
    """Start ``swarmevo ARGUMENTS`` beside a run, with a plugin that does ``deed``."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), zoo_plugins.DEED: deed}
    command = [sys.executable, "-m", "swarmevo", *arguments]
    return subprocess.Popen(
        command, env=environment, cwd=folder.parent, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def run(folder: Path, *arguments: str, deed: str = "") -> Outcome:
    """Return a command's exit code and the lines that it printed to stderr; to stdout it must print nothing."""
    process = start(folder, *arguments, deed=deed)
    out, err = process.communicate(timeout=120)
    assert out == "" or process.returncode == 0
    return process.returncode, err.splitlines()


def assert_sound(folder: Path, generations: int) -> None:
    with Store.open(folder) as store:
        assert store.generations(0) == generations
        assert verification.verify(store, 1).is_sound


@pytest.mark.parametrize(
    ("plugin", "method", "deed", "told"),
    [
        ("zoo_network", "space", "sys.exit(0)", "SystemExit: 0"),
        ("zoo_network", "policies", "os._exit(0)", r"SystemExit: os\._exit\(0\)"),
        ("zoo_network", "complexity", "KeyboardInterrupt", "KeyboardInterrupt"),
        ("zoo_linear", "act", "unspeakable", "Unspeakable"),
        ("zoo_travel", "evaluate", "os._exit(0)", r"SystemExit: os\._exit\(0\)"),
        ("zoo_search", "factory", "sys.exit(0)", "SystemExit: 0"),
        ("zoo_search", "tell", "os._exit(0)", r"SystemExit: os\._exit\(0\)"),
        ("zoo_search", "restore", "recursion", "RecursionError"),
    ],
)
def test_a_command_fails_with_one_line(
    begun: dict[str, Path], tmp_path: Path, plugin: str, method: str, deed: str, told: str
) -> None:
    """Case 1."""
    folder = Path(shutil.copytree(begun[plugin], tmp_path / "run"))
    code, lines = run(folder, "resume", "run", deed=f"{plugin}.{method}={deed}")
    assert code == 1
    (error,) = [line for line in lines if line.startswith("error: ")]
    assert plugin in error
    assert "zoo 1.0" in error
    assert re.search(told, error)
    assert not any("Traceback" in line for line in lines)
    assert_sound(folder, 1)


def test_what_fails_in_the_rehearsal_leaves_no_folder(begun: dict[str, Path], tmp_path: Path) -> None:
    config = shutil.copy(begun["zoo_travel"] / "config.yaml", tmp_path)
    arguments = "evolve", str(config), "--out", "new"
    code, lines = run(tmp_path / "new", *arguments, deed="zoo_travel.evaluate=os._exit(0)")
    assert code == 2
    (error,) = lines
    assert re.search(r"^error: fitness\.zoo_travel .*evaluate raised .*rehearsal", error)
    assert not (tmp_path / "new").exists()


def test_a_process_that_was_ended_at_once_is_told_by_the_next_command(begun: dict[str, Path], tmp_path: Path) -> None:
    """Case 1: nothing sees what C does; the process left its lock."""
    folder = Path(shutil.copytree(begun["zoo_search"], tmp_path / "run"))
    process = start(folder, "resume", "run", deed="zoo_search.tell=_exit(0) in C")
    assert process.communicate(timeout=120)[0] == ""
    (shown,) = [line for line in run(folder, "show", "run")[1] if line.startswith("warning: ")]
    assert re.match(rf"warning: process {process.pid} on \S+, which wrote the run last, ended without a word in", shown)
    assert "in trial 0, generation 1: " in shown
    code, lines = run(folder, "resume", "run")
    assert code == 0
    assert lines[0] == shown
    assert_sound(folder, 3)
    assert not [line for line in run(folder, "show", "run")[1] if "without a word" in line]


def test_a_command_that_hangs_answers_a_signal(begun: dict[str, Path], tmp_path: Path) -> None:
    """Case 6."""
    folder = Path(shutil.copytree(begun["zoo_travel"], tmp_path / "run"))
    process = start(folder, "resume", "run", deed="zoo_travel.evaluate=hangs")
    while not (folder / "run.lock").exists():
        assert process.poll() is None
        time.sleep(0.01)
    time.sleep(1.0)  # until it hangs; if it does not yet, it stops all the same
    process.send_signal(signal.SIGTERM)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (130, "")
    assert "interrupted; go on with: swarmevo resume run" in err
    assert_sound(folder, 1)

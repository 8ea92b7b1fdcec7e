# SPDX-License-Identifier: BSD-3-Clause
"""Case 68: standard output that is closed, full, of few characters, or a pipe that nobody reads any more."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Any

import pytest

import small_runs
from swarmevo.cli.streams import PIPE_CLOSED

VERBS = {
    "help": ["--help"],
    "version": ["--version"],
    "show": ["show", "{run}"],
    "show as JSON": ["show", "{run}", "--json"],
    "verify": ["verify", "{run}", "--sample", "1"],
    "CSV": ["export", "{run}", "--csv"],
    "JSON": ["export", "{run}", "--json"],
    "controller": ["export", "{run}", "--controller", "1"],
    "test": ["test", "{run}", "--robots", "1", "--repeats", "1", "--set", "episode.horizon=1"],
    "replay": ["replay", "{run}", "--html", "{run}/../page.html"],
    "resume": ["resume", "{run}"],
    "dry run": ["evolve", "--dry-run", "--set", "evolution.population=4", "episode.horizon=1"],
    "plugins": ["plugins"],
    "check": ["plugins", "check", "pde"],
}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_runs.make(tmp_path_factory.mktemp("streams") / "run")


def swarmevo(run: Path, arguments: Sequence[str], stdout: int | IO[Any], **environment: str) -> tuple[int, str]:
    """Return exit code and what came on stderr."""
    command = [sys.executable, "-m", "swarmevo", *(argument.format(run=run) for argument in arguments)]
    done = subprocess.run(
        command, stdout=stdout, stderr=subprocess.PIPE, env={**os.environ, **environment}, text=True, timeout=60
    )
    return done.returncode, done.stderr


def closed_pipe() -> int:
    """Return the end of a pipe whose reader is gone."""
    reader, writer = os.pipe()
    os.close(reader)
    return writer


@pytest.mark.parametrize("verb", VERBS)
def test_a_pipe_that_nobody_reads_ends_the_program_quietly(run: Path, verb: str) -> None:
    pipe = closed_pipe()
    code, said = swarmevo(run, VERBS[verb], pipe)
    os.close(pipe)
    lines = [line for line in said.splitlines() if "stored" not in line]  # that of test
    assert (code, lines) == (PIPE_CLOSED, [])


@pytest.mark.parametrize("verb", ["version", "show", "CSV", "test"])
def test_a_full_disk_is_one_line(run: Path, verb: str) -> None:
    with Path("/dev/full").open("w") as full:
        code, said = swarmevo(run, VERBS[verb], full)
    assert code == 1
    assert said.splitlines()[-1] == "error: stdout: cannot be written: No space left on device"


@pytest.mark.parametrize("verb", ["help", "show", "JSON"])
def test_a_closed_stdout_is_one_line(run: Path, verb: str) -> None:
    arguments = " ".join(VERBS[verb]).format(run=run)
    done = subprocess.run(
        ["sh", "-c", f"{sys.executable} -m swarmevo {arguments} >&-"], capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (1, "error: stdout: cannot be written: Bad file descriptor\n")


def test_without_stderr_progress_does_not_get_into_the_results(tmp_path: Path) -> None:
    settings = " ".join(f"--set {one}" for one in small_runs.SMALL)
    command = f"{sys.executable} -m swarmevo evolve quick --out {tmp_path / 'run'} {settings} 2>&-"
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0
    assert done.stdout.startswith(f"{tmp_path / 'run'}: seed 5, complete")


def test_a_run_whose_progress_nobody_reads_can_be_resumed(tmp_path: Path) -> None:
    settings = " ".join(f"--set {one}" for one in small_runs.SMALL)
    command = f"{sys.executable} -m swarmevo evolve quick --out {tmp_path / 'run'} {settings} 2>&1 | true"
    subprocess.run(["sh", "-c", command], check=True, timeout=60)
    code, said = swarmevo(tmp_path / "run", ["resume", "{run}"], subprocess.DEVNULL)
    assert (code, "error" in said) == (0, False)


def test_few_characters_are_enough(tmp_path: Path, run: Path) -> None:
    """What has none on the terminal is shown as an escape; data is the same whatever the locale."""
    link = tmp_path / "l\u00e4uft \u2581"
    link.symlink_to(run)
    poor = {"PYTHONIOENCODING": "ascii"}
    with (tmp_path / "shown").open("wb") as file:
        assert swarmevo(link, VERBS["show"], file, **poor) == (0, "")
    assert rb"l\xe4uft \u2581: seed 5" in (tmp_path / "shown").read_bytes()
    with (tmp_path / "data").open("wb") as file:
        assert swarmevo(link, VERBS["controller"], file, **poor) == (0, "")
    assert json.loads((tmp_path / "data").read_bytes())["run"] == str(link)

# SPDX-License-Identifier: BSD-3-Clause
"""``--log wandb``: what is in W&B's files, whatever ended the run. Run where Weights & Biases is installed."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from cli.conftest import SMALL, Swarmevo
from cli.conftest import swarmevo_ as swarmevo_

wandb = pytest.importorskip("wandb")

BLOCK = 32768


@pytest.fixture(autouse=True)
def no_service() -> Iterator[None]:
    """End the process that W&B writes in: processes begun later would share it."""
    yield
    wandb.teardown()


def content(trial: int) -> list[bytes]:
    """Return what W&B's files of a trial hold, one for each session, without the header that each block begins with."""
    (id,) = re.findall(r"\w{8}", Path(f"run/wandb/trial-{trial}").read_text())
    files = sorted(Path("run/wandb").glob(f"offline-run-*/run-{id}.wandb"))
    whole = [file.read_bytes() for file in files]
    return [
        b"".join(one[start + 7 : start + BLOCK].rstrip(b"\0") for start in range(0, len(one), BLOCK)) for one in whole
    ]


def series(trial: int, name: str) -> list[list[float]]:
    """Return what was logged in each session: items as protobuf has them on the wire.

    A value that was written comes twice, as the latest one and then in the history.
    """
    key = name.encode()
    head = re.compile(re.escape(b"\x12" + bytes([len(key)]) + key + b"\x82\x01"))
    sessions = []
    for one in content(trial):
        places = [match.end() for match in head.finditer(one)]
        values = [float(one[place + 1 : place + 1 + one[place]]) for place in places if place + one[place] < len(one)]
        latest, history = values[: 2 * (len(values) // 2) : 2], values[1::2]
        assert latest == history
        sessions.append(history)
    return sessions


def test_each_generation_is_there_once_with_what_show_says(swarmevo_: Swarmevo) -> None:
    done = swarmevo_("evolve", "small.yaml", "--seed", 1, "--out", "run", "--log", "wandb")
    assert done.code == 0, done.err
    assert not done.errors
    assert "wandb" not in done.out
    shown = json.loads(swarmevo_("show", "run", "--json").out)
    for trial in shown["trials"]:
        history = trial["history"]
        assert series(trial["trial"], "_step") == [[step["generation"] for step in history]]
        for name in ("front_size", "new_genomes", "episodes"):
            assert series(trial["trial"], name) == [[step[name] for step in history]]
        for name in ("box_pushing", "hidden_neurons"):
            assert series(trial["trial"], f"best/{name}") == [[pytest.approx(step["best"][name]) for step in history]]
        (begun,) = content(trial["trial"])
        for told in (f"run trial {trial['trial']}", "swarmevo", '"feedforward"'):
            assert told.encode() in begun


def test_after_kill_9_no_generation_is_twice_or_missing(tmp_path: Path, swarmevo_: Swarmevo) -> None:
    Path("small.yaml").write_text(SMALL)
    chosen = "--set", "evolution.generations=120", "--seed", "1", "--trials", "1"
    command = [sys.executable, "-m", "swarmevo", "evolve", "small.yaml", *chosen, "--out", "run"]
    killed = subprocess.Popen([*command, "--log", "wandb"], cwd=tmp_path, stderr=subprocess.PIPE)
    while not any(file.stat().st_size >= BLOCK for file in Path("run/wandb").glob("offline-run-*/*.wandb")):
        assert killed.poll() is None
        time.sleep(0.05)
    killed.kill()
    killed.communicate()
    (before,) = series(0, "_step")
    assert 0 < len(before) < 120  # what W&B had not written is lost
    assert swarmevo_("resume", "run", "--log", "wandb").code == 0
    first, second = series(0, "_step")
    assert first == before
    assert [*first, *second] == list(range(120))


def test_a_folder_that_cannot_be_written_is_a_warning(tmp_path: Path, swarmevo_: Swarmevo) -> None:
    settings = "--seed", 1, "--trials", 1, "--out", "run"
    assert swarmevo_("evolve", "small.yaml", *settings).code == 0
    Path("run/wandb").write_text("not a folder")
    done = swarmevo_("resume", "run", "--log", "wandb")
    assert done.code == 0
    assert "wandb" in done.err

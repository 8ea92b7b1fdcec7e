# SPDX-License-Identifier: BSD-3-Clause
"""Case 10: what the verbs write, on a disk that is full."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

import small_runs
from cli.conftest import Swarmevo

OUTPUTS = {
    "CSV": ["export", "run", "--csv", "--out", "out/file"],
    "JSON": ["export", "run", "--json", "--out", "out/file"],
    "controller": ["export", "run", "--controller", 1, "--out", "out/file"],
    "C": ["export", "run", "--controller", 1, "--as", "epuck", "--out", "out/file"],
    "replay": ["replay", "run", "--html", "out/page.html"],
    "report": ["report", "run", "--html", "out/page.html"],
    "figures": ["report", "run", "--html", "page.html", "--figures", "out"],
    "new figures": ["report", "run", "--html", "page.html", "--figures", "out/deep/er"],
    "new CSV": ["export", "run", "--csv", "--out", "out/deep/er/file"],
    "new replay": ["replay", "run", "--html", "out/deep/er/page.html"],
    "new report": ["report", "run", "--html", "out/deep/er/page.html"],
}
"""The new ones are in folders that are made for them."""


def everything(folder: Path) -> dict[str, bytes | None]:
    """Return all that is in a folder, however deep."""
    return {str(path): path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_runs.make(tmp_path_factory.mktemp("made") / "run")


@pytest.fixture
def outside(tmp_path: Path, made: Path, swarmevo_: Swarmevo) -> Swarmevo:
    """Run ``swarmevo`` beside a run and a folder that holds a page and a figure already."""
    (tmp_path / "run").symlink_to(made)
    (tmp_path / "out").mkdir()
    for name in ("page.html", "fronts.pdf"):
        (tmp_path / "out" / name).write_text("old")
    return swarmevo_


@pytest.mark.parametrize("output", OUTPUTS)
def test_a_full_disk_leaves_what_was_there(
    outside: Swarmevo, output: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = everything(tmp_path / "out")
    sync = os.fsync

    def sync_or_not(handle: int) -> None:
        if str(tmp_path / "out") in os.readlink(f"/proc/self/fd/{handle}"):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        sync(handle)

    monkeypatch.setattr(os, "fsync", sync_or_not)
    done = outside(*OUTPUTS[output])
    place = "out/deep/er" if output.startswith("new") else "out"
    assert (done.code, done.errors) == (1, [f"no space left on {tmp_path / place}; free some, then try again"])
    assert everything(tmp_path / "out") == before
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    assert outside(*OUTPUTS[output]).code == 0
    assert not [path for path in everything(tmp_path / "out") if ".new" in path]

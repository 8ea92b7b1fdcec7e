# SPDX-License-Identifier: BSD-3-Clause
"""Paths that the system refuses, or that are no text."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from cli.conftest import SMALL, Swarmevo, files
from swarmevo import cli

LONG = "x" * 300
VERBS = ["resume", "show", "report", "replay", "verify", "test", "export --csv"]


@pytest.mark.parametrize("name", [LONG, f"new/{LONG}", f"new/{LONG}/run", "/".join(["new", *["y" * 99] * 5])])
def test_a_run_that_cannot_be_made_is_one_line_and_leaves_nothing(swarmevo_: Swarmevo, name: str) -> None:
    """Case 69: it was a traceback, and parent folders stayed."""
    before = files()
    done = swarmevo_("evolve", "small.yaml", "--out", name)
    assert done.code == 1
    assert len(done.errors) == 1
    assert "File name too long" in done.errors[0] or "at most 493 bytes" in done.errors[0]
    assert done.err.splitlines()[-1] == f"error: {done.errors[0]}"
    assert files() == before


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("name", [LONG, f"{LONG}/run", "x/" * 3000])
def test_a_run_with_a_name_that_is_too_long_is_not_there(swarmevo_: Swarmevo, verb: str, name: str) -> None:
    """Case 69."""
    before = files()
    done = swarmevo_(*verb.split(), name)
    assert done.code in (1, 2)
    assert "does not exist" in done.err or "expected a run folder" in done.err
    assert files() == before


def test_a_configuration_with_a_name_that_is_too_long_is_one_line(swarmevo_: Swarmevo) -> None:
    """Case 69."""
    before = files()
    for name in (LONG, f"{LONG}.yaml"):
        done = swarmevo_("evolve", name, "--out", "run")
        assert done.code == 2
        assert len(done.errors) == 1
    assert files() == before


def test_a_path_that_is_no_utf_8_works_in_every_verb(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Case 28: it was a traceback."""
    monkeypatch.chdir(tmp_path)
    name = os.fsdecode(b"caf\xe9")
    Path(f"{name}.yaml").write_text(SMALL)
    run = f"{name}/run"
    for arguments in (
        ["evolve", f"{name}.yaml", "--out", run, "--seed", "1"],
        *([*verb.split(), run] for verb in VERBS),
        ["report", run, "--figures", f"{name}/f"],
        ["export", run, "--controller", "1", "--out", f"{name}/1.json"],
    ):
        with pytest.raises(SystemExit) as ended:
            cli.main(arguments)
        assert ended.value.code in (0, None), (arguments, capfd.readouterr().err)
    assert set(os.listdir(name)) == {"1.json", "f", "run"}
    assert r"caf\udce9/run/report.html" in capfd.readouterr().out

# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo test``: what becomes of what it found."""

from __future__ import annotations

import errno
import json
import os
import tempfile
from pathlib import Path
from typing import NoReturn

import pytest

import small_runs
from cli.conftest import Swarmevo
from swarmevo.analysis import table_ii


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return small_runs.make(tmp_path / "run", "evolution.trials=1", "evolution.generations=1")


@pytest.mark.parametrize("form", [(), ("--json",)])
def test_tests_of_a_read_only_run_are_printed(
    run: Path, form: tuple[str, ...], swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 57: then one line says what was not stored, and why."""

    def refuse(*_: object, **__: object) -> NoReturn:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(tempfile, "TemporaryDirectory", refuse)
    done = swarmevo_("test", run, "--robots", "3", "--repeats", 1, "--workers", 1, *form)
    assert (done.code, done.errors) == (1, [f"{run / table_ii.FILE}: Read-only file system"])
    assert "Traceback" not in done.err
    if form:
        assert [row["robots"] for row in json.loads(done.out)["rows"]] == [3]
    else:
        assert "(98%)" in done.out


def test_tests_that_nobody_reads_are_stored(run: Path, swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 57: where what is printed is refused, as by a closed pipe, the tests are stored all the same."""

    def refuse(*_: object) -> NoReturn:
        raise SystemExit(141)

    monkeypatch.setattr("swarmevo.views.console.show_assessment", refuse)
    assert swarmevo_("test", run, "--robots", "3", "--repeats", 1, "--workers", 1).code == 141
    assert table_ii.load(run) is not None


@pytest.mark.parametrize(
    ("poorer", "more"),
    [
        (("--robots", "1-3", "--repeats", 1, "--robustness"), "2 repeats"),
        (("--robots", "2", "--repeats", 2, "--robustness"), "teams of 1, 3"),
        (("--robots", "1-3", "--repeats", 2), "robustness"),
        (("--robots", "4", "--repeats", 1), "2 repeats, teams of 1, 2, 3, robustness"),
    ],
)
def test_richer_tests_are_not_replaced(run: Path, poorer: tuple[object, ...], more: str, swarmevo_: Swarmevo) -> None:
    """Case 11: the poorer ones are printed, and one line says why they are not stored."""
    rich = ("test", run, "--robots", "1-3", "--repeats", 2, "--robustness", "--workers", 1)
    assert swarmevo_(*rich).err.splitlines()[-1] == f"stored in {run / table_ii.FILE}"
    file = run / table_ii.FILE
    stored = file.read_bytes()
    done = swarmevo_("test", run, *poorer, "--workers", 1, "--json")
    reason = f"not stored: {file} holds more ({more}); to store this instead, move that file away"
    assert (done.code, done.err.splitlines()[-1]) == (0, reason)
    assert json.loads(done.out)["repeats"] == poorer[3]
    assert file.read_bytes() == stored


def test_tests_as_rich_of_later_generations_or_of_a_damaged_file_are_stored(run: Path, swarmevo_: Swarmevo) -> None:
    """Case 11."""
    file = run / table_ii.FILE
    said = f"stored in {file}"

    def tested(*options: object) -> str:
        return swarmevo_("test", run, "--robots", "3", "--workers", 1, *options).err.splitlines()[-1]

    assert [tested("--repeats", 1), tested("--repeats", 1), tested("--repeats", 2)] == [said] * 3
    assert swarmevo_("resume", run, "--generations", "+1").code == 0
    assert tested("--repeats", 1) == said
    file.write_text("{}")
    assert tested("--repeats", 1) == said
    assert table_ii.load(run) is not None

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

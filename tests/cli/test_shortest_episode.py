# SPDX-License-Identifier: BSD-3-Clause
"""Case 23: an episode of a single control step, the shortest that is allowed, at every verb."""

from __future__ import annotations

from pathlib import Path

import pytest

import small_runs
from swarmevo import cli


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_runs.make(tmp_path_factory.mktemp("runs") / "run", "episode.horizon=0.1")


@pytest.mark.parametrize(
    "verb",
    [
        "show",
        "show --json",
        "verify",
        "test --repeats 1",
        "report",
        "replay --html page.html",
        "export --csv",
        "export --json",
    ],
)
def test_every_verb_takes_it(run: Path, verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    name, *options = verb.split()
    options += ["--html", "report.html", "--figures", "figures"] if name == "report" else []
    with pytest.raises(SystemExit) as ended:
        cli.main([name, str(run), *options])
    assert ended.value.code == 0

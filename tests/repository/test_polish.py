# SPDX-License-Identifier: BSD-3-Clause
"""A search that goes on: it does from where the run's has ended, and the page tells how."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import small_runs

# The benchmarks are not installed. At the end of the path: the installed swarmevo comes first.
sys.path.append(str(Path(__file__).parents[2]))

from benchmarks import polish

SETTINGS = (
    "optimiser={cma: {switches: 'on'}}",
    "fitness={shaped: {togetherness: 4.0}}",
    "controller={feedforward: {hidden: 1}}",
    "worlds=[{team.robots: 3}]",
    "evolution.trials=1",
    "evolution.population=6",
)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_runs.make(tmp_path_factory.mktemp("runs") / "best", *SETTINGS)


def test_it_goes_on_from_the_end_of_the_trial(run: Path) -> None:
    config, optimiser = polish.search_of(run, 0)
    again = polish.search_of(run, 0)[1]
    np.testing.assert_array_equal(optimiser.ask(), again.ask())
    generations = optimiser.state()["search"]["generation"]
    assert generations == config.evolution.generations
    polish.go_on(config, again, 2, 1, 2.0)
    assert again.state()["search"]["generation"] == generations + 2
    assert not np.array_equal(again.answer(), optimiser.answer())
    with pytest.raises(SystemExit, match="expected trial 7, but nothing of it is stored"):
        polish.search_of(run, 7)


def test_the_page_has_both_answers_and_the_command(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    genomes = tmp_path / "both.csv"
    words = [str(run), "--generations", "1", "--repeats", "1", "--tests", "2", "--genomes", str(genomes)]
    monkeypatch.setattr(sys, "argv", ["polish", *words])
    polish.main()
    page = capsys.readouterr().out
    assert "swarmevo evolve best --seed 5 --trials 1 --out runs/best" in page
    assert " ".join(["python -m benchmarks.polish", *words]) in page
    assert "4 episodes of each\ngenome and 24 in all, and `success` has the weight 2 beside" in page
    rows = [line.split(" | ")[:2] for line in page.splitlines() if line.startswith(("| before", "| after"))]
    assert rows == [[f"| {name}", str(robots)] for name in ("before", "after") for robots in (3, 4, 5)]
    before = polish.search_of(run, 0)[1].answer()[0]
    np.testing.assert_array_equal(np.loadtxt(genomes, delimiter=",")[0], before)

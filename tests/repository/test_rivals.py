# SPDX-License-Identifier: BSD-3-Clause
"""The page of optimisers: what it keeps of trials, and what it says of planted ones."""

from __future__ import annotations

import json
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

# The benchmarks are not installed. At the end of the path: the installed swarmevo comes first.
sys.path.append(str(Path(__file__).parents[2]))

from benchmarks import rivals
from benchmarks.rivals import Budget, Task, Trial
from swarmevo import plugins
from swarmevo.plugins.team import load_config

ROOT = Path(__file__).parents[2]
SMALL = Budget(episodes=24, population=6, repeats=1, tests=2)
TASK = Task("localisation", "a robot homes", ("box_pushing", "hidden_neurons"), ("team_end",))


def planted(values: dict[str, list[float]]) -> list[Trial]:
    return [Trial("localisation", name, seed, at, at) for name, row in values.items() for seed, at in enumerate(row)]


def test_the_extra_brings_all_that_any_rival_needs() -> None:
    ours, theirs = (
        tomllib.loads((ROOT / folder / "pyproject.toml").read_text())["project"]
        for folder in ("", "plugins/swarmevo_rivals")
    )
    (needed,) = map(Requirement, ours["optional-dependencies"]["rivals"])
    assert (needed.name, needed.extras) == (theirs["name"], set(theirs["optional-dependencies"]))


def test_every_task_is_for_every_rival_and_what_describes_changes_no_objective() -> None:
    rivals_ = {entry.name for entry in plugins.discover() if entry.distribution == "swarmevo-rivals"}
    for task in rivals.TASKS:
        made = rivals.sweeps(task)
        assert {name for sweep in made for one in sweep.optimisers for name in one} == rivals_ | {"pde"}
        for sweep in made:
            for one in sweep.optimisers:
                assert load_config(
                    task.config, [f"optimiser={json.dumps(one)}", f"fitness={json.dumps(sweep.fitness)}"]
                )


def test_the_page_says_who_is_surely_better_and_who_is_not() -> None:
    values = {
        "pde": [0.50, 0.52, 0.54, 0.56, 0.58, 0.60, 0.62, 0.64],
        "cma": [0.70, 0.72, 0.74, 0.76, 0.78, 0.80, 0.82, 0.84],
        "random": [0.10, 0.12, 0.14, 0.16, 0.18, 0.20, 0.22, 0.24],
        "gde3": [0.51, 0.53, 0.55, 0.57, 0.59, 0.61, 0.63, 0.65],
    }
    page = "".join(rivals.page(TASK, planted(values), 8))
    assert page.endswith("By the hypervolume surely: cma better than PDE; random worse.\n")
    rows = [line.split(" | ") for line in page.splitlines() if line.startswith("| ")][2:]
    assert [row[0].strip("| ") for row in rows] == ["cma", "gde3", "pde", "random"]
    assert [row[3] for row in rows] == ["100 % (100 to 100)", rows[1][3], "", "0 % (0 to 0)"]
    # Of 64 pairs gde3's are above in 36: 1 + 2 + ... + 8.
    assert rows[1][3].startswith("56 % (")


def test_p_is_adjusted_for_the_pairs_that_are_shown() -> None:
    """Of six with six that do not overlap p is 2 in 924; three pairs with PDE are shown, of six that there are."""
    rows = {name: [k + at / 10 for at in range(6)] for k, name in enumerate(["pde", "cma", "gde3", "random"])}
    page = "".join(rivals.page(TASK, planted(rows), 6))
    cells = [line.split(" | ") for line in page.splitlines() if line.startswith("| ")][2:]
    assert [row[4] for row in cells] == [f"{3 * 2 / 924:.2g}"] * 3 + [""]
    assert "for the pairs shown" in " ".join(rivals.head(SMALL, "1-6", [TASK]).split())


def test_trials_of_several_sittings_make_the_same_page_whatever_their_order() -> None:
    trials = planted({"pde": [0.3, 0.5, 0.4, 0.35, 0.45], "cma": [0.6, 0.41, 0.43, 0.5, 0.38]})
    assert list(rivals.page(TASK, trials, 5)) == list(rivals.page(TASK, trials[::-1], 5))


def test_what_is_kept_reads_back_and_another_budget_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "rivals.csv"
    trials = planted({"pde": [0.1 + 0.2, 1 / 3], "pde, own rates": [1e-9]})
    rivals.write(path, trials[::-1], SMALL)
    assert rivals.read(path, SMALL) == sorted(trials)
    assert rivals.read(tmp_path / "none.csv", SMALL) == []
    with pytest.raises(SystemExit, match=r"expected trials with Budget.*tests=3.*--kept"):
        rivals.read(path, Budget(episodes=24, population=6, repeats=1, tests=3))
    path.write_text(path.read_text().replace("cross-fitted", "otherwise"))
    with pytest.raises(SystemExit, match=r"expected numbers that are cross-fitted, got others; move it away"):
        rivals.read(path, SMALL)


def test_only_seeds_that_are_not_kept_are_evolved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(rivals, "TASKS", (TASK,))
    monkeypatch.setattr(rivals, "OTHERS", ({"pde": {}}, {"random": {}}, {"pde": {"rates": "self"}}))
    kept, out = tmp_path / "rivals.csv", tmp_path / "runs"
    options = ["--episodes", "24", "--population", "6", "--repeats", "1", "--tests", "2", "--tasks", "localisation"]

    def call(seeds: str, *more: str) -> str:
        words = [*options, "--seeds", seeds, "--out", str(out), "--kept", str(kept), *more]
        monkeypatch.setattr(sys, "argv", ["rivals", *words])
        rivals.main()
        return capsys.readouterr().out

    first = call("1")
    assert "| pde | 1 |" in first
    assert "| random | 1 |" in first
    assert "| map_elites | 1 |" in first
    assert "--seeds 1 --episodes 24 --population 6 --repeats 1 --tests 2 --tasks localisation" in first
    rows = kept.read_text()
    assert len(rows.splitlines()) == 1 + 5  # pde with rates of its own, too
    kept.rename(tmp_path / "before.csv")
    bits = (out / "localisation").rglob("run.sqlite")
    evolved = {file: file.read_bytes() for file in bits}
    assert call("1") == first  # computed anew, not evolved
    assert kept.read_text() == rows
    assert len(evolved) == 5
    assert all(file.read_bytes() == content for file, content in evolved.items())
    kept.write_text("".join(line for line in rows.splitlines(keepends=True) if ",map_elites," not in line))
    assert call("1") == first  # who is missing is computed anew
    assert kept.read_text() == rows
    (out / "localisation").rename(tmp_path / "gone")
    assert "| pde | 2 |" in call("1-2")
    assert set(rows.splitlines()) < set(kept.read_text().splitlines())
    assert sorted(one.name for one in (out / "localisation").iterdir()) == ["seed-2", "seed-2-maps"]
    assert call("1") == first
    assert "so far" not in first
    assert "\n2 of 4 seeds so far.\n" in call("1-4", "--stored")
    assert sorted(one.name for one in (out / "localisation").iterdir()) == ["seed-2", "seed-2-maps"]
    assert "None yet." in call("7", "--stored")

# SPDX-License-Identifier: BSD-3-Clause
"""Each task that ships can be done by a controller by hand, is not done by chance, and evolves."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

# Benchmarks and examples are not installed. At the end of the path: the installed swarmevo comes first.
sys.path.append(str(Path(__file__).parents[2]))

from benchmarks import tasks
from swarmevo import cli
from swarmevo.plugins.team import load_config

EPISODES = 6
LEAST = {
    "aggregation": {"aggregation": (0.7, 0.55), "largest_cluster": (0.8, 0.5)},
    "clearing": {"delivery": (0.85, 0.3), "transport": (0.9, 0.3)},
    "coverage": {"coverage": (0.7, 0.3)},
    "foraging": {"delivery": (0.3, 0.1), "transport": (0.5, 0.25)},
    "localisation": {"box_pushing": (3.0, 1.5), "homing": (0.8, 0.6)},
    "phototaxis": {"nearness": (0.9, 0.7), "arrived": (0.9, 0.3)},
    "paper": {"box_pushing": (20.0, 5.0)},
}
"""For each task's objectives what the controller by hand has at least, and random genomes at most, in the mean."""


def test_every_baseline_is_tried() -> None:
    assert LEAST.keys() == tasks.BASELINES.keys()


@pytest.mark.parametrize("task", LEAST)
def test_the_baseline_scores_and_random_genomes_do_not(task: str) -> None:
    settings = load_config(task)
    scores = [
        dict(zip(tasks.names(settings), values.mean(axis=0), strict=True))
        for values in (tasks.baseline(settings, task, EPISODES, seed=7), tasks.random(settings, EPISODES, seed=7))
    ]
    assert LEAST[task].keys() == scores[0].keys()
    for name, (least, most) in LEAST[task].items():
        assert scores[0][name] >= least, name
        assert scores[1][name] <= most, name


def test_a_box_needs_three_robots() -> None:
    """Of four, two press on each of the boxes, and neither moves."""
    assert not tasks.baseline(load_config("clearing", ["team.robots=4"]), "clearing", EPISODES, seed=7).any()


def test_the_table_of_the_page_is_printed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", ["tasks", "coverage", "--episodes", "2"])
    tasks.main()
    head, _, line = capsys.readouterr().out.splitlines()
    assert head == "| task | objective | by hand | random |"
    assert line.startswith("| coverage | coverage | 0.")


SPOKEN = {
    "aggregation": ("largest cluster >= 1", "not in the largest cluster in the end"),
    "clearing": ("all delivered", "never touched a movable"),
    "coverage": ("coverage >= 0.8", "mostly in others' tracks"),
    "foraging": ("all delivered", "delivery", "never touched a movable"),
    "localisation": ("homing", "left the source again"),
    "phototaxis": ("arrived >= 1", "away from the emitter in the end"),
    "paper": ("homing", "pushing", "pushed without RF"),
}
"""For each task a measure of success and a behaviour that are its own."""
HOMING, PUSHING = "homing", "pushing"
UNSPOKEN = {
    "aggregation": (HOMING, PUSHING, "source", "RF"),
    "clearing": ("push\n", "push in", "push rate", "box"),
    "coverage": (HOMING, PUSHING, "source", "RF"),
    "foraging": ("push\n", "push in", "push rate", "box"),
    "localisation": ("push\n", "RF", "circling together"),
    "phototaxis": (HOMING, PUSHING, "source", "RF"),
    "paper": ("all delivered", "movable"),
}
"""For each task words of the paper's that say nothing there."""


@pytest.mark.parametrize("task", LEAST)
def test_it_evolves_and_is_spoken_of_and_verified(
    task: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    short = ["evolution.generations=2", "evolution.population=4", "evolution.repeats=1", "episode.horizon=2.0"]
    settings = [word for setting in short for word in ("--set", setting)]
    said = ""
    for command in (
        ["evolve", task, *settings, "--seed", "1", "--out", "run"],
        ["show", "run"],
        ["test", "run", "--robots", "1", "--repeats", "1", "--until", "0.5"],
        ["verify", "run"],
    ):
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(tmp_path)
            with pytest.raises(SystemExit) as exit:
                cli.main(command)
        out, errors = capsys.readouterr()
        assert not exit.value.code, errors
        said += out if command[0] in ("show", "test") else ""
    assert [word for word in SPOKEN[task] if word not in said] == []
    assert [word for word in UNSPOKEN[task] if word in said] == []

# SPDX-License-Identifier: BSD-3-Clause
"""Trackers of other people: what they are told, and that a bad one does a run no harm."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import swarmevo as se
from cli.conftest import Swarmevo
from cli.conftest import swarmevo_ as swarmevo_
from conftest import Distribution

NOTES = """
    import json
    from pathlib import Path
    class Notes:
        def __init__(self, run):
            self.file = Path(run.folder, "notes.jsonl")
            self.run = run
        def lines(self):
            return [json.loads(line) for line in self.file.read_text().splitlines()] if self.file.exists() else []
        def logged(self, trial):
            return sum(line["trial"] == trial for line in self.lines())
        def log(self, trial, generation, scalars):
            with self.file.open("a") as file:
                file.write(json.dumps({"trial": trial, "generation": generation, "seed": self.run.seed,
                    "population": self.run.config["evolution"]["population"], **scalars}) + "\\n")
        def close(self):
            pass
    class Faulty(Notes):
        def log(self, trial, generation, scalars):
            if generation == 1 and trial == 0: raise OSError("no route to host")
            super().log(trial, generation, scalars)
    class Absurd(Notes):
        def logged(self, trial):
            return -1
    class Poor:
        def __init__(self, run):
            pass
    def refuses(run):
        raise ValueError("no key; set NOTES_KEY")
"""
GROUP = {name: f"notes:{name.capitalize()}" for name in ("notes", "faulty", "absurd", "poor")} | {
    "refuses": "notes:refuses"
}


@pytest.fixture(autouse=True)
def _installed(distribution: Distribution) -> None:
    distribution("notes", "1.0", {"swarmevo.trackers": GROUP}, notes=NOTES)


def noted(run: str) -> list[tuple[int, int]]:
    lines = [json.loads(line) for line in Path(run, "notes.jsonl").read_text().splitlines()]
    return [(line["trial"], line["generation"]) for line in lines]


EVERY = [(trial, generation) for trial in (0, 1) for generation in (0, 1)]


def test_a_tracker_is_told_each_generation_once(swarmevo_: Swarmevo) -> None:
    assert swarmevo_("evolve", "small.yaml", "--seed", 3, "--out", "run", "--log", "notes").code == 0
    assert noted("run") == EVERY
    first = json.loads(Path("run/notes.jsonl").read_text().splitlines()[0])
    assert (first["seed"], first["population"], first["episodes"]) == (3, 4, 4)
    assert swarmevo_("resume", "run", "--log", "notes").code == 0
    assert noted("run") == EVERY


def test_from_python(tmp_path: Path) -> None:
    small = {"episode.horizon": 1, "evolution.population": 4, "evolution.generations": 2, "evolution.trials": 2}
    se.evolve("quick", seed=1, out=tmp_path / "run", set=small, log=["notes"])
    assert noted(str(tmp_path / "run")) == EVERY


def test_a_tracker_that_fails_is_told_and_the_run_goes_on(swarmevo_: Swarmevo) -> None:
    done = swarmevo_("evolve", "small.yaml", "--seed", 3, "--out", "run", "--log", "faulty", "--log", "notes")
    assert done.code == 0
    warnings = [line for line in done.err.splitlines() if line.startswith("warning: ")]
    assert warnings == [
        "warning: tracker.faulty (notes 1.0): log: raised OSError: no route to host; the run goes on, this session "
        "logs no more there"
    ]
    assert "4 of 4" not in done.err
    assert json.loads(swarmevo_("show", "run", "--json").out)["complete"]


def test_an_absurd_answer_is_told(swarmevo_: Swarmevo) -> None:
    done = swarmevo_("evolve", "small.yaml", "--out", "run", "--log", "absurd")
    assert done.code == 0
    assert "warning: tracker.absurd (notes 1.0): logged: expected a number of generations, got -1; " in done.err


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--log", "tensorbord"], 1, "tracker.tensorbord: no such plugin; did you mean tensorboard?"),
        (["--log", "notes", "--log", "notes"], 2, "--log notes: given twice; leave one out"),
        (["--log", "refuses"], 1, "--log refuses: ValueError: no key; set NOTES_KEY"),
        (
            ["--log", "poor"],
            1,
            "tracker.poor (notes 1.0, notes:Poor): expected the methods logged, log and close, got Poor",
        ),
    ],
)
def test_what_cannot_be_used_is_refused_before_a_folder_is_made(
    swarmevo_: Swarmevo, arguments: list[str], code: int, message: str
) -> None:
    done = swarmevo_("evolve", "small.yaml", *arguments, "--out", "run")
    assert (done.code, done.errors) == (code, [message])
    assert not Path("run").exists()


def test_trackers_are_listed_as_other_plugins_are(swarmevo_: Swarmevo) -> None:
    rows = [line.split()[:2] for line in swarmevo_("plugins").out.splitlines()]
    assert ["tracker", "tensorboard"] in rows
    assert "sound" in swarmevo_("plugins", "check", "tensorboard").out

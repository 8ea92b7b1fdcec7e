# SPDX-License-Identifier: BSD-3-Clause
"""Evolving and going on: what is printed where, interruption, and that errors leave nothing behind."""

from __future__ import annotations

import json
import os
import pty
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import datetime, tzinfo
from pathlib import Path
from typing import Any

import pytest
import yaml

from cli.conftest import SMALL, Swarmevo, files
from conftest import Distribution
from swarmevo.evolution.loop import Progress
from swarmevo.runs import driver
from swarmevo.runs.store import Store
from swarmevo.views import console


def test_evolve_prints_the_front_on_stdout_and_progress_on_stderr(swarmevo_: Swarmevo) -> None:
    done = swarmevo_("evolve", "small.yaml", "--seed", 1, "--out", "run", "--workers", 2)
    assert done.code == 0
    assert "Front over all trials" in done.out
    assert "Front of trial 1" in done.out
    first, *lines = done.err.partition("next:\n")[0].splitlines()
    assert first == "run run, seed 1"
    pattern = r"trial [01]/1, generation [01]/1: best box_pushing \S+, front \d, \d new, \S+ episodes/s, 0:00:0\d left"
    assert [bool(re.fullmatch(pattern, line)) for line in lines] == [True] * 4
    assert {path.name for path in Path("run").iterdir()} == {"config.yaml", "provenance.json", "run.sqlite"}


@pytest.mark.parametrize(("columns", "lines"), [(40, 11), (80, 6), (120, 6)])
def test_what_comes_next_fits_the_terminal(
    swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch, columns: int, lines: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    out = "runs of many/a-name"
    done = swarmevo_("evolve", "small.yaml", "--seed", 1, "--trials", 1, "--out", out)
    told = done.err.partition("next:\n")[2]
    assert len(told.splitlines()) == lines
    assert [line for line in told.splitlines() if len(line) > columns] == []
    commands = [line for line in re.sub(r" \\\n +", " ", told).splitlines() if line.startswith("  swarmevo ")]
    assert [shlex.split(line) for line in commands] == [
        ["swarmevo", verb, out] for verb in ("report", "replay", "test")
    ]


def test_what_comes_next_stands_in_columns_where_there_is_room(swarmevo_: Swarmevo) -> None:
    told = swarmevo_("evolve", "small.yaml", "--seed", 1, "--trials", 1, "--out", "x").err.partition("next:\n")[2]
    assert [re.split(" {2,}", line)[1:] for line in told.splitlines()] == [
        ["swarmevo report x", "its front and its replays as a page to open"],
        ["swarmevo replay x", "the most successful of its front in 3-D"],
        ["swarmevo test x", "its front on fresh seeds; those above are a bit too good"],
    ]
    assert len({re.search("(its front|the most)", line).start() for line in told.splitlines()}) == 1


def test_show_says_what_evolve_said(swarmevo_: Swarmevo) -> None:
    evolved = swarmevo_("evolve", "small.yaml", "--seed", 1, "--out", "run")
    assert swarmevo_("show", "run").out == evolved.out


STUBBORN = """
    class Stubborn:
        def __init__(self, space, population, objectives, rng, new_at: int = 0):
            self._genomes, self._told, self._new_at = rng.standard_normal((population, space.size)), 0, new_at
        def ask(self):
            return self._genomes + (self._told == self._new_at)
        def tell(self, genomes, costs):
            self._told += 1
        def state(self):
            return {"genomes": self._genomes, "told": self._told}
        def restore(self, state):
            self._genomes, self._told = state["genomes"], state["told"]
"""
STANDSTILL = "no new genome; the optimiser asked only for those that the trial had before"


def test_generations_without_a_new_genome_are_a_warning(swarmevo_: Swarmevo, distribution: Distribution) -> None:
    """Case 50: of any optimiser, once where they begin, and counted by show."""
    distribution("dull", "1.0", {"swarmevo.optimisers": {"stubborn": "dull:Stubborn"}}, dull=STUBBORN)
    settings = ["--set", "evolution.generations=6", "optimiser.stubborn.new_at=3"]
    done = swarmevo_("evolve", "small.yaml", "--plugin", "stubborn", "--seed", 1, "--out", "run", *settings)
    assert done.code == 0
    new = [int(count) for count in re.findall(r"front \d, (\d) new, ", done.err)]
    assert new == [4, 0, 0, 4, 0, 0] * 2
    warnings = [line for line in done.err.splitlines() if line.startswith("warning")]
    places = [f"trial {trial}, generation {generation}" for trial in (0, 1) for generation in (1, 4)]
    assert warnings == [f"warning: {place}: {STANDSTILL}" for place in places]
    shown = swarmevo_("show", "run").out
    assert shown == done.out
    assert shown.count("6 of 6 generations, 0 to 4 new genomes each") == 2
    assert f"warning: trial 1: in 4 generations, first in 1, {STANDSTILL}" in shown
    (first, _) = json.loads(swarmevo_("show", "run", "--json").out)["trials"]
    assert [step["new_genomes"] for step in first["history"]] == [4, 0, 0, 4, 0, 0]


def test_a_seed_is_drawn_printed_and_stored(swarmevo_: Swarmevo) -> None:
    done = swarmevo_("evolve", "small.yaml", "--trials", 1)
    printed = re.match(r"run (runs/small-\d{8}-\d{6}-(\d+)), seed (\d+)\n", done.err)
    assert printed
    folder, in_name, seed = printed.groups()
    assert seed == in_name
    assert yaml.safe_load(Path(folder, "config.yaml").read_text())["evolution"]["seed"] == int(seed)


def test_runs_begun_in_the_same_second_have_folders_of_their_own(
    swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 55: with the same seed, the second and the third have a number behind their names."""

    class Noon(datetime):
        @classmethod
        def now(cls, tz: tzinfo | None = None) -> Noon:
            return cls(2026, 1, 2, 12, 0, 0, tzinfo=tz)

    monkeypatch.setattr(driver, "datetime", Noon)
    begun = [swarmevo_("evolve", "small.yaml", "--seed", 1, "--trials", i) for i in (1, 2, 3)]
    names = [f"runs/small-20260102-120000-1{number}" for number in ("", "-2", "-3")]
    assert [done.err.splitlines()[0] for done in begun] == [f"run {name}, seed 1" for name in names]
    assert [yaml.safe_load(Path(name, "config.yaml").read_text())["evolution"]["trials"] for name in names] == [1, 2, 3]


def test_processes_that_begin_together_take_no_folder_of_another(tmp_path: Path) -> None:
    """Case 55."""
    (tmp_path / "small.yaml").write_text(SMALL)
    command = [sys.executable, "-m", "swarmevo", "evolve", "small.yaml", "--seed", "1"]
    begun = [subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) for _ in range(3)]
    said = [process.communicate()[1] for process in begun]
    assert [process.returncode for process in begun] == [0, 0, 0], said
    assert len(list((tmp_path / "runs").iterdir())) == 3


def test_options_and_settings_reach_the_run(swarmevo_: Swarmevo) -> None:
    done = swarmevo_(
        *("evolve", "small.yaml", "--plugin", "pde", "--trials", 1, "--seed", 3, "--out", "run"),
        *("--set", "evolution.generations=1", "optimiser.pde.crossover_rate=0.9", "--set", "team.robots=2"),
    )
    assert done.code == 0
    stored = yaml.safe_load(Path("run/config.yaml").read_text())
    assert stored["optimiser"] == {"pde": {"crossover_rate": 0.9}}
    assert stored["team"]["robots"] == 2
    assert stored["evolution"]["trials"] == stored["evolution"]["generations"] == 1


def test_a_run_folder_is_never_overwritten(swarmevo_: Swarmevo) -> None:
    Path("run").mkdir()
    done = swarmevo_("evolve", "small.yaml", "--out", "run")
    assert done.code == 2
    assert done.errors == ["--out run: exists already and is never overwritten; choose another name"]
    assert files() == {"small.yaml", "run"}


def test_dry_run_forecasts_and_writes_nothing(swarmevo_: Swarmevo) -> None:
    done = swarmevo_("evolve", "small.yaml", "--dry-run", "--workers", 1)
    assert done.code == 0
    assert done.out.startswith("16 episodes, 0:00:16 simulated\n")
    assert "episodes/s on 1 workers, measured on 4 episodes" in done.out
    assert files() == {"small.yaml"}


def test_a_failure_during_the_run_is_one_line_and_says_how_to_go_on(
    swarmevo_: Swarmevo, distribution: Callable[..., Path]
) -> None:
    source = """
    import numpy as np
    class Sulky:
        def __init__(self, space, population, objectives, rng):
            self.size, self.told = space.size, 0
        def ask(self):
            if self.told: raise RuntimeError("no more\\nideas")
            return np.zeros((2, self.size))
        def tell(self, genomes, costs): self.told = 1
        def state(self): return {"told": self.told}
        def restore(self, state): self.told = state["told"]
    """
    distribution("moods", "0.3", {"swarmevo.optimisers": {"sulky": "sulky:Sulky"}}, sulky=source)
    done = swarmevo_("evolve", "small.yaml", "--plugin", "sulky", "--out", "run")
    assert done.code == 1
    assert "go on with: swarmevo resume run\n" in done.err
    (line,) = done.errors
    assert "sulky" in line
    assert "moods" in line
    assert "no more ideas" in line


# ---- interruption ----------------------------------------------------------------------------------------------------


def results(folder: str) -> list[Any]:
    with Store.open(folder) as store:
        kept = [store.generation(trial, number) for trial in range(2) for number in range(store.generations(trial))]
    return [
        (generation.episodes.grid("hash").tolist(), generation.episodes.grid("objective").tolist())
        for generation in kept
    ]


@pytest.fixture
def signal_after_a_generation(monkeypatch: pytest.MonkeyPatch) -> Callable[[signal.Signals], None]:
    """Have the first generation end with a signal to this process."""
    unpatched = console.progress

    def patch(number: signal.Signals) -> None:
        @contextmanager
        def progress(done: int, total: int) -> Iterator[Callable[[Progress], None]]:
            with unpatched(done, total) as observe:

                def observe_and_signal(now: Progress) -> None:
                    observe(now)
                    if done == 0 and now.trial == now.generation == 0:
                        signal.raise_signal(number)

                yield observe_and_signal

        monkeypatch.setattr(console, "progress", progress)

    return patch


@pytest.fixture
def usual_signals() -> Iterator[None]:
    """Let signals do what they do in a terminal: a shell's background job starts with SIGINT ignored."""
    usual = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: signal.SIG_DFL}
    before = {number: signal.signal(number, handler) for number, handler in usual.items()}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures("usual_signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_cleanly_and_resume_gives_the_uninterrupted_result(
    swarmevo_: Swarmevo, signal_after_a_generation: Callable[[signal.Signals], None], number: signal.Signals
) -> None:
    handlers = [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)]
    swarmevo_("evolve", "small.yaml", "--seed", 1, "--out", "whole")
    signal_after_a_generation(number)
    folder = "cut in two"
    done = swarmevo_("evolve", "small.yaml", "--seed", 1, "--out", folder)
    assert done.code == 130
    assert done.out == ""
    assert done.err.splitlines()[-2:] == [
        "stopping; once more to stop at once",
        "interrupted; go on with: swarmevo resume 'cut in two'",
    ]
    assert "not complete" in swarmevo_("show", folder).out

    command = done.err.splitlines()[-1].partition(": ")[2]
    resumed = swarmevo_(*shlex.split(command)[1:], "--workers", 2)
    assert resumed.code == 0
    assert "complete" in resumed.out
    assert results(folder) == results("whole")
    assert [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)] == handlers


def test_resume_of_a_complete_run_shows_it(swarmevo_: Swarmevo) -> None:
    evolved = swarmevo_("evolve", "small.yaml", "--seed", 1, "--out", "run")
    again = swarmevo_("resume", "run")
    assert again[:2] == (0, evolved.out)
    assert [line.split()[:2] for line in again.err.splitlines()[1:]] == [
        ["swarmevo", verb] for verb in ("report", "replay", "test")
    ]


# ---- terminals -------------------------------------------------------------------------------------------------------


def on_a_terminal(folder: Path, **environment: str) -> tuple[str, str]:
    """Evolve with stderr on a terminal; return stdout and stderr."""
    (folder / "small.yaml").write_text(SMALL)
    host, terminal = pty.openpty()
    command = [sys.executable, "-m", "swarmevo", "evolve", "small.yaml", "--seed", "1", "--out", "run"]
    process = subprocess.Popen(
        command,
        cwd=folder,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "100", **environment},
        stdout=subprocess.PIPE,
        stderr=terminal,
        text=True,
    )
    os.close(terminal)
    said = b""
    while True:
        try:
            chunk = os.read(host, 65536)
        except OSError:  # the other end is closed
            break
        said += chunk
    os.close(host)
    out, _ = process.communicate(timeout=60)
    assert process.returncode == 0
    return out, said.decode()


def test_a_live_bar_on_a_terminal(tmp_path: Path) -> None:
    out, err = on_a_terminal(tmp_path)
    assert "━" in err
    assert "\x1b[" in err
    assert re.search(r"trial 1/1 gen 1/1  box_pushing \S+  front \d  \d new  \S+ ep/s  ETA 0:00:00", err)
    assert "\x1b" not in out


def test_no_color_is_honoured(tmp_path: Path) -> None:
    _, err = on_a_terminal(tmp_path, NO_COLOR="1")
    assert "━" in err
    assert not re.search(r"\x1b\[[0-9;]*3[0-9]m|\x1b\[9[0-9]m", err)


def test_plain_lines_on_a_dumb_terminal(tmp_path: Path) -> None:
    _, err = on_a_terminal(tmp_path, TERM="dumb")
    assert "\x1b" not in err
    assert "trial 1/1, generation 1/1: best box_pushing" in err


# ---- bad configurations ----------------------------------------------------------------------------------------------


# What the file says: the places that the errors must name, all of them and no other. Errors about where things stand
# come from the library, those about options from the plugins.
BAD = {
    "": ["bad.yaml"],
    "- arena\n- box": ["bad.yaml"],
    "arena: {size: 1": ["bad.yaml"],
    "box:\n  mass: 1\n  mass: 2": ["bad.yaml"],
    "arena: {siz: 1}": ["arena.siz"],
    "speed: 3": ["speed"],
    "box: {mass: 240 g}": ["box.mass"],
    "box: {mass: -0.24}": ["box.mass"],
    "box: {mass: .nan, size: [.inf, 1, 1]}": ["box.size[0]", "box.mass"],
    'box: {mass: "0.24"}': ["box.mass"],
    "noise: {rf: true}": ["noise.rf"],
    "arena: {size: 1000}": ["arena.size"],
    "episode: {horizon: 180000}": ["episode.horizon"],
    "team: {robots: 0}": ["team.robots"],
    "team: {robots: 1000000000}": ["team.robots"],
    "team: {robots: five}": ["team.robots"],
    "evolution: {seed: -1, population: 0, trials: 1.5}": [
        "evolution.population",
        "evolution.trials",
        "evolution.seed",
    ],
    "optimiser: {pde: {}, other: {}}": ["optimiser"],
    "optimiser: other": ["optimiser.other"],
    "optimiser: {pde: {crossover: 0.7}}": ["optimiser.pde.crossover"],
    "optimiser: {pde: {crossover_rate: 70%, mutation_rate: 1}}": ["optimiser.pde.crossover_rate"],
    "controller: {feedforward: {hidden: -1}}": ["controller.feedforward.hidden"],
    "evolution: {population: 2}": ["optimiser.pde"],
    "team: {robots: 2, start: poses, start_poses: [[0, 0, 0], [0.05, 0, 0]]}": ["team.start_poses[1]"],
    "team: {robots: 2, start: poses, start_poses: [[0, 0, 0]]}": ["team.start_poses"],
    "team: {robots: 1, start: poses, start_poses: [[0.6, 0, 0]]}": ["team.start_poses[0]"],
    "team: {robots: 1, start: poses, start_poses: [[0, 0.3, 0]]}": ["team.start_poses[0]"],
    "box: {pose: [0, 0.5, 0]}": ["box.pose"],
    "robot: {centre_of_mass: 0.06}": ["robot.centre_of_mass"],
    "emitter: {strength: [50, 1]}": ["emitter.strength"],
    "episode: {control_period: 0.03}": ["episode.control_period"],
    "noise: {rf: -1}\nbox: {pose: [9, 9, 0]}\noptimiser: {pde: {rate: 1}}\nfitness: nothing\ncolour: red": [
        "noise.rf",
        "colour",
        "box.pose",
        "fitness.nothing",
        "optimiser.pde.rate",
    ],
}


@pytest.mark.parametrize("text", BAD)
def test_a_bad_configuration(swarmevo_: Swarmevo, text: str) -> None:
    Path("bad.yaml").write_text(text)
    for mode in ([], ["--dry-run"]):
        done = swarmevo_("evolve", "bad.yaml", *mode)
        assert done.code == 2
        assert done.out == ""
        assert done.err.splitlines() == [f"error: {error}" for error in done.errors]
        assert [error.split(": ")[0] for error in done.errors] == BAD[text]
    assert files() == {"small.yaml", "bad.yaml"}


@pytest.mark.parametrize("mode", [[], ["--dry-run"]])
def test_plugins_that_do_not_fit_together(swarmevo_: Swarmevo, mode: list[str]) -> None:
    """Whether a genome is larger than a fitness function takes it shows in evaluations, in some sooner or later."""
    done = swarmevo_("evolve", "small.yaml", "--set", "controller.feedforward.hidden=16", *mode)
    assert (done.code, done.out) == (2, "")
    (line,) = done.errors
    assert line.startswith("fitness.hidden_neurons (swarmevo ")
    assert "maximum: expected at most 15 hidden neurons, a genome uses 16" in line
    assert files() == {"small.yaml"}
    settings = ["controller.feedforward.hidden=16", "fitness.hidden_neurons.maximum=16"]
    assert swarmevo_("evolve", "small.yaml", "--set", *settings, *mode).code == 0


def test_a_bad_override_is_listed_with_the_files_errors(swarmevo_: Swarmevo) -> None:
    Path("bad.yaml").write_text("noise: {rf: 2}")
    done = swarmevo_("evolve", "bad.yaml", "--seed", -3, "--plugin", "ped", "--set", "arena.size=big", "team.colour=1")
    assert [error.split(": ")[0] for error in done.errors] == [
        "arena.size",
        "team.colour",
        "noise.rf",
        "evolution.seed",
        "optimiser.ped",
    ]


def test_a_missing_file(swarmevo_: Swarmevo) -> None:
    done = swarmevo_("evolve", "papper")
    assert (done.code, done.errors) == (2, ["papper: no such file; did you mean paper?"])

# SPDX-License-Identifier: BSD-3-Clause
"""``--log tensorboard``: event files, read back with TensorBoard's own reader, whatever ended the run."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cli.conftest import SMALL, Swarmevo, files
from cli.conftest import swarmevo_ as swarmevo_

pytest.importorskip("tensorboard")

Series = dict[str, list[tuple[int, float]]]
TAGS = {
    *("hypervolume", "best/box_pushing", "best/hidden_neurons", "front_size", "new_genomes", "episodes"),
    "episodes_per_second",
}


def read(run: Path | str, trial: int) -> Series:
    """Return what TensorBoard shows of a trial: for each name the steps and values, in the order of the files."""
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    events = EventAccumulator(str(Path(run, "tensorboard", f"trial-{trial}")), size_guidance={"scalars": 0})
    events.Reload()
    return {tag: [(one.step, one.value) for one in events.Scalars(tag)] for tag in events.Tags()["scalars"]}


def steps(run: Path | str, trial: int) -> list[int]:
    """Return the steps of a trial, which are those of each of its series."""
    found = read(run, trial)
    assert set(found) == TAGS
    (same,) = {tuple(step for step, _ in series) for series in found.values()}
    return list(same)


def test_each_generation_is_there_once_with_what_show_says(swarmevo_: Swarmevo) -> None:
    done = swarmevo_("evolve", "small.yaml", "--seed", 1, "--out", "run", "--log", "tensorboard")
    assert done.code == 0, done.err
    shown = json.loads(swarmevo_("show", "run", "--json").out)
    volume = 1.0
    for objective in shown["objectives"]:
        volume *= objective["range"][1] - objective["range"][0]
    for trial in shown["trials"]:
        found = read("run", trial["trial"])
        assert set(found) == TAGS
        assert found["hypervolume"] == [
            (step["generation"], pytest.approx(step["hypervolume"] / volume)) for step in trial["history"]
        ]
        for name in ("box_pushing", "hidden_neurons"):
            expected = [(step["generation"], pytest.approx(step["best"][name])) for step in trial["history"]]
            assert found[f"best/{name}"] == expected
        for name in ("front_size", "new_genomes", "episodes"):
            assert found[name] == [(step["generation"], step[name]) for step in trial["history"]]


def test_what_earlier_generations_lack_is_made_up_for(swarmevo_: Swarmevo) -> None:
    swarmevo_("evolve", "small.yaml", "--seed", 1, "--out", "run", "--trials", 1)
    assert not Path("run/tensorboard").exists()
    assert swarmevo_("resume", "run", "--generations", "+2", "--log", "tensorboard").code == 0
    assert steps("run", 0) == [0, 1, 2, 3]
    assert swarmevo_("resume", "run", "--generations", "+1").code == 0  # without
    assert swarmevo_("resume", "run", "--log", "tensorboard").code == 0  # nothing is left to evolve
    assert steps("run", 0) == [0, 1, 2, 3, 4]


def test_after_kill_9_no_generation_is_twice_or_missing(tmp_path: Path, swarmevo_: Swarmevo) -> None:
    Path("small.yaml").write_text(SMALL)
    chosen = "--set", "evolution.generations=150", "--seed", "1", "--trials", "1"
    command = [sys.executable, "-m", "swarmevo", "evolve", "small.yaml", *chosen, "--out", "run"]
    killed = subprocess.Popen([*command, "--log", "tensorboard"], cwd=tmp_path, stderr=subprocess.PIPE)
    while not list(Path("run").glob("tensorboard/trial-0/*")):
        assert killed.poll() is None
        time.sleep(0.05)
    killed.kill()
    killed.communicate()
    (file,) = Path("run").glob("tensorboard/trial-0/*")
    with file.open("rb+") as stream:  # as if it was killed within a record
        stream.truncate(max(60, file.stat().st_size - 7))
    assert swarmevo_("resume", "run", "--log", "tensorboard").code == 0
    assert sorted(steps("run", 0)) == list(range(150))


def test_each_run_of_a_sweep_has_its_own(swarmevo_: Swarmevo) -> None:
    grid = "--grid", "evolution.population=4,5", "--seeds", "1"
    done = swarmevo_("sweep", "small.yaml", *grid, "--out", "s", "--workers", 2, "--log", "tensorboard")
    assert done.code == 0, done.err
    for size in (4, 5):
        assert [value for _, value in read(f"s/population={size}/seed-1", 1)["episodes"]] == [size, 2 * size]


@pytest.mark.parametrize("verb", ["evolve", "sweep"])
def test_without_the_library_it_is_one_line_and_nothing_is_written(
    swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch, verb: str
) -> None:
    monkeypatch.setitem(sys.modules, "tensorboard.summary.writer", None)
    done = swarmevo_(verb, "small.yaml", "--log", "tensorboard", "--out", "new")
    assert (done.code, done.out) == (1, "")
    assert done.errors == ["--log tensorboard: needs TensorBoard: pip install 'swarmevo[tensorboard]'"]
    assert files() == {"small.yaml"}

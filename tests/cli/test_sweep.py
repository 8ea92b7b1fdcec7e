# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo sweep``: real runs of a second in processes of their own, whatever ends them; and what is refused."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from cli.conftest import SMALL, Swarmevo, files
from conftest import Distribution
from swarmevo import config as configuration
from swarmevo.cli.compare import _groups as groups
from swarmevo.errors import StoreError
from swarmevo.runs.store import Store
from swarmevo.sweeps import board as boards
from swarmevo.sweeps import cell as cells
from swarmevo.sweeps.extension import extended
from swarmevo.sweeps.folder import Sweep
from swarmevo.sweeps.grid import Names, Setting

GRID = ("--grid", "optimiser.pde.mutation_rate=0.01,0.5", "evolution.population=4,6", "--seeds", "1,3")
FOLDERS = [f"mutation_rate={rate},population={size}" for rate in ("0.01", "0.5") for size in (4, 6)]


def bits(folder: Path | str) -> list[Any]:
    """Return what a run evolved, in all its trials."""
    with Store.open(folder) as store:
        kept = [store.generation(trial, n) for trial in store.trials() for n in range(store.generations(trial))]
        return [(one.genomes.tolist(), one.episodes["hash"].tolist()) for one in kept]


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep, and the process's report of it."""
    folder = tmp_path_factory.mktemp("swept")
    (folder / "small.yaml").write_text(SMALL)
    done = swarmevo(folder, "sweep", "small.yaml", *GRID, "--out", "s", "--workers", "2")
    assert done.returncode == 0, done.stderr
    (folder / "out").write_text(done.stdout)
    (folder / "err").write_text(done.stderr)
    return folder


def swarmevo(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "swarmevo", *arguments], cwd=folder, capture_output=True, text=True)


# ---- what is found ---------------------------------------------------------------------------------------------------


def test_a_run_folder_for_each_setting_and_seed(swept: Path) -> None:
    runs = sorted(str(file.parent.relative_to(swept / "s")) for file in swept.glob("s/*/*/run.sqlite"))
    assert runs == sorted(f"{name}/seed-{seed}" for name in FOLDERS for seed in (1, 3))
    others = {path.name for path in (swept / "s").iterdir()} - set(FOLDERS)
    assert others == {"sweep.json", "sweep.html"}
    lines = (swept / "err").read_text().splitlines()
    assert lines[0] == "sweep s: 4 settings, 2 seeds"
    assert [line.split(",")[0] for line in lines[1:9]] == [f"run {number}/8" for number in range(1, 9)]
    assert lines[9:] == ["written: s/sweep.html", "test whether they differ with: swarmevo compare s"]


def test_a_run_has_the_bits_of_evolve_with_its_settings(swept: Path, swarmevo_: Swarmevo) -> None:
    chosen = "--set", "optimiser.pde.mutation_rate=0.5", "evolution.population=6"
    assert swarmevo_("evolve", "small.yaml", "--seed", 3, *chosen, "--out", "run").code == 0
    run = swept / "s" / FOLDERS[3] / "seed-3"
    assert bits(run) == bits("run")
    assert (run / "config.yaml").read_bytes() == Path("run/config.yaml").read_bytes()


def test_one_table_and_one_page(swept: Path) -> None:
    heads, *rows = (swept / "out").read_text().splitlines()[1:]
    assert heads.split()[:5] == ["mutation_rate", "population", "runs", "trials", "episodes"]
    assert [row.split()[:5] for row in rows] == [
        [rate, size, "2/2", "4", str(2 * int(size))] for rate in ("0.01", "0.5") for size in ("4", "6")
    ]
    page = (swept / "s" / "sweep.html").read_text()
    assert page.count("<svg") == 3
    assert "<script" not in page


def test_medians_are_those_of_the_runs(swept: Path, swarmevo_: Swarmevo) -> None:
    """Held against what ``show`` says of each run."""
    found = json.loads(swarmevo_("show", swept / "s", "--json").out)
    assert found["grid"] == {"optimiser.pde.mutation_rate": ["0.01", "0.5"], "evolution.population": ["4", "6"]}
    assert [row["name"] for row in found["rows"]] == FOLDERS
    for row in found["rows"]:
        for seed, run in zip((1, 3), row["runs"], strict=True):
            shown = json.loads(swarmevo_("show", swept / "s" / row["name"] / f"seed-{seed}", "--json").out)
            volume = 1.0
            for objective in shown["objectives"]:
                volume *= objective["range"][1] - objective["range"][0]
            steps = [trial["history"][-1] for trial in shown["trials"]]
            assert [one["hypervolume"] for one in run["trials"]] == [
                pytest.approx(step["hypervolume"] / volume) for step in steps
            ]
            assert [one["best"] for one in run["trials"]] == [step["best"] for step in steps]


def test_the_same_command_again_runs_nothing_and_says_the_same(
    swept: Path, swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = {file: file.stat().st_mtime_ns for file in swept.glob("s/*/*/*")}
    monkeypatch.chdir(swept)
    again = swarmevo_("sweep", "small.yaml", *GRID, "--out", "s", "--workers", 1)
    assert (again.code, again.out) == (0, (swept / "out").read_text())
    assert {file: file.stat().st_mtime_ns for file in swept.glob("s/*/*/*")} == before


def test_settings_are_compared_each_with_all_its_seeds(swept: Path, swarmevo_: Swarmevo) -> None:
    one, other, *more = (swept / "s" / name for name in FOLDERS)
    runs = {name: [swept / "s" / name / f"seed-{seed}" for seed in (1, 3)] for name in FOLDERS}
    assert groups([swept / "s"], []) == groups([one, other, *more], []) == runs
    assert list(groups([one, other], [more[0]]).values()) == [[*runs[one.name], *runs[other.name]], runs[more[0].name]]
    found = json.loads(swarmevo_("compare", one, other, "--repeats", 1, "--json").out)
    assert [(group["name"], len(group["trials"])) for group in found["groups"]] == [(name, 4) for name in FOLDERS[:2]]


# ---- what ends it ----------------------------------------------------------------------------------------------------


def begun(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "swarmevo", "sweep", "small.yaml", *arguments]
    return subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


LENGTH = "evolution.generations=12", "evolution.trials=1"
LONGER = ("--grid", "optimiser.pde.mutation_rate=0.01,0.5", "--seeds", "1-2", "--set", *LENGTH)


def wait_for_generations(process: subprocess.Popen[str], folder: Path, runs: str = "*/seed-*") -> None:
    """Wait until a run has stored a generation, and see that the sweep still goes on."""
    while process.poll() is None:
        for file in folder.glob(f"{runs}/run.sqlite"):
            with Store.open(file.parent) as store:
                if store.totals().generations:
                    return
        time.sleep(0.05)
    raise AssertionError(process.communicate())


def kill(sweep: subprocess.Popen[str]) -> None:
    """Kill a sweep, and wait until none of its workers is left, that would write on."""
    workers = [
        int(path.name)
        for path in Path("/proc").iterdir()
        if path.name.isdigit() and f"\nPPid:\t{sweep.pid}\n" in _status(path)
    ]
    sweep.kill()
    sweep.communicate()
    assert workers
    for worker in workers:
        while os.path.exists(f"/proc/{worker}") and "\nState:\tZ" not in _status(Path(f"/proc/{worker}")):
            time.sleep(0.05)


def test_kill_9_and_the_same_command_gives_the_same_bits(tmp_path: Path, swarmevo_: Swarmevo) -> None:
    Path("small.yaml").write_text(SMALL)
    killed = begun(tmp_path, *LONGER, "--out", "s", "--workers", "2")
    wait_for_generations(killed, tmp_path / "s")
    kill(killed)
    there = Sweep.open(Path("s"))
    assert not all(cell.folder.exists() and len(bits(cell.folder)) == 12 for cell in there.cells)
    unfinished = there.cells[-1].folder.with_name(".seed-2")  # as if it was killed while it made a folder
    unfinished.mkdir(parents=True, exist_ok=True)
    (unfinished / "config.yaml").touch()

    done = swarmevo_("sweep", "small.yaml", *LONGER, "--out", "s", "--workers", 2)
    assert done.code == 0, done.err
    assert "s: 4 of 4 runs are complete" in done.out
    for cell in there.cells[1:3]:
        rate = cell.setting.values["optimiser.pde.mutation_rate"]
        name = f"{rate}-{cell.seed}"
        chosen = *LENGTH, f"optimiser.pde.mutation_rate={rate}"
        swarmevo_("evolve", "small.yaml", "--seed", cell.seed, "--set", *chosen, "--out", name)
        assert bits(cell.folder) == bits(name)
    assert not unfinished.exists()


def _status(process: Path) -> str:
    try:
        return (process / "status").read_text()
    except OSError:
        return ""


def test_ctrl_c_ends_it_cleanly_and_resume_goes_on(tmp_path: Path, swarmevo_: Swarmevo) -> None:
    Path("small.yaml").write_text(SMALL)
    stopped = begun(tmp_path, *LONGER, "--out", "s", "--workers", "2")
    wait_for_generations(stopped, tmp_path / "s")
    stopped.send_signal(signal.SIGTERM)
    out, err = stopped.communicate()
    assert (stopped.returncode, out) == (130, "")
    *lines, last = err.splitlines()  # a run may become complete while the others stop
    assert "stopping; once more to stop at once" in lines
    assert last == "interrupted; go on with: swarmevo resume s"
    assert not list(Path("s").rglob("*.lock"))  # each was closed
    assert swarmevo_("show", "s").out.startswith("s: ")
    assert "s: 4 of 4 runs are complete" in swarmevo_("resume", "s", "--workers", 1).out


FRAGILE = """
    import os, signal
    class Fragile:
        def __init__(self, space, population, objectives, rng, fault: str = ""):
            self.genomes = rng.standard_normal((population, space.size))
            self.fault = fault if rng.bit_generator.seed_seq.entropy else ""
        def ask(self):
            if self.fault == "raise": raise RuntimeError("no more ideas")
            if self.fault == "kill": os.kill(os.getpid(), signal.SIGKILL)
            return self.genomes
        def tell(self, genomes, costs): pass
        def state(self): return {"genomes": self.genomes}
        def restore(self, state): self.genomes = state["genomes"]
"""


def test_a_run_that_fails_does_not_keep_others_from_theirs(swarmevo_: Swarmevo, distribution: Distribution) -> None:
    distribution("moods", "0.3", {"swarmevo.optimisers": {"fragile": "fragile:Fragile"}}, fragile=FRAGILE)
    grid = "--grid", "optimiser={fragile: {fault: raise}},{fragile: {fault: kill}},pde"
    done = swarmevo_("sweep", "small.yaml", *grid, "--seeds", 1, "--out", "s", "--workers", 2)
    assert done.code == 1
    assert done.errors == ["2 of 3 runs failed; go on with: swarmevo resume s"]
    told = [line for line in done.err.splitlines() if "failed: " in line]
    assert len(told) == 2
    (raised,) = [line for line in told if "no more ideas" in line]
    assert "fragile" in raised
    (gone,) = [line for line in told if "ended its process: signal SIGKILL" in line]
    assert "fragile" in gone
    assert "s: 1 of 3 runs are complete" in done.out
    assert done.out.count("failed: optimiser=fragile_fault_") == 2


def test_a_page_that_cannot_be_written_is_a_warning(
    swept: Path, swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(swept)
    Path("s/sweep.html").rename("s/before")
    Path("s/sweep.html").symlink_to("nowhere/page")
    try:
        done = swarmevo_("resume", "s", "--workers", 1)
    finally:
        Path("s/before").replace("s/sweep.html")
    assert done.code == 0
    assert done.out == (swept / "out").read_text()
    assert "warning: no page: s/sweep.html: " in done.err


def test_one_sweep_is_not_run_twice_at_once(swept: Path, swarmevo_: Swarmevo) -> None:
    with Sweep.open(swept / "s").locked():
        done = swarmevo_("resume", swept / "s")
    assert done.code == 1
    assert f"process {os.getpid()}" in done.errors[0]
    assert "is writing it" in done.errors[0]


# ---- what is added ---------------------------------------------------------------------------------------------------


def contents(folder: Path) -> dict[Path, tuple[bytes, int]]:
    """Return the bytes of a run's files, and when they were written."""
    return {file: (file.read_bytes(), file.stat().st_mtime_ns) for file in folder.iterdir()}


def test_an_extension_killed_and_gone_on_with_leaves_what_is_complete(tmp_path: Path, swarmevo_: Swarmevo) -> None:
    Path("small.yaml").write_text(SMALL)
    sizes, chosen = "evolution.population=", ("--set", *LENGTH)
    assert swarmevo_("sweep", "small.yaml", "--grid", f"{sizes}5", "--seeds", 2, *chosen, "--out", "s").code == 0
    first = Path("s/population=5/seed-2")
    before, text = contents(first), Path("s/sweep.json").read_text()
    more = "--grid", f"{sizes}4,5", "--seeds", "1,2", *chosen, "--out", "s"
    killed = begun(tmp_path, *more, "--workers", "2")
    wait_for_generations(killed, tmp_path / "s", "*/seed-1")
    kill(killed)
    assert contents(first) == before
    there = Sweep.open(Path("s"))
    assert (there.grid, there.seeds) == ({"evolution.population": ["5", "4"]}, [2, 1])
    assert json.loads(text)["settings"] == json.loads(Path("s/sweep.json").read_text())["settings"][:1]

    done = swarmevo_("sweep", "small.yaml", *more, "--workers", 2)
    assert done.code == 0, done.err
    assert "s: 4 of 4 runs are complete" in done.out
    assert contents(first) == before
    swarmevo_("evolve", "small.yaml", "--seed", 1, "--set", *LENGTH, f"{sizes}4", "--out", "alone")
    assert bits("s/population=4/seed-1") == bits("alone")


def test_names_of_added_settings_are_not_taken() -> None:
    config = configuration.load("quick")

    def settings(*labels: str) -> list[Setting]:
        names = Names()
        return [Setting(names.of(label), {"key": label}, config) for label in labels]

    there = Sweep(Path("s"), settings("a?", "a!"), [1])
    found, seeds = extended(there, settings("a!", "b", "a+?", "a*", "a?"), [3, 1])
    assert seeds == [1, 3]
    assert [(one.name, one.values["key"]) for one in found] == [
        ("a", "a?"), ("a-2", "a!"), ("b", "b"), ("a+", "a+?"), ("a-2-2", "a*"),
    ]  # fmt: skip


def test_a_sweep_that_another_process_extended_meanwhile_is_not_overwritten(swept: Path, tmp_path: Path) -> None:
    folder = tmp_path / "s"
    shutil.copytree(swept / "s", folder)
    seen = Sweep.open(folder)
    Sweep(folder, seen.settings, [1, 3, 7]).create(seen)
    text = (folder / "sweep.json").read_text()
    with pytest.raises(StoreError, match="s: somebody else has just made or extended it; give the command again"):
        Sweep(folder, seen.settings, [1, 3, 8]).create(seen)
    assert (folder / "sweep.json").read_text() == text


# ---- what is refused -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--grid", "box.mas=1,2"], "box.mas: unknown key; did you mean box.mass?"),
        (["--grid", "box.mass=1,1"], "--grid box.mass=1,1: 1 is given twice; leave one out"),
        (["--grid", "box.mass"], "--grid box.mass: expected KEY=VALUE,VALUE,..., the values in YAML"),
        (["--grid", "evolution.seed=1,2"], "--grid evolution.seed=1,2: expected seeds in --seeds, as 1-10"),
        (["--seeds", "0x1"], "--seeds: expected seeds as in 1-10 or 1,4,9, got '0x1'"),
        (["--workers", "0"], "--workers: expected auto or a whole number from 1 to 9999, got '0'"),
        (["--out", "small.yaml"], "--out small.yaml: exists already and is no sweep; choose another name"),
        (["--out", "."], "--out .: exists already and is no sweep; choose another name"),
    ],
)
def test_what_is_wrong_is_one_line_and_nothing_is_written(
    swarmevo_: Swarmevo, arguments: list[str], message: str
) -> None:
    done = swarmevo_("sweep", "small.yaml", *arguments)
    assert (done.code, done.out, done.errors) == (2, "", [message])
    assert files() == {"small.yaml"}


def test_a_setting_that_fails_its_rehearsal_is_named(swarmevo_: Swarmevo) -> None:
    grid = "--grid", "fitness.hidden_neurons.maximum=1,10"
    done = swarmevo_("sweep", "small.yaml", *grid, "--out", "s")
    assert done.code == 2
    assert len(done.errors) == 1
    assert done.errors[0].startswith("maximum=1: ")
    assert files() == {"small.yaml"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (GRID[:2], "another grid: optimiser.pde.mutation_rate=0.01,0.5 evolution.population=4,6, not "),
        (
            ["--grid", "optimiser.pde.mutation_rate=0.02,0.5", *GRID[2:]],
            "another grid: optimiser.pde.mutation_rate=0.01,0.5 evolution.population=4,6, not "
            "optimiser.pde.mutation_rate=0.02,0.5 evolution.population=4,6",
        ),
        (["--grid", *GRID[2:0:-1], *GRID[3:]], "another grid: optimiser.pde.mutation_rate=0.01,0.5 evolution"),
        ([*GRID[:3], "--seeds", "1,2"], "other seeds: 1,3, not 1,2"),
        ([*GRID[:3], "--seeds", "1-3", "--set", "box.mass=0.2"], "another configuration, which differs in box.mass"),
        ([*GRID, "--set", "box.mass=0.2"], "another configuration, which differs in box.mass"),
    ],
)  # fmt: skip
def test_another_sweeps_folder_is_refused(swept: Path, swarmevo_: Swarmevo, arguments: list[str], message: str) -> None:
    before = (swept / "s" / "sweep.json").read_bytes()
    done = swarmevo_("sweep", "small.yaml", *arguments, "--out", swept / "s")
    assert done.code == 2
    (line,) = done.errors
    assert line.startswith(f"{swept / 's'}: exists already, with {message}")
    assert line.endswith("; give all that it has, and what is to be added, or choose another name")
    assert (swept / "s" / "sweep.json").read_bytes() == before


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"format": 2}', "\0"])
def test_a_damaged_sweep_is_one_line(swarmevo_: Swarmevo, text: str) -> None:
    Path("s").mkdir()
    Path("s/sweep.json").write_text(text)
    for verb in ("show", "resume", "compare"):
        done = swarmevo_(verb, "s")
        assert done.code == 1
        assert done.errors == [
            "s/sweep.json: expected what swarmevo sweep of this version wrote, got something else; restore a copy"
        ]


def test_a_sweep_leads_nowhere_else(swept: Path, swarmevo_: Swarmevo) -> None:
    Path("s").mkdir()
    whole = (swept / "s" / "sweep.json").read_text()
    Path("s/sweep.json").write_text(whole.replace(f'"{FOLDERS[0]}"', '"../../elsewhere"', 1))
    assert swarmevo_("resume", "s").code == 1
    assert files() == {"small.yaml", "s", "s/sweep.json"}


def test_another_run_in_the_place_of_one_is_refused(swept: Path, swarmevo_: Swarmevo) -> None:
    shutil.copytree(swept / "s", "s")
    shutil.rmtree(f"s/{FOLDERS[0]}/seed-1")
    Path(f"s/{FOLDERS[0]}/seed-3").rename(f"s/{FOLDERS[0]}/seed-1")
    done = swarmevo_("resume", "s", "--workers", 1)
    assert done.code == 1
    assert f"failed: {FOLDERS[0]}, seed 1: s/{FOLDERS[0]}/seed-1: expected the run of the sweep's setting" in done.out
    assert done.out.startswith("s: 7 of 8 runs are complete")


def test_dry_run_forecasts_and_writes_nothing(swarmevo_: Swarmevo) -> None:
    done = swarmevo_("sweep", "small.yaml", *GRID, "--dry-run", "--workers", 1)
    assert done.code == 0, done.err
    assert "8 runs, 160 episodes, 0:02:40 simulated\n" in done.out
    assert done.out.endswith("nothing was written\n")
    assert files() == {"small.yaml"}


def test_threads_are_as_many_as_the_share(swept: Path) -> None:
    """While it changes, too; the bits are the same."""
    with boards.new(1) as board:
        board.share = 2
        backend = cells.SharedThreads(configuration.load("quick").model_dump_json(), board)
        assert backend.slots == 2
        board.share = 3
        assert list(backend.run([], lambda: False)) == []
        assert backend._threads.slots == backend.slots == 3
        backend.close()

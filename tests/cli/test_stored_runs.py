# SPDX-License-Identifier: BSD-3-Clause
"""What commands say of a run that is lost, damaged, changed or of another plugin: one line, never another number."""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

import seals
from cli.conftest import Outcome, Swarmevo
from swarmevo.runs.database import DATABASE_FILE
from swarmevo.runs.store import Store

READING = {
    "show": ("show", "run"),
    "csv": ("export", "run", "--csv"),
    "json": ("export", "run", "--json"),
    "controller": ("export", "run", "--controller", 2),
    "replay": ("replay", "run:2"),
    "report": ("report", "run"),
    "test": ("test", "run", "--workers", 1),
    "verify": ("verify", "run", "--workers", 1),
    "resume": ("resume", "run", "--workers", 1),
}


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("finished")


@pytest.fixture
def run(swarmevo_: Swarmevo, finished: Path) -> Path:
    """A finished run, in the folder ``run``."""
    if not (finished / "run").exists():
        assert swarmevo_("evolve", "small.yaml", "--seed", 1, "--out", finished / "run").code == 0
    return Path(shutil.copytree(finished / "run", "run"))


def only_line(said: Outcome) -> str:
    assert said.code in (1, 2)
    (line,) = said.errors
    return line


# ---- lost while it is written ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("lose", "told"),
    [
        (lambda: shutil.rmtree("run"), "was deleted, moved or replaced"),
        (lambda: Path("run", DATABASE_FILE).unlink(), "was deleted, moved or replaced"),
        (lambda: Path("run").rename("elsewhere"), "was deleted, moved or replaced"),
        (lambda: os.truncate(Path("run", DATABASE_FILE), 0), "was truncated"),
        (lambda: os.truncate(Path("run", DATABASE_FILE), 50_000), "was truncated"),
    ],
)
def test_a_run_that_is_lost_while_it_evolves_ends_with_one_line(
    swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch, lose: Callable[[], None], told: str
) -> None:
    """Cases 2 and 73: it went on to the end, with exit code 0, and nothing remained."""
    append = Store.append

    def append_and_lose(store: Store, *arguments: Any) -> None:
        append(store, *arguments)
        lose()

    monkeypatch.setattr(Store, "append", append_and_lose)
    said = swarmevo_("evolve", "small.yaml", "--seed", 1, "--out", "run", "--workers", 1)
    assert said.code == 1
    assert only_line(said).startswith(f"run: {DATABASE_FILE} {told} while the run was writing it")
    assert "go on with" not in said.err
    assert not said.out


def test_a_run_that_was_moved_goes_on_at_its_new_place(swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 73."""
    append = Store.append

    def append_and_move(store: Store, *arguments: Any) -> None:
        append(store, *arguments)
        Path("run").rename("elsewhere")

    with monkeypatch.context() as patched:
        patched.setattr(Store, "append", append_and_move)
        assert swarmevo_("evolve", "small.yaml", "--seed", 1, "--out", "run").code == 1
    assert swarmevo_("resume", "elsewhere").code == 0
    assert swarmevo_("evolve", "small.yaml", "--seed", 1, "--out", "other").code == 0
    csv = [swarmevo_("export", folder, "--csv").out for folder in ("elsewhere", "other")]
    assert csv[0] == csv[1]


# ---- damaged or changed ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", READING)
def test_a_configuration_that_was_edited_is_refused_by_every_command(
    swarmevo_: Swarmevo, run: Path, command: str
) -> None:
    """Case 54: the edited world was used without a word, and stored as the run's Table II."""
    config = run / "config.yaml"
    config.write_text(config.read_text().replace("horizon: 1.0", "horizon: 2.0"))
    before = {path.name for path in run.iterdir()}
    assert "config.yaml: was changed since the run began; undo that" in only_line(swarmevo_(*READING[command]))
    assert {path.name for path in run.iterdir()} == before


@pytest.mark.parametrize("command", ["controller", "replay", "report", "test", "json"])
def test_a_genome_that_was_changed_is_refused_by_every_command_that_reads_it(
    swarmevo_: Swarmevo, run: Path, command: str
) -> None:
    """Case 4: nan was written into C."""
    with closing(sqlite3.connect(run / DATABASE_FILE)) as database:
        database.execute("UPDATE genome SET genes = zeroblob(length(genes))")
        database.commit()
    assert "is damaged: genome " in only_line(swarmevo_(*READING[command]))


@pytest.mark.parametrize("command", READING)
def test_a_genome_of_another_size_is_one_line(swarmevo_: Swarmevo, run: Path, command: str) -> None:
    """Case 25: its checksum is right, but the plugin takes others."""
    seals.change(run, "UPDATE genome SET genes = substr(genes, 9)")
    said = swarmevo_(*READING[command])
    if command in ("show", "csv", "json", "resume"):  # which simulate nothing
        assert said.code == 0
        return
    line = only_line(said)
    assert "controller.feedforward (swarmevo" in line
    assert "genomes: expected the shape (n, 257), got (" in line
    assert line.endswith("evolved with, and take the robot.sensors of then")


@pytest.mark.parametrize("number", [99999999999999999999, 2**63 - 1])
def test_an_individual_that_cannot_be_is_just_not_there(swarmevo_: Swarmevo, run: Path, number: int) -> None:
    """Case 66: it was called damage."""
    asked = {
        f"there is no genome {number}": ("export", run, "--controller", number),
        f"there is no individual {number}": ("replay", f"{run}:{number}"),
        f"was not evaluated in generation {number}, but in": ("replay", run, "--generation", number),
        "expected a repeat from 0 to 0": ("replay", run, "--repeat", number),
    }
    for told, command in asked.items():
        line = only_line(swarmevo_(*command))
        assert told in line
        assert "damaged" not in line


# ---- the controller that comes with swarmevo -------------------------------------------------------------------------


def test_the_shipped_controller_is_replayed_without_a_run(swarmevo_: Swarmevo) -> None:
    done = swarmevo_("replay", "--best", "--robots", "3-4", "--set", "episode.horizon=2")
    assert (done.code, done.out, done.err) == (0, "replay-best.html\n", "")
    assert "the controller that comes with swarmevo" in Path("replay-best.html").read_text()


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (["replay"], "replay: expected RUN or --best, got neither"),
        (["replay", "run", "--best"], "replay: expected RUN or --best, got both"),
        (["replay", "--best", "--live"], "--live: has no effect with --best; leave it out"),
        (["replay", "--best", "--set", "box.mass=-1"], "box.mass: expected a number from 0.001 to 1000 [kg], got -1"),
    ],
)
def test_what_the_shipped_controller_cannot_do(swarmevo_: Swarmevo, arguments: list[str], error: str) -> None:
    done = swarmevo_(*arguments)
    assert (done.code, done.errors) == (2, [error])

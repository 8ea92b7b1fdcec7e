# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import json
import re
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

import toy_plugins
from conftest import Distribution, installer
from seals import change
from swarmevo import cli
from swarmevo.errors import Interrupted, StoreError
from swarmevo.runs.database import DATABASE_FILE
from swarmevo.runs.driver import begin, evolve
from swarmevo.runs.folder import CONFIG_FILE, PROVENANCE_FILE
from swarmevo.runs.store import Store
from swarmevo.runs.verification import Difference, Report, verify

EVALUATIONS = 2 * (4 + 5 + 6)


@pytest.fixture(scope="module", params=["toy_network", "toy_linear"])
def finished(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Path:
    """A finished run of a native controller, and of one in Python."""
    folder = tmp_path_factory.mktemp("finished")
    with pytest.MonkeyPatch.context() as monkeypatch:
        toy_plugins.install(installer(folder, monkeypatch))
        begin(folder / "run", toy_plugins.config(controller=request.param))
        with Store.open(folder / "run", readonly=False) as store:
            evolve(store, 1, lambda progress: None)
    return folder / "run"


@pytest.fixture
def folder(tmp_path: Path, distribution: Distribution, finished: Path) -> Path:
    """A copy of it, to be changed."""
    toy_plugins.install(distribution)
    return shutil.copytree(finished, tmp_path / "run")


def verified(folder: Path, sample: int | None = None, **options: Any) -> Report:
    with Store.open(folder) as store:
        return verify(store, 2, sample, **options)


def test_a_run_comes_out_as_it_is_stored(folder: Path) -> None:
    seen: list[tuple[int, int]] = []
    report = verified(folder, observe=lambda done, total: seen.append((done, total)))
    assert report == Report(EVALUATIONS, EVALUATIONS, 2 * EVALUATIONS, (), (), ())
    assert report.is_sound
    assert seen == [(done, EVALUATIONS) for done in (4, 9, 15, 19, 24, 30)]


@pytest.mark.parametrize("sample", [1, 7, 1000])
def test_a_sample_is_of_its_size(folder: Path, sample: int) -> None:
    report = verified(folder, sample)
    assert report.is_sound
    assert report.checked == min(sample, EVALUATIONS)
    assert report.episodes == 2 * report.checked


@pytest.mark.parametrize("left_out", [0, 1])
def test_a_sample_is_what_is_simulated(folder: Path, left_out: int) -> None:
    change(folder, "UPDATE episode SET hash = hash + 1")
    report = verified(folder, EVALUATIONS - left_out)
    assert len(report.differences) == report.episodes == 2 * (EVALUATIONS - left_out)


WHERE = "WHERE trial = 1 AND generation = 2 AND individual = 3 AND repeat = 1"


@pytest.mark.parametrize(
    ("change_to", "what"),
    [
        ("hash = hash + 1", ("trajectory",)),
        ("objective_1 = objective_1 * 1.0000000000000002", ("distance",)),
        ("push_time = 0.5", ("push_time",)),
        ("homing_time_1 = 17.0", ("homing_time",)),
        ("fault = 'it fell over', hash = 0", ("trajectory", "fault")),
    ],
)
def test_what_was_changed_is_found(folder: Path, change_to: str, what: tuple[str, ...]) -> None:
    change(folder, f"UPDATE episode SET {change_to} {WHERE}")
    report = verified(folder)
    assert [(d.trial, d.generation, d.individual, d.repeat, d.session, d.what) for d in report.differences] == [
        (1, 2, 3, 1, 1, what)
    ]
    assert report.explanations == (
        "session 1: versions, plugins, library and CPU are the same; a plugin is not deterministic, or the database "
        "was changed",
    )
    assert not report.is_sound


def test_a_difference_knows_its_session(folder: Path) -> None:
    change(folder, "INSERT INTO session SELECT 2, provenance, sha256 FROM session")
    change(folder, f"UPDATE episode SET hash = 1, session = 2 {WHERE}")
    report = verified(folder)
    assert [difference.session for difference in report.differences] == [2]
    assert [line.partition(":")[0] for line in report.explanations] == ["session 2"]


def test_plugins_that_measure_something_else_are_refused(folder: Path) -> None:
    change(folder, "UPDATE objective SET high = high + 1 WHERE number = 0")
    with pytest.raises(StoreError, match="install the versions of the plugins that the run began with"):
        verified(folder)


def test_a_changed_genome_is_found(folder: Path) -> None:
    with Store.open(folder) as store:
        genome = int(store.genome_ids(0, 1)[2])
        genes = store.genome(genome)
    genes[:] = 1.0
    change(folder, "UPDATE genome SET genes = ? WHERE id = ?", genes.tobytes(), genome)
    assert {difference.genome for difference in verified(folder).differences} == {genome}


def damage(folder: Path, statement: str) -> None:
    """Change the database as a disk would."""
    with closing(sqlite3.connect(folder / DATABASE_FILE)) as database:
        assert database.execute(statement).rowcount
        database.commit()


@pytest.mark.parametrize(
    ("statement", "what"),
    [
        ("UPDATE genome SET genes = zeroblob(length(genes)) WHERE id = 2", "genome 2"),
        (f"UPDATE episode SET objective_0 = objective_0 * 1.0000000000000002 {WHERE}", "generation 2 of trial 1"),
        (f"UPDATE episode SET fault = 'it fell over' {WHERE}", "generation 2 of trial 1"),
        (f"DELETE FROM episode {WHERE}", "generation 2 of trial 1"),
        ("UPDATE individual SET genome = 1 WHERE (trial, generation, number) = (0, 1, 2)", "generation 1 of trial 0"),
        ("UPDATE generation SET seconds = seconds + 1 WHERE (trial, number) = (0, 2)", "generation 2 of trial 0"),
        ("DELETE FROM generation WHERE (trial, number) = (0, 2)", "generation 2 of trial 0"),
        ("UPDATE optimiser SET state = replace(state, '1', '2') WHERE trial = 0", "the optimiser's state of trial 0"),
        ("DELETE FROM optimiser WHERE trial = 1", "the optimiser's state of trial 1"),
        ("UPDATE session SET provenance = replace(provenance, '1', '2')", "the provenance of session 1"),
    ],
)
def test_damage_is_found_and_named(folder: Path, statement: str, what: str) -> None:
    """Cases 3 and 4: what is stored has checksums, and ``verify`` checks them all."""
    damage(folder, statement)
    report = verified(folder)
    assert what in report.damage
    assert not report.is_sound
    assert report.episodes == 0


def test_a_changed_provenance_file_is_found(folder: Path) -> None:
    """Case 54."""
    file = folder / PROVENANCE_FILE
    file.write_text(file.read_text().replace('"numpy": "', '"numpy": "9'))
    assert verified(folder).damage == (PROVENANCE_FILE,)
    file.unlink()
    assert verified(folder).damage == (PROVENANCE_FILE,)


def test_the_command_names_all_damage_and_exits_with_1(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    damage(folder, "UPDATE episode SET push_time = 0.5 WHERE generation = 1")
    damage(folder, "UPDATE optimiser SET state = '{}'")
    with pytest.raises(SystemExit) as exit:
        cli.main(["verify", str(folder)])
    assert exit.value.code == 1
    damaged = ["generation 1 of trial 0", "generation 1 of trial 1"]
    damaged += [f"the optimiser's state of trial {trial}" for trial in range(2)]
    assert capsys.readouterr().out.splitlines() == [
        *(f"damaged: {what} is not as it was stored" for what in damaged),
        "nothing was simulated anew; restore the run from a copy first",
    ]


def test_what_has_changed_since_explains_differences(folder: Path) -> None:
    origin = json.loads((folder / "provenance.json").read_text())
    origin["cpu"], origin["numpy"], origin["created"] = "Another CPU", "0.9", "long ago"
    origin["library"] |= {"build": "swarmevo 0.0.1", "path": "elsewhere"}  # where it lies changes no result
    (folder / PROVENANCE_FILE).write_text(json.dumps(origin))
    change(folder, "UPDATE session SET provenance = ?", json.dumps(origin))
    assert verified(folder).explanations == ()  # nothing differs, nothing is to be explained
    change(folder, f"UPDATE episode SET hash = 1 {WHERE}")
    lines = verified(folder).explanations
    assert [line.partition(", is ")[0] for line in lines] == [
        "session 1: library build was swarmevo 0.0.1",
        "session 1: numpy was 0.9",
        "session 1: cpu was Another CPU",
    ]


def test_a_changed_plugin_explains_differences_before_anything_else(folder: Path) -> None:
    """Case 52: episodes ran on a cluster's workers, which are no cause while their CPUs are those of this machine."""
    origin = json.loads((folder / "provenance.json").read_text())
    origin["worker_cpus"], origin["numpy"] = [origin["cpu"]], "0.9"
    for plugin in ("controller.toy_network", "controller.toy_linear", "fitness.toy_travel"):
        origin["plugin_files"] |= {plugin: {"toy_plugins.py": "other"}}
    (folder / PROVENANCE_FILE).write_text(json.dumps(origin))
    change(folder, "UPDATE session SET provenance = ?", json.dumps(origin))
    change(folder, f"UPDATE episode SET hash = 1 {WHERE}")
    first, second = verified(folder).explanations
    assert re.match(r"session 1: toy_plugins\.py of controller\.toy_\w+, fitness\.toy_travel was changed", first)
    assert second.startswith("session 1: numpy was 0.9")
    origin["worker_cpus"] = ["Another CPU", "Yet another CPU"]
    (folder / PROVENANCE_FILE).write_text(json.dumps(origin))
    change(folder, "UPDATE session SET provenance = ?", json.dumps(origin))
    assert verified(folder).explanations[-1].startswith("session 1: cpu was Another CPU, Yet another CPU, is ")


def test_a_run_with_another_configuration_is_not_verified(folder: Path) -> None:
    with (folder / CONFIG_FILE).open("a") as file:
        file.write("# a remark\n")
    with pytest.raises(StoreError, match=r"config\.yaml: was changed since the run began"):
        verified(folder)


def test_verifying_can_be_stopped(folder: Path) -> None:
    with pytest.raises(Interrupted):
        verified(folder, stop=lambda: True)


def test_the_command_says_what_differs_and_exits_with_1(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def run(*options: str) -> tuple[Any, str]:
        with pytest.raises(SystemExit) as exit:
            cli.main(["verify", str(folder), "--workers", "1", *options])
        return exit.value.code, capsys.readouterr().out

    code, said = run("--sample", "3")
    assert not code
    assert said == "3 of 30 evaluations simulated anew, 6 episodes\nthe same, bit by bit\n"
    change(folder, f"UPDATE episode SET hash = 1 {WHERE}")
    code, said = run()
    assert code == 1
    assert "differs: trial 1, generation 2, individual 3, repeat 1, genome " in said
    assert "the database was changed" in said
    assert said.endswith("1 episodes differ\n")
    code, said = run("--json")
    assert code == 1
    found = json.loads(said)
    assert found["sound"] is False
    assert Difference(**found["differences"][0] | {"what": ("trajectory",)}) in verified(folder).differences

# SPDX-License-Identifier: BSD-3-Clause
"""Stored controllers in another world: what may be changed, what is said about it, and that the run stays as it is."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest

import small_runs
from swarmevo import cli, config
from swarmevo.analysis import assessment
from swarmevo.errors import ConfigError
from swarmevo.runs import other_world
from swarmevo.runs.store import Store
from swarmevo.runs.tests_file import TESTS_FILE
from swarmevo.views.replay import episode as replay_episode
from swarmevo.views.replay import server as replay_server

ARTICULATED = ["physics.drive=articulated", "physics.time_step=0.004"]
CHANGES = ["physics.time_step 0.004 (evolved with 0.05)", "physics.drive articulated (evolved with driven_contacts)"]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_runs.make(tmp_path_factory.mktemp("runs") / "run", "evolution.trials=1")


def digests(folder: Path) -> dict[str, str]:
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.iterdir()}


def swarmevo(*arguments: object) -> int:
    with pytest.raises(SystemExit) as exit:
        cli.main([str(argument) for argument in arguments])
    return int(exit.value.code or 0)


# ---- which world -----------------------------------------------------------------------------------------------------


def test_nothing_changed_is_the_runs_world(run: Path) -> None:
    with Store.open(run) as store:
        same = other_world.load(store, [])
        assert same == config.load(store.config_path)
        assert other_world.changes(store.config, same) == []
        assert other_world.changes(store.config, other_world.load(store, ["physics.drive=driven_contacts"])) == []


def test_what_is_changed_is_told(run: Path) -> None:
    with Store.open(run) as store:
        other = other_world.load(store, [*ARTICULATED, "noise.rf=0.1"])
        assert (other.physics.drive, other.physics.time_step, other.noise.rf) == ("articulated", 0.004, 0.1)
        assert other_world.changes(store.config, other) == ["noise.rf 0.1 (evolved with 0.0)", *CHANGES]


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("optimiser.pde.mutation_rate=0.1", "expected a key of the world (arena, box, "),
        ("fitness=box_pushing", "all else is as it was evolved"),
        ("controller.feedforward.hidden=3", "expected a key of the world"),
        ("evolution.seed=3", "expected a key of the world"),
        ("physics={drive: articulated}", "expected a key of the world"),
        ("drive", "expected a key of the world"),
        ("team.robots=2", "choose the team's size with --robots"),
        ("team.genomes=individual", "the stored genomes are of the run's kind of team"),
        ("physics.drve=articulated", "physics.drve: unknown key; did you mean physics.drive?"),
        ("physics.time_step=0.03", "episode.control_period"),  # the library's own check
    ],
)
def test_what_is_no_other_world_is_refused(run: Path, override: str, message: str) -> None:
    with Store.open(run) as store, pytest.raises(ConfigError) as raised:
        other_world.load(store, [override])
    (line,) = raised.value.errors
    assert message in line


def test_every_section_of_the_world_may_be_changed() -> None:
    assert set(config.Config.model_fields) - set(config.WORLD) == {
        *("worlds", "vary", "controller", "fitness", "optimiser", "evolution"),
    }
    for key in other_world.FIXED:
        section, name = key.split(".")
        assert hasattr(getattr(config.Config(), section), name)


# ---- tests in it -----------------------------------------------------------------------------------------------------


def test_tests_in_another_world_say_so(run: Path) -> None:
    with Store.open(run) as store:
        usual = assessment.assess(store, (3,), 2, workers=1)
        other = assessment.assess(store, (3,), 2, True, workers=1, overrides=["episode.horizon=1", "arena.size=1.2"])
    assert (usual.changes, usual.horizon) == ([], 2)
    assert other.changes == ["arena.size 1.2 (evolved with 1.0)", "episode.horizon 1.0 (evolved with 2.0)"]
    assert other.horizon == 1
    assert other.robustness[0].name == "as set"
    assert [one.evolved for one in other.controllers] == [one.evolved for one in usual.controllers]


def test_the_command_leaves_the_run_as_it_is(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its tests are stored beside it, under their world."""
    (run / TESTS_FILE).unlink(missing_ok=True)
    before = digests(run)
    options = [word for setting in ARTICULATED for word in ("--set", setting)]
    assert swarmevo("test", run, "--robots", 3, "--repeats", 1, "--workers", 1, *options) == 0
    said = capsys.readouterr()
    assert f"In another world than that of evolution: {', '.join(CHANGES)}" in said.out
    assert said.err == f"stored in {run / TESTS_FILE}\n"
    assert swarmevo("test", run, "--robots", 3, "--repeats", 1, "--workers", 1, "--json", "--set", *ARTICULATED) == 0
    assert json.loads(capsys.readouterr().out)["changes"] == CHANGES
    (run / TESTS_FILE).unlink()
    assert digests(run) == before


def test_the_command_refuses_in_one_line(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("test", "replay"):
        assert swarmevo(command, run, "--set", "optimiser.pde.mutation_rate=0.1") == 2
        said = capsys.readouterr()
        assert said.err.startswith("error: --set optimiser.pde.mutation_rate=0.1: expected a key of the world")
        assert (said.out, said.err.count("\n")) == ("", 1)


# ---- replays in it ---------------------------------------------------------------------------------------------------


def test_a_replay_in_another_world_is_not_held_against_the_stored_one(run: Path) -> None:
    with Store.open(run) as store:
        chosen = replay_episode.choose(store)
        shown, warning = replay_episode.episodes(store, chosen, [3, 2], overrides=ARTICULATED)
    assert warning == f"another world than the stored episode's: {', '.join(CHANGES)}; its trajectory is not compared"
    assert [one["warning"] for one in shown] == [warning, warning]
    assert [one["robots"] for one in shown] == [3, 2]


def test_its_page_has_a_name_of_its_own(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = digests(run)
    assert swarmevo("replay", run, "--set", "physics.drive=articulated", "physics.time_step=0.004") == 0
    said = capsys.readouterr()
    assert said.err.startswith("warning: another world than the stored episode's: physics.time_step 0.004")
    page = Path(said.out.strip())
    assert page.name.endswith("-other-world.html")
    page.unlink()
    assert digests(run) == before


def test_live_episodes_are_in_it_too(run: Path) -> None:
    name, head = next(iter(replay_server.live_episodes(run, None, ["arena.size=1.2"])(0)))
    assert (name, head["arena"]["bounds"]) == ("head", (-0.6, 0.6, -0.6, 0.6))
    assert "arena.size 1.2 (evolved with 1.0)" in head["subtitle"]

# SPDX-License-Identifier: BSD-3-Clause
"""What is exported is what is stored; a controller in C says what the library says."""

from __future__ import annotations

import csv
import io
import json
import math
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import seals
import toy_plugins
from conftest import installer
from swarmevo import cli, plugins, simulation
from swarmevo import config as configuration
from swarmevo.config import Config
from swarmevo.errors import ConfigError, ExportError, StoreError
from swarmevo.plugins.team import Team
from swarmevo.protocols import FloatArray, NativePolicies, Objective, SceneInfo
from swarmevo.runs import export, made_for, other_world
from swarmevo.runs.driver import begin, evolve
from swarmevo.runs.store import Store
from swarmevo.simulation._ffi import load
from swarmevo.simulation.policies import native_policies

DOCS = Path(__file__).parents[2] / "docs"
INPUTS = 300
SCENE = SceneInfo(robots=2, control_steps=10, control_period=0.1)


@pytest.fixture(autouse=True)
def _toys(distribution: Callable[..., Any]) -> None:
    toy_plugins.install(distribution)


def run(folder: Path, config: Config) -> Path:
    begin(folder, config)
    with Store.open(folder, readonly=False) as store:
        evolve(store, 1, lambda progress: None)
    return folder


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("finished")
    with pytest.MonkeyPatch.context() as monkeypatch:
        toy_plugins.install(installer(folder, monkeypatch))
        return run(folder / "run", toy_plugins.config())


@pytest.fixture
def folder(tmp_path: Path, finished: Path) -> Path:
    return shutil.copytree(finished, tmp_path / "run")


# ---- episodes --------------------------------------------------------------------------------------------------------


def test_csv_has_every_episode_with_all_bits(folder: Path) -> None:
    out = io.StringIO()
    with Store.open(folder) as store:
        export.write_csv(store, out)
        rows = list(csv.DictReader(io.StringIO(out.getvalue())))
        assert list(rows[0]) == list(export.columns(store))
        assert len(rows) == store.totals().episodes
        for row in rows:
            stored = store.generation(int(row["trial"]), int(row["generation"]))
            at = int(row["individual"]), int(row["repeat"])
            names = [objective.name for objective in store.objectives]
            assert [float(row[name]) for name in names] == stored.episodes.grid("objective")[at].tolist()
            assert int(row["hash"], 16) == stored.episodes.grid("hash")[at]
            assert np.array_equal(
                float(row["push_time"] or "nan"), stored.episodes.grid("push_time")[at], equal_nan=True
            )
            np.testing.assert_array_equal(store.genome(int(row["genome"])), stored.genomes[at[0]])
            assert (row["session"], row["fault"]) == ("1", "")


def test_json_has_everything(folder: Path) -> None:
    out = io.StringIO()
    with Store.open(folder) as store:
        export.write_json(store, out)
        found = json.loads(out.getvalue())
        assert Config.model_validate_json(json.dumps(found["config"])) == configuration.load(store.config_path)
        assert found["sessions"] == {"1": json.loads((folder / "provenance.json").read_text())}
        assert [tuple(row) for row in found["episodes"]] == list(export.episodes(store))
        assert all(len(row) == len(found["columns"]) for row in found["episodes"])
        genomes = dict(found["genomes"])
        assert list(genomes) == store.all_genomes()
        np.testing.assert_array_equal(genomes[3], store.genome(3))


def test_a_run_without_a_generation_exports_no_episode(tmp_path: Path) -> None:
    begin(tmp_path / "run", toy_plugins.config())
    with Store.open(tmp_path / "run") as store:
        out = io.StringIO()
        export.write_json(store, out)
        assert json.loads(out.getvalue())["episodes"] == []
        assert list(export.episodes(store)) == []


def test_every_column_is_documented(folder: Path) -> None:
    page = (DOCS / "episodes.md").read_text()
    with Store.open(folder) as store:
        objectives = {objective.name for objective in store.objectives}
        for name in export.columns(store):
            assert name in objectives or f"`{re.sub('_[0-9]+$', '_J', name)}`" in page, name


# ---- controllers -----------------------------------------------------------------------------------------------------


def native(policies: NativePolicies, observations: FloatArray, scene: SceneInfo = SCENE) -> FloatArray:
    """Return what the library's first network commands in an episode of these observations."""
    ffi, _ = load()
    made, keep_alive = native_policies(policies, scene)
    memory, commands = np.zeros(made[0].memory), np.empty((len(observations), scene.commands))
    for observation, command in zip(observations, commands, strict=True):
        made[0].function(
            made[0].parameters,
            ffi.from_buffer("double[]", observation),
            ffi.from_buffer("double[]", memory),
            ffi.from_buffer("double[]", command),
        )
    assert keep_alive
    return commands


def random_observations() -> FloatArray:
    return np.random.default_rng(5).random((INPUTS, 13))


def test_a_controller_as_json_computes_what_the_library_does(folder: Path) -> None:
    with Store.open(folder) as store:
        found = json.loads(json.dumps(export.controller(store, 4)))
        genes = store.genome(4)
    assert found["genes"] == genes.tolist()
    assert np.array(found["blocks"]["input_hidden"]).shape == (2, 14)
    assert len(found["observations"]) == 13
    (network,) = found["networks"]
    x = random_observations()
    shape = (-1, 13)
    hidden = np.tanh(x @ np.reshape(network["input_hidden"], shape).T + network["hidden_bias"])
    commands = np.tanh(hidden @ np.reshape(network["hidden_output"], (-1, 2)) + network["output_bias"])
    np.testing.assert_allclose(
        commands, native(toy_plugins.Network().policies(genes[np.newaxis]), x), rtol=0, atol=1e-13
    )


def compiled(source: str, folder: Path, *more: Path | str) -> Path:
    """Compile C99 without a warning; return the program."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("needs a C compiler")
    folder.mkdir(exist_ok=True)
    (folder / "controller.c").write_text(source)
    flags = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-O2", "-ffp-contract=off"]
    command = [compiler, *flags, *map(str, more), "controller.c", "-o", "program", "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder / "program"


def outputs(program: Path, lines: FloatArray) -> FloatArray:
    text = "\n".join(" ".join(value.hex() for value in line) for line in lines.tolist())
    done = subprocess.run([program], input=text, capture_output=True, text=True, check=True, timeout=60)
    return np.array([[float.fromhex(word) for word in line.split()] for line in done.stdout.splitlines()])


EPUCK_MAIN = r"""
#include <stdio.h>
int main(void) {
    double x[13], command[2];
    int i, n = 0, raw[8], left, right;
    while (scanf("%lf", &x[n]) == 1) {
        if (++n < 13) continue;
        n = 0;
        swarmevo_controller(x, command);
        for (i = 0; i < 8; ++i) raw[i] = (int)(x[i] * 5000);
        swarmevo_step(raw, x + 8, x[12] * 60, &left, &right);
        printf("%a %a %a %a\n", command[0], command[1], (double)left, (double)right);
    }
    return 0;
}
"""

CONTROLLERS: list[dict[str, Any]] = [
    {"feedforward": {"hidden": 15}},
    {"feedforward": {"hidden": 7, "bias": False}},
    {"feedforward": {"hidden": 3, "activation": "logistic"}},
    {"feedforward": {"hidden": 1, "bias": False, "activation": "logistic"}},
    {"linear": {}},
    {"linear": {"bias": False, "activation": "tanh"}},
    {"linear": {"activation": "logistic"}},
    {"elman": {"hidden": 15}},
    {"elman": {"hidden": 3, "bias": False, "activation": "logistic"}},
    {"jordan": {"hidden": 15}},
    {"jordan": {"hidden": 3, "bias": False, "activation": "logistic"}},
    {"ctrnn": {"hidden": 15}},
    {"ctrnn": {"hidden": 3, "bias": False, "activation": "tanh", "integration": "euler"}},
]


def network_run(folder: Path, controller: dict[str, Any], **sections: Any) -> Path:
    return run(
        folder,
        toy_plugins.config(
            controller=controller,
            fitness=["hidden_neurons"],
            evolution={"generations": 1, "trials": 1, "repeats": 1},
            **sections,
        ),
    )


def policies_of(folder: Path, genome: int) -> tuple[NativePolicies, Config]:
    settings = configuration.load(folder / "config.yaml")
    ((name, options),) = settings.controller.items()
    made = plugins.create("controller", name, options)
    size = made.space(simulation.Scene(settings).info).size
    with Store.open(folder) as store:
        return made.policies(store.genome(genome).reshape(-1, size)), settings


def commanded(policies: NativePolicies, observations: FloatArray) -> FloatArray:
    """Return what the robot does: the library clips commands."""
    return np.clip(native(policies, observations), -1, 1)


def expected_steps(policies: NativePolicies, settings: Config, x: FloatArray) -> FloatArray:
    """Return wheel speeds [steps/s] for what ``EPUCK_MAIN`` makes of ``x``."""
    observed = x.copy()
    observed[:, :8] = np.clip(np.floor(x[:, :8] * 5000) / settings.sensors.infrared_curve[0][1], 0, 1)
    least, most = settings.emitter.strength
    observed[:, 12] = np.clip(x[:, 12] * 60, least, most) / most
    speeds: FloatArray = commanded(policies, observed) * settings.robot.top_speed * 1000 / (2 * math.pi)
    return np.clip(np.round(speeds), -1000, 1000)


of_every_kind = pytest.mark.parametrize("options", CONTROLLERS, ids=str)
STEP = "swarmevo_step(raw, x + 8, x[12] * 60, &left, &right);"
COMMAND = "swarmevo_controller(x, command);"


@of_every_kind
def test_an_e_pucks_firmware_says_what_the_library_says(tmp_path: Path, options: dict[str, Any]) -> None:
    folder = network_run(tmp_path / "run", options)
    x = random_observations()
    for genome in (1, 3):
        with Store.open(folder) as store:
            source = export.source(store, genome, "epuck")
        policies, settings = policies_of(folder, genome)
        # A program for each: a network with a memory would remember the other call.
        asked = source + EPUCK_MAIN.replace(STEP, "(void)raw, left = right = 0;")
        commands = outputs(compiled(asked, tmp_path / f"asked{genome}"), x)[:, :2]
        if "feedforward" in options:
            np.testing.assert_allclose(commands, commanded(policies, x), rtol=0, atol=1e-13)
        else:  # sums in the same order: else differences would grow from step to step
            np.testing.assert_array_equal(commands, commanded(policies, x))
        driven = source + EPUCK_MAIN.replace(COMMAND, "command[0] = command[1] = 0.0;")
        steps = outputs(compiled(driven, tmp_path / f"driven{genome}"), x)[:, 2:]
        np.testing.assert_allclose(steps, expected_steps(policies, settings, x), rtol=0, atol=1.0)


@pytest.mark.parametrize("options", [{"elman": {}}, {"jordan": {}}, {"ctrnn": {}}], ids=str)
def test_a_network_in_c_forgets_when_it_is_told_to(tmp_path: Path, options: dict[str, Any]) -> None:
    folder = network_run(tmp_path / "run", options)
    with Store.open(folder) as store:
        team = Team(store.config)
        largest = max(store.all_genomes(), key=lambda id: team.complexity(store.genome(id)[np.newaxis])[0])
        source = export.source(store, largest, "epuck")
    policies, _ = policies_of(folder, largest)
    x = random_observations()[:20]
    forgetful = source + EPUCK_MAIN.replace(STEP, "swarmevo_forget(), (void)raw, left = right = 0;")
    found = outputs(compiled(forgetful, tmp_path / "c"), x)[:, :2]
    anew = np.concatenate([commanded(policies, observation[np.newaxis]) for observation in x])
    np.testing.assert_array_equal(found, anew)
    assert (anew[1:] != commanded(policies, x)[1:]).any()


@pytest.mark.parametrize("kind", ["feedforward", "elman", "jordan", "ctrnn"])
def test_a_network_without_hidden_units_is_c_too(tmp_path: Path, kind: str) -> None:
    folder = network_run(tmp_path / "run", {kind: {"hidden": 2}})
    with Store.open(folder) as store:
        genes, team = store.genome(1), Team(store.config)
    genes[team.space.is_switch] = 0.0
    seals.change(folder, "UPDATE genome SET genes = ? WHERE id = 1", genes.tobytes())
    with Store.open(folder) as store:
        (network,) = export.networks(team, genes)
        source = export.source(store, 1, "epuck") + EPUCK_MAIN
    assert "0 hidden units" in network.description
    x = random_observations()[:5]
    found = outputs(compiled(source, tmp_path / "c"), x)
    policies, _ = policies_of(folder, 1)
    np.testing.assert_allclose(found[:, :2], native(policies, x), rtol=0, atol=1e-13)


@of_every_kind
def test_a_network_as_json_has_no_unit_that_is_off(tmp_path: Path, options: dict[str, Any]) -> None:
    folder = network_run(tmp_path / "run", options)
    with Store.open(folder) as store:
        (network,) = json.loads(json.dumps(export.controller(store, 3)))["networks"]
        on = int(Team(store.config).complexity(store.genome(3)[np.newaxis])[0])
    assert len(network.get("hidden_bias", [])) == on
    assert len(network.get("rates", [])) == (on if "ctrnn" in options else 0)
    if "elman" in options or "ctrnn" in options:
        assert [len(row) for row in network["context_hidden"]] == [on] * on


@pytest.mark.parametrize("kind", ["feedforward", "elman", "jordan", "ctrnn"])
def test_a_memory_of_a_control_step_is_of_its_length(tmp_path: Path, kind: str) -> None:
    folder, slower = network_run(tmp_path / "run", {kind: {"hidden": 2}}), ["episode.control_period=0.05"]
    with Store.open(folder) as store:
        team, exported = Team(store.config), json.loads(json.dumps(export.controller(store, 1)))
        assert ("call it as often" in export.source(store, 1, "epuck")) is (kind != "feedforward")
        other = configuration.changed(store.config, slower, plugins.option_errors)
        deeds = [
            lambda: other_world.load(store, slower),
            lambda: made_for.check_run("run", store.config, other, team.space),
            lambda: made_for.check_exported("file", exported, other, team.space),
        ]
        for deed in deeds:
            if kind in ("elman", "jordan"):
                with pytest.raises(ConfigError, match=f"of 0.1 s, with which the controller {kind} was .*got 0.05 s;"):
                    deed()
            else:
                deed()


def test_a_memory_is_not_written_as_c_of_another_period(tmp_path: Path) -> None:
    world = {"episode": {"control_period": 0.0125, "horizon": 0.5}, "physics": {"time_step": 0.0125}}
    for kind in ("elman", "ctrnn", "feedforward"):
        folder = network_run(tmp_path / kind, {kind: {"hidden": 2}}, **world)
        with Store.open(folder) as store:
            if kind == "feedforward":
                assert "CONTROL_PERIOD_MS 12 " in export.source(store, 1, "epuck")
                continue
            with pytest.raises(ExportError, match=r"memory as C, got 12.5 ms, which would be 12 ms there; write"):
                export.source(store, 1, "epuck")


OBSERVED_MAIN = r"""
#include <stdio.h>
int main(void) {
    double x[SWARMEVO_OBSERVATIONS], command[SWARMEVO_COMMANDS];
    int n = 0, left, right;
    while (scanf("%lf", &x[n]) == 1) {
        if (++n < SWARMEVO_OBSERVATIONS) continue;
        n = 0;
        swarmevo_step(x, command, &left, &right);
        printf("%a %a %a %a %a\n", command[SWARMEVO_LEFT], command[SWARMEVO_RIGHT], command[SWARMEVO_MESSAGE_0],
               (double)left, (double)right);
    }
    return SWARMEVO_RANGE_AND_BEARING_0_MESSAGE_0 != 9 || SWARMEVO_GROUND_1 != 11;
}
"""
OTHER_SENSES = {
    "robot": {"sensors": ["infrared", "range_and_bearing", "ground", "odometry"]},
    "sensors": {
        "range_and_bearing_sectors": 1,
        "range_and_bearing_message": 1,
        "ground_position": [[0.03, 0.01], [0.03, -0.01]],
    },
}


@pytest.mark.parametrize("options", [{"linear": {}}, {"ctrnn": {"hidden": 5}}], ids=str)
def test_other_sensors_are_read_by_who_calls_it(tmp_path: Path, options: dict[str, Any]) -> None:
    """Then the program is given observations, at places that have names, and tells the message too."""
    folder = network_run(tmp_path / "run", options, **OTHER_SENSES)
    with Store.open(folder) as store:
        source = export.source(store, 1, "epuck")
    assert "then the bits of the message" in source
    x = np.random.default_rng(2).uniform(-1, 1, (100, 14))
    found = outputs(compiled(source + OBSERVED_MAIN, tmp_path / "c"), x)
    policies, settings = policies_of(folder, 1)
    commands = native(policies, x, configuration.scene_info(settings))
    np.testing.assert_array_equal(np.clip(found[:, :3], -1, 1), np.clip(commands, -1, 1))
    steps = np.clip(commands[:, :2], -1, 1) * settings.robot.top_speed * 1000 / (2 * math.pi)
    np.testing.assert_allclose(found[:, 3:], steps, rtol=0, atol=1.0)


def test_each_robot_has_its_controller(tmp_path: Path) -> None:
    folder = network_run(tmp_path / "run", {"feedforward": {"hidden": 3}}, team={"genomes": "individual"})
    with Store.open(folder) as store:
        sources = [export.source(store, 1, "epuck", robot) for robot in range(2)]
        assert sources[0] != sources[1]
        with pytest.raises(ExportError, match="robot: expected 0 to 1, got 2"):
            export.source(store, 1, "epuck", 2)
        found = export.controller(store, 1)
    assert len(found["networks"]) == 2
    assert "input_hidden[1]" in found["blocks"]
    assert "robot 1 of the run" in sources[1]


def test_all_robots_may_have_one_controller(tmp_path: Path) -> None:
    """Case 33: then there is no other robot to choose."""
    with Store.open(network_run(tmp_path / "run", {"feedforward": {"hidden": 3}})) as store:
        export.source(store, 1, "epuck", 0)
        with pytest.raises(ExportError, match="robot: expected 0, for all robots have the same genome, got 1"):
            export.source(store, 1, "epuck", 1)


def test_a_name_cannot_get_into_the_code(tmp_path: Path) -> None:
    folder = network_run(tmp_path / "x*\u2044 $hidden\n${title}#error", {"feedforward": {"hidden": 2}})
    with Store.open(folder) as store:
        source = export.source(store, 1, "epuck")
    assert source.index("*/") < source.index("#include")
    compiled(source + EPUCK_MAIN, tmp_path / "c")


def test_what_cannot_be_exported(tmp_path: Path) -> None:
    folder = run(tmp_path / "run", toy_plugins.config(controller="toy_linear"))
    with Store.open(folder) as store:
        with pytest.raises(ExportError, match="controller toy_linear: expected networks that the library runs"):
            export.source(store, 1, "epuck")
        assert export.controller(store, 1)["networks"] == []
        with pytest.raises(StoreError, match="there is no genome 999"):
            export.controller(store, 999)


# ---- the command -----------------------------------------------------------------------------------------------------


def test_the_command(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def call(*arguments: object) -> tuple[Any, str, str]:
        with pytest.raises(SystemExit) as exit:
            cli.main(["export", str(folder), *map(str, arguments)])
        return exit.value.code or 0, *capsys.readouterr()

    code, out, _ = call("--csv")
    assert (code, len(out.splitlines())) == (0, 61)
    assert json.loads(call("--json")[1])["format"] == 1
    assert json.loads(call("--controller", 2)[1])["genome"] == 2
    assert "wb_robot_step" in call("--controller", 2, "--as", "webots")[1]
    file = tmp_path / "controller.c"
    assert call("--controller", 2, "--as", "epuck", "--out", file) == (0, "", "")
    assert "swarmevo_step" in file.read_text()
    code, _, err = call("--csv", "--out", file)
    assert (code, err) == (1, f"error: {file}: exists already and is never overwritten; choose another name\n")
    for wrong in ([], ["--csv", "--json"], ["--controller", 1, "--as", "c++"]):
        code, _, err = call(*wrong)
        assert code == 2
        assert "expected" in err
    code, _, err = call("--controller", 999, "--out", tmp_path / "other")
    assert (code, (tmp_path / "other").exists()) == (1, False)


@pytest.mark.parametrize("name", [*export.BEFORE, "push_time", "homing_time_1", "hash", *export.AFTER])
def test_an_objective_with_the_name_of_a_column_is_refused(tmp_path: Path, name: str) -> None:
    """Cases 24 and 51: before a folder is made, whichever column it is."""
    settings = toy_plugins.config(fitness={"toy_bad_fitness": {"fault": f"named {name}"}})
    with pytest.raises(ConfigError, match=f"^objective {name}: expected another name than that of a column"):
        begin(tmp_path / "run", settings)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("text", "cell"),
    [
        ("=1+1", "'=1+1"),
        ("@SUM(A1)", "'@SUM(A1)"),
        ("-2+3", "'-2+3"),
        ("+cmd", "'+cmd"),
        ("\t=1", r"\t=1"),
        ("a\r\n=1\x1b[2J", r"a\r\n=1\x1b[2J"),
        ("plain, text", "plain, text"),
    ],
)
def test_text_in_a_csv_is_no_formula(folder: Path, monkeypatch: pytest.MonkeyPatch, text: str, cell: str) -> None:
    """Case 26: headings and faults; numbers stay numbers."""
    monkeypatch.setattr(export, "columns", lambda store: {text: ""})
    monkeypatch.setattr(export, "episodes", lambda store: iter([(-1.5, text, None)]))
    out = io.StringIO()
    with Store.open(folder) as store:
        export.write_csv(store, out)
    assert list(csv.reader(io.StringIO(out.getvalue()))) == [[cell], ["-1.5", cell, ""]]


def test_every_heading_of_a_csv_has_a_cell(folder: Path) -> None:
    """Case 51: the names that are refused come from the columns that are written."""
    with Store.open(folder) as store:
        named = export.columns(store)
        assert all(len(row) == len(named) for row in export.episodes(store))
        for name in set(named) - {objective.name for objective in store.objectives}:
            with pytest.raises(ExportError):
                export.check_names([Objective(name, "minimise", (0.0, 1.0))], store.robots)

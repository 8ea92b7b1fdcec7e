# SPDX-License-Identifier: BSD-3-Clause
"""A project for Webots: its world is one, and its controllers do what the simulator's do with the same readings.

There is no Webots here: the world is held against ``webots_world.py``, the programs run on ``mock_webots.c``, both
written from Webots' reference manual. What devices return is computed here from poses, as that manual says.
"""

from __future__ import annotations

import math
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import toy_plugins
import webots_player
import webots_world
from swarmevo import cli
from swarmevo.config import Config
from swarmevo.errors import ExportError
from swarmevo.protocols import FloatArray
from swarmevo.runs import export
from swarmevo.runs.driver import begin, evolve
from swarmevo.runs.store import Store
from swarmevo.simulation import Lockstep
from webots_world import WorldNode

TESTS = Path(__file__).parents[1]
QUIET = {"infrared": 0.0, "infrared_at_contact": 0.0, "wheels": 0.0}
GENOME = 1
PAPER: dict[str, Any] = {
    "team": {"robots": 3, "start": "random", "start_region": [-0.3, 0.3, 0.1, 0.45]},
    "controller": {"feedforward": {"hidden": 5}},
}
SWARM: dict[str, Any] = {
    "arena": {"shape": "circle", "size": 1.6},
    "scene": {
        "movables": [
            {"shape": "cylinder", "size": [0.1, 0.1, 0.03], "mass": 0.03, "pose": [0.3, 0.2, 0.0]},
            {"size": [0.2, 0.1, 0.03], "mass": 0.1, "pose": [0.0, -0.2, 0.3], "friction": 0.4},
        ],
        "obstacles": [
            {"shape": "wall", "ends": [[-0.3, 0.1], [-0.1, 0.3]]},
            {"shape": "cylinder", "size": [0.1, 0.1, 0.1], "pose": [0.5, 0, 0]},
        ],
        "emitters": [
            {"position": [0, 0.5, 0.03], "range": 0.5},
            {"channel": "prey", "position": [0.1, 0.1, 0.03], "strength": [1, 70]},
            {"channel": "light", "position": [0.2, -0.3, 0.2], "range": 0.6, "strength": [0.5, 20]},
            {"channel": "rf", "rides_on": 1, "position": [0.02, 0, 0.03], "strength": [2, 30], "reach": "arena"},
            {"channel": "light", "position": [-0.3, 0.3, 0.1], "reach": "arena"},
        ],
        "goals": [],
        "patches": [
            {"shape": "cylinder", "size": [0.4, 0.4], "pose": [0, -0.6, 0], "grey": 0.0},
            {"size": [0.3, 0.2], "pose": [0.4, 0.5, 0.4], "grey": 0.5},
        ],
    },
    "robot": {
        "sensors": [
            *("light", "infrared", "touch", "range_and_bearing", "ground", "rf", "odometry", "rf_bearing"),
        ]
    },
    "sensors": {
        "range_and_bearing_message": 2,
        "range_and_bearing_sectors": 3,
        "light_sectors": 5,
        "ground_position": [[0.03, 0.01], [0.03, -0.01]],
        "infrared_target": "all",
    },
    "team": {"robots": 4, "start": "random", "start_region": [-0.4, 0.4, -0.4, 0.4]},
    "controller": {"elman": {"hidden": 4}},
}


@pytest.fixture(autouse=True)
def _toys(distribution: Callable[..., Any]) -> None:
    toy_plugins.install(distribution)


def run(folder: Path, sections: dict[str, Any]) -> Path:
    budget = {"generations": 1, "trials": 1, "repeats": 1}
    begin(folder, toy_plugins.config(**sections, noise=QUIET, fitness=["hidden_neurons"], evolution=budget))
    with Store.open(folder, readonly=False) as store:
        evolve(store, 1, lambda progress: None)
    return folder


def project(folder: Path, sections: dict[str, Any], infrared: Any = "evolved") -> tuple[Path, Config, FloatArray]:
    """Return a project, its configuration, and the genome whose controllers it has."""
    with Store.open(run(folder / "run", sections)) as store:
        export.webots_project(store, GENOME, folder / "project", infrared)
        return folder / "project", store.config, store.genome(GENOME)


# ---- the world -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sections", [PAPER, SWARM], ids=["paper", "swarm"])
def test_the_world_is_one_and_has_what_the_scene_has(tmp_path: Path, sections: dict[str, Any]) -> None:
    folder, config, _ = project(tmp_path, sections)
    nodes = webots_world.read((folder / "worlds" / "swarmevo.wbt").read_text())
    webots_world.check(nodes, folder)
    named = {one["name"]: one for one in nodes if "name" in one.fields}
    with Lockstep(config, seed=7) as lockstep:
        state = lockstep.state()
    for i, (x, y, heading) in enumerate(state.pose[0].tolist()):
        robot = named[f"robot {i}"]
        assert robot["translation"][:2] == pytest.approx((x, y), abs=1e-9)
        assert robot["rotation"] == pytest.approx((0, 0, 1, heading), abs=1e-9)
        assert robot["controllerArgs"] == [str(i)]
        weights = [one["mass"] for one in robot.below() if one.kind == "Physics"]
        assert sum(weights) == pytest.approx(config.robot.mass)
    for i, (x, y, heading) in enumerate(state.movables[0].tolist()):
        movable = named[f"movable {i}"]
        assert movable["translation"][:2] == pytest.approx((x, y), abs=1e-9)
        assert movable["rotation"][3] == pytest.approx(heading, abs=1e-9)
    emitters = {one["name"]: one for node in nodes for one in node.below() if one.kind == "Emitter"}
    scene = config.scene
    for i, emitter in enumerate(scene.emitters or [config.emitter]):
        assert emitters[f"emitter {i}"]["range"] == (-1 if emitter.reach == "arena" else emitter.range)
    assert len({one for one in named if one.startswith("obstacle")}) == len(scene.obstacles)
    assert named["floor"]["contactMaterial"] == "floor"


def test_rays_are_where_ours_are_and_bumpers_stick_out(tmp_path: Path) -> None:
    folder, config, _ = project(tmp_path, PAPER)
    nodes = webots_world.read((folder / "worlds" / "swarmevo.wbt").read_text())
    named = {one["name"]: one for one in nodes if "name" in one.fields}
    robot, box = named["robot 0"], named["movable 0"]
    parts = {one["name"]: one for one in robot.below() if "name" in one.fields}
    middle = robot["translation"][2]
    for i, yaw_deg in enumerate(config.sensors.infrared_yaw_deg):
        yaw, (x, y, z) = math.radians(yaw_deg), parts[f"ps{i}"]["translation"]
        assert (x, y) == pytest.approx((0.035 * math.cos(yaw), 0.035 * math.sin(yaw)))
        assert parts[f"ps{i}"]["rotation"] == pytest.approx((0, 0, 1, yaw))
        assert bounds(box)[1] < z + middle < min(bounds(named["wall 0"])[1], bounds(robot)[1])
    # Movables reach down to where the bumpers are; walls and bodies do not.
    bumper = parts["ts0"]
    height = bumper["children"][0]["children"][0]["geometry"]["size"][2] / 2
    low, high = (middle + bumper["translation"][2] + sign * height for sign in (-1, 1))
    assert 0 < low < high < min(bounds(named["wall 0"])[0], bounds(robot)[0], bounds(box)[0])
    foot = next(one for one in box["children"] if one.kind == "Solid")
    assert foot["boundingObject"]["size"][:2] == config.box.size[:2]
    pieces = [one for i in range(4) for one in parts[f"ts{i}"]["boundingObject"]["children"]]
    angles = sorted(math.degrees(math.atan2(one["translation"][1], one["translation"][0])) for one in pieces)
    assert angles == pytest.approx(np.arange(-55, 60, 10))  # four sectors of 30 degrees in three pieces each


def bounds(solid: WorldNode) -> tuple[float, float]:
    """Return from and to what height the bounding object of a solid reaches that stands in the world."""
    shape = solid["boundingObject"]
    height = shape["size"][2] if shape.kind == "Box" else shape["height"]
    return solid["translation"][2] - height / 2, solid["translation"][2] + height / 2


def test_the_floor_has_the_scenes_grey(tmp_path: Path) -> None:
    folder, _, _ = project(tmp_path, SWARM)
    nodes = webots_world.read((folder / "worlds" / "swarmevo.wbt").read_text())
    (side, _) = next(one["boundingObject"]["size"] for one in nodes if one.get("name") == "floor")
    image = Image.open(folder / "worlds" / "floor.png")

    def grey(x: float, y: float) -> Any:
        pixel = image.getpixel((int((x / side + 0.5) * image.width), int((0.5 - y / side) * image.height)))
        assert isinstance(pixel, tuple)
        return pixel[0] / 255

    assert [grey(0, 0), grey(0, -0.6), grey(0.4, 0.5), grey(0, -0.38)] == pytest.approx([1, 0, 0.5, 1], abs=0.01)
    # Webots' formula for infra-red rays leads through the table to that grey.
    ground = next(one for node in nodes for one in node.below() if one.get("name") == "gs0")
    distances, values, _ = zip(*ground["lookupTable"], strict=True)
    for level in (0.0, 0.1, 0.5, 0.9, 1.0):
        assert np.interp(0.002 / (0.2 + 0.8 * level), distances, values) == pytest.approx(1000 * level, abs=2)


@pytest.mark.parametrize(
    ("old", "new"),
    [("Cylinder", "Cilinder"), ("contactMaterial", "material"), ("basicTimeStep 20", 'basicTimeStep "20"')],
)
def test_the_reader_refuses_what_webots_does_not_know(tmp_path: Path, old: str, new: str) -> None:
    folder, _, _ = project(tmp_path, PAPER)
    text = (folder / "worlds" / "swarmevo.wbt").read_text()
    with pytest.raises(ValueError, match=re.escape(new.split()[0]) + "|could not convert"):
        webots_world.read(text.replace(old, new, 1))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('name "wall 1"', 'name "wall 0"'),
        ('material1 "caster"', 'material1 "cast"'),
        ('url [\n            "floor.png"', 'url [\n            "flor.png"'),
        ('controller "swarmevo"', 'controller "swarm"'),
        ("mass 0.24", "mass -1"),
    ],
)
def test_the_check_finds_what_does_not_fit(tmp_path: Path, old: str, new: str) -> None:
    folder, _, _ = project(tmp_path, PAPER)
    text = (folder / "worlds" / "swarmevo.wbt").read_text()
    assert old in text
    with pytest.raises(AssertionError):
        webots_world.check(webots_world.read(text.replace(old, new, 1)), folder)


# ---- the controllers -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def mock(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with Webots' headers and the compiled mock."""
    return webots_player.build(tmp_path_factory.mktemp("mock"))


@pytest.mark.parametrize(
    ("sections", "infrared", "steps"),
    [
        (PAPER, "evolved", 150),
        ({**PAPER, "team": {**PAPER["team"], "genomes": "individual"}}, "2022", 60),
        (PAPER, "2013", 40),
        (SWARM, "evolved", 150),
    ],
    ids=["paper", "own genomes, 2022", "2013", "swarm"],
)
def test_the_same_readings_give_the_same_commands(
    tmp_path: Path, mock: Path, sections: dict[str, Any], infrared: str, steps: int
) -> None:
    folder, config, genome = project(tmp_path, {**sections, "episode": {"horizon": steps / 10}}, infrared)
    told = webots_player.recorded(config, genome)
    world = webots_world.read((folder / "worlds" / "swarmevo.wbt").read_text())
    programs: dict[str, Path] = {}
    for one in world:
        if one.kind != "Robot" or not one["name"].startswith("robot"):
            continue
        source = folder / "controllers" / one["controller"] / (one["controller"] + ".c")
        program = programs.setdefault(one["controller"], webots_player.compiled(source, mock))
        names = [node["name"] for node in one.below() if node.kind in webots_world.DEVICES]
        devices = ["left wheel motor", "right wheel motor", *(name for name in names if not name.endswith("motor"))]
        number = int(one["controllerArgs"][0])
        played = webots_player.Robot(config, told, number, devices, infrared)
        head = [f"{world[0]['basicTimeStep']:g} 100 {len(devices)}", *(f"1 {name}" for name in devices)]
        text = "\n".join([*head, *map(played.frame, range(steps))])
        done = subprocess.run([program, str(number)], input=text, capture_output=True, text=True, timeout=60)
        assert (done.returncode, done.stderr) == (0, "")
        lines = [line.split() for line in done.stdout.splitlines()]
        assert len(lines) == steps
        speeds = np.array([[float.fromhex(word) for word in line[:2]] for line in lines])
        expected = np.clip(told["command"][:, number], -1, 1)
        np.testing.assert_allclose(np.clip(speeds / config.robot.top_speed, -1, 1), expected[:, :2], rtol=0, atol=1e-9)
        if expected.shape[1] > 2:
            bits = [[int(word) for word in line[2:]] for line in lines]
            assert bits == [[number, *map(int, row > 0)] for row in expected[:, 2:]]
    assert np.ptp(told["command"][:, :, :2]) > 0.1  # they did do something


@pytest.mark.parametrize("device", ["infrared", "touch", "rf", "rf_bearing", "range_and_bearing", "light"])
def test_a_robot_with_one_device_in_an_empty_scene_compiles(tmp_path: Path, mock: Path, device: str) -> None:
    """Without a warning of what it does not use."""
    sections = {**PAPER, "robot": {"sensors": [device]}, "scene": {"movables": [], "emitters": [], "goals": []}}
    folder, _, _ = project(tmp_path, sections, "2022")
    webots_player.compiled(folder / "controllers" / "swarmevo" / "swarmevo.c", mock)


def test_a_period_that_is_no_multiple_of_the_worlds_step_is_said(tmp_path: Path, mock: Path) -> None:
    folder, _, _ = project(tmp_path, PAPER)
    program = webots_player.compiled(folder / "controllers" / "swarmevo" / "swarmevo.c", mock)
    text = "32 96 2\n1 left wheel motor\n1 right wheel motor\n" + ".\n" * 5
    done = subprocess.run([program], input=text, capture_output=True, text=True, timeout=60)
    assert (done.returncode, len(done.stdout.splitlines())) == (0, 5)
    assert "control period of 100 ms is no multiple of the world's step of 32 ms: it is 96 ms here" in done.stderr


def test_a_source_sends_the_numbers_of_its_emitters(tmp_path: Path, mock: Path) -> None:
    folder, _, _ = project(tmp_path, PAPER)
    program = webots_player.compiled(folder / "controllers" / "swarmevo_source" / "swarmevo_source.c", mock)
    done = subprocess.run(
        [program], input="20 20 2\n1 lamp\n7 emitter 11\n" + ".\n" * 3, capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, [line.split()[2:] for line in done.stdout.splitlines()]) == (0, [["11"]] * 3)


# ---- what cannot be, and the command ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("sections", "message"),
    [
        (
            {"robot": {"sensors": ["touch", "movable_motion"]}},
            "expected devices that Webots has, .* got movable_motion; ",
        ),
        ({"sensors": {"touch_mode": "graded"}}, "sensors.touch_mode: expected binary for Webots"),
        (
            {"box": {"size": [0.2, 0.1, 0.08], "mass": 0.5}},
            "sensors.infrared_target: expected all, or movables lower than",
        ),
        (
            {"episode": {"control_period": 0.0125, "horizon": 0.5}, "physics": {"time_step": 0.0125}},
            "episode.control_period: expected whole milliseconds for Webots, got 0.0125 s",
        ),
    ],
    ids=["sensor", "touch mode", "high box", "period"],
)
def test_what_webots_has_not_is_refused(tmp_path: Path, sections: dict[str, Any], message: str) -> None:
    with pytest.raises(ExportError, match=message):
        project(tmp_path, {**PAPER, **sections})
    assert not (tmp_path / "project").exists()


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = run(tmp_path / "run", PAPER)

    def call(*arguments: object) -> tuple[int, str]:
        with pytest.raises(SystemExit) as exit:
            cli.main(["export", str(folder), "--controller", "1", *map(str, arguments)])
        return int(exit.value.code or 0), capsys.readouterr().err

    out = tmp_path / "webots"
    assert call("--as", "webots", "--infrared", "2022", "--out", out) == (0, "")
    assert "1465.73" in (out / "worlds" / "swarmevo.wbt").read_text()
    assert "lookup table `2022`" in (out / "README.md").read_text()
    code, said = call("--as", "webots", "--out", out)
    assert (code, said) == (1, f"error: {out}: expected a folder that is empty or not there; choose another name\n")
    assert call("--as", "webots", "--infrared", "2020")[0] == 2
    assert "--infrared: has no effect without --as webots" in call("--infrared", "2022")[1]
    assert "--robot: has no effect in a Webots project" in call("--as", "webots", "--robot", "0", "--out", out)[1]

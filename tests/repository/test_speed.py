# SPDX-License-Identifier: BSD-3-Clause
"""The 2-D peers of the speed benchmark: at which step they run, which networks, in which scene."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarmevo import config
from swarmevo.config import Config
from swarmevo.simulation import Lockstep, Scene, simulate

# The benchmarks are not installed. At the end of the path: the installed swarmevo comes first.
sys.path.append(str(Path(__file__).parents[2]))

from benchmarks import assumptions, lockstep, speed
from benchmarks.cases import avoiding_network, pushing_config, random_networks, write_networks
from benchmarks.speed import Planar, Prepared, Trial

# ---- the step ----


@pytest.mark.parametrize(
    ("ways", "largest"),
    [
        ({0.001: 1.0, 0.002: 1.0, 0.005: 1.0}, 0.005),
        ({0.001: 1.0, 0.002: 1.019, 0.005: 0.981}, 0.005),
        ({0.001: 1.0, 0.002: 0.99, 0.005: 0.97}, 0.002),
        ({0.001: 1.0, 0.002: 1.03, 0.005: 1.0}, 0.001),  # near again, but by chance
        ({0.005: 0.97, 0.002: 0.99, 0.001: 1.0}, 0.002),  # in any order
        ({0.001: 0.5, 0.002: 0.508, 0.005: 0.512}, 0.002),  # relative to the way
        ({0.001: 1.0, 0.002: float("nan"), 0.005: 1.0}, 0.001),
    ],
)
def test_the_largest_valid_step_is_the_last_before_the_way_of_the_box_is_off(
    ways: dict[float, float], largest: float
) -> None:
    assert speed.valid_steps({step: Trial(way, 0.1) for step, way in ways.items()})[-1] == largest


def test_a_step_at_which_bodies_overlap_deeper_than_ours_may_is_not_valid() -> None:
    assert speed.valid_steps({0.001: Trial(1.0, 0.2), 0.002: Trial(1.0, 1.0), 0.005: Trial(1.0, 1.1)})[-1] == 0.002


@pytest.mark.parametrize("way", [0.0, float("nan")])
def test_a_box_that_does_not_move_makes_no_step_valid(way: float) -> None:
    with pytest.raises(ValueError, match="expected a box that is pushed at the step"):
        speed.valid_steps({0.001: Trial(way, 0.1), 0.002: Trial(way, 0.1)})


def test_the_steps_divide_the_control_period() -> None:
    ratios = Config().episode.control_period / np.array(speed.STEPS)
    np.testing.assert_allclose(ratios, ratios.round(), rtol=1e-12)


# ---- what is run ----


def prepared(*ways: float) -> dict[str, Prepared | str]:
    trials = {step: Trial(way, 0.1) for step, way in zip(speed.STEPS, ways, strict=False)}
    return {"A": Prepared(["a"], Path("folder"), trials), "B": "not installed"}


def test_a_2d_peer_runs_at_its_largest_valid_step_which_its_name_says() -> None:
    name, command = speed.runner("A, 2-D", Planar("A", "pushing", 3), prepared(1.0, 1.01, 1.05))
    assert name == "A, 2-D, at 2 ms"
    friction = str(Config().physics.box_friction)
    options = ["--networks", "folder/pushing.csv", "--dt", "0.002", "--seconds", "8.0", "--episodes", "3"]
    assert command == ["a", "pushing", *options, "--box-friction", friction]


def test_a_peer_that_cannot_be_run_has_the_reason_in_place_of_a_rate() -> None:
    name, reason = speed.runner("B, 2-D", Planar("B", "random", 3), prepared(1.0))
    assert (name, speed.rate_of(reason)) == ("B, 2-D", "not installed")


def test_without_a_compiler_box2d_is_not_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(shutil, "which", lambda _: None)
    assert speed.compiled_box2d(tmp_path) == "g++ is not installed"


def test_the_table_of_steps_says_which_are_valid() -> None:
    *_, first, second = speed.steps_compared(prepared(1.0, 1.05)).splitlines()
    assert first == "| A | 1 ms | 1.0000 | 0.10 | yes |"
    assert second == "| A | 2 ms | 1.0500 | 0.10 | no |"


def test_the_2d_peers_get_the_weights_and_switches_of_our_networks(tmp_path: Path) -> None:
    networks = random_networks(3)
    write_networks(tmp_path / "networks.csv", networks)
    hidden, output, on = np.split(np.loadtxt(tmp_path / "networks.csv", delimiter=","), [15 * 14, 15 * 14 + 2 * 16], 1)
    np.testing.assert_array_equal(hidden.reshape(3, 15, 14), networks.input_hidden)
    np.testing.assert_array_equal(output.reshape(3, 2, 16), networks.hidden_output)
    np.testing.assert_array_equal(on, networks.hidden_switch)


# ---- the scene ----


def expected_constants() -> dict[str, Any]:
    """Return the constants of the 2-D scenes, by their names in Python, as our configuration has them."""
    c, pushing = Config(), pushing_config()
    start, box = pushing.team.start_poses, pushing.box
    return {
        "ROBOTS": c.team.robots,
        "GRAVITY": c.physics.gravity,
        "ARENA_SIZE": c.arena.size,
        "WIDE_ARENA_SIZE": pushing.arena.size,
        "BOX_LENGTH": c.box.size[0],
        "BOX_WIDTH": c.box.size[1],
        "BOX_MASS": c.box.mass,
        "BOX_Y": c.box.pose[1],
        "ROBOT_RADIUS": c.robot.radius,
        "ROBOT_MASS": c.robot.mass,
        "CENTRE_OF_MASS": c.robot.centre_of_mass,
        "CASTER_OFFSET": c.robot.caster_offset,
        "AXLE_LENGTH": c.robot.axle_length,
        "TOP_SPEED": c.robot.top_speed * c.robot.wheel_radius,
        "WHEEL_FRICTION": c.physics.wheel_friction,
        "BOX_FRICTION": c.physics.box_friction,
        "SIDE_FRICTION": c.physics.side_friction,
        "ROW_Y": c.team.row_y,
        "ROW_SPACING": c.team.row_spacing,
        "POSITION_JITTER": c.team.start_jitter[0],
        "HEADING_JITTER": c.team.start_jitter[1],
        "PUSHER_SPACING": start[1][0] - start[0][0],
        "PUSHER_GAP": box.pose[1] - box.size[1] / 2 - c.robot.radius - start[0][1],
        "BOX_TO_SOUTH_WALL": box.pose[1] + pushing.arena.size / 2,
        "CONTROL_PERIOD": c.episode.control_period,
        "WHEEL_NOISE": c.noise.wheels,
        "INFRARED_NOISE": c.noise.infrared,
        "INFRARED_NOISE_AT_CONTACT": c.noise.infrared_at_contact,
        "INFRARED_YAW_DEG": c.sensors.infrared_yaw_deg,
        "INFRARED_CURVE": c.sensors.infrared_curve,
        "INFRARED_RANGE": c.sensors.infrared_curve[-1][0],
        "TOUCH_YAW_DEG": c.sensors.touch_yaw_deg,
        "TOUCH_HALF_WIDTH_DEG": c.sensors.touch_half_width_deg,
        "TOUCH_RANGE": c.sensors.touch_range,
        "EMITTER_RANGE": c.emitter.range,
        "EMITTER_ABOVE_RECEIVER": c.emitter.position[2] - c.robot.height,
        "LEAST_STRENGTH": c.emitter.strength[0],
        "MOST_STRENGTH": c.emitter.strength[1],
    }


def python_constants(source: str) -> dict[str, Any]:
    """Return the literals that a module assigns, by name."""
    found: dict[str, Any] = {}
    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign):
            try:
                value = ast.literal_eval(node.value)
            except ValueError:
                continue  # it is computed
            target = node.targets[0]
            if isinstance(target, ast.Tuple):
                found.update(zip(map(ast.unparse, target.elts), value, strict=True))
            else:
                found[ast.unparse(target)] = value
    return found


def cpp_constants(source: str) -> dict[str, Any]:
    """Return the numbers of constexpr declarations, by name in the style of Python."""
    found = {}
    for declaration in re.findall(r"^constexpr \w+ ([^;]+);", source, re.MULTILINE):
        for name, value in re.findall(r"k(\w+)[^=,]* = (\{.*\}|[-\w.]+)", declaration, re.DOTALL):
            numbers = [float(number) for number in re.findall(r"-?\d[\d.]*", value)]
            found[re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).upper()] = numbers if value[0] == "{" else numbers[:1]
    return found


@pytest.mark.parametrize(
    ("script", "constants"), [("pymunk_scene.py", python_constants), ("box2d_scene.cpp", cpp_constants)]
)
def test_the_2d_peers_have_the_scene_of_our_configuration(script: str, constants: Any) -> None:
    found = constants((speed.PEERS / script).read_text())
    for name, value in expected_constants().items():
        np.testing.assert_allclose(np.ravel(found[name]), np.ravel(value), rtol=1e-6, err_msg=name)


# ---- stepping from Python ----


def test_the_table_of_stepping_from_python_is_that_of_the_page() -> None:
    section = lockstep.section(lockstep.rows(repeat=1, sizes=(1, 2), horizon=1.0))
    *_, first, _, _, last = section.splitlines()
    assert re.fullmatch(r"\| roaming \| 1 \| [\d,]+ \| [\d,]+ to [\d,]+ \| [\d,]+ \|", first)
    assert re.fullmatch(r"\| random \| 2 \| [\d,]+ \| [\d,]+ to [\d,]+ \| [\d,]+ \|", last)
    head = section.splitlines()[:-4]
    assert "\n".join(head) in (lockstep.ROOT / "docs" / "performance.md").read_text()


def test_roaming_commands_are_those_of_the_same_episodes() -> None:
    scene = Scene(config.load("paper", ["episode.horizon=2.0"]))
    commands = lockstep.roaming_commands(scene, worlds=2)
    with Lockstep(scene, worlds=2) as world:
        expected = simulate(scene, avoiding_network(), world.keys, np.zeros((2, 5), dtype=np.uint32)).hash
        for each in commands:
            world.advance(each)
        assert np.array_equal(world.state().hash, expected)


# ---- instructions ----


@pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++")
def test_the_program_whose_instructions_are_counted_compiles() -> None:
    native = assumptions.ROOT / "native"
    command = ["g++", "-std=c++17", "-fsyntax-only", f"-I{native / 'include'}", f"-I{native / 'src'}"]
    program = assumptions.ROOT / "benchmarks" / "native" / "episodes.cpp"
    done = subprocess.run([*command, program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


# ---- assumptions ----


@pytest.mark.parametrize("each", assumptions.ASSUMPTIONS, ids=lambda each: each.name)
def test_an_assumption_can_be_taken_out(each: assumptions.Assumption, tmp_path: Path) -> None:
    sources = tmp_path / "src"
    shutil.copytree(assumptions.ROOT / "native" / "src", sources)
    before = (sources / each.file).read_text()
    each.undo(sources)
    assert (sources / each.file).read_text() == before.replace(each.code, each.without) != before
    with pytest.raises(ValueError, match=r"expected .* once, found it 0 times"):
        each.undo(sources)


def test_every_assumption_that_a_step_checks_is_timed() -> None:
    listed = re.findall(r"all\.push_back\(.*?\);", (assumptions.ROOT / "native" / "src" / assumptions.LIST).read_text())
    timed = [each.code for each in assumptions.ASSUMPTIONS if each.file == assumptions.LIST]
    assert sorted(timed) == sorted(listed)

# SPDX-License-Identifier: BSD-3-Clause
"""The second simulator: what does not move is as in the library, and the shipped controller pushes in it."""

from __future__ import annotations

import ast
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarmevo import config as configuration
from swarmevo.analysis import shipped
from swarmevo.analysis.recording import simulate
from swarmevo.config import Config
from swarmevo.errors import ConfigError, InvalidArgument
from swarmevo.plugins.team import Team
from swarmevo.runs import export, other_world

# The benchmarks are not installed. At the end of the path: the installed swarmevo comes first.
sys.path.append(str(Path(__file__).parents[2]))

from benchmarks import validation_sensors
from benchmarks.cases import changed
from benchmarks.second_simulator import __main__ as command
from benchmarks.second_simulator import episode, sensors
from benchmarks.twin import REFERENCE_STEP

SHIPPED = command.tested(None)
QUIET = {"infrared": 0.0, "infrared_at_contact": 0.0, "wheels": 0.0, "rf": 0.0}


def random_generator(test: int = 0) -> np.random.Generator:
    return np.random.default_rng((2026, test))


# ---- what shares nothing ---------------------------------------------------------------------------------------------


def imported(path: Path) -> set[str]:
    tree = ast.parse(path.read_text())
    froms = {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    return froms | {name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names}


def test_it_knows_of_swarmevo_the_configuration_alone() -> None:
    folder = Path(episode.__file__).parent
    files = [folder / "sensors.py", folder / "episode.py", folder.parent / "twin.py", folder.parent / "reference.py"]
    names = set().union(*map(imported, files))
    known = {name for name in names if name.startswith(("swarmevo", "benchmarks"))}
    assert known <= {
        "swarmevo.config",
        "swarmevo.errors",
        "swarmevo.protocols",  # types of arrays
        "benchmarks.reference",
        "benchmarks.second_simulator",
        "benchmarks.twin",
    }


# ---- what does not move ----------------------------------------------------------------------------------------------


def test_sensors_are_the_librarys_in_random_scenes() -> None:
    """The box is seen too, and box sensors are graded."""
    answering = np.zeros(3)
    for part in validation_sensors.draw(250, threads=1):
        for poses, box, *found in zip(
            part.robots, part.box[:, np.newaxis], part.infrared, part.touch, part.rf, strict=True
        ):
            distances = sensors.infrared_distances(part.config, poses, box)
            expected = (
                sensors.infrared_readings(part.config, distances),
                sensors.touch_readings(part.config, poses, box),
                sensors.strongest(sensors.homing_sources(part.config, poses, box)),
            )
            for one, other in zip(found, expected, strict=True):
                np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)
            answering += [np.count_nonzero(found[0]), np.count_nonzero(found[1]), np.count_nonzero(found[2] > 1)]
    assert answering.min() > 100


@pytest.mark.parametrize("options", [{}, {"activation": "logistic", "hidden": 5}, {"bias": False}])
@pytest.mark.parametrize("bumper", ["sprung", "rigid"])
def test_readings_commands_and_successes_are_the_librarys_along_its_own_episode(
    options: dict[str, Any], bumper: str
) -> None:
    """Pressed bumpers, robots that meet, and boxes at the wall among its poses."""
    config = changed(SHIPPED.config, noise=QUIET, robot={"bumper": bumper}, episode={"horizon": 60.0})
    genes = np.array(SHIPPED.exported["genes"])
    if options:
        config = config.model_copy(update={"controller": {"feedforward": options}})
        space = Team(config).space
        genes = random_generator().normal(0, 2, space.size)
        assert Team(config).complexity(genes[np.newaxis]) >= 1
    team = Team(config)
    plain = [vars(one) for one in export.networks(team, genes)]
    (network,) = episode.networks_of({"networks": plain})
    done = simulate(team, genes, [shipped.key(repeat=1)], threads=1)  # the team pushes in that one
    telemetry = done.telemetry

    homing_times, push_time = np.full(config.team.robots, np.nan), np.nan
    for step, (poses, box) in enumerate(zip(telemetry.pose[0], telemetry.movables[0], strict=True)):
        now = step * config.episode.control_period
        homing_times[np.isnan(homing_times) & sensors.are_home(config, poses, box)] = now
        (at_wall,) = sensors.are_at_goal(config, box)
        assert at_wall == telemetry.box_contact[0, step]
        push_time = now if np.isnan(push_time) and at_wall else push_time
        seen = episode.observe(config, poses, box, random_generator())
        np.testing.assert_allclose(seen[:, :8], telemetry.infrared[0, step], atol=1e-12)
        np.testing.assert_allclose(seen[:, 8:12], telemetry.touch[0, step], atol=1e-12)
        np.testing.assert_allclose(50 * seen[:, 12], telemetry.rf[0, step], rtol=1e-12)
        commands = [network.command(one) for one in seen]
        np.testing.assert_allclose(commands, telemetry.command[0, step], atol=1e-10)
    np.testing.assert_allclose(homing_times, telemetry.homing_time[0])
    np.testing.assert_allclose(push_time, telemetry.push_time[0])
    if not options:
        assert telemetry.touch.any()
        assert np.isfinite(push_time)


@pytest.mark.parametrize(
    ("wall", "outwards"), [("north", (0, 1)), ("south", (0, -1)), ("east", (1, 0)), ("west", (-1, 0))]
)
def test_the_box_is_at_a_wall_within_2_mm(wall: str, outwards: tuple[int, int]) -> None:
    config = changed(Config(), arena={"target_wall": wall})
    for turn in (0.0, 0.3, 2.0):
        half_length, half_width = 0.1375, 0.09
        along, across = abs(np.cos(turn)), abs(np.sin(turn))
        extent = (half_length * along + half_width * across, half_length * across + half_width * along)
        for gap, is_there in ((0.0019, True), (0.0021, False)):
            x, y = (one * (0.5 - gap - way) for one, way in zip(outwards, extent, strict=True))
            assert sensors.are_at_goal(config, np.array([[x, y, turn]])) == [is_there]


def test_readings_are_as_noisy_as_the_configuration_says() -> None:
    config = changed(SHIPPED.config, team={"robots": 1}, noise={"rf": 0.2})
    away = np.array([[0.0, 0.345, 0.0]])
    for distance, spread in ((0.0025, 0.0275), (0.005, 0.05), (0.03, 0.05)):
        poses = np.array([[config.arena.size / 2 - config.robot.radius - distance, 0.35, np.pi / 2]])  # ps2 sees a wall
        rng = random_generator()
        seen = np.array([episode.observe(config, poses, away, rng)[0] for _ in range(1000)])
        exact = sensors.infrared_readings(config, np.array(distance))
        assert seen[:, 2].mean() == pytest.approx(exact, rel=0.01)
        assert seen[:, 2].std() / exact == pytest.approx(spread, rel=0.1)
        assert not seen[:, 5].any()
    home = np.array([[0.0, 0.145, 0.0]])  # S is 25
    seen = np.array([episode.observe(config, home, away, rng)[0, 12] for _ in range(1000)])
    assert seen.std() / seen.mean() == pytest.approx(0.2, rel=0.1)


# ---- what moves ------------------------------------------------------------------------------------------------------


def run_shipped(robots: int, test: int, horizon: float) -> episode.Outcome:
    config = changed(other_world.of_size(SHIPPED.config, robots), episode={"horizon": horizon})
    return episode.run(config, episode.team_of(episode.networks_of(SHIPPED.exported)), random_generator(test))


def test_wheels_are_as_noisy_as_the_configuration_says() -> None:
    """A wheel at its top speed may turn faster still, and does not lose the noise of half of its steps."""
    network = episode.Network("tanh", np.zeros((0, 13)), np.zeros(0), np.zeros((0, 2)), np.full(2, 20.0))
    pose = (0.0, -0.45, np.pi / 2)
    config = changed(
        other_world.of_size(Config(), 1),
        box={"pose": (0.35, 0.4, 0.0)},
        team={"start": "poses", "start_poses": (pose,), "start_jitter": (0.0, 0.0)},
        noise={"wheels": 0.1},
        episode={"horizon": 6.0},
    )
    paths = [
        episode.run(config, episode.team_of([network]), random_generator(test), whole=True).poses[:, 0, :2]
        for test in range(3)
    ]
    ways = np.concatenate([np.linalg.norm(np.diff(path[5:], axis=0), axis=1) for path in paths])
    at_top_speed = 0.1 * config.robot.top_speed * config.robot.wheel_radius
    assert ways.mean() == pytest.approx(at_top_speed, rel=0.015)
    assert ways.std() / at_top_speed == pytest.approx(0.1 / np.sqrt(3) / np.sqrt(2), rel=0.2)
    assert ways.max() > 1.03 * at_top_speed


def test_longer_steps_than_the_references_change_nothing() -> None:
    config = changed(other_world.of_size(SHIPPED.config, 3), episode={"horizon": 15.0})
    team = episode.team_of(episode.networks_of(SHIPPED.exported))
    coarse, fine = (
        episode.run(config, team, random_generator(), time_step=step) for step in (episode.TIME_STEP, REFERENCE_STEP)
    )
    np.testing.assert_allclose(coarse.poses[..., :2], fine.poses[..., :2], atol=2e-4)  # 0.2 mm


@pytest.mark.parametrize("test", [0, 1])
def test_the_shipped_controller_pushes_with_three_robots(test: int) -> None:
    outcome = run_shipped(3, test, 90.0)
    assert np.isfinite(outcome.homing_times).all()
    assert 10 < outcome.push_time < 90
    assert outcome.poses.shape[1:] == (4, 3)


def test_two_robots_do_not_move_the_box() -> None:
    outcome = run_shipped(2, 0, 40.0)
    assert np.isnan(outcome.push_time)
    assert len(outcome.poses) == 400
    assert np.isfinite(outcome.homing_times).all()
    assert np.linalg.norm(outcome.poses[-1, -1, :2] - outcome.poses[0, -1, :2]) < 0.002


def test_robots_start_in_a_row_that_looks_away_and_is_never_twice_the_same() -> None:
    outcomes = [run_shipped(5, test, 0.1) for test in (0, 1)]
    first, second = (outcome.poses[0, :5] for outcome in outcomes)
    exact = np.array([[x, -0.4, -np.pi / 2] for x in (-0.24, -0.12, 0.0, 0.12, 0.24)])
    for poses in (first, second):
        assert (np.abs(poses - exact) <= (0.01, 0.01, 0.1)).all()
        assert (np.abs(poses - exact) > 1e-6).all()
    assert (first != second).all()


def test_an_episode_depends_on_its_random_numbers_alone() -> None:
    np.testing.assert_array_equal(run_shipped(3, 4, 2.0).poses, run_shipped(3, 4, 2.0).poses)


# ---- what is refused -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ("robot.sensors=[infrared, ground]", "robot.sensors: expected infrared, .*, light, got ground"),
        ("team.robots=9", "team.robots: expected at most 8 in a row, got 9"),
        ("sensors.touch_mode=force", "sensors.touch_mode: expected binary or graded, got force"),
        ("physics.gravity=1.6", r"physics.gravity: expected 9.81, got 1.6"),
    ],
)
def test_a_world_that_is_not_built_is_refused(settings: str, message: str) -> None:
    config: Config = configuration.load("paper", [settings])
    with pytest.raises(InvalidArgument, match=f"^{message}$"):
        episode.run(config, episode.team_of(episode.networks_of(SHIPPED.exported)), random_generator())


def test_a_controller_that_is_no_network_is_refused() -> None:
    with pytest.raises(InvalidArgument, match=r"^controller: expected a feed-forward network"):
        episode.networks_of({"networks": []})


def test_a_controller_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "list.json"
    file.write_text("[1, 2]")
    with pytest.raises(
        ConfigError, match=r"^list.json: expected a controller as `swarmevo export --controller` writes"
    ):
        command.tested(str(file))
    with pytest.raises(ConfigError, match=r"^nosuch:3: expected an exported controller or RUN:ID, but there is none$"):
        command.tested("nosuch:3")


# ---- the page --------------------------------------------------------------------------------------------------------


def outcome(homing_times: list[float], push_time: float) -> episode.Outcome:
    return episode.Outcome(
        np.array(homing_times), push_time, np.zeros((1, 3, 3)), np.zeros((1, 1), dtype=bool), np.zeros((1, 2, 13)),
        np.zeros((1, 2, 2)),
    )  # fmt: skip


def test_a_row_of_the_page_tells_rates_and_times() -> None:
    outcomes = [
        outcome([1.0, np.nan], 20.0),
        outcome([2.0, 3.0], np.nan),
    ]
    assert command.summary(outcomes) == command.Row(homing_rate=0.75, push_rate=0.5, push_time=20.0)
    assert command.summary(outcomes[1:]).push_time is None


@pytest.mark.parametrize(
    ("robots", "push_rate", "carries"), [(2, 0.0, True), (2, 0.01, False), (3, 0.95, True), (3, 0.94, False)]
)
def test_what_is_asked(robots: int, push_rate: float, carries: bool) -> None:
    never = command.Row(1.0, 0.0, None)
    second = command.Row(1.0, push_rate, 20.0)
    rigid = command.Compared("rigid", 1, 100, command.Row(1.0, 1.0, 20.0), never)  # nothing is asked of it
    assert command.carries([command.Compared("sprung", robots, 100, second, never), rigid]) == carries


def test_the_page_is_of_the_shipped_controller_and_stands(capsys: pytest.CaptureFixture[str]) -> None:
    (found,) = command.compare(SHIPPED, [3], {"sprung": 1})
    page = command.page(SHIPPED, [found], "the command")
    assert "the controller that comes with swarmevo" in page
    assert "\n| sprung | 3 | 1 | 100.0 % " in page
    assert "sprung bumpers:\n**yes**." in page
    assert "push_rate=1.0" in capsys.readouterr().err

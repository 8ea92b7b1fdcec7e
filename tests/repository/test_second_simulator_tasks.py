# SPDX-License-Identifier: BSD-3-Clause
"""The tasks in the second simulator: its devices, starts and objectives are the library's where nothing moves."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from swarmevo import config as configuration
from swarmevo.config import Config
from swarmevo.errors import InvalidArgument
from swarmevo.plugins.team import Team
from swarmevo.protocols import FloatArray
from swarmevo.simulation import EpisodeKey, simulate_lockstep

# The benchmarks are not installed. At the end of the path: the installed swarmevo comes first.
sys.path.append(str(Path(__file__).parents[2]))

from benchmarks import validation_devices as devices
from benchmarks.cases import changed
from benchmarks.second_simulator import episode, sensors, tasks
from benchmarks.second_simulator.tasks import Row
from examples.baselines import BASELINES

QUIET = ["noise.infrared=0", "noise.infrared_at_contact=0", "noise.wheels=0"]
RNG = np.random.default_rng


# ---- devices ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("world", range(6))
def test_devices_are_the_librarys_in_random_scenes(world: int) -> None:
    """Round, rectangular and five-sided arenas, cylinders and boxes, obstacles, emitters that ride, lights."""
    config = devices.random_config(world)
    answering = dict.fromkeys(("infrared", "touch", "rf", "rf_bearing", "range_and_bearing", "light"), 0)
    for moment in devices.moments(config, 12):
        poses, movables = moment.robots, moment.movables
        for name in answering:
            found, rest = (
                episode.DEVICES[name](config, poses, movables, RNG(0)),
                [1 / 30, 1 / 20] if name == "rf" else 0.0,
            )
            expected = moment.observations[name]
            if name == "range_and_bearing":
                expected = expected[:, :: 1 + devices.MESSAGE]
            np.testing.assert_allclose(found, expected, atol=1e-9, err_msg=name)
            answering[name] += np.count_nonzero(np.abs(expected - rest) > 1e-9)
    assert min(answering.values()) >= 5, answering


def test_noise_is_as_the_configuration_says() -> None:
    emitters = "scene.emitters=[{reach: arena}, {channel: light, reach: arena}]"
    quiet = configuration.load("paper", ["robot.sensors=[rf_bearing, range_and_bearing, light]", emitters])
    config = changed(quiet, noise={"rf_bearing": 0.1, "range_and_bearing": 0.04, "light": 0.05})
    poses, box, rng = np.array([[0.0, -0.2, 0.5], [0.05, 0.15, 0.0]]), np.array([config.box.pose]), RNG(1)
    seen = np.array([episode.observe(config, poses, box, rng)[0] for _ in range(2000)])
    exact = episode.observe(quiet, poses, box, rng)[0]
    names = episode.observation_names(config)
    spread = np.arctan2(seen[:, 1], seen[:, 0]) - np.arctan2(exact[1], exact[0])
    assert spread.std() == pytest.approx(0.1, rel=0.06)
    (near,) = (i for i, name in enumerate(names) if name.startswith("range") and exact[i] > 0)
    assert seen[:, near].std() == pytest.approx(0.04 * (1 - exact[near]), rel=0.06)
    (lit,) = (i for i, name in enumerate(names) if name.startswith("light") and exact[i] > 0)
    assert seen[:, lit].std() == pytest.approx(0.05 * exact[lit], rel=0.06)


def along(task: str, overrides: list[str]) -> tuple[Team, episode.Outcome, FloatArray, FloatArray]:
    """Return an episode of a task's controller in the library, its observations, and its objectives."""
    config = configuration.load(task, [*overrides, "episode.until=horizon"])
    team = Team(config)
    channels = ["pose", "movables", "at_goal", "command", "observation", *team.channels]
    actor = BASELINES[task](team.scene.info)
    robots = np.zeros((1, team.robots, 0))
    done = simulate_lockstep(team.scene, actor, robots, [EpisodeKey(1, 0, 2**31, 0)], list(dict.fromkeys(channels)))
    one = done.telemetry
    poses = np.concatenate([one.pose[0], one.movables[0]], axis=1)
    outcome = episode.Outcome(
        one.homing_time[0], one.push_time[0], poses, one.at_goal[0].astype(bool), one.observation[0], one.command[0]
    )
    columns = [i for i, objective in enumerate(team.objectives) if objective.of == "episode"]
    return team, outcome, one.observation[0], team.judge(done, np.zeros((1, team.space.size)), 0)[columns]


@pytest.mark.parametrize("task", tasks.TASKS)
def test_observations_commands_and_objectives_are_the_librarys_along_its_own_episode(task: str) -> None:
    team, outcome, observation, objectives = along(task, QUIET)
    config = team.config
    assert episode.observation_names(config) == list(team.scene.info.observation_names)
    mind, n = tasks.mind_of(task, config), config.team.robots
    for step, bodies in enumerate(outcome.poses):
        seen = episode.observe(config, bodies[:n], bodies[n:], RNG(0))
        np.testing.assert_allclose(seen, observation[step], atol=1e-9)
        np.testing.assert_allclose(mind(observation[step]), outcome.commands[step], atol=1e-12)
        np.testing.assert_array_equal(sensors.are_at_goal(config, bodies[n:]), outcome.at_goal[step])
    homes = np.array([sensors.are_home(config, bodies[:n], bodies[n:]) for bodies in outcome.poses])
    first = np.where(homes.any(axis=0), homes.argmax(axis=0) * config.episode.control_period, np.nan)
    np.testing.assert_allclose(first, outcome.homing_times)
    np.testing.assert_allclose(tasks.judge(config, outcome), objectives, atol=1e-9)
    assert max(objectives) > 0.1


def test_objectives_of_a_walk_at_random_are_the_librarys() -> None:
    """Clusters of several sizes, and pucks that are not delivered."""
    for task, horizon in (("aggregation", 0.1), ("aggregation", 8.0), ("foraging", 20.0)):
        team, outcome, _, objectives = along(task, [f"episode.horizon={horizon}"])
        np.testing.assert_allclose(tasks.judge(team.config, outcome), objectives, atol=1e-9)


# ---- starts ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("task", ["foraging", "coverage", "aggregation"])
def test_all_start_in_their_regions_clear_of_each_other(task: str) -> None:
    config = configuration.load(task)
    radius, starts = config.robot.radius, [episode.start(config, RNG(i)) for i in range(20)]
    for robots, movables in starts:
        west, east, south, north = config.team.start_region
        assert ((robots[:, :2] >= (west, south)) & (robots[:, :2] <= (east, north))).all()
        away = np.linalg.norm(robots[:, np.newaxis, :2] - robots[np.newaxis, :, :2], axis=-1)
        assert away[~np.eye(len(robots), dtype=bool)].min() > 2 * radius
        assert (sensors.gaps_to_walls(config, robots[:, :2]) > radius).all()
        for thing, pose in zip(episode.surroundings_of(config).movables, movables, strict=True):
            assert (sensors.gap_to(thing, pose, robots[:, :2]) > radius).all()
        for one in episode.surroundings_of(config).obstacles:
            assert (sensors.gap_to(one, np.array(one.pose), robots[:, :2]) > radius).all()
    headings = np.concatenate([robots[:, 2] for robots, _ in starts])
    assert headings.min() < -2.5
    assert headings.max() > 2.5


def test_a_region_without_room_is_refused() -> None:
    crowd = configuration.load("coverage", ["team.robots=30"])
    cramped = crowd.model_copy(update={"team": crowd.team.model_copy(update={"start_region": (-0.1, 0.1, -0.1, 0.1)})})
    with pytest.raises(InvalidArgument, match=r"^start_region: expected room for a disc of 0.035 m, got"):
        episode.start(cramped, RNG(0))


# ---- what moves ------------------------------------------------------------------------------------------------------


def test_six_robots_clear_both_boxes() -> None:
    config: Config = configuration.load("clearing")
    outcome = episode.run(config, tasks.mind_of("clearing", config), RNG(0), whole=True)
    assert outcome.at_goal[-1].any()
    assert 3 < outcome.push_time < 30
    assert len(outcome.poses) == round(10 * outcome.push_time) + 1  # until: push
    assert tasks.judge(config, outcome)[1] == 1.0


def test_four_robots_two_at_each_box_move_neither() -> None:
    poses = [(x + side, 0.05, np.pi / 2) for x in (-0.35, 0.35) for side in (-0.05, 0.05)]
    config = configuration.load(
        "clearing", ["team.start=poses", "team.robots=4", f"team.start_poses={[list(map(float, p)) for p in poses]}",
                     "episode.horizon=15"],
    )  # fmt: skip
    outcome = episode.run(config, tasks.mind_of("clearing", config), RNG(0), whole=True)
    way = np.linalg.norm(outcome.poses[-1, 4:, :2] - outcome.poses[0, 4:, :2], axis=1)
    assert way.max() < 0.002


# ---- the page --------------------------------------------------------------------------------------------------------


def test_the_page_says_whether_means_differ() -> None:
    alike = Row("foraging", "delivery", (0.50, 0.03), (0.59, 0.04))
    assert alike.difference == pytest.approx(0.09 / 0.05)
    same = Row("clearing", "transport", (1.0, 0.0), (1.0, 0.0))
    assert same.difference == 0
    text = tasks.page([alike, same], 30, "the command")
    assert "| foraging | delivery | 0.500 ± 0.030 | 0.590 ± 0.040 | 1.8 |" in text
    assert "3 standard errors: **yes**" in text
    other = Row("clearing", "transport", (1.0, 0.0), (0.9, 0.0))
    assert other.difference == float("inf")
    assert "3 standard errors: **no**" in tasks.page([alike, other], 30, "the command")


def test_a_task_is_compared_in_both() -> None:
    (delivery, transport) = tasks.compare("clearing", 2, 1)
    assert (delivery.task, delivery.objective, transport.objective) == ("clearing", "delivery", "transport")
    assert delivery.second[0] == pytest.approx(delivery.library[0], abs=0.02)
    assert transport.second[0] == transport.library[0] == 1.0

# SPDX-License-Identifier: BSD-3-Clause
"""Scenes made of lists: movables, obstacles, emitters, goals and arenas of other shapes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarmevo.config import Config, ConfigError, load
from swarmevo.config import dump as as_yaml
from swarmevo.config import world as world_of
from swarmevo.protocols import FeedForward, FloatArray
from swarmevo.simulation import EpisodeKey, Scene, scene_errors, simulate, simulate_lockstep

ROW = {"start": "poses", "robots": 1, "start_poses": [[0.0, -0.3, np.pi / 2]], "start_jitter": [0.0, 0.0]}
QUIET = {"infrared": 0.0, "infrared_at_contact": 0.0, "wheels": 0.0}
PUCK = {"shape": "cylinder", "size": [0.06, 0.06, 0.03], "mass": 0.02, "pose": [0.0, -0.1, 0.0]}


def config_of(horizon: float = 5.0, **sections: Any) -> Config:
    return Config.model_validate({"noise": QUIET, "team": ROW, "episode": {"horizon": horizon}} | sections)


def errors_of(**sections: Any) -> list[str]:
    return scene_errors(config_of(**sections))


class Constant:
    """Gives all robots the same share of their top speed."""

    def __init__(self, speed: float) -> None:
        self.speed = speed

    def start(self, genomes: FloatArray) -> None:
        pass

    def act(self, observations: FloatArray) -> FloatArray:
        return np.full((*observations.shape[:2], 2), self.speed)


def driven(config: Config, *channels: str, speed: float = 0.5, n: int = 1) -> Any:
    """Let all robots go straight on."""
    keys = [EpisodeKey(1, 0, 0, i) for i in range(n)]
    return simulate_lockstep(Scene(config), Constant(speed), np.zeros((n, config.team.robots, 1)), keys, channels)


def random_networks(n: int) -> FeedForward:
    rng = np.random.default_rng(4)
    return FeedForward(2 * rng.normal(size=(n, 5, 14)), 2 * rng.normal(size=(n, 2, 6)), np.ones((n, 5), dtype=bool))


def hashes(config: Config, n: int = 6) -> list[int]:
    drivers = np.repeat(np.arange(n, dtype=np.uint32)[:, None], config.team.robots, axis=1)
    done = simulate(Scene(config), random_networks(n), [EpisodeKey(1, 0, 0, i) for i in range(n)], drivers)
    return list(done.hash)


# ---- the box, the emitter and the wall are shorthand -----------------------------------------------------------------


def test_the_lists_spelled_out_are_the_same_world() -> None:
    plain = load("paper", ["episode.horizon=20"])
    spelled = load(
        "paper",
        ["episode.horizon=20", "scene.movables=[{}]", "scene.emitters=[{}]", "scene.goals=[{wall: north}]"],
    )
    assert hashes(plain) == hashes(spelled)
    assert world_of(plain)["scene"] == world_of(spelled)["scene"]
    (box,) = world_of(plain)["scene"]["movables"]
    assert box["friction"] == plain.physics.box_friction


def test_a_list_is_written_and_read_back() -> None:
    scene = {"movables": [PUCK], "obstacles": [{"shape": "wall"}], "goals": [{"region": [0, 1, 0, 1]}]}
    config = config_of(scene=scene)
    path_text = as_yaml(config)
    assert "cylinder" in path_text
    assert Config.model_validate(config.model_dump()) == config


def test_worlds_and_set_take_whole_lists() -> None:
    config = load(
        "paper", ["scene.obstacles=[{pose: [0.2, 0, 0]}]", "worlds=[{scene.obstacles: []}, {team.robots: 3}]"]
    )
    assert len(config.scene.obstacles) == 1
    assert len(config.worlds) == 2


# ---- what is refused -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("scene", "line"),
    [
        ({"movables": [PUCK, PUCK]}, "scene.movables[0].pose: expected it clear of scene.movables[1]"),
        ({"obstacles": [{"pose": [0, 0.3, 0]}]}, "box.pose: expected it clear of scene.obstacles[0]"),
        ({"movables": [PUCK | {"pose": [0.48, 0, 0]}]}, "scene.movables[0].pose: expected it inside the arena"),
        ({"movables": [PUCK | {"size": [0.06, 0.07, 0.03]}]}, "scene.movables[0].size: expected a cylinder's diameter"),
        ({"patches": [{"shape": "cylinder", "size": [0.2, 0.9]}]}, "scene.patches[0].size: expected a disc's diameter"),
        (
            {"movables": [PUCK | {"size": [1.1, 1.1, 0.03], "start": "random"}]},
            "scene.movables[0].start_region: expected an arena in which a disc of 1.1 m fits, got one of 1 m",
        ),
        ({"movables": [PUCK | {"size": [0.06, 0.06, 0.2]}]}, "scene.movables[0].size: expected one that slides"),
        ({"emitters": [{"rides_on": 3}]}, "scene.emitters[0].rides_on: expected one of the 1 movables, got 3"),
        (
            {"obstacles": [{"pose": [0, -0.3, 0]}]},
            "team.start_poses[0]: expected the robot clear of scene.obstacles[0]",
        ),
        ({"goals": [{"region": [0.2, 0.1, 0, 1]}]}, "scene.goals[0].region: expected x from < x to"),
        ({"goals": [{"region": [0.5, 0.6, 0, 1]}]}, "scene.goals[0].region: expected it in the arena, a part at least"),
        ({"obstacles": [{"pose": [0.3, 0.58, 0.5]}]}, "scene.obstacles[0].pose: expected it in the arena, a part"),
        (
            {"obstacles": [{"shape": "wall", "ends": [[-1, 0], [-0.6, 0]]}]},
            "scene.obstacles[0].ends: expected it in the arena, a part at least, got it beyond a wall",
        ),
        (
            {"obstacles": [{"shape": "wall", "ends": [[0.3, 0], [0.3, 0]]}]},
            "scene.obstacles[0].ends: their distance: expected 0.01 to 10 m, got 0",
        ),
    ],
)
def test_a_scene_that_cannot_be_is_one_line(scene: dict[str, Any], line: str) -> None:
    (found,) = errors_of(scene=scene)
    assert found.startswith(line)


def test_what_reaches_into_the_arena_is_fine() -> None:
    goal, wall = {"region": [0.49, 3, -3, 3]}, {"shape": "wall", "ends": [[0.45, -2], [2, 2]]}
    assert errors_of(scene={"goals": [goal], "obstacles": [{"pose": [0.3, 0.54, 0]}, wall]}) == []


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("scene.movables=[{mass: -1}]", "scene.movables[0].mass: expected a number from 0.001 to 1000 [kg], got -1"),
        ("scene.movables=[{colour: 1}]", "scene.movables[0].colour: unknown key; it has shape, size"),
        ("scene.movables=[{masss: 1}]", "scene.movables[0].masss: unknown key; did you mean mass?"),
        ("scene.movables=[3]", "scene.movables[0]: expected a section (shape"),
        ("scene.movables=3", "scene.movables: expected a list of sections (shape"),
        ("scene.goals=[{}]", "scene.goals[0]: expected a wall or a region, got neither"),
        ("scene.goals=[{wall: up}]", "scene.goals[0].wall: expected one of north, south, east, west, got 'up'"),
        ("scene.obstacles=[{ends: [[0, x], [0, 1]]}]", "scene.obstacles[0].ends[0][1]: expected a number"),
        ("scene.emitters=[{channel: X Y}]", "scene.emitters[0].channel: expected text that matches"),
    ],
)
def test_a_wrong_entry_of_a_list_is_one_line(text: str, line: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load("paper", [text])
    (found,) = caught.value.errors
    assert found.startswith(line)


@pytest.mark.parametrize(
    ("arena", "line"),
    [
        ({"shape": "rectangle", "sides": [0.1, 1.0]}, "arena.sides[0]: expected 0.2 to 100 m"),
        ({"shape": "polygon"}, "arena.corners: their number: expected 3 to 32, got 0"),
        (
            {"shape": "polygon", "corners": [[-1, -1], [-1, 1], [1, 1], [1, -1]]},
            "arena.corners[1]: expected corners at least 0.01 m apart, counter-clockwise",
        ),
        (
            {"shape": "polygon", "corners": [[0, -1], [0.6, 0.8], [-0.95, -0.3], [0.95, -0.3], [-0.6, 0.8]]},
            "arena.corners: expected a polygon that goes round once",
        ),
    ],
)
def test_an_arena_that_cannot_be_is_told(arena: dict[str, Any], line: str) -> None:
    settings = {"shape": "square"} | arena
    config = config_of()
    changed = config.arena.model_copy(update=settings)
    assert scene_errors(config.model_copy(update={"arena": changed}))[0].startswith(line)


def test_a_wall_is_no_goal_of_a_round_arena() -> None:
    assert "expected a region" in errors_of(arena={"shape": "circle"}, scene={"goals": [{"wall": "north"}]})[0]
    assert errors_of(arena={"shape": "circle", "size": 1.2}) == []  # the default goal is that of a wall: none


# ---- what happens ----------------------------------------------------------------------------------------------------


def test_a_puck_is_pushed_to_a_region() -> None:
    goal = {"region": [-0.1, 0.1, 0.0, 0.3]}
    config = config_of(scene={"movables": [PUCK, PUCK | {"pose": [0.0, 0.0, 0.0]}], "goals": [goal]})
    done = driven(config, "movables", "at_goal", "box", "box_contact")
    telemetry = done.telemetry
    assert telemetry.movables.shape == (1, 50, 2, 3)
    assert telemetry.at_goal[0, 0].tolist() == [0.0, 1.0]
    np.testing.assert_array_equal(telemetry.movables[:, :, 0], telemetry.box)
    np.testing.assert_array_equal(telemetry.at_goal[:, :, 0], telemetry.box_contact)
    first = int(telemetry.at_goal[0, :, 0].argmax())
    assert telemetry.movables[0, first, 0, 1] >= 0 > telemetry.movables[0, first - 1, 0, 1]
    assert telemetry.push_time[0] == pytest.approx(0.1 * first)


def test_an_episode_ends_when_all_have_been_at_a_goal() -> None:
    scene = {"movables": [PUCK], "goals": [{"region": [-0.1, 0.1, 0.0, 0.3]}]}
    config = config_of(scene=scene, episode={"horizon": 20.0, "until": "push"})
    assert driven(config).steps[0] < 100


def test_nothing_to_push_and_nobody_to_hear() -> None:
    done = driven(config_of(scene={"movables": [], "emitters": []}), "movables", "box", "box_contact", "rf")
    assert done.telemetry.movables.shape == (1, 50, 0, 3)
    assert np.isnan(done.telemetry.box).all()
    assert not done.telemetry.box_contact.any()
    assert not done.telemetry.rf.any()
    assert np.isnan(done.telemetry.push_time).all()
    assert np.isnan(done.telemetry.homing_time).all()


def test_an_emitter_rides_on_a_movable() -> None:
    scene = {"movables": [PUCK], "emitters": [{"rides_on": 0, "position": [0.0, 0.0, 0.03]}]}
    telemetry = driven(config_of(scene=scene), "movables", "rf", "pose").telemetry
    away = telemetry.movables[0, :, 0, :2] - telemetry.pose[0, :, 0, :2]
    squared = (away**2).sum(axis=1) + (0.05 - 0.03) ** 2
    np.testing.assert_allclose(telemetry.rf[0, :, 0], np.clip(1 / squared, 1, 50), rtol=1e-9)


def test_movables_are_drawn_anew_in_each_episode() -> None:
    puck = PUCK | {"start": "random", "start_region": [-0.3, 0.3, -0.1, 0.3]}
    config = config_of(0.1, scene={"movables": [puck] * 4, "obstacles": [{"pose": [0, 0.1, 0.3]}]})
    poses = driven(config, "movables", speed=0, n=50).telemetry.movables
    places = poses[:, 0, :, :2]
    assert len(np.unique(places.reshape(-1, 2), axis=0)) == 200
    for i in range(4):
        for j in range(i):
            assert np.hypot(*(places[:, i] - places[:, j]).T).min() > 0.06
    assert (np.hypot(places[..., 0], places[..., 1] - 0.1) > 0.08).all()
    np.testing.assert_array_equal(poses, driven(config, "movables", speed=0, n=50).telemetry.movables)


@pytest.mark.parametrize(
    ("arena", "reach"),
    [
        ({"shape": "circle", "size": 1.2}, lambda x, y: np.hypot(x, y) - 0.6),
        ({"shape": "rectangle", "sides": [1.6, 1.0]}, lambda x, y: np.maximum(abs(x) - 0.8, abs(y) - 0.5)),
        (
            {"shape": "polygon", "corners": [[-0.5, -0.5], [0.7, -0.5], [0, 0.7]]},
            lambda x, y: np.maximum.reduce([-0.5 - y, (1.2 * x + 0.7 * y - 0.49) / np.hypot(1.2, 0.7)]),
        ),
    ],
)
def test_robots_keep_within_arenas_of_any_shape(arena: dict[str, Any], reach: Any) -> None:
    team = {"start": "random", "start_region": [-0.2, 0.2, -0.3, -0.1], "robots": 4}
    config = config_of(30.0, arena=arena, team=team, scene={"movables": [], "goals": []})
    pose = driven(config, "pose", speed=1.0).telemetry.pose
    beyond = reach(pose[..., 0], pose[..., 1]) + 0.035
    assert beyond.max() < 0.012  # the travel of the bumper
    assert beyond.max() > 0.002  # they press


def test_robots_and_infrared_meet_obstacles() -> None:
    scene = {"movables": [], "obstacles": [{"shape": "wall", "ends": [[-0.2, 0.0], [0.2, 0.0]], "thickness": 0.02}]}
    telemetry = driven(config_of(8.0, scene=scene), "pose", "infrared").telemetry
    assert telemetry.pose[0, -1, 0, 1] == pytest.approx(-0.01 - 0.035, abs=0.006)
    assert telemetry.infrared[0, 0].max() == 0
    assert telemetry.infrared[0, -1, 0, [0, 7]].min() > 0.9

# SPDX-License-Identifier: BSD-3-Clause
"""Distances to walls, obstacles, emitters and goals: by hand, and as the library sees them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarmevo.config import Arena, Config, Goal, Movable, Surroundings, surroundings
from swarmevo.protocols import FeedForward
from swarmevo.simulation import EpisodeKey, Scene, layout, simulate

PENTAGON = ((-0.6, -0.5), (0.6, -0.5), (0.8, 0.2), (0.0, 0.8), (-0.8, 0.2))
PUCK: dict[str, Any] = {"shape": "cylinder", "size": (0.06, 0.06, 0.03), "mass": 0.02}
NORTH = np.pi / 2


@pytest.mark.parametrize(
    ("arena", "place", "distance"),
    [
        (Arena(), (0.1, -0.3), 0.2),
        (Arena(shape="rectangle", sides=(3.0, 1.0)), (1.4, 0.0), 0.1),
        (Arena(shape="circle", size=2.0), (0.3, 0.4), 0.5),
        (Arena(shape="polygon", corners=PENTAGON), (0.1, -0.4), 0.1),
        (Arena(shape="polygon", corners=PENTAGON), (0.0, 0.8), 0.0),
    ],
)
def test_the_nearest_wall(arena: Arena, place: tuple[float, float], distance: float) -> None:
    assert layout.wall_distance(arena, np.array(place)) == pytest.approx(distance, abs=1e-12)


def test_an_outline_goes_round_the_arena() -> None:
    assert layout.outline(Arena()).tolist() == [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]
    circle = layout.outline(Arena(shape="circle"))
    middles = (circle + np.roll(circle, -1, axis=0)) / 2
    assert np.hypot(*middles.T) == pytest.approx(0.5)  # it touches the circle from outside
    assert np.hypot(*circle.T).max() < 0.5003


def test_the_nearest_obstacle() -> None:
    scene = Surroundings.model_validate(
        {
            "obstacles": [
                {"size": (0.4, 0.2, 0.1), "pose": (0.0, 0.0, NORTH)},
                {"shape": "cylinder", "size": (0.2, 0.2, 0.1), "pose": (1.0, 0.0, 0.0)},
                {"shape": "wall", "ends": ((0.0, 1.0), (1.0, 1.0)), "thickness": 0.02},
            ]
        }
    )
    places = np.array([[0.05, 0.1], [0.4, 0.0], [0.7, 0.0], [0.5, 0.9], [0.0, 0.6]])
    assert layout.obstacle_distance(scene, places) == pytest.approx([0.0, 0.3, 0.2, 0.09, 0.39])
    assert layout.obstacle_distance(Surroundings(), places).tolist() == [np.inf] * 5


def test_goals_by_hand() -> None:
    box, puck = Movable(size=(0.4, 0.2, 0.03)), Movable.model_validate(PUCK)
    pose, turned = np.array([0.1, 0.2, 0.0]), np.array([0.1, 0.2, NORTH])
    north, region = Goal(wall="north"), Goal(region=(0.4, 0.6, 0.6, 0.8))
    assert layout.goal_distance(Arena(), box, north, pose) == pytest.approx(0.2)
    assert layout.goal_distance(Arena(), box, north, turned) == pytest.approx(0.1)
    assert layout.goal_distance(Arena(), puck, north, turned) == pytest.approx(0.27)
    assert layout.goal_distance(Arena(), box, region, turned) == pytest.approx(0.5)
    assert layout.goal_distance(Arena(), box, region, np.array([0.5, 0.7, 1.0])) == 0


def test_each_channel_has_signals_of_its_own() -> None:
    emitters = [
        {"channel": "light", "strength": (2.0, 900.0)},
        {"strength": (1.0, 40.0)},
        {"channel": "prey", "strength": (2.0, 90.0)},
        {"channel": "rf", "strength": (3.0, 30.0)},
    ]
    scene = Surroundings.model_validate({"emitters": emitters})
    assert scene.radio_channels == ("rf", "prey")
    assert (layout.signal_range(scene), layout.signal_scale(scene)) == ((3.0, 40.0), 40.0)
    assert (layout.signal_range(scene, 1), layout.signal_scale(scene, 1)) == ((2.0, 90.0), 90.0)
    assert [one.strength[1] for one in layout.homing_emitters(scene)] == [40.0, 30.0]
    assert all(layout.has_range(scene, one) for one in scene.emitters or ())
    heard_everywhere = Surroundings.model_validate({"emitters": [one | {"reach": "arena"} for one in emitters]})
    # Robots are home within the range of those of the first channel.
    assert [layout.has_range(heard_everywhere, one) for one in heard_everywhere.emitters or ()] == [
        False,
        True,
        False,
        True,
    ]
    nothing = Surroundings(emitters=())
    assert (layout.signal_range(nothing), layout.signal_scale(nothing)) == ((0.0, 0.0), 1.0)


def test_the_library_has_the_same_goals_and_the_same_range() -> None:
    """Five robots push a row of pucks north, the third of which carries the emitter."""
    config = Config.model_validate(
        {
            "scene": {
                "movables": [{**PUCK, "pose": (0.12 * i - 0.24, -0.3, 0.5 * i)} for i in range(5)],
                "emitters": [{"rides_on": 2, "position": (0.05, 0.0, 0.03), "range": 0.12}],
                "goals": [{"wall": "north"}, {"region": (-0.5, 0.5, -0.2, 0.0)}],
            },
            "team": {"start": "poses", "start_poses": tuple((0.12 * i - 0.24, -0.4, NORTH) for i in range(5))},
            "episode": {"horizon": 9.0},
        }
    )
    ahead = FeedForward(np.zeros((1, 1, 14)), np.full((1, 2, 2), 3.0), np.ones((1, 1), dtype=bool))
    channels = ("pose", "movables", "at_goal", "rf")
    seen = simulate(Scene(config), ahead, [EpisodeKey(1, 0, 0, 0)], channels=channels).telemetry
    scene = surroundings(config)
    came = 0
    for i, movable in enumerate(scene.movables or ()):
        poses, at_goal = seen.movables[..., i, :], seen.at_goal[..., i] > 0
        distance = np.min(
            [layout.goal_distance(config.arena, movable, goal, poses) for goal in scene.goals or ()], axis=0
        )
        assert (distance[at_goal] < 1e-3).all()
        assert (distance[~at_goal] > 0).all()
        came += bool(at_goal.any())
    assert came >= 3
    (emitter,) = scene.emitters or ()
    away = seen.pose[..., :2] - layout.emitter_places(emitter, seen.movables)[:, :, np.newaxis]
    height = config.robot.height - emitter.position[2]
    heard = np.sum(away**2, axis=-1) + height**2 <= emitter.range**2
    assert heard.any()
    assert not heard.all()
    assert ((seen.rf > 1.0) == heard).all()

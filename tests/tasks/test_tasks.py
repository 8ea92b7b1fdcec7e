# SPDX-License-Identifier: BSD-3-Clause
"""Objectives of tasks: numbers worked out by hand, and an episode that ends early held against one that does not."""

from __future__ import annotations

from math import hypot, nan, pi, sqrt
from typing import Any

import numpy as np
import pytest

from swarmevo.config import Config, load, scene_info
from swarmevo.protocols import Telemetry
from swarmevo.simulation import EpisodeKey, Scene, simulate_lockstep
from swarmevo.testing import FitnessTests, SwitchCounter
from swarmevo_tasks import geometry
from swarmevo_tasks.aggregation import Aggregation, LargestCluster
from swarmevo_tasks.coverage import Coverage
from swarmevo_tasks.delivery import Delivered, Delivery, Transport
from swarmevo_tasks.phototaxis import Arrived

PUCK = {"shape": "cylinder", "size": [0.06, 0.06, 0.03], "mass": 0.02, "pose": [0.0, -0.1, 0.0]}


def made(factory: Any, settings: Config, **options: Any) -> Any:
    return (
        factory(**options)
        if factory in (Aggregation, Arrived, LargestCluster)
        else factory(scene_info(settings), **options)
    )


def config_of(steps: int = 4, **sections: Any) -> Config:
    return Config.model_validate({"episode": {"horizon": 0.1 * steps}} | sections)


def value(factory: Any, settings: Config, push: float = nan, **channels: Any) -> float:
    """Return a fitness of one episode, whose channels are given from its steps on."""
    telemetry = telemetry_of(settings, push, **channels)
    (found,) = made(factory, settings).evaluate(telemetry, np.zeros((1, 0)), SwitchCounter())[:, 0].tolist()
    return float(found)


def shown(factory: Any, settings: Config, **channels: Any) -> dict[str, list[bool]]:
    """Return for each behaviour that a fitness knows which robots of one episode showed it."""
    found = made(factory, settings).behaviours(telemetry_of(settings, **channels))
    return {name: flags[0].tolist() for name, flags in found.items()}


def telemetry_of(settings: Config, push: float = nan, **channels: Any) -> Telemetry:
    recorded = {name: np.array([values], dtype=float) for name, values in channels.items()}
    info = scene_info(settings)
    return Telemetry(0.1, np.full((1, info.robots), nan), np.array([push]), channels=recorded, world=info.world)


@pytest.mark.parametrize("factory", [Aggregation, Arrived, LargestCluster, Coverage, Delivered, Delivery, Transport])
def test_conformance(factory: Any) -> None:
    class Tests(FitnessTests):
        def create(self) -> Any:
            return made(factory, Config())

    for name in dir(Tests):
        if name.startswith("test_"):
            getattr(Tests(), name)()


# ---- aggregation -----------------------------------------------------------------------------------------------------


def test_aggregation_is_the_distance_from_the_middle_of_the_team() -> None:
    """Two robots 0.4 m apart are 0.2 m from their middle, and the arena's corners 0.707 m."""
    apart, together = [[-0.2, 0, 0], [0.2, 0, 0]], [[0.1, 0.1, 0], [0.1, 0.1, 0]]
    settings = config_of(2, team={"robots": 2})
    assert value(Aggregation, settings, pose=[apart, apart]) == pytest.approx(1 - 0.2 / sqrt(0.5))
    assert value(Aggregation, settings, pose=[apart, together]) == pytest.approx(1 - 0.1 / sqrt(0.5))
    corners = [[-0.5, -0.5, 0], [0.5, 0.5, 0]]
    assert value(Aggregation, settings, pose=[corners]) == pytest.approx(0)


@pytest.mark.parametrize(
    ("xs", "largest"),
    [
        ([0, 0.13, 0.26, 0.39], 4),  # a chain: its ends are one cluster, though far from each other
        ([0, 0.13, 0.28, 0.41], 2),
        ([0, 0.13, 0.26, 0.41], 3),
        ([-0.4, -0.2, 0.0, 0.2], 1),
    ],
)
def test_a_cluster_is_of_robots_between_which_no_other_fits(xs: list[float], largest: int) -> None:
    """Their radius is 0.035 m: they are adjacent up to 0.14 m."""
    end = [[x, 0, 0] for x in xs]
    settings = config_of(team={"robots": 4})
    assert value(LargestCluster, settings, pose=[[[0, 0, 0]] * 4, end]) == largest / 4


def test_who_is_not_in_the_largest_cluster() -> None:
    end = [[x, 0, 0] for x in (0.26, 0.41, 0, 0.13)]
    flags = shown(LargestCluster, config_of(team={"robots": 4}), pose=[[[0, 0, 0]] * 4, end])
    assert flags == {"not in the largest cluster in the end": [False, True, False, False]}


# ---- coverage --------------------------------------------------------------------------------------------------------


def test_each_cell_counts_once_whoever_visits_it() -> None:
    """Of 100 cells all are free. Two robots in one, then one of them in another: 1 %, 2 %, 2 %."""
    settings = config_of(3, team={"robots": 2}, scene={"movables": []})
    here, there = [0.05, 0.05, 0], [0.15, 0.05, 0]
    assert value(Coverage, settings, pose=[[here, here], [here, there], [there, here]]) == pytest.approx(0.02)
    assert value(Coverage, settings, pose=[[here, [-0.5, 0.5, 0]]]) == pytest.approx(0.02)  # pressed to the corner


def test_cells_in_and_at_obstacles_are_not_free() -> None:
    """A box of 0.2 m in the middle has 4 cells; the 12 around have their middles 0.05 m from it: a robot fits."""
    box = {"size": [0.2, 0.2, 0.1]}
    settings = config_of(1, team={"robots": 1}, scene={"movables": [], "obstacles": [box]})
    assert value(Coverage, settings, pose=[[[0.3, 0.3, 0]]]) == pytest.approx(1 / 96)
    assert value(Coverage, settings, pose=[[[0.05, 0.05, 0]]]) == 0
    wider = config_of(1, team={"robots": 1}, scene={"movables": [], "obstacles": [box | {"size": [0.24, 0.2, 0.1]}]})
    assert value(Coverage, wider, pose=[[[0.3, 0.3, 0]]]) == pytest.approx(1 / 92)  # beside it none fits


@pytest.mark.parametrize("cell", [0.0, -1.0, 1e-5, nan])
def test_a_cell_that_cannot_be_is_told(cell: float) -> None:
    with pytest.raises(ValueError, match=r"^cell: expected a side"):
        Coverage(scene_info(Config()), cell)


def test_an_arena_without_a_free_cell_is_told() -> None:
    settings = config_of(scene={"movables": [], "obstacles": [{"size": [0.9, 0.9, 0.1]}]})
    with pytest.raises(ValueError, match=r"^cell: expected some that a robot can stand in, got none of 0\.5 m"):
        Coverage(scene_info(settings), 0.5)


@pytest.mark.parametrize(
    ("arena", "point", "distance"),
    [
        ({"shape": "square", "size": 1.0}, (0.3, 0.1), 0.2),
        ({"shape": "rectangle", "sides": [2.0, 1.0]}, (0.8, 0.1), 0.2),
        ({"shape": "circle", "size": 1.0}, (0.3, 0.4), 0.0),
        ({"shape": "polygon", "corners": [[0, 0], [1, 0], [0, 1]]}, (0.25, 0.25), 0.25),
        ({"shape": "polygon", "corners": [[0, 0], [1, 0], [0, 1]]}, (0.6, 0.6), -0.2 / sqrt(2)),
    ],
)
def test_clearance_of_walls(arena: dict[str, Any], point: tuple[float, float], distance: float) -> None:
    info = scene_info(config_of(arena=arena, scene={"movables": []}))
    assert geometry.clearance(info.world, np.array([point])) == pytest.approx([distance])


@pytest.mark.parametrize(
    ("obstacle", "point", "distance"),
    [
        ({"size": [0.2, 0.1, 0.1]}, (0.2, 0.0), 0.1),
        ({"size": [0.2, 0.1, 0.1], "pose": [0, 0, pi / 2]}, (0.2, 0.0), 0.15),
        ({"size": [0.2, 0.1, 0.1]}, (0.13, 0.09), 0.05),
        ({"size": [0.2, 0.1, 0.1]}, (0.0, 0.02), -0.03),
        ({"shape": "cylinder", "size": [0.2, 0.2, 0.1], "pose": [0.1, 0, 0]}, (0.1, 0.3), 0.2),
        ({"shape": "wall", "ends": [[0, 0], [0.2, 0.2]], "thickness": 0.02}, (0.2, 0.0), hypot(0.1, 0.1) - 0.01),
    ],
)
def test_clearance_of_obstacles(obstacle: dict[str, Any], point: tuple[float, float], distance: float) -> None:
    info = scene_info(config_of(scene={"movables": [], "obstacles": [obstacle]}))
    assert geometry.clearance(info.world, np.array([point])) == pytest.approx([distance])


# ---- delivery --------------------------------------------------------------------------------------------------------

TWO = {"movables": [PUCK, PUCK | {"pose": [0.2, -0.1, 0]}], "goals": [{"region": [-0.5, 0.5, 0.2, 0.5]}]}


def test_what_was_delivered_stays_so() -> None:
    """In four steps the first puck is at the goal in the second alone: half of them in three steps of four."""
    at_goal = [[0, 0], [1, 0], [0, 0], [0, 0]]
    assert value(Delivered, config_of(scene=TWO), at_goal=at_goal) == 0.5
    assert value(Delivery, config_of(scene=TWO), at_goal=at_goal) == pytest.approx(0.375)


def test_an_episode_that_ended_with_the_last_delivery_is_worth_as_much() -> None:
    at_goal = [[0, 0], [1, 0], [1, 1], [0, 0]]
    for rows in (at_goal, at_goal[:3], at_goal[:2]):
        assert value(Delivery, config_of(scene=TWO), push=0.2, at_goal=rows) == pytest.approx((0.5 + 1 + 1) / 4)
        assert value(Delivered, config_of(scene=TWO), push=0.2, at_goal=rows) == 1


def test_transport_is_the_way_that_movables_came() -> None:
    """Both have 0.3 m to go: the first comes a third nearer and goes back, the other is in the region."""
    start, end = [0.0, -0.1, 0.0], [0.2, 0.25, 0.0]
    path = [[start, end], [[0.0, 0.0, 0.0], end], [start, end]]
    settings = config_of(scene=TWO)
    assert value(Transport, settings, movables=path, at_goal=[[0, 1]] * 3) == pytest.approx((1 / 3 + 1) / 2)


@pytest.mark.parametrize(
    ("goal", "movable", "pose", "way"),
    [
        ({"wall": "north"}, {"size": [0.2, 0.1, 0.03]}, (0, 0.1, 0), 0.35),
        ({"wall": "north"}, {"size": [0.2, 0.1, 0.03]}, (0, 0.1, pi / 2), 0.3),
        ({"wall": "west"}, {"size": [0.2, 0.1, 0.03]}, (0, 0.1, pi / 2), 0.45),
        ({"wall": "east"}, PUCK, (0.1, 0.1, 1.0), 0.37),
        ({"region": [0.1, 0.2, 0.1, 0.2]}, PUCK, (0.0, 0.0, 0), hypot(0.1, 0.1)),
        ({"region": [0.1, 0.2, 0.1, 0.2]}, PUCK, (0.15, 0.4, 0), 0.2),
        ({"region": [0.1, 0.2, 0.1, 0.2]}, PUCK, (0.15, 0.15, 0), 0.0),
    ],
)
def test_the_way_to_a_goal(goal: dict[str, Any], movable: dict[str, Any], pose: tuple[float, ...], way: float) -> None:
    info = scene_info(config_of(scene={"movables": [movable], "goals": [goal]}))
    world = info.world
    (movable,) = world["scene"]["movables"]
    assert geometry.way_to_goals(world, movable, np.array([pose])) == pytest.approx([way])


@pytest.mark.parametrize("key", ["movables", "goals"])
@pytest.mark.parametrize("factory", [Delivered, Delivery, Transport])
def test_nothing_to_deliver_is_told(factory: Any, key: str) -> None:
    with pytest.raises(ValueError, match=rf"^expected a scene with {key}, got none; see scene\.{key}$"):
        factory(scene_info(config_of(scene=TWO | {key: []})))


class Ahead:
    def start(self, genomes: Any) -> None:
        pass

    def act(self, observations: Any) -> Any:
        return np.full((*observations.shape[:2], 2), 0.5)


@pytest.mark.parametrize("factory", [Delivered, Delivery, Transport])
def test_a_real_delivery(factory: Any) -> None:
    """A robot pushes a puck into the region; an episode that ends then has the same worth to the bit."""
    values = []
    for until in ("horizon", "push"):
        settings = load(
            "paper",
            [
                "team.robots=1",
                "team.start=poses",
                f"team.start_poses=[[0, -0.3, {pi / 2}]]",
                "team.start_jitter=[0, 0]",
                "scene.movables=[{shape: cylinder, size: [0.06, 0.06, 0.03], mass: 0.02, pose: [0, -0.1, 0]}]",
                "scene.goals=[{region: [-0.1, 0.1, 0.0, 0.3]}]",
                "episode.horizon=10",
                f"episode.until={until}",
            ],
        )
        scene, fitness = Scene(settings), made(factory, settings)
        done = simulate_lockstep(scene, Ahead(), np.zeros((1, 1, 0)), [EpisodeKey(1, 0, 0, 0)], fitness.channels)
        recorded = {name: array[:, : done.steps[0]] for name, array in done.telemetry.channels.items()}
        telemetry = Telemetry(0.1, done.homing_time, done.push_time, channels=recorded, world=scene.info.world)
        values.append(fitness.evaluate(telemetry, np.zeros((1, 0)), SwitchCounter()).item())
        assert fitness.terms(telemetry).keys() == {fitness.name}
    assert values[0] == values[1]
    assert 0.5 < values[0] <= 1


# ---- behaviours and arrival ------------------------------------------------------------------------------------------


def test_who_was_mostly_where_another_had_been() -> None:
    """Robot 0 goes ahead through three cells; robot 1 enters two of them later, and one that is new."""
    ways = [[(-0.35, 0), (-0.25, 0), (-0.15, 0), (-0.15, 0)], [(0.25, 0), (-0.35, 0), (-0.35, 0), (-0.25, 0)]]
    pose = [[[*ways[robot][step], 0] for robot in range(2)] for step in range(4)]
    settings = config_of(team={"robots": 2}, scene={"movables": [], "emitters": []})
    assert shown(Coverage, settings, pose=pose) == {"mostly in others' tracks": [False, True]}
    alone = [[one] for one, _ in pose]
    assert shown(Coverage, config_of(team={"robots": 1}), pose=alone) == {"mostly in others' tracks": [False]}


@pytest.mark.parametrize("enough", [0, -0.5, 1.5, nan, "most"])
def test_what_is_enough_is_a_share(enough: object) -> None:
    with pytest.raises(ValueError, match="enough: expected a share above 0 and up to 1"):
        made(Coverage, Config(), enough=enough)


def test_who_never_touched_a_movable() -> None:
    settings = config_of(2, team={"robots": 2}, scene={"movables": [PUCK], "goals": [{"wall": "north"}]})
    touch = [[[0, 0, 0, 0], [0, 0, 0, 0]], [[0, 0, 0, 0], [0, 0.5, 0, 0]]]
    assert shown(Transport, settings, touch=touch) == {"never touched a movable": [True, False]}


def test_who_arrived() -> None:
    """The emitter is at (0, 0.345); the end counts."""
    settings = config_of(2, team={"robots": 2}, scene={"movables": []})
    start, end = [[0, 0.345, 0], [0, 0, 0]], [[0.21, 0.345, 0], [0, 0.15, 0]]
    assert value(Arrived, settings, pose=[start, end]) == 0.5
    assert shown(Arrived, settings, pose=[start, end]) == {"away from the emitter in the end": [True, False]}
    assert Arrived().objectives[0].success == 1.0
    for within in (0, -1, np.inf, nan, "near"):
        with pytest.raises(ValueError, match="within: expected a distance above 0"):
            Arrived(within)  # type: ignore[arg-type]

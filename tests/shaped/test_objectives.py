# SPDX-License-Identifier: BSD-3-Clause
"""Shaped objectives: numbers worked out by hand in the default world, in turned worlds and in real episodes.

In the default world the box is 0.275 by 0.18 m at (0, 0.345), the target wall at y = 0.5: the free way is 0.065 m, the
pushing face is at y = 0.255, and a robot of radius 0.035 touches it from y = 0.218 on.
"""

from __future__ import annotations

import re
from dataclasses import replace
from math import hypot, pi, sqrt

import numpy as np
import pytest

from swarmevo import config, simulation
from swarmevo.config import Arena, Config, Emitter, Episode, Surroundings
from swarmevo.errors import ConfigError, PluginError
from swarmevo.plugins.team import Team, load_config
from swarmevo.protocols import Objective, Telemetry
from swarmevo.runs import driver
from swarmevo.testing import FitnessTests, SwitchCounter, random_telemetry
from swarmevo_shaped.geometry import free_way, robots_at_face
from swarmevo_shaped.objectives import (
    Displacement,
    Homing,
    Nearness,
    Progress,
    Speed,
    Success,
    Togetherness,
)
from swarmevo_shaped.weighted import WeightedMean

NORTH = pi / 2
BOX = (0.0, 0.345, 0.0)
AT_FACE, ELSEWHERE = (0.0, 0.22, NORTH), (0.0, -0.4, NORTH)
FACTORIES = (Togetherness, Progress, Displacement, Success, Speed, Homing, Nearness, WeightedMean)
NEVER = float("nan")


def world(steps=4, **sections):
    return config.world(Config(episode=Episode(horizon=0.1 * steps), **sections))


def episode(pose, box=BOX, push=NEVER, homing=NEVER, steps=4, **sections):
    """Return one episode: poses ``(robots, 3)`` or ``(steps, robots, 3)``, the box likewise; what is one stays."""
    pose, box = np.array(pose, dtype=float), np.array(box, dtype=float)
    return Telemetry(
        control_period=0.1,
        homing_time=np.broadcast_to(homing, (1, pose.shape[-2])).astype(float),
        push_time=np.array([push]),
        pose=np.broadcast_to(pose, (steps, *pose.shape[-2:]))[np.newaxis].copy(),
        box=np.broadcast_to(box, (steps, 3))[np.newaxis].copy(),
        world=world(steps, **sections),
    )


def value(factory, telemetry, **options):
    genomes = np.zeros((len(telemetry.push_time), 0))
    (found,) = factory(**options).evaluate(telemetry, genomes, SwitchCounter())[:, 0].tolist()
    return found


@pytest.mark.parametrize("factory", FACTORIES)
def test_conformance(factory):
    class Tests(FitnessTests):
        def create(self):
            return factory()

    for name in dir(Tests):
        if name.startswith("test_"):
            getattr(Tests(), name)()


@pytest.mark.parametrize("factory", FACTORIES)
def test_each_is_one_objective_from_0_to_1_measured_in_an_episode(factory):
    (one,) = factory().objectives
    assert (one.direction, one.range, one.of) == ("maximise", (0.0, 1.0), "episode")


# ---- togetherness ----------------------------------------------------------------------------------------------------


def test_each_robot_that_joins_counts_for_more():
    """None, one, two, three and four robots at the face: 0, 1/9, 4/9, 1 and 1; their mean is 23/45."""
    places = [(x, 0.22, NORTH) for x in (-0.12, -0.04, 0.04, 0.12)]
    poses = [[places[i] if i < n else ELSEWHERE for i in range(4)] for n in range(5)]
    telemetry = episode(poses, steps=5)
    assert Togetherness().course(telemetry)[0] == pytest.approx([0, 1 / 9, 4 / 9, 1, 1])
    assert value(Togetherness, telemetry) == pytest.approx(23 / 45)
    assert value(Togetherness, telemetry, needed=4) == pytest.approx((1 + 4 + 9 + 16) / 16 / 5)
    assert value(Togetherness, telemetry, needed=1) == pytest.approx(4 / 5)
    assert value(Togetherness, telemetry, power=1) == pytest.approx((1 / 3 + 2 / 3 + 1 + 1) / 5)


@pytest.mark.parametrize(
    ("robot", "touches"),
    [
        ((0.0, 0.2181, NORTH), True),
        ((0.0, 0.2179, NORTH), False),  # 0.1 mm farther than the box sensors see
        ((0.0, 0.2299, NORTH), True),  # its bumper is pressed in
        ((0.0, 0.26, NORTH), False),  # in the box
        ((0.137, 0.22, NORTH), True),
        ((0.138, 0.22, NORTH), False),  # past the end of the face
        ((-0.138, 0.22, NORTH), False),
        ((0.0, 0.47, -NORTH), False),  # at the face towards the wall
        ((0.172, 0.345, pi), False),  # at the short sides
        ((-0.172, 0.345, 0.0), False),
        ((0.0, 0.22, NORTH + 1.04), True),  # turned by 59.6 degrees
        ((0.0, 0.22, NORTH - 1.04), True),
        ((0.0, 0.22, NORTH + 1.05), False),  # by 60.2
        ((0.0, 0.22, -NORTH), False),
    ],
)
def test_who_touches_the_pushing_face(robot, touches):
    assert value(Togetherness, episode([robot]), needed=1) == touches


def test_a_robot_may_stand_any_way_if_told_so():
    telemetry = episode([(0.0, 0.22, -NORTH)])
    assert value(Togetherness, telemetry, needed=1, facing=179.0) == 0
    assert value(Togetherness, telemetry, needed=1, facing=180) == 1


@pytest.mark.parametrize(
    ("turned", "robot", "touches"),
    [
        (pi, (0.13, 0.22, NORTH), True),  # the other long side faces south
        (NORTH, (0.085, 0.345 - 0.1375 - 0.036, NORTH), True),  # a short side does: 0.18 long, at y = 0.2075
        (NORTH, (0.095, 0.345 - 0.1375 - 0.036, NORTH), False),
        (
            0.5,
            (0.03 * np.cos(0.5) + 0.125 * np.sin(0.5), 0.345 + 0.03 * np.sin(0.5) - 0.125 * np.cos(0.5), NORTH),
            True,
        ),
        (0.5, (0.06, 0.22, NORTH), False),
    ],
)
def test_the_pushing_face_turns_with_the_box(turned, robot, touches):
    assert value(Togetherness, episode([robot], box=(0.0, 0.345, turned)), needed=1) == touches


# ---- progress and displacement ---------------------------------------------------------------------------------------


def box_at(*y, x=0.0):
    return [(x, at, 0.0) for at in y]


def test_progress_is_a_share_of_the_free_way():
    telemetry = episode([ELSEWHERE], box_at(0.345, 0.345 + 0.0325, 0.345 + 0.052, 0.345 + 0.013))
    assert Progress().course(telemetry)[0] == pytest.approx([0, 0.5, 0.8, 0.2])
    assert value(Progress, telemetry) == pytest.approx(0.8)
    assert value(Progress, telemetry, measured="end") == pytest.approx(0.2)


def test_progress_is_of_the_corner_nearest_to_the_wall():
    """Turned by 45 degrees the box reaches 0.455 / sqrt(8) ahead of its centre, not 0.09."""
    telemetry = episode([ELSEWHERE], [(0, 0.345, 0), (0, 0.3, pi / 4), (0, 0.3, -pi / 4), (0, 0.3, 3 * pi / 4)])
    expected = (0.3 + 0.455 / sqrt(8) - 0.345 - 0.09) / 0.065
    assert Progress().course(telemetry)[0] == pytest.approx([0, expected, expected, expected])


def test_progress_backwards_is_none():
    assert value(Progress, episode([ELSEWHERE], box_at(0.345, 0.2, 0.1, 0.0)), measured="end") == 0


def test_displacement_is_the_farthest_in_any_direction():
    telemetry = episode([ELSEWHERE], [(0, 0.345, 0), (0.0195, 0.319, 0), (0.0, 0.338, 0), (0, 0.345, 1.0)])
    assert value(Displacement, telemetry) == pytest.approx(hypot(0.0195, 0.026) / 0.065)
    assert value(Displacement, episode([ELSEWHERE], [(0, 0.345, 0), (0.4, 0.2, 0)] * 2)) == 1
    assert value(Displacement, episode([ELSEWHERE])) == 0


# ---- success, speed, homing, nearness --------------------------------------------------------------------------------


def test_speed_is_the_share_of_the_horizon_that_was_left():
    assert value(Speed, episode([ELSEWHERE], push=0.1)) == 0.75
    assert value(Speed, episode([ELSEWHERE], push=0.4)) == 0
    assert value(Speed, episode([ELSEWHERE])) == 0
    assert [value(Success, episode([ELSEWHERE], push=time)) for time in (0.4, NEVER)] == [1, 0]


def test_homing_is_a_share_of_the_robots():
    assert value(Homing, episode([ELSEWHERE] * 4, homing=[0.3, NEVER, 0.0, NEVER])) == 0.5


def test_nearness_is_1_at_the_emitter_and_0_in_the_farthest_corner():
    """Of two robots, over four steps, one at the emitter in the first half: 1/4. The corner is 0.982 m away."""
    emitter, corner = (0.0, 0.345, 1.0), (0.5, -0.5, 0.0)
    telemetry = episode([[emitter, corner]] * 2 + [[corner, corner]] * 2)
    assert value(Nearness, telemetry) == pytest.approx(0.25)
    half_way = episode([(0.25, (0.345 - 0.5) / 2, 0.0)])
    assert value(Nearness, half_way) == pytest.approx(0.5)


# ---- any world, any end ----------------------------------------------------------------------------------------------


def random_episodes(walls_turned: int) -> Telemetry:
    """Return twenty episodes at the box, in the default world turned counter-clockwise by so many quarters."""
    rng = np.random.default_rng(0)
    shape = (20, 30)
    box = np.stack([rng.uniform(low, high, shape) for low, high in ((-0.1, 0.1), (0.3, 0.37), (-pi, pi))], axis=-1)
    pose = box[..., np.newaxis, :] + rng.uniform((-0.2, -0.2, -pi), (0.2, 0.2, pi), (*shape, 5, 3))
    emitter = np.array([[0.05, 0.345, 0.0]])
    quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
    turn = np.linalg.matrix_power(quarter, walls_turned)
    for places in (box, pose, emitter):
        places[..., :2] = places[..., :2] @ turn.T
        places[..., 2] += walls_turned * pi / 2
    return Telemetry(
        0.1,
        homing_time=np.where(rng.random((20, 5)) < 0.5, NEVER, 1.0),
        push_time=np.where(np.arange(20) % 3 == 0, 0.1 * np.arange(20), NEVER),
        pose=pose,
        box=box,
        world=world(
            30,
            arena=Arena(target_wall=("north", "west", "south", "east")[walls_turned]),
            emitter=Emitter(position=(*emitter[0, :2].tolist(), 0.03)),
        ),
    )


def values(fitness, telemetry):
    return fitness.evaluate(telemetry, np.zeros((len(telemetry.push_time), 0)), SwitchCounter())[:, 0]


def test_a_turned_world_has_the_same_values():
    straight = random_episodes(0)
    counts = robots_at_face(straight, pi / 3)
    assert set(np.unique(counts)) >= {0, 1, 2}
    for quarters in (1, 2, 3):
        turned = random_episodes(quarters)
        assert np.array_equal(robots_at_face(turned, pi / 3), counts)
        assert free_way(turned) == pytest.approx(free_way(straight), abs=1e-12)
        for factory in FACTORIES:
            assert values(factory(), turned) == pytest.approx(values(factory(), straight), abs=1e-12)


@pytest.mark.parametrize(
    "fitness", [*(factory() for factory in FACTORIES), Progress("end")], ids=lambda fitness: type(fitness).__name__
)
def test_an_episode_that_ends_at_the_push_has_the_same_value(fitness):
    whole, seen = random_episodes(0), 0
    for i in np.flatnonzero(np.isfinite(whole.push_time)):
        end = max(1, round(float(whole.push_time[i]) / 0.1))
        alone = replace(
            whole,
            homing_time=whole.homing_time[i : i + 1],
            push_time=whole.push_time[i : i + 1],
            channels={name: channel[i : i + 1] for name, channel in whole.channels.items()},
        )
        cut = replace(alone, channels={name: channel[:, :end] for name, channel in alone.channels.items()})
        assert values(fitness, cut).tolist() == values(fitness, alone).tolist()
        seen += 1
    assert seen == 7


@pytest.mark.parametrize("factory", FACTORIES)
def test_the_best_is_1_and_the_worst_0(factory):
    corner, emitter = (0.5, -0.5, 0.0), Emitter(position=(*AT_FACE[:2], 0.03))
    assert value(factory, episode([AT_FACE] * 3, push=0.0, emitter=emitter)) == pytest.approx(1.0, abs=1e-15)
    assert value(factory, episode([corner])) == pytest.approx(0.0, abs=1e-15)


def test_togetherness_and_nearness_stay_as_they_were_in_the_last_second_before_the_push():
    """One robot, ten steps away and fifteen at the face, of whose last ten steps all count; away again after it."""
    poses = [[ELSEWHERE]] * 10 + [[AT_FACE]] * 15 + [[ELSEWHERE]] * 25
    assert value(Togetherness, episode(poses, push=2.5, steps=50), needed=1) == pytest.approx(40 / 50)
    assert value(Togetherness, episode(poses, push=1.5, steps=50), needed=1) == pytest.approx((5 + 35 * 0.5) / 50)
    assert value(Togetherness, episode(poses, push=0.5, steps=50), needed=1) == 0
    emitter, corner = [(0.0, 0.345, 0.0)], [(0.5, -0.5, 0.0)]
    assert value(Nearness, episode([emitter] * 5 + [corner] * 35, push=1.5, steps=40)) == pytest.approx(5 / 40)


def test_who_pushes_backwards_is_not_together():
    telemetry = episode([(x, 0.22, -NORTH) for x in (-0.1, 0.0, 0.1)], push=0.1)
    assert value(Togetherness, telemetry) == 0
    assert value(Togetherness, telemetry, facing=180) == 1


@pytest.mark.parametrize("factory", [Togetherness, Progress, Displacement, Speed, Nearness])
def test_without_a_world_there_is_one_clear_line(factory):
    telemetry = replace(random_telemetry(factory.channels, 1), world={})
    with pytest.raises(ValueError, match=r"^telemetry\.world: expected the world of the episodes, got none; give it"):
        value(factory, telemetry)


# ---- real episodes ---------------------------------------------------------------------------------------------------

PUSHING = {
    "team": {
        "robots": 3,
        "start": "poses",
        "start_poses": [[-0.1, 0.15, NORTH], [0.0, 0.1, NORTH], [0.1, 0.05, NORTH]],
    },
    "noise": {"infrared": 0, "infrared_at_contact": 0, "wheels": 0.05},
    "controller": {"feedforward": {"hidden": 1}},
    "fitness": ["togetherness", "progress", "success", "speed", "homing", "nearness", "displacement", "shaped"],
    "episode": {"horizon": 30.0},
}


def judged(settings, channels=None):
    """Return a team that drives straight ahead, its episodes, and what it is worth in them."""
    team = Team(Config.model_validate(settings))
    genomes = np.zeros((2, team.space.size))
    team.space.split(genomes)["hidden_output"][..., -1] = 5.0
    keys = [simulation.EpisodeKey(1, 0, 0, repeat) for repeat in range(2)]
    done = team.simulate(genomes, keys, channels)
    names = [objective.name for objective in team.objectives]
    return done, [dict(zip(names, team.judge(done, genomes, i), strict=True)) for i in range(2)]


def test_three_robots_that_push_together():
    done, found = judged(PUSHING)
    assert np.isfinite(done.push_time).all()
    for one, time in zip(found, done.push_time, strict=True):
        assert (one["success"], one["progress"], one["homing"]) == (1, 1, 1)
        assert one["speed"] == pytest.approx(1 - time / 30)
        assert one["togetherness"] > 0.7
        assert 0.85 < one["shaped"] < 1


def test_a_real_episode_that_ends_at_the_push_has_the_same_values():
    whole, cut = (judged(PUSHING | {"episode": {"horizon": 30.0, "until": until}}) for until in ("horizon", "push"))
    assert (cut[0].steps < whole[0].steps).all()
    assert cut[1] == whole[1]


def test_two_robots_do_not_get_far():
    poses = PUSHING["team"]["start_poses"][::2]
    _, found = judged(PUSHING | {"team": {"robots": 2, "start": "poses", "start_poses": poses}})
    for one in found:
        assert one["success"] == one["speed"] == 0
        assert 0 <= one["progress"] <= one["displacement"] < 0.2
        assert 0.35 < one["togetherness"] < 4 / 9


def test_who_touches_is_who_feels_the_box():
    """At the pushing face, all robots ahead, the box sensors answer exactly where geometry says so."""
    done, _ = judged(PUSHING, channels=["pose", "box", "touch"])
    telemetry = replace(done.telemetry, world=config.world(Config.model_validate(PUSHING)))
    before = int(done.push_time.min() / 0.1)
    felt = (telemetry.touch.max(axis=-1) > 0).sum(axis=-1)[:, :before]
    assert set(np.unique(felt)) == {0, 1, 2, 3}
    assert np.array_equal(robots_at_face(telemetry, pi / 3)[:, :before], felt)


# ---- options ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("factory", "options", "message"),
    [
        (Togetherness, {"needed": 0}, "needed: expected a whole number from 1 to 64, got 0"),
        (Togetherness, {"needed": 2.0}, "needed: expected a whole number from 1 to 64, got 2.0"),
        (Togetherness, {"power": 0}, "power: expected a number above 0 and up to 10, got 0"),
        (Togetherness, {"facing": 181}, "facing: expected a number from 0 to 180, got 181"),
        (Togetherness, {"facing": float("nan")}, "facing: expected a number from 0 to 180, got nan"),
        (Progress, {"measured": "last"}, "measured: expected one of most, end, got 'last'"),
    ],
)
def test_wrong_options_are_one_clear_line(factory, options, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        factory(**options)


def test_names():
    assert Speed().objectives == (Objective("speed", "maximise", (0.0, 1.0)),)
    names = [factory().objectives[0].name for factory in FACTORIES]
    assert names == ["togetherness", "progress", "displacement", "success", "speed", "homing", "nearness", "shaped"]


# ---- other scenes ----------------------------------------------------------------------------------------------------

PUCK = {"shape": "cylinder", "size": (0.06, 0.06, 0.03)}


@pytest.mark.parametrize(
    ("scene", "found"),
    [
        ({"movables": [], "goals": []}, "0 movables and no goal"),
        ({"movables": [PUCK]}, "a cylinder and a wall"),
        ({"goals": [{"region": (0, 0.1, 0, 0.1)}]}, "a box and a region"),
        ({"movables": [{}, {}]}, "2 movables and a wall"),
    ],
)
@pytest.mark.parametrize("factory", [Togetherness, Progress, Displacement])
def test_what_needs_one_box_and_one_wall_says_so(factory, scene, found):
    told = episode([ELSEWHERE], scene=Surroundings.model_validate(scene))
    with pytest.raises(ValueError, match=f"scene: expected one box and one wall to push it to, got {found}; success"):
        value(factory, told)


def test_nearness_needs_an_emitter_that_stands_still():
    for emitters, found in (([], "0"), ([{"rides_on": 0}], "one that rides")):
        told = episode([ELSEWHERE], scene=Surroundings.model_validate({"emitters": emitters}))
        with pytest.raises(ValueError, match=f"scene.emitters: expected one that stands still, got {found}"):
            value(Nearness, told)


@pytest.mark.parametrize(
    ("fitness", "scene", "line"),
    [
        ("togetherness", "{movables: []}", "togetherness: scene: expected one box and one wall to push it to, got"),
        (
            "progress",
            "{goals: []}",
            "progress: scene: expected one box and one wall to push it to, got a box and no goal",
        ),
        (
            "displacement",
            "{movables: [{}, {pose: [0, 0, 0]}]}",
            "displacement: scene: expected one box and one wall to push it to, got 2",
        ),
        ("success", "{goals: []}", "success: expected a scene with goals, got none; see scene.goals"),
        ("speed", "{movables: []}", "speed: expected a scene with movables, got none; see scene.movables"),
        ("homing", "{emitters: []}", "homing: scene.emitters: expected one to home in on, got none"),
        ("homing", "{emitters: [{channel: light}]}", "homing: scene.emitters: expected one to home in on, got lights"),
        ("nearness", "{emitters: []}", "nearness: scene.emitters: expected one that stands still, got 0"),
        ("shaped", "{movables: []}", "shaped: togetherness: scene: expected one box and one wall to push it to, got 0"),
        ("arrived", "{emitters: []}", "arrived: scene.emitters: expected one that stands still, got 0"),
        ("transport", "{goals: []}", "transport: expected a scene with goals, got none; see scene.goals"),
        ("box_pushing", "{emitters: []}", "box_pushing: scene.emitters: expected one to home in on, got none"),
    ],
)
def test_what_does_not_fit_its_scene_is_refused_when_it_is_loaded(fitness, scene, line):
    with pytest.raises(ConfigError) as raised:
        load_config("quick", [f"scene={scene}", f"fitness={fitness}"])
    assert len(raised.value.errors) == 1
    assert raised.value.errors[0].startswith(f"fitness.{line}")


def test_what_has_no_weight_needs_nothing():
    weights = "{togetherness: 0, success: 0, nearness: 1}"
    assert Team(load_config("quick", ["scene={movables: []}", f"fitness={{shaped: {weights}}}"])).channels == ["pose"]


def test_a_world_that_does_not_fit_is_refused_before_a_run_is_made(tmp_path):
    settings = load_config("quick", ["worlds=[{}, {scene.goals: []}]", "fitness=success", "evolution.seed=1"])
    with pytest.raises(PluginError, match="expected a scene with goals, got none"):
        driver.begin(tmp_path / "run", settings)
    assert not (tmp_path / "run").exists()


def test_the_box_the_wall_and_the_arena_are_those_of_the_scene():
    scene = Surroundings.model_validate({"movables": [{"size": (0.1, 0.1, 0.03)}], "goals": [{"wall": "east"}]})
    told = episode([ELSEWHERE], (0.2, 0.0, 0.0), arena=Arena(shape="rectangle", sides=(3.0, 1.0)), scene=scene)
    assert free_way(told)[0, 0] == pytest.approx(1.5 - 0.05 - 0.2)

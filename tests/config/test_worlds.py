# SPDX-License-Identifier: BSD-3-Clause
"""``worlds`` and ``vary``: what is accepted, what is drawn, what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from swarmevo import config
from swarmevo.config import Config, Worlds
from swarmevo.errors import ConfigError
from swarmevo.plugins.team import load_config

THREE_AND_FIVE = "worlds=[{team.robots: 3}, {team.robots: 5, weight: -2}]"


def test_a_configuration_without_worlds_has_one() -> None:
    worlds = Worlds(Config())
    assert [world.config for world in worlds] == [Config()]
    assert worlds.of_episode(1, 0, 0, 7) == Config()


def test_episodes_go_round_the_worlds() -> None:
    worlds = Worlds(load_config("paper", [THREE_AND_FIVE]))
    assert [world.weight for world in worlds] == [1, -2]
    assert [worlds.of_episode(1, 0, 0, repeat).team.robots for repeat in range(4)] == [3, 5, 3, 5]


def test_it_is_written_and_read_again() -> None:
    chosen = load_config("paper", [THREE_AND_FIVE, "vary.box.mass={uniform: [0.2, 0.28]}"])
    assert Config.model_validate_json(chosen.model_dump_json()) == chosen
    assert chosen.vary == {"box.mass": {"uniform": [0.2, 0.28]}}


def test_what_varies_is_drawn_anew_in_each_episode_and_the_same_for_the_same_episode() -> None:
    worlds = Worlds(load_config("paper", ["vary={box.mass: {uniform: [0.2, 0.28]}}"]))
    keys = [(seed, trial, generation, repeat) for seed in (1, 2) for trial in (0, 1) for generation in range(50)
            for repeat in range(3)]  # fmt: skip
    masses = [worlds.of_episode(*key).box.mass for key in keys]
    assert masses == [worlds.of_episode(*key).box.mass for key in reversed(keys)][::-1]
    assert len(set(masses)) == len(masses) == 600
    assert 0.2 <= min(masses) < 0.202
    assert 0.278 < max(masses) <= 0.28
    # The mean of 600 uniform draws is normal with a spread of 0.08 / sqrt(12 * 600).
    assert np.mean(masses) == pytest.approx(0.24, abs=4 * 0.08 / math.sqrt(12 * 600))


def test_each_kind_of_draw_gives_what_the_key_takes() -> None:
    worlds = Worlds(
        load_config(
            "paper",
            [
                "vary={team.robots: {uniform: [3, 5]}, box.pose: {uniform: [[-0.1, 0.3, 0], [0.1, 0.34, 0]]},"
                " box.mass: {normal: [0.24, 0.01]}, team.start: {choice: [row, random]}, noise.rf: {choice: [0, 0.1]}}"
            ],
        )
    )
    seen = [worlds.of_episode(1, 0, generation, 0) for generation in range(300)]
    robots = [one.team.robots for one in seen]
    assert {type(n) for n in robots} == {int}
    assert set(robots) == {3, 4, 5}
    assert min(robots.count(n) for n in (3, 4, 5)) > 70  # of 100 expected, with a spread of 8
    poses = np.array([one.box.pose for one in seen])
    assert np.all((poses >= [-0.1, 0.3, 0]) & (poses <= [0.1, 0.34, 0]))
    assert abs(np.corrcoef(poses[:, 0], poses[:, 1])[0, 1]) < 0.25  # each drawn on its own
    masses = np.array([one.box.mass for one in seen])
    assert np.all(np.abs(masses - 0.24) <= 0.03)  # cut off at three spreads
    assert np.std(masses) == pytest.approx(0.01, rel=0.15)
    assert {one.team.start for one in seen} == {"row", "random"}
    assert {one.noise.rf for one in seen} == {0.0, 0.1}
    assert all(Config.model_validate_json(one.model_dump_json()) == one for one in seen[:20])


WRONG = {
    "worlds=3": "worlds: expected a list of worlds, each {section.key: value}, got 3",
    "worlds=[3]": "worlds: expected a list of worlds, each {section.key: value}, got [3]",
    "vary=3": "vary: expected {section.key: {uniform: [low, high]}}, got 3",
    "worlds=[{team.robotz: 3}]": "worlds[0].team.robotz: expected a key of the world; did you mean team.robots?",
    "worlds=[{evolution.repeats: 3}]": "worlds[0].evolution.repeats: expected a key of the world; it is section.key",
    "worlds=[{team.robots: 300}]": "worlds[0].team.robots: expected a whole number from 1 to 64, got 300",
    "worlds=[{}, {team.robots: 3, weight: 0}]": "worlds[1].weight: expected a number other than 0",
    "worlds=[{weight: heavy}]": "worlds[0].weight: expected a number other than 0",
    "worlds=[{team.genomes: individual}]": "worlds[0].team.genomes: expected another key",
    "worlds=[{episode.control_period: 0.2}]": "worlds[0].episode.control_period: expected another key",
    "worlds=[{box.pose: [9, 0, 0]}]": "worlds[0]: box.pose: ",
    "vary.box=3": "vary: expected {section.key: ",
    "vary={box.mass: {uniform: [0.3, 0.2]}}": "vary.box.mass.uniform: expected the low end first, got [0.3, 0.2]",
    "vary={box.mass: {unifrom: [0.2, 0.3]}}": "vary.box.mass: expected one of {uniform: [...]}, {normal: [...]}",
    "vary={box.mass: {uniform: [0.2]}}": "vary.box.mass.uniform: expected [low, high], got [0.2]",
    "vary={box.mass: {uniform: [0.2, a]}}": "vary.box.mass.uniform: expected a number for each of the two",
    "vary={box.mass: {normal: [0.2, 0.1]}}": "vary.box.mass: expected a number from 0.001 to 1000 [kg], got -0.1",
    "vary={box.mass: {normal: [0.2, -0.1]}}": "vary.box.mass.normal: expected a standard deviation of at least 0",
    "vary={box.pose: {uniform: [0, 1]}}": "vary.box.pose.uniform: expected a list of 3 numbers for each of the two",
    "vary={team.start: {uniform: [0, 1]}}": "vary.team.start.uniform: expected a key with numbers; draw it by choice",
    "vary={team.start: {choice: [row, heap]}}": "vary.team.start: expected one of row, poses, random, got 'heap'",
    "vary={team.start: {choice: []}}": "vary.team.start.choice: expected a list of values, got []",
    "vary={team.robots: {uniform: [3, 50]}}": "vary.team.robots at 50: team.start_poses[44]: ",
    "vary={scene.movables.0.mass: {uniform: [0.2, 0.3]}}": "vary.scene.movables.0.mass: expected an entry of "
    "scene.movables, which names nothing here; name it whole",
    "vary={box.pose.3: {uniform: [0, 1]}}": "vary.box.pose.3: expected an entry of box.pose, 0 to 2, got 3",
    "vary={box.pose.x: {uniform: [0, 1]}}": "vary.box.pose.x: expected an entry of box.pose, 0 to 2, got x",
    "vary={box.mass.0: {uniform: [0, 1]}}": "vary.box.mass.0: expected box.mass alone, which is 0.24 and has",
    "vary={team.start_poses.0: {choice: [0]}}": "vary.team.start_poses.0: expected an entry of "
    "team.start_poses, which has none, got 0",
    "vary={'box.pose[0]': {uniform: [0, 1]}}": "vary.box.pose[0]: expected a key of the world; write "
    "an entry of a list as box.pose.0",
    "vary={box.pose: {choice: [[0, 0.3, 0]]}, box.pose.0: {uniform: [0, 0.1]}}": "vary.box.pose.0: expected it "
    "alone or in what is drawn whole, got both",
    "vary={box.pose: {choice: [here]}}": "vary.box.pose: expected a list of 3 numbers from -100",
    "vary={box.pose: {uniform: [[0, [1], 0], [1, 1, 1]]}}": "vary.box.pose.uniform: expected a list of 3 numbers",
    "vary={box.pose: {uniform: [[0, '1', 0], [1, 1, 1]]}}": "vary.box.pose.uniform: expected a list of 3 numbers",
    "vary={team.robots: {choice: [few]}}": "vary.team.robots: expected a whole number from 1 to 64, got 'few'",
    "vary={robot.sensors.0: {choice: [ground]}}": "vary.robot.sensors.0: expected another key; a controller",
    "vary={sensors.infrared_yaw_deg: {choice: [[0, 10]]}}": "vary.sensors.infrared_yaw_deg at (0.0, 10.0): "
    "robot.sensors: expected the observations and commands that the controller was made for",
    "evolution.over_worlds=best": "evolution.over_worlds: expected one of mean, worst, quantile, got 'best'",
}


@pytest.mark.parametrize(("override", "error"), WRONG.items())
def test_a_wrong_entry_is_one_clear_line(override: str, error: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load_config("paper", [override])
    assert caught.value.errors[0].startswith(error)


def test_robots_with_genomes_of_their_own_are_as_many_in_all_worlds() -> None:
    with pytest.raises(ConfigError, match=r"each robot has a genome of its own"):
        load_config("paper", ["team.genomes=individual", THREE_AND_FIVE])


def test_a_key_is_not_both_fixed_and_varied() -> None:
    with pytest.raises(ConfigError, match=r"worlds\[0\]\.box\.mass: expected it here or in vary, got both"):
        load_config("paper", ["worlds=[{box.mass: 0.3}]", "vary={box.mass: {uniform: [0.2, 0.3]}}"])


TWO_PUCKS = "scene.movables=[{pose: [0, 0.1, 0]}, {shape: cylinder, size: [0.1, 0.1, 0.03]}]"


def test_entries_of_lists_are_drawn_each_on_its_own() -> None:
    drawn = "vary={scene.movables.0.mass: {uniform: [0.2, 0.3]}, scene.movables.1.pose.0: {normal: [0, 0.05]}}"
    worlds = Worlds(load_config("paper", [TWO_PUCKS, drawn, "worlds=[{}, {scene.movables.1.mass: 0.5}]"]))
    seen = [worlds.of_episode(1, 0, 0, repeat) for repeat in range(100)]
    masses = [one.scene.movables[0].mass for one in seen if one.scene.movables]
    places = [one.scene.movables[1].pose for one in seen if one.scene.movables]
    assert len(set(masses)) == len({x for x, _, _ in places}) == 100
    assert 0.2 <= min(masses) < 0.21 < 0.29 < max(masses) <= 0.3
    assert {(y, heading) for _, y, heading in places} == {(0.345, 0.0)}
    assert [one.scene.movables[1].mass for one in seen[:4] if one.scene.movables] == [0.24, 0.5, 0.24, 0.5]
    assert all(Config.model_validate_json(one.model_dump_json()) == one for one in seen[:20])


def test_a_world_that_cannot_be_is_drawn_again() -> None:
    worlds = Worlds(load_config("paper", ["vary={box.mass: {uniform: [0.2, 0.3]}}"]))

    def errors(config: Config) -> list[str]:
        return [f"box.mass: expected at least 0.27, got {config.box.mass:g}"] * (config.box.mass < 0.27)

    first = [worlds.of_episode(1, 0, 0, repeat).box.mass for repeat in range(200)]
    drawn = [worlds.of_episode(1, 0, 0, repeat, errors).box.mass for repeat in range(200)]
    assert drawn == [worlds.of_episode(1, 0, 0, repeat, errors).box.mass for repeat in range(200)]
    assert all(new == old if old >= 0.27 else new >= 0.27 for new, old in zip(drawn, first, strict=True))
    assert np.mean(drawn) == pytest.approx(0.285, abs=3 * 0.03 / np.sqrt(12 * 200))
    with pytest.raises(ConfigError, match=r"^vary: expected a world that can be among 1000 draws for .*: it is red$"):
        worlds.of_episode(1, 0, 0, 0, lambda _config: ["it is red"])


def test_whole_lists_of_sections_are_chosen() -> None:
    drawn = "vary={scene.movables: {choice: [[{}], [{pose: [0, 0.1, 0]}, {mass: 0.3}]]}}"
    worlds = Worlds(load_config("paper", [drawn]))
    seen = [worlds.of_episode(1, 0, 0, repeat).scene.movables or () for repeat in range(20)]
    assert {len(movables) for movables in seen} == {1, 2}
    assert {movables[-1].mass for movables in seen} == {0.24, 0.3}


@pytest.mark.parametrize(
    ("world", "error"),
    [
        (
            "scene.movables: [{}]",
            "worlds[1]: vary.scene.movables.1.mass: expected an entry of scene.movables, 0 to 0, got 1",
        ),
        ("scene.movables.1.mass: 0.5", "worlds[1].scene.movables.1.mass: expected it here or in vary, got both"),
    ],
)
def test_an_entry_that_varies_is_in_all_worlds(world: str, error: str) -> None:
    drawn = "vary={scene.movables.1.mass: {uniform: [0.1, 0.3]}}"
    with pytest.raises(ConfigError) as caught:
        load_config("paper", [TWO_PUCKS, drawn, f"worlds=[{{}}, {{{world}}}]"])
    assert caught.value.errors == (error,)


def test_a_named_world_changes_no_other_key() -> None:
    (world,) = Worlds(load_config("paper", ["worlds=[{box.mass: 0.3}]"]))
    assert world.config == config.load("paper", ["box.mass=0.3"])

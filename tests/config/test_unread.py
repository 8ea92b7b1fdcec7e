# SPDX-License-Identifier: BSD-3-Clause
"""A key that is given and that nothing reads is refused: an experiment that varies nothing would look like one."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmevo import config
from swarmevo.errors import ConfigError
from swarmevo.plugins.team import load_config

MOVABLES = "scene.movables=[{mass: 0.2, friction: 0.5}]"
FITNESS = "fitness=[aggregation]"
IDLE = {
    "box.mass": ([MOVABLES, "box.mass=0.3"], "box.mass", "scene.movables stands in the place of the box"),
    "box": ([MOVABLES, "box={mass: 0.3}"], "box", "scene.movables stands in the place of the box"),
    "friction": (
        [MOVABLES, "physics.box_friction=0.3"],
        "physics.box_friction",
        "each movable has a friction",
    ),
    "emitter": (["scene.emitters=[{}]", "emitter.range=0.1"], "emitter.range", "scene.emitters stands in"),
    "wall": (["scene.goals=[]", "arena.target_wall=south"], "arena.target_wall", "scene.goals stands in"),
    "circle": (
        ["arena.shape=circle", "arena.size=1.6", "arena.target_wall=south"],
        "arena.target_wall",
        "a circle has no such wall",
    ),
    "sides": (["arena.sides=[3, 2]"], "arena.sides", "arena.shape is square"),
    "size": (["arena.shape=rectangle", "arena.sides=[2, 2]", "arena.size=3"], "arena.size", "arena.shape is rectangle"),
    "region": (["team.start_region=[0, 0.1, 0, 0.1]"], "team.start_region", "team.start is row"),
    "poses": (["team.start_poses=[[0, 0, 0]]"], "team.start_poses", "team.start is row"),
    "row": (["team.start=random", "team.row_y=0.1"], "team.row_y", "team.start is random"),
    "worlds": (
        [MOVABLES, "worlds=[{team.robots: 3}, {box.mass: 0.5}]"],
        r"worlds\[1\]\.box\.mass",
        "scene.movables stands in the place of the box",
    ),
    "vary": (
        [MOVABLES, "vary={box.mass: {uniform: [0.2, 0.28]}}"],
        r"vary\.box\.mass",
        "scene.movables stands in the place of the box",
    ),
}


@pytest.mark.parametrize("case", IDLE)
def test_a_key_that_nothing_reads_is_refused(case: str) -> None:
    overrides, key, why = IDLE[case]
    with pytest.raises(ConfigError, match=rf"^{key}: expected another key; nothing reads it, for {why}"):
        load_config("paper", [*overrides, FITNESS])


READ = {
    "in one of the worlds": ["worlds=[{}, {team.start: random}]", "team.start_region=[-0.3, 0.3, -0.3, 0]"],
    "drawn in one of the worlds": ["worlds=[{scene.movables: []}, {}]", "vary={box.mass: {uniform: [0.2, 0.28]}}"],
    "the box": ["box.mass=0.3", "box.start=random", "box.start_region=[-0.1, 0.1, 0, 0.1]"],
    "friction": ["scene.movables=[{}, {friction: 0.2, pose: [0, 0, 0]}]", "physics.box_friction=0.3"],
}


@pytest.mark.parametrize("case", READ)
def test_a_key_that_a_world_reads_is_taken(case: str) -> None:
    load_config("paper", [*READ[case], FITNESS])


ENTRIES = {
    "scene: {obstacles: [{ends: [[-0.3, 0.1], [-0.1, 0.3]]}]}": "scene.obstacles.0.ends: .*obstacles.0.shape is box",
    "scene: {obstacles: [{thickness: 0.05}]}": "scene.obstacles.0.thickness: .*obstacles.0.shape is box",
    "scene: {obstacles: [{shape: wall, ends: [[-0.2, 0], [0, 0]], pose: [0.1, 0, 0]}]}": "scene.obstacles.0.pose: .*",
    "scene: {movables: [{start_region: [0, 0.1, 0, 0.1]}]}": "scene.movables.0.start_region: .*start is pose",
    "arena: {sides: [3, 2]}": "arena.sides: .*arena.shape is square",
    "arena: {shape: rectangle, sides: [2, 2], size: 3}": "arena.size: .*arena.shape is rectangle",
}


@pytest.mark.parametrize("text", ENTRIES)
def test_a_file_names_nothing_in_vain(text: str, tmp_path: Path) -> None:
    file = tmp_path / "one.yaml"
    file.write_text(f"{text}\nfitness: [aggregation]\n")
    with pytest.raises(ConfigError, match=f"^{ENTRIES[text]}$"):
        load_config(file)


def test_a_run_writes_what_can_be_read_again(tmp_path: Path) -> None:
    """Every key, those of the box beside scene.movables, too."""
    file = tmp_path / "dumped.yaml"
    file.write_text(config.dump(load_config("paper", [MOVABLES, FITNESS])))
    assert load_config(file) == load_config("paper", [MOVABLES, FITNESS])

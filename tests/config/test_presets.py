# SPDX-License-Identifier: BSD-3-Clause
"""Robots by name."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from swarmevo.config import Config, ConfigError, Robot, changed, dump, load
from swarmevo.config.presets import PRESETS
from swarmevo.protocols import FeedForward
from swarmevo.simulation import EpisodeKey, Scene, simulate


def test_the_default_robot_is_the_papers() -> None:
    assert Config() == Config.model_validate({"robot": {"preset": "epuck"}})
    assert Config().robot.mass == 0.08


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_has_its_values_and_runs(name: str) -> None:
    config = load("paper", [f"robot.preset={name}", "episode.horizon=30"])
    for section, values in PRESETS[name].items():
        plain = getattr(config, section).model_dump(mode="json")
        assert {key: plain[key] for key in values} == values
    scene, rng = Scene(config), np.random.default_rng(1)
    inputs, n = scene.info.observations, 6
    networks = FeedForward(
        rng.normal(size=(n, 5, inputs + 1)), 2 * rng.normal(size=(n, 2, 6)), np.ones((n, 5), dtype=bool)
    )
    done = simulate(scene, networks, [EpisodeKey(1, 0, 0, i) for i in range(n)])
    assert not done.status.any(), done.messages
    assert done.unsolved_steps.sum() == 0
    assert done.max_penetration.max() < 0.001


def test_a_named_key_wins_over_the_preset() -> None:
    config = load("paper", ["robot.preset=thymio_ii", "robot.mass=0.3"])
    assert (config.robot.mass, config.robot.radius, len(config.sensors.infrared_yaw_deg)) == (0.3, 0.056, 7)


def test_a_stored_configuration_is_as_it_was_and_may_be_given_another_robot(tmp_path) -> None:
    config = load("paper", ["robot.preset=khepera_iv", "robot.mass=0.6", "noise.wheels=0.1"])
    (tmp_path / "config.yaml").write_text(dump(config))
    assert load(tmp_path / "config.yaml") == config
    for other in (changed(config, ["robot.preset=epuck"]), load(tmp_path / "config.yaml", ["robot.preset=epuck"])):
        assert other == load("paper", ["robot.mass=0.6", "noise.wheels=0.1"])


def test_a_preset_in_python() -> None:
    assert Config(robot=Robot(preset="thymio_ii")) == Config.model_validate({"robot": {"preset": "thymio_ii"}})
    assert Config(robot=Robot(preset="thymio_ii", mass=0.5)).robot.mass == 0.5


def test_a_robot_that_nobody_knows_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"robot.preset: expected one of epuck, epuck_real, khepera_iv, thymio_ii"):
        load("paper", ["robot.preset=roomba"])


PAGE = (Path(__file__).parents[2] / "docs" / "robots.md").read_text(encoding="utf-8").partition("## Presets")[2]


def _rows(heading: str) -> list[list[str]]:
    lines = PAGE.partition(f"### {heading}\n")[2].partition("\n### ")[0].splitlines()
    return [[cell.strip(" `") for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")][2:]


@pytest.mark.parametrize("name", PRESETS)
def test_the_page_tells_each_number_and_its_source(name: str) -> None:
    config, letters = Config.model_validate({"robot": {"preset": name}}), {row[0] for row in _rows("Sources")}
    rows = _rows(f"`{name}`")
    for key, value, source in rows:
        section, _, field = key.partition(".")
        assert getattr(config, section).model_dump(mode="json")[field] == _parsed(value), key
        cited = re.match(r"([A-Z](?:, [A-Z])*)\b", source)
        assert source.startswith("*") if cited is None else set(cited[1].split(", ")) <= letters, key
    told = {f"{section}.{field}" for section, values in PRESETS[name].items() for field in values}
    all_keys = {f"{section}.{field}" for preset in PRESETS.values() for section in preset for field in preset[section]}
    assert {row[0] for row in rows} == (all_keys if name == "epuck" else told)


def _parsed(value: str) -> object:
    return json.loads(value) if value[0] in "[0123456789" else value

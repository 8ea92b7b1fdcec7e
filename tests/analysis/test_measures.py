# SPDX-License-Identifier: BSD-3-Clause
"""Which measures of success and which behaviours a scene has."""

from __future__ import annotations

from typing import Any

import pytest

from swarmevo.analysis import census
from swarmevo.analysis.measures import measures_of
from swarmevo.config import Config
from swarmevo.plugins.team import load_config
from swarmevo.protocols import Objective

PUCK = {"shape": "cylinder", "size": [0.06, 0.06, 0.03], "mass": 0.02, "pose": [0.0, -0.1, 0.0]}
LIGHT = {"position": [0.0, 0.3, 0.03], "channel": "light"}
OF_BOX_AND_SOURCE = ["homed without pushing", "pushed without RF"]


@pytest.mark.parametrize(
    ("scene", "homing", "push", "one_box", "paper"),
    [
        ({}, True, True, True, True),
        ({"movables": []}, True, False, False, False),
        ({"emitters": []}, False, True, True, False),
        ({"emitters": [LIGHT]}, False, True, True, False),
        ({"goals": []}, True, False, True, False),
        ({"goals": [{"region": [-0.5, 0.5, 0.2, 0.5]}]}, True, True, True, False),
        ({"movables": [PUCK]}, True, True, False, False),
        ({"movables": [], "emitters": []}, False, False, False, False),
    ],
)
def test_a_scene_says_which_rates_mean_something(
    scene: dict[str, Any], homing: bool, push: bool, one_box: bool, paper: bool
) -> None:
    settings = Config.model_validate({"scene": scene})
    found = measures_of(settings, ())
    assert (found.homing, found.push, found.one_box, found.paper) == (homing, push, one_box, paper)
    assert found.rates == ["push" if one_box else "all_delivered"] * push + ["homing"] * homing
    out = [label for label in census.LABELS if label not in census.fitting(settings)]
    assert out == ([] if homing and scene.get("movables", [PUCK]) else OF_BOX_AND_SOURCE)


def test_objectives_that_say_what_a_success_is_come_before_homing() -> None:
    gain, plain = Objective("gain", "maximise", (0, 1), success=0.5), Objective("plain", "maximise", (0, 1))
    assert measures_of(Config(), (plain, gain)).rates == ["push", "gain", "homing"]


def test_the_papers_configurations_have_its_table() -> None:
    assert all(measures_of(load_config(name), ()).paper for name in ("paper", "best", "robust", "shaped", "quick"))


def test_one_robot_shows_no_behaviour_of_a_team() -> None:
    alone = Config.model_validate({"team": {"robots": 1}})
    assert census.fitting(alone) == ["static near a wall", *OF_BOX_AND_SOURCE]

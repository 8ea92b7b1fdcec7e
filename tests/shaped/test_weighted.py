# SPDX-License-Identifier: BSD-3-Clause
"""Several shaped objectives in one number."""

from __future__ import annotations

import re

import numpy as np
import pytest

from swarmevo.testing import FitnessTests, SwitchCounter, random_telemetry
from swarmevo_shaped.objectives import Displacement, Homing, Progress, Success, Togetherness
from swarmevo_shaped.weighted import WeightedMean

NO_WEIGHTS = dict.fromkeys(("togetherness", "progress", "success", "speed", "homing", "nearness", "displacement"), 0.0)


def values(fitness):
    telemetry = random_telemetry(("pose", "box"), 30)
    return fitness.evaluate(telemetry, np.zeros((30, 0)), SwitchCounter())[:, 0]


class TestConformanceNegative(FitnessTests):
    def create(self):
        return WeightedMean(homing=1.0, nearness=0.5, displacement=-3.0)


def test_it_is_the_mean_by_the_weights():
    mean = values(WeightedMean(**NO_WEIGHTS | {"progress": 3, "homing": 1, "success": 4}))
    parts = 3 * values(Progress()) + values(Homing()) + 4 * values(Success())
    assert mean == pytest.approx(parts / 8, abs=1e-15)
    assert len(np.unique(mean)) >= 5


def test_a_single_weight_is_that_objective_whatever_the_weight():
    assert values(WeightedMean(**NO_WEIGHTS | {"progress": 0.1})).tolist() == values(Progress()).tolist()


def test_a_weight_below_0_makes_less_of_it_better():
    fitness = WeightedMean(**NO_WEIGHTS | {"homing": 1.0, "displacement": -3.0})
    assert fitness.objectives[0].range == (-0.75, 0.25)
    assert values(fitness) == pytest.approx(0.25 * values(Homing()) - 0.75 * values(Displacement()), abs=1e-15)


def test_the_options_of_togetherness_are_passed_on():
    weights = NO_WEIGHTS | {"togetherness": 1.0}
    telemetry = random_telemetry(("pose", "box"), 1, steps=20000)
    found, expected = (
        fitness.evaluate(telemetry, np.zeros((1, 0)), SwitchCounter()).tolist()
        for fitness in (WeightedMean(**weights, needed=2, power=1.5, facing=180), Togetherness(2, 1.5, 180))
    )
    assert found == expected
    assert found != WeightedMean(**weights).evaluate(telemetry, np.zeros((1, 0)), SwitchCounter()).tolist()


def test_channels_of_what_has_no_weight_are_not_recorded():
    assert WeightedMean().channels == ("box", "pose")
    assert WeightedMean(togetherness=0.0, progress=1.0).channels == ("box",)
    assert WeightedMean(**NO_WEIGHTS | {"success": 1.0}).channels == ()


def test_its_terms_are_courses_times_their_shares():
    telemetry = random_telemetry(WeightedMean().channels, 2)
    terms = WeightedMean(**NO_WEIGHTS | {"progress": 1.0, "togetherness": 3.0, "success": 4.0}).terms(telemetry)
    assert list(terms) == ["togetherness", "progress"]
    assert np.array_equal(terms["progress"], Progress().course(telemetry) / 8)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"speed": float("inf")}, "speed: expected a finite number as weight, got inf"),
        ({"homing": "1"}, "homing: expected a finite number as weight, got '1'"),
        (NO_WEIGHTS, "togetherness: expected a weight that is not 0, of this objective or another"),
        ({"needed": 65}, "needed: expected a whole number from 1 to 64, got 65"),
    ],
)
def test_wrong_options_are_one_clear_line(options, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        WeightedMean(**options)

# SPDX-License-Identifier: BSD-3-Clause
"""Cylinders, obstacles and other arenas against the independent reference: the validation report's cases, shortened."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

# The benchmarks are not installed. At the end of the path: the installed swarmevo comes first.
sys.path.append(str(Path(__file__).parents[2]))

from benchmarks import validation_objects as objects
from benchmarks.reference import Movable, Obstacle, Planar, Surroundings
from benchmarks.validation_scenes import Settings

REFERENCE_STEP = 2e-5
"""Twice that of the report, which changes a case by less than a tenth of its limits [s]."""


@pytest.mark.parametrize("case", objects.CASES, ids=lambda case: case.name)
def test_objects_do_as_in_the_independent_reference(case: objects.Case) -> None:
    truth = case.truth(REFERENCE_STEP)
    for step in (0.005, objects.DEFAULT_STEP):
        assert objects.keeps(case.difference(truth, step))


@pytest.mark.parametrize("case", [c for c in objects.OBSTACLES if not c.movables], ids=lambda case: case.name)
def test_robots_with_wheels_on_hinges_meet_obstacles_as_in_the_reference(case: objects.Case) -> None:
    """A tall obstacle does not tip them: they meet it no higher than each other."""
    assert objects.keeps(case.articulated())


@pytest.mark.parametrize("number", range(6))
def test_random_scenes_do_as_in_the_reference(number: int) -> None:
    (found,) = objects.random_differences(number, (0.005,))
    assert objects.keeps(found)


def test_a_cylinder_of_other_feet_mass_or_size_is_told_apart() -> None:
    case = objects.CYLINDERS[2]
    truth = case.truth(REFERENCE_STEP)
    for key, value in (("feet", 0.9), ("mass", 0.05), ("size", (0.096, 0.096, 0.03))):
        (movable,) = case.movables
        other = objects.replace(case, movables=[movable.model_copy(update={key: value})])
        assert not objects.keeps(other.difference(truth, 0.005)), key


@pytest.mark.parametrize("robots", [1, 2])
def test_robots_in_a_row_push_a_cylinder_up_to_the_mass_of_the_balance(robots: int) -> None:
    for share in (0.98, 1.02):
        case = objects.pushed(objects.in_a_row(robots), share * objects.balance(robots))
        for poses in (case.run(), case.truth(REFERENCE_STEP)):
            assert objects.is_moved(poses) == (share < 1)


def test_two_move_a_cylinder_that_one_does_not() -> None:
    mass = 1.5 * objects.balance(1)
    one, two = (objects.pushed(objects.in_a_row(robots), mass) for robots in (1, 2))
    assert not objects.is_moved(one.run())
    assert objects.is_moved(two.run())


def test_the_heaviest_is_found_by_bisection() -> None:
    assert objects.heaviest(lambda mass: mass <= 0.3) == pytest.approx(0.3, rel=1e-3)


def test_the_report_tells_each_case() -> None:
    found = objects.compare(objects.CASES[3:4], Settings(threads=1))
    text = objects._tables(found)
    assert "narrow feet" in text
    assert text.endswith("at every time step: **yes**.\n")


def test_surroundings_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="at least three corners"):
        Planar([], Surroundings([], [], [(0, 0), (1, 0)]))
    with pytest.raises(ValueError, match="diameter twice"):
        Planar([], Surroundings([], [Obstacle("cylinder", (0.1, 0.2), (0, 0, 0))], 1.0))
    with pytest.raises(ValueError, match="expected mass"):
        Planar([], Surroundings([Movable("box", (0.1, 0.2), 0.0, 0.5, (0, 0, 0))], [], 1.0))


def test_the_state_has_robots_then_movables() -> None:
    movables = [Movable("box", (0.1, 0.2), 0.1, 0.5, (0.1 * i, 0.3, 0.2)) for i in (1, 4)]
    world = Planar([(0, -0.3, 1.0)], Surroundings(movables, [], 1.0))
    np.testing.assert_allclose(world.state()[:, :3], [(0, -0.3, 1.0), (0.1, 0.3, 0.2), (0.4, 0.3, 0.2)])
    np.testing.assert_allclose(world.box(), (0.1, 0.3, 0.2))

# SPDX-License-Identifier: BSD-3-Clause
"""A shortened version of every check of the validation report, and that any command runs on either drive."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from swarmevo import cli, config
from swarmevo.config import Config
from swarmevo.simulator import Scene, simulate

# The benchmarks are not installed. At the end of the path: the installed swarmevo comes first.
sys.path.append(str(Path(__file__).parents[1]))

from benchmarks import validation
from benchmarks import validation_calibration as calibration
from benchmarks import validation_convergence as convergence
from benchmarks import validation_distribution as distribution
from benchmarks import validation_invariants as invariants
from benchmarks import validation_sensors as sensors
from benchmarks.validation_calibration import Push
from benchmarks.validation_scenes import (
    DRIVES,
    Drive,
    Section,
    Settings,
    changed,
    drive,
    keys,
    ks_distance,
    random_networks,
    standing,
    table,
)

every_drive = pytest.mark.parametrize("name", DRIVES)
DEFAULT_STEP = Config().physics.time_step


# ---- at least three robots -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "step"), [("driven_contacts", 0.02), ("driven_contacts", DEFAULT_STEP), ("articulated", 0.02)]
)
def test_one_and_two_robots_do_not_move_the_box_and_more_push_it_to_the_wall(name: Drive, step: float) -> None:
    ratio = calibration.default_ratio()
    assert calibration.is_still(Push(1, ratio, name, step))
    assert calibration.is_still(Push(2, ratio, name, step))
    for robots in (3, 4, 5):
        assert calibration.is_at_wall(Push(robots, ratio, name, step))


@pytest.mark.parametrize(("name", "step"), [("driven_contacts", DEFAULT_STEP), ("articulated", 0.02)])
def test_the_default_friction_keeps_a_margin_on_both_sides(name: Drive, step: float) -> None:
    ratio, margin = calibration.default_ratio(), calibration.MARGIN
    assert calibration.is_still(Push(2, ratio * (1 - margin), name, step))
    assert calibration.is_at_wall(Push(3, ratio * (1 + margin), name, step))


@pytest.mark.parametrize(("name", "step"), [("driven_contacts", DEFAULT_STEP), ("articulated", 0.02)])
def test_two_robots_at_a_slant_do_not_move_the_box(name: Drive, step: float) -> None:
    assert calibration.slanted_way(2, float(np.radians(30)), (name, step)) < calibration.STILL


def test_the_window_is_found() -> None:
    found = calibration.window(("driven_contacts", DEFAULT_STEP), precision=0.02)
    assert found.low < 0.53
    assert found.high > 0.64
    assert found.margins(found.low) == (0, found.high / found.low - 1)


def test_one_robot_at_a_corner_does_not_move_the_box() -> None:
    for where, poses in calibration.corner_scenes().items():
        if where.startswith("one"):
            moved, turned = calibration.corner_push(poses, ("driven_contacts", DEFAULT_STEP))
            assert moved < calibration.STILL
            assert abs(turned) < np.radians(1)


# ---- convergence -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def differences() -> convergence.Differences:
    return convergence.compare(
        Settings(threads=1), steps={"driven_contacts": (0.01, DEFAULT_STEP), "articulated": (0.01,)}
    )


@pytest.mark.parametrize("case", convergence.CASES, ids=lambda case: case.name)
def test_the_default_drive_keeps_to_the_limits(case: convergence.Case, differences: convergence.Differences) -> None:
    for step in (0.01, DEFAULT_STEP):
        found = differences[case.name, "driven_contacts", step]
        # A robot that slides along a wall turns to face it a little late at large steps.
        assert (
            found.share < convergence.LARGEST_WAY_ERROR
            if case.name == convergence.SLIDING
            else found.is_within_limits()
        )
        assert found.angle < 3 * convergence.LARGEST_TURN_ERROR


@pytest.mark.parametrize("case", convergence.CASES, ids=lambda case: case.name)
def test_the_reference_keeps_to_the_formulas(case: convergence.Case, differences: convergence.Differences) -> None:
    assert differences[case.name, *convergence.REFERENCE].is_within_limits()


def test_circles_have_the_formulas_radius() -> None:
    (arc,) = (case for case in convergence.CASES if case.name == "arc")
    radius = convergence.measured_radius(arc.run(("driven_contacts", DEFAULT_STEP)))
    assert radius == pytest.approx(convergence.arc_radius(*convergence.ARC), rel=1e-3)


# ---- distributions ---------------------------------------------------------------------------------------------------


def test_kolmogorov_smirnov_distance() -> None:
    assert ks_distance([1, 2, 3], [3, 2, 1]) == 0
    assert ks_distance([1, 2], [3, 4]) == 1
    assert ks_distance([1, 2, 3, 4], [1, 2, 3, 5]) == pytest.approx(0.25)


def test_time_steps_and_drives_agree_in_distribution(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(distribution, "HORIZON", 10.0)
    settings = Settings(pairs=60, threads=1)
    default = distribution.run(distribution.Model("driven_contacts", DEFAULT_STEP), settings)
    for model in (distribution.Model("driven_contacts", 0.02), distribution.Model("articulated", 0.02)):
        found = distribution.distances(default, distribution.run(model, settings))
        assert set(found) == set(distribution.QUANTITIES)
        assert max(found.values()) < distribution.critical_distance(settings.pairs)
    assert np.ptp(default.f1) > 0


# ---- invariants ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("crowd", invariants.CROWDS, ids=lambda crowd: str(crowd.robots))
def test_invariants_hold_under_stress(crowd: invariants.Crowd, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(invariants, "HORIZON", 20.0)
    found = invariants.stress(crowd, episodes=20, threads=1)
    assert found.failed == 0
    assert np.quantile(found.penetration, 0.9) < invariants.DEEPEST
    assert found.penetration.max() < 2 * invariants.DEEPEST
    assert found.messages_per_million() < invariants.MOST_MESSAGES
    assert found.fallen() == 0


def test_what_is_free_in_three_dimensions_stays_on_the_floor() -> None:
    """The default drive keeps bodies level; only on the articulated one can they sink, fly or tip."""
    n, team = 20, Config().team.robots
    config = changed(
        Config(),
        physics={"drive": "articulated", "time_step": 0.005},
        team={"start": "random"},
        episode={"horizon": 20.0},
    )
    drivers = np.repeat(np.arange(n, dtype=np.uint32)[:, np.newaxis], team, axis=1)
    done = simulate(Scene(config), random_networks(n, seed=5, forward=2.0), keys(n), drivers)
    assert not done.status.any()
    assert done.unsolved_steps.sum() == 0
    assert done.max_penetration.max() < invariants.DEEPEST
    assert 1e-6 < done.max_lift.max() < 0.001
    assert 0.999 < done.min_upright.min() < 1 - 1e-6


def test_a_fallen_robot_is_an_outcome() -> None:
    """A tall robot on short casters that drives against the box falls on its back; the episode goes on and says so."""
    tall = changed(
        standing([(0.0, -0.1, np.pi / 2)]),
        robot={"centre_of_mass": 0.14, "height": 0.15, "caster_offset": 0.005, "caster_clearance": 1e-4},
        box={"pose": (0.0, 0.2, 0.0)},
        physics={"drive": "articulated", "time_step": 0.01},
        episode={"horizon": 5.0},
    )
    done = drive(tall, [(1.0, 1.0)])
    assert done.min_upright[0] < invariants.FALLEN


def test_mirror_images_stay_together() -> None:
    images = invariants.mirror(episodes=20, horizon=1.0)
    assert images.deviation[:, 0].max() < 1e-12
    # Pairs part after collisions; docs/validation.md says how fast.
    assert np.median(images.deviation.max(axis=1)) < 1e-6
    assert images.deviation[:, :5].max() < 1e-3


def test_a_mirror_image_is_another_episode() -> None:
    here = standing([(0.1, -0.2, 0.3)])
    there = invariants.mirrored(here, np.array(here.team.start_poses))
    assert there.team.start_poses[0] == pytest.approx((-0.1, -0.2, np.pi - 0.3))
    networks = random_networks(1, seed=0)
    swapped = invariants.with_swapped_wheels(networks)
    np.testing.assert_array_equal(swapped.hidden_output[:, 0], networks.hidden_output[:, 1])


# ---- sensors ---------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def scenes() -> list[sensors.Scenes]:
    return sensors.draw(500, threads=1)


def test_infrared_agrees_with_marching_rays(scenes: list[sensors.Scenes]) -> None:
    check = sensors.check_infrared(scenes)
    assert check.answering > 1000
    assert check.largest < 1e-4


def test_touch_agrees_with_the_nearest_point_of_the_outline(scenes: list[sensors.Scenes]) -> None:
    check = sensors.check_touch(scenes)
    assert check.answering > 100
    assert check.undecided < check.readings / 50
    assert check.largest < 1e-4


def test_rf_agrees_with_its_definition(scenes: list[sensors.Scenes]) -> None:
    check = sensors.check_rf(scenes)
    assert check.answering > 1000
    assert check.largest < 1e-12


def test_infrared_noise_is_the_configs() -> None:
    found = sensors.infrared_spread(0.03, readings=1000)
    assert found.mean == pytest.approx(found.expected, rel=0.01)
    assert found.deviation == pytest.approx(Config().noise.infrared, rel=0.1)


# ---- any command on either drive -------------------------------------------------------------------------------------


@every_drive
def test_commands_run_on_either_drive(name: Drive, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    small = "episode.horizon=1", "evolution.population=4", "evolution.generations=2", "evolution.repeats=1"
    chosen = f"physics.drive={name}", "physics.time_step=0.005"
    settings = [word for setting in (*small, *chosen) for word in ("--set", setting)]
    run("evolve", *settings, "--seed", "1", "--workers", "1", "--out", "run")
    run("resume", "run", "--workers", "1")
    run("show", "run")
    run("test", "run", "--robots", "1", "--repeats", "1")
    physics = config.load(tmp_path / "run" / "config.yaml").physics
    assert (physics.drive, physics.time_step) == (name, 0.005)


def run(*arguments: str) -> None:
    with pytest.raises(SystemExit) as exit:
        cli.main(list(arguments))
    assert not exit.value.code


def test_the_drives_give_other_bits_of_the_same_behaviour() -> None:
    networks, drivers = random_networks(1, seed=3, forward=1.0), np.zeros((1, 5), dtype=np.uint32)
    found = {}
    for name in DRIVES:
        either = changed(Config(), physics={"drive": name, "time_step": 0.005}, episode={"horizon": 2.0})
        found[name] = simulate(Scene(either), networks, keys(1), drivers, ("pose",))
    one, other = found.values()
    assert one.hash[0] != other.hash[0]
    assert one.telemetry.pose is not None
    assert other.telemetry.pose is not None
    np.testing.assert_allclose(one.telemetry.pose[..., :2], other.telemetry.pose[..., :2], atol=0.002)


# ---- the report ------------------------------------------------------------------------------------------------------


def test_parts_of_the_page_are_written_one_by_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = tmp_path / "validation.md"
    asked: list[Settings] = []

    def part(text: str, settings: Settings) -> Section:
        asked.append(settings)
        return Section(text, {f"{text}.png": Figure()})

    monkeypatch.setattr(validation, "SECTIONS", {"first": lambda s: part("one", s), "second": lambda s: part("two", s)})
    validation.main(["second", "--page", str(page), "--episodes", "7"])
    assert asked[0].episodes == 7
    assert set(validation.parts_of(page.read_text())) == {"second"}
    validation.main(["first", "--page", str(page)])
    text = page.read_text()
    assert text.startswith(validation.HEAD)
    assert text.index("one") < text.index("two")
    assert {file.name for file in (tmp_path / "validation").iterdir()} == {"one.png", "two.png"}


def test_an_unknown_part_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        validation.main(["nonsense"])
    assert "expected parts of calibration, convergence" in capsys.readouterr().err


def test_the_page_has_all_parts() -> None:
    assert list(validation.parts_of(validation.PAGE.read_text())) == list(validation.SECTIONS)


def test_tables_put_numbers_to_the_right() -> None:
    assert table(["a", "b"], [["x", 1.5]]) == "| a | b |\n| --- | ---: |\n| x | 1.5 |\n"

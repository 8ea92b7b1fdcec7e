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
from swarmevo.simulation import Scene, simulate

# The benchmarks are not installed. At the end of the path: the installed swarmevo comes first.
sys.path.append(str(Path(__file__).parents[2]))

from benchmarks import validation
from benchmarks import validation_calibration as calibration
from benchmarks import validation_convergence as convergence
from benchmarks import validation_distribution as distribution
from benchmarks import validation_invariants as invariants
from benchmarks import validation_meetings as meetings
from benchmarks import validation_outside as outside
from benchmarks import validation_ramming as ramming
from benchmarks import validation_sensors as sensors
from benchmarks.validation_calibration import Place, Push
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
    traction,
)

every_drive = pytest.mark.parametrize("name", DRIVES)
DEFAULT_STEP = Config().physics.time_step


# ---- at least three robots -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "step"), [("driven_contacts", 0.02), ("driven_contacts", DEFAULT_STEP), ("articulated", 0.004)]
)
def test_one_and_two_robots_do_not_move_the_box_and_more_push_it_to_the_wall(name: Drive, step: float) -> None:
    ratio = calibration.default_ratio()
    assert calibration.is_still(Push(1, ratio, name, step))
    assert calibration.is_still(Push(2, ratio, name, step))
    for robots in (3, 4, 5):
        assert calibration.is_at_wall(Push(robots, ratio, name, step))


@pytest.mark.parametrize(("name", "step"), [("driven_contacts", DEFAULT_STEP), ("articulated", 0.004)])
def test_the_default_friction_keeps_a_margin_on_both_sides(name: Drive, step: float) -> None:
    ratio, margin = calibration.default_ratio(), calibration.MARGIN
    assert calibration.is_still(Push(2, ratio * (1 - margin), name, step))
    for place in calibration.TWO:
        assert not place.gives_way(ratio * (1 - margin), (name, step))
    assert calibration.is_at_wall(Push(3, ratio * (1 + margin), name, step))


@pytest.mark.parametrize(("name", "step"), [("driven_contacts", DEFAULT_STEP), ("articulated", 0.004)])
def test_two_robots_at_a_slant_do_not_move_the_box(name: Drive, step: float) -> None:
    assert calibration.slanted_way(2, float(np.radians(30)), (name, step)) < calibration.STILL


def test_the_window_is_found() -> None:
    found = calibration.window(("driven_contacts", DEFAULT_STEP), precision=0.005)
    assert found.lows == pytest.approx([place.threshold(calibration.corners()) for place in calibration.TWO], rel=0.01)
    assert found.low == found.lows[1]
    assert found.high == pytest.approx(calibration.balance(3), rel=0.01)
    assert found.margins(found.low) == (0, found.high / found.low - 1)
    assert min(found.margins(calibration.default_ratio())) > calibration.MARGIN


def test_feet_hold_a_force_by_friction_and_a_torque_by_friction_at_their_distance() -> None:
    feet = calibration.corners()
    assert calibration.holding_friction(feet, np.array([0.3, 0.4, 0.0])) == pytest.approx(0.5, rel=1e-6)
    lever = float(np.hypot(*feet[0]))
    assert calibration.holding_friction(feet, np.array([0.0, 0.0, -0.2])) == pytest.approx(0.2 / lever, rel=1e-6)


def test_no_turn_gains_more_than_the_friction_that_holds() -> None:
    place, feet = Place(2, "long", "end"), calibration.corners()
    force, torque = 2 * traction(), float(place.along().sum()) * traction()
    centres = np.random.default_rng(1).normal(scale=0.3, size=(20_000, 2))
    gained = np.abs(torque - centres[:, 0] * force)
    taken = np.linalg.norm(feet - centres[:, np.newaxis], axis=2).mean(axis=1)
    needed = calibration.holding_friction(feet, np.array([0.0, force, torque]))
    assert 0.99 * needed < (gained / taken).max() < needed * (1 + 1e-6)


@pytest.mark.parametrize("place", calibration.PLACES, ids=str)
def test_robots_that_press_move_the_box_where_its_limit_curve_says_so(place: Place) -> None:
    found = place.measured(("driven_contacts", DEFAULT_STEP))
    assert found == pytest.approx(place.threshold(calibration.corners()), rel=calibration.CURVE_ERROR)


def test_the_articulated_drive_finds_the_limit_curve_as_well() -> None:
    place = Place(2, "long", "end")
    found = place.measured(("articulated", 0.004), precision=0.002)
    assert found == pytest.approx(place.threshold(calibration.corners()), rel=calibration.CURVE_ERROR)


def test_a_box_of_even_pressure_has_no_window() -> None:
    feet = calibration.even_feet()
    assert Place(3, "long", "middle").threshold(feet) == pytest.approx(calibration.balance(3), rel=1e-3)
    assert Place(2, "long", "end").threshold(feet) == pytest.approx(0.74, abs=0.005)


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
        Settings(threads=1), steps={"driven_contacts": (0.01, DEFAULT_STEP), "articulated": (0.004,)}
    )


@pytest.mark.parametrize("case", convergence.CASES, ids=lambda case: case.name)
def test_the_default_drive_keeps_to_the_limits(case: convergence.Case, differences: convergence.Differences) -> None:
    for step in (0.01, DEFAULT_STEP):
        assert differences[case.name, "driven_contacts", step].is_within_limits()


@pytest.mark.parametrize("case", [c for c in convergence.CASES if not c.meets], ids=lambda case: case.name)
def test_the_articulated_drive_keeps_to_the_formulas(
    case: convergence.Case, differences: convergence.Differences
) -> None:
    assert differences[case.name, *convergence.REFERENCE].is_within_limits()


def test_bumpers_at_a_wall_are_pressed_by_traction_over_stiffness() -> None:
    for figures in convergence.figures_with_formulas():
        if "bumper" in figures.name:
            (case,) = (case for case in convergence.CASES if case.name == figures.case)
            assert figures.read(case.run(("driven_contacts", DEFAULT_STEP))) == pytest.approx(figures.formula, rel=0.01)


def test_circles_have_the_formulas_radius() -> None:
    (arc,) = (case for case in convergence.CASES if case.name == "arc")
    radius = convergence.measured_radius(arc.run(("driven_contacts", DEFAULT_STEP)))
    assert radius == pytest.approx(convergence.arc_radius(*convergence.ARC), rel=1e-3)


# ---- where bodies meet -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def compared() -> dict[str, meetings.Compared]:
    steps: dict[Drive, tuple[float, ...]] = {"driven_contacts": (0.005, DEFAULT_STEP), "articulated": (0.004,)}
    return {found.case.name: found for found in meetings.compare(Settings(threads=1), steps)}


@pytest.mark.parametrize("case", meetings.CASES, ids=lambda case: case.name)
def test_bodies_that_meet_do_as_in_the_independent_reference(
    case: meetings.Case, compared: dict[str, meetings.Compared]
) -> None:
    assert compared[case.name].differences["driven_contacts", 0.005].keeps(case)
    assert meetings.default_difference(compared[case.name]).keeps(case)


def test_rows_are_pushed_by_the_articulated_drive_as_in_the_reference_that_shifts_loads(
    compared: dict[str, meetings.Compared],
) -> None:
    for case in meetings.ROWS:
        assert compared[case.name].differences[meetings.SHIFTING].keeps(case)


def test_the_shift_of_loads_explains_the_difference_between_the_drives() -> None:
    turned = meetings.turned_by_rows(Settings(threads=1))
    assert turned.is_explained()
    assert not turned._replace(shifting=turned.reference).is_explained()
    assert turned.apart()["default"] < np.radians(0.2)


def test_a_robot_that_pitches_rams_more_softly() -> None:
    found = meetings.blow(Settings(threads=1))
    assert found.articulated < found.on_casters / 3
    assert found.default == pytest.approx(found.reference, rel=0.1)
    assert found.on_casters == pytest.approx(found.reference, rel=0.2)


def test_the_reference_follows_the_config() -> None:
    case = meetings.CASES[0]
    usual = meetings.reference_poses(case.config(), case.commands)
    for other in (
        changed(case.config(), physics={"box_friction": 0.5}),
        changed(case.config(), robot={"bumper": "rigid"}),
        changed(case.config(), box={"velocity": (0.1, 0.0, 0.0)}),
    ):
        assert np.abs(meetings.reference_poses(other, case.commands) - usual).max() > 1e-4


# ---- a simulator from outside ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def held() -> list[outside.Compared]:
    steps: dict[Drive, tuple[float, ...]] = {"driven_contacts": (0.005, DEFAULT_STEP), "articulated": (0.001,)}
    return outside.compare(Settings(threads=1), steps)


def test_boxes_slide_and_robots_meet_as_in_a_simulator_from_outside(held: list[outside.Compared]) -> None:
    assert not outside.missed(held, "driven_contacts")
    for compared in held:
        assert compared.figure.error(compared.reference) < 0.2 * compared.figure.tolerance()
        assert not compared.figure.keeps(compared.figure.outside + 1.01 * compared.figure.tolerance())


def test_the_simulator_from_outside_says_what_its_first_report_said() -> None:
    for figure in outside.FIGURES:
        if figure.first is not None:
            assert figure.outside == pytest.approx(figure.first, rel=0.025)


def test_the_articulated_drive_slides_as_in_a_simulator_from_outside(held: list[outside.Compared]) -> None:
    assert not outside.missed(held, "articulated")
    assert outside.shift(held).is_explanation()


def test_the_feet_of_the_reference_hardly_give() -> None:
    found = outside.feet(Settings(threads=1))
    for stiffness, way in outside.RAMMED.items():
        assert found.ours[stiffness] == pytest.approx(way, rel=1e-3)
    assert found.default == found.ours[outside.DEFAULT_FEET]
    assert found.are_stiff_enough()
    assert found.share(found.ours[outside.SOFT_FEET]) > 4 * outside.LARGEST_FOOT_ERROR
    assert max(map(found.share, found.library)) < outside.LARGEST_FOOT_ERROR


# ---- distributions ---------------------------------------------------------------------------------------------------


def test_kolmogorov_smirnov_distance() -> None:
    assert ks_distance([1, 2, 3], [3, 2, 1]) == 0
    assert ks_distance([1, 2], [3, 4]) == 1
    assert ks_distance([1, 2, 3, 4], [1, 2, 3, 5]) == pytest.approx(0.25)


def test_time_steps_and_drives_agree_in_distribution() -> None:
    settings = Settings(pairs=60, threads=1)
    default = distribution.run(distribution.Model("driven_contacts", DEFAULT_STEP), settings)
    assert default.moved() >= 1 - distribution.MOST_STILL
    assert np.ptp(default.f1) > 0
    for model in (distribution.Model("driven_contacts", 0.02), distribution.Model("articulated", 0.004)):
        found = distribution.run(model, settings)
        assert set(distribution.distances(default, found)) == set(distribution.QUANTITIES)
        assert distribution.are_alike(default, found)
    assert not distribution.are_alike(default, default._replace(f1=default.f1 + 10))
    assert not distribution.are_alike(default, default._replace(way=default.way / 2))


def test_teams_that_start_at_the_box_are_judged_by_themselves() -> None:
    default = distribution.run(distribution.Model("driven_contacts", DEFAULT_STEP), Settings(pairs=60, threads=1))
    roaming, *pushing = distribution.counts(60)
    assert len(default.that_push().f1) == sum(pushing) == 60 - roaming
    assert default.that_push().moved() > 0.75
    assert [len(kind.f1) for kind in default.by_kind()] == distribution.counts(60)


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
        physics={"drive": "articulated", "time_step": 0.004},
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
        physics={"drive": "articulated", "time_step": 0.004},
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


# ---- fewer than three ------------------------------------------------------------------------------------------------


def is_still(outcome: ramming.Moved) -> bool:
    return outcome.reach < ramming.STILL


def test_one_robot_does_not_move_the_box_by_ramming_or_turning() -> None:
    for strategy in (*ramming.rammings_of_one()[::5], *ramming.wriggles_of_one()[::9]):
        assert is_still(ramming.outcome(strategy, horizon=60.0)), ramming.described(strategy)
        assert is_still(ramming.outcome(strategy, horizon=20.0, noise=True)), ramming.described(strategy)


@pytest.mark.parametrize("stand", [ramming.abreast, ramming.in_a_row])
def test_two_robots_do_not_move_the_box_by_ramming_the_middle_of_a_face(stand: ramming.Stand) -> None:
    for strategy in (*ramming.rammings_of_two(stand)[::8], *ramming.wriggles_of_two(stand)[::8]):
        assert is_still(ramming.outcome_in_lane(strategy, horizon=40.0)), ramming.described(strategy)


def test_a_bumper_that_two_in_a_row_press_in_all_the_way_is_a_rigid_one() -> None:
    south, *_ = ramming.faces()
    strategy = ramming.Strategy(ramming.in_a_row(south), (ramming.ram((0.3, 0.67)), ramming.ram((0.3, 0.67), 0.25)))
    pressed = 2 * traction() / ramming.default_bumper().stiffness
    for travel, moves in ((0.6 * pressed, True), (1.1 * pressed, False)):
        bumper = ramming.default_bumper()._replace(travel=travel)
        assert is_still(ramming.outcome_in_lane(strategy, 60.0, bumper)) != moves


def test_random_networks_of_one_robot_do_not_move_the_box() -> None:
    for at_box in (False, True):
        assert [is_still(outcome) for outcome in ramming.networks(1, 10, at_box, horizon=60.0)] == [True] * 10


@pytest.mark.parametrize("team", [ramming.ONE, ramming.ABREAST, ramming.ROW])
def test_a_search_finds_no_way_to_move_the_box(team: str) -> None:
    moved, strategy = ramming.hunt(ramming.hunts()[team][0], budget=80, seed=0, horizon=20.0)
    assert is_still(moved), ramming.described(strategy)


def test_a_search_finds_what_moves_the_box() -> None:
    """With rigid bumpers one robot does; else the search would prove nothing."""
    rigid = ramming.default_bumper()._replace(kind="rigid")
    able = ramming.hunts()[ramming.ONE][0]._replace(judge=lambda s, horizon: ramming.outcome(s, horizon, bumper=rigid))
    moved, _ = ramming.hunt(able, budget=100, seed=2, horizon=30.0)
    assert not is_still(moved)


def test_two_robots_in_step_at_one_end_of_a_face_move_it_as_in_the_reference() -> None:
    """What docs/validation.md admits."""
    south, east, *_ = ramming.faces()
    strategy = ramming.Strategy(ramming.at_end(south), (ramming.FULL,) * 2)
    ours = ramming.outcome(strategy, horizon=2.0)
    reference = ramming.moved(ramming.track_in_reference(strategy, horizon=2.0))
    assert 0.002 < ours.way == pytest.approx(reference.way, rel=0.1)
    assert np.radians(0.5) < ours.turn == pytest.approx(reference.turn, rel=0.1)
    # At the end of the short face they just fail to: a force that is 3 % too high at its peak would move it.
    most, _ = ramming.ramming(ramming.at_end(east), ramming.default_bumper(), horizon=60.0)
    assert most.way < 1e-4


def test_a_blow_is_the_same_whenever_in_a_step_it_comes() -> None:
    south, *_ = ramming.faces()
    blows = [
        ramming.outcome(ramming.Strategy(ramming.at_end(south, 0.03 + 0.008 * phase), (ramming.FULL,) * 2), 2.0).way
        for phase in ramming.PHASES
    ]
    assert max(blows) < 1.03 * min(blows)


def test_a_rigid_blow_moves_the_box_as_momentum_has_it() -> None:
    rigid = ramming.default_bumper()._replace(kind="rigid")
    south, *_ = ramming.faces()
    moved = ramming.blow(lambda gap: (south.pose(0.0, gap),), rigid)
    assert moved.way == pytest.approx(ramming.rigid_way(), rel=0.05)
    assert moved.turn < 1e-6


def test_the_tail_does_what_the_nose_does() -> None:
    pose = ramming.faces()[0].pose(0.05, 0.02)
    nose = ramming.Strategy((pose,), (ramming.ram((1.0, 0.5)),))
    time = ramming.instants(3.0)
    np.testing.assert_allclose(ramming.with_tail(nose).commands(time), -nose.commands(time))
    assert np.cos(ramming.with_tail(nose).poses[0][2] - pose[2]) == pytest.approx(-1)


def test_a_strategy_is_described_by_all_its_numbers() -> None:
    drive = ramming.Drive(ramming.Wave(0.1, 0.5, 0.3, 0.25, 0.4), ramming.Wave(0.2))
    text = ramming.described(ramming.Strategy(((0.1, -0.2, 0.3),), (drive,)))
    assert (
        text
        == "from (0.1, -0.2, 0.3) ahead 0.6 for 0.4 of a period of 0.3 s, else -0.4, from 0.25 of it on, turning 0.2"
    )


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
    chosen = f"physics.drive={name}", "physics.time_step=0.004"
    settings = [word for setting in (*small, *chosen) for word in ("--set", setting)]
    run("evolve", *settings, "--seed", "1", "--workers", "1", "--out", "run")
    run("resume", "run", "--workers", "1")
    run("show", "run")
    run("test", "run", "--robots", "1", "--repeats", "1")
    physics = config.load(tmp_path / "run" / "config.yaml").physics
    assert (physics.drive, physics.time_step) == (name, 0.004)


def run(*arguments: str) -> None:
    with pytest.raises(SystemExit) as exit:
        cli.main(list(arguments))
    assert not exit.value.code


def test_the_drives_give_other_bits_of_the_same_behaviour() -> None:
    networks, drivers = random_networks(1, seed=3, forward=1.0), np.zeros((1, 5), dtype=np.uint32)
    found = {}
    for name in DRIVES:
        either = changed(Config(), physics={"drive": name, "time_step": 0.004}, episode={"horizon": 2.0})
        found[name] = simulate(Scene(either), networks, keys(1), drivers, ("pose",))
    one, other = found.values()
    assert one.hash[0] != other.hash[0]
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

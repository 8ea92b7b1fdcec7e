# SPDX-License-Identifier: BSD-3-Clause
"""Tests of controllers: what is counted, that it is repeatable, and that tests add up."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import small_runs
from swarmevo import config
from swarmevo.analysis import assessment, bench, fronts, table_ii
from swarmevo.analysis.measures import measures_of
from swarmevo.analysis.sequential import Until
from swarmevo.analysis.table_ii import PAPER, Outcome
from swarmevo.errors import ConfigError, Interrupted, StoreError
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.protocols import Objective
from swarmevo.runs import driver
from swarmevo.runs.store import Store
from swarmevo.runs.tests_file import TESTS_FILE


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_runs.make(tmp_path_factory.mktemp("runs") / "run")


def assess(run: Path, **options: object) -> table_ii.Assessment:
    """Test a run as if nobody had before."""
    (run / TESTS_FILE).unlink(missing_ok=True)
    return assess_more(run, **options)


def assess_more(run: Path, **options: object) -> table_ii.Assessment:
    with Store.open(run) as store:
        return assessment.assess(store, **{"sizes": (1, 3), "repeats": 2, "workers": 1} | options)  # type: ignore[arg-type]


# ---- what is counted -------------------------------------------------------------------------------------------------


def test_an_outcome_by_hand() -> None:
    homing = np.array([[1.0, np.nan], [3.0, 5.0], [np.nan, np.nan]])
    objectives = (
        Objective("gain", "maximise", (0.0, 9.0), success=3.0),
        Objective("error", "minimise", (0.0, 9.0), success=1.0),
        Objective("plain", "maximise", (0.0, 9.0)),
        Objective("size", "minimise", (0.0, 9.0), of="genome", success=5.0),
    )
    values = np.array([[1.0, 1.0, 2.0, 4.0], [3.0, 2.0, 2.0, 4.0], [5.0, 3.0, 2.0, 4.0]])
    outcome = table_ii.outcome(2, homing, np.array([np.nan, 7.0, np.nan]), objectives, values)
    assert outcome == Outcome(
        robots=2,
        tests=3,
        homing_rate=0.5,
        any_home_rate=pytest.approx(2 / 3),
        all_home_rate=pytest.approx(1 / 3),
        homing_time=3.0,
        push_rate=pytest.approx(1 / 3),
        push_time=7.0,
        success_rates={"gain": pytest.approx(2 / 3), "error": pytest.approx(1 / 3)},
        objectives={
            "gain": (3.0, pytest.approx((4 / 3) ** 0.5)),
            "error": (2.0, pytest.approx(3**-0.5)),
            "plain": (2.0, 0.0),
        },
    )


def test_never_is_none() -> None:
    outcome = table_ii.outcome(1, np.full((4, 1), np.nan), np.full(4, np.nan), (), np.empty((4, 0)))
    assert (outcome.homing_rate, outcome.homing_time, outcome.push_rate, outcome.push_time) == (0, None, 0, None)


def test_the_papers_table() -> None:
    assert [row.robots for row in PAPER] == [1, 2, 3, 4, 5]
    assert [row.push_rate for row in PAPER] == [0, 0, 0.96, 0.56, 0.3]
    assert [row.push_time for row in PAPER] == [None, None, 43.44, 37.42, 30.67]
    assert [round(100 * row.homing_rate, 2) for row in PAPER] == [13.33, 26.67, 97.67, 93.33, 88.67]


# ---- tests -----------------------------------------------------------------------------------------------------------


def test_every_controller_of_every_front_is_tested(run: Path) -> None:
    found = assess(run)
    with Store.open(run) as store:
        points = [(trial, point.genome) for trial in (0, 1) for point in fronts.front(store, trial)]
    assert [(one.trial, one.genome) for one in found.controllers] == points
    assert [row.robots for row in found.rows] == [1, 3]
    assert all(row.tests == 2 * len(points) for row in found.rows)
    assert all([outcome.robots for outcome in one.outcomes] == [1, 3] for one in found.controllers)
    assert found.robustness == []


def test_tests_meet_noise_that_evolution_did_not(run: Path) -> None:
    with Store.open(run) as store:
        keys = [bench.test_key(store.config, 1, i) for i in range(2)]
    assert [tuple(key) for key in keys] == [(5, 1, 2**32 - 1, 0), (5, 1, 2**32 - 1, 1)]
    most = next(limit.le for limit in config.Evolution.model_fields["generations"].metadata if hasattr(limit, "le"))
    assert most < assessment.GENERATION


def test_again_is_the_same_on_any_workers(run: Path) -> None:
    assert assess(run, workers=1) == assess(run, workers=2)


def test_the_evolved_team_is_tested_whatever_the_sizes(run: Path) -> None:
    by_one, by_three = assess(run, sizes=(1,)), assess(run, sizes=(3,))
    assert [one.tested for one in by_one.controllers] == [one.tested for one in by_three.controllers]
    assert all(one.tested.keys() == one.evolved.keys() for one in by_one.controllers)


@pytest.mark.parametrize(
    ("team", "sizes"),
    [({"robots": 5}, [1, 2, 3, 4, 5]), ({"robots": 8}, [1, 2, 3, 4, 5, 8]), ({"robots": 1}, [1, 2, 3, 4, 5])],
)
def test_the_evolved_size_is_among_those_that_are_tested(team: dict[str, Any], sizes: list[int]) -> None:
    settings = config.Config.model_validate({"team": team})
    assert assessment.team_sizes(settings) == sizes
    own = config.Config.model_validate({"team": {**team, "genomes": "individual"}})
    assert assessment.team_sizes(own) == [size for size in sizes if size <= team["robots"]]


def test_robustness_changes_the_world(run: Path) -> None:
    found = assess(run, robustness=True)
    names = [condition.name for condition in found.robustness]
    assert names[0] == "as evolved"
    assert {"no noise", "double noise", "exact starts", "turned starts", "rigid bumpers"} < set(names)
    assert found.robustness[0].outcome == found.rows[1]


def test_a_world_without_room_is_left_out(run: Path) -> None:
    with Store.open(run) as store:
        settings = config.load(store.config_path, ["team.start_region=[-0.04, 0.04, -0.04, 0.04]"])
    assert "starts anywhere" not in assessment._worlds(settings)


def test_the_other_bumpers_are_those_that_evolution_did_not_have(run: Path) -> None:
    with Store.open(run) as store:
        settings = config.load(store.config_path, ["robot.bumper=rigid"])
    changes, world = assessment._worlds(settings)["sprung bumpers"]
    assert (changes, world.robot.bumper) == ("robot.bumper sprung", "sprung")


def test_progress_reaches_its_end(run: Path) -> None:
    seen: list[tuple[int, int]] = []
    assess(run, robustness=True, observe=lambda done, total: seen.append((done, total)))
    assert seen[-1][0] == seen[-1][1]
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)


def test_it_can_be_stopped(run: Path) -> None:
    with pytest.raises(Interrupted):
        assess(run, stop=lambda: True)


# ---- tests add up ----------------------------------------------------------------------------------------------------


@pytest.fixture
def evaluated(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many episodes each evaluation of this test runs."""
    counts: list[int] = []
    original = Evaluator.evaluate

    def evaluate(self: Evaluator, *given: Any, **named: Any) -> Any:
        done = original(self, *given, **named)
        known = given[4] if len(given) > 4 else None
        counts.append(len(done.episodes) - (0 if known is None else len(known)))
        return done

    monkeypatch.setattr(Evaluator, "evaluate", evaluate)
    return counts


def test_nothing_is_run_twice(run: Path, evaluated: list[int]) -> None:
    few = assess(run, repeats=2)
    controllers = len(few.controllers)
    assert sum(evaluated) == 2 * 2 * controllers
    assert assess_more(run, repeats=2) == few
    assert sum(evaluated) == 4 * controllers
    more = assess_more(run, repeats=5)
    assert sum(evaluated) == 2 * 5 * controllers
    assert more == assess(run, repeats=5)


def test_a_smaller_test_shows_what_is_stored(run: Path, evaluated: list[int]) -> None:
    rich = assess(run, sizes=(1, 2, 3), repeats=4, robustness=True)
    evaluated.clear()
    poor = assess_more(run, sizes=(2,), repeats=1)
    assert not evaluated
    assert (poor.repeats, poor.rows) == (4, rich.rows[1:2])
    assert [one.tested for one in poor.controllers] == [one.tested for one in rich.controllers]
    with Store.open(run) as store:
        assert assessment.stored(store) == rich


def test_worlds_are_kept_apart(run: Path, evaluated: list[int]) -> None:
    usual = assess(run)
    other = assess_more(run, overrides=["arena.size=1.2"])
    assert other.changes == ["arena.size 1.2 (evolved with 1.0)"]
    done = sum(evaluated)
    assert assess_more(run, overrides=["arena.size=1.2"]) == other
    assert assess_more(run, overrides=["arena.size=1.0"]) == usual
    assert sum(evaluated) == done
    with Store.open(run) as store:
        assert assessment.stored(store) == usual


def test_an_individual_alone(run: Path, evaluated: list[int]) -> None:
    with Store.open(run) as store:
        everybody, on_front = store.individuals(), {point.genome for point in fronts.front(store, 0)}
    genome = next(int(id) for id in everybody.genome[everybody.trial == 0] if id not in on_front)
    found = assess(run, genome=genome, repeats=3)
    assert [(one.genome, one.trial, one.outcomes[0].tests) for one in found.controllers] == [(genome, 0, 3)]
    assert sum(evaluated) == 2 * 3
    with Store.open(run) as store:
        assert assessment.stored(store) is None  # it is on no front


def test_each_controller_counts_the_same(run: Path) -> None:
    best = assess(run, sizes=(3,)).controllers[0].genome
    assess_more(run, sizes=(3,), repeats=9, genome=best)
    found = assess_more(run, sizes=(3,))
    assert [one.outcomes[0].tests for one in found.controllers if one.genome == best] == [9]
    assert (found.repeats, found.rows[0].tests) == (2, 2 * len(found.controllers))


def test_those_who_came_later_are_untested(tmp_path: Path) -> None:
    run = small_runs.make(tmp_path / "run", "evolution.trials=1", "evolution.generations=1")
    assess(run, sizes=(3,), genome=1)
    with Store.open(run, readonly=False) as store:
        driver.extend(store, "+6")
        driver.evolve(store, 1, lambda now: None, lambda: False)
    with Store.open(run) as store:
        front = fronts.front(store, 0)
        found = assessment.stored(store)
    assert found is None or found.untested == len(front) - len(found.controllers) > 0
    assert assess_more(run, sizes=(3,)).untested == 0


# ---- until it is decided ---------------------------------------------------------------------------------------------


def test_a_controller_is_tested_until_it_is_decided(run: Path, evaluated: list[int]) -> None:
    found = assess(run, sizes=(3,), repeats=60, until=Until(0.5))
    assert {one.verdict for one in found.verdicts} == {"below"}  # within two seconds no box is pushed anywhere
    assert {one.tests for one in found.verdicts} == {25}
    assert sum(evaluated) == 25 * len(found.controllers)
    assert assess_more(run, sizes=(3,), repeats=60, until=Until(0.5)).verdicts == found.verdicts
    assert sum(evaluated) == 25 * len(found.controllers)


def test_more_tests_change_no_decision(run: Path) -> None:
    assess(run, sizes=(3,), repeats=60)
    found = assess_more(run, sizes=(3,), repeats=60, until=Until(0.5, "homing"))
    assert {one.tests for one in found.verdicts} == {25}
    assert {one.outcomes[0].tests for one in found.controllers} == {60}


# ---- teams of individuals --------------------------------------------------------------------------------------------


def test_individuals_are_tested_in_smaller_teams_only(tmp_path: Path) -> None:
    run = small_runs.make(tmp_path / "run", "team.genomes=individual", "evolution.trials=1")
    found = assess(run, sizes=(2, 3))
    assert [row.robots for row in found.rows] == [2, 3]
    with pytest.raises(ConfigError, match="at most 3"):
        assess(run, sizes=(4,))


# ---- the most successful ---------------------------------------------------------------------------------------------


def with_rates(found: table_ii.Assessment, *rates: list[float]) -> table_ii.Assessment:
    """Return tests in which controllers pushed at these rates, with each team size."""
    controllers = [
        replace(one, outcomes=[replace(o, push_rate=rate) for o, rate in zip(one.outcomes, own, strict=True)])
        for one, own in zip(found.controllers, rates, strict=True)
    ]
    return replace(found, controllers=controllers)


def test_tests_decide_over_all_trials_once_they_know_more(run: Path) -> None:
    found = assess(run, repeats=2)  # with two team sizes: more tests than the two episodes in evolution
    places = [(one.trial, one.genome) for one in found.controllers]
    assert len(places) > 2
    assert {trial for trial, _ in places} == {0, 1}
    with Store.open(run) as store:
        evolved = fronts.most_successful(fronts.front(store), measures_of(store.config, store.objectives))
        for best in range(len(places)):
            rates = [[0.7, 0.6]] * len(places)
            rates[best] = [0.5, 0.9]  # the mean counts
            tests = with_rates(found, *rates)
            chosen = assessment.most_successful(store, tests)
            assert (chosen.trial, chosen.genome) == places[best]
            assert (tests.most_successful.trial, tests.most_successful.genome) == places[best]
            for worse in (replace(tests, untested=1), replace(tests, controllers=tests.controllers[:-1])):
                assert assessment.most_successful(store, worse) == evolved
            few = [replace(one, outcomes=[replace(o, tests=0) for o in one.outcomes]) for one in tests.controllers]
            assert assessment.most_successful(store, replace(tests, controllers=few)) == evolved


def test_stored_tests_decide(run: Path) -> None:
    found = assess(run, repeats=5)
    with Store.open(run) as store:
        chosen = assessment.most_successful(store)
        assert assessment.watched(store) == (chosen.genome, chosen.trial)
    homed = {(one.trial, one.genome): np.mean([o.homing_rate for o in one.outcomes]) for one in found.controllers}
    assert not any(o.push_rate for one in found.controllers for o in one.outcomes)  # so homing decides
    assert homed[chosen.trial, chosen.genome] == max(homed.values())
    (run / TESTS_FILE).unlink()
    with Store.open(run) as store:
        best = fronts.most_successful(fronts.front(store), measures_of(store.config, store.objectives))
        assert assessment.most_successful(store) == best


# ---- watching --------------------------------------------------------------------------------------------------------


def test_watching_shows_the_tests(run: Path) -> None:
    found = assess(run, sizes=(3,), repeats=assessment.REPEATS)
    with Store.open(run) as store:
        seen = assessment.watch(store)
        best = assessment.most_successful(store)
    assert [key.trial for key in seen.keys] == [best.trial] * assessment.REPEATS
    homing = np.isfinite(seen.telemetry.homing_time).mean()
    (tested,) = [one for one in found.controllers if (one.trial, one.genome) == (best.trial, best.genome)]
    assert tested.outcomes[0].homing_rate == homing
    assert seen.telemetry.pose.shape == (assessment.REPEATS, 20, 3, 3)


def test_watching_somebody_unknown(run: Path) -> None:
    with Store.open(run) as store, pytest.raises(StoreError, match="there is no genome 999"):
        assessment.watch(store, 999)

# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo compare``: real runs of a second, what is found of them, and what cannot be compared."""

from __future__ import annotations

import dataclasses
import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_hex

import small_runs
from cli.conftest import Swarmevo
from swarmevo.analysis import comparison
from swarmevo.analysis.comparison import Comparison, Group, Trial
from swarmevo.api.runs import Run
from swarmevo.protocols import Objective
from swarmevo.runs.store import Store
from swarmevo.views.compare import drawings, page
from swarmevo.views.figures import style

F1 = Objective("gain", "maximise", (0.0, 10.0))
SIZE = Objective("size", "minimise", (0.0, 4.0))


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("runs")
    return [small_runs.make(folder / f"seed-{seed}", f"evolution.seed={seed}") for seed in (1, 2, 3)]


# ---- what is found ---------------------------------------------------------------------------------------------------


def test_each_run_is_a_group_of_trials(runs: list[Path], swarmevo_: Swarmevo) -> None:
    done = swarmevo_("compare", *runs, "--repeats", 2, "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert [(one["name"], len(one["trials"])) for one in found["groups"]] == [(run.name, 2) for run in runs]
    assert [one["name"] for one in found["measures"]] == ["hypervolume", "box_pushing", "success"]
    assert all(len(one["pairs"]) == 3 for one in found["measures"])
    assert all(0 <= one["p"] <= 1 for one in found["measures"])
    assert found["notes"] == [
        "Few trials (seed-1 2, seed-2 2, seed-3 2): hardly any difference can be significant; evolve at least ten."
    ]


def test_trials_are_judged_by_fresh_tests_of_their_fronts(runs: list[Path]) -> None:
    """Held against what each individual's own tests say, with an area that is counted point by point."""
    with Store.open(runs[0]) as one, Store.open(runs[1]) as other:
        found = comparison.compare({"a": [one], "b": [other]}, repeats=3)
    worst = np.array([one.worst for one in found.objectives])
    width = np.array([one.range[1] - one.range[0] for one in found.objectives])
    for trial in found.groups[0].trials:
        members = list(Run(runs[0]).front(trial.trial))
        tests = np.array([member.simulate(3).values for member in members])
        gains = abs(tests - worst) / width
        others = [np.delete(gains, k, axis=1).mean(axis=1) for k in range(3)]
        assert trial.tested == pytest.approx(attained_by_the_chosen(others, gains), abs=0.005)
        firsts = [tests[chosen[:, 0].argmax(), k, 0] for k, chosen in enumerate(others)]
        assert trial.first == pytest.approx(np.mean(firsts))
        assert trial.episodes == trial.course[-1][0]


def attained_by_the_chosen(others: list[np.ndarray], gains: np.ndarray) -> float:
    """Return the share of a fine grid that is attained by those who reach farthest in their direction."""
    points = (np.stack(np.meshgrid(*[np.arange(300)] * 2), axis=-1).reshape(-1, 2) + 0.5) / 300
    found = []
    for k, chosen in enumerate(others):
        ratios = chosen[:, np.newaxis] / points
        best = np.lexsort([ratios.max(axis=2), ratios.min(axis=2)], axis=0)[-1]
        found.append(gains[best, k])
    return float((np.mean(found, axis=0) >= points).all(axis=1).mean())


def test_with_one_test_it_is_said_who_is_the_best(runs: list[Path], swarmevo_: Swarmevo) -> None:
    done = swarmevo_("compare", *runs[:2], "--repeats", 1)
    assert "One test of each controller: evolution says who is the best of a front." in " ".join(done.out.split())
    assert "One test" not in swarmevo_("compare", *runs[:2], "--repeats", 2).out


def test_tests_add_up(runs: list[Path], swarmevo_: Swarmevo) -> None:
    first, again = (swarmevo_("compare", *runs[:2], "--repeats", 2, "--json").out for _ in range(2))
    assert first == again
    swarmevo_("compare", *runs[:2], "--repeats", 4)
    assert swarmevo_("compare", *runs[:2], "--repeats", 2, "--json").out == first


def test_runs_are_pooled_against_others(runs: list[Path], swarmevo_: Swarmevo) -> None:
    done = swarmevo_("compare", runs[0], runs[1], "--against", runs[2], "--repeats", 1, "--json")
    groups = json.loads(done.out)["groups"]
    assert [(one["name"], len(one["trials"])) for one in groups] == [("seed-1+seed-2", 4), ("seed-3", 2)]
    done = swarmevo_("compare", runs[0], "--against", runs[1], runs[2], "--repeats", 1, "--json")
    groups = json.loads(done.out)["groups"]
    assert [(one["name"], len(one["trials"])) for one in groups] == [("seed-1", 2), ("seed-2+seed-3", 4)]


def test_the_console_and_the_page(runs: list[Path], swarmevo_: Swarmevo, tmp_path: Path) -> None:
    done = swarmevo_("compare", *runs[:2], "--repeats", 1, "--html", "out/page.html")
    assert done.code == 0, done.err
    assert "seed-1 and seed-2" in done.out
    assert done.err.splitlines()[-1] == "written: out/page.html"
    text = (tmp_path / "out" / "page.html").read_text()
    assert "<script" not in text
    assert text.count("<svg") == 8
    assert "Where a larger share of one group" in text
    assert "all tests but one" not in text  # there is one test


def trial(number: int, tested: float) -> Trial:
    gain = 10 * tested
    return Trial(
        "run", number, 100, tested + 0.1, tested, gain, None, [(50, tested), (100, tested + 0.1)], [[gain, 1.0]]
    )


def planted(*shifts: float) -> Comparison:
    rng = np.random.default_rng(1)
    groups = [
        Group(f"g{i}", ["run"], ["pde"], [trial(k, v) for k, v in enumerate(0.3 + shift + 0.05 * rng.random(10))])
        for i, shift in enumerate(shifts)
    ]
    return Comparison(1, 10, [F1, SIZE], groups, list(comparison._measures(groups, [F1, SIZE])), [])


def test_a_planted_difference_is_named() -> None:
    found = planted(0.0, 0.2)
    (pair,) = found.measures[0].pairs
    assert (pair.a12, pair.low, pair.high) == (0, 0, 0)
    assert pair.p < 0.001
    assert page.pair_table(found.measures[0]).rows[0][-1] == "g1"
    same = planted(0.0, 0.0).measures[0]
    assert page.pair_table(same).rows[0][-1] == "not known"


def test_of_three_groups_the_one_that_differs_is_found() -> None:
    (volume, *_) = planted(0.0, 0.0, 0.2).measures
    assert volume.p is not None
    assert volume.p < 0.001
    assert [pair.p < 0.05 for pair in volume.pairs] == [False, True, True]
    assert page.render(planted(0.0, 0.0, 0.2)).count("<svg") == 6  # no difference of three attainment functions


def test_where_few_trials_meet_many_the_share_that_attained_more_has_its_colour() -> None:
    """Three of eight trials attain what neither of two does."""
    poor, good = ([[2.0, 3.0]], [[8.0, 1.0]])
    fronts = {"x": [poor] * 2, "y": [good] * 3 + [poor] * 5}
    groups = [
        Group(
            name,
            ["run"],
            ["pde"],
            [Trial("run", k, 100, 0.1, 0.1, 2.0, None, [(100, 0.1)], p) for k, p in enumerate(of)],
        )
        for name, of in fronts.items()
    ]
    (axes,) = drawings.attainment_differences(Comparison(1, 10, [F1, SIZE], groups, [], [])).axes
    parts = [part for part in axes.collections if part.get_paths()]
    assert [to_hex(part.get_facecolor()[0]).upper() for part in parts] == [style.colour(1)] * 2
    assert [part.get_alpha() for part in parts] == [0.375, 0.375]


@pytest.mark.parametrize(
    "names",
    [
        [f"mutation_rate={rate},robots={robots}" for rate in (0.01, 0.1, 0.3) for robots in (3, 4, 5)],
        ["+".join(f"seed-{k}" for k in range(20)), "x" * 100],
        [f"g{k}" for k in range(30)],
    ],
)
def test_many_names_and_long_ones_have_room(names: list[str]) -> None:
    """What matplotlib warns of, such as axes that have no room, fails too."""
    shifted = planted(*np.linspace(0, 0.3, len(names)))
    groups = [dataclasses.replace(group, name=name) for group, name in zip(shifted.groups, names, strict=True)]
    found = dataclasses.replace(shifted, groups=groups, measures=list(comparison._measures(groups, [F1, SIZE])))
    assert page.render(found).count("<svg") == 6 + (len(names) == 2)
    for picture in (drawings.optimism(found), drawings.values(found, found.measures[1])):
        picture.draw_without_rendering()
        (axes,) = picture.axes
        labels = [label.get_window_extent() for label in axes.get_yticklabels()]
        assert [label.get_text().replace("\n", "") for label in axes.get_yticklabels()] == names
        assert all(above.y0 >= below.y1 for above, below in itertools.pairwise(labels))
        assert min(label.x0 for label in labels) >= 0
        assert axes.bbox.width > 0.4 * picture.bbox.width
    for picture in (drawings.courses(found), drawings.profiles(found), drawings.attained(found)):
        picture.draw_without_rendering()
        (axes,) = picture.axes
        assert axes.bbox.height > 2 * picture.dpi
        legend = axes.get_legend().get_window_extent()
        assert legend.x0 >= 0
        assert legend.x1 <= picture.bbox.width
        assert legend.y0 >= 0
    panels = drawings.attainment_panels(found)
    panels.draw_without_rendering()
    assert [axes.get_title("left").replace("\n", "") for axes in panels.axes] == names
    assert all(axes.bbox.height > 1.2 * panels.dpi for axes in panels.axes)
    boxes = [axes.get_tightbbox() for axes in panels.axes]
    assert all(box is not None and box.x0 >= 0 and box.x1 <= panels.bbox.width for box in boxes)


def test_where_all_are_the_same_what_there_could_be_is_shown() -> None:
    found = planted(0.0, 0.1)
    never = comparison.measure("success", True, {name: [0.0] * 10 for name in ("g0", "g1")})
    (axes,) = drawings.values(found, never).axes
    assert axes.get_xlim() == pytest.approx((-0.02, 1.02))
    same = comparison.measure("gain", True, {name: [3.0] * 10 for name in ("g0", "g1")})
    (axes,) = drawings.values(found, same).axes
    assert axes.get_xlim() == pytest.approx((-0.2, 10.2))


def test_a_course_is_known_from_the_first_generation_to_the_last() -> None:
    rows = comparison.hypervolume_at([trial(0, 0.5)], np.array([0.0, 49.0, 50.0, 99.0, 100.0, 101.0]))
    assert np.array_equal(rows, [[np.nan, np.nan, 0.5, 0.5, 0.6, np.nan]], equal_nan=True)


# ---- what cannot be compared -----------------------------------------------------------------------------------------


def test_other_worlds_are_refused_and_where_they_differ_is_said(
    runs: list[Path], swarmevo_: Swarmevo, tmp_path: Path
) -> None:
    other = small_runs.make(tmp_path / "other", "box.mass=0.3", "noise.wheels=0.2")
    done = swarmevo_("compare", runs[0], other)
    assert done.code == 2
    (line,) = done.errors
    assert line.startswith(
        f"{other}: expected the world and the fitness of {runs[0]}, but they differ in box.mass: 0.24 and 0.3; "
    )
    assert line.endswith("compare runs of the same task")


def test_another_optimiser_and_budget_are_compared_with_a_note(
    runs: list[Path], swarmevo_: Swarmevo, tmp_path: Path
) -> None:
    other = small_runs.make(tmp_path / "other", "optimiser.pde.mutation_rate=0.1", "evolution.generations=4")
    done = swarmevo_("compare", runs[0], other, "--repeats", 1)
    assert done.code == 0, done.err
    assert "Budgets differ, in episodes of a trial (seed-1 8, other 16)" in done.out


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ([0], "compare: expected at least two runs, got one; name another"),
        ([0, 0], "expected each run once, got it twice; leave one out"),
    ],
)
def test_one_run_is_compared_with_nothing(
    names: list[int], message: str, runs: list[Path], swarmevo_: Swarmevo
) -> None:
    done = swarmevo_("compare", *(runs[i] for i in names))
    assert done.code == 2
    assert message in done.errors[0]


def test_a_changed_plugin_is_told(runs: list[Path], swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("swarmevo.runs.driver.changed_plugins", lambda store: f"{store.folder.name} was changed")
    done = swarmevo_("compare", *runs[:2], "--repeats", 1)
    told = [line for line in done.err.splitlines() if line.startswith("warning: ")]
    assert told == ["warning: seed-1 was changed", "warning: seed-2 was changed"]

# SPDX-License-Identifier: BSD-3-Clause
"""The pages about runs: that they tell how they were made, and are made of small runs without a warning."""

from __future__ import annotations

import shlex
import sys
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

import small_runs
from swarmevo.analysis import census, fronts
from swarmevo.plugins.team import Team, load_config
from swarmevo.protocols import FloatArray
from swarmevo.runs.store import Store

# The benchmarks are not installed. At the end of the path: the installed swarmevo comes first.
sys.path.append(str(Path(__file__).parents[2]))

from benchmarks import choices, deadlocks, hidden_neurons, made_by, results, results_paper, stages


@pytest.mark.parametrize(
    ("name", "overrides", "command"),
    [
        ("paper", ["evolution.seed=1"], "swarmevo evolve paper --seed 1 --out runs/mine"),
        (
            "best",
            ["evolution.seed=1", "evolution.trials=10", "evolution.generations=120"],
            "swarmevo evolve best --seed 1 --trials 10 --set evolution.generations=120 --out runs/mine",
        ),
        ("paper", ["optimiser=cma"], "swarmevo evolve paper --plugin cma --out runs/mine"),
        (
            "best",
            ["fitness.hidden_neurons={}", "optimiser=pde"],
            "swarmevo evolve best --plugin pde --set 'fitness.hidden_neurons={}' --out runs/mine",
        ),
    ],
)
def test_a_page_tells_the_command_that_made_its_run(name: str, overrides: list[str], command: str) -> None:
    assert made_by.evolution(load_config(name, overrides), Path("/elsewhere/mine")) == (name, command)


def test_the_command_makes_the_same_configuration() -> None:
    settings = load_config(
        "paper", ["box.pose=[0, 0.2, 0.5]", "worlds=[{team.robots: 3}]", "vary={box.mass: {uniform: [0.2, 0.3]}}"]
    )
    _, command = made_by.evolution(settings, Path("runs/mine"))
    words = shlex.split(command)
    assert load_config(words[2], [words[i + 1] for i, word in enumerate(words) if word == "--set"]) == settings


def test_what_no_override_makes_is_evolved_from_the_runs_own_configuration() -> None:
    settings = load_config("paper")
    without_options = settings.model_copy(update={"optimiser": {"pde": {}}})
    _, command = made_by.evolution(without_options, Path("runs/mine"))
    assert command == "swarmevo evolve runs/mine/config.yaml --out runs/mine"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_runs.make(tmp_path_factory.mktemp("results") / "small")


def test_the_paper_page_has_its_figures_goals_and_examples(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(results_paper, "FOLDER", tmp_path)
    monkeypatch.setattr(sys, "argv", ["results", str(run), "--paper"])
    with Store.open(run) as store:
        page = results.page(store, repeats=1, robust_repeats=0, with_paper=True)
    assert page.startswith("# Two trials of ")
    assert "python -m benchmarks.results runs/small --paper\n" in page
    assert "| trials that failed | 0 | 2 of 2 |" in page
    for picture in tmp_path.iterdir():
        assert f"]({picture.name})" in page
    assert {"small-evolution.png", "small-fronts.png", "small-paths.png"} <= {one.name for one in tmp_path.iterdir()}


def test_a_behaviours_clearest_example_is_the_stored_episode_with_most_robots(run: Path) -> None:
    with Store.open(run) as store:
        found = results_paper.clearest(store)
        assert found
        for label, example in found.items():
            shares = census.census(example.recording.config, example.recording.telemetry)
            assert shares[label] == example.share > 0
            assert int(example.recording.episodes.hash[0]) == example.chosen.hash


def test_pressing_is_counted_from_the_first_homing_on(run: Path) -> None:
    with Store.open(run) as store:
        tested = results.assessment.assess(store, repeats=1).controllers
        shares = results_paper.pressing(store, tested, robots=3)
    assert all(0 <= share <= 1 for share in shares)
    assert shares[2] <= shares[1] <= 1
    assert np.isfinite(shares).all()


def test_how_fast_a_trial_learns_is_the_push_rate_of_each_tenth_of_its_generations(run: Path) -> None:
    with Store.open(run) as store:
        last = results.learning(store).splitlines()[-1]
        trial = store.trials()[-1]
        pushed = np.isfinite(store.generation(trial, store.generations(trial) - 1).episodes["push_time"])
    assert last.startswith(f"| {trial} |")
    assert last.endswith(f"| {100 * pushed.mean():.0f} % |")


def test_of_each_number_of_hidden_neurons_who_pushed_most_in_evolution_is_tested(run: Path) -> None:
    with Store.open(run) as store:
        found = hidden_neurons.best(store)
        points = [point for trial in store.trials() for point in fronts.front(store, trial)]
        row = hidden_neurons.row(store, *next(iter(found.items())), tests=1)
    assert list(found) == sorted({point.objectives["hidden_neurons"] for point in points})
    for point in points:
        assert point.push_interval[0] <= found[int(point.objectives["hidden_neurons"])].push_interval[0]
    assert len(row) == len(hidden_neurons.HEAD)


@pytest.mark.parametrize("trials", [1, 2, 4, 7])
def test_of_every_choice_of_trials_the_one_that_pushes_most_is_chosen(trials: int) -> None:
    rates = np.random.default_rng(5).integers(8, 11, (7, 3)) / 10  # some are equal in the mean
    every = list(combinations(range(7), trials))
    chosen = [max(choice, key=lambda i: rates[i].mean()) for choice in every]
    np.testing.assert_allclose(choices.chances(rates, trials), np.bincount(chosen, minlength=7) / len(every))


def test_the_page_of_choices_judges_by_other_tests_than_it_chooses_by(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "two.csv").write_text("1,2\n3,4\n")

    def push_rates(genomes: FloatArray, tests: int, seed: int) -> FloatArray:
        first = np.array([[0.98, 0.98, 1.0], [1.0, 1.0, 1.0]])
        return first if seed == choices.CHOOSING else first[::-1]

    monkeypatch.setattr(choices, "push_rates", push_rates)
    said = choices.page([tmp_path / "two.csv"], trials=2, tests=7)
    assert "| two, 0 | 98.0 % | 98.0 % | 100.0 % | 100.0 % | 100.0 % | 100.0 % | yes |" in said
    assert "| 1 | 2 | 50.0 % |\n| 2 | 1 | 0.0 % |" in said  # the second was chosen, and falls short
    with pytest.raises(SystemExit, match="--trials 3: expected at most as many as the files have rows, 2"):
        choices.page([tmp_path / "two.csv"], trials=3, tests=7)


# ---- when a search decides -------------------------------------------------------------------------------------------


def test_a_stage_is_the_mean_of_what_was_asked_for_before_it(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stages, "LAST", 1)
    with Store.open(run) as store:
        found = stages.means(store, 1, [1, 2])
        asked = [store.genome(id) for id in store.genome_ids(1, 1).tolist()]
    assert found.shape == (2, len(asked[0]))
    np.testing.assert_array_equal(found[1], np.mean(asked, axis=0))


def test_the_page_of_stages_has_a_row_a_trial(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def push_rates(genomes: FloatArray, tests: int, seed: int) -> FloatArray:
        return np.array([[0.5, 0.5, 0.2], [0.9, 0.9, 0.9], [0.8, 0.8, 0.8], [1.0, 1.0, 1.0]])

    monkeypatch.setattr(stages, "LAST", 1)
    monkeypatch.setattr(stages, "push_rates", push_rates)
    said = stages.page([run], [1, 2], tests=7)
    assert "| run, trial | 1 | 2 |" in said
    assert "| small, 0 | 40.0 % | 90.0 % |\n| small, 1 | 80.0 % | 100.0 % |" in said
    assert "with the last column: 1.00." in said
    assert "--out runs/small\n" in said


def test_a_page_writes_the_best_of_each_trial(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["results", str(run), "--repeats", "1", "--genomes", str(tmp_path / "best.csv")])
    results.main()
    with Store.open(run) as store:
        firsts = [store.genome(fronts.front(store, trial)[0].genome) for trial in store.trials()]
        chosen = results.assessment.most_successful(store).genome
    np.testing.assert_array_equal(np.loadtxt(tmp_path / "best.csv", delimiter=","), firsts)
    assert f"The most successful, in the mean over the teams: individual {chosen}." in capsys.readouterr().out


# ---- why teams fail --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("places", "fault"),
    [
        ([(-0.08, 0.22), (0.0, 0.22), (0.05, 0.468)], deadlocks.BEHIND),
        ([(-0.08, 0.22), (0.0, 0.22), (0.2, 0.468)], deadlocks.FEW),  # beside it
        ([(-0.08, 0.22), (0.0, 0.22), (0.1, 0.0)], deadlocks.FEW),
        ([(-0.08, 0.22), (0.0, 0.22), (0.1, 0.22), (0.4, 0.4)], deadlocks.MANY),
    ],
)
@pytest.mark.parametrize("turn", [0.0, 0.1, -0.1])
def test_a_team_that_fails_is_stuck_in_something(places: list[tuple[float, float]], fault: str, turn: float) -> None:
    box = np.array([0.01, 0.345, turn])
    turning = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    robots = np.column_stack([(np.array(places) - [0, 0.345]) @ turning + box[:2], np.zeros(len(places))])
    assert deadlocks.fault(robots, box, load_config("paper")) == fault


def test_a_robot_is_wedged_where_it_touches_wall_and_corner() -> None:
    settings = load_config("paper")
    (x, y), box = deadlocks.wedge(settings), np.array(settings.box.pose)
    assert (np.hypot(x - 0.1375, y - 0.435), 0.5 - y) == pytest.approx((0.0355, 0.0355))
    for side in (x, -x):
        assert deadlocks.fault(np.array([[side, y, 0]]), box, settings) == deadlocks.WEDGED
        assert deadlocks.fault(np.array([[1.01 * side, y, 0]]), box, settings) == deadlocks.FEW
        assert deadlocks.fault(np.array([[side, y - 0.001, 0]]), box, settings) == deadlocks.FEW


def test_the_page_of_deadlocks_counts_each_team_that_fails(tmp_path: Path) -> None:
    """Robots that stand still are never at the face."""
    size = Team(load_config("paper", ["controller={feedforward: {hidden: 1}}"])).space.size
    np.savetxt(tmp_path / "still.csv", np.zeros((2, size)), delimiter=",")
    said = deadlocks.page([tmp_path / "still.csv"], tests=1)
    assert "| 4 | 2 | 100.0 % | 100.0 % | 100.0 % | 100.0 % | 100.0 % | 100.0 % |" in said
    assert said.count("| 4 | 2 | 0 | 0 | 2 | 0 |") == 2  # with each bumper
    assert "| 4 | 0.0 % | 0.0 % | 0.0 % | 0.0 % |" in said
    assert said.count("| still, 1 | 0 % | 0 % |") == 2  # pairs, corners

# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import json
import multiprocessing
import os
import signal
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import moocore
import numpy as np
import pytest

import toy_plugins
from conftest import Distribution, installer
from swarmevo import config as configuration
from swarmevo.analysis import fronts
from swarmevo.config import Config
from swarmevo.errors import ConfigError, EvaluationError, Interrupted, PluginError, StoreError
from swarmevo.evolution import loop, threads
from swarmevo.evolution.evaluation import to_costs
from swarmevo.evolution.loop import Progress
from swarmevo.plugins.team import never
from swarmevo.runs.database import DATABASE_FILE
from swarmevo.runs.driver import begin, evolve
from swarmevo.runs.store import Store

GENERATIONS, TRIALS = 3, 2


@pytest.fixture(autouse=True)
def _toys(distribution: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    toy_plugins.install(distribution)
    monkeypatch.setattr(threads, "JOB_SECONDS", 0.0)  # one episode a job: 1 + n * r questions whether to stop


class StopAt:
    """Answers no until it has been asked some times, then yes for good."""

    def __init__(self, times: int) -> None:
        self._left = times

    def __call__(self) -> bool:
        self._left -= 1
        return self._left <= 0


def ignore(progress: Progress) -> None:
    pass


def run(
    folder: Path,
    workers: int = 1,
    observe: Callable[[Progress], None] = ignore,
    stop: Callable[[], bool] = never,
) -> None:
    """Begin a run if there is none yet, and go on with it."""
    if not folder.exists():
        begin(folder, toy_plugins.config())
    with Store.open(folder, readonly=False) as store:
        evolve(store, workers, observe, stop)


def content(folder: Path) -> dict[str, list[tuple[Any, ...]]]:
    """Return all that a run stored, but times."""
    with closing(sqlite3.connect(folder / DATABASE_FILE)) as database:
        queries = {table: f"SELECT * FROM {table}" for table in ("run", "genome", "individual", "episode", "optimiser")}
        queries["generation"] = "SELECT trial, number FROM generation"
        return {table: database.execute(query).fetchall() for table, query in queries.items()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[tuple[Any, ...]]]:
    """What a run that was never interrupted stored."""
    folder = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as monkeypatch:
        toy_plugins.install(installer(folder, monkeypatch))
        run(folder / "run")
    return content(folder / "run")


# ---- a run -----------------------------------------------------------------------------------------------------------


def test_a_run_stores_every_generation_of_every_trial(tmp_path: Path) -> None:
    run(tmp_path / "run")
    with Store.open(tmp_path / "run") as store:
        assert store.trials() == [0, 1]
        for trial in range(TRIALS):
            assert store.generations(trial) == GENERATIONS
            assert [len(store.generation(trial, number).genomes) for number in range(GENERATIONS)] == [4, 5, 6]
            state = store.state(trial)
            assert state is not None
            assert state["told"] == GENERATIONS
        assert store.totals().episodes == TRIALS * (4 + 5 + 6) * 2


def test_a_folder_knows_where_its_run_comes_from(tmp_path: Path) -> None:
    chosen = toy_plugins.config()
    begin(tmp_path / "run", chosen)
    assert configuration.load(tmp_path / "run" / "config.yaml") == chosen
    origin = json.loads((tmp_path / "run" / "provenance.json").read_text())
    assert any(plugin.startswith("optimiser.toy_search (toys 1.0") for plugin in origin["plugins"])
    assert origin["library"]["build"]
    assert origin["python"]


def test_the_same_seed_gives_the_same_bits_on_any_number_of_workers(
    tmp_path: Path, whole: dict[str, list[tuple[Any, ...]]]
) -> None:
    run(tmp_path / "two", workers=2)
    assert content(tmp_path / "two") == whole


def test_trials_differ(whole: dict[str, list[tuple[Any, ...]]]) -> None:
    hashes = [row[-1] for row in whole["episode"]]
    assert len(set(hashes)) == len(hashes)


def test_progress_tells_where_the_run_stands(tmp_path: Path) -> None:
    seen: list[Progress] = []
    run(tmp_path / "run", observe=seen.append)
    places = [(trial, generation) for trial in range(TRIALS) for generation in range(GENERATIONS)]
    assert [(p.trial, p.generation) for p in seen] == places
    assert [p.episodes for p in seen] == np.cumsum([8, 10, 12] * 2).tolist()
    assert {(p.trials, p.generations) for p in seen} == {(TRIALS, GENERATIONS)}
    assert all(p.episodes_per_second > 0 for p in seen)
    assert [p.eta_seconds > 0 for p in seen] == [True] * 5 + [False]
    with Store.open(tmp_path / "run") as store:
        for p in seen:
            means = store.generation(p.trial, p.generation).episodes.grid("objective").mean(axis=1)
            assert list(p.best) == ["travel", "distance", "neurons"]
            np.testing.assert_allclose(list(p.best.values()), [means[:, 0].max(), *means[:, 1:].min(axis=0)])
            front = moocore.filter_dominated(to_costs(store.objectives, means))
            assert p.front_size == len(front)


OPPOSED = """
    import numpy as np
    from swarmevo.protocols import Objective

    class Opposed:
        objectives = tuple(Objective(name, "minimise", (0.0, 100.0)) for name in ("above", "below"))
        channels = ()

        def evaluate(self, telemetry, genomes, controller):
            gene = np.round(np.tanh(genomes[:, 0]) * 2**20) / 2**20  # sums are exact
            return np.stack([1 - gene, 1 + gene], axis=1)
"""


def test_a_front_that_would_fill_the_population_leaves_room_for_new_genomes(
    tmp_path: Path, distribution: Distribution
) -> None:
    """Case 50: nobody dominates anybody; whom PDE leaves out stays on the run's front."""
    distribution("opposed", "1.0", {"swarmevo.fitness": {"opposed": "opposed:Opposed"}}, opposed=OPPOSED)
    budget = {"generations": 12, "population": 6, "trials": 2, "repeats": 1}
    begin(tmp_path / "run", toy_plugins.config(optimiser="pde", fitness="opposed", evolution=budget))
    seen: list[Progress] = []
    run(tmp_path / "run", observe=seen.append)
    assert all(progress.new_genomes > 0 for progress in seen)
    with Store.open(tmp_path / "run") as store:
        for trial in range(TRIALS):
            steps = fronts.history(store, trial)
            assert [step.new_genomes for step in steps] == [p.new_genomes for p in seen if p.trial == trial]
            assert sum(step.new_genomes for step in steps) == store.totals(trial).genomes
            front = fronts.front(store, trial)
            objectives = {tuple(row) for row in store.individuals(trial).objectives}
            assert {tuple(point.objectives.values()) for point in front} == objectives
            assert any(point.last_generation < budget["generations"] - 1 for point in front)


def test_the_optimisers_random_numbers_are_of_the_trial_alone(tmp_path: Path) -> None:
    run(tmp_path / "run")
    with Store.open(tmp_path / "run") as store:
        for trial in range(TRIALS):
            rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence([7, trial, 0x0B7])))
            np.testing.assert_array_equal(store.generation(trial, 0).genomes, rng.standard_normal((4, 36)))


def test_a_team_of_individuals_and_a_controller_in_python_evolve(tmp_path: Path) -> None:
    begin(tmp_path / "run", toy_plugins.config(team={"genomes": "individual"}, controller="toy_linear"))
    run(tmp_path / "run")
    with Store.open(tmp_path / "run") as store:
        assert store.generation(1, 2).genomes.shape == (6, 2 * 28)


# ---- interrupted and continued ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("times", [1, 2, 8, 9, 10, 20, 21, 34, 63])
def test_a_run_stopped_anywhere_goes_on_as_if_it_had_not_been(
    tmp_path: Path, whole: dict[str, list[tuple[Any, ...]]], times: int
) -> None:
    with pytest.raises(Interrupted):
        run(tmp_path / "run", stop=StopAt(times))
    assert content(tmp_path / "run") != whole
    run(tmp_path / "run", workers=2)
    assert content(tmp_path / "run") == whole


def test_a_run_stopped_after_each_generation_goes_on_as_if_it_had_not_been(
    tmp_path: Path, whole: dict[str, list[tuple[Any, ...]]]
) -> None:
    stored: list[Progress] = []
    for number in range(1, GENERATIONS * TRIALS):
        with pytest.raises(Interrupted):
            run(tmp_path / "run", observe=stored.append, stop=lambda number=number: len(stored) == number)  # type: ignore[misc]
    run(tmp_path / "run", observe=stored.append)
    assert len(stored) == GENERATIONS * TRIALS
    assert content(tmp_path / "run") == whole


@pytest.mark.parametrize("where", ["after a generation", "within a generation", "before the commit"])
def test_a_run_that_was_killed_goes_on_as_if_it_had_not_been(
    tmp_path: Path, whole: dict[str, list[tuple[Any, ...]]], where: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "run"

    def die(*_: object) -> Any:
        os.kill(os.getpid(), signal.SIGKILL)

    def go_on_and_die() -> None:
        if where == "after a generation":
            run(folder, observe=die)
        elif where == "within a generation":
            stop = StopAt(15)
            run(folder, stop=lambda: stop() and die())
        else:
            monkeypatch.setattr(Store, "_insert_genomes", die)
            run(folder)

    for _ in range(2):
        child = multiprocessing.get_context("fork").Process(target=go_on_and_die)
        child.start()
        child.join(60)
        assert child.exitcode == -signal.SIGKILL
    run(folder)
    assert content(folder) == whole


def test_a_finished_run_is_left_alone(tmp_path: Path, whole: dict[str, list[tuple[Any, ...]]]) -> None:
    run(tmp_path / "run")
    seen: list[Progress] = []
    run(tmp_path / "run", observe=seen.append)
    assert seen == []
    assert content(tmp_path / "run") == whole


def test_two_processes_cannot_evolve_one_run(tmp_path: Path) -> None:
    def second(progress: Progress) -> None:
        with pytest.raises(StoreError, match="is writing it"):
            run(tmp_path / "run")

    run(tmp_path / "run", observe=second)


def test_a_run_can_be_read_while_it_evolves(tmp_path: Path) -> None:
    def look(progress: Progress) -> None:
        with Store.open(tmp_path / "run") as store:
            assert store.generations(progress.trial) == progress.generation + 1

    run(tmp_path / "run", observe=look)


# ---- what is wrong ---------------------------------------------------------------------------------------------------


def bad_optimiser(fault: str, at: int = 1) -> Config:
    return toy_plugins.config(optimiser={"toy_bad_optimiser": {"fault": fault, "at": at}})


@pytest.mark.parametrize("at", [0, 1])
@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("ask raises", "ask, .*: raised KeyError: 'nobody"),
        ("list", "ask, .*: expected a NumPy array, got list"),
        ("dtype", "ask, .*: expected dtype float64, got float32"),
        ("axes", r"ask, .*: expected the shape \(n, 36\) with n >= 1, got \(36,\)"),
        ("size", r"ask, .*: expected the shape \(n, 36\) with n >= 1, got \(., 35\)"),
        ("none", r"ask, .*: expected the shape \(n, 36\) with n >= 1, got \(0, 36\)"),
        ("nan", "ask, .*: expected finite numbers, got nan in genome 1, gene 2"),
        ("tell raises", "tell, .*: raised KeyError: 'nobody"),
        ("tell writes", "tell, .*: raised ValueError: assignment destination is read-only"),
        ("state", r"state, .*: state\['rng'\]: expected a number, .*, got Generator"),
    ],
)
def test_an_optimiser_that_fails_is_named_and_what_is_stored_stays(
    tmp_path: Path, fault: str, told: str, at: int
) -> None:
    begin(tmp_path / "run", bad_optimiser(fault, at))
    with pytest.raises(PluginError, match=told) as error:
        run(tmp_path / "run")
    message = str(error.value)
    assert message.startswith("optimiser.toy_bad_optimiser (toys 1.0): ")
    assert f", trial 0, generation {at}: " in message
    assert "repair the plugin, then resume" in message
    assert "\n" not in message
    with Store.open(tmp_path / "run") as store:
        assert store.generations(0) == at


def test_a_repaired_optimiser_goes_on(
    tmp_path: Path, whole: dict[str, list[tuple[Any, ...]]], monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as broken:
        broken.setattr(toy_plugins.Search, "restore", None)
        broken.setattr(toy_plugins.Search, "tell", _raise_in_second)
        with pytest.raises(PluginError, match="raised RuntimeError: not yet"):
            run(tmp_path / "run")
    run(tmp_path / "run")
    assert content(tmp_path / "run") == whole


def _raise_in_second(search: Any, genomes: Any, costs: Any, tell: Any = toy_plugins.Search.tell) -> None:
    if search._told == 1:
        raise RuntimeError("not yet")
    tell(search, genomes, costs)


def test_an_optimiser_that_cannot_restore_is_named(tmp_path: Path) -> None:
    begin(tmp_path / "run", bad_optimiser("restore raises"))
    with pytest.raises(Interrupted):
        run(tmp_path / "run", stop=StopAt(12))
    with pytest.raises(PluginError, match="restore, trial 0, generation 1: raised KeyError"):
        run(tmp_path / "run")


@pytest.mark.parametrize(
    ("section", "error"),
    [
        ({"optimiser": "nobody"}, PluginError),
        ({"optimiser": {"toy_bad_optimiser": {}}}, PluginError),
        ({"fitness": {"toy_bad_fitness": {"fault": "channel"}}}, EvaluationError),
    ],
)
def test_a_configuration_that_cannot_be_run_makes_no_folder(
    tmp_path: Path, section: dict[str, Any], error: type[Exception]
) -> None:
    with pytest.raises(error):
        begin(tmp_path / "run", toy_plugins.config(**section))
    assert not (tmp_path / "run").exists()


def test_what_only_an_evaluation_shows_makes_no_folder_either(tmp_path: Path) -> None:
    bad = toy_plugins.config(fitness={"toy_bad_fitness": {"fault": "raises"}})
    with pytest.raises(ConfigError, match=r"^fitness\.toy_bad_fitness .*: evaluate raised .* \(found in a rehearsal"):
        begin(tmp_path / "run", bad)
    assert not (tmp_path / "run").exists()


def test_a_run_that_is_to_go_on_after_faults_begins(tmp_path: Path) -> None:
    fitness = {"toy_bad_fitness": {"fault": "raises"}}
    begin(tmp_path / "run", toy_plugins.config(fitness=fitness, evolution={"on_fault": "worst"}))
    assert (tmp_path / "run").exists()


def test_a_run_is_not_continued_with_plugins_that_measure_something_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin(tmp_path / "run", toy_plugins.config())
    monkeypatch.setattr(toy_plugins.Travel, "objectives", toy_plugins.Travel.objectives[::-1])
    with pytest.raises(StoreError, match="the plugins now have"):
        run(tmp_path / "run")


def test_the_time_to_go_is_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(np.cumsum([0.0, 1.0, 0.0, 2.0, 0.0, 6.0, 0.0, 3.0, 0.0, 3.0, 0.0, 3.0]).tolist())
    monkeypatch.setattr(loop, "perf_counter", lambda: next(clock))
    monkeypatch.setattr(loop, "RECENT_GENERATIONS", 2)
    seen: list[Progress] = []
    run(tmp_path / "run", observe=seen.append)
    assert [p.eta_seconds for p in seen] == pytest.approx([5 * 1.0, 4 * 1.5, 3 * 4.0, 2 * 4.5, 1 * 3.0, 0.0])
    assert [p.episodes_per_second for p in seen][:3] == [8 / 1, 10 / 2, 12 / 6]

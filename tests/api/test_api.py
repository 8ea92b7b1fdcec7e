# SPDX-License-Identifier: BSD-3-Clause
"""The public interface as its docstring has it."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swarmevo as se
from swarmevo.errors import InvalidArgument
from swarmevo.protocols import CHANNELS
from swarmevo.runs.store import Store

SMALL = {
    "episode.horizon": 4,
    "team.robots": 3,
    "evolution.population": 6,
    "evolution.generations": 2,
    "evolution.trials": 2,
    "evolution.repeats": 1,
}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> se.Run:
    return se.evolve("quick", seed=5, out=tmp_path_factory.mktemp("runs") / "small", set=SMALL)


@pytest.fixture(scope="module")
def best(run: se.Run) -> se.Individual:
    return run.front().best()


def hashes(folder: Path) -> list[list[int]]:
    with Store.open(folder) as store:
        return [store.generation(trial, number).episodes["hash"].tolist() for trial in (0, 1) for number in (0, 1)]


# ---- the package -----------------------------------------------------------------------------------------------------


def test_every_name_is_there_and_nothing_is_loaded_before_it_is_used() -> None:
    code = (
        "import sys, swarmevo as se\n"
        "assert not [name for name in sys.modules if name.startswith(('numpy', 'cffi', 'pydantic', 'swarmevo.'))"
        " and name != 'swarmevo._version']\n"
        "assert set(se.__all__) <= set(dir(se))\n"
        "for name in se.__all__: getattr(se, name)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_name_that_is_not_there() -> None:
    with pytest.raises(AttributeError, match="module 'swarmevo' has no attribute 'evolv'"):
        se.evolv  # noqa: B018


def test_errors_have_one_base() -> None:
    for error in (se.ConfigError, se.EvaluationError, se.PluginError, se.SimulatorError, se.StoreError):
        assert issubclass(error, se.SwarmevoError)
    with pytest.raises(se.SwarmevoError, match=r"evolution\.generation: .*did you mean evolution\.generations"):
        se.load_config("quick", {"evolution.generation": 3})


# ---- evolving --------------------------------------------------------------------------------------------------------


def test_the_same_bits_as_the_command_line(run: se.Run, tmp_path: Path) -> None:
    settings = [f"{key}={value}" for key, value in SMALL.items()]
    command = [sys.executable, "-m", "swarmevo", "evolve", "quick", "--seed", "5", "--out", str(tmp_path / "run")]
    subprocess.run([*command, "--set", *settings], check=True, capture_output=True)
    assert hashes(run.folder) == hashes(tmp_path / "run")


def test_an_interrupted_run_is_resumed_to_the_same_bits(run: se.Run, tmp_path: Path) -> None:
    seen: list[Any] = []
    with pytest.raises(se.errors.Interrupted):
        se.evolve("quick", seed=5, out=tmp_path / "run", set=SMALL, observe=seen.append, stop=lambda: len(seen) > 1)
    assert len(seen) == 2
    assert hashes(se.resume(tmp_path / "run").folder) == hashes(run.folder)


def test_a_run_is_made_longer(tmp_path: Path) -> None:
    short = se.evolve("quick", seed=1, out=tmp_path / "run", set={**SMALL, "evolution.generations": 1})
    se.resume(short.folder, generations="+1")
    assert [len(trial.history) for trial in short.summary().trials] == [2, 2]


def test_a_configuration_that_was_read_can_be_changed(tmp_path: Path) -> None:
    settings = se.load_config("quick", SMALL)
    made = se.evolve(
        settings, seed=9, out=tmp_path / "run", set={"evolution.trials": 1, "noise.infrared": np.float64(0)}
    )
    assert (made.config.evolution.trials, made.config.noise.infrared, made.seed) == (1, 0.0, 9)
    assert settings.evolution.trials == 2


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: se.load_config({"team": {}}), "config: expected a YAML file, .*, got dict; single keys are for set"),  # type: ignore[arg-type]
        (lambda: se.evolve(3), "config: expected a YAML file, .*, got int; "),  # type: ignore[arg-type]
        (lambda: se.load_config("quick", ["team.robots=3"]), "set: expected .*, got "),  # type: ignore[arg-type]
    ],
)
def test_what_is_no_configuration_is_one_line(call: Callable[[], object], message: str) -> None:
    with pytest.raises(se.ConfigError, match=f"^{message}"):
        call()


@pytest.mark.parametrize(
    ("set", "message"),
    [
        ({"team.robots": object()}, "team.robots: expected a number, text, list or mapping, got object"),
        ({"team.robots": float("nan")}, "team.robots: expected a whole number from 1 to 64, got"),
        ({"robots": 3}, "robots: unknown key; did you mean team.robots"),
    ],
)
def test_a_wrong_setting_is_one_line_and_no_folder(tmp_path: Path, set: dict[str, Any], message: str) -> None:
    with pytest.raises(se.ConfigError, match=message) as caught:
        se.evolve("quick", out=tmp_path / "run", set=set)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "run").exists()


def test_a_folder_that_is_no_run() -> None:
    with pytest.raises(se.StoreError, match=r"expected a run folder, but there is no run\.sqlite in it"):
        se.open("nowhere")


# ---- fronts and individuals ------------------------------------------------------------------------------------------


def test_a_front_is_a_table_of_individuals(run: se.Run) -> None:
    front = run.front()
    frame = front.frame()
    assert len(frame) == len(front) == len(front.rows) >= 1
    assert frame["box_pushing"].tolist() == [one.objectives["box_pushing"] for one in front]
    assert front.best().id == front[0].id == int(frame["genome"][frame["box_pushing"].idxmax()])
    assert front.best("hidden_neurons").objectives["hidden_neurons"] == frame["hidden_neurons"].min()
    assert [one.id for one in front[:1]] == [front[0].id]
    assert {one.trial for trial in (0, 1) for one in run.front(trial)} == {0, 1}
    with pytest.raises(
        se.SwarmevoError, match="expected one of the objectives box_pushing, hidden_neurons, got 'speed'"
    ):
        front.best("speed")


def test_an_individual_is_simulated_with_all_telemetry(best: se.Individual) -> None:
    found = best.simulate(4, robots=2, set={"noise.wheels": 0.0})
    assert {name: found.telemetry.channels[name].shape[:2] for name in CHANNELS} == dict.fromkeys(CHANNELS, (4, 40))
    assert (found.homing_time.shape, found.push_time.shape, found.values.shape) == ((4, 2), (4,), (4, 2))
    again = best.simulate(2, robots=2, set={"noise.wheels": 0.0}, threads=1)
    assert again.episodes.hash.tolist() == found.episodes.hash.tolist()[:2]
    assert best.simulate(1, seed=1).episodes.hash != best.simulate(1, seed=2).episodes.hash


def test_tests_are_those_of_the_command_line(run: se.Run, best: se.Individual) -> None:
    rates = best.test(5)
    (table,) = [one for one in run.table_ii((3,)).controllers if (one.trial, one.genome) == (best.trial, best.id)]
    assert rates.outcome == table.outcomes[0]
    assert rates.push[0] <= rates.outcome.push_rate <= rates.push[1]
    assert rates.homing[0] <= rates.outcome.homing_rate <= rates.homing[1]


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({"episodes": 0}, InvalidArgument, "episodes: expected 1 to 65535, got 0"),
        ({"seed": -1}, InvalidArgument, "seed: expected 0 to"),
        ({"robots": 0}, InvalidArgument, "team.robots: expected 1 to 64 robots, got 0"),
        ({"set": {"evolution.seed": 1}}, se.ConfigError, "expected a key of the world"),
    ],
)
def test_what_cannot_be_simulated_is_one_line(
    best: se.Individual, given: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message) as caught:
        best.simulate(**given)
    assert "\n" not in str(caught.value)


def test_a_replay_is_a_page(best: se.Individual, tmp_path: Path) -> None:
    stored, fresh, three = best.replay(), best.replay(seed=7), best.replay(robots=2)
    assert stored.save(tmp_path / "best.html").read_text() == stored.html
    assert len({stored.html, fresh.html, three.html}) == 3
    assert "seed 7" in fresh.html


def test_a_stored_episode_that_differs_is_refused(run: se.Run, monkeypatch: pytest.MonkeyPatch) -> None:
    best = run.front().best()
    best.genes = best.genes + 1.0  # what is replayed is what is stored
    assert best.replay().html == run.front().best().replay().html


def test_a_run_is_verified(run: se.Run) -> None:
    assert run.verify(sample=3).is_sound


# ---- how they show themselves ----------------------------------------------------------------------------------------


def test_objects_show_themselves_in_short(run: se.Run, best: se.Individual) -> None:
    shown = [run, run.front(), best, best.simulate(2), best.test(2), best.replay()]
    for thing in shown:
        assert len(repr(thing)) < 160
        assert "\n" not in repr(thing)
        assert thing._repr_html_().startswith("<")
    assert repr(run) == f"<Run {run.folder}: 2 trials, 4 of 4 generations, seed 5>"
    assert repr(best).startswith(f"<Individual {best.id} of trial {best.trial}: box_pushing ")


def test_a_name_of_a_run_cannot_become_markup(tmp_path: Path) -> None:
    settings = {**SMALL, "evolution.trials": 1, "evolution.generations": 1}
    run = se.evolve("quick", seed=1, out=tmp_path / "<b>run", set=settings)
    for thing in (run, run.front(), run.front()[0].replay()):
        assert "<b>" not in thing._repr_html_()


def test_what_has_no_effect_is_refused(tmp_path: Path, run: se.Run) -> None:
    """Cases 33 and 75."""
    with pytest.raises(se.ConfigError, match=r"^evolution\.seed: set twice, by evolution\.seed=1 and by evolution"):
        se.evolve("quick", seed=2, set={"evolution.seed": 1}, out=tmp_path / "new")
    with pytest.raises(se.ConfigError, match=r"^workers: expected 0 with a scheduler, whose workers are used, got 2$"):
        se.evolve("quick", workers=2, scheduler="tcp://nowhere:1", out=tmp_path / "new")
    with pytest.raises(se.ConfigError, match=r"^workers: "):
        se.resume(run.folder, workers=2, scheduler="tcp://nowhere:1", generations="+1")
    deep: list[Any] = []
    for _ in range(100_000):
        deep = [deep]
    with pytest.raises(se.ConfigError, match="got list nested too deeply"):  # case 27
        se.evolve("quick", set={"optimiser.pde.crossover_rate": deep}, out=tmp_path / "new")
    assert not (tmp_path / "new").exists()
    assert se.open(run.folder).config.evolution.generations == 2

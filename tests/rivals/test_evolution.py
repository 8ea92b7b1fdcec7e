# SPDX-License-Identifier: BSD-3-Clause
"""Runs with CMA-ES: found by its entry point, interrupted, continued to the same bits."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import small_runs
import toy_plugins
from swarmevo import plugins
from swarmevo.config import changed, load
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.evolution.optimiser import CheckedOptimiser
from swarmevo.runs import driver, verification
from swarmevo.runs.store import Store

OPTIONS = {"sigma": 0.5, "weights": [1.0, 1.0, 0.0], "restarts": "bipop"}


@pytest.fixture(autouse=True)
def _toys(distribution: Callable[..., Any]) -> None:
    toy_plugins.install(distribution)


def config(**evolution: Any) -> Any:
    return toy_plugins.config(optimiser={"cma": OPTIONS}, evolution=evolution)


def run(folder: Path, generations: int = 1_000) -> list[Any]:
    """Continue a run by some generations; return what is stored of each trial."""

    class Enough(Exception):  # noqa: N818 - no error
        pass

    left = [generations]

    def observe(progress: Any) -> None:
        left[0] -= 1
        if not left[0]:
            raise Enough

    with Store.open(folder, readonly=False) as store:
        with suppress(Enough):
            driver.evolve(store, 1, observe)
        return [
            (trial, store.generation(trial, number).genomes.tobytes(), store.generation(trial, number).episodes["hash"])
            for trial in range(2)
            for number in range(store.generations(trial))
        ]


def test_it_is_a_plugin_of_a_distribution_of_its_own() -> None:
    entry = plugins.find("optimiser", "cma")
    assert (entry.distribution, entry.target) == ("swarmevo-rivals", "swarmevo_rivals.cma:CMAES")
    (report,) = plugins.check("cma")
    assert report.error is None


def test_a_run_that_is_left_after_each_generation_has_the_same_bits(tmp_path: Path) -> None:
    whole, cut = (driver.begin(tmp_path / name, config(generations=5)) for name in ("whole", "cut"))
    expected = run(whole)
    assert len(expected) == 10
    for _ in range(9):
        run(cut, generations=1)
    np.testing.assert_equal(run(cut), expected)
    with Store.open(cut) as store:
        assert verification.verify(store, 1).is_sound


@pytest.mark.parametrize("name", ["como_cma", "nsga2"])
def test_a_run_whose_process_is_killed_goes_on_to_the_same_bits(tmp_path: Path, name: str) -> None:
    generations = 20
    changes = ("evolution.population=12", f"evolution.generations={generations}", f"optimiser={name}")
    settings = changed(load("quick", small_runs.SMALL), changes, plugins.option_errors)
    whole, cut = (driver.begin(tmp_path / place, settings) for place in ("whole", "cut"))
    expected = run(whole)
    assert len(expected) == 2 * generations
    for wanted in (3, 12):
        command = [sys.executable, "-m", "swarmevo", "resume", str(cut), "--workers", "1"]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while stored_generations(cut) < wanted:
            assert process.poll() is None
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL
    assert 12 <= stored_generations(cut) < 2 * generations
    np.testing.assert_equal(run(cut), expected)


def stored_generations(folder: Path) -> int:
    with Store.open(folder) as store:
        return store.totals().generations


def test_the_host_gets_its_answer(tmp_path: Path) -> None:
    with Evaluator(config(), workers=1) as evaluator:
        optimiser = CheckedOptimiser(config(), evaluator, trial=0)
        optimiser.start_from(np.ones((1, evaluator.space.size)))
        assert optimiser.answer(0).shape == (0, evaluator.space.size)
        genomes = optimiser.ask(0)
        assert abs(genomes.mean() - 1) < 0.3
        optimiser.tell(0, genomes, genomes[:, :3], genomes[:, :0])
        assert optimiser.answer(1).shape == (1, evaluator.space.size)

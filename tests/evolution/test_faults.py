# SPDX-License-Identifier: BSD-3-Clause
"""Episodes that fail: the run ends with a line that names them, or they get the worst objectives and it goes on."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import toy_plugins
from conftest import Distribution
from swarmevo.config import Config
from swarmevo.errors import EvaluationError, Interrupted
from swarmevo.evolution import evaluation, processes
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.evolution.results import Results
from swarmevo.protocols import FloatArray
from swarmevo.runs.driver import begin, evolve
from swarmevo.runs.store import Store

BAD = 5.0  # first gene of a genome that makes the plugins below fail

MOODY = """
import os, signal
import numpy as np
import toy_plugins

def fail(fault):
    if fault == "raises":
        raise KeyError("nobody\\nhome")
    if fault == "hangs":
        while True:
            pass
    if fault == "dies":
        os.kill(os.getpid(), signal.SIGSEGV)

class MoodyLinear(toy_plugins.Linear):
    def __init__(self, mood):
        super().__init__()
        self._mood = mood

    def act(self, observations):
        bad = self._weights[:, 0, 0, 0] == 5.0
        if bad.any():
            fail(self._mood)
        commands = super().act(observations)
        if self._mood == "nan":
            commands[bad] = np.nan
        return commands

class MoodyNetwork(toy_plugins.Network):
    def __init__(self, mood):
        self._mood = mood

    def policies(self, genomes):
        if (genomes[:, 0] != 5.0).all():
            return super().policies(genomes)
        fail(self._mood)
        return super().policies(np.full_like(genomes, np.nan))

class MoodyTravel(toy_plugins.Travel):
    def __init__(self, mood):
        self._mood = mood

    def evaluate(self, telemetry, genomes, controller):
        if (genomes[:, 0] != 5.0).all():
            return super().evaluate(telemetry, genomes, controller)
        fail(self._mood)
        return np.full((1, 2), np.nan)
"""


@pytest.fixture(autouse=True)
def _plugins(distribution: Distribution) -> None:
    toy_plugins.install(distribution)
    controllers = {"moody_linear": "moods:MoodyLinear", "moody_network": "moods:MoodyNetwork"}
    groups = {"swarmevo.controllers": controllers, "swarmevo.fitness": {"moody_travel": "moods:MoodyTravel"}}
    distribution("moods", "1.0", groups, moods=MOODY)


def config(plugin: str, mood: str, on_fault: str = "worst", timeout: float | None = None) -> Config:
    policy = {"on_fault": on_fault, "episode_timeout": timeout}
    if plugin == "moody_travel":
        return toy_plugins.config(fitness={plugin: {"mood": mood}, "toy_neurons": {}}, evolution=policy)
    return toy_plugins.config(controller={plugin: {"mood": mood}}, evolution=policy)


def genomes(settings: Config, n: int = 6, bad: tuple[int, ...] = (2,)) -> FloatArray:
    with Evaluator(settings, 1) as evaluator:
        made = np.random.default_rng(0).standard_normal((n, evaluator.space.size))
    made[list(bad), 0] = BAD
    return made


def evaluate(settings: Config, tried: FloatArray, workers: int = 2) -> evaluation.Evaluation:
    with Evaluator(settings, workers) as evaluator:
        return evaluator.evaluate(tried, 0, 0)


PLUGINS = ["moody_linear", "moody_network", "moody_travel"]
MOODS = [("raises", "raised KeyError"), ("nan", "nan|not finite|refused")]
LIMIT = 0.5  # [s]


def children() -> set[int]:
    """Return the processes that this one has started and that still run."""
    tasks = Path(f"/proc/{os.getpid()}/task").iterdir()
    found = {int(pid) for task in tasks for pid in (task / "children").read_text().split()}
    return {pid for pid in found if Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"}


def assert_only_the_bad_one_failed(found: evaluation.Evaluation, sound: evaluation.Evaluation, told: str) -> None:
    assert set(found.episodes.failures) == {(2, 0), (2, 1)}
    for (individual, repeat), reason in found.episodes.failures.items():
        assert "\n" not in reason
        assert re.search(told, reason), reason
        np.testing.assert_array_equal(found.objectives[individual, repeat], [0.0, 1.0, toy_plugins.HIDDEN])
        assert found.episodes.grid("hash")[individual, repeat] == 0
        assert np.isnan(found.episodes.grid("push_time")[individual, repeat])
    others = [0, 1, 3, 4, 5]
    np.testing.assert_array_equal(found.objectives[others], sound.objectives[others])
    np.testing.assert_array_equal(found.episodes.grid("hash")[others], sound.episodes.grid("hash")[others])


@pytest.mark.parametrize("plugin", PLUGINS)
@pytest.mark.parametrize(("mood", "told"), MOODS)
def test_what_fails_in_one_episode_costs_that_episode(plugin: str, mood: str, told: str) -> None:
    settings = config(plugin, mood)
    tried = genomes(settings)
    sound = tried.copy()
    sound[2, 0] = 0.0
    assert_only_the_bad_one_failed(evaluate(settings, tried), evaluate(settings, sound), told)


@pytest.mark.parametrize("plugin", PLUGINS)
@pytest.mark.parametrize(("mood", "told"), MOODS)
def test_or_ends_the_evaluation(plugin: str, mood: str, told: str) -> None:
    settings = config(plugin, mood, on_fault="fail")
    with pytest.raises(EvaluationError, match=told) as error:
        evaluate(settings, genomes(settings))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("plugin", PLUGINS)
@pytest.mark.parametrize(
    ("mood", "told"),
    [("hangs", "the episode took longer than its time limit of 0.5 s"), ("dies", "ended its process: signal SIGSEGV")],
)
def test_what_hangs_or_crashes_costs_that_episode(plugin: str, mood: str, told: str) -> None:
    settings = config(plugin, mood, timeout=LIMIT)
    tried = genomes(settings)
    sound = tried.copy()
    sound[2, 0] = 0.0
    assert_only_the_bad_one_failed(evaluate(settings, tried, workers=1), evaluate(settings, sound), told)


@pytest.mark.parametrize(("mood", "told"), [("hangs", "took longer than"), ("dies", "ended its process")])
def test_or_ends_the_evaluation_with_its_place(mood: str, told: str) -> None:
    settings = config("moody_network", mood, on_fault="fail", timeout=LIMIT)
    with pytest.raises(EvaluationError, match=told) as error:
        evaluate(settings, genomes(settings, n=3, bad=(1,)), workers=1)
    assert "trial 0, generation 0, individual 1, repeat 0" in str(error.value)


def test_a_time_limit_changes_no_bit() -> None:
    free, limited = config("moody_network", ""), config("moody_network", "", timeout=60.0)
    tried = genomes(free, bad=())
    one, two = evaluate(free, tried).episodes, evaluate(limited, tried).episodes
    for name in one.values:
        np.testing.assert_array_equal(one[name], two[name], err_msg=name)


def test_a_plugin_s_error_comes_through_a_process_as_it_is() -> None:
    settings = config("moody_network", "raises", on_fault="fail", timeout=60.0)
    with pytest.raises(EvaluationError, match=r"controller\.moody_network \(moods 1\.0\): policies raised KeyError"):
        evaluate(settings, genomes(settings))


def test_a_hanging_episode_can_be_stopped() -> None:
    settings = config("moody_network", "hangs", timeout=1e6)
    tried = genomes(settings, bad=(3,))
    answers = iter([False, True])
    before = children()
    with Evaluator(settings, 1) as evaluator, pytest.raises(Interrupted):
        evaluator.evaluate(tried, 0, 0, lambda: next(answers))
    assert children() <= before


def test_a_generation_in_which_everything_fails_ends_the_run() -> None:
    settings = config("moody_network", "raises")
    with pytest.raises(EvaluationError, match="0: every episode failed; individual 0, repeat 0: contr"):
        evaluate(settings, genomes(settings, n=2, bad=(0, 1)))


def test_what_failed_is_not_kept_but_tried_again() -> None:
    settings = config("moody_network", "raises")
    tried, kept = genomes(settings), list[Results]()
    with Evaluator(settings, 1) as evaluator:
        found = evaluator.evaluate(tried, 0, 0, keep=lambda result, seconds: kept.append(result))
    assert len(found.episodes.failures) == 2
    assert kept
    assert not any(fault for result in kept for fault in result.faults)


def test_a_failed_episode_is_recorded_in_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ask = toy_plugins.Search.ask

    def ask_with_a_bad_one(self: Any) -> FloatArray:
        asked: FloatArray = ask(self)
        asked[1, 0] = BAD
        return asked

    monkeypatch.setattr(toy_plugins.Search, "ask", ask_with_a_bad_one)
    begin(tmp_path / "run", config("moody_network", "raises"))
    seen: list[Any] = []
    with Store.open(tmp_path / "run", readonly=False) as store:
        evolve(store, 1, seen.append)
    with Store.open(tmp_path / "run") as store:
        assert store.totals().faults == len(seen) * 2
        generation = store.generation(1, 2)
        assert set(generation.episodes.failures) == {(1, 0), (1, 1)}
        assert "policies raised KeyError" in generation.episodes.failures[1, 0]
        np.testing.assert_array_equal(generation.episodes.grid("objective")[1], [[0.0, 1.0, 2.0]] * 2)


# ---- a call in another process ---------------------------------------------------------------------------------------


def never() -> bool:
    return False


def call(function: Callable[..., Any], *arguments: object, limit: float = 60.0) -> Any:
    with processes.child() as child:
        return child.call(function, arguments, limit, never)


def test_calls_share_a_process_until_it_is_lost() -> None:

    first = call(os.getpid)
    assert first != os.getpid()
    assert call(os.getpid) == first
    with pytest.raises(ZeroDivisionError):
        call(divmod, 1, 0)
    assert call(os.getpid) == first
    with pytest.raises(processes.Lost, match="ended its process: exit code 3"):
        call(os._exit, 3)
    second = call(os.getpid)
    assert second != first
    assert second in children()
    processes.dismiss()
    assert second not in children()


def test_a_child_does_not_outlive_its_parent() -> None:

    program = (
        "import os, threading\nfrom swarmevo.evolution import processes\n"
        "with processes.child() as child:\n"
        "    print(child.call(os.getpid, (), 60, lambda: False), flush=True)\n"
        "    threading.Timer(0.1, lambda: os._exit(9)).start()\n"
        "    child.call(eval, ('exec(\"while True: pass\")',), 60, lambda: False)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.returncode == 9
    pid = int(done.stdout)
    for _ in range(1000):
        try:
            state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            return
        if state == "Z":
            return
        os.sched_yield()
        threading.Event().wait(0.01)
    pytest.fail(f"process {pid} is still there")

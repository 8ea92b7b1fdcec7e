# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import dataclasses
import os
import threading
from collections.abc import Callable, Generator, Sequence
from functools import reduce
from operator import add
from typing import Any

import numpy as np
import pytest

import toy_plugins
from forks import in_a_fork
from grids import results
from swarmevo import plugins, returned, simulation
from swarmevo.config import WORLD, Config
from swarmevo.errors import EvaluationError, Interrupted
from swarmevo.evolution import evaluation, threads
from swarmevo.evolution.aggregation import OverWorlds
from swarmevo.evolution.costs import to_costs
from swarmevo.evolution.evaluation import Evaluation, Evaluator
from swarmevo.evolution.jobs import Job, run_job
from swarmevo.evolution.results import Results, joined
from swarmevo.plugins.checked import check_together
from swarmevo.plugins.team import Team, never
from swarmevo.protocols import Compiled, FloatArray, Objective
from toy_plugins import HIDDEN

FIELDS = ("objectives", "hash", "push_time", "homing_time", "ode_messages", "unsolved_steps")


@pytest.fixture(autouse=True)
def _toys(distribution: Callable[..., Any]) -> None:
    toy_plugins.install(distribution)


class Recorder:
    """A backend that keeps the jobs and runs them here, last one first."""

    def __init__(self, config_json: str, workers: int) -> None:
        self._config_json = config_json
        self.slots = workers
        self.machines: dict[str, Any] = {}
        self.jobs: list[Job] = []

    @property
    def job_seconds(self) -> float:
        return threads.JOB_SECONDS

    def run(self, jobs: Sequence[Job], stop: Callable[[], bool]) -> Generator[Results, None, None]:
        self.jobs += jobs
        for job in reversed(jobs):
            yield run_job(self._config_json, job)

    def close(self) -> None:
        pass


def genomes_for(config: Config, n: int, seed: int = 0) -> FloatArray:
    with Evaluator(config, 1) as evaluator:
        return np.random.default_rng(seed).standard_normal((n, evaluator.space.size))


def evaluate(config: Config, genomes: FloatArray, generation: int = 0, workers: int = 1) -> Evaluation:
    with Evaluator(config, workers) as evaluator:
        return evaluator.evaluate(genomes, trial=0, generation=generation)


def assert_same(a: Any, b: Any) -> None:
    one, two = getattr(a, "episodes", a), getattr(b, "episodes", b)
    for name in one.values:
        np.testing.assert_array_equal(one[name], two[name], err_msg=name)
    np.testing.assert_array_equal(getattr(a, "costs", 0), getattr(b, "costs", 0))


# ---- what comes out --------------------------------------------------------------------------------------------------


def test_an_evaluation_has_every_repeat_of_every_genome() -> None:
    config = toy_plugins.config(evolution={"repeats": 3})
    found = evaluate(config, genomes_for(config, 5))
    assert found.objectives.shape == (5, 3, 3)
    assert found.costs.shape == (5, 3)
    for name in ("hash", "push_time", "ode_messages"):
        assert found.episodes.grid(name).shape == (5, 3)
    assert found.episodes.grid("homing_time").shape == (5, 3, 2)
    assert found.episodes.grid("hash").dtype == np.uint64
    assert len(np.unique(found.episodes.grid("hash"))) == 15
    assert found.seconds > 0


def test_costs_are_the_means_with_maximised_objectives_turned_around() -> None:
    config = toy_plugins.config()
    found = evaluate(config, genomes_for(config, 4))
    np.testing.assert_allclose(found.costs, found.objectives.mean(axis=1) * [-1, 1, 1], rtol=1e-14)


def test_objectives_of_several_plugins_stand_side_by_side() -> None:
    with Evaluator(toy_plugins.config(), 1) as evaluator:
        assert [o.name for o in evaluator.objectives] == ["travel", "distance", "neurons"]
        np.testing.assert_array_equal(evaluator.reference, [0.0, 1.0, HIDDEN])


def test_a_cost_is_never_minus_zero() -> None:
    costs = to_costs([Objective("a", "maximise", (0, 1)), Objective("b", "minimise", (0, 1))], np.zeros((1, 2)))
    assert not np.signbit(costs).any()


def test_all_individuals_of_a_generation_meet_the_same_noise() -> None:
    config = toy_plugins.config()
    genomes = np.repeat(genomes_for(config, 1), 3, axis=0)
    here, later = evaluate(config, genomes, generation=0), evaluate(config, genomes, generation=1)
    for found in (here, later):
        assert (found.episodes.grid("hash") == found.episodes.grid("hash")[0]).all()
        assert found.episodes.grid("hash")[0, 0] != found.episodes.grid("hash")[0, 1]
    assert here.episodes.grid("hash")[0, 0] != later.episodes.grid("hash")[0, 0]


# ---- the same bits however the work is cut ---------------------------------------------------------------------------


@pytest.mark.parametrize("controller", ["toy_network", "toy_linear"])
def test_results_do_not_depend_on_the_number_of_workers(controller: str) -> None:
    config = toy_plugins.config(controller=controller)
    genomes = genomes_for(config, 7)
    alone = evaluate(config, genomes)
    for workers in (0, 2, 5):
        assert_same(alone, evaluate(config, genomes, workers=workers))


@pytest.mark.parametrize("genomes_of", ["shared", "individual"])
def test_results_do_not_depend_on_the_cut_into_jobs(genomes_of: str) -> None:
    config = toy_plugins.config(team={"genomes": genomes_of, "robots": 3})
    genomes = genomes_for(config, 6)
    whole = _run_in_jobs(config, genomes, 12)
    for length in (1, 2, 5, 7):
        assert_same(whole, _run_in_jobs(config, genomes, length))


def _run_in_jobs(config: Config, genomes: FloatArray, length: int) -> Results:
    """Return the results of jobs of a length as one."""
    keys = [simulation.EpisodeKey(7, 0, 0, repeat) for repeat in range(2)]
    places = [(individual, key) for individual in range(len(genomes)) for key in keys]
    results = []
    for start in range(0, len(places), length):
        individuals, episodes = zip(*places[start : start + length], strict=True)
        job = Job(individuals, genomes[list(individuals)], episodes)
        results.append(run_job(config.model_dump_json(), job))
    return joined(results[::-1])


@pytest.mark.parametrize("controller", ["toy_network", "toy_linear"])
@pytest.mark.parametrize("known", [[0], [3, 4, 5], [0, 8, 9, 11], [*range(11)], [*range(12)]])
def test_what_is_known_is_not_run_again_and_changes_nothing(controller: str, known: list[int]) -> None:
    """Of a controller in Python a job is run as a whole, or not at all."""
    config = toy_plugins.config(controller=controller)
    genomes = genomes_for(config, 6)
    kept: list[Results] = []
    with Evaluator(config, 1) as evaluator:
        whole = evaluator.evaluate(genomes, 0, 0, keep=lambda result, seconds: kept.append(result))
        everything = joined(kept)
        kept.clear()
        given = everything.only(np.isin(np.arange(12), known))
        again = evaluator.evaluate(genomes, 0, 0, known=given, keep=lambda result, seconds: kept.append(result))
    assert_same(whole, again)
    ran = {place for result in kept for place in (2 * result.individual + result.repeat).tolist()}
    if controller == "toy_network":
        assert ran == set(range(12)) - set(known)
    else:
        assert ran == {place for job in (range(8), range(8, 12)) if not set(job) <= set(known) for place in job}


def test_a_mean_has_the_same_bits_for_any_number_of_individuals() -> None:
    values = np.random.default_rng(0).standard_normal((5, 300, 1))
    nothing = np.full((5, 300), np.nan)

    def means(chosen: slice) -> FloatArray:
        part = values[chosen]
        shape = part.shape[:2]
        episodes = results(
            objective=part,
            push_time=nothing[chosen],
            homing_time=nothing[chosen, :, np.newaxis],
            ode_messages=np.zeros(shape),
            unsolved_steps=np.zeros(shape),
            hash=np.zeros(shape),
        )
        return OverWorlds(Config(), [Objective("one", "maximise", (-9.0, 9.0))]).judge(episodes, len(part))

    assert means(slice(5))[:, 0].tolist() == [reduce(add, one) / 300 for one in values[:, :, 0].tolist()]
    assert all(means(slice(i, i + 1)) == means(slice(5))[i] for i in range(5))


def test_a_fitness_cannot_change_what_the_next_one_sees(monkeypatch: pytest.MonkeyPatch) -> None:
    config = toy_plugins.config()
    genomes = genomes_for(config, 3)
    sound = evaluate(config, genomes)
    judge = toy_plugins.Travel.evaluate

    def judge_and_spoil(self: Any, telemetry: Any, given: FloatArray, controller: Any) -> FloatArray:
        found: FloatArray = judge(self, telemetry, given, controller)
        given[:] = -1.0  # all switches off
        return found

    monkeypatch.setattr(toy_plugins.Travel, "evaluate", judge_and_spoil)
    assert sound.objectives[..., 2].any()
    assert_same(sound, evaluate(config, genomes))


def test_a_fitness_knows_the_world_of_the_episodes(monkeypatch: pytest.MonkeyPatch) -> None:
    config = toy_plugins.config(box={"size": [0.3, 0.2, 0.05]}, arena={"target_wall": "east"})
    judge, seen = toy_plugins.Travel.evaluate, []

    def look(self: Any, telemetry: Any, given: FloatArray, controller: Any) -> FloatArray:
        seen.append(telemetry.world)
        return judge(self, telemetry, given, controller)

    monkeypatch.setattr(toy_plugins.Travel, "evaluate", look)
    evaluate(config, genomes_for(config, 1))
    assert tuple(seen[0]) == WORLD
    assert (seen[0]["episode"]["horizon"], seen[0]["team"]["robots"]) == (1.0, 2)
    assert (seen[0]["box"]["size"], seen[0]["arena"]["target_wall"]) == ((0.3, 0.2, 0.05), "east")


def test_a_fitness_knows_each_of_several_worlds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of that episode: how many robots it has, and what was drawn for it."""
    config = toy_plugins.config(
        worlds=[{"team.robots": 2}, {"team.robots": 3}], vary={"box.mass": {"uniform": [0.2, 0.3]}}
    )
    judge, seen = toy_plugins.Travel.evaluate, []

    def look(self: Any, telemetry: Any, given: FloatArray, controller: Any) -> FloatArray:
        seen.append((telemetry.world["team"]["robots"], telemetry.homing_time.shape[1], telemetry.world["box"]["mass"]))
        return judge(self, telemetry, given, controller)

    monkeypatch.setattr(toy_plugins.Travel, "evaluate", look)
    evaluate(config, genomes_for(config, 1))
    assert sorted(told for told, _, _ in seen) == [2, 2, 3, 3]
    assert all(told == robots and 0.2 <= mass <= 0.3 for told, robots, mass in seen)
    assert len({mass for _, _, mass in seen}) > 1


def test_the_terms_of_a_fitness_come_from_the_world_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def terms(self: Any, telemetry: Any) -> dict[str, FloatArray]:
        return {"horizon": np.full((1, 10), telemetry.world["episode"]["horizon"])}

    monkeypatch.setattr(toy_plugins.Travel, "terms", terms, raising=False)
    config = toy_plugins.config()
    team = Team(config)
    episodes = team.simulate(genomes_for(config, 1), [simulation.EpisodeKey(1, 0, 0, 0)])
    assert team.terms(episodes, 0)[1]["horizon"][0] == 1.0


def test_a_backend_that_is_closed_has_nothing_running(monkeypatch: pytest.MonkeyPatch) -> None:
    config = toy_plugins.config()
    genome = genomes_for(config, 1)
    jobs = [Job((0,), genome, (simulation.EpisodeKey(7, 0, 0, i),)) for i in range(2)]
    began, ended = threading.Event(), threading.Event()

    def run(config_json: str, job: Job, cancelled: Callable[[], bool]) -> Results:
        if job.episodes[0].repeat == 1:
            began.set()
            while not cancelled():
                began.wait(0.001)
            threading.Event().wait(0.05)  # it does not end at once
            ended.set()
        return run_job(config_json, job)

    monkeypatch.setattr(threads, "run_job", run)
    backend = threads.ThreadBackend(config.model_dump_json(), 2)
    results = backend.run(jobs, never)
    next(results)
    assert began.wait(60)
    results.close()
    assert ended.is_set()
    backend.close()


def test_a_job_is_a_pure_function() -> None:
    config = toy_plugins.config()
    job = Job((0,), genomes_for(config, 1), (simulation.EpisodeKey(7, 0, 0, 0),))
    other = toy_plugins.config(episode={"horizon": 0.5})
    first = run_job(config.model_dump_json(), job)
    between = run_job(other.model_dump_json(), job)
    assert_same(first, run_job(config.model_dump_json(), job))
    assert (first["objective"][0, :2] != between["objective"][0, :2]).all()


def test_another_backend_may_answer_in_any_order() -> None:
    config = toy_plugins.config()
    genomes = genomes_for(config, 5)
    with Evaluator(config, 2, Recorder) as evaluator:
        assert_same(evaluate(config, genomes), evaluator.evaluate(genomes, 0, 0))


def recorded_lengths(config: Config, genomes: FloatArray, workers: int) -> list[int]:
    """Return the jobs' lengths in a second evaluation, when the first has told how long an episode takes."""
    recorder: list[Recorder] = []

    def backend(config_json: str, workers: int) -> Recorder:
        recorder.append(Recorder(config_json, workers))
        return recorder[0]

    with Evaluator(config, workers, backend) as evaluator:
        evaluator.evaluate(genomes, 0, 0)
        recorder[0].jobs.clear()
        evaluator.evaluate(genomes, 0, 1)
    return [len(job.episodes) for job in recorder[0].jobs]


def test_jobs_are_short_enough_for_every_worker_to_have_some(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "JOB_SECONDS", 1e9)
    config = toy_plugins.config()
    assert recorded_lengths(config, genomes_for(config, 8), workers=1) == [8, 4, 2, 1, 1]
    assert recorded_lengths(config, genomes_for(config, 8), workers=2) == [4, 3, 2, 1, 1, 1, 1, 1, 1, 1]


def test_jobs_are_short_enough_to_stop_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "JOB_SECONDS", 0.0)
    config = toy_plugins.config()
    assert recorded_lengths(config, genomes_for(config, 8), workers=1) == [1] * 16


def test_telemetry_of_a_job_stays_in_its_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "JOB_SECONDS", 1e9)
    # Per control step: pose 2 x 3, command 2 x 2, rf 2.
    monkeypatch.setattr(evaluation, "TELEMETRY_BYTES", 3 * 8 * 10 * (6 + 4 + 2))
    config = toy_plugins.config()
    assert recorded_lengths(config, genomes_for(config, 8), workers=1) == [3] * 4 + [2, 1, 1]


def test_jobs_in_lockstep_depend_on_nothing_but_the_configuration() -> None:
    config = toy_plugins.config(controller="toy_linear")
    for workers in (1, 3):
        assert recorded_lengths(config, genomes_for(config, 10), workers) == [8, 8, 4]


# ---- a genome for each robot -----------------------------------------------------------------------------------------


def test_a_team_of_individuals_has_a_genome_for_each_robot() -> None:
    shared = toy_plugins.config()
    own = toy_plugins.config(team={"genomes": "individual"})
    one, two = genomes_for(shared, 2)
    alike = evaluate(own, np.concatenate([one, one])[np.newaxis])
    assert_same(alike, evaluate(shared, one[np.newaxis]))
    mixed = evaluate(own, np.array([np.concatenate([one, two]), np.concatenate([two, one])]))
    assert len(np.unique(np.concatenate([mixed.episodes.grid("hash")[:, 0], alike.episodes.grid("hash")[:, 0]]))) == 3


def test_lockstep_gives_each_robot_its_genome() -> None:
    shared = toy_plugins.config(controller="toy_linear")
    own = toy_plugins.config(controller="toy_linear", team={"genomes": "individual"})
    one = genomes_for(shared, 1)
    assert_same(evaluate(own, np.concatenate([one, one], axis=1)), evaluate(shared, one))


def test_the_complexity_of_a_team_is_the_mean_over_its_robots() -> None:
    on, off = np.ones(36), np.zeros(36)
    team = Team(toy_plugins.config(team={"genomes": "individual"}))
    np.testing.assert_array_equal(team.complexity(np.array([[*on, *off], [*on, *on]])), [1.0, 2.0])


def test_every_robot_of_every_episode_finds_its_compiled_policy(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Any] = []

    def simulate(scene: Any, policies: Compiled, episodes: Any, robot_policies: Any, *_: Any) -> None:
        seen.append((policies, robot_policies))
        raise simulation.SimulatorError("not run")

    monkeypatch.setattr(simulation, "simulate", simulate)
    config = toy_plugins.config(controller="toy_direct", team={"genomes": "individual"})
    genomes = genomes_for(config, 2)
    keys = tuple(simulation.EpisodeKey(7, 0, 0, repeat) for repeat in range(2))
    with pytest.raises(simulation.SimulatorError, match="not run"):
        run_job(config.model_dump_json(), Job((0, 1), genomes, keys))
    ((policies, robot_policies),) = seen
    assert (policies.function, policies.memory) == (1, 3)
    np.testing.assert_array_equal(policies.parameters[robot_policies], genomes.reshape(2, 2, 36))


# ---- stopping --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("controller", ["toy_network", "toy_linear"])
@pytest.mark.parametrize("asked", [1, 2, 3])
def test_an_evaluation_stops_when_asked(controller: str, asked: int) -> None:
    config = toy_plugins.config(controller=controller)
    genomes = genomes_for(config, 20)
    answers = iter([False] * (asked - 1) + [True])
    with Evaluator(config, 2) as evaluator:
        with pytest.raises(Interrupted):
            evaluator.evaluate(genomes, 0, 0, lambda: next(answers))
        assert next(answers, None) is None
        assert_same(evaluator.evaluate(genomes, 0, 0), evaluate(config, genomes))


def test_a_cancelled_job_in_lockstep_ends_within_a_step() -> None:
    config = toy_plugins.config(controller="toy_linear", episode={"horizon": 1000.0})
    job = Job((0,), genomes_for(config, 1), (simulation.EpisodeKey(7, 0, 0, 0),))
    answers = iter([False, False, True])
    with pytest.raises(Interrupted):
        run_job(config.model_dump_json(), job, lambda: next(answers))
    assert next(answers, None) is None


# ---- what is wrong ---------------------------------------------------------------------------------------------------


def assert_one_line(error: pytest.ExceptionInfo[BaseException], *parts: str) -> None:
    message = str(error.value)
    assert "\n" not in message
    for part in parts:
        assert part in message


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("no objective", "expected at least one"),
        ("not iterable", "objectives raised TypeError"),
        ("no Objective", "expected an Objective, got str"),
        ("of", "good: expected it to be of episode or genome, got 'world'"),
        ("direction", "expected the direction maximise or minimise, got 'up'"),
        ("range", "expected as range two finite numbers, low and high, within 1e+50, got (1.0, 1.0)"),
        ("infinite", "expected as range two finite numbers"),
        ("no pair", "expected as range two finite numbers, low and high, within 1e+50, got 1.0"),
        ("wide", "expected as range two finite numbers, low and high, within 1e+50, got (0.0, 1e+308)"),
        ("text range", "expected as range two finite numbers"),
        ("name", "expected as name text that can be printed, got 3"),
        ("blank", "expected as name text that can be printed, got ' '"),
        ("escape", r"expected as name text that can be printed, got '\x1b[2J'"),
        ("surrogate", r"expected as name text that can be printed, got '\udcff'"),
        ("channel", "channels: expected some of pose, command"),
    ],
)
def test_a_fitness_that_describes_itself_badly_is_named(fault: str, told: str) -> None:
    """Case 62: refused before a folder is made."""
    with pytest.raises(EvaluationError) as error:
        Evaluator(toy_plugins.config(fitness={"toy_bad_fitness": {"fault": fault}}), 1)
    assert_one_line(error, "fitness.toy_bad_fitness (toys 1.0): ", told)


def test_two_objectives_of_one_name_are_refused() -> None:
    fitness = {"toy_neurons": {}, "toy_bad_fitness": {"fault": "same name"}}
    with pytest.raises(EvaluationError, match="fitness: two objectives are named 'neurons'"):
        Evaluator(toy_plugins.config(fitness=fitness), 1)


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("raises", "evaluate raised KeyError: 'nobody\\nhome'"),
        ("shape", "evaluate: expected an array of shape (1, 1), got (1,)"),
        ("nan", "evaluate: expected finite numbers, got nan at [0, 0]"),
        ("text", "evaluate: expected an array of numbers, got list of str_"),
        ("none", "evaluate: expected an array of numbers, got NoneType"),
        ("complex", "evaluate: expected an array of numbers, got ndarray of complex128"),
        ("masked", "evaluate: expected an array of numbers, got a masked array; fill it"),
        ("huge", "evaluate: expected an array of numbers, got list of object_"),
        ("long", "evaluate: expected finite numbers, got inf at [0, 0]"),
        ("largest", "evaluate: expected good in its range from 0 to 1, got 1e+308"),
        ("outside", "evaluate: expected good in its range from 0 to 1, got 1.001"),
        ("below", "evaluate: expected good in its range from 0 to 1, got -0.001"),
    ],
)
def test_a_fitness_that_fails_is_named(fault: str, told: str) -> None:
    """Cases 20, 21 and 63: plugin, objective, value and what was expected."""
    config = toy_plugins.config(fitness={"toy_bad_fitness": {"fault": fault}})
    with pytest.raises(EvaluationError) as error:
        evaluate(config, genomes_for(config, 2), workers=2)
    assert_one_line(error, "fitness.toy_bad_fitness (toys 1.0): ", told)


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("raises", "policies raised KeyError"),
        ("count", "policies: expected 1 policies, got 0"),
        ("type", "policies: expected FeedForward, Linear, Recurrent or Compiled, got str"),
        ("nan", "its policies were refused"),
    ],
)
def test_a_native_controller_that_fails_is_named(fault: str, told: str) -> None:
    config = toy_plugins.config(controller={"toy_bad_controller": {"fault": fault}})
    with pytest.raises(EvaluationError) as error:
        evaluate(config, genomes_for(config, 2))
    assert_one_line(error, "controller.toy_bad_controller (toys 1.0): ", told)


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("raises", "act raised KeyError"),
        ("shape", "act: expected an array of shape (1, 2, 2), got (3,), in trial 0, generation 0, individual 0"),
    ],
)
def test_a_controller_in_python_that_fails_is_named(fault: str, told: str) -> None:
    config = toy_plugins.config(controller={"toy_linear": {"fault": fault}})
    with pytest.raises(EvaluationError) as error:
        evaluate(config, genomes_for(config, 2))
    assert_one_line(error, "controller.toy_linear (toys 1.0): ", told)


def test_an_episode_that_fails_names_its_individual(monkeypatch: pytest.MonkeyPatch) -> None:
    simulate = simulation.simulate

    def failing(*arguments: Any) -> simulation.Episodes:
        done = simulate(*arguments)
        keys = arguments[2]
        failed = [key.repeat == 1 for key in keys]
        return dataclasses.replace(
            done,
            status=np.array(failed, dtype=np.int32),
            messages=["ODE: LCP went astray" if f else "" for f in failed],
        )

    monkeypatch.setattr(simulation, "simulate", failing)
    config = toy_plugins.config()
    with pytest.raises(EvaluationError) as error:
        evaluate(config, genomes_for(config, 1), generation=4)
    assert_one_line(error, "the episode failed: ODE: LCP went astray, in trial 0, generation 4, individual 0, repeat 1")


def test_an_evaluator_needs_a_seed_and_a_number_of_workers() -> None:
    with pytest.raises(ValueError, match=r"evolution\.seed: expected a number, got None"):
        Evaluator(toy_plugins.config(evolution={"seed": None}), 1)
    with pytest.raises(ValueError, match="workers: expected a number of at least 0, got -1"):
        Evaluator(toy_plugins.config(), -1)


def test_genomes_of_another_shape_are_refused() -> None:
    config = toy_plugins.config()
    with pytest.raises(EvaluationError, match=r"genomes: expected the shape \(n, 36\), got \(2, 35\); install"):
        evaluate(config, np.zeros((2, 35)))


# ---- forks -----------------------------------------------------------------------------------------------------------


def test_a_fork_cannot_use_an_evaluator() -> None:
    """Case 74: its threads are not there; one line instead of waiting for ever."""
    config = toy_plugins.config()
    genomes = genomes_for(config, 2)
    with Evaluator(config, 2) as evaluator:
        evaluator.evaluate(genomes, 0, 0)

        def use() -> None:
            with evaluator:  # which frees nothing of the parent's
                evaluator.evaluate(genomes, 0, 0)

        said = in_a_fork(use)
        assert said.startswith(f"EvaluationError: evaluator: expected process {os.getpid()}, which made it, got ")
        assert said.endswith("a fork of it without its workers; make one in each process")
        assert (evaluator.evaluate(genomes, 0, 0).costs == evaluate_anew(config, genomes)).all()


def evaluate_anew(config: Config, genomes: FloatArray) -> FloatArray:
    with Evaluator(config, 2) as evaluator:
        return evaluator.evaluate(genomes, 0, 0).costs


def test_a_fork_makes_an_evaluator_of_its_own() -> None:
    """Case 74: also where jobs run in processes, which stay those of the parent."""
    config = toy_plugins.config(evolution={"episode_timeout": 60.0})
    genomes = genomes_for(config, 2)
    with Evaluator(config, 2) as evaluator:
        costs = evaluator.evaluate(genomes, 0, 0).costs
        assert in_a_fork(lambda: (evaluate_anew(config, genomes) == costs).all()) in ("True", "np.True_")
        assert (evaluator.evaluate(genomes, 0, 0).costs == costs).all()


# ---- values of other types -------------------------------------------------------------------------------------------


def test_names_ranges_and_values_of_other_types_are_plain_in_the_host() -> None:
    """Cases 62 and 63: lists, float32 and NumPy's text are what they stand for, everywhere."""
    config = toy_plugins.config(fitness={"toy_bad_fitness": {"fault": "other types"}})
    team = Team(config)
    assert team.objectives == [Objective("good", "minimise", (0.0, 1.0))]
    assert Team(Config()).objectives[1].of == "genome"
    assert [type(value) for value in (team.objectives[0].name, *team.objectives[0].range)] == [str, float, float]
    assert evaluate(config, genomes_for(config, 1)).objectives.tolist() == [[[0.25], [0.25]]]


def test_a_value_at_the_end_of_its_range_may_be_rounded() -> None:
    """Case 20."""
    objective = Objective("a", "minimise", (0.0, 1.0))
    returned.check_range(np.array([[1.0 + 1e-12], [-1e-12]]), [objective])


def use(config: Config) -> None:
    """Ask a controller for all that it returns."""
    team = Team(config)
    genome = np.ones((1, team.space.size))
    team.complexity(genome)
    team.simulate(genome, [simulation.EpisodeKey(1, 0, 0, 0)])


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("scalar complexity", "complexity: expected an array of shape (1,), got ()"),
        ("column complexity", "complexity: expected an array of shape (1,), got (1, 1)"),
        ("activation", "its policies were refused: activation: expected tanh or logistic, got 'relu'"),
        ("switch 0.7", "its policies were refused: hidden_switch: expected booleans of shape (n, hidden), got float64"),
        ("switch nan", "hidden_switch: expected booleans"),
        ("switch 256", "hidden_switch: expected booleans of shape (n, hidden), got int64"),
        ("switch -1", "hidden_switch: expected booleans"),
        ("bias", "bias: expected True or False, got 1"),
        ("complex weights", "input_hidden: expected an array of numbers, got ndarray of complex128"),
        ("list weights", "input_hidden: expected an array of shape (1, 2, 14), got list"),
        ("no function", "function: expected a whole number from 1 to"),
        ("real memory", "memory: expected a whole number from 0 to 4294967295, got 1.5"),
        ("scalar block", "space: block gain: expected a unit_axis of the shape (), got 0"),
        ("twin blocks", "space: expected blocks of different names, got 'gain' twice"),
        ("no blocks", "space: expected at least one gene, got none"),
        ("block of text", "space: expected blocks, a tuple of Block, got ('gain',)"),
    ],
)
def test_what_a_controller_returns_is_checked(fault: str, told: str) -> None:
    """Cases 60, 63 and 67: the controller is named, not the optimiser that got its space."""
    config = toy_plugins.config(controller={"toy_odd_controller": {"fault": fault}}, fitness="toy_neurons")
    with pytest.raises(EvaluationError) as error:
        use(config)
    assert_one_line(error, "controller.toy_odd_controller (toys 1.0): ", told)


@pytest.mark.parametrize("fault", ["scalar block", "twin blocks", "no blocks"])
def test_a_controllers_bad_space_is_the_controllers(fault: str) -> None:
    """Case 67: found when the configuration is read."""
    config = toy_plugins.config(controller={"toy_odd_controller": {"fault": fault}}, fitness="toy_neurons")
    (error,) = plugins.option_errors(config)
    assert error.startswith("controller.toy_odd_controller: ")


def test_a_fitness_gets_checked_complexities() -> None:
    """Case 63: what a fitness asks the controller for is checked as well; the controller is named."""
    config = toy_plugins.config(
        controller={"toy_odd_controller": {"fault": "column complexity"}}, fitness="toy_neurons"
    )
    with pytest.raises(EvaluationError) as error:
        evaluate(config, genomes_for(config, 1))
    assert str(error.value).count("controller.toy_odd_controller (toys 1.0): complexity: expected an array") == 1
    assert "fitness" not in str(error.value)


def test_a_hypervolume_is_always_finite() -> None:
    """Case 22: so that whatever is shown or exported is valid JSON."""
    widest = [Objective(f"objective {i}", "minimise", (-returned.LARGEST, returned.LARGEST)) for i in range(7)]
    check_together(widest[:6], [])
    with pytest.raises(EvaluationError, match=r"^fitness: expected ranges of objectives whose product is finite"):
        check_together(widest, [])

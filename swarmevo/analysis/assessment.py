# SPDX-License-Identifier: BSD-3-Clause
"""Tests of controllers: the paper's Table II, robustness, and a census of what the robots learned to do.

Every controller on the front of every trial is tested in episodes that evolution never saw: their keys hold the
generation ``GENERATION``, which no run reaches. All controllers of a trial meet the same noise. The
same tests give the same bits.

The result is an :class:`~swarmevo.analysis.table_ii.Assessment`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from swarmevo import simulation
from swarmevo.analysis import fronts
from swarmevo.analysis.census import LABELS, census
from swarmevo.analysis.recording import Recording, record, simulate
from swarmevo.analysis.table_ii import FORMAT, Assessment, Condition, Outcome, Tested, outcome
from swarmevo.config import Config
from swarmevo.errors import Interrupted, StoreError
from swarmevo.evolution.evaluation import Evaluation, Evaluator
from swarmevo.plugins.team import Team, never
from swarmevo.runs import other_world
from swarmevo.runs.store import Store
from swarmevo.simulation import EpisodeKey

GENERATION: Final = 2**32 - 1
"""Of the tests' episode keys; a run has at most a million generations."""
TEAM_SIZES: Final = range(1, 6)
"""Rows of Table II."""
REPEATS: Final = 5
"""Tests of each controller (paper VII)."""


# ---- the tests -------------------------------------------------------------------------------------------------------


Observe = Callable[[int, int], None]
"""Called with the number of episodes done and the number of all."""


def assess(
    store: Store,
    sizes: Sequence[int] = TEAM_SIZES,
    repeats: int = REPEATS,
    robustness: bool = False,
    workers: int = 0,
    observe: Observe = lambda done, total: None,
    stop: Callable[[], bool] = never,
    overrides: Sequence[str] = (),
) -> Assessment:
    """Test every controller on the front of every trial.

    Args:
        store: The run.
        sizes: Of the teams: rows of the table.
        repeats: Tests of each controller and team size.
        robustness: Also with other noise, other starts and the other bumpers.
        workers: Episodes at once; 0: one for each processor.
        observe: Told about the progress.
        stop: Asked now and then; when true, the tests end.
        overrides: Of the world, ``section.key=value`` (:func:`swarmevo.runs.other_world.load`).

    Raises:
        ConfigError: An override is refused, or a size: each robot has a genome of its own.
        EvaluationError: A plugin or an episode failed.
        Interrupted: ``stop`` said so.
        SimulatorError: The world does not take teams of such a size.
        StoreError: The run has no generation yet.
    """
    settings = _tested_config(store, repeats, overrides)
    changes = other_world.changes(store, settings)
    bench = _Bench(store, workers, observe, stop)
    teams = {robots: other_world.of_size(settings, robots) for robots in dict.fromkeys((*sizes, store.robots))}
    worlds = _worlds(settings) if robustness else {}
    bench.plan(repeats * (len(teams) + len(worlds) + 1))  # and once more for the census

    results = {robots: bench.evaluate(team) for robots, team in teams.items()}
    conditions = [
        Condition(name, disturbance, _pooled(store.robots, bench.evaluate(world)))
        for name, (disturbance, world) in worlds.items()
    ]
    world = "as set" if changes else "as evolved"
    undisturbed = Condition(world, "none", _pooled(store.robots, results[store.robots]))
    behaviours = bench.census(settings)
    return Assessment(
        format=FORMAT,
        generation=GENERATION,
        generations={trial: store.generations(trial) for trial in store.trials()},
        repeats=repeats,
        horizon=settings.episode.horizon,
        rows=[_pooled(robots, results[robots]) for robots in sizes],
        controllers=_controllers(store, bench.fronts, {k: results[k] for k in sizes}, results, behaviours),
        behaviours=_mean_shares([shares for trial in behaviours.values() for shares in trial]),
        robustness=[undisturbed, *conditions] if robustness else [],
        changes=changes,
    )


def _tested_config(store: Store, repeats: int, overrides: Sequence[str] = ()) -> Config:
    return _changed(other_world.load(store, overrides), "evolution", repeats=repeats)


class _Bench:
    """The controllers of all fronts, and where they are tested. Results are keyed by trial."""

    def __init__(self, store: Store, workers: int, observe: Observe, stop: Callable[[], bool]) -> None:
        self.fronts = {trial: fronts.front(store, trial) for trial in store.trials()}
        if not self.fronts:
            raise StoreError(f"{store.folder}: expected at least one generation to test, but none is stored yet")
        self._genomes = {
            trial: np.array([store.genome(point.genome) for point in front]) for trial, front in self.fronts.items()
        }
        self._evolved_robots = store.robots
        self._workers, self._observe, self._stop = workers, observe, stop
        self._done = self._total = 0

    def plan(self, tests: int) -> None:
        """Announce how often each controller is tested."""
        self._total = tests * sum(map(len, self._genomes.values()))

    def evaluate(self, settings: Config) -> dict[int, Evaluation]:
        results = {}
        with Evaluator(settings, self._workers) as evaluator:
            for trial, genomes in self._genomes.items():
                team = other_world.first_robots(settings, genomes, self._evolved_robots)
                results[trial] = evaluator.evaluate(team, trial, GENERATION, self._stop)
                self._note(len(genomes) * settings.evolution.repeats)
        return results

    def census(self, settings: Config) -> dict[int, list[dict[str, float]]]:
        """Return the share of robots with each label, for each controller."""
        found: dict[int, list[dict[str, float]]] = {}
        team = Team(settings)
        for trial, genomes in self._genomes.items():
            found[trial] = []
            for genome in genomes:
                if self._stop():
                    raise Interrupted
                seen = simulate(team, genome, test_keys(settings, trial), self._workers)
                found[trial].append(census(settings, seen.telemetry))
                self._note(settings.evolution.repeats)
        return found

    def _note(self, episodes: int) -> None:
        self._done += episodes
        self._observe(self._done, self._total)


def test_keys(settings: Config, trial: int) -> list[EpisodeKey]:
    """Return the keys of a trial's tests, as many as the configuration has repeats."""
    assert settings.evolution.seed is not None  # a run's configuration has one
    return [EpisodeKey(settings.evolution.seed, trial, GENERATION, i) for i in range(settings.evolution.repeats)]


def _controllers(
    store: Store,
    fronts: dict[int, list[fronts.FrontPoint]],
    tested: dict[int, dict[int, Evaluation]],
    results: dict[int, dict[int, Evaluation]],
    behaviours: dict[int, list[dict[str, float]]],
) -> list[Tested]:
    names = [objective.name for objective in store.objectives]
    return [
        Tested(
            trial=trial,
            genome=point.genome,
            evolved=point.objectives,
            tested=dict(zip(names, results[store.robots][trial].objectives[i].mean(axis=0).tolist(), strict=True)),
            outcomes=[
                outcome(robots, *(result[trial].episodes.grid(name)[i] for name in ("homing_time", "push_time")))
                for robots, result in tested.items()
            ],
            behaviours=behaviours[trial][i],
        )
        for trial, front in fronts.items()
        for i, point in enumerate(front)
    ]


# ---- outcomes --------------------------------------------------------------------------------------------------------


def _pooled(robots: int, results: dict[int, Evaluation]) -> Outcome:
    """Return the outcome over the controllers of all trials; each was tested as often."""
    homing = np.concatenate([result.episodes["homing_time"] for result in results.values()])
    return outcome(robots, homing, np.concatenate([result.episodes["push_time"] for result in results.values()]))


def _mean_shares(shares: Sequence[dict[str, float]]) -> dict[str, float]:
    return {label: float(np.mean([share[label] for share in shares])) for label in LABELS}


# ---- other worlds ----------------------------------------------------------------------------------------------------


def _changed(settings: Config, section: str, **values: Any) -> Config:
    changed = getattr(settings, section).model_copy(update=values)
    return settings.model_copy(update={section: changed})


def _worlds(settings: Config) -> dict[str, tuple[str, Config]]:
    """Return the worlds that robustness is tested in: for each name its changes in words, and the configuration.

    A world that the library refuses, say for lack of room, is left out.
    """
    noise = settings.noise.model_dump()
    position, heading = settings.team.start_jitter
    doubled = {name: min(1.0, 2 * value) for name, value in noise.items()}
    turned = (position, min(3.15, 5 * heading))
    bumper = "rigid" if settings.robot.bumper == "sprung" else "sprung"
    worlds = {
        "no noise": ("noise.* 0", _changed(settings, "noise", **dict.fromkeys(noise, 0.0))),
        "double noise": ("noise.* doubled", _changed(settings, "noise", **doubled)),
        "exact starts": ("team.start_jitter 0", _changed(settings, "team", start_jitter=(0.0, 0.0))),
        "turned starts": (f"team.start_jitter {list(turned)}", _changed(settings, "team", start_jitter=turned)),
        "starts anywhere": ("team.start random", _changed(settings, "team", start="random")),
        f"{bumper} bumpers": (f"robot.bumper {bumper}", _changed(settings, "robot", bumper=bumper)),
    }
    return {name: world for name, world in worlds.items() if not simulation.scene_errors(world[1])}


# ---- watching -------------------------------------------------------------------------------------------------------


def watch(store: Store, genome: int | None = None) -> Recording:
    """Test an individual ``REPEATS`` times, in the first episodes that :func:`assess` runs too, and keep the telemetry.

    Args:
        store: The run.
        genome: Id of the individual's genome; None: the first of the front over all trials.

    Raises:
        EvaluationError: An episode failed.
        StoreError: There is no such genome, or no generation yet.
    """
    id, trial = watched(store, genome)
    settings = _tested_config(store, REPEATS)
    return record(settings, store.genome(id), test_keys(settings, trial))


def watched(store: Store, genome: int | None = None) -> tuple[int, int]:
    """Return a genome's id and its trial, where it is in several the first; None is the first of the whole front.

    Raises:
        StoreError: There is no such genome, or no generation yet.
    """
    if genome is None:
        if not (front := fronts.front(store)):
            raise StoreError(f"{store.folder}: expected at least one generation, but none is stored yet")
        return front[0].genome, front[0].trial
    found = store.individuals()
    trials = found.trial[found.genome == genome]
    if not trials.size:
        raise StoreError(f"{store.folder}: there is no genome {genome}")
    return genome, int(trials[0])

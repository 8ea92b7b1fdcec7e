# SPDX-License-Identifier: BSD-3-Clause
"""Controllers on trial: the paper's Table II, robustness, and a census of what the robots learned to do.

Every controller on the front of every trial is tested in episodes that evolution never saw: their keys hold the
generation ``GENERATION``, which no run reaches. All controllers of a trial meet the same noise. Who tests a run twice
gets the same bits twice.

The result is a file of its own in the run folder, ``table_ii.json``; a later test replaces it. Tests in another world
than that of evolution have no file there.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import pydantic

from swarmevo import plugins, simulation
from swarmevo.analysis import fronts
from swarmevo.analysis.census import LABELS, census
from swarmevo.config import Config
from swarmevo.errors import EvaluationError, Interrupted, StoreError
from swarmevo.evolution.evaluation import Evaluation, Evaluator, never
from swarmevo.protocols import CHANNELS, FloatArray, NativeController, Telemetry
from swarmevo.runs import other_world
from swarmevo.runs.store import Store
from swarmevo.simulation import EpisodeKey, Episodes

GENERATION: Final = 2**32 - 1
"""Of the tests' episode keys; a run has at most a million generations."""
TEAM_SIZES: Final = range(1, 6)
"""Rows of Table II."""
REPEATS: Final = 5
"""Tests of each controller (paper VII)."""
FILE: Final = "table_ii.json"
FORMAT: Final = 1
"""Of the file; another one is refused."""


class PaperRow(NamedTuple):
    """A row of the paper's Table II; rates in [0, 1], times in seconds, None: "Max"."""

    robots: int
    homing_rate: float
    homing_time: float
    push_rate: float
    push_time: float | None


PAPER: Final = (
    PaperRow(1, 0.1333, 10.36, 0.0, None),
    PaperRow(2, 0.2667, 12.37, 0.0, None),
    PaperRow(3, 0.9767, 13.54, 0.96, 43.44),
    PaperRow(4, 0.9333, 13.78, 0.56, 37.42),
    PaperRow(5, 0.8867, 11.68, 0.30, 30.67),
)
"""The paper's Table II."""


@dataclass(frozen=True)
class Outcome:
    """What a number of tests with teams of one size gave."""

    robots: int
    tests: int
    homing_rate: float
    """Share of robots that came within the emitter's range."""
    any_home_rate: float
    """Share of tests in which at least one robot did."""
    all_home_rate: float
    """Share of tests in which all robots did."""
    homing_time: float | None
    """Mean over the robots that did [s]; None: none did."""
    push_rate: float
    """Share of tests in which the box touched the target wall."""
    push_time: float | None
    """Mean over those tests [s]; None: in none, the paper's "Max"."""


@dataclass(frozen=True)
class Tested:
    """One controller of a trial's front."""

    trial: int
    genome: int
    """Its id in the store."""
    evolved: dict[str, float]
    """Its objectives in the run: means over the episodes it was selected by."""
    tested: dict[str, float]
    """The same in the tests, with as many robots as in evolution."""
    outcomes: list[Outcome]
    """One for each team size."""
    behaviours: dict[str, float]
    """Share of robots with each label of the census, with as many robots as in evolution."""


@dataclass(frozen=True)
class Condition:
    """A change of the world that no controller was evolved in."""

    name: str
    changes: str
    """Of the configuration."""
    outcome: Outcome


@dataclass(frozen=True)
class Assessment:
    """All tests of a run."""

    format: int
    generation: int
    """Of the tests' episode keys."""
    generations: dict[int, int]
    """For each trial: how many generations it had when it was tested."""
    repeats: int
    horizon: float
    """Of a test [s]: who has not succeeded by then never does."""
    rows: list[Outcome]
    """Table II: for each team size the means over all controllers."""
    controllers: list[Tested]
    behaviours: dict[str, float]
    """Over all controllers."""
    robustness: list[Condition]
    """The undisturbed world first; empty if it was not asked for."""
    changes: list[str] = field(default_factory=list)
    """What the tests' world has other than that of evolution, key by key."""

    def is_stale(self, store: Store) -> bool:
        """Whether the run has gone on since."""
        return self.generations != {trial: store.generations(trial) for trial in store.trials()}


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
        for trial, genomes in self._genomes.items():
            found[trial] = []
            for genome in genomes:
                if self._stop():
                    raise Interrupted
                seen = record(settings, genome, test_keys(settings, trial), threads=self._workers)
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
                _outcome(robots, result[trial].homing_time[i], result[trial].push_time[i])
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
    homing = np.concatenate([result.homing_time.reshape(-1, robots) for result in results.values()])
    return _outcome(robots, homing, np.concatenate([result.push_time.ravel() for result in results.values()]))


def _outcome(robots: int, homing_time: FloatArray, push_time: FloatArray) -> Outcome:
    """Return the outcome of tests: ``homing_time`` ``(tests, robots)`` and ``push_time`` ``(tests,)``; NaN: never."""
    home = np.isfinite(homing_time)
    return Outcome(
        robots=robots,
        tests=len(push_time),
        homing_rate=float(home.mean()),
        any_home_rate=float(home.any(axis=1).mean()),
        all_home_rate=float(home.all(axis=1).mean()),
        homing_time=_mean(homing_time),
        push_rate=float(np.isfinite(push_time).mean()),
        push_time=_mean(push_time),
    )


def _mean(times: FloatArray) -> float | None:
    finite = times[np.isfinite(times)]
    return float(finite.mean()) if finite.size else None


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


# ---- watching --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Recording:
    """Tests of one individual, with their telemetry."""

    config: Config
    trial: int
    genome: int
    """Its id in the store."""
    episodes: Episodes

    @property
    def telemetry(self) -> Telemetry:
        """All channels."""
        return self.episodes.telemetry

    @property
    def best(self) -> int:
        """The test in which the box was at the wall soonest, else that in which most robots were at the source."""
        pushed = self.telemetry.push_time
        if np.isfinite(pushed).any():
            return int(np.nanargmin(pushed))
        return int(np.isfinite(self.telemetry.homing_time).sum(axis=1).argmax())


def watch(store: Store, genome: int | None = None, tests: int = REPEATS, threads: int = 0) -> Recording:
    """Test an individual and keep the telemetry.

    Args:
        store: The run.
        genome: Id of the individual's genome; None: the first of the front over all trials.
        tests: Number of episodes: the first ones that :func:`assess` runs too.
        threads: 0: one for each processor.

    Raises:
        EvaluationError: An episode failed.
        StoreError: There is no such genome, or no generation yet.
    """
    id, trial = watched(store, genome)
    settings = _tested_config(store, tests)
    episodes = record(settings, store.genome(id), test_keys(settings, trial), threads=threads)
    return Recording(settings, trial, id, episodes)


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


def record(
    settings: Config, genome: FloatArray, keys: Sequence[EpisodeKey], channels: Sequence[str] = (), threads: int = 0
) -> Episodes:
    """Run episodes of one individual and keep their telemetry.

    Args:
        settings: Of the run.
        genome: ``(size,)``: of the robots, or, where each has its own, of the team.
        keys: One for each episode.
        channels: To keep; all if none is named.
        threads: 0: one for each processor.

    Raises:
        EvaluationError: An episode failed.
        PluginError: The controller cannot be made.
        SimulatorError: The library refuses the scene or the policies.
    """
    scene = simulation.Scene(settings)
    robots = scene.info.robots
    ((name, options),) = settings.controller.items()
    controller: Any = plugins.create("controller", name, options)
    genomes = genome.reshape(robots if settings.team.genomes == "individual" else 1, -1)
    wanted, threads = channels or list(CHANNELS), threads or len(os.sched_getaffinity(0))
    if isinstance(controller, NativeController):
        drivers = np.arange(robots, dtype=np.uint32) % len(genomes)
        everyone = np.tile(drivers, (len(keys), 1))
        done = simulation.simulate(scene, controller.policies(genomes), keys, everyone, wanted, threads)
    else:
        teams = np.tile(genomes, (len(keys), robots // len(genomes), 1))
        done = simulation.simulate_lockstep(scene, controller, teams, keys, wanted, threads)
    for key, status, message in zip(keys, done.status, done.messages, strict=True):
        if status:
            raise EvaluationError(f"{key}: the episode failed: {message}")
    return done


# ---- the file --------------------------------------------------------------------------------------------------------


_ASSESSMENT: Final = pydantic.TypeAdapter(Assessment)


def as_json(assessment: Assessment) -> str:
    """Return an assessment as JSON, with the paper's table beside it."""
    found = dataclasses.asdict(assessment) | {"paper": [row._asdict() for row in PAPER]}
    return pydantic.TypeAdapter(dict[str, Any]).dump_json(found, indent=2).decode()


def save(assessment: Assessment, folder: Path) -> Path:
    """Write an assessment into its run's folder, in place of an older one; return the file.

    Args:
        assessment: In the run's own world.
        folder: Of the run.

    Raises:
        StoreError: It cannot be written.
        ValueError: It is of another world.
    """
    if assessment.changes:
        raise ValueError(f"assessment: expected one in the run's own world, got {', '.join(assessment.changes)}")
    file = folder / FILE
    unfinished = file.with_suffix(".tmp")
    try:
        unfinished.write_text(as_json(assessment) + "\n", encoding="utf-8")
        unfinished.replace(file)
    except OSError as error:
        raise StoreError(f"{file}: {error.strerror or error}") from error
    return file


def load(folder: Path) -> Assessment | None:
    """Return the assessment in a run's folder; None: the run was not tested.

    Raises:
        StoreError: The file is damaged or of another version.
    """
    file = folder / FILE
    try:
        found = _ASSESSMENT.validate_json(file.read_bytes())
    except FileNotFoundError:
        return None
    except (OSError, pydantic.ValidationError) as error:
        raise StoreError(f"{file}: is damaged; make it again with swarmevo test") from error
    if found.format != FORMAT:
        raise StoreError(f"{file}: expected format {FORMAT}, got {found.format}; make it again with swarmevo test")
    return found

# SPDX-License-Identifier: BSD-3-Clause
"""Tests of controllers: the paper's Table II, robustness, and a census of what the robots learned to do.

Every controller on the front of every trial is tested in episodes that evolution never saw: their keys hold the
generation ``GENERATION``, which no run reaches. All controllers of a trial meet the same noise. The
same tests give the same bits. Each is stored once (:mod:`swarmevo.runs.tests`), and an
:class:`~swarmevo.analysis.table_ii.Assessment` is a view of what is stored.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from swarmevo import simulation
from swarmevo.analysis import fronts
from swarmevo.analysis.bench import Bench, Candidate, Observe, test_key
from swarmevo.analysis.fronts import FrontPoint
from swarmevo.analysis.measures import Measures, measures_of
from swarmevo.analysis.recording import Recording, record
from swarmevo.analysis.sequential import Until, decide, settled, successes
from swarmevo.analysis.table_ii import Assessment, Condition, Outcome, Tested, Verdict, outcome
from swarmevo.config import Config
from swarmevo.errors import StoreError
from swarmevo.evolution.results import Results
from swarmevo.plugins.team import Team, never
from swarmevo.protocols import FloatArray, Objective
from swarmevo.runs import other_world
from swarmevo.runs.store import Store
from swarmevo.runs.tests import GENERATION, StoredTests, world_of

TABLE_II_SIZES: Final = range(1, 6)
"""Its rows."""
REPEATS: Final = 5
"""Tests of each controller (paper VII)."""

_LARGEST_TEAM: Final = 64


# ---- the tests -------------------------------------------------------------------------------------------------------


def team_sizes(settings: Config) -> list[int]:
    """Return the sizes of teams that are tested where nobody names any: those of Table II, and the one evolved.

    Where each robot has a genome of its own there are no larger teams.
    """
    robots = settings.team.robots
    sizes = {*TABLE_II_SIZES, robots}
    return sorted(size for size in sizes if size <= robots or not settings.team.has_own_genomes)


def assess(
    store: Store,
    sizes: Sequence[int] | None = None,
    repeats: int = REPEATS,
    robustness: bool = False,
    workers: int = 0,
    observe: Observe = lambda done, total: None,
    stop: Callable[[], bool] = never,
    overrides: Sequence[str] = (),
    until: Until | None = None,
    genome: int | None = None,
    tests: StoredTests | None = None,
) -> Assessment:
    """Test every controller on the front of every trial, as far as its tests are not stored.

    Args:
        store: The run.
        sizes: Of the teams: rows of the table. None: :func:`team_sizes`.
        repeats: Tests of each controller and team size, at least; there may be more already.
        robustness: Also with other noise, other starts and the other bumpers.
        workers: Episodes at once; 0: one for each processor.
        observe: Told about the progress.
        stop: Asked now and then; when true, the tests end; what was tested is stored.
        overrides: Of the world, ``section.key=value`` (:func:`swarmevo.runs.other_world.load`).
        until: Ends a controller's tests when it is decided; then ``repeats`` is the most.
        genome: Id of an individual: it alone is tested.
        tests: Those of the run, open for writing; None: they are opened here.

    Raises:
        ConfigError: An override is refused, or a size: each robot has a genome of its own.
        EvaluationError: A plugin or an episode failed.
        InvalidArgument: The task has no such rate as is to be decided.
        Interrupted: ``stop`` said so.
        SimulatorError: The world does not take teams of such a size.
        StoreError: The run has no generation yet, there is no such genome, or the tests cannot be stored.
    """
    if tests is None:
        with StoredTests.open(store, readonly=False) as opened:
            return assess(
                store, sizes, repeats, robustness, workers, observe, stop, overrides, until, genome, tests=opened
            )
    settings = other_world.load(store, overrides)
    bench = Bench(store.config, tests, _candidates(store, genome), store.objectives, workers, observe, stop)
    return assess_bench(bench, store.config, settings, sizes, repeats, robustness, until)


def assess_genomes(
    settings: Config,
    genomes: FloatArray,
    sizes: Sequence[int] | None = None,
    repeats: int = REPEATS,
    robustness: bool = False,
    workers: int = 0,
    observe: Observe = lambda done, total: None,
    stop: Callable[[], bool] = never,
    until: Until | None = None,
) -> Assessment:
    """Test controllers that are of no run, as those of trial 0; nothing is stored.

    Args:
        settings: Their world, controller and fitness, with a seed. Its ``worlds`` and ``vary`` are left out.
        genomes: ``(k, size)``; each is known by its number, from 0.
        sizes: As of :func:`assess`, and so are those that follow.
        repeats: See there.
        robustness: See there.
        workers: See there.
        observe: See there.
        stop: See there.
        until: See there.

    Raises:
        ConfigError, EvaluationError, InvalidArgument, Interrupted, SimulatorError: As :func:`assess`.
    """
    settings = other_world.one_world(settings)
    team = Team(settings)
    with StoredTests.forgotten(len(team.objectives), len(team.descriptors)) as tests:
        candidates = [Candidate(0, i, genes, {}) for i, genes in enumerate(genomes)]
        bench = Bench(settings, tests, candidates, team.objectives, workers, observe, stop)
        return assess_bench(bench, settings, settings, sizes, repeats, robustness, until)


def assess_one(settings: Config, genes: FloatArray, repeats: int, trial: int = 0) -> tuple[Outcome, Measures]:
    """Test a controller in one world, with the team of that world; nothing is stored.

    Args:
        settings: Its world, controller and fitness, with a seed.
        genes: ``(size,)``
        repeats: Tests.
        trial: Whose noise it meets.

    Returns:
        What the tests gave, and which of it says something of the task.

    Raises:
        ConfigError, EvaluationError, SimulatorError: As :func:`assess`.
    """
    settings = other_world.one_world(settings)
    team = Team(settings)
    with StoredTests.forgotten(len(team.objectives), len(team.descriptors)) as tests:
        one = Candidate(trial, 0, genes, {})
        bench = Bench(settings, tests, [one], team.objectives, workers=0)
        bench.test(settings, repeats)
        found = bench.stored(settings, one)
        found = found.only(found.repeat < repeats)
        return _outcome(bench, settings.team.robots, found), measures_of(settings, team.objectives)


@dataclass(frozen=True)
class Retested:
    """A controller of a trial's front, on fresh seeds."""

    trial: int
    genome: int
    """Its id in the store."""
    evolved: dict[str, float]
    """Its objectives in the run."""
    tested: FloatArray
    """The same in the tests: ``(repeats, objectives)``."""
    success: FloatArray
    """How far each of them was a success, ``(repeats,)``; 0, if no rate was asked for."""


def retest(
    store: Store,
    repeats: int,
    workers: int = 0,
    observe: Observe = lambda done, total: None,
    stop: Callable[[], bool] = never,
    rate: str | None = None,
) -> list[Retested]:
    """Test every controller on the front of every trial with the team of evolution: the first so many of its tests.

    Args:
        store: The run.
        repeats: Tests of each controller.
        workers: As of :func:`assess`, and so are those that follow.
        observe: See there.
        stop: See there.
        rate: Of success (:attr:`~swarmevo.analysis.measures.Measures.rates`); None: none.

    Raises:
        EvaluationError, Interrupted, SimulatorError, StoreError: As :func:`assess`.
    """
    settings = other_world.test_world(store.config)
    with StoredTests.open(store, readonly=False) as tests:
        bench = Bench(store.config, tests, _candidates(store), store.objectives, workers, observe, stop)
        bench.plan(repeats)
        bench.test(settings, repeats)
        found = [(one, bench.stored(settings, one)) for one in bench.candidates]
    counted = [(one, tests.only(tests.repeat < repeats)) for one, tests in found]
    return [
        Retested(
            trial=one.trial,
            genome=one.genome,
            evolved=dict(one.evolved),
            tested=tests["objective"],
            success=successes(rate, tests, store.objectives) if rate else np.zeros(len(tests)),
        )
        for one, tests in counted
    ]


def assess_bench(
    bench: Bench,
    run: Config,
    settings: Config,
    sizes: Sequence[int] | None,
    repeats: int,
    robustness: bool = False,
    until: Until | None = None,
) -> Assessment:
    """Test the controllers of a bench, and return what is stored of them then.

    Args:
        bench: With somebody to test.
        run: The configuration that they were evolved with.
        settings: The same, or that of another world.
        sizes: As of :func:`assess`, and so are those that follow.
        repeats: See there.
        robustness: See there.
        until: See there.

    Raises:
        ConfigError, EvaluationError, InvalidArgument, Interrupted, SimulatorError, StoreError: As :func:`assess`.
    """
    until = until and settled(until, measures_of(settings, bench.objectives))
    sizes = team_sizes(settings) if sizes is None else sizes
    teams = _teams(settings, (*sizes, run.team.robots))
    worlds = _worlds(settings) if robustness else {}
    bench.plan(repeats * (len(teams) + len(worlds) + 1))  # and once more for the census
    for world in (*teams.values(), *(world for _, world in worlds.values())):
        bench.test(world, repeats, until)
    bench.watch(settings, repeats)
    return _view(bench, run, settings, sizes, worlds, (until, repeats) if until else None)


def stored(store: Store) -> Assessment | None:
    """Return what is stored of the controllers on the fronts in the run's own world; None: they were not tested.

    Raises:
        StoreError: The tests are damaged, or of another version.
    """
    settings = other_world.test_world(store.config)
    with StoredTests.open(store) as tests:
        known = set(tests.worlds())
        most = settings.team.robots if settings.team.has_own_genomes else _LARGEST_TEAM
        teams = {robots: other_world.of_size(settings, robots) for robots in range(1, most + 1)}
        sizes = [robots for robots, team in teams.items() if world_of(settings, team) in known]
        worlds = {name: one for name, one in _worlds(settings).items() if world_of(settings, one[1]) in known}
        if not store.trials() or not sizes:
            return None
        bench = Bench(settings, tests, _candidates(store), store.objectives)
        found = _view(bench, settings, settings, sizes, worlds)
    return found if found.controllers else None


def _candidates(store: Store, genome: int | None = None) -> list[Candidate]:
    """Return the controllers on the front of every trial, or an individual of the run."""
    if genome is not None:
        _, trial = watched(store, genome)
        found = store.individuals(trial)
        names = [objective.name for objective in store.objectives]
        (evolved,) = found.objectives[found.genome == genome].tolist()
        return [Candidate(trial, genome, store.genome(genome), dict(zip(names, evolved, strict=True)))]
    if not (trials := store.trials()):
        raise StoreError(f"{store.folder}: expected at least one generation to test, but none is stored yet")
    return [
        Candidate(trial, point.genome, store.genome(point.genome), point.objectives)
        for trial in trials
        for point in fronts.front(store, trial)
    ]


def _teams(settings: Config, sizes: Sequence[int]) -> dict[int, Config]:
    return {robots: other_world.of_size(settings, robots) for robots in dict.fromkeys(sizes)}


# ---- views of what is stored -----------------------------------------------------------------------------------------


def _view(
    bench: Bench,
    run: Config,
    settings: Config,
    sizes: Sequence[int],
    worlds: dict[str, tuple[str, Config]],
    wanted: tuple[Until, int] | None = None,
) -> Assessment:
    """Return what is stored of a bench's controllers; ``wanted``: what was to be decided, in how many tests at most."""
    evolved_robots = run.team.robots
    teams = _teams(settings, (*sizes, evolved_robots))
    results = {robots: [bench.stored(team, one) for one in bench.candidates] for robots, team in teams.items()}
    of_sizes = {robots: results[robots] for robots in sizes if any(map(len, results[robots]))}
    changes = other_world.changes(run, settings)
    conditions = [
        Condition(name, change, row)
        for name, change, found in (
            ("as set" if changes else "as evolved", "none", results[evolved_robots]),
            *(
                (name, change, [bench.stored(world, one) for one in bench.candidates])
                for name, (change, world) in worlds.items()
            ),
        )
        for row in _pooled(bench, evolved_robots, found)
    ]
    seen = [bench.census(settings, one) for one in bench.candidates]
    controllers = [
        Tested(
            trial=one.trial,
            genome=one.genome,
            evolved=dict(one.evolved),
            tested=_means(bench.objectives, results[evolved_robots][i]),
            outcomes=[_outcome(bench, robots, found[i]) for robots, found in of_sizes.items() if len(found[i])],
            behaviours=seen[i],
        )
        for i, one in enumerate(bench.candidates)
        if any(len(found[i]) for found in results.values())
    ]
    rows = [row for robots, found in of_sizes.items() for row in _pooled(bench, robots, found)]
    return Assessment(
        generation=GENERATION,
        repeats=min((_least(found) for found in of_sizes.values()), default=0),
        measures=measures_of(settings, bench.objectives),
        horizon=settings.episode.horizon,
        rows=rows,
        controllers=controllers,
        behaviours=_mean_shares([shares for shares in seen if shares]),
        robustness=conditions if worlds else [],
        changes=changes,
        until=wanted and wanted[0],
        verdicts=list(_verdicts(bench, of_sizes, *wanted)) if wanted else [],
        untested=sum(not all(len(found[i]) for found in results.values()) for i in range(len(bench.candidates))),
    )


def _verdicts(bench: Bench, results: dict[int, list[Results]], until: Until, most: int) -> Iterator[Verdict]:
    for i, one in enumerate(bench.candidates):
        for robots, found in results.items():
            decided = decide(until, successes(until.rate, found[i], bench.objectives), most)
            yield Verdict(**vars(decided), trial=one.trial, genome=one.genome, robots=robots)


def _outcome(bench: Bench, robots: int, *results: Results) -> Outcome:
    """Return the outcome of all the tests together."""
    homing_time, push_time, values = (
        np.concatenate([one[column] for one in results]) for column in ("homing_time", "push_time", "objective")
    )
    return outcome(robots, homing_time, push_time, bench.objectives, values)


def _least(results: Sequence[Results]) -> int:
    """Return how many tests each controller that was tested has."""
    return min((len(one) for one in results if len(one)), default=0)


def _pooled(bench: Bench, robots: int, results: Sequence[Results]) -> list[Outcome]:
    """Return the outcome over all controllers that were tested, each by as many tests; [] if none was."""
    least = _least(results)
    counted = [one.only(one.repeat < least) for one in results if len(one)]
    return [_outcome(bench, robots, *counted)] if counted else []


def _means(objectives: Sequence[Objective], results: Results) -> dict[str, float]:
    if not len(results):
        return {}
    names = [objective.name for objective in objectives]
    return dict(zip(names, results["objective"].mean(axis=0).tolist(), strict=True))


def _mean_shares(shares: Sequence[dict[str, float]]) -> dict[str, float]:
    return {label: float(np.mean([share[label] for share in shares])) for label in shares[0]} if shares else {}


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


# ---- the most successful ---------------------------------------------------------------------------------------------


def most_successful(store: Store, tests: Assessment | None = None) -> FrontPoint:
    """Return who of the fronts succeeds most often in what matters most.

    Tests decide among the fronts of all trials where all controllers have had them, each as many of them as episodes in
    evolution at least. Else what evolution knows decides, among the front over all trials.

    Args:
        store: The run.
        tests: Of its fronts, as :func:`stored` returns them; None: they are read here.

    Raises:
        StoreError: There is no generation yet, or it cannot be read.
    """
    points = [point for trial in store.trials() for point in fronts.front(store, trial)]
    if not points:
        raise StoreError(f"{store.folder}: expected at least one generation, but none is stored yet")
    tests = stored(store) if tests is None else tests
    by_place = {(point.trial, point.genome): point for point in points}
    if tests is None or not _know_more(tests, by_place):
        return fronts.most_successful(fronts.front(store), measures_of(store.config, store.objectives))
    best = tests.most_successful
    return by_place[best.trial, best.genome]


def _know_more(tests: Assessment, points: Mapping[tuple[int, int], FrontPoint]) -> bool:
    """Return whether tests know as much of every controller as evolution does."""
    done = {(one.trial, one.genome): sum(outcome.tests for outcome in one.outcomes) for one in tests.controllers}
    return not tests.untested and all(done.get(place, 0) >= point.episodes for place, point in points.items())


# ---- watching -------------------------------------------------------------------------------------------------------


def watch(store: Store, genome: int | None = None) -> Recording:
    """Test an individual ``REPEATS`` times, in the first episodes that :func:`assess` runs too, and keep the telemetry.

    Args:
        store: The run.
        genome: Id of the individual's genome; None: the most successful.

    Raises:
        EvaluationError: An episode failed.
        StoreError: There is no such genome, or no generation yet.
    """
    id, trial = watched(store, genome)
    settings = other_world.test_world(store.config)
    return record(settings, store.genome(id), [test_key(settings, trial, i) for i in range(REPEATS)])


def watched(store: Store, genome: int | None = None) -> tuple[int, int]:
    """Return a genome's id and its trial, where it is in several the first; None is the run's most successful.

    Raises:
        StoreError: There is no such genome, or no generation yet.
    """
    if genome is None:
        best = most_successful(store)
        return best.genome, best.trial
    found = store.individuals()
    trials = found.trial[found.genome == genome]
    if not trials.size:
        raise StoreError(f"{store.folder}: there is no genome {genome}")
    return genome, int(trials[0])

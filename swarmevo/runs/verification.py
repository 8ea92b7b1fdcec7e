# SPDX-License-Identifier: BSD-3-Clause
"""Whether a run's results can be had again: stored evaluations are simulated anew and compared, bit by bit.

What differs is explained by the provenance, if it can be: episodes know the session that ran them, and a session knows
the versions, the library and the machine that it had.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from swarmevo.evolution.evaluation import Evaluator
from swarmevo.evolution.results import Results
from swarmevo.plugins.team import never
from swarmevo.protocols import BoolArray
from swarmevo.runs.comparison import differing
from swarmevo.runs.driver import check_objectives, origin_of
from swarmevo.runs.provenance import changed_files
from swarmevo.runs.store import Store
from swarmevo.runs.tests import StoredTests
from swarmevo.runs.tests_again import DifferentTest, simulated_anew

EXPLAINING: Final = (
    "swarmevo",
    "git_revision",
    "library",
    "plugins",
    "numpy",
    "python",
    "libm",
    "libc",
    "platform",
)
"""Entries of the provenance that a result may depend on, besides the plugins' files and the CPUs."""


@dataclass(frozen=True)
class Difference:
    """An episode that did not come out as it is stored."""

    trial: int
    generation: int
    individual: int
    repeat: int
    genome: int
    """Its id in the store."""
    session: int
    """That ran it."""
    what: tuple[str, ...]
    """What differs: ``trajectory``, names of objectives, other columns, ``fault``."""


@dataclass(frozen=True)
class Report:
    """What came of verifying a run."""

    evaluations: int
    """Individuals of generations, all repeats of each."""
    checked: int
    """Of them."""
    episodes: int
    """Simulated anew."""
    differences: tuple[Difference, ...]
    explanations: tuple[str, ...]
    """For each session of the differences, one line for each thing that has changed since; or that nothing has."""
    damage: tuple[str, ...]
    """What is not as it was stored, one line each; nothing was simulated then."""
    tests: int = 0
    """Stored by ``swarmevo test``."""
    tests_checked: int = 0
    """Of them."""
    different_tests: tuple[DifferentTest, ...] = ()

    @property
    def is_sound(self) -> bool:
        """Whether everything came out as it is stored."""
        return not self.differences and not self.different_tests and not self.damage


def verify(
    store: Store,
    workers: int,
    sample: int | None = None,
    observe: Callable[[int, int], None] = lambda done, total: None,
    stop: Callable[[], bool] = never,
) -> Report:
    """Hold all that is stored against its checksums; if it is intact, simulate stored evaluations anew.

    Args:
        store: Of the run.
        workers: Episodes to run at once; 0 is one for each processor.
        sample: How many evaluations, and how many tests, drawn at random; None is all.
        observe: Told how many of how many evaluations are done; then of how many controllers' tests in a world.
        stop: Asked between jobs.

    Raises:
        EvaluationError, PluginError, SimulatorError: The run's configuration cannot be run here.
        Interrupted: ``stop`` said so.
        StoreError: The run cannot be read, or its plugins now measure something else.
    """
    damage = tuple(store.damage() or store.damaged_start())
    if damage:  # what is not known of the run cannot be known of its tests
        return Report(0, 0, 0, (), (), damage)
    with StoredTests.open(store, check=False) as tests:
        if damage := tuple(tests.damage()):
            return Report(0, 0, 0, (), (), damage)
        return _simulated_anew(store, tests, workers, sample, observe, stop)


def _simulated_anew(
    store: Store,
    tests: StoredTests,
    workers: int,
    sample: int | None,
    observe: Callable[[int, int], None],
    stop: Callable[[], bool],
) -> Report:
    config = store.config
    places = _places(store)
    chosen = places if sample is None else _drawn(places, sample)
    differences: list[Difference] = []
    done, episodes = 0, 0
    with Evaluator(config, workers) as evaluator:
        check_objectives(store, evaluator)
        for (trial, number), individuals in _by_generation(chosen).items():
            stored = store.generation(trial, number)
            wanted = np.isin(stored.episodes.individual, individuals)
            known = stored.episodes.only(~wanted)
            counts = np.bincount(stored.episodes.individual)
            again = evaluator.evaluate(stored.genomes, trial, number, stop, known, episodes=counts).episodes
            differences += _compare(store, (trial, number), stored.episodes, again, wanted)
            done, episodes = done + len(individuals), episodes + int(wanted.sum())
            observe(done, len(chosen))
        now = origin_of(config, evaluator)
    tested = simulated_anew(store, tests, workers, sample, observe, stop)
    return Report(
        evaluations=len(places),
        checked=len(chosen),
        episodes=episodes,
        differences=tuple(differences),
        explanations=(*_explanations(store, differences, now), *_explained_tests(tests, tested.differences, now)),
        damage=(),
        tests=tested.tests,
        tests_checked=tested.checked,
        different_tests=tested.differences,
    )


# ---- which evaluations -----------------------------------------------------------------------------------------------

Place = tuple[int, int, int]  # trial, generation, individual


def _places(store: Store) -> list[Place]:
    return [
        (trial, number, individual)
        for trial in store.trials()
        for number in range(store.generations(trial))
        for individual in range(len(store.genome_ids(trial, number)))
    ]


def _drawn(places: Sequence[Place], sample: int) -> list[Place]:
    drawn = np.random.default_rng().choice(len(places), size=min(sample, len(places)), replace=False)
    return [places[i] for i in np.sort(drawn)]


def _by_generation(places: Sequence[Place]) -> dict[tuple[int, int], list[int]]:
    found: dict[tuple[int, int], list[int]] = {}
    for trial, number, individual in places:
        found.setdefault((trial, number), []).append(individual)
    return found


# ---- what differs, and why -------------------------------------------------------------------------------------------


def _compare(
    store: Store, place: tuple[int, int], stored: Results, again: Results, wanted: BoolArray
) -> Iterator[Difference]:
    genomes, sessions = store.genome_ids(*place), store.sessions(*place)
    for i in np.flatnonzero(wanted).tolist():
        if what := tuple(differing(store, stored, i, again, i)):
            individual, repeat = int(stored.individual[i]), int(stored.repeat[i])
            yield Difference(*place, individual, repeat, int(genomes[individual]), int(sessions[i]), what)


def explain(store: Store, session: int) -> list[str]:
    """Return what has changed since a session of a run, one line each; or that nothing has."""
    with Evaluator(store.config, workers=1) as evaluator:
        return _explain(store.session(session), origin_of(store.config, evaluator))


def _explain(then: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    return list(_changes(then, now)) or [
        "versions, plugins, library and CPU are the same; a plugin is not deterministic, or the database was changed"
    ]


def _explanations(store: Store, differences: Sequence[Difference], now: Mapping[str, Any]) -> Iterator[str]:
    for session in sorted({difference.session for difference in differences}):
        yield from (f"session {session}: {line}" for line in _explain(store.session(session), now))


def _explained_tests(tests: StoredTests, differences: Sequence[DifferentTest], now: Mapping[str, Any]) -> Iterator[str]:
    for session in sorted({difference.session for difference in differences}):
        yield from (f"session {session} of tests: {line}" for line in _explain(tests.session(session), now))


def _changes(then: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """Yield one line for each entry that was different when the episodes ran, the likeliest cause first."""
    for file, plugins in changed_files(then, now).items():
        yield f"{file} of {', '.join(plugins)} was changed"
    for name in EXPLAINING:
        before, after = _flat(then.get(name)), _flat(now.get(name))
        for key in sorted(before.keys() | after.keys()):
            if before.get(key) != after.get(key) and key != "path":
                title = f"{name} {key}".rstrip()
                yield f"{title} was {before.get(key, 'not noted')}, is {after.get(key, 'not noted')}"
    if (before_cpus := _cpus(then)) != (after_cpus := _cpus(now)):
        yield f"cpu was {before_cpus}, is {after_cpus}"


def _cpus(origin: Mapping[str, Any]) -> str:
    """Return on what episodes ran: this machine's CPU, or those of a cluster's workers."""
    return ", ".join(map(str, origin.get("worker_cpus") or [origin.get("cpu", "not noted")]))


def _flat(entry: Any) -> dict[str, Any]:
    if isinstance(entry, Mapping):
        return dict(entry)
    if isinstance(entry, list):
        return {str(i): line for i, line in enumerate(entry)}
    return {} if entry is None else {"": entry}

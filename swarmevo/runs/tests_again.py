# SPDX-License-Identifier: BSD-3-Clause
"""Whether a run's tests can be had again: stored ones are simulated anew, each alone, and compared bit by bit."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from swarmevo import config as configuration
from swarmevo.config import Config
from swarmevo.errors import StoreError
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.evolution.results import Results
from swarmevo.plugins.team import never
from swarmevo.protocols import IntArray
from swarmevo.runs import other_world
from swarmevo.runs.comparison import differing
from swarmevo.runs.store import Store
from swarmevo.runs.tests import GENERATION, Place, StoredTests

Observe = Callable[[int, int], None]


@dataclass(frozen=True)
class DifferentTest:
    """A test that did not come out as it is stored."""

    world: str
    """What it has other than that of evolution, as JSON."""
    trial: int
    genome: int
    """Its id in the store."""
    repeat: int
    session: int
    """Of ``tests.sqlite``, that ran it."""
    what: tuple[str, ...]
    """What differs: ``trajectory``, names of objectives, other columns, ``fault``."""


@dataclass(frozen=True)
class Simulated:
    """What came of simulating tests anew."""

    tests: int
    """Stored."""
    checked: int
    differences: tuple[DifferentTest, ...]


def simulated_anew(
    store: Store,
    tests: StoredTests,
    workers: int,
    sample: int | None,
    observe: Observe = lambda done, total: None,
    stop: Callable[[], bool] = never,
) -> Simulated:
    """Simulate stored tests anew.

    Args:
        store: The run.
        tests: Those of the run.
        workers: Episodes to run at once; 0 is one for each processor.
        sample: How many tests, drawn at random; None is all.
        observe: Told of how many controllers' tests in a world, of how many, are done.
        stop: Asked between jobs.

    Raises:
        EvaluationError, PluginError, SimulatorError: They cannot be run here.
        Interrupted: ``stop`` said so.
        StoreError: They cannot be read, or are of a genome that the run does not have.
    """
    ids = store.genome_ids_by_digest()
    stored = {place: tests.episodes(place, _world(store, place).team.robots) for place in tests.places()}
    total = sum(map(len, stored.values()))
    drawn = np.ones(total, dtype=np.bool_)
    if sample is not None and sample < total:
        drawn[np.random.default_rng().choice(total, size=total - sample, replace=False)] = False
    differences: list[DifferentTest] = []
    start = 0
    for done, (place, episodes) in enumerate(stored.items(), start=1):
        wanted = episodes.repeat[drawn[start : start + len(episodes)]]
        start += len(episodes)
        if place.genome not in ids:
            raise StoreError(f"{tests.file}: expected tests of the run's genomes, got those of {place.genome.hex()}")
        if len(wanted):
            differences += _differences(store, tests, place, ids[place.genome], episodes, wanted, workers, stop)
        observe(done, len(stored))
    return Simulated(total, int(drawn.sum()), tuple(differences))


def _differences(
    store: Store,
    tests: StoredTests,
    place: Place,
    genome: int,
    stored: Results,
    wanted: IntArray,
    workers: int,
    stop: Callable[[], bool],
) -> Iterator[DifferentTest]:
    settings = _world(store, place)
    repeats = int(stored.repeat.max()) + 1
    evolution = settings.evolution.model_copy(update={"repeats": repeats})
    settings = settings.model_copy(update={"evolution": evolution})
    genes = other_world.first_robots(settings, store.genome(genome)[np.newaxis], store.config.team.robots)
    known = stored.only(~np.isin(stored.repeat, wanted))
    with Evaluator(settings, workers) as evaluator:
        again = evaluator.evaluate(genes, place.trial, GENERATION, stop, known if len(known) else None).episodes
    sessions = tests.sessions(place)
    for i, repeat in enumerate(stored.repeat.tolist()):
        if repeat in wanted and (what := tuple(differing(store, stored, i, again, repeat))):
            yield DifferentTest(place.world, place.trial, genome, repeat, sessions[i], what)


def _world(store: Store, place: Place) -> Config:
    return configuration.changed(
        other_world.test_world(store.config), configuration.as_overrides(json.loads(place.world))
    )

# SPDX-License-Identifier: BSD-3-Clause
"""Where controllers are tested: what is stored is not run again, what is run is stored as it comes."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any, Final

import numpy as np

from swarmevo.analysis.census import LABELS, by_episode, fitting
from swarmevo.analysis.recording import simulate
from swarmevo.analysis.sequential import Until, decide, looks, successes
from swarmevo.config import Config
from swarmevo.errors import Interrupted
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.evolution.results import Results, joined
from swarmevo.plugins.team import Team, never
from swarmevo.protocols import CENSUS_CHANNELS, FloatArray, Objective
from swarmevo.runs import checksums, other_world
from swarmevo.runs.driver import origin_of
from swarmevo.runs.tests import GENERATION, Place, StoredTests, world_of
from swarmevo.simulation import EpisodeKey

MOST_REPEATS: Final = 65535
"""Tests of a controller: their keys count them in 16 bits."""
MOST_CENSUS: Final = 24
"""Tests of a controller that the census watches."""
_KEPT_SECONDS: Final = 1.0
"""Results are stored when they are that old: what a kill may cost."""

Observe = Callable[[int, int], None]
"""Called with the number of episodes done and the number of all."""


@dataclass(frozen=True)
class Candidate:
    """A controller to test."""

    trial: int
    """Of the run, from 0: all its controllers meet the same noise."""
    genome: int
    """Its id."""
    genes: FloatArray = field(repr=False)
    """``(size,)``"""
    evolved: Mapping[str, float]
    """Its objectives in the run: means over the episodes it was selected by."""


class Bench:
    """Tests some controllers of a run, or of none, in several worlds.

    Args:
        run: The configuration that they were evolved with, and a seed.
        tests: Those that there are, to which new ones are added.
        candidates: Whom to test.
        objectives: That they are judged by.
        workers: Episodes at once; 0: one for each processor.
        observe: Told about the progress.
        stop: Asked now and then; when true, the tests end.
    """

    def __init__(
        self,
        run: Config,
        tests: StoredTests,
        candidates: Sequence[Candidate],
        objectives: Sequence[Objective],
        workers: int = 1,
        observe: Observe = lambda done, total: None,
        stop: Callable[[], bool] = never,
    ) -> None:
        self._run, self._tests, self._workers, self._observe, self._stop = run, tests, workers, observe, stop
        self.candidates, self.objectives = candidates, objectives
        self._digests = {id(one): checksums.of_genes(one.genes) for one in candidates}
        self._is_begun = False
        self._done = self._total = 0

    # ---- what there is

    def stored(self, settings: Config, candidate: Candidate) -> Results:
        """Return the tests of a controller in a world: all that are there without a gap, from the first on."""
        found = self._tests.episodes(self._place(settings, candidate), settings.team.robots)
        return found.only(_without_gap(found.repeat))

    def census(self, settings: Config, candidate: Candidate) -> dict[str, float]:
        """Return the share of robots with each label that fits the scene, over what the census watched; {}: nothing.

        The labels of the fitness functions come after those of the paper.
        """
        shares = list(self._tests.shares(self._place(settings, candidate)).values())
        if not shares:
            return {}
        general = dict(zip(LABELS, np.mean([one[: len(LABELS)] for one in shares], axis=0).tolist(), strict=True))
        own = [dict(one[len(LABELS) :]) for one in shares]
        labels = [label for label in own[0] if all(label in one for one in own)]
        return {
            **{label: general[label] for label in fitting(settings)},
            **{label: float(np.mean([one[label] for one in own])) for label in labels},
        }

    def _place(self, settings: Config, candidate: Candidate) -> Place:
        return Place(world_of(self._run, settings), candidate.trial, self._digests[id(candidate)])

    # ---- what is run

    def plan(self, tests: int) -> None:
        """Announce how often each controller is tested."""
        self._total = tests * len(self.candidates)

    def test(self, settings: Config, repeats: int, until: Until | None = None) -> None:
        """Run what is missing of each controller's first tests in a world.

        Args:
            settings: The world.
            repeats: Tests of each controller.
            until: Ends a controller's tests before that.

        Raises:
            EvaluationError: A plugin or an episode failed.
            Interrupted: ``stop`` said so.
            StoreError: The tests cannot be stored.
        """
        done = self._done + repeats * len(self.candidates)
        active = list(self.candidates)
        for upto in looks(repeats) if until else [repeats]:
            self._test(settings, active, upto)
            if until:
                active = [one for one in active if self._is_open(settings, one, upto, until)]
            if not active:
                break
        self._note(done - self._done)

    def _is_open(self, settings: Config, candidate: Candidate, tests: int, until: Until) -> bool:
        found = self.stored(settings, candidate)
        return decide(until, successes(until.rate, found, self.objectives), tests).verdict == "open"

    def _test(self, settings: Config, candidates: Sequence[Candidate], upto: int) -> None:
        # A controller written in Python sees several of its episodes at once: always the same ones.
        with Evaluator(_repeated(settings, 1), 1) as evaluator:
            block = evaluator.block
        repeats = min(-(-upto // block) * block, MOST_REPEATS)
        parts = []
        for trial, group in groupby(sorted(candidates, key=lambda one: one.trial), key=lambda one: one.trial):
            members = list(group)
            places = [self._place(settings, one) for one in members]
            known = self._known(places, settings.team.robots, repeats)
            if len(known) < repeats * len(members):
                parts.append((trial, members, places, known))
        if not parts:
            return
        with Evaluator(_repeated(settings, repeats), self._workers) as evaluator:
            self._begin(evaluator)
            for trial, members, places, known in parts:
                genomes = np.array([one.genes for one in members])
                team = other_world.first_robots(settings, genomes, self._run.team.robots)
                self._evaluate(evaluator, team, trial, places, known)

    def _known(self, places: Sequence[Place], robots: int, repeats: int) -> Results:
        found = [self._tests.episodes(place, robots) for place in places]
        known = [one.only(one.repeat < repeats) for one in found]
        return joined([_of_individual(one, i) for i, one in enumerate(known)])

    def _evaluate(
        self, evaluator: Evaluator, genomes: FloatArray, trial: int, places: list[Place], known: Results
    ) -> None:
        pending: list[Results] = []
        stored_at = time.monotonic()

        def store() -> None:  # many in one transaction: each waits for the disk
            if pending:
                self._tests.add_episodes(places, joined(pending))
            pending.clear()

        def keep(results: Results, seconds: float) -> None:
            nonlocal stored_at
            pending.append(results)
            self._note(len(results))
            if time.monotonic() - stored_at > _KEPT_SECONDS:
                store()
                stored_at = time.monotonic()

        try:
            done = evaluator.evaluate(genomes, trial, GENERATION, self._stop, known if len(known) else None, keep)
            failed = np.array([bool(fault) for fault in done.episodes.faults])
            if failed.any():
                pending.append(done.episodes.only(failed))
        finally:
            store()

    def _begin(self, evaluator: Evaluator) -> None:
        if not self._is_begun:
            self._tests.begin_session(origin_of(self._run, evaluator))
            self._is_begun = True

    def watch(self, settings: Config, repeats: int) -> None:
        """Take the census of each controller's first tests in a world, at most ``MOST_CENSUS``; as :meth:`test`."""
        with Evaluator(_repeated(settings, 1), 1) as evaluator:
            block = evaluator.block
            upto = min(-(-repeats // block) * block, MOST_CENSUS)
            team = Team(settings)
            for one in self.candidates:
                place = self._place(settings, one)
                found = self._tests.shares(place)
                missing = [i for i in range(upto) if len(found.get(i, ())) < len(LABELS)]
                blocks = sorted({i // block for i in missing}) if block > 1 else [0] if missing else []
                for number in blocks:
                    if self._stop():
                        raise Interrupted
                    self._begin(evaluator)
                    wanted = range(number * block, (number + 1) * block) if block > 1 else missing
                    keys = [test_key(self._run, one.trial, i) for i in wanted]
                    seen = simulate(team, one.genes, keys, self._workers, sorted({*CENSUS_CHANNELS, *team.channels}))
                    shares = by_episode(settings, seen.telemetry, seen.steps.tolist()).tolist()
                    own = [list(team.behaviours(seen, i).items()) for i in range(len(keys))]
                    self._tests.add_shares(
                        place, {i: [*of, *more] for i, of, more in zip(wanted, shares, own, strict=True)}
                    )
                self._note(upto)

    def _note(self, episodes: int) -> None:
        self._done += max(0, episodes)
        self._observe(min(self._done, self._total), self._total)


def test_key(run: Config, trial: int, repeat: int) -> EpisodeKey:
    """Return the key of a trial's test, from 0."""
    assert run.evolution.seed is not None  # a run's configuration has one
    return EpisodeKey(run.evolution.seed, trial, GENERATION, repeat)


def _repeated(settings: Config, repeats: int) -> Config:
    evolution = settings.evolution.model_copy(update={"repeats": repeats})
    return settings.model_copy(update={"evolution": evolution})


def _of_individual(results: Results, individual: int) -> Results:
    return Results(
        individual=np.full(len(results), individual, dtype=np.intp),
        repeat=results.repeat,
        values=results.values,
        faults=results.faults,
        seconds=results.seconds,
    )


def _without_gap(repeat: Any) -> Any:
    """Return which of sorted repeats have all others before them."""
    return repeat == np.arange(len(repeat))

# SPDX-License-Identifier: BSD-3-Clause
"""The loop: ask the optimiser, evaluate, tell it, store. Nothing here knows what the optimiser does.

All that a generation depends on is the optimiser's state after the one before, and both are stored in one transaction.
So a run that was killed and continued, however often, gives the same bits as one that never was. Results are kept as
they come: of a generation that was cut short only the jobs in work are run again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any, Final, Protocol

import moocore
import numpy as np

from swarmevo.config import Config
from swarmevo.errors import ConfigError, EvaluationError
from swarmevo.evolution.archive import Archive
from swarmevo.evolution.budget import Budget
from swarmevo.evolution.costs import to_costs
from swarmevo.evolution.evaluation import Evaluation, Evaluator
from swarmevo.evolution.optimiser import CheckedOptimiser
from swarmevo.evolution.results import Generation, Results
from swarmevo.plugins.team import never
from swarmevo.protocols import FloatArray, IntArray, Objective
from swarmevo.testing import random_genomes

RECENT_GENERATIONS: Final = 20
"""The remaining time is estimated from this many."""


@dataclass(frozen=True)
class Progress:
    """Where a run stands after a generation."""

    trial: int
    """From 0."""
    generation: int
    """From 0; it has just been stored."""
    generations: int
    """In each trial, at most."""
    refining: bool
    """Whether no new individuals are made any more (``evolution.refine``)."""
    trials: int
    episodes: int
    """Stored so far, in all trials."""
    episodes_per_second: float
    """In this generation."""
    best: Mapping[str, float]
    """For each objective the best mean in this generation."""
    front_size: int
    """Points that no other of this generation dominates; equal ones count once."""
    new_genomes: int
    """In this generation, which no generation of its trial had before. 0: the search stands still."""
    eta_seconds: float
    """To the end of the run."""


class Journal(Protocol):
    """What is kept of a run: a run folder, :class:`swarmevo.runs.store.Store`. Trials and generations count from 0."""

    def generations(self, trial: int) -> int:
        """Return how many generations of a trial are kept."""
        ...

    def start(self) -> FloatArray | None:
        """Return the genomes ``(k, size)`` that the optimisers begin from; None: they begin on their own."""
        ...

    def episodes_stored(self, trial: int | None = None) -> int:
        """Return how many episodes are kept, of a trial or of all trials."""
        ...

    def generation(self, trial: int, number: int) -> Generation:
        """Return a kept generation."""
        ...

    def state(self, trial: int) -> Mapping[str, Any] | None:
        """Return the optimiser's state after a trial's last generation; None: it has none."""
        ...

    def genome_ids(self, trial: int, number: int) -> IntArray:
        """Return ``(n,)``: what tells the genomes of a kept generation from all others of the run."""
        ...

    def in_flight(self, trial: int, number: int, genomes: FloatArray) -> Results:
        """Return the episodes that are kept of a generation in work, with genomes ``(n, size)``."""
        ...

    def keep(self, trial: int, number: int, genomes: FloatArray, episodes: Results) -> None:
        """Keep some episodes of the generation in work."""
        ...

    def append(self, trial: int, number: int, generation: Generation, state: str) -> None:
        """Keep a generation and the optimiser's state after it, both or neither."""
        ...


def rehearse(config: Config, stop: Callable[[], bool] = never) -> None:
    """Evaluate an individual once, to find what shows only then: plugins that do not fit together, say.

    It has random weights and every switch on, so that it is as large as any that evolution can come upon. Nothing is
    done where a failed episode is to be recorded, not to end the run (``evolution.on_fault: worst``).

    Raises:
        ConfigError: The evaluation failed.
        EvaluationError, PluginError, SimulatorError: The plugins or the scene cannot be made.
        Interrupted: ``stop`` said so.
    """
    if config.evolution.on_fault == "worst":
        return
    evolution = config.evolution.model_copy(update={"repeats": 1})
    with Evaluator(config.model_copy(update={"evolution": evolution}), workers=1) as evaluator:
        largest = random_genomes(evaluator.space, 1)
        largest[:, evaluator.space.is_switch] = 1.0
        try:
            evaluator.evaluate(largest, trial=0, generation=0, stop=stop)
        except EvaluationError as error:
            raise ConfigError(f"{error} (found in a rehearsal, in an individual with every switch on)") from error


def evolve(
    journal: Journal,
    config: Config,
    evaluator: Evaluator,
    observe: Callable[[Progress], None],
    stop: Callable[[], bool] = never,
) -> None:
    """Run every trial of a run from its last kept generation to the end.

    Args:
        journal: Keeps the run.
        config: Of the run.
        evaluator: Of this configuration.
        observe: Told after each generation.
        stop: Asked between jobs; when true, the jobs in work are dropped; the run can be continued.

    Raises:
        EvaluationError, PluginError, SimulatorError: Something failed; the generations before are kept.
        Interrupted: ``stop`` said so.
    """
    run = _Run(journal, config, evaluator, observe, stop)
    for trial in range(config.evolution.trials):
        run.finish(trial)


class _Run:
    """A run in progress."""

    def __init__(
        self,
        journal: Journal,
        config: Config,
        evaluator: Evaluator,
        observe: Callable[[Progress], None],
        stop: Callable[[], bool],
    ) -> None:
        self._journal = journal
        self._config = config
        self._evaluator = evaluator
        self._observe = observe
        self._stop = stop
        evolution = config.evolution
        self._budget = Budget(evolution)
        self._episodes = {trial: journal.episodes_stored(trial) for trial in range(evolution.trials)}
        self._recent: list[tuple[float, float]] = []  # of the latest generations: seconds, share of the trial
        self._had: set[int] = set()  # genomes of the trial, by their ids
        self._archive: Archive | None = None  # of the trial, where it decides anything

    def finish(self, trial: int) -> None:
        """Run what is missing of a trial."""
        number = self._journal.generations(trial)
        if self._budget.is_spent(number, self._episodes[trial]):
            return
        optimiser = CheckedOptimiser(self._config, self._evaluator, trial)
        if number == 0 and (start := self._journal.start()) is not None:
            optimiser.start_from(start)
        optimiser.restore(self._journal.state(trial), number)
        self._had = set().union(*(self._journal.genome_ids(trial, one).tolist() for one in range(number)))
        self._archive = self._archived(trial, number)
        while not self._budget.is_spent(number, self._episodes[trial]):
            self._step(optimiser, trial, number)
            number += 1

    def _archived(self, trial: int, generations: int) -> Archive | None:
        """Return the archive of a trial's kept generations; None: nothing asks for it."""
        if not self._config.evolution.resample and not self._config.evolution.refine:
            return None
        archive = self._evaluator.archive()
        for number in range(generations):
            archive.add(self._journal.generation(trial, number))
        return archive

    def _step(self, optimiser: CheckedOptimiser, trial: int, generation: int) -> None:
        started = perf_counter()
        before = self._budget.share(generation, self._episodes[trial])
        refining = self._budget.is_for_refining(generation, self._episodes[trial])
        asked = optimiser.answer(generation) if refining else optimiser.ask(generation)
        genomes = np.concatenate([asked, self._again(asked, refining)])
        evaluation = self._evaluate(genomes, trial, generation, racing=0 if refining else len(asked))
        if not refining:
            of_asked = slice(len(asked))
            optimiser.tell(generation, asked, evaluation.costs[of_asked], evaluation.descriptors[of_asked])
        evaluated = Generation(genomes, evaluation.episodes)
        self._journal.append(trial, generation, evaluated, optimiser.state(generation))
        if self._archive is not None:
            self._archive.add(evaluated)
        self._episodes[trial] += len(evaluation.episodes)
        gained = self._budget.share(generation + 1, self._episodes[trial]) - before
        self._recent = [*self._recent, (perf_counter() - started, gained)][-RECENT_GENERATIONS:]
        self._observe(self._progress(trial, generation, refining, evaluation))

    def _again(self, asked: FloatArray, refining: bool) -> FloatArray:
        """Return genomes ``(n, size)`` that are to be evaluated again beside those that the optimiser asked for.

        Not those which it asked for: in one generation they would meet the same noise twice.
        """
        evolution = self._config.evolution
        if self._archive is None or not len(self._archive):
            return asked[:0]
        most = max(1, evolution.population - len(asked)) if refining else evolution.resample
        known = {genome.tobytes() for genome in asked}
        places = self._archive.least_sampled(most + len(asked), evolution.least_episodes).tolist()
        fresh = [place for place in places if self._archive.genomes[place].tobytes() not in known]
        return self._archive.genomes[fresh[:most]]

    def _evaluate(self, genomes: FloatArray, trial: int, generation: int, racing: int) -> Evaluation:
        """Run what is not kept of a generation; return all of it, with the seconds that it took in all sessions."""
        kept = self._journal.in_flight(trial, generation, genomes)

        def keep(episodes: Results, seconds: float) -> None:
            self._journal.keep(trial, generation, genomes, replace(episodes, seconds=kept.seconds + seconds))

        evaluation = self._evaluator.evaluate(genomes, trial, generation, self._stop, kept, keep, racing)
        episodes = replace(evaluation.episodes, seconds=kept.seconds + evaluation.seconds)
        return replace(evaluation, episodes=episodes)

    def _progress(self, trial: int, generation: int, refining: bool, evaluation: Evaluation) -> Progress:
        evolution = self._config.evolution
        seconds, shares = (sum(column) for column in zip(*self._recent, strict=True))
        done = (
            self._budget.share(self._done(t, trial, generation), self._episodes[t]) for t in range(evolution.trials)
        )
        return Progress(
            trial=trial,
            generation=generation,
            generations=evolution.generations,
            refining=refining,
            trials=evolution.trials,
            episodes=sum(self._episodes.values()),
            episodes_per_second=len(evaluation.episodes) / self._recent[-1][0],
            best=_best(self._evaluator.objectives, evaluation.costs),
            front_size=int(np.count_nonzero(moocore.is_nondominated(evaluation.costs))),
            new_genomes=self._count_new(trial, generation),
            eta_seconds=(evolution.trials - sum(done)) * seconds / shares,
        )

    def _done(self, trial: int, current: int, generation: int) -> int:
        """Return how many generations of a trial are kept, while ``generation`` of ``current`` has just been."""
        return generation + 1 if trial == current else self._journal.generations(trial)

    def _count_new(self, trial: int, generation: int) -> int:
        """Return how many genomes of a generation no generation of its trial had before, and remember them."""
        before = len(self._had)
        self._had.update(self._journal.genome_ids(trial, generation).tolist())
        return len(self._had) - before


def _best(objectives: list[Objective], costs: FloatArray) -> dict[str, float]:
    least = to_costs(objectives, costs.min(axis=0))  # a second time: back to the objectives' own directions
    return {objective.name: float(value) for objective, value in zip(objectives, least, strict=True)}

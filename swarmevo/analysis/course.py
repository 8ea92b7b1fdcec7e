# SPDX-License-Identifier: BSD-3-Clause
"""How far a trial had come with each generation, judged by what was known then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple

import numpy as np

from swarmevo.analysis import dominance
from swarmevo.config import Evolution
from swarmevo.evolution.aggregation import OverWorlds
from swarmevo.evolution.budget import Budget
from swarmevo.protocols import FloatArray, IntArray, Objective
from swarmevo.runs.records import Summary
from swarmevo.runs.store import Store


@dataclass(frozen=True)
class Step:
    """How far a trial had come with a generation."""

    generation: int
    episodes: int
    """That the trial has spent, with those of this generation."""
    hypervolume: float
    front_size: int
    new_genomes: int
    """In this generation, which no generation of its trial had before. 0: the search stood still, or it refined."""
    refining: bool
    """Whether the generation was for evaluating again what is there (``evolution.refine``)."""
    best: dict[str, float]
    """The best mean of each objective, on the front."""


class Standing(NamedTuple):
    """An individual of a trial's front, judged by its episodes so far."""

    genome: int
    """Its id in the store."""
    first_generation: int
    last_generation: int
    episodes: int
    values: list[float]
    """Its mean in each objective."""


class Course:
    """The steps of a trial, and its front, of generations that are added as they come.

    The front is that of all individuals so far. An individual's mean may fall when it is evaluated again, and the
    hypervolume with it: what it dominated may be back.

    The time of :meth:`add` is linear in the number of generations added, but for one look at all individuals: the mean
    of a genome that none of these generations evaluates again stays as it is, so that of all such genomes their front
    is enough.

    Args:
        objectives: m.
        over_worlds: Of the run.
        evolution: Of the run.
    """

    def __init__(self, objectives: Sequence[Objective], over_worlds: OverWorlds, evolution: Evolution) -> None:
        self._objectives, self._over_worlds = objectives, over_worlds
        self._least, self._budget, self._spent = evolution.least_episodes, Budget(evolution), 0
        self._row: dict[int, int] = {}  # of each genome in what follows
        worlds = len(over_worlds.worlds)
        self._sums = np.empty((0, worlds, len(objectives)))  # over its episodes in each world
        self._counts = np.empty((0, worlds), dtype=np.int64)
        self._genome, self._first, self._last = (np.empty(0, dtype=np.int64) for _ in range(3))
        self._front = np.empty(0, dtype=np.intp)  # rows

    def add(self, summaries: Sequence[Summary]) -> list[Step]:
        """Take the trial's next generations, and return how far it had come with each."""
        rows = self._rows(summaries)
        last = np.full(len(self._row), -1)  # of these generations; -1: none has it
        for each, summary in zip(rows, summaries, strict=True):
            last[each] = summary.number
        before = self._counts.sum(axis=1)
        settled = self._front_of(np.flatnonzero((last < 0) & (before >= self._least)))
        unsure = np.flatnonzero((last < 0) & (before < self._least))  # needed while all are
        met_again = np.flatnonzero((last >= 0) & (before > 0))
        steps = []
        for each, summary in zip(rows, summaries, strict=True):
            np.add.at(self._sums, each, summary.sums)
            np.add.at(self._counts, each, summary.counts)
            new = np.unique(each[self._first[each] < 0])
            self._first[new] = summary.number
            self._last[each] = summary.number
            met_again = np.union1d(met_again, each)
            is_sure = self._episodes(met_again) >= self._least
            is_over = last[met_again] == summary.number
            self._front = self._front_of(settled, met_again[is_sure])
            if not len(self._front):  # nobody has enough: those with the most
                every = np.concatenate([unsure, met_again])
                episodes = self._episodes(every)
                self._front = self._front_of(every[episodes == episodes.max(initial=0)])
                unsure = np.concatenate([unsure, met_again[is_over]])
            steps.append(self._step(summary, len(new)))
            settled = self._front_of(settled, met_again[is_sure & is_over])
            met_again = met_again[~is_over]
        return steps

    @property
    def front(self) -> list[Standing]:
        """The trial's front after the last generation added, the best first objective first."""
        facts = (self._genome, self._first, self._last)
        columns = [*(fact[self._front].tolist() for fact in facts), self._episodes(self._front).tolist()]
        return [Standing(*row) for row in zip(*columns, self._means(self._front).tolist(), strict=True)]

    def _rows(self, summaries: Sequence[Summary]) -> list[IntArray]:
        """Return the rows of each generation's genomes, made where they are new."""
        rows = [
            np.array(
                [self._row.setdefault(genome, len(self._row)) for genome in summary.genomes.tolist()], dtype=np.intp
            )
            for summary in summaries
        ]
        new = list(islice(self._row, len(self._genome), None))
        nothing = np.full(len(new), -1)
        self._genome = np.append(self._genome, np.array(new, dtype=np.int64))
        self._first, self._last = np.append(self._first, nothing), np.append(self._last, nothing)
        self._sums = np.concatenate([self._sums, np.zeros((len(new), *self._sums.shape[1:]))])
        self._counts = np.concatenate([self._counts, np.zeros((len(new), *self._counts.shape[1:]), dtype=np.int64)])
        return rows

    def _episodes(self, rows: IntArray) -> IntArray:
        episodes: IntArray = self._counts[rows].sum(axis=1)
        return episodes

    def _means(self, rows: IntArray) -> FloatArray:
        return self._over_worlds(self._sums[rows] / self._counts[rows][..., np.newaxis])

    def _front_of(self, *parts: IntArray) -> IntArray:
        """Return the rows that no other of several arrays of rows dominates; of equal ones that of the lowest id."""
        rows = np.concatenate(parts)
        rows = rows[np.argsort(self._genome[rows])]
        return rows[dominance.places(self._objectives, self._means(rows))]

    def _step(self, summary: Summary, new_genomes: int) -> Step:
        refining = self._budget.is_for_refining(summary.number, self._spent)
        self._spent += summary.episodes
        points = self._means(self._front)
        return Step(
            generation=summary.number,
            episodes=self._spent,
            hypervolume=dominance.hypervolume(self._objectives, points),
            front_size=len(points),
            new_genomes=new_genomes,
            refining=refining,
            best={o.name: _best(o, points[:, k]) for k, o in enumerate(self._objectives)},
        )


def history(store: Store, trial: int) -> list[Step]:
    """Return how far a trial had come with each generation."""
    return Course(store.objectives, store.over_worlds, store.config.evolution).add(list(store.summaries(trial)))


def _best(objective: Objective, values: FloatArray) -> float:
    return float(values.max() if objective.is_maximised else values.min())

# SPDX-License-Identifier: BSD-3-Clause
"""What a run found and what it cost: fronts, hypervolume, episodes; and what a run will cost.

An individual is judged by the mean over all its stored episodes of a trial, of all generations and repeats. Of
individuals with the same objectives one represents all. The hypervolume is measured against a fixed reference, the
worse end of each objective's range, in the objectives' own units.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np

from swarmevo import config
from swarmevo.analysis import dominance
from swarmevo.analysis.course import Step as Step
from swarmevo.analysis.course import history as history
from swarmevo.analysis.dominance import hypervolume as hypervolume
from swarmevo.analysis.dominance import non_dominated as non_dominated
from swarmevo.analysis.dominance import volume as volume
from swarmevo.analysis.measures import DELIVERED, HOMING, PUSH, Measures, measures_of
from swarmevo.analysis.statistics import wilson
from swarmevo.evolution.budget import Budget
from swarmevo.protocols import BoolArray, Descriptor, IntArray, Objective
from swarmevo.runs.records import Individuals, Totals
from swarmevo.runs.store import Store
from swarmevo.testing import random_genomes

if TYPE_CHECKING:  # looking at a run needs no simulator
    from swarmevo.evolution.evaluation import Evaluator


@dataclass(frozen=True)
class FrontPoint:
    """An individual of a front or a map; rates and means are over its stored episodes of one trial."""

    genome: int
    """Its id in the store."""
    trial: int
    first_generation: int
    last_generation: int
    episodes: int
    """Behind every mean and rate here."""
    objectives: dict[str, float]
    descriptors: dict[str, float | None]
    """None: every episode failed."""
    homing_rate: float
    """Share of robots that came within the emitter's range."""
    homing_interval: tuple[float, float]
    """Wilson's, of 95 %, with the episodes as independent trials."""
    homing_time: float | None
    """[s]; None: none did."""
    push_rate: float
    """Share of episodes in which the box touched the target wall."""
    push_interval: tuple[float, float]
    """Likewise."""
    push_time: float | None
    """[s]; None: it never did."""
    success_rates: dict[str, float]
    """For each objective that says what a success is, the share of episodes that were one."""
    success_intervals: dict[str, tuple[float, float]]
    """Likewise."""


@dataclass(frozen=True)
class Cost(Totals):
    """What a run has cost so far."""

    simulated_seconds: float


@dataclass(frozen=True)
class Trial:
    """One evolution of a run."""

    trial: int
    front: list[FrontPoint]
    history: list[Step]


@dataclass(frozen=True)
class Summary:
    """A run as ``swarmevo show`` tells it."""

    run: str
    seed: int
    trials_planned: int
    generations_planned: int
    complete: bool
    objectives: list[Objective]
    descriptors: list[Descriptor]
    measures: Measures
    """Which rates say something of the task."""
    trials: list[Trial]
    front: list[FrontPoint]
    """Over all trials."""
    cost: Cost


@dataclass(frozen=True)
class Forecast:
    """What a run will cost, extrapolated from episodes with random genomes.

    Evolved teams that press on the box take longer to simulate than random ones.
    """

    episodes: int
    """At most: an optimiser may ask for fewer."""
    simulated_seconds: float
    wall_seconds: float
    workers: int
    measured_episodes: int
    episodes_per_second: float
    """Measured, on all workers."""


# ---- fronts ----------------------------------------------------------------------------------------------------------


def front(store: Store, trial: int | None = None) -> list[FrontPoint]:
    """Return the non-dominated individuals of a trial, or of all trials, the best first objective first."""
    found = store.individuals(trial)
    known = np.flatnonzero(_are_known(found.episodes, store.config.evolution.least_episodes))
    return points(store, found, known[dominance.places(store.objectives, found.objectives[known])])


def points(store: Store, found: Individuals, rows: IntArray) -> list[FrontPoint]:
    """Return what is known of some individuals, by their rows."""
    names = [objective.name for objective in store.objectives]
    successes = {k: objective.name for k, objective in enumerate(store.objectives) if objective.success is not None}
    return [
        FrontPoint(
            genome=int(found.genome[i]),
            trial=int(found.trial[i]),
            first_generation=int(found.first_generation[i]),
            last_generation=int(found.last_generation[i]),
            episodes=int(found.episodes[i]),
            objectives=dict(zip(names, found.objectives[i].tolist(), strict=True)),
            descriptors={
                one.name: _number(value) for one, value in zip(store.descriptors, found.descriptors[i], strict=True)
            },
            homing_rate=float(found.homing_rate[i]),
            homing_interval=_interval(found.homing_rate[i], found.episodes[i]),
            homing_time=_number(found.homing_time[i]),
            push_rate=float(found.push_rate[i]),
            push_interval=_interval(found.push_rate[i], found.episodes[i]),
            push_time=_number(found.push_time[i]),
            success_rates={name: float(found.success_rates[i, k]) for k, name in successes.items()},
            success_intervals={
                name: _interval(found.success_rates[i, k], found.episodes[i]) for k, name in successes.items()
            },
        )
        for i in rows
    ]


def most_successful(points: Sequence[FrontPoint], measures: Measures) -> FrontPoint:
    """Return who succeeds most often in what matters most: of points with the best first objective first, the first.

    Rates are compared by the lower ends of their intervals: three successes of three tell less than 49 of 50.

    Raises:
        ValueError: There is no point.
    """

    def certain(point: FrontPoint) -> list[float]:
        intervals = {
            **point.success_intervals,
            PUSH: point.push_interval,
            DELIVERED: point.push_interval,
            HOMING: point.homing_interval,
        }
        return [intervals[rate][0] for rate in measures.rates]

    return max(points, key=certain)  # of equals the first


def _are_known(episodes: IntArray, least: int) -> BoolArray:
    """Return ``(n,)``: who has enough episodes to be judged; if nobody has, who has the most."""
    known: BoolArray = episodes >= min(least, int(episodes.max(initial=0)))
    return known


def _interval(rate: float, episodes: int) -> tuple[float, float]:
    return wilson(float(rate) * int(episodes), int(episodes))


def _number(value: float) -> float | None:
    return None if np.isnan(value) else float(value)


# ---- the run as a whole ----------------------------------------------------------------------------------------------


def summarise(store: Store) -> Summary:
    """Return a run's fronts, its hypervolume and its cost.

    Raises:
        ConfigError: The run's configuration is damaged.
        StoreError: The run cannot be read.
    """
    settings = store.config
    evolution, totals = settings.evolution, store.totals()
    return Summary(
        run=str(store.folder),
        seed=store.seed,
        trials_planned=evolution.trials,
        generations_planned=evolution.generations,
        complete=is_complete(store),
        objectives=list(store.objectives),
        descriptors=list(store.descriptors),
        measures=measures_of(settings, store.objectives),
        trials=[Trial(trial, front(store, trial), history(store, trial)) for trial in store.trials()],
        front=front(store),
        cost=Cost(**asdict(totals), simulated_seconds=totals.steps * settings.episode.control_period),
    )


def is_complete(store: Store) -> bool:
    """Return whether every trial has spent its budget."""
    evolution, budget = store.config.evolution, Budget(store.config.evolution)
    return all(budget.is_spent(store.generations(t), store.episodes_stored(t)) for t in range(evolution.trials))


def generations(store: Store) -> tuple[int, int]:
    """Return how many generations are stored, and how many the whole run has, over all trials."""
    evolution = store.config.evolution
    return store.totals().generations, evolution.trials * evolution.generations


# ---- before a run ----------------------------------------------------------------------------------------------------


_EPISODES_PER_WORKER = 4
"""Of a forecast: enough to keep all workers busy for most of the time, as in a run."""


def forecast(settings: config.Config, evaluator: Evaluator, workers: int) -> Forecast:
    """Measure some episodes with random genomes and return what the whole run will cost.

    Args:
        settings: Of the run.
        evaluator: Of the same configuration and number of workers.
        workers: At least 1.

    Raises:
        EvaluationError: A plugin or an episode failed.
    """
    evolution = settings.evolution
    each = evolution.repeats * len(config.Worlds(settings))
    wanted = math.ceil(_EPISODES_PER_WORKER * workers / each)
    genomes = random_genomes(evaluator.space, min(wanted, evolution.population))
    evaluator.evaluate(genomes[:1], trial=0, generation=0)  # caches warm up
    seconds = evaluator.evaluate(genomes, trial=0, generation=0).seconds
    rate = len(genomes) * each / seconds
    whole = evolution.generations * (evolution.population + evolution.resample) * each
    episodes = evolution.trials * min(whole, evolution.episodes or whole)
    return Forecast(
        episodes=episodes,
        simulated_seconds=episodes * settings.episode.horizon,
        wall_seconds=episodes / rate,
        workers=workers,
        measured_episodes=len(genomes) * each,
        episodes_per_second=rate,
    )

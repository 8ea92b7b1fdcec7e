# SPDX-License-Identifier: BSD-3-Clause
"""Runs held against each other: several groups of trials in the same world, judged on fresh seeds.

The front that a run has stored is too good: who stands on it was selected for good luck as well. Hence every controller
of every trial's front is tested again, in episodes that evolution never saw, and a trial counts with what these leave.
The trial is the unit of all statistics.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pydantic

from swarmevo.analysis import assessment, cross_fitting, fronts
from swarmevo.analysis.measures import measures_of
from swarmevo.analysis.significance import (
    holm,
    kruskal_wallis,
    mann_whitney,
    vargha_delaney,
    vargha_delaney_interval,
)
from swarmevo.config import WORLD
from swarmevo.errors import ConfigError, StoreError
from swarmevo.plugins.team import never
from swarmevo.protocols import FloatArray, Objective
from swarmevo.runs.store import Store

FORMAT: Final = 2
"""Of the JSON."""
REPEATS: Final = 10
"""Tests of each controller, if nobody says otherwise."""
LEAST_TRIALS: Final = 5
"""Of a group: with fewer, hardly any difference is significant."""
_MOST_SHOWN: Final = 3  # differences between two worlds
_ALIKE: Final = 1.05  # budgets of two groups, the larger over the smaller


@dataclass(frozen=True)
class Trial:
    """A trial of a group."""

    run: str
    trial: int
    """From 0."""
    episodes: int
    """That it has spent."""
    stored: float
    """Hypervolume of its front by the episodes of evolution, as a share of the product of the objectives' ranges."""
    tested: float
    """The same of the same controllers, on fresh seeds (:mod:`swarmevo.analysis.cross_fitting`)."""
    first: float
    """Mean of the first objective of the best among them, likewise."""
    success: float | None
    """Rate of success of who succeeds most often, likewise; None: the task has none."""
    course: list[tuple[int, float]]
    """Episodes spent after each generation, and the stored hypervolume then, likewise a share."""
    points: list[list[float]]
    """Objectives of those of its front that are not dominated on fresh seeds."""


@dataclass(frozen=True)
class Group:
    """Trials that are compared as one."""

    name: str
    runs: list[str]
    optimisers: list[str]
    trials: list[Trial]


@dataclass(frozen=True)
class Pair:
    """Two groups in one measure."""

    a: str
    b: str
    p: float
    """Of the Mann-Whitney test, two-sided; of several pairs in a measure adjusted by Holm."""
    a12: float
    """How often a trial of a is above one of b: 0.5, there is no difference."""
    low: float
    """Of the bootstrap's 95 % interval of that."""
    high: float


@dataclass(frozen=True)
class Measure:
    """A number of each trial, and what the groups' differ by."""

    name: str
    more_is_better: bool
    values: dict[str, list[float]]
    """Of each group's trials."""
    p: float | None
    """Of the Kruskal-Wallis test, that any group differs; None: there are two."""
    pairs: list[Pair]


@dataclass(frozen=True)
class Comparison:
    """Groups of trials and what was found of them."""

    format: int
    repeats: int
    """Tests of each controller."""
    objectives: list[Objective]
    groups: list[Group]
    measures: list[Measure]
    notes: list[str]
    """What to bear in mind, one sentence each."""


def as_json(found: Comparison) -> str:
    """Return a comparison as JSON."""
    return pydantic.TypeAdapter(Comparison).dump_json(found, indent=2).decode()


# ---- the whole -------------------------------------------------------------------------------------------------------


def compare(
    groups: Mapping[str, Sequence[Store]],
    repeats: int = REPEATS,
    workers: int = 0,
    observe: Callable[[str], None] = lambda what: None,
    stop: Callable[[], bool] = never,
) -> Comparison:
    """Test the fronts of all runs again, and compare the groups; tests add up in the runs' folders.

    Args:
        groups: At least two, by name: the runs of each.
        repeats: Tests of each controller.
        workers: Episodes at once; 0: one for each processor.
        observe: Told what is being done, one line each.
        stop: Asked now and then; when true, the tests end; what was tested is stored.

    Raises:
        ConfigError: Their worlds or what they are judged by differ, or there are fewer than two groups.
        EvaluationError, Interrupted, SimulatorError, StoreError: As :func:`swarmevo.analysis.assessment.assess`.
        SwarmevoError: scipy is not installed.
    """
    if len(groups) < 2:
        raise ConfigError(f"compare: expected at least two groups of runs, got {len(groups)}")
    stores = [store for members in groups.values() for store in members]
    for other in stores[1:]:
        _require_alike(stores[0], other)
    objectives = list(stores[0].objectives)
    mann_whitney([0.0], [0.0])  # scipy is missed before an hour of tests
    found = [
        Group(
            name=name,
            runs=[str(store.folder) for store in members],
            optimisers=list(dict.fromkeys(next(iter(store.config.optimiser)) for store in members)),
            trials=[one for store in members for one in _trials(store, repeats, workers, observe, stop)],
        )
        for name, members in groups.items()
    ]
    return Comparison(
        format=FORMAT,
        repeats=repeats,
        objectives=objectives,
        groups=found,
        measures=list(_measures(found, objectives)),
        notes=list(_notes(stores, found, repeats)),
    )


def differences(one: Store, other: Store) -> list[str]:
    """Return where the worlds of two runs differ, or what their episodes are judged by, one line each."""
    here, there = (store.config.model_dump(mode="json") for store in (one, other))
    pairs = [
        (f"{section}.{key}", value, there[section].get(key))
        for section in (*WORLD, "fitness")
        for key, value in {**dict.fromkeys(there[section]), **here[section]}.items()
    ]
    pairs += [(key, here[key], there[key]) for key in ("worlds", "vary")]
    return [f"{key}: {_short(a)} and {_short(b)}" for key, a, b in pairs if a != b]


def _require_alike(one: Store, other: Store) -> None:
    found = differences(one, other)
    if not found and list(one.objectives) != list(other.objectives):
        found = ["the objectives: their plugins are of other versions"]
    if found:
        more = f" and {len(found) - _MOST_SHOWN} more" if len(found) > _MOST_SHOWN else ""
        raise ConfigError(
            f"{other.folder}: expected the world and the fitness of {one.folder}, but they differ in "
            f"{'; '.join(found[:_MOST_SHOWN])}{more}; compare runs of the same task"
        )


def _short(value: object) -> str:
    shown = str(value)
    return shown if len(shown) <= 40 else f"{shown[:37]}..."


# ---- trials ----------------------------------------------------------------------------------------------------------


def _trials(
    store: Store, repeats: int, workers: int, observe: Callable[[str], None], stop: Callable[[], bool]
) -> Iterator[Trial]:
    if not store.trials():
        raise StoreError(f"{store.folder}: expected at least one generation to compare, but none is stored yet")
    observe(f"{store.folder}: testing the fronts of {len(store.trials())} trials")
    objectives = store.objectives
    rates = measures_of(store.config, objectives).rates
    tested = assessment.retest(store, repeats, workers, stop=stop, rate=rates[0] if rates else None)
    for trial in store.trials():
        members = [one for one in tested if one.trial == trial]
        tests = np.array([one.tested for one in members])
        values = tests.mean(axis=1)
        stored = np.array([[one.evolved[objective.name] for objective in objectives] for one in members])
        history = fronts.history(store, trial)
        sign = 1 if objectives[0].is_maximised else -1
        first, success = cross_fitting.of_the_best(
            sign * stored[:, 0], sign * tests[:, :, 0], np.array([one.success for one in members])
        )
        yield Trial(
            run=str(store.folder),
            trial=trial,
            episodes=history[-1].episodes,
            stored=_share(objectives, stored),
            tested=cross_fitting.hypervolume(objectives, stored, tests),
            first=sign * first,
            success=success if rates else None,
            course=[(step.episodes, step.hypervolume / fronts.volume(objectives)) for step in history],
            points=fronts.non_dominated(objectives, values).tolist(),
        )


def _share(objectives: Sequence[Objective], points: FloatArray) -> float:
    return fronts.hypervolume(objectives, points) / fronts.volume(objectives)


def hypervolume_at(trials: Sequence[Trial], episodes: FloatArray) -> FloatArray:
    """Return ``(trials, len(episodes))``: the stored hypervolume that each trial had after so many episodes.

    NaN: it had not spent so many, or had not finished a generation yet.
    """
    rows = np.full((len(trials), len(episodes)), np.nan)
    for row, trial in zip(rows, trials, strict=True):
        spent, reached = np.array(trial.course).T
        place = np.searchsorted(spent, episodes, side="right") - 1
        known = (place >= 0) & (episodes <= spent[-1])
        row[known] = reached[place[known]]
    return rows


# ---- statistics ------------------------------------------------------------------------------------------------------


def _measures(groups: Sequence[Group], objectives: Sequence[Objective]) -> Iterator[Measure]:
    yield measure("hypervolume", True, {group.name: [one.tested for one in group.trials] for group in groups})
    first = objectives[0]
    if len(objectives) > 1:
        values = {group.name: [one.first for one in group.trials] for group in groups}
        yield measure(first.name, first.is_maximised, values)
    rates = {group.name: [one.success for one in group.trials if one.success is not None] for group in groups}
    if all(rates.values()):
        yield measure("success", True, rates)


def measure(name: str, more_is_better: bool, values: dict[str, list[float]], against: str | None = None) -> Measure:
    """Return what a number of each trial says of how groups differ.

    Args:
        name: Of the number.
        more_is_better: Whether a larger one is.
        values: By group, at least two: those of its trials.
        against: The group that each other one makes a pair with, as its second; None: all pairs.

    Raises:
        SwarmevoError: scipy is not installed.
    """
    if against is None:
        pairs = list(itertools.combinations(values, 2))
    else:
        pairs = [(against, other) for other in values if other != against]
    adjusted = holm([mann_whitney(values[a], values[b]) for a, b in pairs])
    return Measure(
        name=name,
        more_is_better=more_is_better,
        values=values,
        p=kruskal_wallis(list(values.values())) if len(values) > 2 else None,
        pairs=[
            Pair(a, b, p, vargha_delaney(values[a], values[b]), *vargha_delaney_interval(values[a], values[b]))
            for (a, b), p in zip(pairs, adjusted, strict=True)
        ],
    )


def _notes(stores: Sequence[Store], groups: Sequence[Group], repeats: int) -> Iterator[str]:
    if repeats == 1:
        yield (
            "One test of each controller: evolution says who is the best of a front. With more tests each is left out "
            "in turn: the others say who it is, and the one left out how good."
        )
    if few := [f"{group.name} {len(group.trials)}" for group in groups if len(group.trials) < LEAST_TRIALS]:
        yield f"Few trials ({', '.join(few)}): hardly any difference can be significant; evolve at least ten."
    budgets = {group.name: max(one.episodes for one in group.trials) for group in groups}
    if max(budgets.values()) > _ALIKE * min(budgets.values()):
        said = ", ".join(f"{name} {episodes}" for name, episodes in budgets.items())
        yield f"Budgets differ, in episodes of a trial ({said}): compare at equal ones, see evolution.episodes."
    if unfinished := [str(store.folder) for store in stores if not fronts.is_complete(store)]:
        yield f"Not finished: {', '.join(unfinished)}."
    if any(store.config.worlds or store.config.vary for store in stores):
        yield (
            "Evolution had several worlds or some that vary; the tests are in the one of the configuration's sections, "
            "so that stored and tested values differ for that reason too."
        )

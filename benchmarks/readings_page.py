# SPDX-License-Identifier: BSD-3-Clause
"""How near a table is to the paper's Table II, and the page about the readings.

A table is ten rates: homing with one to five robots, then pushing. Its distance to the paper's is the root mean square
of their differences. The unit of chance is the trial: intervals are a bootstrap over trials.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from benchmarks.pages import table
from swarmevo.analysis import fronts
from swarmevo.analysis.table_ii import PAPER, Assessment, Tested
from swarmevo.evolution.budget import Budget
from swarmevo.protocols import FloatArray
from swarmevo.runs.store import Store

PAPER_RATES: Final = np.array([row.homing_rate for row in PAPER] + [row.push_rate for row in PAPER])
"""``(10,)``"""
SIZES: Final = len(PAPER)
"""Of teams."""
RESAMPLES: Final = 10_000


@dataclass(frozen=True)
class Found:
    """What a reading's tests gave."""

    name: str
    trials: tuple[FloatArray, ...]
    """Of each trial ``(controllers, 10)``: rates of all controllers of its front, the best first."""
    tests: int
    """Of each controller with each team."""
    budget: str
    """In words."""

    @property
    def best(self) -> tuple[FloatArray, ...]:
        """The best of each trial alone, ``(1, 10)``."""
        return tuple(rates[:1] for rates in self.trials)


def found_in(name: str, store: Store, tests: Assessment) -> Found | None:
    """Return the rates that tests gave, of the trials that are complete and tested; None: there are less than two."""
    of = {(one.trial, one.genome): _rates(one) for one in tests.controllers if len(one.outcomes) == SIZES}
    trials = []
    for trial in complete_trials(store):
        members = [of.get((trial, point.genome)) for point in fronts.front(store, trial)]
        if all(rates is not None for rates in members):
            trials.append(np.array(members))
    evolution = store.config.evolution
    budget = f"seed {evolution.seed}, {evolution.episodes} episodes of {store.config.episode.horizon:g} s in each trial"
    return Found(name, tuple(trials), tests.repeats, budget) if len(trials) > 1 else None


def complete_trials(store: Store) -> list[int]:
    """Return the trials that have spent their budget."""
    budget = Budget(store.config.evolution)
    return [
        trial for trial in store.trials() if budget.is_spent(store.generations(trial), store.episodes_stored(trial))
    ]


def _rates(one: Tested) -> FloatArray:
    outcomes = sorted(one.outcomes, key=lambda of: of.robots)
    return np.array([of.homing_rate for of in outcomes] + [of.push_rate for of in outcomes])


# ---- distance and chance ---------------------------------------------------------------------------------------------


def distance(rates: FloatArray) -> FloatArray:
    """Return how far tables ``(..., 10)`` are from the paper's: root mean square, in per cent."""
    return np.asarray(100 * np.sqrt(np.mean((rates - PAPER_RATES) ** 2, axis=-1)))


def fall(rates: FloatArray) -> FloatArray:
    """Return by how much tables' ``(..., 10)`` rate of pushing changes from three to five robots, in per cent."""
    return np.asarray(100 * (rates[..., SIZES + 4] - rates[..., SIZES + 2]))


def mean(trials: Sequence[FloatArray]) -> FloatArray:
    """Return the table ``(10,)`` over all controllers, each of which counts the same."""
    return np.asarray(np.concatenate(trials).mean(axis=0))


def resampled(trials: Sequence[FloatArray], seed: int = 0) -> FloatArray:
    """Return tables ``(RESAMPLES, 10)`` of as many trials, drawn with replacement: the same ones of each reading."""
    drawn = np.random.default_rng(seed).integers(len(trials), size=(RESAMPLES, len(trials)))
    sums, counts = np.array([rates.sum(axis=0) for rates in trials]), np.array([len(rates) for rates in trials])
    return np.asarray(sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1)[:, np.newaxis])


def interval(values: FloatArray) -> tuple[float, float]:
    """Return between which ends 95 % of the values lie."""
    low, high = np.quantile(values, [0.025, 0.975])
    return float(low), float(high)


# ---- the page --------------------------------------------------------------------------------------------------------


def page(readings: Sequence[Found], meanings: Mapping[str, tuple[str, Sequence[str]]]) -> str:
    """Return the page about readings, of which the first is held against the others.

    Args:
        readings: Those that are finished, at least one.
        meanings: Of all that were planned: in words, and what they override.
    """
    return "\n".join(_parts(readings, meanings))


def _parts(readings: Sequence[Found], meanings: Mapping[str, tuple[str, Sequence[str]]]) -> Iterator[str]:
    first = readings[0]
    nobody, everybody = distance(np.zeros(2 * SIZES)), distance(np.array([1.0] * SIZES + [0, 0, 1, 1, 1]))
    yield "# Which reading of the paper reproduces it?\n"
    yield (
        f"Each reading is `configs/paper.yaml` but for the keys named, evolved with F1 and PDE as the paper has them: "
        f"{first.budget}. What comes out is tested in the reading's own world on fresh seeds, each controller "
        f"{first.tests} times with each team. {len(readings)} of {len(meanings)} readings are finished; which, with "
        "how many trials, is in the last table. They are screened, no more: a whole run has 9,000 episodes a trial.\n"
    )
    yield (
        "Distance is the root mean square of the differences to the paper's ten rates, in per cent. In brackets: 95 % "
        "intervals by a bootstrap over trials, for controllers of one trial are not independent of each other. "
        f"Robots that never come home and never push are at {nobody:.1f}; those that always come home, and always push "
        f"where they are three or more, at {everybody:.1f}, since the paper's one and two robots seldom come home.\n"
    )
    yield "## All controllers of the fronts\n"
    yield _table(readings, [one.trials for one in readings])
    yield _verdict(readings, [one.trials for one in readings])
    yield "## The best of each trial\n"
    yield (
        "The first of its front, chosen by evolution. The paper's rates of pushing, 96, 56 and 30 %, are whole numbers "
        "of 50 tests, as five of one controller from each of ten trials would be; its text says that all were tested.\n"
    )
    yield _table(readings, [one.best for one in readings])
    yield _verdict(readings, [one.best for one in readings])
    yield "## What they are\n"
    done = {one.name: len(one.trials) for one in readings}
    rows = [
        [name, meaning, ", ".join(f"`{override}`" for override in overrides), str(done.get(name, "not finished"))]
        for name, (meaning, overrides) in meanings.items()
    ]
    yield table(["reading", "meaning", "overrides", "trials"], rows)
    yield (
        "Not tried: F1 as a sum over robots, which only scales it, so that the same are retained; ties as they are, "
        "with which duplicates fill the population and no child is made any more ([paper map](../paper-map.md)).\n"
    )


def _table(readings: Sequence[Found], tables: Sequence[Sequence[FloatArray]]) -> str:
    """Return the readings' tables, the nearest to the paper first."""
    base, bases = distance(mean(tables[0])), distance(resampled(tables[0]))
    rows = {}
    for one, trials in zip(readings, tables, strict=True):
        rates, drawn = mean(trials), resampled(trials)
        further = _with_interval(distance(rates) - base, distance(drawn) - bases, "+")
        rows[float(distance(rates)), one.name] = [
            one.name,
            str(len(trials)),
            str(sum(map(len, trials))),
            _with_interval(distance(rates), distance(drawn)),
            "" if one is readings[0] else further,
            *_cells(rates),
            _with_interval(fall(rates), fall(drawn), "+"),
        ]
    paper = ["*the paper*", "10", "", "0", "", *_cells(PAPER_RATES), f"{fall(PAPER_RATES):+.0f}"]
    than = f"than {readings[0].name}"
    head = ["reading", "trials", "controllers", "distance", than, "homing, 1 to 5", "pushing, 1 to 5", "from 3 to 5"]
    return table(head, [paper, *(rows[key] for key in sorted(rows))])


def _cells(rates: FloatArray) -> list[str]:
    return [", ".join(f"{100 * rate:.0f}" for rate in part) for part in (rates[:SIZES], rates[SIZES:])]


def _with_interval(value: FloatArray, drawn: FloatArray, sign: str = "") -> str:
    low, high = interval(drawn)
    return f"{float(value):{sign}.1f} ({low:{sign}.1f} to {high:{sign}.1f})"


def _verdict(readings: Sequence[Found], tables: Sequence[Sequence[FloatArray]]) -> str:
    """Say which reading is nearest, whether that is sure, and which have the paper's falling rate."""
    distances = {one.name: float(distance(mean(trials))) for one, trials in zip(readings, tables, strict=True)}
    drawn = {one.name: distance(resampled(trials)) for one, trials in zip(readings, tables, strict=True)}
    nearest, *others = sorted(distances, key=distances.__getitem__)
    rivals = [name for name in others if interval(drawn[name] - drawn[nearest])[0] <= 0]
    falling = [
        f"{one.name} ({fall(mean(trials)):+.0f})"
        for one, trials in zip(readings, tables, strict=True)
        if interval(fall(resampled(trials)))[1] < 0
    ]
    surely = f"not surely nearer than {_listed(rivals)}" if rivals else "surely nearer than any other"
    shape = f"It falls surely with {_listed(falling)}." if falling else "With none it surely falls."
    return (
        f"Nearest is {nearest}, at {distances[nearest]:.1f}: {surely}. The paper's rate of pushing falls by "
        f"{-fall(PAPER_RATES):.0f} from three robots to five. {shape}\n"
    )


def _listed(names: Sequence[str]) -> str:
    *some, last = names
    return f"{', '.join(some)} and {last}" if some else last

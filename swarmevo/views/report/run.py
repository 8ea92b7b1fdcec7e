# SPDX-License-Identifier: BSD-3-Clause
"""What a report knows of a run: its fronts, its tests and the episodes of its controllers, and the same as JSON."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from swarmevo.analysis import assessment, fronts
from swarmevo.analysis.fronts import FrontPoint, Summary
from swarmevo.analysis.table_ii import Assessment, Tested
from swarmevo.config import Surroundings, surroundings
from swarmevo.errors import EvaluationError, StoreError
from swarmevo.plugins.team import Team
from swarmevo.runs.store import Store
from swarmevo.simulation import layout
from swarmevo.views import text
from swarmevo.views.replay import data as replay_data
from swarmevo.views.replay import episode as replay_episode

MOST_REPLAYS: Final = 24
"""Episodes in a page, of each run: about 0.2 MB each. The front over all trials comes first."""
REPLAY_BYTES: Final = 1_000_000
"""Most that the control steps of one of them take: 14 minutes of the paper's team; a longer one is thinned."""
_RARE: Final = 0.05
"""A behaviour that fewer robots show is not told of a controller."""


@dataclass(frozen=True)
class Run:
    """A run, its points and their episodes."""

    number: int
    """In the page."""
    name: str
    summary: Summary
    tests: Assessment | None
    points: list[FrontPoint]
    """Of the fronts of all trials."""
    best: set[tuple[int, int]]
    """(trial, genome) of those on the front over all trials."""
    opened: FrontPoint
    """The most successful, whom the page opens on."""
    episodes: dict[tuple[int, int], dict[str, Any]]
    """(trial, genome): an episode for the player."""
    faults: dict[tuple[int, int], str]
    """(trial, genome): why there is none, for it failed."""
    scene: Surroundings
    """Of its configuration: what its robots home in on, and what they bring where."""

    @classmethod
    def of(cls, store: Store, number: int, name: str, observe: Callable[[str], None]) -> Run:
        """Read a run and simulate its controllers' episodes once more.

        Raises:
            EvaluationError: The controller takes genomes of another size.
            StoreError: It has no generation yet.
        """
        summary = fronts.summarise(store)
        if not summary.front:
            raise StoreError(f"{store.folder}: expected at least one generation to report, but none is stored yet")
        best = {(point.trial, point.genome) for point in summary.front}
        tests = assessment.stored(store)
        opened = assessment.most_successful(store, tests)
        points = [point for trial in summary.trials for point in trial.front]
        team = Team(store.config)
        for point in points:  # what another version of a plugin evolved is no single episode's fault
            team.check(store.genome(point.genome)[np.newaxis])
        opens = opened.trial, opened.genome
        replayed = sorted(
            points, key=lambda one: ((one.trial, one.genome) != opens, (one.trial, one.genome) not in best)
        )
        replayed = replayed[:MOST_REPLAYS]
        episodes, faults = {}, {}
        for i, point in enumerate(replayed, 1):
            observe(f"{name}: replay {i} of {len(replayed)}")
            chosen = replay_episode.chosen_of(store, point.genome, point.trial)
            try:
                episodes[point.trial, point.genome] = _episode(store, chosen)
            except EvaluationError as error:
                faults[point.trial, point.genome] = chosen.fault or str(error)
        scene = surroundings(store.config)
        return cls(number, name, summary, tests, points, best, opened, episodes, faults, scene)

    @property
    def homing(self) -> str:
        """Which robots have homed in on something; empty: there is nothing to home in on."""
        return text.homing(layout.homing_emitters(self.scene))

    def rates(self, point: FrontPoint) -> list[tuple[str, float]]:
        """Return names and rates of a point's success, in the order of ``measures.rates``: the first matters most."""
        measures = self.summary.measures
        return [
            *([(text.delivery(self.scene), point.push_rate)] if measures.push else []),
            *((text.success(one), point.success_rates[one.name]) for one in measures.successes),
            *([(self.homing, point.homing_rate)] if measures.homing else []),
        ]

    @property
    def first_shown(self) -> str:
        """Why the page opens on whom it does; empty: nothing in the task is a success."""
        rates = [max(self.rates(point)[k][1] for point in self.points) for k, _ in enumerate(self.rates(self.opened))]
        if not rates:
            return ""
        names = self.summary.measures.rates
        tests = [one for tested in (self.tests.controllers if self.tests else []) for one in tested.outcomes]
        if rates[0] > 0 or any(one.rate(names[0]) > 0 for one in tests):
            return "the one shown first succeeds most often"
        reached = [name for (name, _), rate in zip(self.rates(self.opened), rates, strict=True) if rate > 0]
        best = [*reached, text.words(self.summary.objectives[0].name)][0]
        return f"nobody succeeds, and the one shown first is best in: {best}"

    def tested(self, point: FrontPoint) -> Tested | None:
        """Return what the tests say of a point, if it was tested."""
        controllers = self.tests.controllers if self.tests else []
        return next((one for one in controllers if (one.trial, one.genome) == (point.trial, point.genome)), None)


def _episode(store: Store, chosen: replay_episode.Chosen) -> dict[str, Any]:
    """Return a stored episode, simulated once more; where the bits differ it says so itself."""
    recording, warning = replay_episode.replay(store, chosen, force=True)
    where = f"trial {chosen.key.trial}, generation {chosen.key.generation}, repeat {chosen.key.repeat}"
    return replay_data.data(recording, f"Individual {chosen.genome}", where, warning, REPLAY_BYTES)


# ---- for the page's script -------------------------------------------------------------------------------------------


def data(store: Store, run: Run) -> dict[str, Any]:
    """Return what ``report.js`` needs of a run. A scene that several episodes share is said once."""
    episodes = list(run.episodes.values())
    shared = episodes[0]["scene"] if episodes else []
    keys = [(point.trial, point.genome) for point in run.points]
    return {
        "objectives": [
            {"name": text.words(o.name), "label": text.label(o), "maximise": o.is_maximised} for o in store.objectives
        ],
        "beyond": text.not_drawn(store.objectives),
        "points": [_point(store, run, point) for point in run.points],
        "opened": keys.index((run.opened.trial, run.opened.genome)),
        "scene": shared,
        "episodes": [
            {key: value for key, value in episode.items() if key != "scene" or value != shared} for episode in episodes
        ],
    }


def _point(store: Store, run: Run, point: FrontPoint) -> dict[str, Any]:
    key = point.trial, point.genome
    return {
        "trial": point.trial,
        "genome": point.genome,
        "values": list(point.objectives.values()),
        "front": key in run.best,
        "episode": list(run.episodes).index(key) if key in run.episodes else None,
        "facts": [*_facts(store, run, point), *_no_replay(run.faults.get(key))],
        "command": f"swarmevo replay {shlex.quote(f'{store.folder}:{point.genome}')}",
    }


def _no_replay(fault: str | None) -> list[tuple[str, str]]:
    return [] if fault is None else [("no replay, the episode failed", fault)]


def _facts(store: Store, run: Run, point: FrontPoint) -> list[tuple[str, str]]:
    """Return what is said of a point beside the chart: names and values."""
    facts = [(text.words(name), text.number(value)) for name, value in point.objectives.items()]
    if run.homing:
        facts.append((run.homing, text.rate(point.homing_rate, point.homing_time)))
    if delivered := text.delivery(run.scene):
        facts.append((delivered, text.rate(point.push_rate, point.push_time)))
    facts += [
        (text.success(one), text.percent(point.success_rates[one.name])) for one in run.summary.measures.successes
    ]
    facts += [
        ("judged by", text.count(point.episodes, "episode")),
        ("lived in", f"trial {point.trial}, {text.generations(point.first_generation, point.last_generation)}"),
    ]
    tested = run.tested(point)
    if tested is not None:
        first = store.objectives[0].name
        if tested.tested:
            facts.append((f"{text.words(first)} in fresh tests", text.number(tested.tested[first])))
        shown = [f"{label} {text.percent(share)}" for label, share in tested.behaviours.items() if share >= _RARE]
        if tested.behaviours:
            rare = f"none in {text.percent(_RARE)} of the robots or more"
            facts.append(("other behaviours in fresh tests", ", ".join(shown) or rare))
    return facts

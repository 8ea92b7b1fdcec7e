# SPDX-License-Identifier: BSD-3-Clause
"""What trackers are told of a run: the numbers of each stored generation, once, whenever a session ends.

They are made from what is stored, not from what has just been computed: those of a generation that a killed process
stored but did not log are made up for, and a run that was not tracked from its beginning is logged from there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from swarmevo.analysis import fronts
from swarmevo.analysis.course import Course, Step
from swarmevo.errors import PluginError
from swarmevo.evolution.loop import Progress
from swarmevo.plugins import trackers
from swarmevo.plugins.trackers import CheckedTracker
from swarmevo.protocols import TrackedRun
from swarmevo.runs.store import Store

Observe = Callable[[Progress], None]


@contextmanager
def tracked(store: Store, names: Sequence[str], observe: Observe, say: Callable[[str], None]) -> Iterator[Observe]:
    """Give an observer of a run that tells trackers too, those of earlier generations first.

    Args:
        store: Of the run.
        names: Of the trackers.
        observe: To be told as well.
        say: Told what a tracker did wrong; the run goes on without it.

    Raises:
        ConfigError, PluginError: A tracker cannot be used.
    """
    trackers.check(names)
    evolution = store.config.evolution
    run = TrackedRun(store.folder.resolve().name, str(store.folder), store.seed, store.config.model_dump(mode="json"))
    followers = [_Follower(store, CheckedTracker(name, run), say) for name in names]
    try:
        for follower in followers:
            for trial in range(evolution.trials):
                follower.catch_up(trial)

        def tell(now: Progress) -> None:
            observe(now)
            for follower in followers:
                follower.catch_up(now.trial)

        yield tell
    finally:
        for follower in followers:
            follower.close()


class _Follower:
    """Keeps a tracker up with a run."""

    def __init__(self, store: Store, tracker: CheckedTracker, say: Callable[[str], None]) -> None:
        self._store, self._tracker, self._say = store, tracker, say
        self._courses: dict[int, Course] = {}
        self._done: dict[int, int] = {}  # generations of each trial that its course has
        self._logged: dict[int, int] = {}
        self._failed = False

    def catch_up(self, trial: int) -> None:
        """Log the stored generations of a trial that are not logged yet."""
        if self._failed:
            return
        if trial not in self._courses:
            store = self._store
            self._courses[trial] = Course(store.objectives, store.over_worlds, store.config.evolution)
        try:
            if trial not in self._logged:
                self._logged[trial] = self._tracker.logged(trial)
            summaries = list(self._store.summaries(trial, self._done.get(trial, 0)))
            steps = self._courses[trial].add(summaries)
            self._done[trial] = self._done.get(trial, 0) + len(steps)
            for step, summary in zip(steps, summaries, strict=True):
                if step.generation >= self._logged[trial]:
                    self._tracker.log(trial, step.generation, self._scalars(step, summary.episodes, summary.seconds))
                    self._logged[trial] = step.generation + 1
        except PluginError as error:
            self._give_up(error)

    def _scalars(self, step: Step, episodes: int, seconds: float) -> dict[str, float]:
        scalars = {
            "hypervolume": step.hypervolume / fronts.volume(self._store.objectives),
            **{f"best/{name}": value for name, value in step.best.items()},
            "front_size": step.front_size,
            "new_genomes": step.new_genomes,
            "episodes": step.episodes,
            "episodes_per_second": episodes / seconds if seconds else math.nan,
        }
        return {name: float(value) for name, value in scalars.items() if math.isfinite(value)}

    def _give_up(self, error: PluginError) -> None:
        self._failed = True
        self._say(f"warning: {error}; the run goes on, this session logs no more there")

    def close(self) -> None:
        """Close the tracker."""
        try:
            self._tracker.close()
        except PluginError as error:
            if not self._failed:
                self._give_up(error)

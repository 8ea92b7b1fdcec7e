# SPDX-License-Identifier: BSD-3-Clause
"""A run followed while it evolves: how far it is, in which state, and its fronts and hypervolume so far.

Each look reads only what is new since the last one. What the folder does not hold (who ends a process at once says
nothing) is told by the writer's lock.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Final, Literal

import numpy as np

from swarmevo.analysis import dominance
from swarmevo.analysis.course import Course, Standing, Step
from swarmevo.config import Config
from swarmevo.errors import SwarmevoError
from swarmevo.evolution.budget import Budget
from swarmevo.evolution.loop import RECENT_GENERATIONS
from swarmevo.protocols import Objective
from swarmevo.runs.database import DATABASE_FILE
from swarmevo.runs.folder import CONFIG_FILE
from swarmevo.runs.following import Fault, FollowedStore, Tally
from swarmevo.runs.lock import Writer
from swarmevo.runs.lock import writer as writer_of
from swarmevo.runs.store import lock_file

State = Literal["opening", "running", "finished", "killed", "stopped", "broken"]
"""``killed``: the writer ended without a word. ``stopped``: it ended as it should, before the run was complete."""

LAST_FAULTS: Final = 100
"""That are kept of a run."""
_LOOKS_BEFORE_BROKEN: Final = 2  # a folder that is just being made is no run yet


@dataclass(frozen=True)
class Progress:
    """Where a run stands."""

    state: State
    said: str = ""
    """Of a broken run its error, of a killed one who wrote it; one line."""
    config: Config | None = None
    """None: not read yet, or broken."""
    seed: int = 0
    generations: tuple[int, ...] = ()
    """Stored, of each trial."""
    share: float = 0.0
    """Of the whole run that is done, in [0, 1]."""
    episodes: int = 0
    faults: int = 0
    """Episodes that failed."""
    seconds: float = 0.0
    """That the evaluations took."""
    last: str = ""
    """When the last generation was stored, as ISO 8601; "": there is none."""
    eta_seconds: float | None = None
    """To the end of a run that is being written, by its latest generations; None: not known."""


@dataclass
class _Trial:
    """What is known of a trial."""

    tallies: list[Tally] = field(default_factory=list)
    course: Course | None = None
    steps: list[Step] = field(default_factory=list)


class Following:
    """A run folder that is looked at again and again. Belongs to one thread at a time."""

    def __init__(self, folder: Path) -> None:
        self.folder: Final = folder
        self.progress = Progress("opening")
        """As of the last :meth:`look`."""
        self.objectives: tuple[Objective, ...] = ()
        self.faults: list[Fault] = []
        """The last ones of the generations taken by :meth:`take`."""
        self._trials: list[_Trial] = []
        self._store: FollowedStore | None = None  # closed
        self._stamp: object = None
        self._failures = 0

    # ---- how far it is

    def look(self) -> Progress:
        """Return where the run stands; it is read only if something has changed."""
        stamp = _stamp(self.folder)
        if stamp != self._stamp or 0 < self._failures < _LOOKS_BEFORE_BROKEN:
            try:
                self.progress = self._read()
                self._failures = 0
            except (SwarmevoError, OSError) as error:
                self._fail(error)
            self._stamp = stamp
        return self.progress

    def _fail(self, error: Exception) -> None:
        self._failures += 1
        if self._failures >= _LOOKS_BEFORE_BROKEN:
            self.progress = Progress("broken", str(error))
            self._forget()

    def _forget(self) -> None:
        self._store, self._trials, self.faults = None, [], []

    def _open(self) -> FollowedStore:
        store = FollowedStore.open(self.folder)
        if self._store is not None:
            store.recall(self._store)
            if store.digest != self._store.digest or store.seed != self._store.seed:  # longer now, or another run
                self._forget()
        self._store = store
        return store

    def _read(self) -> Progress:
        with self._open() as store:
            config, writer = store.config, store.writer
            if not self._trials or not all(self._goes_on(store, trial) for trial in range(len(self._trials))):
                self.faults, self._trials = [], [_Trial() for _ in range(config.evolution.trials)]
            self.objectives = store.objectives
            for number, trial in enumerate(self._trials):
                trial.tallies += store.tallies(number, len(trial.tallies))
        return self._progress(config, store.seed, writer)

    def _goes_on(self, store: FollowedStore, number: int) -> bool:
        """Return whether a trial still has the last generation that is known of it: else it is another run's."""
        known = self._trials[number].tallies[-1:]
        return not known or store.tallies(number, known[0].number)[:1] == known

    def _progress(self, config: Config, seed: int, writer: Writer) -> Progress:
        budget = Budget(config.evolution)
        every = [tally for trial in self._trials for tally in trial.tallies]
        shares = [_shares(budget, trial.tallies) for trial in self._trials]
        left = sum(1.0 - (of_trial[-1] if of_trial else 0.0) for of_trial in shares)
        gained = [gain for of_trial in shares for gain in np.diff(of_trial, prepend=0.0).tolist()]
        rate = sum(gained[-RECENT_GENERATIONS:]) / (_seconds(every[-RECENT_GENERATIONS:]) or 1.0)
        return Progress(
            state=_state(writer, complete=left <= 0.0),
            said="" if writer.is_there or not writer.name else writer.name,
            config=config,
            seed=seed,
            generations=tuple(len(trial.tallies) for trial in self._trials),
            share=1.0 - left / len(self._trials),
            episodes=sum(tally.episodes for tally in every),
            faults=sum(tally.faults for tally in every),
            seconds=sum(tally.seconds for tally in every),
            last=max((tally.stored for tally in every), default=""),
            eta_seconds=left / rate if writer.is_there and rate > 0 else None,
        )

    # ---- what it found

    def take(self, most: int) -> bool:
        """Read stored generations that were not taken yet, each held against its checksum.

        Args:
            most: Episodes to read, but at least one generation.

        Returns:
            Whether there are more.
        """
        if not self._trials:
            return False
        try:
            with self._open() as store:
                for number, trial in enumerate(self._trials):
                    most -= self._take(store, number, trial, most)
        except (SwarmevoError, OSError) as error:
            self._failures = _LOOKS_BEFORE_BROKEN
            self._fail(error)
        return self.untaken > 0

    def _take(self, store: FollowedStore, number: int, trial: _Trial, most: int) -> int:
        """Read generations of a trial until there were so many episodes; return how many there were."""
        arrivals, episodes = [], 0
        for tally in trial.tallies[len(trial.steps) :]:
            if episodes >= most:
                break
            arrivals.append(store.arrival(number, tally.number))
            episodes += tally.episodes
        if arrivals:
            course = trial.course or Course(store.objectives, store.over_worlds, store.config.evolution)
            trial.steps += course.add([arrival.summary for arrival in arrivals])
            trial.course = course
            found = [fault for arrival in arrivals for fault in arrival.faults]
            self.faults = [*self.faults, *found][-LAST_FAULTS:]
        return episodes

    @property
    def untaken(self) -> int:
        """Stored generations that were not taken yet."""
        return sum(len(trial.tallies) - len(trial.steps) for trial in self._trials)

    @property
    def steps(self) -> list[list[Step]]:
        """Of each trial, the generations taken."""
        return [trial.steps for trial in self._trials]

    @property
    def fronts(self) -> list[list[Standing]]:
        """Of each trial, after the generations taken."""
        return [trial.course.front if trial.course else [] for trial in self._trials]

    def global_front(self) -> set[tuple[int, int]]:
        """Return (trial, genome) of those on the front over all trials."""
        every = [(trial, one) for trial, front in enumerate(self.fronts) for one in front]
        if not every or self.progress.config is None:
            return set()
        enough = min(self.progress.config.evolution.least_episodes, max(one.episodes for _, one in every))
        known = [(trial, one) for trial, one in every if one.episodes >= enough]
        places = dominance.places(self.objectives, np.array([one.values for _, one in known]))
        return {(known[i][0], known[i][1].genome) for i in places.tolist()}


def _shares(budget: Budget, tallies: Sequence[Tally]) -> list[float]:
    """Return how much of its budget a trial had spent after each generation."""
    episodes = np.cumsum([tally.episodes for tally in tallies]).tolist()
    return [budget.share(number, spent) for number, spent in enumerate(episodes, start=1)]


def _seconds(tallies: Sequence[Tally]) -> float:
    """Return how long generations took: their evaluations, and what the optimiser did between them.

    The longest pause between two generations is left out, in which the run may have stood still until it was resumed.
    """
    stored = [datetime.fromisoformat(tally.stored).timestamp() for tally in tallies]
    pauses = np.sort(np.diff(stored) - [tally.seconds for tally in tallies[1:]])[:-1]
    between = max(0.0, float(pauses.mean())) if len(pauses) else 0.0
    return sum(tally.seconds for tally in tallies) + len(tallies) * between


def _state(writer: Writer, complete: bool) -> State:
    if writer.is_there:
        return "running"
    if complete:
        return "finished"
    return "killed" if writer.name else "stopped"


def _stamp(folder: Path) -> object:
    """Return what is another one whenever something of a run has changed."""
    lock = lock_file(folder)
    files = [folder / DATABASE_FILE, folder / f"{DATABASE_FILE}-wal", folder / CONFIG_FILE, lock]
    return [_status(file) for file in files], writer_of(lock).is_there


def _status(file: Path) -> tuple[int, ...]:
    try:
        found = os.stat(file)
    except OSError as error:
        return (error.errno or 0,)
    # Without st_ctime: SQLite touches a log's owner whenever root reads it.
    return found.st_dev, found.st_ino, found.st_mode, found.st_size, found.st_mtime_ns

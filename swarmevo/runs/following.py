# SPDX-License-Identifier: BSD-3-Clause
"""Reading of a run folder what is new since the last look, while somebody writes it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Self

from swarmevo.runs import integrity
from swarmevo.runs.database import damaged
from swarmevo.runs.folder import readable
from swarmevo.runs.lock import Writer, writer
from swarmevo.runs.records import Summary
from swarmevo.runs.store import Store, lock_file


class Tally(NamedTuple):
    """A stored generation of a trial, counted."""

    number: int
    """From 0."""
    seconds: float
    """That its evaluation took."""
    stored: str
    """When, as ISO 8601."""
    episodes: int
    faults: int
    """Episodes that failed."""


class Fault(NamedTuple):
    """A stored episode that failed."""

    trial: int
    generation: int
    genome: int
    """Id of its individual's genome."""
    repeat: int
    text: str


@dataclass(frozen=True)
class Arrival:
    """A stored generation, as it was found intact."""

    summary: Summary
    faults: list[Fault]


class FollowedStore(Store):
    """A run folder of which only what is asked for is read, and held against its checksum as it is read.

    Another :class:`Store` goes through all generations before it returns anything, which takes seconds for a run of
    100,000 individuals. Open one for each look: a reader that stays open keeps the writer from leaving one file.
    """

    def check(self) -> None:
        """Do nothing: :meth:`arrival` checks the generation that it reads."""

    @property
    def digest(self) -> str:
        """Of the configuration."""
        return self._config_sha256

    @property
    def writer(self) -> Writer:
        """Who writes the run, or ended without closing it."""
        return writer(lock_file(self.folder))

    def recall(self, before: Self) -> None:
        """Take over what an earlier look has made of the configuration, if that is the same."""
        if before.digest == self.digest:
            self.__dict__ |= {
                name: before.__dict__[name] for name in ("config", "over_worlds") if name in before.__dict__
            }

    @readable
    def tallies(self, trial: int, start: int) -> list[Tally]:
        """Return the generations of a trial from a number on. Only their rows are read."""
        counts = self._rows(
            "SELECT generation, COUNT(*), COUNT(fault) FROM episode WHERE trial = ? AND generation >= ?"
            " GROUP BY generation",
            trial,
            start,
        )
        by_generation = {number: (episodes, faults) for number, episodes, faults in counts}
        rows = self._rows(
            "SELECT number, seconds, stored FROM generation WHERE trial = ? AND number >= ? ORDER BY number",
            trial,
            start,
        )
        return [
            Tally(number, seconds, stored, *by_generation[number])
            for number, seconds, stored in rows
            if number in by_generation
        ]

    @readable
    def arrival(self, trial: int, number: int) -> Arrival:
        """Return a stored generation. Only its rows are read.

        Raises:
            StoreError: It is not there, or not as it was stored.
        """
        with self._snapshot():
            checked = list(integrity.generations(self._database, self._episode_columns, (trial, number)))
        if any(stored != found for _, stored, found in checked):
            raise damaged(self.folder, f"generation {number} of trial {trial}")
        summary = self._summary(trial, number)
        rows = self._rows(
            "SELECT individual, repeat, fault FROM episode WHERE trial = ? AND generation = ? AND fault IS NOT NULL",
            trial,
            number,
        )
        genomes = summary.genomes.tolist()
        return Arrival(summary, [Fault(trial, number, genomes[place], repeat, text) for place, repeat, text in rows])

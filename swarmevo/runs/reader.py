# SPDX-License-Identifier: BSD-3-Clause
"""Reading a run folder."""

from __future__ import annotations

import functools
import hashlib
import json
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarmevo.errors import StoreError
from swarmevo.evolution.aggregation import OverWorlds
from swarmevo.evolution.results import Generation, Results
from swarmevo.evolution.state import decode_state
from swarmevo.protocols import FloatArray, IntArray
from swarmevo.runs import checksums
from swarmevo.runs.database import damaged
from swarmevo.runs.folder import RunFolder, readable
from swarmevo.runs.records import Individuals, Lives, Summary, Totals
from swarmevo.runs.schema import from_rows


class StoreReader(RunFolder):
    """What can be asked of a run folder; every method raises StoreError if it cannot be read, or was changed."""

    @readable
    def session(self, id: int) -> dict[str, Any]:
        """Return with what episodes were run: the provenance of a session.

        Raises:
            StoreError: There is no such session, or it is damaged.
        """
        rows = self._rows("SELECT provenance FROM session WHERE id = ?", id)
        try:
            found = json.loads(rows[0][0])
        except (IndexError, ValueError) as error:
            raise StoreError(f"{self.folder}: the provenance of session {id} is missing or damaged") from error
        if not isinstance(found, dict):
            raise StoreError(f"{self.folder}: the provenance of session {id} is damaged")
        return found

    @readable
    def sessions(self, trial: int, number: int) -> NDArray[np.int64]:
        """Return ``(k,)``: the session that ran each episode of a generation, by individual and repeat."""
        rows = self._rows(
            "SELECT session FROM episode WHERE trial = ? AND generation = ? ORDER BY individual, repeat",
            trial,
            number,
        )
        if not rows:
            raise StoreError(f"{self.folder}: there is no generation {number} of trial {trial}")
        return np.array([session for (session,) in rows], dtype=np.int64)

    @readable
    def genome_ids(self, trial: int, number: int) -> NDArray[np.int64]:
        """Return ``(n,)``: the id of each individual's genome in a generation."""
        rows = self._rows(
            "SELECT genome FROM individual WHERE trial = ? AND generation = ? ORDER BY number", trial, number
        )
        return np.array([id for (id,) in rows], dtype=np.int64)

    @readable
    def in_flight(self, trial: int, number: int, genomes: FloatArray) -> Results:
        """Return the kept episodes of a generation that is not complete.

        Args:
            trial: From 0.
            number: Of the generation, from 0.
            genomes: ``(n, size)``: the generation's; episodes of others are left out.
        """
        digests = dict(enumerate(map(checksums.of_genes, genomes)))
        rows = [row for row in self._kept(trial, number) if digests.get(row[3]) == row[2]]
        return self._results([row[3:] for row in rows], max((row[1] for row in rows), default=0.0))

    def _kept(self, trial: int, number: int) -> list[tuple[Any, ...]]:
        """Return rows of ``in_flight_columns`` of a generation; damaged ones are left out, hence run again."""
        rows = self._rows(
            f"SELECT sha256, {', '.join(self._in_flight_columns)} FROM in_flight"
            " WHERE trial = ? AND generation = ? ORDER BY individual, repeat",
            trial,
            number,
        )
        return [row[1:] for row in rows if row[0] == checksums.of_rows([(trial, number, *row[1:])])]

    @readable
    def trials(self) -> list[int]:
        """Return the trials that have at least one generation, in order."""
        return [trial for (trial,) in self._rows("SELECT DISTINCT trial FROM generation ORDER BY trial")]

    @readable
    def generations(self, trial: int) -> int:
        """Return how many generations of a trial are stored: 0 to this less one."""
        ((last,),) = self._rows("SELECT MAX(number) FROM generation WHERE trial = ?", trial)  # without counting them
        return 0 if last is None else int(last) + 1

    def episodes_stored(self, trial: int | None = None) -> int:
        """Return how many episodes are stored, of a trial or of all trials."""
        return self.totals(trial).episodes

    @readable
    def state(self, trial: int) -> dict[str, Any] | None:
        """Return the optimiser's state after a trial's last stored generation; None: it has none."""
        rows = self._rows("SELECT state FROM optimiser WHERE trial = ?", trial)
        try:
            return decode_state(rows[0][0]) if rows else None
        except ValueError as error:
            raise StoreError(f"{self.folder}: the optimiser's state of trial {trial} is damaged: {error}") from error

    @readable
    def generation(self, trial: int, number: int) -> Generation:
        """Return a generation as it was appended.

        Raises:
            StoreError: It is not stored.
        """
        seconds = self._rows("SELECT seconds FROM generation WHERE trial = ? AND number = ?", trial, number)
        if not seconds:
            raise StoreError(f"{self.folder}: there is no generation {number} of trial {trial}")
        genes = self._rows(
            "SELECT id, sha256, genes FROM individual JOIN genome ON genome.id = individual.genome"
            " WHERE trial = ? AND generation = ? ORDER BY number",
            trial,
            number,
        )
        rows = self._rows(
            f"SELECT {', '.join(self._episode_columns)} FROM episode"
            " WHERE trial = ? AND generation = ? ORDER BY individual, repeat",
            trial,
            number,
        )
        episodes = self._results([row[2:] for row in rows], seconds[0][0], tuple(row[1] or "" for row in rows))
        if not np.array_equal(np.unique(episodes.individual), np.arange(len(genes))):
            raise ValueError("episodes are missing")
        return Generation(np.array([self._genes(*row) for row in genes]), episodes)

    def summaries(self, trial: int, start: int = 0) -> Iterator[Summary]:
        """Yield every stored generation of a trial in short, in order, from that of a number on."""
        for number in range(start, self.generations(trial)):
            yield self._summary(trial, number)

    @readable
    def _summary(self, trial: int, number: int) -> Summary:
        sums = ", ".join(f"TOTAL({column})" for column in self._objective_columns())
        rows = self._rows(
            f"SELECT individual, world, COUNT(*), SUM(ode_messages), SUM(unsolved_steps), {sums} FROM episode"
            " WHERE trial = ? AND generation = ? GROUP BY individual, world ORDER BY individual, world",
            trial,
            number,
        )
        seconds = self._rows("SELECT seconds FROM generation WHERE trial = ? AND number = ?", trial, number)
        genomes = self.genome_ids(trial, number)
        counts = np.array([row[:5] for row in rows], dtype=np.int64)
        return Summary(
            trial=trial,
            number=number,
            genomes=genomes,
            sums=self._by_world(counts[:, 0], counts[:, 1], np.array([row[5:] for row in rows]), len(genomes)),
            counts=self._by_world(counts[:, 0], counts[:, 1], counts[:, 2], len(genomes)),
            episodes=int(counts[:, 2].sum()),
            ode_messages=int(counts[:, 3].sum()),
            unsolved_steps=int(counts[:, 4].sum()),
            seconds=seconds[0][0],
        )

    def _by_world(self, place: IntArray, world: IntArray, values: NDArray[Any], n: int) -> NDArray[Any]:
        """Return values of some worlds of n individuals as ``(n, worlds, ...)``; 0 elsewhere."""
        found = np.zeros((n, len(self.over_worlds.worlds), *values.shape[1:]), dtype=values.dtype)
        found[place, world] = values
        return found

    @functools.cached_property
    def over_worlds(self) -> OverWorlds:
        """What makes one number for each objective of the means in each world."""
        return OverWorlds(self.config, self.objectives)

    @readable
    def individuals(self, trial: int | None = None) -> Individuals:
        """Return every genome of a trial, or of all trials, with its means over all its episodes.

        They come ordered by trial and genome id; a genome met in two trials comes twice.
        """
        homing, described = self._homing_columns(), self._descriptor_columns()
        sums = ", ".join(f"TOTAL({column})" for column in [*self._objective_columns(), *described])
        succeeded = [
            "0" if one.success is None else f"TOTAL({column} {'>=' if one.is_maximised else '<='} {one.success!r})"
            for one, column in zip(self.objectives, self._objective_columns(), strict=True)
        ]
        known = f"COUNT({described[0]})" if described else "0"
        came = " + ".join(f"COUNT({column})" for column in homing)
        time = " + ".join(f"TOTAL({column})" for column in homing)
        rows = self._rows(
            "SELECT individual.trial, genome, world, MIN(individual.generation), MAX(individual.generation), COUNT(*),"
            f" SUM(robots), {came}, COUNT(push_time), {known}, {time}, TOTAL(push_time), {sums}, {', '.join(succeeded)}"
            " FROM individual JOIN episode"
            " ON episode.trial = individual.trial AND episode.generation = individual.generation"
            " AND episode.individual = individual.number"
            " WHERE ?1 IS NULL OR individual.trial = ?1"
            " GROUP BY individual.trial, genome, world ORDER BY individual.trial, genome, world",
            trial,
        )
        whole = np.array([row[:10] for row in rows], dtype=np.int64).reshape(-1, 10)
        reals = np.array([row[10:] for row in rows], dtype=np.float64)
        reals = reals.reshape(len(rows), 2 + 2 * len(self.objectives) + len(described))
        starts = np.flatnonzero(np.any(np.diff(whole[:, :2], axis=0, prepend=-1), axis=1))
        place = np.cumsum(np.isin(np.arange(len(whole)), starts)) - 1  # of each row's genome
        robot_episodes, episodes, homings, pushes = (
            np.add.reduceat(whole[:, column], starts) if len(starts) else np.empty(0, dtype=np.int64)
            for column in (6, 5, 7, 8)
        )
        parts = np.split(reals, np.cumsum([2, len(self.objectives), len(described)]), axis=1)
        times, successes = (np.zeros((len(starts), parts[i].shape[1])) for i in (0, 3))
        np.add.at(times, place, parts[0])
        np.add.at(successes, place, parts[3])
        means = self._by_world(place, whole[:, 2], parts[1] / whole[:, 5:6], len(starts))
        descriptors = [self._by_world(place, whole[:, 2], part, len(starts)) for part in (parts[2], whole[:, 9])]
        return Individuals(
            genome=whole[starts, 1],
            trial=whole[starts, 0],
            first_generation=np.minimum.reduceat(whole[:, 3], starts) if len(starts) else whole[:, 3],
            last_generation=np.maximum.reduceat(whole[:, 4], starts) if len(starts) else whole[:, 4],
            episodes=episodes,
            objectives=self.over_worlds(means),
            descriptors=self.over_worlds.descriptors(*descriptors),
            homing_rate=homings / robot_episodes,
            homing_time=_mean(times[:, 0], homings),
            push_rate=pushes / episodes,
            push_time=_mean(times[:, 1], pushes),
            success_rates=successes / episodes[:, np.newaxis],
        )

    @readable
    def lives(self, genome: int, trial: int, generation: int | None = None) -> Lives:
        """Return a genome's episodes in a trial, or in one generation of it; there may be none.

        Of a genome that is twice in a generation, and so ran the same episodes twice, they come once.
        """
        rows = self._rows(
            f"SELECT individual.generation, {', '.join(self._episode_columns)} FROM individual JOIN episode"
            " ON episode.trial = individual.trial AND episode.generation = individual.generation"
            " AND episode.individual = individual.number"
            " WHERE individual.trial = ?1 AND genome = ?2 AND (?3 IS NULL OR individual.generation = ?3)"
            " AND NOT EXISTS (SELECT 1 FROM individual AS before WHERE before.trial = individual.trial AND"
            " before.generation = individual.generation AND before.number < individual.number AND before.genome = ?2)"
            " ORDER BY individual.generation DESC, repeat",
            trial,
            genome,
            generation,
        )
        return Lives(
            generation=np.array([row[0] for row in rows], dtype=np.int64),
            session=np.array([row[1] for row in rows], dtype=np.int64),
            episodes=self._results([row[3:] for row in rows], 0.0, tuple(row[2] or "" for row in rows)),
        )

    @readable
    def all_genomes(self) -> list[int]:
        """Return the ids of all genomes, in order."""
        return [id for (id,) in self._rows("SELECT id FROM genome ORDER BY id")]

    @readable
    def genome(self, id: int) -> FloatArray:
        """Return the genome ``(size,)`` with an id.

        Raises:
            StoreError: There is none.
        """
        rows = self._rows("SELECT id, sha256, genes FROM genome WHERE id = ?", id)
        if not rows:
            raise StoreError(f"{self.folder}: there is no genome {id}")
        return self._genes(*rows[0])

    @readable
    def genome_ids_by_digest(self) -> dict[bytes, int]:
        """Return the ids of all genomes by their SHA-256 (:func:`swarmevo.runs.checksums.of_genes`)."""
        return {bytes(digest): id for id, digest in self._rows("SELECT id, sha256 FROM genome")}

    @readable
    def totals(self, trial: int | None = None) -> Totals:
        """Return what a trial, or the run, has cost so far."""
        where = "WHERE ?1 IS NULL OR trial = ?1"
        generations, seconds = self._rows(f"SELECT COUNT(*), TOTAL(seconds) FROM generation {where}", trial)[0]
        individuals, genomes = self._rows(f"SELECT COUNT(*), COUNT(DISTINCT genome) FROM individual {where}", trial)[0]
        episodes, messages, unsolved, steps, faults = self._rows(
            "SELECT COUNT(*), TOTAL(ode_messages), TOTAL(unsolved_steps), TOTAL(steps), COUNT(fault)"
            f" FROM episode {where}",
            trial,
        )[0]
        sums = int(messages), int(unsolved), int(steps)
        return Totals(generations, individuals, genomes, episodes, *sums, seconds, faults)

    def _genes(self, id: int, digest: bytes, content: bytes) -> FloatArray:
        if hashlib.sha256(content).digest() != digest:
            raise damaged(self.folder, f"genome {id}")
        genes: FloatArray = np.frombuffer(content, dtype="<f8").astype(np.float64)
        return genes

    def _results(self, rows: Sequence[tuple[Any, ...]], seconds: float, faults: tuple[str, ...] = ()) -> Results:
        """Return rows that begin with individual and repeat as results."""
        places = np.array([row[:2] for row in rows], dtype=np.intp).reshape(-1, 2)
        return Results(
            individual=places[:, 0],
            repeat=places[:, 1],
            values=from_rows([row[2:] for row in rows], self.sizes),
            faults=faults or ("",) * len(rows),
            seconds=seconds,
        )

    def _objective_columns(self) -> list[str]:
        return [f"objective_{k}" for k in range(len(self.objectives))]

    def _descriptor_columns(self) -> list[str]:
        return [f"descriptor_{k}" for k in range(len(self.descriptors))]

    def _homing_columns(self) -> list[str]:
        return [f"homing_time_{j}" for j in range(self.robots)]


def _mean(total: FloatArray, count: NDArray[np.int64]) -> FloatArray:
    """Return ``total / count``, NaN where nothing was counted."""
    mean: FloatArray = np.divide(total, count, out=np.full(len(total), math.nan), where=count > 0)
    return mean

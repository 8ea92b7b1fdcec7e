# SPDX-License-Identifier: BSD-3-Clause
"""All genomes of a trial with all their episodes: who has been judged by too few, and who stands on the front.

It follows from the generations alone, which are added in their order: a run that goes on has the same archive to the
bit as one that was never cut short.
"""

from __future__ import annotations

import moocore
import numpy as np

from swarmevo.evolution.aggregation import OverWorlds, world_sums
from swarmevo.evolution.costs import to_costs
from swarmevo.evolution.results import Generation
from swarmevo.protocols import FloatArray, IntArray, Objective


class Archive:
    """The genomes of a trial, in the order in which they came.

    Args:
        over_worlds: Judges the means of their episodes.
        objectives: m.
        size: Of a genome.
    """

    def __init__(self, over_worlds: OverWorlds, objectives: list[Objective], size: int) -> None:
        self._over_worlds, self._objectives = over_worlds, objectives
        worlds = len(over_worlds.worlds)
        self.genomes: FloatArray = np.empty((0, size))
        self._sums: FloatArray = np.empty((0, worlds, len(objectives)))
        self._counts: IntArray = np.empty((0, worlds), dtype=np.intp)
        self._places: dict[bytes, int] = {}

    def __len__(self) -> int:
        return len(self.genomes)

    def add(self, generation: Generation) -> None:
        """Add the episodes of a generation."""
        n = len(generation.genomes)
        sums, counts = world_sums(generation.episodes, n, self._counts.shape[1])
        keys = [genome.tobytes() for genome in generation.genomes]
        new = [i for i, key in enumerate(keys) if self._places.setdefault(key, len(self._places)) >= len(self)]
        first = list({keys[i]: i for i in reversed(new)}.values())[::-1]  # of equal ones the first
        self.genomes = np.concatenate([self.genomes, generation.genomes[first]])
        self._sums = np.concatenate([self._sums, np.zeros((len(first), *self._sums.shape[1:]))])
        self._counts = np.concatenate([self._counts, np.zeros((len(first), self._counts.shape[1]), dtype=np.intp)])
        places = np.array([self._places[key] for key in keys])
        np.add.at(self._sums, places, sums)
        np.add.at(self._counts, places, counts)

    @property
    def episodes(self) -> IntArray:
        """``(n,)``: of each genome."""
        counts: IntArray = self._counts.sum(axis=1)
        return counts

    def least_sampled(self, most: int, least_episodes: int = 0) -> IntArray:
        """Return the places of up to ``most`` genomes on the front, those with the fewest episodes first.

        Who has fewer than ``least_episodes`` cannot push anybody from the front, but may stand on it: it is for being
        evaluated again.
        """
        costs = to_costs(self._objectives, self._over_worlds(self._sums / self._counts[..., np.newaxis]))
        on_front = np.flatnonzero(moocore.is_nondominated(costs))
        sure = np.flatnonzero(self.episodes >= least_episodes)
        if len(sure):
            on_front = np.union1d(on_front, sure[moocore.is_nondominated(costs[sure])])
        order = np.lexsort((on_front, self.episodes[on_front]))
        chosen: IntArray = on_front[order][:most]
        return chosen

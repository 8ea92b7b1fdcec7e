# SPDX-License-Identifier: BSD-3-Clause
"""From an individual's episodes to one number for each objective or descriptor: a mean in each world, then over worlds.

Episodes are added up in the order of their repeats, so the bits do not depend on how the work was cut.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swarmevo.config import Config, Worlds
from swarmevo.evolution.results import Results
from swarmevo.protocols import FloatArray, IntArray, Objective


def world_sums(
    results: Results, individuals: int, worlds: int, column: str = "objective"
) -> tuple[FloatArray, IntArray]:
    """Return a column's sums ``(individuals, worlds, m)``, and of how many episodes ``(individuals, worlds)``."""
    sums = np.zeros((individuals, worlds, results[column].shape[1]))
    counts = np.zeros((individuals, worlds), dtype=np.intp)
    places = results.individual, results["world"].astype(np.intp)
    np.add.at(sums, places, results[column])
    np.add.at(counts, places, 1)
    return sums, counts


class OverWorlds:
    """Makes one number for each objective of the means in each world (``evolution.over_worlds``); and of descriptors.

    Args:
        config: With ``worlds``, or one alone.
        objectives: m.
    """

    def __init__(self, config: Config, objectives: Sequence[Objective]) -> None:
        self.worlds = Worlds(config)
        self._weights = np.array([world.weight for world in self.worlds])
        self._how, self._quantile = config.evolution.over_worlds, config.evolution.worlds_quantile
        self._ends = np.array([sum(objective.range) for objective in objectives])
        self._is_maximised = np.array([objective.is_maximised for objective in objectives])
        self._of_genome = np.array([objective.of == "genome" for objective in objectives])

    def judge(self, results: Results, individuals: int) -> FloatArray:
        """Return ``(individuals, m)`` of episodes, at least one of each individual in each world."""
        sums, counts = world_sums(results, individuals, len(self.worlds))
        return self(sums / counts[..., np.newaxis])

    def describe(self, results: Results, individuals: int) -> FloatArray:
        """Return the descriptors ``(individuals, d)`` of episodes; NaN where all episodes failed."""
        known = results.only(~np.isnan(results["descriptor"]).any(axis=1))
        return self.descriptors(*world_sums(known, individuals, len(self.worlds), "descriptor"))

    def descriptors(self, sums: FloatArray, counts: IntArray) -> FloatArray:
        """Return ``(n, d)`` of sums ``(n, worlds, d)`` over so many episodes ``(n, worlds)``.

        The mean over the worlds in which there are episodes, by the size of their weights: what a behaviour is like has
        no opposite. Without any episode: NaN.
        """
        weights, total = np.abs(self._weights) * (counts > 0), np.zeros_like(sums[:, 0])
        for world in range(len(self.worlds)):
            total += weights[:, world, np.newaxis] * sums[:, world] / np.maximum(counts[:, world, np.newaxis], 1)
        of_all = weights.sum(axis=1, keepdims=True)
        found: FloatArray = np.divide(total, of_all, out=np.full_like(total, np.nan), where=of_all > 0)
        return found

    def __call__(self, means: FloatArray) -> FloatArray:
        """Return ``(n, m)`` of the means in each world ``(n, worlds, m)``.

        A weight below 0 wants the opposite: a value is mirrored in the middle of its objective's range. An objective of
        the genome alone is what it is, whatever the weights. A world without episodes (NaN) makes NaN.
        """
        wanted = np.where(self._weights[:, np.newaxis] < 0, self._ends - means, means)
        if self._how == "mean":
            weights, total = np.abs(self._weights), np.zeros_like(wanted[:, 0])
            for world, weight in enumerate(weights):
                total += weight * wanted[:, world]
            over = total / weights.sum()
        else:
            goodness = np.where(self._is_maximised, wanted, -wanted)
            share = 0.0 if self._how == "worst" else self._quantile
            over = np.quantile(goodness, share, axis=1)
            over = np.where(self._is_maximised, over, 0.0 - over)
        found: FloatArray = np.where(self._of_genome, means.mean(axis=1), over)
        return found

# SPDX-License-Identifier: BSD-3-Clause
"""Genomes that know nothing yet, and genomes as points of a search that has no bounds."""

from __future__ import annotations

import numpy as np

from swarmevo.protocols import BoolArray, FloatArray, GenomeSpace


def random_genomes(space: GenomeSpace, n: int, rng: np.random.Generator) -> FloatArray:
    """Return ``(n, size)``: weights of N(0, 1), or anywhere between their bounds, and switches on or off."""
    genomes = rng.standard_normal((n, space.size))
    low, high = space.bounds
    bounded, rho = np.isfinite(low) & np.isfinite(high), space.is_switch
    genomes[:, bounded] = rng.uniform(low[bounded], high[bounded], (n, np.count_nonzero(bounded)))
    genomes[:, rho] = rng.random((n, np.count_nonzero(rho))) < 0.5
    return np.clip(genomes, low, high)


def middle(space: GenomeSpace) -> FloatArray:
    """Return ``(size,)``: 0, or the middle between two bounds, and switches at their threshold."""
    genome = np.where(space.is_switch, 0.5, 0.0)
    low, high = space.bounds
    bounded = np.isfinite(low) & np.isfinite(high)
    genome[bounded] = (low[bounded] + high[bounded]) / 2
    return np.clip(genome, low, high)


class Frame:
    """Where genes are in a search: those between two bounds in [-1, 1], the others as they are.

    Args:
        bounds: ``(2, n)``
    """

    def __init__(self, bounds: FloatArray) -> None:
        low, high = bounds
        between: BoolArray = np.isfinite(low) & np.isfinite(high)
        self._bounds, self._offset, self._scale = bounds, np.zeros(len(low)), np.ones(len(low))
        self._offset[between] = (low[between] + high[between]) / 2
        self._scale[between] = (high[between] - low[between]) / 2

    def points(self, genes: FloatArray) -> FloatArray:
        """Return ``(..., n)``: where ``genes`` of that shape are."""
        points: FloatArray = (genes - self._offset) / self._scale
        return points

    def genes(self, points: FloatArray) -> FloatArray:
        """Return ``(..., n)``: the genes at ``points``, or the bound where these are beyond it."""
        genes: FloatArray = np.clip(self._offset + self._scale * points, *self._bounds)
        return genes

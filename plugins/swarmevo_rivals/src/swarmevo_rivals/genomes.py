# SPDX-License-Identifier: BSD-3-Clause
"""Genomes that know nothing yet."""

from __future__ import annotations

import numpy as np

from swarmevo.protocols import FloatArray, GenomeSpace


def random_genomes(space: GenomeSpace, n: int, rng: np.random.Generator) -> FloatArray:
    """Return ``(n, size)``: weights of N(0, 1), or anywhere between their bounds, and switches on or off."""
    genomes = rng.standard_normal((n, space.size))
    low, high = space.bounds
    bounded, rho = np.isfinite(low) & np.isfinite(high), space.is_switch
    genomes[:, bounded] = rng.uniform(low[bounded], high[bounded], (n, np.count_nonzero(bounded)))
    genomes[:, rho] = rng.random((n, np.count_nonzero(rho))) < 0.5
    return np.clip(genomes, low, high)

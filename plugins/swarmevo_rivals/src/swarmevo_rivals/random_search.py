# SPDX-License-Identifier: BSD-3-Clause
"""Random search: what an optimiser must be better than."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from swarmevo.protocols import FloatArray, GenomeSpace
from swarmevo_rivals.genomes import random_genomes


class RandomSearch:
    """Random search: every generation is as random as the first; nothing is learnt.

    Args:
        space: Layout of a genome.
        population: Genomes of a generation.
        objectives: Number of costs.
        rng: The only source of randomness.
    """

    def __init__(self, space: GenomeSpace, population: int, objectives: int, rng: np.random.Generator) -> None:
        self._space, self._population, self._rng = space, population, rng

    def ask(self) -> FloatArray:
        """Return random genomes ``(population, size)``."""
        return random_genomes(self._space, self._population, self._rng)

    def tell(self, genomes: FloatArray, costs: FloatArray) -> None:
        """Take no notice of the costs."""

    def state(self) -> dict[str, Any]:
        """Return the RNG's state."""
        return {"rng": self._rng.bit_generator.state}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from ``state``."""
        self._rng.bit_generator.state = state["rng"]

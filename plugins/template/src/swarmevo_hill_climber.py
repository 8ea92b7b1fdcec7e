# SPDX-License-Identifier: BSD-3-Clause
"""An optimiser for swarmevo: independent hill climbers that try random steps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from swarmevo.protocols import FloatArray, GenomeSpace


class HillClimber:
    """As many hill climbers as the population has members; none knows of the others.

    Each takes a random step, and steps back if its old place dominates the new one.

    Args:
        space: Layout of a genome.
        population: Number of climbers.
        objectives: Number of costs.
        rng: The only source of randomness.
        spread: Standard deviation of a step, above 0.

    Raises:
        ValueError: ``spread`` is not above 0.
    """

    def __init__(
        self, space: GenomeSpace, population: int, objectives: int, rng: np.random.Generator, *, spread: float = 0.1
    ) -> None:
        if not 0 < spread < np.inf:
            raise ValueError(f"spread: expected a number above 0, got {spread!r}")
        self._rng, self._spread, self._bounds = rng, spread, space.bounds
        self._places = np.zeros((population, space.size))
        self._costs = np.full((population, objectives), np.inf)

    def ask(self) -> FloatArray:
        """Return where the climbers step to: at first anywhere."""
        started = np.all(np.isfinite(self._costs))
        steps = self._rng.standard_normal(self._places.shape) * (self._spread if started else 1.0)
        return np.clip(self._places + steps, *self._bounds)

    def tell(self, genomes: FloatArray, costs: FloatArray) -> None:
        """Stay where it is not worse than before."""
        worse = np.all(self._costs <= costs, axis=1) & np.any(self._costs < costs, axis=1)
        self._places = np.where(worse[:, np.newaxis], self._places, genomes)
        self._costs = np.where(worse[:, np.newaxis], self._costs, costs)

    def state(self) -> dict[str, Any]:
        """Return the climbers' places and costs and the RNG's state."""
        return {
            "places": self._places.copy(),
            "costs": self._costs.copy(),
            "rng": self._rng.bit_generator.state,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from ``state``."""
        self._places, self._costs = np.array(state["places"]), np.array(state["costs"])
        self._rng.bit_generator.state = state["rng"]

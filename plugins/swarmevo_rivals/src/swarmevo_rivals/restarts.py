# SPDX-License-Identifier: BSD-3-Clause
"""What follows a search that is over: IPOP (Auger & Hansen 2005) and BIPOP (Hansen 2009)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, Literal

import numpy as np

Restarts = Literal["none", "ipop", "bipop"]

MOST_DOUBLINGS: Final = 9
"""Of the population; what comes later is no larger. As many restarts as pycma makes."""


class Schedule:
    """Populations and spreads of the searches after the first.

    Args:
        restarts: ``ipop``: twice the population each time. ``bipop``: that, in turn with searches of smaller
            populations and spreads, so that both kinds evaluate as many points.
        population: Of the first search.
        sigma: Of the first search.
    """

    def __init__(self, restarts: Restarts, population: int, sigma: float) -> None:
        self._restarts, self._population, self._sigma = restarts, population, sigma
        self._doublings = 0
        self._is_small = True  # the first search is followed by a large one
        self._evaluations = [0, 0]  # of the large, of the small

    def count(self, evaluations: int) -> None:
        """Count the evaluations of the search in work."""
        self._evaluations[self._is_small] += evaluations

    def follow(self, rng: np.random.Generator) -> tuple[int, float]:
        """Return population and spread of the search that follows."""
        large, small = self._evaluations
        self._is_small = self._restarts == "bipop" and small < large
        if not self._is_small:
            self._doublings = min(self._doublings + 1, MOST_DOUBLINGS)
            return self._population * 2**self._doublings, self._sigma
        # Between the first population and half of the largest, mostly small ones; spreads down to a hundredth.
        population = int(self._population * (2.0**self._doublings / 2) ** (rng.random() ** 2))
        return population, self._sigma * 10 ** (-2 * rng.random())

    def state(self) -> dict[str, Any]:
        """Return what was counted."""
        return {
            "doublings": self._doublings,
            "is_small": self._is_small,
            "evaluations": list(self._evaluations),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from ``state``."""
        self._doublings, self._is_small = state["doublings"], state["is_small"]
        self._evaluations = list(state["evaluations"])

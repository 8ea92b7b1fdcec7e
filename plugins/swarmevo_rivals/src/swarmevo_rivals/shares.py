# SPDX-License-Identifier: BSD-3-Clause
"""Costs that can be held against each other."""

from __future__ import annotations

import numpy as np

from swarmevo.protocols import FloatArray, Problem


class Shares:
    """Costs as shares of the objectives' ranges, 0 the best and 1 the worst.

    Args:
        problem: Names and ranges of the objectives.
    """

    def __init__(self, problem: Problem) -> None:
        ranges = [(one.is_maximised, one.range) for one in problem.objectives]
        self._best = np.array([-high if maximised else low for maximised, (low, high) in ranges])
        self._width = np.array([high - low for _, (low, high) in ranges])

    def __call__(self, costs: FloatArray) -> FloatArray:
        """Return the shares ``(n, objectives)`` of ``costs`` of that shape."""
        shares: FloatArray = (costs - self._best) / self._width
        return shares

# SPDX-License-Identifier: BSD-3-Clause
"""Objectives as costs: less is better in every column. The only place that turns one into the other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swarmevo.protocols import FloatArray, Objective


def to_costs(objectives: Sequence[Objective], values: FloatArray) -> FloatArray:
    """Return ``values`` ``(..., m)``, each in its own direction, as costs: less is better in every column."""
    maximised = np.array([objective.is_maximised for objective in objectives])
    costs: FloatArray = np.where(maximised, 0.0 - values, values)  # 0 - x, as -x would make -0 of 0
    return costs


def reference_costs(objectives: Sequence[Objective]) -> FloatArray:
    """Return ``(m,)``: the worse end of each objective's range as costs, the hypervolume's reference."""
    return to_costs(objectives, np.array([objective.worst for objective in objectives], dtype=np.float64))

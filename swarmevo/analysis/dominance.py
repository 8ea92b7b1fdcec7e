# SPDX-License-Identifier: BSD-3-Clause
"""Which points no other dominates, and how much a set of them does; each objective in its own direction."""

from __future__ import annotations

import math
from collections.abc import Sequence

import moocore
import numpy as np

from swarmevo.protocols import FloatArray, IntArray, Objective


def hypervolume(objectives: Sequence[Objective], points: FloatArray) -> float:
    """Return the volume that ``points`` ``(n, m)`` dominate, against the worse end of each objective's range."""
    reference = [objective.worst for objective in objectives]
    return float(moocore.hypervolume(points, ref=reference, maximise=_maximised(objectives)))


def volume(objectives: Sequence[Objective]) -> float:
    """Return the product of the objectives' ranges, which no hypervolume exceeds."""
    return math.prod(high - low for low, high in (objective.range for objective in objectives))


def places(objectives: Sequence[Objective], points: FloatArray) -> IntArray:
    """Return the indices of the non-dominated rows of ``points`` ``(n, m)``, the best first objective first.

    Of equal rows the first represents all.
    """
    if len(points) == 0:
        return np.empty(0, dtype=np.intp)
    chosen = np.flatnonzero(moocore.is_nondominated(points, maximise=_maximised(objectives)))
    first = points[chosen, 0]
    return chosen[np.argsort(-first if objectives[0].is_maximised else first, kind="stable")]


def non_dominated(objectives: Sequence[Objective], points: FloatArray) -> FloatArray:
    """Return the non-dominated rows of ``points`` ``(n, m)``, one of each kind, the best first objective first."""
    return points[places(objectives, points)]


def _maximised(objectives: Sequence[Objective]) -> list[bool]:
    return [objective.is_maximised for objective in objectives]

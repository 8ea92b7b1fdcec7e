# SPDX-License-Identifier: BSD-3-Clause
"""How sure a rate is."""

from __future__ import annotations

import math
from statistics import NormalDist


def wilson(successes: float, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return Wilson's score interval of a rate (E. B. Wilson, 1927).

    Args:
        successes: Of the trials; may be a mean over parts of each trial, and so no whole number.
        trials: Independent ones, at least 1.
        confidence: That the interval holds the true rate.
    """
    z = NormalDist().inv_cdf((1 + confidence) / 2)
    rate = successes / trials
    middle = (rate + z * z / (2 * trials)) / (1 + z * z / trials)
    half = z / (1 + z * z / trials) * math.sqrt(rate * (1 - rate) / trials + z * z / (4 * trials * trials))
    return max(0.0, middle - half), min(1.0, middle + half)

# SPDX-License-Identifier: BSD-3-Clause
"""Whether samples differ, and by how much: rank tests of scipy, effect sizes, and what several tests at once cost.

The unit is the trial. Small p-values say that a difference is there, effect sizes how large it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from swarmevo.errors import SwarmevoError
from swarmevo.protocols import FloatArray

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

RESAMPLES: Final = 10_000
"""Of a bootstrap."""
_SEED: Final = 0  # the same interval each time


def mann_whitney(a: ArrayLike, b: ArrayLike) -> float:
    """Return the two-sided p-value of the Mann-Whitney test: exact where there are few values without ties.

    Raises:
        SwarmevoError: scipy is not installed.
    """
    stats, a, b = _scipy_stats(), np.asarray(a), np.asarray(b)
    if _are_all_the_same([a, b]):
        return 1.0
    return float(stats.mannwhitneyu(a, b, alternative="two-sided").pvalue)


def kruskal_wallis(groups: Sequence[ArrayLike]) -> float:
    """Return the p-value of the Kruskal-Wallis test: whether any of several samples differs.

    Raises:
        SwarmevoError: scipy is not installed.
    """
    stats = _scipy_stats()
    return 1.0 if _are_all_the_same(groups) else float(stats.kruskal(*groups).pvalue)


def vargha_delaney(a: ArrayLike, b: ArrayLike) -> float:
    """Return A12 (Vargha and Delaney, 2000): how often a value of ``a`` is above one of ``b``, a tie counted half."""
    return float(_above(np.asarray(a)[np.newaxis], np.asarray(b)[np.newaxis])[0])


def vargha_delaney_interval(a: ArrayLike, b: ArrayLike, confidence: float = 0.95) -> tuple[float, float]:
    """Return the percentile bootstrap's interval of A12; the same one each time."""
    rng = np.random.default_rng(_SEED)
    drawn = [rng.choice(np.asarray(values), size=(RESAMPLES, len(np.asarray(values)))) for values in (a, b)]
    tail = (1 - confidence) / 2
    low, high = np.quantile(_above(*drawn), [tail, 1 - tail])
    return float(low), float(high)


def holm(p_values: Sequence[float]) -> list[float]:
    """Return p-values adjusted for being several (Holm, 1979), in their order."""
    order = np.argsort(p_values, kind="stable")
    steps = np.asarray(p_values)[order] * np.arange(len(p_values), 0, -1)
    adjusted = np.empty(len(p_values))
    adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1.0)
    return [float(p) for p in adjusted]


def _above(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return ``(k,)``: A12 of each of k pairs of samples ``(k, n)`` and ``(k, m)``."""
    total = np.zeros(len(a))
    for column in a.T:  # one at a time: no array of (k, n, m)
        total += ((column[:, np.newaxis] > b) + 0.5 * (column[:, np.newaxis] == b)).sum(axis=1)
    return np.asarray(total / (a.shape[1] * b.shape[1]))


def _are_all_the_same(groups: Sequence[ArrayLike]) -> bool:
    values = np.concatenate([np.asarray(group) for group in groups])
    return bool((values == values[0]).all())


def _scipy_stats() -> Any:
    try:
        import scipy.stats
    except ImportError as error:
        raise SwarmevoError("scipy: expected it installed for statistics; pip install 'swarmevo[stats]'") from error
    return scipy.stats

# SPDX-License-Identifier: BSD-3-Clause
"""How good a trial's controllers are, by tests that did not choose among them.

Of many alike the best by the same tests looks better than of few, and so does their hypervolume: fronts of different
sizes would differ where nothing does. Hence one half of the tests says who is the best, the other half how good that
one is, and the other way round; the mean of both counts. It is what somebody gets who chooses by so many tests, a
little less than what the best are worth. With a single test evolution says who is the best.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from swarmevo.protocols import FloatArray, Objective

ANGLES: Final = 1000
"""Directions in the plane of two objectives."""
DIRECTIONS: Final = 4096
"""Where there are more objectives; a power of two, as Sobol's points are even for."""
_NEXT: Final = 1e-6  # how much of the other objectives counts between equals


def hypervolume(objectives: Sequence[Objective], evolved: FloatArray, tests: FloatArray) -> float:
    """Return the hypervolume of controllers as a share of the product of the m objectives' ranges.

    In polar coordinates about the reference, the worse end of each range, the hypervolume is an integral over all
    directions of how far somebody reaches there (Deng & Zhang 2019, "Approximating hypervolume and hypervolume
    contributions using polar coordinate"). In each direction one half of the tests says who that is, the other how far
    that one reaches. Of two objectives the integral is within 0.00001 of the exact one, of three and four within 0.01.

    Args:
        objectives: m.
        evolved: In evolution, of each controller ``(n, m)``.
        tests: In the tests ``(n, repeats, m)``.
    """
    worst = np.array([one.worst for one in objectives])
    width = np.array([high - low for low, high in (one.range for one in objectives)])
    gained, tested = (np.abs(values - worst) / width for values in (evolved, tests))
    return float(np.mean([_crossed(chosen, valued) for chosen, valued in _halves(gained, tested)]))


def _crossed(chosen: FloatArray, valued: FloatArray) -> float:
    """Return the volume ``valued`` reaches by who is the best by ``chosen`` in each direction; ``(n, m)`` in [0, 1]."""
    m = chosen.shape[1]
    directions = _directions(m)
    ratios = chosen[:, np.newaxis] / directions
    best = (ratios.min(axis=2) + _NEXT * ratios.mean(axis=2)).argmax(axis=0)
    reach = (valued[best] / directions).min(axis=1)
    surface = 2 * math.pi ** (m / 2) / math.gamma(m / 2) / 2**m  # of the unit sphere's part with no negative coordinate
    return float(surface / m * np.mean(reach**m))


@functools.cache
def _directions(m: int) -> FloatArray:
    """Return unit vectors ``(k, m)``, spread evenly, of which no coordinate is 0."""
    if m == 1:
        return np.ones((1, 1))
    if m == 2:
        angle = (np.arange(ANGLES) + 0.5) / ANGLES * math.pi / 2
        return np.stack([np.cos(angle), np.sin(angle)], axis=1)
    from scipy import stats  # an extra

    even = stats.qmc.Sobol(m, scramble=False).random(DIRECTIONS) + 0.5 / DIRECTIONS
    normal: FloatArray = stats.norm.ppf((1 + even) / 2)  # as far in all directions alike
    unit: FloatArray = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return unit


def of_the_best(evolved: FloatArray, first: FloatArray, success: FloatArray) -> tuple[float, float]:
    """Return the first objective of who is the best in it, and the rate of success of who succeeds most often.

    Of equal rates of success the better in the first objective is taken.

    Args:
        evolved: The first objective in evolution, of each controller ``(n,)``; more is better.
        first: The same in the tests ``(n, repeats)``.
        success: How far each test was a success ``(n, repeats)``.
    """
    known = np.stack([evolved, np.zeros(len(evolved))], axis=1)  # evolution does not say who succeeds
    found = [
        (valued[chosen[:, 0].argmax(), 0], valued[np.lexsort(chosen.T)[-1], 1])
        for chosen, valued in _halves(known, np.stack([first, success], axis=2))
    ]
    best, most_successful = np.mean(found, axis=0).tolist()
    return best, most_successful


def _halves(evolved: FloatArray, tests: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield by what controllers are chosen, and by what valued, each ``(n, m)``; of tests ``(n, repeats, m)``."""
    half = tests.shape[1] // 2
    if half == 0:
        yield evolved, tests[:, 0]
        return
    one, other = tests[:, :half].mean(axis=1), tests[:, half:].mean(axis=1)
    yield one, other
    yield other, one

# SPDX-License-Identifier: BSD-3-Clause
"""Which share of several trials attained a trade-off, and where two groups of trials differ in that.

A trial attains a point of the plane if one of its front is as good in both costs, or better. The library moocore has
such differences for groups of equal size alone.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from swarmevo.protocols import FloatArray


@dataclass(frozen=True)
class Rectangle:
    """A part of the plane of two costs in which the same trials attain everything, without its upper ends."""

    low: tuple[float, float]
    high: tuple[float, float]
    """Infinite: it has no end."""
    difference: float
    """Share of the first group's trials that attain it, less that of the second group's; not 0."""


def differences(a: Sequence[FloatArray], b: Sequence[FloatArray]) -> Iterator[Rectangle]:
    """Return where two groups differ; the rectangles do not overlap.

    Args:
        a: Of each of its trials the costs ``(n, 2)`` of a front, at least one.
        b: Those of the other group.
    """
    points = np.concatenate([*a, *b])
    across, up = np.unique(points[:, 0]), np.unique(points[:, 1])
    shares = _attained(a, across, up) - _attained(b, across, up)
    x, y = [*across.tolist(), np.inf], [*up.tolist(), np.inf]
    begun: dict[tuple[int, int, float], int] = {}  # runs of the row below, and the row that each began in
    for row in range(len(up) + 1):
        runs = _runs(shares[row]) if row < len(up) else []
        for run in [one for one in begun if one not in runs]:
            first, end, difference = run
            yield Rectangle((x[first], y[begun.pop(run)]), (x[end], y[row]), difference)
        for run in runs:
            begun.setdefault(run, row)


def _attained(trials: Sequence[FloatArray], across: FloatArray, up: FloatArray) -> FloatArray:
    """Return ``(len(up), len(across))``: the share of trials that attain each place."""
    counts = np.zeros((len(up), len(across)), dtype=np.intp)
    for points in trials:
        attains = np.zeros(counts.shape, dtype=bool)
        attains[np.searchsorted(up, points[:, 1]), np.searchsorted(across, points[:, 0])] = True
        counts += np.logical_or.accumulate(np.logical_or.accumulate(attains, axis=0), axis=1)
    shares: FloatArray = counts / len(trials)
    return shares


def _runs(row: FloatArray) -> list[tuple[int, int, float]]:
    """Return where a row has the same value, from a place to before another, and the value; where it is not 0."""
    places = [0, *(np.flatnonzero(np.diff(row)) + 1).tolist(), len(row)]
    return [(i, j, float(row[i])) for i, j in itertools.pairwise(places) if row[i] != 0]

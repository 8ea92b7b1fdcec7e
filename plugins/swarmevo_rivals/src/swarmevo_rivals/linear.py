# SPDX-License-Identifier: BSD-3-Clause
"""Linear algebra that has the same bits on every processor and any number of threads.

NumPy leaves matrices to a library that computes with other instructions on each kind of processor, and sums in another
order. Here all is sums, products, quotients and roots of single numbers, which IEEE 754 rounds the same everywhere.
"""

from __future__ import annotations

import math
import sys
from typing import Final

import numpy as np

from swarmevo.protocols import FloatArray, IntArray

NEARLY: Final = 2.0**-40
"""Largest cosine between two rows in a sweep after which they are at right angles, as each sweep about squares it."""
MOST_SWEEPS: Final = 40
"""They take three to ten."""


def product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the product ``(m, n)`` of matrices ``(m, k)`` and ``(k, n)``."""
    found = np.zeros((len(a), b.shape[1]))
    for column, row in zip(a.T, b, strict=True):
        found += column[:, np.newaxis] * row
    return found


def axes_of(covariance: FloatArray, near: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the eigenvalues ``(n,)`` of a symmetric matrix that has none below 0, ascending, and unit eigenvectors.

    Rows of the matrix are rotated in pairs, as many at once as have no row in common, until all are at right angles:
    then each is an eigenvector times its eigenvalue (one-sided Jacobi; Golub & Van Loan, Matrix Computations, 8.6).

    Args:
        covariance: ``(n, n)``
        near: Eigenvectors of a matrix like it, as rows ``(n, n)``; the nearer, the sooner it is done.

    Returns:
        The eigenvectors are rows ``(n, n)``; that of an eigenvalue of 0 is 0.
    """
    rows = product(near, covariance)
    rounds = _rounds(len(rows))
    for _ in range(MOST_SWEEPS):
        if max((_rotate(rows, p, q) for p, q in rounds), default=0.0) <= NEARLY:
            break
    values = np.sqrt((rows * rows).sum(axis=1))
    order = np.argsort(values, kind="stable")
    values, rows = values[order], rows[order]
    return values, np.divide(rows, values[:, np.newaxis], out=np.zeros_like(rows), where=values[:, np.newaxis] > 0)


def _rotate(rows: FloatArray, p: IntArray, q: IntArray) -> float:
    """Turn rows p and q, pair by pair, until they are at right angles; return the largest cosine there was."""
    one, other = rows[p], rows[q]
    one_square, other_square = (one * one).sum(axis=1), (other * other).sum(axis=1)
    common = (one * other).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        slope = (other_square - one_square) / (2 * common)
        tangent = np.copysign(1.0, slope) / (np.abs(slope) + np.sqrt(1 + slope * slope))
        cosines = np.abs(common) / (np.sqrt(one_square) * np.sqrt(other_square))
    tangent = np.where(common == 0, 0.0, tangent)[:, np.newaxis]
    cosine = 1 / np.sqrt(1 + tangent * tangent)
    sine = tangent * cosine
    rows[p] = cosine * one - sine * other
    rows[q] = sine * one + cosine * other
    return float(np.where(common == 0, 0.0, cosines).max(initial=0.0))


def _rounds(n: int) -> list[tuple[IntArray, IntArray]]:
    """Return in which rounds each row meets each other once, as players of a tournament do: who meets whom."""
    players = list(range(n + n % 2))
    half, rounds = len(players) // 2, []
    for _ in players[1:]:
        pairs = [sorted(pair) for pair in zip(players[:half], players[: half - 1 : -1], strict=True)]
        p, q = np.array([pair for pair in pairs if pair[1] < n], dtype=np.intp).reshape(-1, 2).T
        rounds.append((p, q))
        players = [players[0], players[-1], *players[1:-1]]
    return rounds


def log_determinant(matrix: FloatArray) -> float:
    """Return the logarithm of the determinant of a symmetric matrix ``(n, n)`` whose eigenvalues are above 0.

    By elimination; what rounding made 0 or less counts as the least number there is.
    """
    left, total = matrix.copy(), 0.0
    for i in range(len(left)):
        pivot = max(float(left[i, i]), sys.float_info.min)
        total += math.log(pivot)
        left[i + 1 :, i + 1 :] -= left[i + 1 :, i, np.newaxis] / pivot * left[i, i + 1 :]
    return total

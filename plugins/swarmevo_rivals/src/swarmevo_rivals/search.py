# SPDX-License-Identifier: BSD-3-Clause
"""A search by CMA-ES (Hansen, *The CMA Evolution Strategy: A Tutorial*, arXiv 1604.00772), which the equations are of.

Written here, not left to a library, for the same bits on every processor (:mod:`.linear`): libraries leave matrices to
NumPy. Tests hold it against the library cmaes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from swarmevo.protocols import FloatArray
from swarmevo_rivals.linear import axes_of, log_determinant, product

LARGEST_STEP, LARGEST_EXPONENT = 1e32, 100.0
TINY: Final = 1e-8
"""In place of variances of 0, which are rounding."""

FLAT, CONVERGED, DIVERGED, STRETCHED = 1e-12, 1e-12, 1e4, 1e14
"""A search is over when costs differ by less, when variances are less than that share of the first spread, when the
longest axis is longer, or when it is that many times the shortest."""

SNR, MEMORY_OF_MEAN, MEMORY_OF_COVARIANCE, DAMPING = 1.4, 0.1, 0.03, 0.1
"""alpha, beta_m, beta_Sigma, gamma of Nomura et al. (2023)."""


class Search:
    """A normal distribution that learns, from its first mean until the search is over.

    Args:
        mean: ``(n,)``
        sigma: Standard deviation of each coordinate at first.
        population: Points of a generation.
        adapts: Whether learning rates are adapted to noise (Nomura et al., *CMA-ES with Learning Rate Adaptation*,
            arXiv 2304.03473).
        rng: Whatever is drawn comes from it.
    """

    def __init__(self, mean: FloatArray, sigma: float, population: int, adapts: bool, rng: np.random.Generator) -> None:
        n = len(mean)
        self.population, self._adapts, self._rng = population, adapts, rng
        self._rates = _Rates(n, population)
        self._mean, self._sigma, self._first_sigma = mean.astype(np.float64), float(sigma), float(sigma)
        self._covariance = self._axes = np.eye(n)
        self._step_path, self._path = np.zeros(n), np.zeros(n)  # p_sigma, p_c
        self._generation = 0
        self._extremes = np.zeros((10 + math.ceil(30 * n / population), 2))  # least and largest costs of late
        self._rate_of_mean, self._rate_of_covariance = 1.0, 1.0
        self._shift, self._shift_square = np.zeros(n), 0.0  # E and V of the mean's steps, of the covariance's
        self._change, self._change_square = np.zeros((n, n)), 0.0
        self._decompose()

    @property
    def generations(self) -> int:
        """How many were told."""
        return self._generation

    @property
    def mean(self) -> FloatArray:
        """Of the distribution, ``(n,)``."""
        return self._mean.copy()

    def ask(self) -> FloatArray:
        """Return points ``(population, n)`` (eqs. 38 to 40); of the axes' signs and order nothing depends."""
        drawn = self._rng.standard_normal((self.population, len(self._mean)))
        return self._mean + self._sigma * product(drawn, self._root)

    def tell(self, points: FloatArray, costs: FloatArray) -> None:
        """Learn from the costs ``(population,)`` of the points that were asked for."""
        order = np.argsort(costs, kind="stable")
        ranked = points[order]
        self._generation += 1
        self._extremes[self._generation % len(self._extremes)] = costs[order[[0, -1]]]
        before = (self._mean.copy(), self._sigma, self._covariance)
        self._learn((ranked - self._mean) / self._sigma)
        if self._adapts:
            self._adapt(*before)
        if self._adapts or self._generation % self._rates.pause == 0:
            self._decompose()

    def _learn(self, steps: FloatArray) -> None:
        """Move by the steps ``(population, n)`` in units of sigma, the best first."""
        rates, n = self._rates, len(self._mean)
        weights = rates.weights
        step = (weights[: rates.parents, np.newaxis] * steps[: rates.parents]).sum(axis=0)  # eq. 41
        self._mean = self._mean + self._sigma * step
        whitened = product(np.vstack([step, steps]), self._inverse_root)
        self._step_path = (1 - rates.c_sigma) * self._step_path + rates.step_gain * whitened[0]  # eq. 43
        length = _norm(self._step_path)
        decay = math.sqrt(1 - (1 - rates.c_sigma) ** (2 * (self._generation + 1)))
        is_short = length / decay < (1.4 + 2 / (n + 1)) * rates.expected_length
        exponent = rates.c_sigma / rates.d_sigma * (length / rates.expected_length - 1)
        self._sigma = min(self._sigma * math.exp(min(exponent, LARGEST_EXPONENT)), LARGEST_STEP)  # eq. 44
        self._path = (1 - rates.c_c) * self._path + is_short * rates.path_gain * step  # eq. 45
        lengths = (whitened[1:] * whitened[1:]).sum(axis=1)
        scaled = np.where(weights >= 0, weights, weights * n / (lengths + TINY))  # eq. 46
        kept = 1 - rates.c_1 - rates.c_mu * weights.sum() + (not is_short) * rates.c_1 * rates.c_c * (2 - rates.c_c)
        learnt = rates.c_mu * product((scaled[:, np.newaxis] * steps).T, steps)
        learnt += rates.c_1 * self._path[:, np.newaxis] * self._path
        self._covariance = kept * self._covariance + learnt  # eq. 47

    def _adapt(self, mean: FloatArray, sigma: float, covariance: FloatArray) -> None:
        """Take of the step from a mean and a covariance only as much as noise leaves sure."""
        n = len(mean)
        old, new = sigma * sigma * covariance, self._sigma * self._sigma * self._covariance
        inverse = self._inverse_root / sigma
        shift = product((self._mean - mean)[np.newaxis], inverse)[0]
        change = product(inverse, product(new - old, inverse)) / math.sqrt(2)
        self._shift, self._shift_square, snr = _signal(self._shift, self._shift_square, shift, MEMORY_OF_MEAN)
        rate_before = self._rate_of_mean
        self._rate_of_mean = _adapted(self._rate_of_mean, snr, MEMORY_OF_MEAN)
        self._change, self._change_square, snr = _signal(
            self._change, self._change_square, change, MEMORY_OF_COVARIANCE
        )
        self._rate_of_covariance = _adapted(self._rate_of_covariance, snr, MEMORY_OF_COVARIANCE)
        self._mean = mean + self._rate_of_mean * (self._mean - mean)
        taken = old + self._rate_of_covariance * (new - old)
        self._sigma = min(math.exp(log_determinant(taken) / 2 / n), LARGEST_STEP)
        self._covariance = taken / (self._sigma * self._sigma)
        self._sigma *= rate_before / self._rate_of_mean

    def _decompose(self) -> None:
        """Find the axes of the distribution."""
        self._covariance = (self._covariance + self._covariance.T) / 2
        variances, self._axes = axes_of(self._covariance, self._axes)
        self._lengths = np.sqrt(np.where(variances > 0, variances, TINY))
        self._take_roots()

    def _take_roots(self) -> None:
        """Find the roots of its covariance."""
        self._root = product(self._axes.T * self._lengths, self._axes)
        self._inverse_root = product(self._axes.T / self._lengths, self._axes)

    def is_over(self) -> bool:
        """Return whether there is nothing more to learn; not between :meth:`ask` and :meth:`tell`."""
        sigma, deviations = self._sigma, np.sqrt(np.diag(self._covariance))
        axis = self._generation % len(self._mean)
        reasons = (
            self._generation > len(self._extremes) and np.ptp(self._extremes) < FLAT,
            bool(np.all(sigma * deviations**2 < CONVERGED * self._first_sigma))
            and bool(np.all(sigma * self._path < CONVERGED * self._first_sigma)),
            sigma * self._lengths[-1] > DIVERGED,
            np.any(self._mean == self._mean + 0.2 * sigma * deviations),
            np.all(self._mean == self._mean + 0.1 * sigma * self._lengths[axis] * self._axes[axis]),
            self._lengths[-1] > STRETCHED * self._lengths[0],
        )
        return any(map(bool, reasons))

    def state(self) -> dict[str, Any]:
        """Return all that it has learnt."""
        return {name: np.copy(value) if isinstance(value, np.ndarray) else value for name, value in self._known()}

    def _known(self) -> list[tuple[str, Any]]:
        known = ("mean", "sigma", "first_sigma", "covariance", "axes", "lengths", "step_path", "path", "generation",
                 "extremes", "rate_of_mean", "rate_of_covariance", "shift", "shift_square", "change",
                 "change_square")  # fmt: skip
        return [("population", self.population), *((name, getattr(self, f"_{name}")) for name in known)]

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from ``state``.

        Raises:
            ValueError: It is of a search by the library cmaes, as runs had it before.
        """
        if "cmaes" in state:
            raise ValueError(
                "expected a search by swarmevo's own CMA-ES, got one by the library cmaes, whose bits depend on the "
                "processor: evolve anew, from its genomes with evolution.start"
            )
        for name, value in state.items():
            kept = np.copy(value) if isinstance(value, np.ndarray) else value
            setattr(self, name if name == "population" else f"_{name}", kept)
        self._rates = _Rates(len(self._mean), self.population)
        self._take_roots()


class _Rates:
    """Weights and learning rates for a number of coordinates and of points (eqs. 49 to 58)."""

    def __init__(self, n: int, population: int) -> None:
        self.parents = population // 2
        raw = np.array([math.log((population + 1) / 2) - math.log(i + 1) for i in range(population)])
        best, rest = raw[: self.parents], raw[self.parents :]
        effective, effective_rest = ((part.sum() ** 2 / (part * part).sum()).item() for part in (best, rest))
        self.c_1 = 2 / ((n + 1.3) ** 2 + effective)
        self.c_mu = min(1 - self.c_1 - 1e-8, 2 * (effective - 2 + 1 / effective) / ((n + 2) ** 2 + effective))
        least = min(
            1 + self.c_1 / self.c_mu,
            1 + 2 * effective_rest / (effective + 2),
            (1 - self.c_1 - self.c_mu) / (n * self.c_mu),
        )
        self.weights = np.where(raw >= 0, raw / raw[raw > 0].sum(), least * raw / np.abs(raw[raw < 0]).sum())
        self.c_sigma = (effective + 2) / (n + effective + 5)
        self.d_sigma = 1 + 2 * max(0.0, math.sqrt((effective - 1) / (n + 1)) - 1) + self.c_sigma
        self.c_c = (4 + effective / n) / (n + 4 + 2 * effective / n)
        self.step_gain = math.sqrt(self.c_sigma * (2 - self.c_sigma) * effective)
        self.path_gain = math.sqrt(self.c_c * (2 - self.c_c) * effective)
        self.pause = max(1, int(1 / (10 * n * (self.c_1 + self.c_mu))))  # generations from axes to axes (B.2)
        self.expected_length = math.sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n * n))  # of a normal vector


def _norm(vector: FloatArray) -> float:
    return math.sqrt((vector * vector).sum())


def _signal(mean: FloatArray, square: float, step: FloatArray, memory: float) -> tuple[FloatArray, float, float]:
    """Return the moving means of steps and of their squared lengths with another one, and their signal over noise."""
    mean = (1 - memory) * mean + memory * step
    square = (1 - memory) * square + memory * float((step * step).sum())
    length = float((mean * mean).sum())
    signal, noise = length - memory / (2 - memory) * square, square - length
    return mean, square, signal / noise if noise > 0 else 0.0


def _adapted(rate: float, snr: float, memory: float) -> float:
    """Return the learning rate that follows: less where there is more noise than alpha allows."""
    excess = min(max(snr / SNR / rate - 1, -1.0), 1.0)
    return min(rate * math.exp(min(DAMPING * rate, memory) * excess), 1.0)

# SPDX-License-Identifier: BSD-3-Clause
"""A search by CMA-ES: the library ``cmaes`` with a given generator's randomness and a state that is plain data."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

import cmaes
import numpy as np

from swarmevo.protocols import FloatArray
from swarmevo_rivals.blas import OneThread


class Search:
    """A normal distribution that learns, from its first mean until the library says that it is over.

    Args:
        mean: ``(n,)``
        sigma: Standard deviation of each coordinate at first.
        population: Points of a generation.
        adapts: Whether learning rates are adapted to noise.
        rng: Whatever is drawn comes from it.
    """

    def __init__(self, mean: FloatArray, sigma: float, population: int, adapts: bool, rng: np.random.Generator) -> None:
        self._made = cmaes.CMA(mean, sigma, population_size=population, lr_adapt=adapts)
        self._made._rng = _Normal(rng)
        self._made._funhist_values.fill(0.0)  # the library leaves chance in it, which a state must not hold
        self._one_thread = OneThread()

    @property
    def population(self) -> int:
        """Points of a generation."""
        return int(self._made.population_size)

    @property
    def generations(self) -> int:
        """How many were told."""
        return int(self._made.generation)

    @property
    def mean(self) -> FloatArray:
        """Of the distribution, ``(n,)``."""
        return np.array(self._made.mean)

    def is_over(self) -> bool:
        """Return whether there is nothing more to learn; not between :meth:`ask` and :meth:`tell`."""
        with self._one_thread():
            return bool(self._made.should_stop())

    def ask(self) -> FloatArray:
        """Return points ``(population, n)``."""
        with self._one_thread():
            return np.array([self._made.ask() for _ in range(self.population)])

    def tell(self, points: FloatArray, costs: FloatArray) -> None:
        """Learn from the costs ``(population,)`` of the points that were asked for."""
        with self._one_thread():
            self._made.tell(list(zip(points, costs.tolist(), strict=True)))

    def state(self) -> dict[str, Any]:
        """Return all that the library knows, and its version."""
        known = {name: copy.copy(value) for name, value in vars(self._made).items() if name != "_rng"}
        return {"cmaes": cmaes.__version__, **known}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from ``state``.

        Raises:
            ValueError: It is that of another version of the library, which would go on otherwise.
        """
        if state["cmaes"] != cmaes.__version__:
            raise ValueError(
                f"expected cmaes {state['cmaes']}, with which the run was begun, got {cmaes.__version__}; install that"
            )
        vars(self._made).update({name: copy.copy(value) for name, value in state.items() if name != "cmaes"})


class _Normal:
    """What the library needs of a generator."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng

    def randn(self, n: int) -> FloatArray:
        return self._rng.standard_normal(n)

# SPDX-License-Identifier: BSD-3-Clause
"""Searches by libraries whose objects have no state that could be stored without a pickle."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any, ClassVar

import numpy as np

from swarmevo.protocols import FloatArray, GenomeSpace
from swarmevo_rivals.genomes import random_genomes


class Replayed(ABC):
    """A search that is decided by its seed, the genomes that it begins with, and what it was told.

    These are its state; to continue is to tell the library all of it once more.

    Args:
        space: Layout of a genome.
        population: Genomes of a generation.
        columns: Numbers that the library is told of each genome.
        rng: The only source of randomness.
    """

    libraries: ClassVar[tuple[str, ...]]
    """Names of the distributions that it computes in: another version may go on otherwise."""

    def __init__(self, space: GenomeSpace, population: int, columns: int, rng: np.random.Generator) -> None:
        self._space, self._population, self._columns, self._rng = space, population, columns, rng
        self._seed = int(rng.integers(2**31))
        self._first = self._within(self._beginning())
        self._told: list[FloatArray] = []
        self._begin()

    def start_from(self, genomes: FloatArray) -> None:
        """Begin from ``genomes`` ``(k, size)``; what the population has more is random, of more the first are taken."""
        given = self._within(genomes[: self._population])
        self._first = np.concatenate([given, self._first[len(given) :]])
        self._begin()

    def state(self) -> dict[str, Any]:
        """Return what the library began with and all that it was told."""
        return {
            "seed": self._seed,
            "first": self._first.copy(),
            "told": np.concatenate([np.empty((0, self._columns)), *self._told]),
            "counts": [len(told) for told in self._told],
            "rng": self._rng.bit_generator.state,
            **{name: version(name) for name in self.libraries},
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from ``state``, by telling the library all of it once more.

        Raises:
            ValueError: It is that of another version of a library, which would go on otherwise.
        """
        for name in self.libraries:
            then, now = state.get(name), version(name)
            if then not in (None, now):  # states of before know one library alone
                raise ValueError(
                    f"expected {name} {then}, with which the run was begun, got {now}; install that version"
                )
        self._seed, self._first = int(state["seed"]), np.array(state["first"])
        ends = np.cumsum([int(count) for count in state["counts"]], dtype=np.intp)
        self._told = np.split(np.array(state["told"]), ends[:-1]) if len(ends) else []
        self._begin()
        for told in self._told:
            self.ask()
            self._learn(told)
        self._rng.bit_generator.state = state["rng"]

    @abstractmethod
    def ask(self) -> FloatArray:
        """Return genomes ``(n, size)``."""

    @abstractmethod
    def _begin(self) -> None:
        """Make the library's objects anew, of ``_seed`` and ``_first``."""

    @abstractmethod
    def _learn(self, told: FloatArray) -> None:
        """Tell the library ``(n, columns)``, of the genomes asked for."""

    def _beginning(self) -> FloatArray:
        """Return the genomes that a search begins with which was given none."""
        return random_genomes(self._space, self._population, self._rng)

    def _within(self, genomes: FloatArray) -> FloatArray:
        """Return ``genomes`` with each gene within its bounds."""
        within: FloatArray = np.clip(genomes, *self._space.bounds)
        return within

    def _tell(self, told: FloatArray) -> None:
        self._told.append(told)
        self._learn(told)

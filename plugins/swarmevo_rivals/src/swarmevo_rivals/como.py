# SPDX-License-Identifier: BSD-3-Clause
"""COMO-CMA-ES (Touré, Hansen et al., GECCO 2019) by comocma: several CMA-ES share a front of two objectives."""

from __future__ import annotations

import os
from typing import Any, Final

import numpy as np

from swarmevo.protocols import FloatArray, GenomeSpace, Problem
from swarmevo_rivals.blas import OneThread
from swarmevo_rivals.checks import require_count, require_positive
from swarmevo_rivals.genomes import Frame, random_genomes
from swarmevo_rivals.replayed import Replayed
from swarmevo_rivals.shares import Shares

LEAST_OFFSPRING: Final = 4
"""Of a kernel: of fewer no covariance is learnt."""


class COMOCMAES(Replayed):
    """COMO-CMA-ES: each of several CMA-ES ("kernels") makes its mean add more hypervolume to those of the others.

    A generation is asked of all kernels at once: their means, and the offspring of each. A kernel that has converged
    stays on the front, and another one begins from a random genome.

    Args:
        space: Layout of a genome.
        population: Genomes of a generation, at least five for each kernel.
        objectives: Number of costs, which must be two.
        rng: The only source of randomness.
        problem: Ranges of the objectives; the worse ends are the hypervolume's reference point.
        kernels: CMA-ES that search at a time. Nothing: one for each ten genomes of the population.
        sigma: Standard deviation of each gene at first.

    Raises:
        ValueError: An option is out of its range, or the objectives are not two.
    """

    libraries = ("comocma", "cma", "moarchiving")

    def __init__(
        self,
        space: GenomeSpace,
        population: int,
        objectives: int,
        rng: np.random.Generator,
        problem: Problem,
        *,
        kernels: int | None = None,
        sigma: float = 1.0,
    ) -> None:
        if objectives != 2:
            raise ValueError(f"objectives: expected two, for which the library is made, got {objectives}")
        kernels = max(1, population // 10) if kernels is None else kernels
        require_count("kernels", kernels)
        require_positive("sigma", sigma)
        if population < kernels * (1 + LEAST_OFFSPRING):
            raise ValueError(
                f"population: expected a number of at least {kernels * (1 + LEAST_OFFSPRING)} for {kernels} kernels, "
                f"got {population}"
            )
        self._kernels, self._sigma = kernels, float(sigma)
        self._shares, self._frame, self._one_thread = Shares(problem), Frame(space.bounds), OneThread()
        super().__init__(space, population, objectives, rng)

    def ask(self) -> FloatArray:
        """Return genomes ``(n, size)``: the kernels' means and their offspring."""
        with self._one_thread():
            self._asked = self._made.ask("all")
        return self._frame.genes(np.array(self._asked))

    def tell(self, genomes: FloatArray, costs: FloatArray) -> None:
        """Have each kernel learn from the costs ``(n, 2)`` of its offspring."""
        self._tell(self._shares(costs))

    def _begin(self) -> None:
        import comocma

        self._random = np.random.Generator(np.random.PCG64(self._seed))
        self._made = comocma.Sofomore(
            [self._kernel(genome) for genome in self._first[: self._kernels]],
            reference_point=[1.0, 1.0],
            opts={
                "archive": False,  # we keep every individual; the library would compute ever longer fractions
                "restart": lambda _: self._kernel(random_genomes(self._space, 1, self._random)[0]),
                "update_order": lambda index: index,  # the library's own order is of NumPy's global generator
                "verb_log": 0,
                "verb_disp": 0,
                "verb_filename": os.devnull,
            },
        )

    def _learn(self, told: FloatArray) -> None:
        with self._one_thread():
            self._made.tell(self._asked, told.tolist())

    def _kernel(self, genome: FloatArray) -> Any:
        import comocma

        offspring = (self._population - self._kernels) // self._kernels
        options = {
            "popsize": offspring,
            "randn": lambda *shape: self._random.standard_normal(shape),
            "seed": np.nan,
            "verbose": -9,
            "verb_log": 0,
            "verb_disp": 0,
        }
        (kernel,) = comocma.get_cmas([self._frame.points(genome).tolist()], self._sigma, options)
        return kernel

# SPDX-License-Identifier: BSD-3-Clause
"""CMA-MAE (Fontaine & Nikolaidis 2023, arXiv 2205.10752) by the library pyribs."""

from __future__ import annotations

import warnings
from typing import Any, Final

import numpy as np

from swarmevo.protocols import BehaviourMap, FloatArray, GenomeSpace, Problem
from swarmevo_rivals.blas import OneThread
from swarmevo_rivals.checks import require_count, require_positive
from swarmevo_rivals.genomes import Frame, middle
from swarmevo_rivals.map_elites import column_of, require_cells
from swarmevo_rivals.replayed import Replayed
from swarmevo_rivals.shares import Shares

LEAST_BATCH: Final = 4
"""Genomes of an emitter in a generation: of fewer no covariance is learnt."""

HOPELESS: Final = -1.0
"""Objective of an individual without descriptors. It is below the threshold of every cell, so it is on no map."""


class CMAMAE(Replayed):
    """CMA-MAE: several CMA-ES ("emitters") search for what is above the threshold of its cell of a map.

    The map is a grid over the descriptors' ranges. A cell's threshold begins at the worse end of the objective's range,
    and moves towards what comes to the cell by ``learning_rate``: 1 is CMA-ME, 0 is CMA-ES for the objective alone.

    Args:
        space: Layout of a genome.
        population: Genomes of a generation, at least four for each emitter; what does not divide by them is left out.
        objectives: Number of costs.
        rng: The only source of randomness.
        problem: Its descriptors are the axes of the map; at least one.
        cells: Along each axis.
        objective: Name of the one that is made better. Nothing: the first.
        emitters: CMA-ES that search at a time. Nothing: one for each ten genomes of the population.
        sigma: Standard deviation of each gene at first.
        learning_rate: Of the thresholds. The paper's 0.01 is for millions of evaluations; a cell that is searched for
            thousands is left too late.

    Raises:
        ValueError: An option is out of its range, or nothing is described.
    """

    libraries = ("ribs",)

    def __init__(
        self,
        space: GenomeSpace,
        population: int,
        objectives: int,
        rng: np.random.Generator,
        problem: Problem,
        *,
        cells: int = 10,
        objective: str | None = None,
        emitters: int | None = None,
        sigma: float = 1.0,
        learning_rate: float = 0.1,
    ) -> None:
        require_cells(cells, problem)
        emitters = max(1, population // 10) if emitters is None else emitters
        require_count("emitters", emitters)
        require_positive("sigma", sigma)
        if not isinstance(learning_rate, (int, float)) or not 0 <= learning_rate <= 1:
            raise ValueError(f"learning_rate: expected a number from 0 to 1, got {learning_rate!r}")
        if population < emitters * LEAST_BATCH:
            raise ValueError(
                f"population: expected a number of at least {emitters * LEAST_BATCH} for {emitters} emitters, got "
                f"{population}"
            )
        self._column = column_of(objective, problem)
        self._objective = problem.objectives[self._column].name
        self._cells, self._emitters, self._sigma = cells, emitters, float(sigma)
        self._rate, self._ranges = float(learning_rate), [one.range for one in problem.descriptors]
        self._shares, self._frame, self._one_thread = Shares(problem), Frame(space.bounds), OneThread()
        super().__init__(space, population, 1 + len(self._ranges), rng)

    def start_from(self, genomes: FloatArray) -> None:
        """Begin with every emitter about the mean of ``genomes`` ``(k, size)``."""
        super().start_from(genomes.mean(axis=0, keepdims=True))

    def ask(self) -> FloatArray:
        """Return genomes ``(n, size)``, as many of each emitter."""
        with self._one_thread():
            return self._frame.genes(self._made.ask())

    def tell(self, genomes: FloatArray, costs: FloatArray, descriptors: FloatArray) -> None:
        """Learn from the costs ``(n, objectives)`` and descriptors ``(n, d)``; NaN: its episodes failed."""
        value = 1 - self._shares(costs)[:, self._column]
        failed = np.isnan(descriptors.sum(axis=1))
        value[failed] = HOPELESS
        low, high = np.array(self._ranges).T
        described = np.where(failed[:, np.newaxis], low, np.clip(descriptors, low, high))
        self._tell(np.column_stack([value, described]))

    def behaviour_map(self) -> BehaviourMap:
        """Return the best that ever came to each cell, as pyribs' result archive has it.

        The map of the search itself may have a worse one there: one that was above the cell's threshold.
        """
        kept = self._best.data(["solution", "index"])
        places = np.asarray(self._best.int_to_grid_index(kept["index"]), dtype=np.intp)
        genomes = self._frame.genes(kept["solution"])
        return BehaviourMap((self._cells,) * len(self._ranges), self._objective, places, genomes)

    def _beginning(self) -> FloatArray:
        return middle(self._space)[np.newaxis]

    def _begin(self) -> None:
        try:
            from ribs.archives import GridArchive
            from ribs.emitters import EvolutionStrategyEmitter
            from ribs.schedulers import Scheduler
        except ImportError as error:
            raise ImportError(f"cma_mae needs pyribs: pip install 'swarmevo-rivals[ribs]' ({error})") from error

        start = self._frame.points(self._first[0])

        class Map(GridArchive):  # type: ignore[misc, unused-ignore]  # without pyribs it has no type
            """Emitters that restart while nobody is on it begin where they began; the library's refuses them."""

            def sample_elites(self, n: Any, replace: bool = True) -> Any:
                if self.empty:
                    return {"solution": np.tile(start, (n, 1))}
                return super().sample_elites(n, replace)

        grid: dict[str, Any] = {
            "solution_dim": self._space.size,
            "dims": [self._cells] * len(self._ranges),
            "ranges": self._ranges,
            "threshold_min": 0.0,
            "seed": self._seed,
        }
        archive = Map(**grid, learning_rate=self._rate)
        batch = self._population // self._emitters
        emitters = [
            EvolutionStrategyEmitter(
                archive,
                x0=start,
                sigma0=self._sigma,
                ranker="imp",
                selection_rule="mu",
                restart_rule="basic",
                batch_size=batch,
                seed=self._seed + 1 + number,
            )
            for number in range(self._emitters)
        ]
        self._best = GridArchive(**grid, learning_rate=1.0)
        self._made = Scheduler(archive, emitters, result_archive=self._best)

    def _learn(self, told: FloatArray) -> None:
        with self._one_thread(), warnings.catch_warnings():
            warnings.filterwarnings("ignore", ".*archive` was empty before adding solutions")  # as often is at first
            self._made.tell(told[:, 0], told[:, 1:])

# SPDX-License-Identifier: BSD-3-Clause
"""What a run folder tells of its runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarmevo.evolution.results import Results
from swarmevo.protocols import FloatArray


@dataclass(frozen=True)
class Summary:
    """One generation in short, as hypervolume and cost need it."""

    trial: int
    number: int
    """From 0."""
    genomes: NDArray[np.int64]
    """``(n,)``: id of each individual's genome."""
    sums: FloatArray
    """``(n, worlds, m)``: of the objectives in the generation's episodes, each in its own direction."""
    counts: NDArray[np.int64]
    """``(n, worlds)``: episodes behind them."""
    episodes: int
    ode_messages: int
    unsolved_steps: int
    seconds: float
    """That the evaluation took."""

    @property
    def means(self) -> FloatArray:
        """``(n, worlds, m)``: of the objectives in each world."""
        means: FloatArray = self.sums / self.counts[..., np.newaxis]
        return means


@dataclass(frozen=True)
class Individuals:
    """Genomes, judged by all the episodes that they ran in one trial. First axis: k genomes."""

    genome: NDArray[np.int64]
    """``(k,)``: id of the genome."""
    trial: NDArray[np.int64]
    """``(k,)``"""
    first_generation: NDArray[np.int64]
    """``(k,)``: in which it appeared."""
    last_generation: NDArray[np.int64]
    """``(k,)``: in which it was last evaluated."""
    episodes: NDArray[np.int64]
    """``(k,)``: number of episodes behind the means, over all generations and repeats."""
    objectives: FloatArray
    """``(k, m)``: mean over those episodes in each world, then over the worlds, each in its own direction."""
    descriptors: FloatArray
    """``(k, d)``: likewise, of those of these episodes that did not fail; NaN: all did."""
    homing_rate: FloatArray
    """``(k,)``: share of robots that came within the emitter's range, over those episodes."""
    homing_time: FloatArray
    """``(k,)``: mean over the robots that did [s]; NaN: none did."""
    push_rate: FloatArray
    """``(k,)``: share of those episodes in which the box touched the target wall."""
    push_time: FloatArray
    """``(k,)``: mean over the episodes in which it did [s]; NaN: in none."""
    success_rates: FloatArray
    """``(k, m)``: share of those episodes that were a success in each objective; 0 where it says nothing of success."""


@dataclass(frozen=True)
class Lives:
    """The episodes of one genome in one trial: k, those of the last generation first."""

    generation: NDArray[np.int64]
    """``(k,)``"""
    session: NDArray[np.int64]
    """``(k,)``: that ran each."""
    episodes: Results
    """k, within a generation by repeat."""


@dataclass(frozen=True)
class Totals:
    """What a run, or one of its trials, has cost so far."""

    generations: int
    individuals: int
    """Evaluated, one for each generation that a genome was in."""
    genomes: int
    """Distinct."""
    episodes: int
    ode_messages: int
    unsolved_steps: int
    steps: int
    """Control steps of all episodes."""
    seconds: float
    """That the evaluations took."""
    faults: int
    """Episodes that failed."""

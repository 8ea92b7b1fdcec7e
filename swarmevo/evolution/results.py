# SPDX-License-Identifier: BSD-3-Clause
"""What episodes gave, wherever it is: on its way from a job, in an evaluation, in the run folder."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarmevo.protocols import FloatArray


@dataclass(frozen=True, kw_only=True)
class Results:
    """Results of episodes. Their axes ``...`` are individuals and repeats ``(n, r)``, or just episodes ``(k,)``."""

    objectives: FloatArray
    """``(..., m)``, as measured, each in its own direction."""
    hash: NDArray[np.uint64]
    """``(...)``: of each episode's trajectory."""
    push_time: FloatArray
    """``(...)`` [s]; NaN: never."""
    homing_time: FloatArray
    """``(..., robots)`` [s]; NaN: never."""
    ode_messages: NDArray[np.uint32]
    """``(...)``: warnings of the physics library."""
    unsolved_steps: NDArray[np.uint32]
    """``(...)``: time steps that it could not solve."""

    def results(self) -> dict[str, NDArray[Any]]:
        """Return the results alone, by name."""
        return {field.name: getattr(self, field.name) for field in fields(Results)}

    def reshaped(self, *shape: int) -> dict[str, NDArray[Any]]:
        """Return the results, by name, with axes of another ``shape`` in the place of ``...``."""
        axes = self.hash.ndim
        return {name: array.reshape(*shape, *array.shape[axes:]) for name, array in self.results().items()}

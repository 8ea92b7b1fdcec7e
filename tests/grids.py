# SPDX-License-Identifier: BSD-3-Clause
"""Results of made-up episodes, for tests of what keeps and judges them."""

from __future__ import annotations

from dataclasses import replace as replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarmevo.evolution.results import COLUMNS, Results


def results(seconds: float = 0.0, **columns: NDArray[Any]) -> Results:
    """Return results of all episodes of a generation, of columns ``(individuals, repeats, ...)``.

    They are in one world, of as many robots as there are homing times, unless ``world`` and ``robots`` say otherwise,
    and without descriptors, unless there is a ``descriptor``.
    """
    shape = columns["hash"].shape
    whole = {"world": 0, "robots": columns["homing_time"].shape[-1], "steps": 10}
    columns = {"descriptor": np.empty((*shape, 0)), **columns}
    columns = {**{name: np.full(shape, value, dtype=np.uint32) for name, value in whole.items()}, **columns}
    assert set(columns) == {column.name for column in COLUMNS}
    individual, repeat = np.indices(shape).reshape(2, -1)
    flat = {name: values.reshape(len(repeat), *values.shape[2:]) for name, values in columns.items()}
    return Results(individual=individual, repeat=repeat, values=flat, faults=("",) * len(repeat), seconds=seconds)


def scored(objective: NDArray[np.float64]) -> Results:
    """Return results of episodes of one robot that left nothing but objectives ``(individuals, repeats, m)``."""
    shape = objective.shape[:2]
    none = {name: np.zeros(shape, dtype=np.uint32) for name in ("ode_messages", "unsolved_steps")}
    times = {"push_time": np.full(shape, np.nan), "homing_time": np.full((*shape, 1), np.nan)}
    return results(objective=objective, hash=np.zeros(shape, dtype=np.uint64), **none, **times)

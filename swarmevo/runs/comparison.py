# SPDX-License-Identifier: BSD-3-Clause
"""Whether an episode that was simulated anew is the stored one, bit by bit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from swarmevo.evolution.results import COLUMNS, Axis, Results
from swarmevo.protocols import BoolArray, Descriptor, Objective
from swarmevo.runs.folder import RunFolder


def differing(run: RunFolder, stored: Results, i: int, again: Results, j: int) -> Iterator[str]:
    """Yield the names of what is not the same in episode i of ``stored`` and in episode j of ``again``, of a run."""
    measured: dict[Axis, Sequence[Objective | Descriptor]] = {
        "objectives": run.objectives,
        "descriptors": run.descriptors,
    }
    for column in COLUMNS:
        same = np.atleast_1d(_same(stored[column.name][i], again[column.name][j]))
        if column.axis in measured:
            yield from (one.name for one, equal in zip(measured[column.axis], same, strict=True) if not equal)
        elif not same.all():
            yield "trajectory" if column.name == "hash" else column.name
    if bool(stored.faults[i]) != bool(again.faults[j]):
        yield "fault"


def _same(one: Any, other: Any) -> BoolArray:
    same: BoolArray = (one == other) | ((one != one) & (other != other))  # NaN is NaN
    return same

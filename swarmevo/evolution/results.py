# SPDX-License-Identifier: BSD-3-Clause
"""What episodes leave: one table of columns, and one container for their values, wherever they are.

The run folder's tables, its queries, the kept episodes of a generation in work, exports, verification and the page
``docs/episodes.md`` follow from :data:`COLUMNS`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from swarmevo.protocols import BoolArray, FloatArray, IntArray

Place: TypeAlias = tuple[int, int]
"""Of an episode in its generation: individual and repeat, from 0."""
Axis = Literal["", "objectives", "descriptors", "robots"]


class Sizes(NamedTuple):
    """How long the axes of columns are in a run."""

    objectives: int
    robots: int
    """In the largest team of any world."""
    descriptors: int = 0


@dataclass(frozen=True)
class Column:
    """Something that every episode leaves: a number, or one for each objective, descriptor or robot."""

    name: str
    """As :class:`swarmevo.simulation.Episodes` has it; but for what is judged, ``objective`` and ``descriptor``, and
    ``world``."""
    dtype: type[np.generic]
    axis: Axis
    meaning: str
    """Of a cell, with its unit."""
    failed: float
    """Of an episode that failed; of objectives their worst, of its world and robots what they are. NaN: the cell may be
    empty."""

    def cells(self, sizes: Sizes) -> list[str]:
        """Return the names of an episode's cells in this column."""
        if not self.axis:
            return [self.name]
        return [f"{self.name}_{i}" for i in range(getattr(sizes, self.axis))]

    @property
    def may_be_empty(self) -> bool:
        """Whether NaN stands for nothing."""
        return self.failed != self.failed


COLUMNS: Final = (
    Column("world", np.uint32, "", "number in the configuration's `worlds`, from 0", 0),
    Column("robots", np.uint32, "", "in the team", 0),
    Column("objective", np.float64, "objectives", "as measured in this episode, in its own direction", 0.0),
    Column("descriptor", np.float64, "descriptors", "as measured in this episode; empty: it failed", np.nan),
    Column("push_time", np.float64, "", "first touch of box and target wall [s]; empty: never", np.nan),
    Column(
        "homing_time",
        np.float64,
        "robots",
        "robot first within the emitter's range [s]; empty: never, or no robot",
        np.nan,
    ),
    Column("steps", np.uint32, "", "control steps done", 0),
    Column("ode_messages", np.uint32, "", "warnings of the physics library", 0),
    Column("unsolved_steps", np.uint32, "", "time steps that it could not solve", 0),
    Column("hash", np.uint64, "", "of the trajectory, 64 bits", 0),
)
"""What is stored of an episode. Another column is a line here and, where the simulator does not tell it yet, one there;
and the next ``SCHEMA_VERSION`` and ``TESTS_VERSION``."""


@dataclass(frozen=True, kw_only=True)
class Results:
    """What k episodes of one generation left."""

    individual: IntArray
    """``(k,)``: place in the generation, from 0."""
    repeat: IntArray
    """``(k,)``: from 0."""
    values: Mapping[str, NDArray[Any]]
    """For each of :data:`COLUMNS` ``(k,)``, ``(k, objectives)``, ``(k, descriptors)`` or ``(k, robots)``."""
    faults: tuple[str, ...]
    """``k``: why each failed; "" where it did not. It has the worst objectives, no descriptors and the hash 0."""
    seconds: float
    """That they took."""

    def __len__(self) -> int:
        return len(self.individual)

    def __getitem__(self, column: str) -> NDArray[Any]:
        return self.values[column]

    def grid(self, column: str) -> NDArray[Any]:
        """Return a column of all episodes of a generation as ``(individuals, repeats, ...)``; all have as many."""
        values = self.values[column]
        return values.reshape(-1, self.repeats, *values.shape[1:])

    @property
    def repeats(self) -> int:
        """Of each individual, where all episodes of a generation are there."""
        return int(self.repeat.max(initial=0)) + 1

    @property
    def failures(self) -> dict[Place, str]:
        """Why episodes failed, by individual and repeat."""
        return {place: fault for place, fault in zip(self._places(), self.faults, strict=True) if fault}

    def places(self) -> set[Place]:
        """Return which episodes these are."""
        return set(self._places())

    def are_of(self, places: Collection[Place]) -> BoolArray:
        """Return ``(k,)``: which are among ``places``."""
        return np.array([place in places for place in self._places()], dtype=np.bool_)

    def _places(self) -> list[Place]:
        return list(zip(self.individual.tolist(), self.repeat.tolist(), strict=True))

    def rows(self) -> Iterator[tuple[Any, ...]]:
        """Yield individual, repeat and cells of each episode, in the order of :data:`COLUMNS`; None: an empty cell."""
        columns = [self.individual.tolist(), self.repeat.tolist()]
        for column in COLUMNS:
            values = self.values[column.name]
            cells = values.T if column.axis else [values]
            columns += [[None if value != value else value for value in cell.tolist()] for cell in cells]
        return zip(*columns, strict=True)

    def only(self, wanted: BoolArray) -> Results:
        """Return the episodes where ``wanted`` ``(k,)`` is true."""
        return Results(
            individual=self.individual[wanted],
            repeat=self.repeat[wanted],
            values={name: values[wanted] for name, values in self.values.items()},
            faults=tuple(fault for fault, want in zip(self.faults, wanted, strict=True) if want),
            seconds=self.seconds,
        )


@dataclass(frozen=True)
class Generation:
    """One generation as evaluated: n individuals."""

    genomes: FloatArray
    """``(n, size)``"""
    episodes: Results
    """All of them, by individual and repeat."""


def joined(results: Sequence[Results]) -> Results:
    """Return one or more results as one, by individual and repeat."""
    individual = np.concatenate([result.individual for result in results])
    repeat = np.concatenate([result.repeat for result in results])
    order = np.lexsort((repeat, individual))
    faults = [fault for result in results for fault in result.faults]
    return Results(
        individual=individual[order],
        repeat=repeat[order],
        values={name: np.concatenate([result[name] for result in results])[order] for name in results[0].values},
        faults=tuple(faults[i] for i in order),
        seconds=sum(result.seconds for result in results),
    )

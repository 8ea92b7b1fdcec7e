# SPDX-License-Identifier: BSD-3-Clause
"""What plugins return, checked: by the host, and by the tests for authors of plugins.

What is wrong is a ``ValueError`` in words that follow the plugin's name: "expected ..., got ...".
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from swarmevo.protocols import (
    BehaviourMap,
    Block,
    BoolArray,
    Descriptor,
    FloatArray,
    GenomeSpace,
    Objective,
    Problem,
)

LARGEST: Final = 1e50
"""Of a range: sums over episodes and hypervolumes of several objectives stay finite."""
MOST_CELLS: Final = 1_000_000
"""Of a map of behaviours."""
ROUNDING: Final = 1e-9
"""Of the width of a range: so far a value may lie outside of it."""


def numbers(values: object, shape: tuple[int, ...]) -> FloatArray:
    """Return ``values`` as finite float64 of a shape; lists and other real dtypes are converted.

    Raises:
        ValueError: They are complex, masked, text or objects, have another shape, or are not finite in float64.
    """
    if isinstance(values, np.ma.MaskedArray):
        raise ValueError("expected an array of numbers, got a masked array; fill it")
    try:
        array = np.asarray(values)
    except Exception as error:  # rows of different lengths, or whatever a stranger's ``__array__`` raises
        raise ValueError(f"expected an array of numbers, got {type(values).__name__}") from error
    if array.dtype.kind not in "biuf":
        inside = f" of {array.dtype.type.__name__}" if array.ndim else ""
        raise ValueError(f"expected an array of numbers, got {type(values).__name__}{inside}")
    if array.shape != shape:
        raise ValueError(f"expected an array of shape {shape}, got {array.shape}")
    with np.errstate(over="ignore"):  # a long double may be too large
        found: FloatArray = array.astype(np.float64, copy=False)
    if not (finite := np.isfinite(found)).all():
        place = tuple(int(i) for i in np.argwhere(~finite)[0])
        raise ValueError(f"expected finite numbers, got {found[place]} at {list(place)}")
    return found


def flags(values: object, shape: tuple[int, ...]) -> BoolArray:
    """Return booleans as an array of a shape.

    Raises:
        ValueError: They are something else.
    """
    found = numbers(values, shape)
    if not ((found == 0) | (found == 1)).all():
        raise ValueError("expected True or False of each, got other numbers")
    return found.astype(np.bool_)


def objective(given: object) -> Objective:
    """Return an objective with a name of plain text and a range of two floats, whatever real numbers it was given.

    Raises:
        ValueError: It is no objective, or its name, direction, range or what it is of cannot be used.
    """
    if not isinstance(given, Objective):
        raise ValueError(f"expected an Objective, got {type(given).__name__}")
    name, direction = _name(given.name), given.direction
    if not isinstance(direction, str) or direction not in ("maximise", "minimise"):
        raise ValueError(f"{name}: expected the direction maximise or minimise, got {direction!r}")
    if not isinstance(given.of, str) or given.of not in ("episode", "genome"):
        raise ValueError(f"{name}: expected it to be of episode or genome, got {given.of!r}")
    range_ = _range(name, given.range)
    return Objective(
        name,
        "maximise" if direction == "maximise" else "minimise",
        range_,
        of="genome" if given.of == "genome" else "episode",
        success=None if given.success is None else _success(name, given.success, range_),
    )


def descriptor(given: object) -> Descriptor:
    """Return a descriptor with a name of plain text and a range of two floats, whatever real numbers it was given.

    Raises:
        ValueError: It is no descriptor, or its name or range cannot be used.
    """
    if not isinstance(given, Descriptor):
        raise ValueError(f"expected a Descriptor, got {type(given).__name__}")
    name = _name(given.name)
    return Descriptor(name, _range(name, given.range))


def behaviour_map(given: object, space: GenomeSpace, problem: Problem) -> BehaviourMap:
    """Return a copy of a map of behaviours with elites in different cells of it.

    Raises:
        ValueError: It is no map, or its grid, its objective, a cell or a genome is not of this problem.
    """
    if not isinstance(given, BehaviourMap):
        raise ValueError(f"expected a BehaviourMap, got {type(given).__name__}")
    cells, axes = given.cells, len(problem.descriptors)
    is_grid = isinstance(cells, tuple) and len(cells) == axes and all(type(n) is int and n > 0 for n in cells)
    if not is_grid or math.prod(cells) > MOST_CELLS:
        raise ValueError(
            f"expected as cells a number for each of {axes} descriptors, at least 1 and up to {MOST_CELLS} in all, got "
            f"{cells!r:.60}"
        )
    names = [one.name for one in problem.objectives]
    if not isinstance(given.objective, str) or given.objective not in names:
        raise ValueError(f"expected as objective one of {', '.join(names)}, got {given.objective!r}")
    genomes = numbers(given.genomes, (*np.shape(given.genomes)[:1], space.size))
    check_bounds(genomes, space)
    places = numbers(given.places, (len(genomes), axes))
    is_cell = (places == np.floor(places)) & (places >= 0) & (places < cells)
    if not is_cell.all() or len(np.unique(places, axis=0)) < len(places):
        raise ValueError(f"expected as places different cells of {cells}, each from 0, got {places.tolist()!r:.60}")
    return BehaviourMap(cells, str(given.objective), places.astype(np.intp), genomes.copy())


def _name(given: object) -> str:
    if not isinstance(given, str) or not given.strip() or not given.isprintable():
        raise ValueError(f"expected as name text that can be printed, got {given!r}")
    return str(given)


def _range(name: str, given: object) -> tuple[float, float]:
    try:
        low, high = numbers(given, (2,)).tolist()
    except ValueError:
        low = high = math.nan
    if not -LARGEST <= low < high <= LARGEST:
        raise ValueError(
            f"{name}: expected as range two finite numbers, low and high, within {LARGEST:g}, got {given!r}"
        )
    return low, high


def _success(name: str, given: object, range_: tuple[float, float]) -> float:
    try:
        success = float(numbers(given, ()))
    except ValueError:
        success = math.nan
    low, high = range_
    if not low <= success <= high:
        raise ValueError(f"{name}: expected as success a number in its range from {low:g} to {high:g}, got {given!r}")
    return success


def check_range(values: FloatArray, measured: Sequence[Objective | Descriptor]) -> None:
    """Refuse ``values`` ``(n, m)`` outside of the ranges of m objectives or descriptors.

    Raises:
        ValueError: One is.
    """
    for one, column in zip(measured, values.T, strict=True):
        low, high = one.range
        slack = ROUNDING * (high - low)
        outside = column[(column < low - slack) | (column > high + slack)]
        if len(outside):
            raise ValueError(
                f"expected {one.name} in its range from {low:g} to {high:g}, got {outside[0]:g}; the range is declared "
                "by the plugin, often by its options"
            )


def space(given: object) -> GenomeSpace:
    """Return the layout of a genome.

    Raises:
        ValueError: It is none, or its blocks cannot be used.
    """
    if not isinstance(given, GenomeSpace):
        raise ValueError(f"expected a GenomeSpace, got {type(given).__name__}")
    blocks: object = given.blocks
    if not isinstance(blocks, Iterable) or not all(isinstance(block, Block) for block in blocks):
        raise ValueError(f"expected blocks, a tuple of Block, got {blocks!r}")
    for block in given.blocks:
        _check_block(block)
    names = [block.name for block in given.blocks]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"expected blocks of different names, got {name!r} twice")
    if given.size < 1:
        raise ValueError("expected at least one gene, got none")
    return given


def _check_block(block: Block) -> None:
    shape, axis = block.shape, block.unit_axis
    if not isinstance(block.name, str):
        raise ValueError(f"block {block.name!r}: expected text as name")
    if not isinstance(shape, tuple) or not all(isinstance(n, int | np.integer) and n >= 0 for n in shape):
        raise ValueError(f"block {block.name}: expected as shape a tuple of lengths, got {shape!r}")
    if not isinstance(axis, int | np.integer) or not 0 <= axis < len(shape):
        raise ValueError(f"block {block.name}: expected a unit_axis of the shape {shape}, got {axis!r}")
    if block.kind not in ("real", "switch"):
        raise ValueError(f"block {block.name}: expected the kind real or switch, got {block.kind!r}")
    if block.bounds is not None and (block.kind == "switch" or not _are_bounds(block.bounds)):
        raise ValueError(
            f"block {block.name}: expected as bounds of real genes two numbers, low and high, or None, got "
            f"{block.bounds!r}" + " of switches" * (block.kind == "switch")
        )


def _are_bounds(given: object) -> bool:
    if not isinstance(given, tuple) or len(given) != 2:
        return False
    return all(isinstance(end, int | float | np.number) for end in given) and bool(given[0] < given[1])


def check_bounds(genomes: FloatArray, space: GenomeSpace) -> None:
    """Refuse genomes ``(n, size)`` with a gene out of its bounds.

    Raises:
        ValueError: There is one.
    """
    low, high = space.bounds
    outside = np.argwhere((genomes < low) | (genomes > high))
    if len(outside):
        row, gene = outside[0]
        raise ValueError(
            f"expected genes within the controller's bounds, got {genomes[row, gene]:g} in genome {row}, gene {gene}, "
            f"which is from {low[gene]:g} to {high[gene]:g}"
        )

# SPDX-License-Identifier: BSD-3-Clause
"""A map of behaviours: the best of each kind, over what a fitness says that behaviours are like."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from swarmevo.analysis.elites import elites
from swarmevo.errors import SwarmevoError
from swarmevo.protocols import FloatArray, IntArray, Objective
from swarmevo.runs.store import Store
from swarmevo.views import text
from swarmevo.views.figures import style
from swarmevo.views.figures.source import Run, opened
from swarmevo.views.figures.style import Picture

CELLS: Final = 20
"""Along each axis, where nobody says otherwise."""


def behaviour_map(run: Run, cells: int | None = None, width: float = style.COLUMN) -> Picture:
    """Return the best of each kind of behaviour over the first two descriptors (Mouret & Clune 2015).

    An individual counts with its means over all its episodes in a trial. All trials share the map.

    Args:
        run: With at least two descriptors.
        cells: Along each axis, over the descriptor's range: a map of all individuals, by the first objective. None: the
            map that the run's optimiser keeps, with its cells and its objective; where it keeps none, or cannot be
            asked here, :data:`CELLS` cells of all individuals.
        width: Of the figure [inches].

    Raises:
        ValueError: The run has fewer descriptors, or there are fewer cells than one.
    """
    with opened(run) as store, style.picture(width, 0.81 * width) as picture:
        if len(store.descriptors) < 2:
            raise ValueError(f"behaviour_map: expected a run with two descriptors, got {len(store.descriptors)}")
        if cells is not None and cells < 1:
            raise ValueError(f"behaviour_map: expected cells of at least 1, got {cells}")
        shown = _of_optimiser(store) if cells is None else _of_everybody(store, cells)
        across = store.descriptors[:2]
        axes = picture.add_subplot()
        edges = [
            np.linspace(*one.range, number + 1) for one, number in zip(across, shown.best.shape[::-1], strict=True)
        ]
        mesh = axes.pcolormesh(*edges, np.ma.masked_invalid(shown.best), cmap="viridis")
        axes.set(xlabel=text.words(across[0].name), ylabel=text.words(across[1].name))
        axes.grid(visible=False)
        bar = picture.colorbar(mesh, ax=axes, shrink=0.85, label=text.label(shown.objective))
        bar.outline.set_visible(False)
        filled = int(np.isfinite(shown.best).sum())
        style.note(axes, f"{shown.whose}: {filled} of {text.count(shown.best.size, 'cell')} filled")
        return picture


class _Shown(NamedTuple):
    """What a map shows."""

    best: FloatArray
    """``(rows, columns)``: NaN: nobody behaved so."""
    objective: Objective
    whose: str


def _of_optimiser(store: Store) -> _Shown:
    """Return the optimiser's map; where there is none, that of all individuals."""
    (name,) = store.config.optimiser
    try:
        kept = elites(store)
    except SwarmevoError:  # its plugin is not installed here, say
        return _of_everybody(store, CELLS, f"no map of {name} here, all individuals")
    if kept is None:
        return _of_everybody(store, CELLS)
    places, shape = kept.places[:, 1::-1], kept.cells[1::-1]
    return _Shown(_best(shape, places, kept.values, kept.objective), kept.objective, f"map of {name}")


def _of_everybody(store: Store, cells: int, whose: str = "all individuals") -> _Shown:
    found, objective = store.individuals(), store.objectives[0]
    known = np.isfinite(found.descriptors[:, :2]).all(axis=1)
    low, high = np.array([one.range for one in store.descriptors[:2]]).T
    share = (found.descriptors[known, :2] - low) / (high - low)
    places = np.clip((share * cells).astype(np.intp), 0, cells - 1)[:, ::-1]
    best = _best((cells, cells), places, found.objectives[known, 0], objective)
    return _Shown(best, objective, whose)


def _best(shape: tuple[int, ...], places: IntArray, values: FloatArray, objective: Objective) -> FloatArray:
    """Return the best of the values ``(k,)`` at each of the places ``(k, 2)``, NaN where there is none."""
    best = np.full(shape, np.nan)
    (np.fmax if objective.is_maximised else np.fmin).at(best, tuple(places.T), values)
    return best

# SPDX-License-Identifier: BSD-3-Clause
"""A map of behaviours: the best of each kind, over what a fitness says that behaviours are like."""

from __future__ import annotations

from typing import Final

import numpy as np

from swarmevo.views import text
from swarmevo.views.figures import style
from swarmevo.views.figures.source import Run, opened
from swarmevo.views.figures.style import Picture

CELLS: Final = 20
"""Along each axis, where nobody says otherwise."""


def behaviour_map(run: Run, cells: int = CELLS, width: float = style.COLUMN) -> Picture:
    """Return the best first objective in each cell of the first two descriptors (Mouret & Clune 2015).

    An individual counts with its means over all its episodes in a trial. All trials share the map.

    Args:
        run: With at least two descriptors.
        cells: Along each axis, over the descriptor's range.
        width: Of the figure [inches].

    Raises:
        ValueError: The run has fewer descriptors.
    """
    with opened(run) as store, style.picture(width, 0.81 * width) as picture:
        if len(store.descriptors) < 2:
            raise ValueError(f"behaviour_map: expected a run with two descriptors, got {len(store.descriptors)}")
        found, objective, across = store.individuals(), store.objectives[0], store.descriptors[:2]
        known = np.isfinite(found.descriptors[:, :2]).all(axis=1)
        low, high = np.array([one.range for one in across]).T
        share = (found.descriptors[known, :2] - low) / (high - low)
        column, row = np.clip((share * cells).astype(np.intp), 0, cells - 1).T
        best = np.full((cells, cells), np.nan)
        better = np.fmax if objective.is_maximised else np.fmin
        better.at(best, (row, column), found.objectives[known, 0])
        axes = picture.add_subplot()
        edges = [np.linspace(*one.range, cells + 1) for one in across]
        mesh = axes.pcolormesh(*edges, np.ma.masked_invalid(best), cmap="viridis")
        axes.set(xlabel=text.words(across[0].name), ylabel=text.words(across[1].name))
        axes.grid(visible=False)
        bar = picture.colorbar(mesh, ax=axes, shrink=0.85, label=text.label(objective))
        bar.outline.set_visible(False)
        filled = int(np.isfinite(best).sum())
        style.note(axes, f"{filled} of {text.count(cells * cells, 'cell')} filled")
        return picture

# SPDX-License-Identifier: BSD-3-Clause
"""The paper's Figs. 3 to 5 of a run, as one plate across a page."""

from __future__ import annotations

from typing import Any, Final

import matplotlib

from swarmevo.analysis import assessment
from swarmevo.analysis.recording import Recording
from swarmevo.runs.store import Store
from swarmevo.views.figures import style
from swarmevo.views.figures.behaviour import draw_paths
from swarmevo.views.figures.course import best_trial, draw_evolution
from swarmevo.views.figures.objectives import draw_fronts
from swarmevo.views.figures.source import Run, opened
from swarmevo.views.figures.style import Picture

_SMALL: Final[Any] = {"font.size": 7, "legend.fontsize": 6.5}  # for three side by side


def paper(run: Run, width: float = style.PAGE) -> Picture:
    """Return a plate: a trial's individuals over the generations, the fronts, paths of the most successful.

    Args:
        run: With at least two objectives.
        width: Of the figure [inches].

    Raises:
        EvaluationError: A test of the most successful failed.
        StoreError: There is no generation yet.
        ValueError: The run has one objective only.
    """
    with opened(run) as store:
        return plate(store, assessment.watch(store), width)


def plate(store: Store, seen: Recording, width: float = style.PAGE) -> Picture:
    """Return what :func:`paper` does, of tests that are recorded already."""
    if len(store.objectives) < 2:
        raise ValueError("paper: expected a run with at least two objectives, got 1")
    with style.picture(width, 0.45 * width) as picture, matplotlib.rc_context(_SMALL):
        evolution, fronts, paths = picture.subplots(1, 3, width_ratios=[1.15, 1, 1])
        draw_evolution(evolution, store, best_trial(store))
        draw_fronts(fronts, store, width / 3, below=True)
        draw_paths(paths, seen, seen.best, width / 3)
        for axes, letter in zip((evolution, fronts, paths), "abc", strict=True):
            place: dict[str, Any] = {"xytext": (-26, 6), "textcoords": "offset points"}
            axes.annotate(letter, (0, 1), xycoords="axes fraction", fontsize=10, fontweight="bold", **place)
        return picture

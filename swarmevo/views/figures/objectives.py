# SPDX-License-Identifier: BSD-3-Clause
"""Fronts of trials and of all of them (the paper's Fig. 4), and attainment surfaces, in the plane of two objectives."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

import moocore
import numpy as np

from swarmevo.analysis import fronts as pareto
from swarmevo.protocols import FloatArray, Objective
from swarmevo.runs.store import Store
from swarmevo.views import text
from swarmevo.views.figures import style
from swarmevo.views.figures.source import Run, opened
from swarmevo.views.figures.style import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ROOM = 0.06
"""Of the points' extent, around them."""


def fronts(run: Run, width: float = style.COLUMN) -> Picture:
    """Return the front of each trial and, in black, that of all (the paper's Fig. 4).

    Args:
        run: With at least one generation.
        width: Of the figure [inches].
    """
    with opened(run) as store, style.picture(width, entries=len(store.trials()) + 1) as picture:
        draw_fronts(picture.add_subplot(), store, width)
        return picture


def draw_fronts(axes: Axes, store: Store, width: float, below: bool = False) -> None:
    """Draw what :func:`fronts` shows into axes of a width [inches], the legend below if that is wanted."""
    shown = [points_of(store, pareto.front(store, trial)) for trial in store.trials()]
    for trial, points in zip(store.trials(), shown, strict=True):
        axes.plot(*points.T, **_marker(trial), markersize=5, alpha=0.85, label=f"trial {trial}", zorder=3)
    front = points_of(store, pareto.front(store))
    _plane_axes(axes, store.objectives, np.concatenate(shown))
    if len(store.objectives) == 2:
        staircase(axes, store.objectives, front, color=style.INK, linewidth=1.6, zorder=2, label="global front")
    axes.plot(*front.T, "o", markersize=9, markerfacecolor="none", markeredgecolor=style.INK, zorder=4)
    _not_drawn(axes, store.objectives, width)
    style.legend(axes, len(store.trials()) + 1, width, below)


def fronts_of_runs(runs: Mapping[str, Run], width: float = style.PAGE) -> Picture:
    """Return the global fronts of several runs of the same objectives, one over the other.

    Args:
        runs: By the names that the legend gives them.
        width: Of the figure [inches].

    Raises:
        ValueError: Their objectives differ.
    """
    with all_opened(runs) as stores, style.picture(width, 0.5 * width, len(runs)) as picture:
        axes, objectives = picture.add_subplot(), same_objectives("fronts_of_runs", stores)
        shown = [points_of(store, pareto.front(store)) for store in stores.values()]
        if len(objectives) == 1:
            shown = [np.column_stack([np.full(len(points), i), points[:, 1]]) for i, points in enumerate(shown)]
        _plane_axes(axes, objectives, np.concatenate(shown))
        if len(objectives) == 1:
            axes.set_xticks(range(len(stores)), list(stores))
            axes.set_xlabel("")
        for i, (name, points) in enumerate(zip(stores, shown, strict=True)):
            look = _marker(i)
            if len(objectives) == 2:
                line = style.STYLES[i % len(style.STYLES)]
                staircase(axes, objectives, points, color=look["color"], linestyle=line, linewidth=1.6)
            axes.plot(*points.T, **look, markersize=5, label=name, zorder=3)
        _not_drawn(axes, objectives, width)
        style.legend(axes, len(runs), width)
        return picture


def attainment(run: Run, width: float = style.COLUMN) -> Picture:
    """Return which trade-offs any, half and all of the trials attained.

    Args:
        run: Of two objectives.
        width: Of the figure [inches].

    Raises:
        ValueError: The run has not two objectives.
    """
    with opened(run) as store, style.picture(width) as picture:
        objectives, trials = store.objectives, store.trials()
        if len(objectives) != 2:
            raise ValueError(f"attainment: expected a run with two objectives, got {len(objectives)}")
        sets = [points_of(store, pareto.front(store, trial)) for trial in trials]
        axes = picture.add_subplot()
        _plane_axes(axes, objectives, np.concatenate(sets))
        attainment_surfaces(axes, objectives, sets)
        style.legend(axes, 3, width)
        return picture


# ---- of runs ---------------------------------------------------------------------------------------------------------


@contextmanager
def all_opened(runs: Mapping[str, Run]) -> Iterator[dict[str, Store]]:
    """Give the stores of runs by their names."""
    with ExitStack() as stack:
        yield {name: stack.enter_context(opened(run)) for name, run in runs.items()}


def same_objectives(name: str, stores: Mapping[str, Store]) -> Sequence[Objective]:
    """Return the objectives of runs that are to be held against each other in figure ``name``.

    Raises:
        ValueError: They differ.
    """
    first, *others = (list(store.objectives) for store in stores.values())
    if any(other != first for other in others):
        raise ValueError(f"{name}: expected runs of the same objectives, got others")
    return first


# ---- the plane -------------------------------------------------------------------------------------------------------


def plane(objectives: FloatArray) -> FloatArray:
    """Return ``(n, 2)`` of ``(n, m)``: the second objective across, the first one up."""
    return objectives[:, 1::-1]


def points_of(store: Store, front: Sequence[pareto.FrontPoint]) -> FloatArray:
    """Return ``(n, 2)``: where a front's points stand; with one objective the trial goes across."""
    if len(store.objectives) == 1:
        return np.array([[point.trial, *point.objectives.values()] for point in front]).reshape(-1, 2)
    return plane(np.array([list(point.objectives.values()) for point in front]).reshape(-1, len(store.objectives)))


def attainment_surfaces(axes: Axes, objectives: Sequence[Objective], sets: Sequence[FloatArray]) -> None:
    """Draw which trade-offs any, half and all of some trials attained, from end to end of the axes.

    Args:
        axes: Whose limits are set.
        objectives: Two.
        sets: Each trial's points in the plane ``(n, 2)``.
    """
    signs = np.array([-1.0 if one.is_maximised else 1.0 for one in reversed(objectives)])
    numbers = np.repeat(np.arange(len(sets)), [len(points) for points in sets])
    shares = {"any trial": 100 / len(sets), "half of the trials": 50.0, "all trials": 100.0}
    found = moocore.eaf(np.concatenate(sets) * signs, numbers, percentiles=sorted(set(shares.values())))
    looks = zip(shares.items(), (style.GREEN, style.BLUE, style.VERMILLION), style.STYLES, strict=False)
    for (name, share), colour, line in looks:
        surface = found[np.isclose(found[:, 2], share)][:, :2] * signs
        staircase(axes, objectives, surface, color=colour, linestyle=line, linewidth=1.6, label=name)


def _marker(number: int) -> dict[str, Any]:
    marker = style.MARKERS[number % len(style.MARKERS)]
    return {"color": style.colour(number), "marker": marker, "linestyle": "none"}


def _plane_axes(axes: Axes, objectives: Sequence[Objective], points: FloatArray) -> None:
    """Name the axes and fix their limits; where the points' places across are whole numbers, so are the ticks."""
    axes.set_ylabel(text.label(objectives[0]))
    axes.set_xlabel(text.label(objectives[1]) if len(objectives) > 1 else "trial")
    axes.xaxis.set_major_locator(style.ticks(are_whole(points[:, 0]), 8))
    low, high = points.min(axis=0), points.max(axis=0)
    room = _ROOM * np.where(high > low, high - low, 1.0)
    axes.set(xlim=(low[0] - room[0], high[0] + room[0]), ylim=(low[1] - room[1], high[1] + room[1]))


def _not_drawn(axes: Axes, objectives: Sequence[Objective], width: float) -> None:
    """Say which objectives the plane does not have."""
    if said := text.not_drawn(objectives):
        style.note(axes, textwrap.fill(said, int(style.LETTERS * width)))


def are_whole(values: FloatArray) -> bool:
    """Whether all are whole numbers."""
    return bool(np.all(values == np.round(values)))


def staircase(axes: Axes, objectives: Sequence[Objective], points: FloatArray, **look: Any) -> None:
    """Draw the edge of what two objectives' front dominates, from end to end of the axes, whose limits are set."""
    first, second = objectives[:2]
    best_first = points[np.argsort(points[:, 0] * (-1 if second.is_maximised else 1))]
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    end, start = left if second.is_maximised else right, bottom if first.is_maximised else top
    across, up = [best_first[0, 0], *best_first[:, 0], end], [start, *best_first[:, 1], best_first[-1, 1]]
    marked = list(range(1, len(points) + 1))  # not the ends, where nobody stands
    axes.plot(across, up, drawstyle="steps-post", markevery=marked, **look)

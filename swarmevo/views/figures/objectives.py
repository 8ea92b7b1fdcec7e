# SPDX-License-Identifier: BSD-3-Clause
"""What evolution found, in the plane of the first two objectives, and how it came there.

Fronts of trials and of all of them (the paper's Fig. 4), attainment surfaces, hypervolume over the generations, and
every individual of a trial (the paper's Fig. 3).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import matplotlib
import moocore
import numpy as np
from matplotlib.ticker import MaxNLocator

from swarmevo.analysis import fronts as pareto
from swarmevo.errors import StoreError
from swarmevo.protocols import FloatArray, Objective
from swarmevo.runs.store import Store
from swarmevo.views import text
from swarmevo.views.figures import style
from swarmevo.views.figures.source import Run, opened
from swarmevo.views.figures.style import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def fronts(run: Run) -> Picture:
    """Return the front of each trial and, in black, that of all (the paper's Fig. 4)."""
    with opened(run) as store, style.picture() as picture:
        axes = picture.add_subplot()
        shown = [_points(store, pareto.front(store, trial)) for trial in store.trials()]
        for trial, points in zip(store.trials(), shown, strict=True):
            look: dict[str, Any] = {
                "color": style.colour(trial),
                "marker": style.MARKERS[trial % len(style.MARKERS)],
                "linestyle": "none",
            }
            axes.plot(*points.T, **look, markersize=5, alpha=0.85, label=f"trial {trial}", zorder=3)
        front = _points(store, pareto.front(store))
        _plane_axes(axes, store.objectives, front)
        if len(store.objectives) == 2:
            end = _worst(store.objectives, np.concatenate(shown))
            staircase(
                axes, store.objectives, front, end, color=style.INK, linewidth=1.8, zorder=2, label="global front"
            )
        axes.plot(*front.T, "o", markersize=10, markerfacecolor="none", markeredgecolor=style.INK, zorder=4)
        style.legend(axes, len(store.trials()) + 1)
        return picture


def attainment(run: Run) -> Picture:
    """Return which trade-offs any, half and all of the trials attained.

    Raises:
        ValueError: The run has not two objectives.
    """
    with opened(run) as store, style.picture() as picture:
        objectives, trials = store.objectives, store.trials()
        if len(objectives) != 2:
            raise ValueError(f"attainment: expected a run with two objectives, got {len(objectives)}")
        sets = [_points(store, pareto.front(store, trial)) for trial in trials]
        signs = np.array([-1.0 if o.is_maximised else 1.0 for o in reversed(objectives)])
        numbers = np.repeat(np.arange(len(sets)), [len(points) for points in sets])
        shares = {"any trial": 100 / len(sets), "half of the trials": 50.0, "all trials": 100.0}
        surfaces = moocore.eaf(np.concatenate(sets) * signs, numbers, percentiles=sorted(set(shares.values())))
        axes = picture.add_subplot()
        _plane_axes(axes, objectives, np.concatenate(sets))
        looks = zip(shares.items(), (style.GREEN, style.BLUE, style.VERMILLION), style.STYLES, strict=False)
        for (name, share), colour, line in looks:
            surface = surfaces[np.isclose(surfaces[:, 2], share)][:, :2] * signs
            end = _worst(objectives, np.concatenate(sets))
            staircase(axes, objectives, surface, end, color=colour, linestyle=line, linewidth=1.8, label=name)
        style.legend(axes, 3)
        return picture


def hypervolume(run: Run) -> Picture:
    """Return the hypervolume of each trial over the generations and, in black, its median."""
    with opened(run) as store, style.picture() as picture:
        axes = picture.add_subplot()
        curves = [[step.hypervolume for step in pareto.history(store, trial)] for trial in store.trials()]
        for trial, curve in zip(store.trials(), curves, strict=True):
            line = style.STYLES[trial // len(style.CYCLE) % len(style.STYLES)]
            axes.plot(curve, color=style.colour(trial), linestyle=line, linewidth=1.3, label=f"trial {trial}")
        common = min(map(len, curves), default=0)
        if len(curves) > 1 and common > 1:
            median = np.median([curve[:common] for curve in curves], axis=0)
            axes.plot(median, color=style.INK, linewidth=4, alpha=0.3, zorder=1.5, label="median")
        axes.set(xlabel="generation", ylabel="hypervolume")
        axes.set_ylim(bottom=0)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        style.legend(axes, len(curves) + 1)
        return picture


def evolution(run: Run, trial: int | None = None) -> Picture:
    """Return one trial's individuals over generations, second and first objective (the paper's Fig. 3).

    Args:
        run: With at least two objectives.
        trial: None: the one with the largest hypervolume.

    Raises:
        ValueError: The run has one objective only.
    """
    with opened(run) as store, style.picture(5.2, 4.4) as picture:
        if len(store.objectives) < 2:
            raise ValueError("evolution: expected a run with at least two objectives, got 1")
        chosen = _best_trial(store) if trial is None else trial
        with matplotlib.rc_context({"grid.color": f"{style.INK}20"}):  # in 3-D, the grid's alpha is not asked for
            axes: Any = picture.add_subplot(projection="3d")
        clouds = [(s.number, _plane(store.over_worlds(s.means))) for s in store.summaries(chosen)]
        generations = np.repeat([number for number, _ in clouds], [len(points) for _, points in clouds])
        points = np.concatenate([points for _, points in clouds])
        best = np.concatenate([_is_front(store.objectives, points) for _, points in clouds])
        axes.scatter(
            generations[~best], *points[~best].T, s=7, color=style.SKY, alpha=0.6, linewidths=0, depthshade=False
        )
        axes.scatter(
            generations[best], *points[best].T, c=generations[best], cmap="viridis", s=16, alpha=1, depthshade=False,
            edgecolors=style.INK, linewidths=0.3,
        )  # fmt: skip
        first, second = store.objectives[:2]
        axes.set(xlabel="generation", ylabel=text.words(second.name), zlabel=text.words(first.name))
        axes.yaxis.set_major_locator(MaxNLocator(integer=_are_whole(points[:, 0]), nbins=6))
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
        picture.suptitle(f"trial {chosen}; outlined: not dominated in their generation", fontsize=9)
        for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
            axis.set_pane_color((0.5, 0.5, 0.5, 0.06))
        axes.view_init(elev=22, azim=-58)
        axes.set_box_aspect((1.25, 1, 0.85), zoom=0.92)
        return picture


def _plane(objectives: FloatArray) -> FloatArray:
    """Return ``(n, 2)`` of ``(n, m)``: the second objective across, the first one up."""
    return objectives[:, 1::-1]


def _points(store: Store, front: Sequence[pareto.FrontPoint]) -> FloatArray:
    """Return ``(n, 2)``: where a front's points stand; with one objective the trial goes across."""
    if len(store.objectives) == 1:
        return np.array([[point.trial, *point.objectives.values()] for point in front]).reshape(-1, 2)
    return _plane(np.array([list(point.objectives.values()) for point in front]).reshape(-1, len(store.objectives)))


def _plane_axes(axes: Axes, objectives: Sequence[Objective], points: FloatArray) -> None:
    """Name the axes; where the points' places across are whole numbers, so are the ticks."""
    axes.set_ylabel(text.label(objectives[0]))
    axes.set_xlabel(text.label(objectives[1]) if len(objectives) > 1 else "trial")
    axes.xaxis.set_major_locator(MaxNLocator(nbins=8, integer=_are_whole(points[:, 0])))
    axes.margins(0.06)


def _are_whole(values: FloatArray) -> bool:
    return bool(np.all(values == np.round(values)))


def staircase(axes: Axes, objectives: Sequence[Objective], points: FloatArray, end: float, **look: Any) -> None:
    """Draw the edge of what two objectives' front dominates, as far as ``end`` in the second objective."""
    best_first = points[np.argsort(points[:, 0] * (1 if objectives[1].direction == "minimise" else -1))]
    axes.plot([*best_first[:, 0], end], [*best_first[:, 1], best_first[-1, 1]], drawstyle="steps-post", **look)


def _worst(objectives: Sequence[Objective], points: FloatArray) -> float:
    """Return the worst second objective among the points."""
    return float(points[:, 0].max() if objectives[1].direction == "minimise" else points[:, 0].min())


def _is_front(objectives: Sequence[Objective], plane: FloatArray) -> Any:
    maximised = [objective.is_maximised for objective in objectives[1::-1]]
    return moocore.is_nondominated(plane, maximise=maximised, keep_weakly=True)


def _best_trial(store: Store) -> int:
    if not store.trials():
        raise StoreError(f"{store.folder}: expected at least one generation, but none is stored yet")
    return max(store.trials(), key=lambda trial: pareto.history(store, trial)[-1].hypervolume)

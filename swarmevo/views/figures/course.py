# SPDX-License-Identifier: BSD-3-Clause
"""How evolution came to its fronts: the hypervolume over the generations, and every individual of a trial (Fig. 3)."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import matplotlib
import moocore
import numpy as np

from swarmevo.analysis import fronts as pareto
from swarmevo.errors import StoreError
from swarmevo.protocols import BoolArray, FloatArray, Objective
from swarmevo.runs.store import Store
from swarmevo.views import text
from swarmevo.views.figures import style
from swarmevo.views.figures.objectives import all_opened, are_whole, plane, same_objectives
from swarmevo.views.figures.source import Run, opened
from swarmevo.views.figures.style import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TIMES: Final = "\N{MULTIPLICATION SIGN}"


def hypervolume(run: Run, width: float = style.COLUMN) -> Picture:
    """Return the hypervolume of each trial over the generations and, in black, its median.

    Args:
        run: With at least one generation.
        width: Of the figure [inches].
    """
    with opened(run) as store, style.picture(width, entries=len(store.trials()) + 1) as picture:
        axes = picture.add_subplot()
        curves = [[step.hypervolume for step in pareto.history(store, trial)] for trial in store.trials()]
        for trial, curve in zip(store.trials(), curves, strict=True):
            line = style.STYLES[trial // len(style.CYCLE) % len(style.STYLES)]
            look: dict[str, Any] = {"color": style.colour(trial), "linestyle": line, "label": f"trial {trial}"}
            axes.plot(curve, **look, **_alone(curve), linewidth=1.3)
        common = min(map(len, curves), default=0)
        if len(curves) > 1 and common > 1:
            median = np.median([curve[:common] for curve in curves], axis=0)
            axes.plot(median, color=style.INK, linewidth=4, alpha=0.3, zorder=1.5, label="median")
        _hypervolume_axes(axes, store.objectives, width)
        style.legend(axes, len(curves) + 1, width)
        return picture


def hypervolume_of_runs(runs: Mapping[str, Run], width: float = style.PAGE) -> Picture:
    """Return the hypervolume of several runs of the same objectives over the generations, with the median.

    Args:
        runs: By the names that the legend gives them.
        width: Of the figure [inches].

    Raises:
        ValueError: Their objectives differ.
    """
    with all_opened(runs) as stores, style.picture(width, 0.5 * width, len(runs)) as picture:
        axes, objectives = picture.add_subplot(), same_objectives("hypervolume_of_runs", stores)
        for i, (name, store) in enumerate(stores.items()):
            curves = [[step.hypervolume for step in pareto.history(store, trial)] for trial in store.trials()]
            look: dict[str, Any] = {"color": style.colour(i), "linestyle": style.STYLES[i % len(style.STYLES)]}
            for curve in curves if len(curves) > 1 else []:
                axes.plot(curve, **look, linewidth=0.7, alpha=0.45)
            common = min(map(len, curves))
            median = np.median([curve[:common] for curve in curves], axis=0)
            axes.plot(median, **look, **_alone(median), linewidth=1.8, label=name)
        _hypervolume_axes(axes, objectives, width)
        style.legend(axes, len(runs), width)
        return picture


def _alone(curve: Sequence[float] | FloatArray) -> dict[str, Any]:
    """Return what shows a curve that is one generation long, for a line of one point is not seen."""
    return {"marker": "o", "markersize": 4} if len(curve) == 1 else {}


def _hypervolume_axes(axes: Axes, objectives: Sequence[Objective], width: float) -> None:
    """Name the axes, with the unit of the volume and what it is measured against."""
    unit = f" {TIMES} ".join(text.words(objective.name) for objective in objectives)
    reference = ", ".join(f"{text.words(objective.name)} {text.number(objective.worst)}" for objective in objectives)
    axes.set_xlabel("generation")
    axes.set_ylabel(f"hypervolume\n({textwrap.fill(unit, int(0.5 * style.LETTERS * width))})")
    style.note(axes, textwrap.fill(f"reference point: {reference}", int(style.LETTERS * width)))
    axes.set_ylim(bottom=0)
    axes.xaxis.set_major_locator(style.ticks(is_whole=True))


def evolution(run: Run, trial: int | None = None, flat: bool = False, width: float = style.COLUMN) -> Picture:
    """Return one trial's individuals over generations, second and first objective (the paper's Fig. 3).

    Args:
        run: With at least two objectives.
        trial: None: the one with the largest hypervolume.
        flat: In the plane of the objectives, the generations as colours; else in three dimensions, as in the paper.
        width: Of the figure [inches].

    Raises:
        ValueError: The run has one objective only.
    """
    with opened(run) as store, style.picture(width, 0.84 * width) as picture:
        if len(store.objectives) < 2:
            raise ValueError("evolution: expected a run with at least two objectives, got 1")
        chosen = best_trial(store) if trial is None else trial
        if flat:
            draw_evolution(picture.add_subplot(), store, chosen)
        else:
            with matplotlib.rc_context({"grid.color": f"{style.INK}20"}):  # in 3-D, the grid's alpha is not asked for
                _draw_in_space(picture.add_subplot(projection="3d"), store, chosen)
            picture.suptitle(f"trial {chosen}; outlined: not dominated in their generation", fontsize=7.5)
        return picture


def draw_evolution(axes: Axes, store: Store, trial: int) -> None:
    """Draw a trial's individuals in the plane of the first two objectives, their generations as colours."""
    generations, points, best = _individuals(store, trial)
    look: dict[str, Any] = {"cmap": "viridis", "vmin": 0, "vmax": max(0.5, int(generations.max()))}
    (across, up), (front_across, front_up) = points[~best].T, points[best].T
    axes.scatter(across, up, c=generations[~best], s=6, alpha=0.55, linewidths=0, **look)
    outlined: dict[str, Any] = {"s": 16, "edgecolors": style.INK, "linewidths": 0.4, "zorder": 3, **look}
    shown = axes.scatter(front_across, front_up, c=generations[best], **outlined)
    first, second = store.objectives[:2]
    axes.set(xlabel=text.label(second), ylabel=text.label(first))
    axes.xaxis.set_major_locator(style.ticks(are_whole(points[:, 0]), 6))
    bar = axes.figure.colorbar(shown, ax=axes, label="generation", shrink=0.9)
    bar.locator = style.ticks(is_whole=True, most=6)
    bar.outline.set_visible(False)
    style.note(axes, f"trial {trial}; outlined: not dominated\nin their generation")


def _draw_in_space(axes: Any, store: Store, trial: int) -> None:
    generations, points, best = _individuals(store, trial)
    axes.scatter(generations[~best], *points[~best].T, s=7, color=style.SKY, alpha=0.6, linewidths=0, depthshade=False)
    axes.scatter(
        generations[best], *points[best].T, c=generations[best], cmap="viridis", s=16, alpha=1, depthshade=False,
        edgecolors=style.INK, linewidths=0.3,
    )  # fmt: skip
    first, second = store.objectives[:2]
    axes.set(xlabel="generation", ylabel=text.words(second.name), zlabel=text.words(first.name))
    axes.yaxis.set_major_locator(style.ticks(are_whole(points[:, 0]), 6))
    axes.xaxis.set_major_locator(style.ticks(is_whole=True, most=6))
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color((0.5, 0.5, 0.5, 0.06))
    axes.view_init(elev=22, azim=-58)
    axes.set_box_aspect((1.25, 1, 0.85), zoom=0.92)


def _individuals(store: Store, trial: int) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return of all individuals of a trial the generation, the place in the plane, and who is not dominated in it."""
    clouds = [(s.number, plane(store.over_worlds(s.means))) for s in store.summaries(trial)]
    generations = np.repeat([number for number, _ in clouds], [len(points) for _, points in clouds])
    best = np.concatenate([_is_front(store.objectives, points) for _, points in clouds])
    return generations, np.concatenate([points for _, points in clouds]), best


def _is_front(objectives: Sequence[Objective], points: FloatArray) -> Any:
    maximised = [objective.is_maximised for objective in objectives[1::-1]]
    return moocore.is_nondominated(points, maximise=maximised, keep_weakly=True)


def best_trial(store: Store) -> int:
    """Return the trial with the largest hypervolume.

    Raises:
        StoreError: There is no generation yet.
    """
    if not store.trials():
        raise StoreError(f"{store.folder}: expected at least one generation, but none is stored yet")
    return max(store.trials(), key=lambda trial: pareto.history(store, trial)[-1].hypervolume)

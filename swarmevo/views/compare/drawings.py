# SPDX-License-Identifier: BSD-3-Clause
"""Figures of a comparison: how fast, how far, how often, and which trade-offs."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import moocore
import numpy as np

from swarmevo.analysis.attainment import differences
from swarmevo.analysis.comparison import Comparison, Group, Measure, Trial, hypervolume_at
from swarmevo.protocols import FloatArray, Objective
from swarmevo.views import text
from swarmevo.views.figures import style
from swarmevo.views.figures.objectives import attainment_surfaces, staircase
from swarmevo.views.figures.style import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ACROSS: Final = 200
"""Places of a course over the episodes."""
_JITTER: Final = 0.12
_WIDTH: Final = 6.4
"""Of a figure [inches]."""
_ROW: Final = 0.42
"""Height of a group's row [inches]."""
_LINE: Final = 0.14
"""Height of a line of a name [inches]."""
_LETTERS: Final = 36
"""Of a line of a name."""
_INSIDE: Final = 5
"""Names that a legend has room for inside the axes."""
_COLUMNS: Final = 2
"""Of a legend."""


def courses(found: Comparison) -> Picture:
    """Return the stored hypervolume against the episodes spent: median and quartiles over the trials."""
    with style.picture(_WIDTH, 3.8 + _below(found.groups)) as picture:
        axes = picture.add_subplot()
        for number, group in enumerate(found.groups):
            ends = [trial.course[-1][0] for trial in group.trials]
            episodes = np.linspace(0, min(ends), _ACROSS)
            curves = hypervolume_at(group.trials, episodes)
            known = np.isfinite(curves).all(axis=0)
            low, median, high = np.quantile(curves[:, known], [0.25, 0.5, 0.75], axis=0)
            axes.fill_between(episodes[known], low, high, color=style.colour(number), alpha=0.2, linewidth=0)
            axes.plot(episodes[known], median, **_line(number), label=_called(group))
        axes.set(xlabel="episodes of a trial", ylabel="hypervolume (share of the ranges)")
        axes.set_ylim(bottom=0)
        axes.set_xlim(left=0)
        _legend(axes, found.groups)
        return picture


def optimism(found: Comparison) -> Picture:
    """Return each trial's hypervolume by the episodes of evolution, and on fresh seeds."""
    with style.picture(_WIDTH, _height(found.groups)) as picture:
        axes = picture.add_subplot()
        for number, group in enumerate(found.groups):
            up = number + _spread(len(group.trials))
            stored, tested = ([getattr(trial, name) for trial in group.trials] for name in ("stored", "tested"))
            axes.hlines(up, tested, stored, color=style.colour(number), linewidth=0.8, alpha=0.6)
            axes.plot(stored, up, "o", markerfacecolor="none", color=style.colour(number), markersize=5)
            axes.plot(tested, up, "o", color=style.colour(number), markersize=5)
            axes.vlines(np.median(tested), number - 0.3, number + 0.3, color=style.INK, linewidth=1.6)
        _name_groups(axes, found.groups)
        axes.set_xlabel("hypervolume (share of the ranges)")
        every = [value for group in found.groups for trial in group.trials for value in (trial.stored, trial.tested)]
        _let_differ(axes, every, (0.0, 1.0))
        return picture


def values(found: Comparison, measure: Measure) -> Picture:
    """Return a measure of each trial, with the groups' medians."""
    with style.picture(_WIDTH, _height(found.groups)) as picture:
        axes = picture.add_subplot()
        for number, (_, numbers) in enumerate(measure.values.items()):
            axes.plot(numbers, number + _spread(len(numbers)), "o", color=style.colour(number), markersize=5)
            axes.vlines(np.median(numbers), number - 0.3, number + 0.3, color=style.INK, linewidth=1.6)
        _name_groups(axes, found.groups)
        better = "more" if measure.more_is_better else "less"
        axes.set_xlabel(f"{text.words(measure.name)} on fresh seeds ({better} is better)")
        ranges = {objective.name: objective.range for objective in found.objectives}
        _let_differ(axes, list(itertools.chain(*measure.values.values())), ranges.get(measure.name, (0.0, 1.0)))
        return picture


def profiles(found: Comparison) -> Picture:
    """Return for each hypervolume the share of trials that have reached it, on fresh seeds."""
    with style.picture(_WIDTH, 3.4 + _below(found.groups)) as picture:
        axes = picture.add_subplot()
        for number, group in enumerate(found.groups):
            reached = np.sort([trial.tested for trial in group.trials])
            share = 1 - np.arange(len(reached)) / len(reached)
            axes.step([0, *reached, reached[-1]], [1, *share, 0], where="pre", **_line(number), label=_called(group))
        axes.set(xlabel="hypervolume on fresh seeds (share of the ranges)", ylabel="share of trials that reached it")
        axes.set_ylim(-0.02, 1.02)
        axes.set_xlim(left=0)
        _let_differ(axes, [trial.tested for group in found.groups for trial in group.trials], (0.0, 1.0))
        _legend(axes, found.groups)
        return picture


def attained(found: Comparison) -> Picture:
    """Return which trade-offs half of each group's trials attained on fresh seeds; of two objectives."""
    with style.picture(_WIDTH, 4.2 + _below(found.groups)) as picture:
        axes = picture.add_subplot()
        sets = [_sets(group) for group in found.groups]
        every = np.concatenate([points for points, _ in sets])
        _name_plane(axes, found.objectives)
        _around(axes, every)
        for number, (group, (points, numbers)) in enumerate(zip(found.groups, sets, strict=True)):
            signs = _signs(found.objectives)
            surface = moocore.eaf(points * signs, numbers, percentiles=[50.0])[:, :2] * signs
            staircase(axes, found.objectives, surface, **_line(number), marker="o", markersize=3, label=_called(group))
        _legend(axes, found.groups)
        return picture


def attainment_panels(found: Comparison) -> Picture:
    """Return which trade-offs any, half and all of each group's trials attained on fresh seeds; of two objectives."""
    rows = math.ceil(len(found.groups) / _COLUMNS)
    height = rows * (2.3 + _LINE * _lines(found.groups)) + 0.8
    with style.picture(_WIDTH, height) as picture:
        panels = picture.subplots(rows, _COLUMNS, sharex=True, sharey=True, squeeze=False).flat
        sets = [[_plane(trial) for trial in group.trials] for group in found.groups]
        _around(panels[0], np.concatenate(list(itertools.chain(*sets))))
        for axes, group, points in zip(panels, found.groups, sets, strict=False):
            attainment_surfaces(axes, found.objectives, points)
            axes.set_title(_called(group), fontsize="small")
        for axes in panels[len(found.groups) :]:
            axes.remove()
        for axes in panels[: len(found.groups)][-_COLUMNS:]:
            axes.tick_params(labelbottom=True)  # also above one that is not there
        picture.supylabel(text.label(found.objectives[0]), fontsize="medium")
        picture.supxlabel(text.label(found.objectives[1]), fontsize="medium")
        picture.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
        return picture


def attainment_differences(found: Comparison) -> Picture:
    """Return where a larger share of one of two groups' trials attained a trade-off; of two objectives.

    Raises:
        ValueError: There are not two groups.
    """
    if len(found.groups) != 2:
        raise ValueError(f"attainment_differences: expected two groups, got {len(found.groups)}")
    with style.picture(_WIDTH, 4.2 + _below(found.groups)) as picture:
        axes = picture.add_subplot()
        signs = _signs(found.objectives)
        low, high = _around(axes, np.concatenate([_sets(group)[0] for group in found.groups]))
        a, b = ([_plane(trial) * signs for trial in group.trials] for group in found.groups)
        for part in differences(a, b):
            (x_0, y_0), (x_1, y_1) = np.clip(np.array([part.low, part.high]) * signs, low, high)
            colour = style.colour(0 if part.difference > 0 else 1)
            axes.fill_between(sorted([x_0, x_1]), y_0, y_1, color=colour, alpha=abs(part.difference), linewidth=0)
        for number, group in enumerate(found.groups):
            axes.plot([], [], "s", color=style.colour(number), label=f"a larger share of {_called(group)}")
        _name_plane(axes, found.objectives)
        _legend(axes, found.groups)
        return picture


def _line(number: int) -> dict[str, Any]:
    return {"color": style.colour(number), "linestyle": style.STYLES[number % len(style.STYLES)], "linewidth": 1.8}


def _spread(n: int) -> FloatArray:
    """Return places beside each other, so that no trial hides another."""
    return np.linspace(-_JITTER, _JITTER, n) if n > 1 else np.zeros(1)


def _called(group: Group) -> str:
    """Return a group's name; a long one takes several lines, broken after commas and plus signs if it can be."""
    lines = [""]
    for part in re.findall(rf"[^,+]{{1,{_LETTERS - 1}}}[,+]?|[,+]", group.name):
        if len(lines[-1]) + len(part) > _LETTERS:
            lines.append("")
        lines[-1] += part
    return "\n".join(lines)


def _lines(groups: Sequence[Group]) -> int:
    """Return how many lines the longest name takes."""
    return max(_called(group).count("\n") + 1 for group in groups)


def _name_groups(axes: Axes, groups: Sequence[Group]) -> None:
    axes.set_yticks(range(len(groups)), [_called(group) for group in groups])
    axes.set_ylim(len(groups) - 0.4, -0.6)  # the first is above
    axes.grid(visible=False, axis="y")


def _height(groups: Sequence[Group]) -> float:
    """Return that of a figure with a row for each group [inches]."""
    return 0.7 + len(groups) * max(_ROW, _LINE * (_lines(groups) + 0.7))


def _legend(axes: Axes, groups: Sequence[Group]) -> None:
    if _is_below(groups):
        style.legend(axes, len(groups), _WIDTH, below=True, ncols=_COLUMNS)
    else:
        style.legend(axes, len(groups), _WIDTH)


def _is_below(groups: Sequence[Group]) -> bool:
    return len(groups) > _INSIDE or _lines(groups) > 1


def _below(groups: Sequence[Group]) -> float:
    """Return the height of a legend below the axes [inches]."""
    return _LINE * (1 + _lines(groups)) * math.ceil(len(groups) / _COLUMNS) if _is_below(groups) else 0.0


def _let_differ(axes: Axes, numbers: Sequence[float], ends: tuple[float, float]) -> None:
    """Show all that there could be where numbers across are all the same; else a tiny part about them is shown."""
    if min(numbers) == max(numbers):
        room = 0.02 * (ends[1] - ends[0])
        axes.set_xlim(ends[0] - room, ends[1] + room)


def _around(axes: Axes, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Let the axes end a little beyond the points ``(n, 2)``; return the lower and the upper ends."""
    low, high = points.min(axis=0), points.max(axis=0)
    room = 0.06 * np.where(high > low, high - low, 1.0)
    axes.set(xlim=(low[0] - room[0], high[0] + room[0]), ylim=(low[1] - room[1], high[1] + room[1]))
    return low - room, high + room


def _name_plane(axes: Axes, objectives: Sequence[Objective]) -> None:
    axes.set_ylabel(text.label(objectives[0]))
    axes.set_xlabel(text.label(objectives[1]))


def _sets(group: Group) -> tuple[FloatArray, FloatArray]:
    """Return the points of all trials in the plane, and each point's trial, from 0."""
    numbers = [[number] * len(trial.points) for number, trial in enumerate(group.trials)]
    return np.concatenate([_plane(trial) for trial in group.trials]), np.array(list(itertools.chain(*numbers)))


def _plane(trial: Trial) -> FloatArray:
    """Return the points ``(n, 2)`` of a trial in the plane, the second objective across."""
    return np.array(trial.points)[:, 1::-1]


def _signs(objectives: Sequence[Objective]) -> FloatArray:
    return np.array([-1.0 if objective.is_maximised else 1.0 for objective in reversed(objectives)])

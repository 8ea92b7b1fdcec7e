# SPDX-License-Identifier: BSD-3-Clause
"""Figures of a sweep: how far each setting came, and how fast."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from swarmevo.protocols import FloatArray
from swarmevo.sweeps.outcome import Findings, Row, Trial
from swarmevo.views.figures import style
from swarmevo.views.figures.style import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_LINES: Final = 8
"""In a figure: with more, nobody tells them apart."""
_JITTER: Final = 0.45
"""Of a line's places, to either side: so that no trial hides another."""
_APART: Final = 0.5
"""Of the room between two values that the lines beside each other take."""
_ACROSS: Final = 200
"""Places of a course over the episodes."""


def effect(found: Findings, key: str) -> Picture:
    """Return the hypervolume of each trial against the values of a key, with the medians.

    A line is a combination of the other keys' values; where they are too many, all are one.
    """
    others = [other for other in found.grid if other != key]
    lines = _grouped(found.rows, others)
    if len(lines) > MOST_LINES:
        lines = {"all settings": list(found.rows)}
    with style.picture(6.4, 3.8) as picture:
        axes = picture.add_subplot()
        width = _APART / len(lines)  # of the places that a line has for its trials at each value
        for number, (name, rows) in enumerate(lines.items()):
            shift = (number + 0.5) * width - 0.5 * _APART
            _draw_line(axes, number, name, shift, width, [_at(rows, key, value) for value in found.grid[key]])
        axes.set_xticks(range(len(found.grid[key])), [_short(value) for value in found.grid[key]])
        axes.set_xlim(-0.6, len(found.grid[key]) - 0.4)
        axes.set(xlabel=key, ylabel="hypervolume (share of the ranges)")
        axes.set_ylim(bottom=0)
        if len(lines) > 1:
            style.legend(axes, len(lines))
        return picture


def courses(found: Findings) -> Picture:
    """Return the hypervolume against the episodes spent: each setting's median over the trials, and quartiles."""
    rows = [row for row in found.rows if row.trials]
    with style.picture(6.4, 3.8) as picture:
        axes = picture.add_subplot()
        for number, row in enumerate(rows):
            episodes, curves = _curves(row.trials)
            low, median, high = np.quantile(curves, [0.25, 0.5, 0.75], axis=0)
            line = style.STYLES[number // len(style.CYCLE) % len(style.STYLES)]
            axes.plot(episodes, median, color=style.colour(number), linestyle=line, linewidth=1.6, label=row.name)
            if len(rows) <= MOST_LINES:
                axes.fill_between(episodes, low, high, color=style.colour(number), alpha=0.15, linewidth=0)
        axes.set(xlabel="episodes of a trial", ylabel="hypervolume (share of the ranges)")
        axes.set_ylim(bottom=0)
        axes.set_xlim(left=0)
        if len(rows) <= 3 * MOST_LINES:
            style.legend(axes, len(rows))
        return picture


def _draw_line(
    axes: Axes, number: int, name: str, shift: float, width: float, values: Sequence[Sequence[float]]
) -> None:
    colour = style.colour(number)
    for place, of_trials in enumerate(values):
        across = place + shift + width * np.linspace(-_JITTER, _JITTER, len(of_trials) + 2)[1:-1]
        axes.plot(across, of_trials, "o", color=colour, markersize=4, alpha=0.55, markeredgewidth=0)
    known = [(place + shift, float(np.median(ones))) for place, ones in enumerate(values) if ones]
    marker = style.MARKERS[number % len(style.MARKERS)]
    axes.plot(*zip(*known, strict=True), color=colour, marker=marker, markersize=6, linewidth=1.6, label=name)


def _grouped(rows: Sequence[Row], keys: Sequence[str]) -> dict[str, list[Row]]:
    """Return the rows of each combination of the keys' values, by its name."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        name = ", ".join(f"{key.rpartition('.')[2]} {_short(row.values[key])}" for key in keys)
        groups.setdefault(name, []).append(row)
    return groups


def _at(rows: Sequence[Row], key: str, value: str) -> list[float]:
    """Return the hypervolumes of all trials in which a key has a value."""
    return [trial.hypervolume for row in rows if row.values[key] == value for trial in row.trials]


def _curves(trials: Sequence[Trial]) -> tuple[FloatArray, FloatArray]:
    """Return numbers of episodes, and what each trial ``(trials, n)`` had reached by then, where all had begun."""
    first = max(trial.course[0][0] for trial in trials)
    last = max(first, min(trial.course[-1][0] for trial in trials))
    episodes = np.linspace(first, last, _ACROSS)
    curves = []
    for trial in trials:
        spent, reached = np.array(trial.course).T
        curves.append(reached[np.searchsorted(spent, episodes, side="right") - 1])
    return episodes, np.array(curves)


def _short(label: str) -> str:
    return label if len(label) <= 24 else f"{label[:21]}..."

# SPDX-License-Identifier: BSD-3-Clause
"""A comparison as one HTML page that needs no network."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np

from swarmevo._version import __version__
from swarmevo.analysis.comparison import Comparison, Measure, Pair
from swarmevo.runs import files
from swarmevo.views import figures, html, text
from swarmevo.views.compare import drawings
from swarmevo.views.report.article import Figure
from swarmevo.views.report.tables import Table

SIGNIFICANT: Final = 0.05
"""A difference is where its p-value is below."""


def write(found: Comparison, file: Path) -> Path:
    """Write the page and return its file.

    Raises:
        OutputError: It cannot be written.
    """
    with files.folder_made(file.parent):
        files.write(file, render(found))
    return file


def render(found: Comparison) -> str:
    """Return the page."""
    return html.render(
        "compare/page.html.jinja",
        title=f"{' and '.join(group.name for group in found.groups)} · swarmevo",
        style=html.asset("swarmevo.views.report", "report.css"),
        found=found,
        groups=group_table(found),
        measures=[(measure, value_table(measure), pair_table(measure)) for measure in found.measures],
        gallery=list(_gallery(found)),
        version=__version__,
    )


# ---- tables, which the console shows too -----------------------------------------------------------------------------


def group_table(found: Comparison) -> Table:
    """Return the groups: their runs, and how much better the stored fronts looked than they are."""
    heads = ["group", "optimiser", "trials", "episodes a trial", "stored hypervolume", "on fresh seeds", "optimism"]
    rows = []
    for group in found.groups:
        stored, tested = (np.array([getattr(one, name) for one in group.trials]) for name in ("stored", "tested"))
        rows.append(
            [
                group.name,
                ", ".join(group.optimisers),
                str(len(group.trials)),
                text.grouped(float(np.median([one.episodes for one in group.trials]))),
                text.number(float(np.median(stored))),
                text.number(float(np.median(tested))),
                text.difference(float(np.median(stored - tested))),
            ]
        )
    return Table(heads, rows)


def value_table(measure: Measure) -> Table:
    """Return of each group the median and the quartiles of a measure."""
    rows = []
    for name, values in measure.values.items():
        low, median, high = np.quantile(values, [0.25, 0.5, 0.75])
        spread = f"{text.number(float(low))} to {text.number(float(high))}"
        worst, best = sorted([min(values), max(values)], reverse=not measure.more_is_better)
        rows.append([name, text.number(float(median)), spread, text.number(worst), text.number(best)])
    return Table(["group", "median", "quartiles", "worst", "best"], rows)


def pair_table(measure: Measure) -> Table:
    """Return what each two groups differ by in a measure."""
    rows = [
        [
            f"{one.a} and {one.b}",
            p_value(one.p),
            f"{one.a12:.2f}",
            f"{one.low:.2f} to {one.high:.2f}",
            _said(measure, one),
        ]
        for one in measure.pairs
    ]
    head = "p" if measure.p is None else "p (Holm)"
    return Table(["groups", head, "A12", "95 % interval", "which is better"], rows)


def _said(measure: Measure, pair: Pair) -> str:
    """Return which of two groups is better, if that is significant."""
    if pair.p >= SIGNIFICANT:
        return "not known"
    return pair.a if (pair.a12 > 0.5) == measure.more_is_better else pair.b


def p_value(p: float) -> str:
    """Return a p-value to two digits."""
    return "< 0.0001" if p < 0.0001 else f"{p:.2g}"


# ---- figures ---------------------------------------------------------------------------------------------------------


def _gallery(found: Comparison) -> Iterator[Figure]:
    def figure(picture: figures.Picture, caption: str) -> Figure:
        return Figure(html.drawing(figures.svg(picture)), caption)

    yield figure(
        drawings.courses(found),
        "Hypervolume against the episodes spent, by the episodes of evolution: median and quartiles of the trials.",
    )
    yield figure(
        drawings.optimism(found),
        "Hypervolume of each trial's front: circles by evolution's episodes, discs on fresh seeds, with their median.",
    )
    yield figure(drawings.profiles(found), "Share of the trials that reached a hypervolume on fresh seeds, or more.")
    for measure in found.measures[1:]:
        yield figure(
            drawings.values(found, measure), f"{text.words(measure.name)} of each trial's best, with the medians."
        )
    if len(found.objectives) == 2:
        yield figure(drawings.attained(found), "Trade-offs that half of each group's trials attained, by all tests.")
        caption = "Trade-offs that any, half and all of each group's trials attained, by all tests."
        yield figure(drawings.attainment_panels(found), caption)
        if len(found.groups) == 2:
            yield figure(
                drawings.attainment_differences(found),
                "Where a larger share of one group's trials attained a trade-off, by all tests, so that luck helps "
                "larger fronts; where the colour is full, all of one and none of the other.",
            )

# SPDX-License-Identifier: BSD-3-Clause
"""A sweep as a table, and as one HTML page that needs no network."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from swarmevo._version import __version__
from swarmevo.runs import files
from swarmevo.sweeps.grid import short_names
from swarmevo.sweeps.outcome import Findings, Row, Trial
from swarmevo.views import figures, html, text
from swarmevo.views.report.article import Figure
from swarmevo.views.report.tables import Table
from swarmevo.views.sweep import drawings


def write(found: Findings, file: Path) -> Path:
    """Write the page and return its file.

    Raises:
        OutputError: It cannot be written.
    """
    with files.folder_made(file.parent):
        files.write(file, render(found))
    return file


def render(found: Findings) -> str:
    """Return the page."""
    return html.render(
        "sweep/page.html.jinja",
        title=f"{Path(found.sweep).resolve().name} · swarmevo",
        style=html.asset("swarmevo.views.report", "report.css"),
        found=found,
        name=Path(found.sweep).resolve().name,
        table=table(found),
        failures=failures(found),
        gallery=list(_gallery(found)),
        version=__version__,
    )


def table(found: Findings) -> Table:
    """Return for each setting what its trials found."""
    rates = sorted({run.rate for row in found.rows for run in row.runs if run.rate})
    heads = [
        *(list(short_names(list(found.grid)).values()) or ["setting"]),
        *("runs", "trials", "episodes", "hypervolume", "quartiles"),
        *(text.words(objective.name) for objective in found.objectives),
        *([f"success ({', '.join(map(text.words, rates))})"] if rates else []),
        "time",
    ]
    return Table(heads, [_row(found, row, bool(rates)) for row in found.rows])


def _row(found: Findings, row: Row, with_success: bool) -> list[str]:
    trials = row.trials

    def median(of: Callable[[Trial], float | None], shown: Callable[[float], str] = text.number) -> str:
        values = [value for value in map(of, trials) if value is not None]
        return shown(float(np.median(values))) if values else "-"

    low, high = np.quantile([one.hypervolume for one in trials], [0.25, 0.75]).tolist() if trials else (0.0, 0.0)
    return [
        *(list(row.values.values()) or [row.name]),
        f"{sum(run.complete for run in row.runs)}/{len(found.seeds)}" + (" failed" if row.failed else ""),
        str(len(trials)),
        median(lambda one: one.episodes, text.grouped),
        median(lambda one: one.hypervolume),
        f"{text.number(low)} to {text.number(high)}" if trials else "-",
        *(median(_best_of(objective.name)) for objective in found.objectives),
        *([median(lambda one: one.success, text.percent)] if with_success else []),
        text.duration(sum(run.seconds for run in row.runs)),
    ]


def _best_of(name: str) -> Callable[[Trial], float | None]:
    return lambda trial: trial.best.get(name)


def failures(found: Findings) -> list[str]:
    """Return which runs failed in this session, and why, one line each."""
    return [f"{row.name}, seed {seed}: {why}" for row in found.rows for seed, why in row.failed.items()]


def _gallery(found: Findings) -> Iterator[Figure]:
    if not any(row.trials for row in found.rows):
        return

    def figure(picture: figures.Picture, caption: str) -> Figure:
        return Figure(html.drawing(figures.svg(picture)), caption)

    for key, values in found.grid.items():
        if len(values) > 1:
            yield figure(
                drawings.effect(found, key),
                f"Hypervolume of each trial's front against {key}, with the medians; of trials that are not complete "
                "as far as they are.",
            )
    yield figure(
        drawings.courses(found),
        "Hypervolume against the episodes spent: the median of each setting's trials, as far as all of them are"
        + (", with the quartiles." if len(found.rows) <= drawings.MOST_LINES else "."),
    )

# SPDX-License-Identifier: BSD-3-Clause
"""A report of one or several runs: one HTML page that needs no network.

The page holds everything: figures as SVG in the page's own ink, numbers as tables, and the episodes of the controllers
on the fronts for the player of replays, which is in it once. Text from a run, which may come from a stranger, is
escaped by the templates.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from swarmevo._version import __version__
from swarmevo.runs import files
from swarmevo.runs.store import Store
from swarmevo.views import figures, html
from swarmevo.views.replay import page as replay_page
from swarmevo.views.report.article import article, overlays
from swarmevo.views.report.run import Run, data

FILE: Final = "report.html"
"""In a run's folder, if no other place is asked for."""
_PACKAGE: Final = "swarmevo.views.report"  # of the assets


def write(folders: Sequence[Path], file: Path, observe: Callable[[str], None] = lambda what: None) -> Path:
    """Write a report of runs and return its file.

    Args:
        folders: Of the runs, each with at least one generation.
        file: Is overwritten.
        observe: Told what is being done, one line each.

    Raises:
        EvaluationError: The controller takes genomes of another size.
        StoreError: A run cannot be read.
        OutputError: The file cannot be written.
    """
    content = page(folders, observe)
    with files.folder_made(file.parent):
        files.write(file, content)
    return file


def write_figures(folders: Sequence[Path], folder: Path, width: float = figures.COLUMN) -> list[Path]:
    """Write the figures of runs as PDF and PNG, ``width`` inches wide, and return the files.

    Those of several runs are each in a folder of its own.
    """
    places = [folder / name for name in names(folders)] if len(folders) > 1 else [folder]
    return [file for run, place in zip(folders, places, strict=True) for file in figures.write(run, place, width=width)]


def names(folders: Sequence[Path]) -> list[str]:
    """Return what runs are called: as their folders, with a number behind it where another one is called so."""
    own = [folder.resolve().name for folder in folders]
    found: list[str] = []
    for i, name in enumerate(own):
        others = {*found, *(own if name in own[:i] else [])}
        numbered = (f"{name}-{number}" for number in itertools.count(2))
        found.append(next(one for one in itertools.chain([name], numbered) if one not in others))
    return found


def page(folders: Sequence[Path], observe: Callable[[str], None] = lambda what: None) -> str:
    """Return the report of runs as HTML."""
    articles, embedded = [], []
    for number, (folder, name) in enumerate(zip(folders, names(folders), strict=True)):
        with Store.open(folder) as store:
            run = Run.of(store, number, name, observe)
            observe(f"{run.name}: figures")
            articles.append(article(store, run))
            embedded.append(data(store, run))
    runs = [(shown.run, folder) for shown, folder in zip(articles, folders, strict=True)]
    overlaid, alone = overlays(runs) if len(runs) > 1 else ([], [])
    return html.render(
        "report/page.html.jinja",
        overlays=overlaid,
        alone=alone,
        title=f"{', '.join(shown.run.name for shown in articles)} · swarmevo",
        player=replay_page.player(),
        style=html.asset(_PACKAGE, "report.css"),
        articles=articles,
        version=__version__,
        data=embedded,
        charts=html.asset(_PACKAGE, "charts.js"),
        script=html.asset(_PACKAGE, "report.js"),
    )

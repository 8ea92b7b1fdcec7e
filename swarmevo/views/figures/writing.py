# SPDX-License-Identifier: BSD-3-Clause
"""All figures of a run, as files, and a figure as SVG for a page."""

from __future__ import annotations

import io
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import matplotlib
from matplotlib.figure import Figure

from swarmevo.analysis import assessment
from swarmevo.runs import files
from swarmevo.views.figures import behaviour, course, maps, networks, objectives, plate, style
from swarmevo.views.figures.source import Run, opened
from swarmevo.views.figures.style import Picture

_GLOBAL_STYLE: Final = re.compile(r"<style[^>]*>\*[^<]*<[^>]*>")
"""Of matplotlib's SVG: inside a page it would be the style of all that is there."""


def every(run: Run, width: float = style.COLUMN) -> Iterator[tuple[str, Picture]]:
    """Yield name and figure of all that a run can show, of a width [inches]; a plate is across a page."""
    with opened(run) as store:
        yield "fronts", objectives.fronts(store, width)
        yield "hypervolume", course.hypervolume(store, width)
        if len(store.objectives) > 1:
            yield "evolution", course.evolution(store, width=width)
            yield "evolution_flat", course.evolution(store, flat=True, width=width)
        if len(store.objectives) == 2 and len(store.trials()) > 1:
            yield "attainment", objectives.attainment(store, width)
        if len(store.descriptors) > 1:
            yield "behaviour_map", maps.behaviour_map(store, width=width)
        seen = assessment.watch(store)
        yield "paths", behaviour.paths(seen, width=width)
        yield "occupancy", behaviour.occupancy(seen, width=width)
        if networks.has_network(seen.config, seen.genes):
            yield "network", networks.network(store, width=width)
        if len(store.objectives) > 1:
            yield "paper", plate.plate(store, seen)


def write(
    run: Run, folder: str | os.PathLike[str], formats: Sequence[str] = ("pdf", "png"), width: float = style.COLUMN
) -> list[Path]:
    """Write every figure of a run, ``width`` inches wide, into a folder, which is made; return the files.

    Raises:
        OutputError: The folder cannot be written.
    """
    folder, made = Path(folder), []
    with files.folder_made(folder):
        for name, picture in every(run, width):
            for kind in formats:
                made.append(folder / f"{name}.{kind}")
                with files.written(made[-1]) as fresh:
                    picture.savefig(fresh, format=kind, dpi=300, metadata=_undated(kind))
    return made


def _undated(kind: str) -> dict[str, Any]:
    """Return metadata that make the same figure the same file."""
    return {"pdf": {"CreationDate": None}, "svg": {"Date": None}}.get(kind, {})


def svg(picture: Figure) -> str:
    """Return a figure as SVG for a page: without a background, ink in the page's own colour, blue as its ``--blue``."""
    buffer = io.StringIO()
    with matplotlib.rc_context(style.SETTINGS):
        picture.savefig(buffer, format="svg", transparent=True, metadata=_undated("svg"))
    drawn = buffer.getvalue().replace(style.INK, "currentColor")
    drawn = drawn.replace(style.BLUE.lower(), f"var(--blue, {style.BLUE})")
    return _GLOBAL_STYLE.sub("", drawn[drawn.index("<svg") :])

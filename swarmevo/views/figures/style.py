# SPDX-License-Identifier: BSD-3-Clause
"""How all figures look: colours, markers, matplotlib's settings, and the figure that is drawn on."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

import matplotlib
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILLION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
"""Okabe and Ito, Color Universal Design (2008)."""
CYCLE: Final = (BLUE, ORANGE, GREEN, VERMILLION, PURPLE, SKY, YELLOW)
"""Of trials and robots: a robot has the same colour in its replay."""
INK: Final = "#1b1b1f"
"""Text, axes and whatever is black in print."""
MARKERS: Final = "osD^vPX*"
"""Of trials; one more than colours, so that the pairs of both begin anew after 56 trials only."""
STYLES: Final = ("-", "--", "-.", ":")

SETTINGS: Final[Any] = {  # matplotlib types the names of its settings one by one
    "font.family": "sans-serif",
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.facecolor": "none",
    "figure.facecolor": "white",
    "grid.color": INK,
    "grid.alpha": 0.12,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "text.color": INK,
    "text.parse_math": False,  # names of objectives and of runs may have any letter
    "text.usetex": False,
    "xtick.color": INK,
    "ytick.color": INK,
    "svg.fonttype": "none",
    "svg.hashsalt": "swarmevo",
    "pdf.fonttype": 42,  # text stays text
}
"""Of matplotlib."""


class Picture(Figure):
    """A figure that shows itself in a notebook, without pyplot."""

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=144)
        return buffer.getvalue()


@contextmanager
def picture(width: float = 5.2, height: float = 3.6) -> Iterator[Picture]:
    """Give a figure to draw on, of ``width`` times ``height`` inches, in our style."""
    with matplotlib.rc_context(SETTINGS):
        yield Picture(figsize=(width, height), layout="constrained")


def colour(number: int) -> str:
    """Return the colour of a trial or a robot."""
    return CYCLE[number % len(CYCLE)]


def legend(axes: Axes, entries: int) -> None:
    """Put the legend inside, or, when it is long, beside the axes."""
    if entries <= 5:
        axes.legend(loc="best")
    else:
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), borderaxespad=0)

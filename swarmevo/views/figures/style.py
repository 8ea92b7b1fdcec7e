# SPDX-License-Identifier: BSD-3-Clause
"""How all figures look: colours, markers, matplotlib's settings, and the figure that is drawn on."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

import matplotlib
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import ScaledTranslation

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
COLUMN: Final = 3.5
"""Width of a figure in a column of a paper [inches]; letters are of 8 points in any width."""
PAGE: Final = 7.0
"""Of one across both columns."""
SCREEN: Final = 5.2
"""Of one in a page."""
LETTERS: Final = 19
"""Of a sentence in small letters, on an inch."""
_INSIDE: Final = 5
"""Entries of a legend that has room inside the axes."""
_ENTRY: Final = 0.82
"""Width of an entry of a legend below the axes [inches]."""
_ROW: Final = 0.17
"""Height of a row of those [inches]."""
_BELOW: Final = 0.42
"""From the axes to a legend below: the ticks and the name of the axis are between [inches]."""

SETTINGS: Final[Any] = {  # matplotlib types the names of its settings one by one
    "font.family": "sans-serif",
    "font.size": 8,
    "axes.titlesize": 9,
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
    "legend.fontsize": 7.5,
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
def picture(width: float = SCREEN, height: float | None = None, entries: int = 0) -> Iterator[Picture]:
    """Give a figure to draw on in our style.

    Args:
        width: [inches]
        height: [inches]; None: as suits the width.
        entries: Of its legend; what stands below the axes makes it higher.
    """
    below = _ROW * math.ceil(entries / _columns(width)) if entries > _INSIDE else 0.0
    with matplotlib.rc_context(SETTINGS):
        yield Picture(figsize=(width, (0.7 * width if height is None else height) + below), layout="constrained")


def colour(number: int) -> str:
    """Return the colour of a trial or a robot."""
    return CYCLE[number % len(CYCLE)]


def legend(axes: Axes, entries: int, width: float = SCREEN, below: bool = False, **more: Any) -> None:
    """Put the legend inside, or, when it is long or is to be, below axes of a width [inches]."""
    if entries <= _INSIDE and not below:
        axes.legend(loc="best", **more)
        return
    look: dict[str, Any] = {"columnspacing": 1.0, "handletextpad": 0.5, "borderaxespad": 0, "handlelength": 1.6}
    look = {"ncols": _columns(width), **look, **more}
    place = axes.transAxes + ScaledTranslation(0, -_BELOW, axes.figure.dpi_scale_trans)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 0), bbox_transform=place, **look)


def ticks(is_whole: bool, most: int = 9) -> MaxNLocator:
    """Return what puts so many ticks to an axis at most; at whole numbers alone, if that is wanted, be it only one."""
    return MaxNLocator(nbins=most, integer=is_whole, min_n_ticks=1 if is_whole else 2)


def note(axes: Axes, said: str) -> None:
    """Say something above the axes, in small letters."""
    axes.set_title(said, fontweight="normal", fontsize=7.5)


def _columns(width: float) -> int:
    return max(2, int(width / _ENTRY))

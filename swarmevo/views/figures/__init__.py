# SPDX-License-Identifier: BSD-3-Clause
"""The paper's figures and ours, with matplotlib: for a notebook, a report or a paper.

Every function takes a run (its folder, or an open :class:`~swarmevo.runs.store.Store`) and returns a figure, which
shows itself in a notebook:

>>> from swarmevo.views import figures
>>> figures.fronts("runs/first")                                # doctest: +SKIP
>>> figures.paths("runs/first").savefig("paths.pdf")            # doctest: +SKIP

Nothing global is touched: no pyplot, no style. Colours are those of Okabe and Ito, which people with any kind of colour
vision can tell apart; lines and markers differ too, for print without colour.
"""

from swarmevo.views.figures.behaviour import occupancy, paths
from swarmevo.views.figures.maps import behaviour_map
from swarmevo.views.figures.networks import has_network, network
from swarmevo.views.figures.objectives import attainment, evolution, fronts, hypervolume
from swarmevo.views.figures.source import Run
from swarmevo.views.figures.style import CYCLE, INK, MARKERS, STYLES, Picture
from swarmevo.views.figures.writing import every, svg, write

__all__ = [
    "CYCLE", "INK", "MARKERS", "STYLES", "Picture", "Run", "attainment", "behaviour_map", "every", "evolution",
    "fronts", "has_network", "hypervolume", "network", "occupancy", "paths", "svg", "write",
]  # fmt: skip

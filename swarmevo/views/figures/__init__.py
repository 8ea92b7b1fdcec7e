# SPDX-License-Identifier: BSD-3-Clause
"""The paper's figures and ours, with matplotlib: for a notebook, a report or a paper.

Every function takes a run (its folder, or an open :class:`~swarmevo.runs.store.Store`) and returns a figure, which
shows itself in a notebook:

>>> from swarmevo.views import figures
>>> figures.fronts("runs/first")                                # doctest: +SKIP
>>> figures.paths("runs/first").savefig("paths.pdf")            # doctest: +SKIP

A figure is as wide as a paper's column, 3.5 inches, or as ``width`` says: ``figures.PAGE`` is 7. ``paper`` is a plate
of the paper's Figs. 3 to 5.

Nothing global is touched: no pyplot, no style. Colours are those of Okabe and Ito, which people with any kind of colour
vision can tell apart; lines and markers differ too, for print without colour.
"""

from swarmevo.views.figures.behaviour import occupancy, paths
from swarmevo.views.figures.course import evolution, hypervolume, hypervolume_of_runs
from swarmevo.views.figures.maps import behaviour_map
from swarmevo.views.figures.networks import has_network, network
from swarmevo.views.figures.objectives import attainment, fronts, fronts_of_runs
from swarmevo.views.figures.plate import paper
from swarmevo.views.figures.source import Run
from swarmevo.views.figures.style import COLUMN, CYCLE, INK, MARKERS, PAGE, SCREEN, STYLES, Picture
from swarmevo.views.figures.writing import every, svg, write

__all__ = [
    "COLUMN", "CYCLE", "INK", "MARKERS", "PAGE", "SCREEN", "STYLES", "Picture", "Run", "attainment", "behaviour_map",
    "every", "evolution", "fronts", "fronts_of_runs", "has_network", "hypervolume", "hypervolume_of_runs", "network",
    "occupancy", "paper", "paths", "svg", "write",
]  # fmt: skip

# SPDX-License-Identifier: BSD-3-Clause
"""The page itself, which asks its server for all that it shows."""

from __future__ import annotations

from typing import Final

from swarmevo._version import __version__
from swarmevo.views import html
from swarmevo.views.replay import page as replay_page

_PACKAGE: Final = "swarmevo.views.dashboard"  # of the assets
_REPORT: Final = "swarmevo.views.report"  # whose charts and styles these are


def render() -> str:
    """Return the page."""
    return html.render(
        "dashboard/page.html.jinja",
        title="swarmevo",
        player=replay_page.player(),
        styles=[html.asset(_REPORT, "report.css"), html.asset(_PACKAGE, "dashboard.css")],
        scripts=[
            html.asset(_REPORT, "charts.js"),
            html.asset(_PACKAGE, "lines.js"),
            html.asset(_PACKAGE, "list.js"),
            html.asset(_PACKAGE, "run.js"),
            html.asset(_PACKAGE, "dashboard.js"),
        ],
        version=__version__,
    )

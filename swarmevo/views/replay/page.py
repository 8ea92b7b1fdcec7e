# SPDX-License-Identifier: BSD-3-Clause
"""An episode of a run, simulated once more, as one HTML file that plays it with the network off.

The page holds meshcat's viewer, the scene as meshcat commands (``scene.py``), the episode as small integers
(``data.py``) and a player (``assets/``) that moves the scene. A baked meshcat animation would name each node and time
in every keyframe, and could draw neither trails nor plots; this way 180 s of five robots take about 0.2 MB, and one
player shows any number of episodes.
"""

from __future__ import annotations

import importlib.resources
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

from markupsafe import Markup

from swarmevo.views import html

_PACKAGE: Final = "swarmevo.views.replay"  # of the assets
_PARTS: Final = (
    *("basics", "track", "senses", "floor", "camera", "scene"),
    *("plot", "network", "events", "team", "stage", "menu", "keys", "player"),
)  # of our player


@dataclass(frozen=True)
class Player:
    """What a page needs once to play episodes."""

    style: Markup
    licences: Markup
    """Of the viewer, for a comment."""
    viewer: Markup
    """meshcat's, a script."""
    parts: list[Markup]
    """Of our player: scripts that share a scope."""


def render(episodes: Sequence[dict[str, Any]], title: str, live: bool = False) -> str:
    """Return one HTML page that plays episodes, side by side if there are several.

    Args:
        episodes: Of :func:`swarmevo.views.replay.data.data`.
        title: Of the page.
        live: The page asks its server for the episodes, one after the other.
    """
    return html.render(
        "replay/page.html.jinja",
        title=title,
        player=player(),
        episodes=list(episodes),
        live=live,
        script=html.asset(_PACKAGE, "replay_page.js"),
    )


@cache
def player() -> Player:
    """Return meshcat's viewer and our player, for ``shared/page.html.jinja``."""
    viewer = importlib.resources.files("meshcat") / "viewer"
    licences = [(viewer / name).read_text(encoding="utf-8") for name in ("LICENSE", "dist/main.min.js.LICENSE.txt")]
    return Player(
        style=html.asset(_PACKAGE, "player.css"),
        licences=html.comment("meshcat's viewer, with three.js:\n\n" + "\n".join(licences)),
        viewer=html.script((viewer / "dist" / "main.min.js").read_text(encoding="utf-8")),
        parts=[html.asset(_PACKAGE, f"player/{part}.js") for part in _PARTS],
    )

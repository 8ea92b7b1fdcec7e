# SPDX-License-Identifier: BSD-3-Clause
"""An episode of a run, simulated once more, as one HTML file that plays it with the network off.

The page holds meshcat's viewer, the scene as meshcat commands (``replay_scene.py``), the episode as small integers and
a player (``assets/``) that moves the scene. A baked meshcat animation would name each node and time in every
keyframe, and could draw neither trails nor plots; this way 180 s of five robots take about 0.2 MB, and one player shows
any number of episodes.
"""

from __future__ import annotations

import html
import importlib.resources
import json
from collections.abc import Sequence
from functools import cache
from typing import Any


def render(episodes: Sequence[dict[str, Any]], title: str, live: bool = False) -> str:
    """Return one HTML page that plays episodes, side by side if there are several.

    Args:
        episodes: Of :func:`data`.
        title: Of the page.
        live: The page asks its server for the episodes, one after the other.
    """
    page = _asset("page.html")
    content = {"title": html.escape(title), "head": page_head(), "episodes": json_script("episodes", list(episodes))}
    content["live"] = "true" if live else "false"
    for name, value in content.items():
        page = page.replace(f"<!--{name}-->", value)
    return page


@cache
def page_head() -> str:
    """Return what a page needs once to play episodes: style, meshcat's viewer and the player."""
    viewer = importlib.resources.files("meshcat") / "viewer"
    licences = [(viewer / name).read_text(encoding="utf-8") for name in ("LICENSE", "dist/main.min.js.LICENSE.txt")]
    bundle = (viewer / "dist" / "main.min.js").read_text(encoding="utf-8")
    notice = "meshcat's viewer, with three.js:\n\n" + "\n".join(licences).replace("--", "- -")
    return "\n".join(
        [
            f"<style>{_asset('replay_player.css')}</style>",
            f"<!-- {notice} -->",
            f"<script>{_script(bundle)}</script>",
            f"<script>{_script(_asset('replay_player.js'))}</script>",
        ]
    )


def json_script(id: str, value: object) -> str:
    """Return ``value`` as a JSON block of a page, safe whatever text is in it."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return f'<script type="application/json" id="{html.escape(id)}">{text}</script>'


def _script(text: str) -> str:
    """Return a script that no closing tag in it can end."""
    return text.replace("</script", "<\\/script")


def _asset(name: str) -> str:
    return (importlib.resources.files("swarmevo.views.replay") / "assets" / name).read_text(encoding="utf-8")

# SPDX-License-Identifier: BSD-3-Clause
"""What objects show of themselves in a notebook."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from swarmevo.views import html, text


def facts(title: str, entries: Mapping[str, str]) -> str:
    """Return names and values under a title."""
    return html.render("shared/notebook_facts.html.jinja", title=title, entries=entries)


def table(title: str, rows: Sequence[Mapping[str, Any]]) -> str:
    """Return rows that have the same columns under a title."""
    cells = [[value for _, value in named(row)] for row in rows]
    heads = [name for name, _ in named(rows[0])] if rows else []
    return html.render("shared/notebook_table.html.jinja", title=title, heads=heads, rows=cells)


def frame(page: str) -> str:
    """Return a whole page inside a frame."""
    return html.render("shared/notebook_frame.html.jinja", page=page)


def named(row: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return names of code and their values as people read them."""
    return [(text.words(name), _shown(name, value)) for name, value in row.items()]


def _shown(name: str, value: Any) -> str:
    if name.endswith("_time"):
        return text.time_taken(value)
    if name.endswith("_rate"):
        return text.percent(value)
    return text.number(value) if isinstance(value, float) else str(value)

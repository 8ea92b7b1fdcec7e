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
    cells = [[cell(value) for value in row.values()] for row in rows]
    heads = [text.words(name) for name in rows[0]] if rows else []
    return html.render("shared/notebook_table.html.jinja", title=title, heads=heads, rows=cells)


def frame(page: str) -> str:
    """Return a whole page inside a frame."""
    return html.render("shared/notebook_frame.html.jinja", page=page)


def cell(value: Any) -> str:
    """Return a value of a table as text."""
    if value is None:
        return "never"
    return text.number(value) if isinstance(value, float) else str(value)

# SPDX-License-Identifier: BSD-3-Clause
"""Where results go, stdout, and how tables look there."""

from __future__ import annotations

import sys
from typing import Any, Final

from rich.console import Console
from rich.table import Table
from rich.text import Text

from swarmevo.printable import printable

_PIPE_WIDTH: Final = 1000
"""[characters]: in a pipe no row is wrapped or cut."""


class _Plain(Console):
    """A console that shows the control characters in text, such as a plugin's name, and never sends them."""

    def render_str(self, text: str, **how: Any) -> Text:
        """Return text as it is printed, alone or in a table."""
        return super().render_str(printable(text, keep="\n\t"), **how)


def stdout() -> Console:
    """Return stdout, as wide as the terminal; nothing that is printed there is taken for markup."""
    width = None if sys.stdout.isatty() else _PIPE_WIDTH
    return _Plain(width=width, highlight=False, markup=False)  # a plugin's name may have brackets


def table(*columns: str, right: bool = False) -> Table:
    """Return an empty table with these heads; ``right``: its cells are aligned to the right."""
    made = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    for column in columns:
        made.add_column(column, justify="right" if right else "left", overflow="fold")
    return made

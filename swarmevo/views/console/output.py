# SPDX-License-Identifier: BSD-3-Clause
"""Where results go, stdout, and how tables look there."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Sequence
from typing import Any, Final

from rich.console import Console
from rich.table import Table
from rich.text import Text

from swarmevo.printable import printable

_PIPE_WIDTH: Final = 1000
"""[characters]: in a pipe no row is wrapped or cut."""
_KEPT: Final = "\N{NO-BREAK SPACE}"


class _Plain(Console):
    """A console that shows the control characters in text, such as a plugin's name, and never sends them.

    In a table that is wider than the terminal, names of columns are broken at underscores; where that is not enough, it
    is printed as lists, row by row: its cells would be broken within words.
    """

    def print(self, *objects: Any, **how: Any) -> None:
        """Print as Rich does."""
        super().print(*map(self._fitted, objects), **how)

    def _fitted(self, one: Any) -> Any:
        if not isinstance(one, Table) or self._width_of(one) <= self.width:
            return one
        heads = [printable(str(column.header), keep="\n").replace("\n", " ") for column in one.columns]
        for column in one.columns:
            column.header = str(column.header).replace("_", "_\n")
        if self._width_of(one) <= self.width:
            return one
        rows = zip(*(column.cells for column in one.columns), strict=True)
        return "\n".join(_listed(heads, [printable(str(cell)) for cell in row], self.width) for row in rows)

    def _width_of(self, table: Table) -> int:
        return self.measure(table, options=self.options.update(width=_PIPE_WIDTH)).maximum

    def render_str(self, text: str, **how: Any) -> Text:
        """Return text as it is printed, alone or in a table."""
        return super().render_str(printable(text, keep="\n\t"), **how)


def _listed(heads: Sequence[str], cells: Sequence[str], width: int) -> str:
    """Return a row as names and values, which stay together; a cell without a name belongs to the one before."""
    pairs: list[str] = []
    for head, cell in zip(heads, cells, strict=True):
        if head or not pairs:
            pairs.append(f"{head} {cell}".strip())
        elif cell:
            pairs[-1] += f" {cell}"
    kept = ", ".join(pair.replace(" ", _KEPT) for pair in pairs)
    lines = textwrap.wrap(kept, width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
    return "\n".join(lines).replace(_KEPT, " ")


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

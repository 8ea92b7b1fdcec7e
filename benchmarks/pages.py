# SPDX-License-Identifier: BSD-3-Clause
"""What pages of docs/results have in common."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from swarmevo.analysis.statistics import wilson


def table(head: Sequence[str], rows: Iterator[Sequence[str]] | Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in (head, ["---"] + ["---:"] * (len(head) - 1), *rows)]
    return "\n".join(lines) + "\n"


def rate(share: float, tests: int) -> str:
    low, high = wilson(share * tests, tests)
    return f"{100 * share:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def seconds(time: float | None) -> str:
    return "never" if time is None else f"{time:.1f} s"

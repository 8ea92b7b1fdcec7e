# SPDX-License-Identifier: BSD-3-Clause
"""Progress on stderr: bars on a terminal, little or nothing elsewhere."""

from __future__ import annotations

import io
from collections.abc import Callable
from contextlib import AbstractContextManager

import pytest
from rich.console import Console

from swarmevo.views import console
from swarmevo.views.console import bars, output

Counter = Callable[[], AbstractContextManager[bars.Observe]]

counters = pytest.mark.parametrize(
    ("counter", "said"), [(console.tests, "3 of 8 episodes"), (console.evaluations, "3 of 8 evaluations")]
)


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    """Return what is written to a terminal in the place of stderr."""
    written = io.StringIO()
    monkeypatch.setattr(bars, "terminal", lambda: Console(file=written, force_terminal=True, width=60))
    return written


@counters
def test_a_bar_on_a_terminal_counts(counter: Counter, said: str, terminal: io.StringIO) -> None:
    with counter() as observe:
        observe(3, 8)
    assert said in terminal.getvalue()
    assert "of 100" not in terminal.getvalue()  # before the total is known


@counters
def test_elsewhere_nothing_is_counted(counter: Counter, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    with counter() as observe:
        observe(3, 8)
    assert capsys.readouterr() == ("", "")


def test_frames_on_a_terminal(terminal: io.StringIO) -> None:
    with console.frames(20) as observe:
        observe(7)
    assert "frame 7 of 20" in terminal.getvalue()


def test_frames_elsewhere_are_told_now_and_then(capsys: pytest.CaptureFixture[str]) -> None:
    with console.frames(20) as observe:
        for done in range(1, 21):
            observe(done)
    assert capsys.readouterr().err.splitlines() == [f"frame {done} of 20" for done in (5, 10, 15, 20)]


def on_a_terminal(width: int) -> str:
    """Return a table of two rows as a terminal of some width shows it; the third column belongs to the second."""
    table = output.table("hidden_neurons\n(minimise)", "homing rate", "", "trial", right=True)
    table.add_row("5", "100% (34-100)", "(paper)", "0")
    table.add_row("12", "50%", "", "1")
    written = io.StringIO()
    output._Plain(file=written, width=width, markup=False).print(table)
    return written.getvalue()


def test_a_table_has_columns_where_there_is_room() -> None:
    head, names, *rows = on_a_terminal(60).splitlines()
    assert head.split() == ["hidden_neurons"]
    assert names.split() == ["(minimise)", "homing", "rate", "trial"]
    assert [row.split() for row in rows] == [["5", "100%", "(34-100)", "(paper)", "0"], ["12", "50%", "1"]]


def test_a_table_with_little_room_has_narrow_heads() -> None:
    first, second, last, *rows = on_a_terminal(40).splitlines()
    assert (first.split(), second.split()) == (["hidden_"], ["neurons"])
    assert last.split() == ["(minimise)", "homing", "rate", "trial"]
    assert rows[0].split() == ["5", "100%", "(34-100)", "(paper)", "0"]


def test_a_table_without_room_is_a_list() -> None:
    """Names and values stay together, and no word is broken."""
    assert on_a_terminal(36).splitlines() == [
        "hidden_neurons (minimise) 5,",
        "  homing rate 100% (34-100) (paper),",
        "  trial 0",
        "hidden_neurons (minimise) 12,",
        "  homing rate 50%, trial 1",
    ]

# SPDX-License-Identifier: BSD-3-Clause
"""Case 26: what a terminal would obey is shown."""

from __future__ import annotations

import pytest

from swarmevo.cli import common
from swarmevo.printable import printable
from swarmevo.views.console import output


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\x1b[2Jx", r"\x1b[2Jx"),
        ("a\nb\tc\rd", r"a\nb\tc\rd"),
        ("\udcff", r"\udcff"),
        ("\u202etxt", r"\u202etxt"),
        ("\x9b31m", r"\x9b31m"),
        ("5\N{NO-BREAK SPACE}s, \u00fcber, $x$", "5\N{NO-BREAK SPACE}s, \u00fcber, $x$"),
    ],
)
def test_what_acts_and_is_not_seen_is_escaped(text: str, shown: str) -> None:
    assert printable(text) == shown


def test_some_characters_may_be_kept() -> None:
    assert printable("a\n\x1b", keep="\n") == "a\n\\x1b"


def test_errors_are_single_lines_without_control_characters(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        common.exit_with(1, "run \x1b[2J\nerror: all is well")
    assert capsys.readouterr().err == "error: run \\x1b[2J\\nerror: all is well\n"


def test_neither_lines_nor_tables_send_control_characters(capsys: pytest.CaptureFixture[str]) -> None:
    out, table = output.stdout(), output.table("head\x1b]0;\x07\nsecond line")
    table.add_row("cell\x1b[2J")
    out.print(table)
    out.print("line\x1b[2J")
    shown = capsys.readouterr().out
    assert "\x1b" not in shown
    assert "\x07" not in shown
    assert [line.rstrip() for line in shown.splitlines()] == [
        r"head\x1b]0;\x07", "second line", r"cell\x1b[2J", r"line\x1b[2J",
    ]  # fmt: skip

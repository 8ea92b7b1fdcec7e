# SPDX-License-Identifier: BSD-3-Clause
"""What objects and sensors cost: that every scene of the page can be timed."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

# The benchmarks are not installed. At the end of the path: the installed swarmevo comes first.
sys.path.append(str(Path(__file__).parents[2]))

from benchmarks import scenes


@pytest.fixture(autouse=True)
def _short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scenes, "EPISODES", 2)
    monkeypatch.setattr(scenes, "HORIZON", 1.0)


def test_the_page_has_a_row_for_every_scene(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["scenes", "--rounds", "1"])
    scenes.main()
    out = capsys.readouterr().out
    rows = [line.split(" | ")[0].removeprefix("| ") for line in out.splitlines() if line.startswith("| ")]
    names = [name for one in scenes.COMPARISONS for name in one.scenes] + list(scenes.BY_HAND)
    assert [row for row in rows if row != "|"] == names
    assert rows.count("|") == len(scenes.COMPARISONS) + 1  # heads of tables
    assert "nan" not in out


def test_by_hand_only_the_library_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a clock that goes on by one with each look, observing and moving take one each."""
    looks = iter(range(10**6))
    monkeypatch.setattr(scenes.time, "process_time", lambda: float(next(looks)))
    (explore, _) = (scenes.ByHand(scenes.CROWDS["and range_and_bearing"], make) for make in scenes.BY_HAND.values())
    assert explore.steps == 2 * 20 * 10
    assert explore.seconds() == 2 * 10

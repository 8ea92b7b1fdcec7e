# SPDX-License-Identifier: BSD-3-Clause
"""Showing a run."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from cli.conftest import Swarmevo
from swarmevo.views import console

GLOSSARY = Path(__file__).parents[2] / "docs" / "glossary.md"


def test_show_as_json(swarmevo_: Swarmevo) -> None:
    swarmevo_("evolve", "small.yaml", "--seed", 1, "--out", "run")
    done = swarmevo_("show", "run", "--json")
    summary = json.loads(done.out)
    assert summary["seed"] == 1
    assert summary["complete"] is True
    assert [len(trial["history"]) for trial in summary["trials"]] == [2, 2]
    assert all(step["hypervolume"] >= 0 for trial in summary["trials"] for step in trial["history"])
    assert set(summary["front"][0]["objectives"]) == {"box_pushing", "hidden_neurons"}
    assert summary["cost"]["episodes"] == 16


def test_the_hypervolume_is_what_the_glossary_says(swarmevo_: Swarmevo) -> None:
    """Held against the area of two objectives by hand; compare and sweep have tests of their own."""
    (told,) = re.findall(r"^\*\*hypervolume\*\*\n: (.*?)\n\n", GLOSSARY.read_text(), re.MULTILINE | re.DOTALL)
    assert "`swarmevo show`, `report` and `dashboard` give it in the objectives' own units, `swarmevo compare`" in told
    swarmevo_("evolve", "small.yaml", "--seed", 1, "--out", "run")
    summary = json.loads(swarmevo_("show", "run", "--json").out)
    first, second = summary["objectives"]
    assert (first["direction"], second["direction"]) == ("maximise", "minimise")
    for trial in summary["trials"]:
        points = [list(point["objectives"].values()) for point in trial["front"]]
        area, best = 0.0, first["range"][0]
        for gain, size in sorted(points, key=lambda point: (point[1], -point[0])):
            area += max(gain - best, 0.0) * (second["range"][1] - size)
            best = max(gain, best)
        assert trial["history"][-1]["hypervolume"] == pytest.approx(area)
        assert area > 1.0  # no share


def test_show_of_what_is_no_run(swarmevo_: Swarmevo) -> None:
    Path("empty").mkdir()
    done = swarmevo_("show", "empty")
    assert (done.code, done.out) == (1, "")
    assert done.errors == ["empty: expected a run folder, but there is no run.sqlite in it"]


@pytest.mark.parametrize(
    ("values", "line"),
    [
        ([1.0], "▁"),
        ([0.0, 7.0], "▁█"),
        ([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0], "▁▂▃▄▅▆▇█"),
        ([3.0, 3.0], "▁▁"),
    ],
)
def test_sparkline(values: list[float], line: str) -> None:
    assert console.sparkline(values) == line


def test_a_long_sparkline_keeps_its_ends() -> None:
    line = console.sparkline(np.linspace(0, 1, 1000).tolist())
    assert len(line) == 60
    assert (line[0], line[-1]) == ("▁", "█")

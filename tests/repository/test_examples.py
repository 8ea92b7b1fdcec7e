# SPDX-License-Identifier: BSD-3-Clause
"""The notebooks in examples/ run, and everything that they show can be shown."""

from __future__ import annotations

import ast
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from swarmevo import config

EXAMPLES = Path(__file__).parents[2] / "examples"
SHORT = ["episode.horizon=6.0", "evolution.population=4"]


def cells(notebook: Path) -> Iterator[str]:
    """Yield the programs of a notebook."""
    for cell in json.loads(notebook.read_text())["cells"]:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []  # no page of a megabyte, no path of somebody's machine
            yield "".join(cell["source"])


def run(program: str, names: dict[str, Any]) -> Any:
    """Run a cell as Jupyter does; return what its last expression is."""
    *body, last = ast.parse(program).body
    exec(compile(ast.Module(body, []), "cell", "exec"), names)
    if isinstance(last, ast.Expr):
        return eval(compile(ast.Expression(last.value), "cell", "eval"), names)
    return exec(compile(ast.Module([last], []), "cell", "exec"), names)


def test_there_are_examples() -> None:
    assert list(EXAMPLES.glob("*.ipynb"))


@pytest.mark.parametrize("notebook", sorted(EXAMPLES.glob("*.ipynb")), ids=lambda path: path.name)
def test_a_notebook_runs_and_shows_its_objects(notebook: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    load = config.load
    monkeypatch.setattr(config, "load", lambda *arguments: config.changed(load(*arguments), SHORT))
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    shown = 0
    for program in cells(notebook):
        found = run(program, names)
        for name in ("_repr_html_", "_repr_png_"):
            if hasattr(found, name) and getattr(found, name)():
                shown += 1
    assert shown >= 8

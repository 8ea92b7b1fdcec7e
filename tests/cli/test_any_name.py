# SPDX-License-Identifier: BSD-3-Clause
"""Case 24: an objective with a name that is markup in every language, at every verb that shows it."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import toy_plugins
from swarmevo import cli
from swarmevo.runs import driver
from swarmevo.runs.store import Store

NAME = r"=$\frac{x$ <b>[red]{{1}},loss"


@pytest.fixture
def run(tmp_path: Path, distribution: Callable[..., Any]) -> Path:
    toy_plugins.install(distribution)
    fitness = {"toy_neurons": {}, "toy_bad_fitness": {"fault": f"named {NAME}"}}
    driver.begin(tmp_path / "run", toy_plugins.config(fitness=fitness))
    with Store.open(tmp_path / "run", readonly=False) as store:
        driver.evolve(store, 1, lambda now: None)
    return tmp_path / "run"


def test_a_name_is_shown_as_it_is(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def swarmevo(*arguments: object) -> str:
        with pytest.raises(SystemExit) as ended:
            cli.main([str(argument) for argument in arguments])
        assert ended.value.code == 0
        return capsys.readouterr().out

    assert NAME in swarmevo("show", run)
    rows = list(csv.reader(swarmevo("export", run, "--csv").splitlines()))
    assert f"'{NAME}" in rows[0]
    assert {len(row) for row in rows} == {len(rows[0])}
    swarmevo("report", run, "--html", tmp_path / "report.html", "--figures", tmp_path / "figures")
    page = (tmp_path / "report.html").read_text()
    assert "<b>[red]" not in page
    assert "&lt;b&gt;[red]" in page

# SPDX-License-Identifier: BSD-3-Clause
"""The map of behaviours that an optimiser keeps, against all that its run stored."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swarmevo as se
import toy_plugins
from swarmevo.analysis.elites import elites
from swarmevo.errors import PluginError, StoreError
from swarmevo.runs import driver
from swarmevo.runs.store import Store
from swarmevo.views.report import page as report
from swarmevo_rivals.map_elites import MapElites

Cell = tuple[int, ...]


@pytest.fixture(autouse=True)
def _toys(distribution: Any) -> None:
    toy_plugins.install(distribution)


def run(folder: Path, optimiser: dict[str, Any], **more: Any) -> Path:
    config = toy_plugins.config(
        optimiser=optimiser,
        fitness=["toy_travel", "toy_neurons", "toy_places"],
        team={"start": "random"},
        evolution={"generations": 4},
        **more,
    )
    driver.begin(folder, config)
    with Store.open(folder, readonly=False) as store:
        driver.evolve(store, 2, lambda now: None)
    return folder


def best_of_each_cell(store: Store, trial: int, cells: int, column: int) -> dict[Cell, tuple[float, bytes]]:
    """Return cost and genome of the best of each cell, of what each generation says; of equal ones the first."""
    objective = store.objectives[column]
    best: dict[Cell, tuple[float, bytes]] = {}
    for number in range(store.generations(trial)):
        kept = store.generation(trial, number)
        values = kept.episodes.grid("objective").mean(axis=1)[:, column]
        costs = -values if objective.direction == "maximise" else values
        places = kept.episodes.grid("descriptor").mean(axis=1)
        for genome, cost, place in zip(kept.genomes, costs.tolist(), places, strict=True):
            cell = tuple(min(cells - 1, int((x + 0.5) * cells)) for x in place)
            if cell not in best or cost < best[cell][0]:
                best[cell] = cost, genome.tobytes()
    return best


@pytest.mark.parametrize(
    ("optimiser", "cells", "objective"),
    [
        ({"map_elites": {"cells": 4}}, 4, "travel"),
        ({"map_elites": {"cells": 7, "objective": "distance"}}, 7, "distance"),
        ({"cma_mae": {"cells": 5, "emitters": 1}}, 5, "travel"),
    ],
)
def test_the_map_has_the_best_of_each_cell(
    tmp_path: Path, optimiser: dict[str, Any], cells: int, objective: str
) -> None:
    folder = run(tmp_path / "run", optimiser)
    with Store.open(folder) as store:
        column = [one.name for one in store.objectives].index(objective)
        worst, sign = {"travel": (0.0, -1), "distance": (1.0, 1)}[objective]
        expected = [best_of_each_cell(store, trial, cells, column) for trial in (0, 1)]
        for trial, best in enumerate(expected):
            found = elites(store, trial)
            assert found is not None
            assert (found.cells, found.objective.name) == ((cells, cells), objective)
            kept = {
                tuple(place): store.genome(point.genome).tobytes()
                for place, point in zip(found.places.tolist(), found.points, strict=True)
            }
            assert kept == {cell: genome for cell, (_, genome) in best.items()}
            assert len(kept) >= 3
            assert found.coverage == len(kept) / cells**2
            assert found.qd_score == pytest.approx(sum(abs(worst - sign * cost) for cost, _ in best.values()))
        both = elites(store)
    assert both is not None
    merged = {cell: min(best[cell][0] for best in expected if cell in best) for cell in itertools.chain(*expected)}
    assert dict(zip(map(tuple, both.places.tolist()), sign * both.values, strict=True)) == pytest.approx(merged)


def test_an_optimiser_without_a_map_has_no_elites(tmp_path: Path) -> None:
    folder = run(tmp_path / "run", {"toy_search": {}})
    assert se.open(folder).elites() is None


def test_a_report_draws_the_map_of_the_optimiser(tmp_path: Path) -> None:
    folder = run(tmp_path / "run", {"map_elites": {"cells": 4}})
    with Store.open(folder) as store:
        found = elites(store)
    assert found is not None
    picture = se.figures.behaviour_map(folder)
    (mesh,) = picture.axes[0].collections
    drawn = np.ma.filled(mesh.get_array(), np.nan).reshape(4, 4)
    expected = np.full((4, 4), np.nan)
    for (x, y), value in zip(found.places, found.values, strict=True):
        expected[y, x] = value
    assert np.array_equal(drawn, expected, equal_nan=True)
    assert picture.axes[0].get_title("left") == f"map of map_elites: {len(found.points)} of 16 cells filled"
    assert "of map_elites: " in report.page([folder])


def test_where_the_optimiser_is_not_installed_all_individuals_are_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = run(tmp_path / "run", {"map_elites": {"cells": 4}})

    def missing(kind: str, name: str) -> Any:
        raise PluginError(f"optimiser.{name}: not installed")

    monkeypatch.setattr("swarmevo.plugins.registry.find", missing)
    title = se.figures.behaviour_map(folder).axes[0].get_title("left")
    assert title.startswith("no map of map_elites here, all individuals: ")
    assert title.endswith(" of 400 cells filled")


def test_elites_in_python(tmp_path: Path) -> None:
    folder = run(tmp_path / "run", {"map_elites": {"cells": 4}})
    found = se.open(folder).elites(trial=1)
    assert found is not None
    assert repr(found) == f"<Elites of run: {len(found)} individuals; travel>"
    assert found.places.shape == (len(found), 2)
    assert found.best().objectives["travel"] == max(one.objectives["travel"] for one in found)
    assert {one.trial for one in found} == {1}
    assert found.coverage == len(found) / 16
    assert repr(found[:2]) == "<Elites of run: 2 individuals; travel>"
    assert found[1:2].places.tolist() == found.places[1:2].tolist()
    low, high = 0, 3
    for one, (x, y) in zip(found, found.places, strict=True):
        assert min(high, max(low, int((one.descriptors["end_x"] + 0.5) * 4))) == x
        assert min(high, max(low, int((one.descriptors["end_y"] + 0.5) * 4))) == y


def test_a_trial_without_a_generation_has_no_map(tmp_path: Path) -> None:
    folder = run(tmp_path / "run", {"map_elites": {"cells": 4}})
    for trial in (2, -1):
        with pytest.raises(StoreError, match=f"expected a trial with a generation, got {trial}"):
            se.open(folder).elites(trial)
    driver.begin(tmp_path / "empty", toy_plugins.config())
    with pytest.raises(StoreError, match="expected a trial with a generation, got none"):
        se.open(tmp_path / "empty").elites()


def test_where_other_things_are_measured_now_it_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = run(tmp_path / "run", {"map_elites": {"cells": 4}})

    class Renamed(toy_plugins.Travel):
        objectives = (replace(toy_plugins.Travel.objectives[0], name="way"), toy_plugins.Travel.objectives[1])

    monkeypatch.setattr(toy_plugins, "Travel", Renamed)
    with pytest.raises(StoreError, match="install the versions of the plugins that the run began with"):
        se.open(folder).elites()
    title = se.figures.behaviour_map(folder).axes[0].get_title("left")
    assert title.startswith("no map of map_elites here, all individuals: ")


@pytest.mark.parametrize("cells", [0, -3])
def test_a_map_has_a_cell_at_least(tmp_path: Path, cells: int) -> None:
    folder = run(tmp_path / "run", {"map_elites": {"cells": 4}})
    with pytest.raises(ValueError, match=f"^behaviour_map: expected cells of at least 1, got {cells}$"):
        se.figures.behaviour_map(folder, cells)


def test_maps_of_trials_that_differ_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = run(tmp_path / "run", {"map_elites": {"cells": 4}})
    kept = MapElites.behaviour_map
    sizes = iter([4, 5])

    def differing(self: MapElites) -> Any:
        return replace(kept(self), cells=(next(sizes), 4))

    monkeypatch.setattr(MapElites, "behaviour_map", differing)
    with pytest.raises(PluginError, match="expected the same cells and objective in all trials"):
        se.open(folder).elites()

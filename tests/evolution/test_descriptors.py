# SPDX-License-Identifier: BSD-3-Clause
"""What a behaviour is like: measured, averaged, told to optimisers, stored, and refused where it is wrong."""

from __future__ import annotations

import csv
import io
import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import seals
import toy_plugins
from grids import results
from swarmevo import cli
from swarmevo.analysis import fronts
from swarmevo.api.runs import Run
from swarmevo.config import Config
from swarmevo.errors import ConfigError, EvaluationError, StoreError
from swarmevo.evolution.aggregation import OverWorlds
from swarmevo.evolution.evaluation import Evaluation, Evaluator
from swarmevo.evolution.loop import Progress
from swarmevo.plugins import option_errors
from swarmevo.protocols import Descriptor, FloatArray, Objective, Problem, takes_descriptors
from swarmevo.runs import driver, export
from swarmevo.runs.schema import DESCRIBED, SCHEMA_VERSION
from swarmevo.runs.store import Store
from swarmevo.runs.verification import verify
from swarmevo.testing import random_genomes
from swarmevo.views import figures
from swarmevo.views.report import page as report

PLACES = (Descriptor("end_x", (-0.5, 0.5)), Descriptor("end_y", (-0.5, 0.5)))


@pytest.fixture(autouse=True)
def _toys(distribution: Any) -> None:
    toy_plugins.install(distribution)


def described(**sections: Any) -> Config:
    return toy_plugins.config(**{"fitness": ["toy_travel", "toy_places"], **sections})


def bad(fault: str, always: bool = True, **sections: Any) -> Config:
    fitness = {"toy_travel": {}, "toy_bad_places": {"fault": fault, "always": always}}
    return toy_plugins.config(fitness=fitness, **sections)


def evaluate(config: Config, genomes: FloatArray | None = None, workers: int = 1) -> Evaluation:
    with Evaluator(config, workers) as evaluator:
        return evaluator.evaluate(random_genomes(evaluator.space, 5) if genomes is None else genomes, 0, 0)


def run(folder: Path, config: Config, until: int | None = None) -> Path:
    """Evolve; ``until``: only so many generations, then the process is as if it were killed."""

    class Enough(Exception):  # noqa: N818 - no error
        pass

    def observe(now: Progress) -> None:
        if until is not None and now.generation + 1 == until:
            raise Enough

    if not folder.exists():
        driver.begin(folder, config)
    with Store.open(folder, readonly=False) as store:
        if until is None:
            driver.evolve(store, 2, observe)
        else:
            with pytest.raises(Enough):
                driver.evolve(store, 2, observe)
    return folder


# ---- evaluations -----------------------------------------------------------------------------------------------------


def test_descriptors_are_means_over_the_episodes() -> None:
    found = evaluate(described())
    each = found.episodes.grid("descriptor")
    assert each.shape == (5, 2, 2)
    assert np.array_equal(found.descriptors, (each[:, 0] + each[:, 1]) / 2)
    assert np.unique(found.descriptors).size == 10


def test_descriptors_do_not_depend_on_workers_and_change_nothing_else() -> None:
    plain, one, two = (
        evaluate(config, workers=workers)
        for config, workers in ((toy_plugins.config(fitness=["toy_travel"]), 1), (described(), 1), (described(), 2))
    )
    assert one.descriptors.tobytes() == two.descriptors.tobytes()
    assert plain.costs.tobytes() == one.costs.tobytes()
    assert plain.episodes["hash"].tolist() == one.episodes["hash"].tolist()
    assert plain.descriptors.shape == (5, 0)


def test_descriptors_over_worlds_are_means_by_the_size_of_the_weights() -> None:
    """A world with a negative weight is not mirrored."""
    config = described(worlds=[{"team.robots": 2}, {"team.robots": 3, "weight": -3}])
    found = evaluate(config)
    world = found.episodes.grid("descriptor").reshape(5, 2, 2, 2).mean(axis=1)  # repeats, worlds
    np.testing.assert_allclose(found.descriptors, (world[:, 0] + 3 * world[:, 1]) / 4, rtol=1e-12)


def test_a_mean_leaves_out_the_episodes_that_failed() -> None:
    nan = np.nan
    descriptor = np.array([[[1.0], [nan], [3.0], [5.0]], [[nan], [2.0], [nan], [4.0]], [[nan]] * 4])
    shape = descriptor.shape[:2]
    episodes = results(
        objective=np.zeros((*shape, 1)),
        descriptor=descriptor,
        push_time=np.full(shape, nan),
        homing_time=np.full((*shape, 1), nan),
        ode_messages=np.zeros(shape),
        unsolved_steps=np.zeros(shape),
        hash=np.zeros(shape),
        world=np.array([[0, 1, 0, 1]] * 3, dtype=np.uint32),
    )
    config = Config.model_validate({"worlds": [{"weight": 1}, {"weight": 2}]})
    over = OverWorlds(config, [Objective("one", "maximise", (-9.0, 9.0))])
    np.testing.assert_array_equal(over.describe(episodes, 3), [[(2 + 2 * 5) / 3], [3.0], [nan]])


# ---- what optimisers are told ----------------------------------------------------------------------------------------


def test_an_optimiser_is_told_descriptors_and_the_problem(tmp_path: Path) -> None:
    folder = run(tmp_path / "run", described(optimiser="toy_described_search"))
    with Store.open(folder) as store:
        state = store.state(1)
        assert state is not None
        assert len(state["described"]) == 3
        for number, told in enumerate(state["described"]):
            kept = store.generation(1, number).episodes.grid("descriptor")
            assert told.tobytes() == ((kept[:, 0] + kept[:, 1]) / 2).tobytes()


def test_an_optimiser_that_takes_descriptors_is_told_none_where_there_are_none(tmp_path: Path) -> None:
    folder = run(tmp_path / "run", toy_plugins.config(optimiser="toy_described_search"))
    with Store.open(folder) as store:
        state = store.state(0)
        assert state is not None
        assert [told.shape for told in state["described"]] == [(4, 0), (5, 0), (6, 0)]


def test_what_an_optimiser_is_told_changes_nothing_for_one_that_takes_nothing_more(tmp_path: Path) -> None:
    plain = run(tmp_path / "plain", toy_plugins.config(fitness=["toy_travel"]))
    more = run(tmp_path / "more", described())
    with Store.open(plain) as one, Store.open(more) as two:
        for number in range(3):
            assert one.generation(0, number).genomes.tobytes() == two.generation(0, number).genomes.tobytes()


def test_the_problem_is_what_the_fitness_functions_measure(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Problem] = []
    made = toy_plugins.DescribedSearch.__init__

    def init(self: Any, space: Any, population: int, objectives: int, rng: Any, problem: Problem) -> None:
        seen.append(problem)
        made(self, space, population, objectives, rng, problem)

    monkeypatch.setattr(toy_plugins.DescribedSearch, "__init__", init)
    assert option_errors(described(optimiser="toy_described_search")) == []
    assert seen == [Problem(toy_plugins.Travel.objectives, PLACES)]


def test_who_takes_descriptors() -> None:
    class Optimiser:
        def tell(self, genomes: Any, costs: Any, *, descriptors: Any = None) -> None: ...

    class Wrapper:
        def tell(self, *told: Any) -> None: ...

    class Own:
        def tell(self, genomes: Any, costs: Any, weights: Any = None) -> None: ...

    class Third:
        def tell(self, genomes: Any, costs: Any, places: Any, /) -> None: ...

    class Named:
        def tell(self, genomes: Any, costs: Any, descriptors: Any = None) -> None: ...

    sorts: list[Any] = [Optimiser(), Wrapper(), Own(), Third(), Named()]
    assert [takes_descriptors(made) for made in sorts] == [False, False, False, True, True]


# ---- what is stored --------------------------------------------------------------------------------------------------


def test_descriptors_are_stored_and_kept_over_an_interruption(tmp_path: Path) -> None:
    config = described(optimiser="toy_described_search")
    whole, cut = run(tmp_path / "whole", config), run(tmp_path / "cut", config, until=2)
    run(cut, config)
    with Store.open(whole) as one, Store.open(cut) as two:
        assert one.descriptors == two.descriptors == PLACES
        for number in range(3):
            left, right = (store.generation(1, number).episodes["descriptor"] for store in (one, two))
            assert left.shape[1] == 2
            assert left.tobytes() == right.tobytes()
        assert json.dumps(one.state(1), default=repr) == json.dumps(two.state(1), default=repr)


def test_only_a_run_with_descriptors_is_of_another_version(tmp_path: Path) -> None:
    for name, config, version in (
        ("plain", toy_plugins.config(), SCHEMA_VERSION),
        ("described", described(), SCHEMA_VERSION + DESCRIBED),
    ):
        driver.begin(tmp_path / name, config)
        with Store.open(tmp_path / name) as store:
            assert store._rows("PRAGMA user_version") == [(version,)]
            tables = {table for (table,) in store._rows("SELECT name FROM sqlite_schema")}
            assert ("descriptor" in tables) == (version == SCHEMA_VERSION + DESCRIBED)


def test_a_run_is_verified_to_the_bit_and_a_changed_descriptor_is_found(tmp_path: Path) -> None:
    folder = run(tmp_path / "run", described())
    with Store.open(folder) as store:
        assert verify(store, 1).is_sound
    seals.change(folder, "UPDATE episode SET descriptor_1 = 0.25 WHERE (generation, individual, repeat) = (1, 0, 0)")
    with Store.open(folder) as store:
        found = verify(store, 1)
    assert [one.what for one in found.differences] == [("end_y",)] * 2


@pytest.mark.parametrize("change", ["UPDATE descriptor SET high = 0.75", "UPDATE descriptor SET name = name || '!'"])
def test_another_descriptor_is_refused(tmp_path: Path, change: str) -> None:
    folder = run(tmp_path / "run", described(), until=1)
    seals.change(folder, change)
    with (
        Store.open(folder, readonly=False) as store,
        pytest.raises(StoreError, match=r"expected the descriptors .*, the plugins now have .*end_x"),
    ):
        driver.evolve(store, 1, lambda now: None)


def test_a_damaged_descriptor_is_refused(tmp_path: Path) -> None:
    folder = run(tmp_path / "run", described(), until=1)
    with closing(sqlite3.connect(folder / "run.sqlite")) as database:
        database.execute("UPDATE descriptor SET high = 0.75 WHERE number = 1")
        database.commit()
    with pytest.raises(StoreError, match="what is known of the whole run is not as it was stored"):
        Store.open(folder)


def test_exports_have_descriptors_by_their_names(tmp_path: Path) -> None:
    folder = run(tmp_path / "run", described())
    with Store.open(folder) as store:
        as_csv, as_json = io.StringIO(), io.StringIO()
        export.write_csv(store, as_csv)
        export.write_json(store, as_json)
        stored = store.generation(0, 0).episodes["descriptor"]
    rows = list(csv.DictReader(io.StringIO(as_csv.getvalue())))
    assert [float(row["end_y"]) for row in rows[: len(stored)]] == stored[:, 1].tolist()
    written = json.loads(as_json.getvalue())
    assert written["descriptors"] == [{"name": one.name, "range": list(one.range)} for one in PLACES]
    place = list(written["columns"]).index("end_x")
    assert [row[place] for row in written["episodes"][: len(stored)]] == stored[:, 0].tolist()
    assert written["columns"]["end_x"].startswith("descriptor, from -0.5 to 0.5; ")


def test_a_front_tells_descriptors(tmp_path: Path) -> None:
    folder = run(tmp_path / "run", described())
    with Store.open(folder) as store:
        (best, *_) = fronts.front(store, 0)
        places = [
            store.generation(0, number).episodes.grid("descriptor")[place]
            for number in range(store.generations(0))
            for place in np.flatnonzero(store.genome_ids(0, number) == best.genome)
        ]
        mean = np.concatenate(places).mean(axis=0)
        assert best.descriptors == pytest.approx({"end_x": mean[0], "end_y": mean[1]}, rel=1e-12)
        assert fronts.summarise(store).descriptors == list(PLACES)
    row = Run(folder).front().rows[0]
    assert {"travel", "end_x", "end_y", "push_rate"} <= set(row)
    assert "descriptors" not in row


def test_show_as_json_has_descriptors(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = run(tmp_path / "run", described())
    with pytest.raises(SystemExit):
        cli.main(["show", str(folder), "--json"])
    summary = json.loads(capsys.readouterr().out)
    assert [one["name"] for one in summary["descriptors"]] == ["end_x", "end_y"]
    assert set(summary["front"][0]["descriptors"]) == {"end_x", "end_y"}


# ---- what is wrong ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ("no Descriptor", "descriptors: expected a Descriptor, got str"),
        ("an Objective", "descriptors: expected a Descriptor, got Objective"),
        ("no range", r"descriptors: end_x: expected as range two finite numbers, .* got \(1\.0, 1\.0\)"),
        ("blank", "descriptors: expected as name text that can be printed, got ' '"),
        ("not iterable", "descriptors raised TypeError"),
        ("none", "objectives: expected at least one, got none"),
        ("twins", "two objectives or descriptors are named 'end_x'"),
        ("an objective's name", "two objectives or descriptors are named 'travel'"),
        ("raises", "describe raised KeyError"),
        ("nan", "describe: expected finite numbers, got nan"),
        ("one", r"describe: expected an array of shape \(1, 2\), got \(1, 1\)"),
        ("three", r"describe: expected an array of shape \(1, 2\), got \(1, 3\)"),
        ("vector", r"describe: expected an array of shape \(1, 2\), got \(2,\)"),
        ("text", "describe: expected an array of numbers, got list of str_"),
        ("nothing", "describe: expected an array of numbers, got NoneType"),
        ("outside", r"describe: expected end_x in its range from -0\.5 to 0\.5, got [67]\."),
    ],
)
def test_a_wrong_descriptor_is_one_clear_line(fault: str, reason: str) -> None:
    with pytest.raises(EvaluationError, match=reason) as caught:
        evaluate(bad(fault))
    assert "\n" not in str(caught.value)
    assert "fitness.toy_bad_places (toys 1.0): " in str(caught.value) or "are named" in str(caught.value)


@pytest.mark.parametrize(("missing", "have"), [("describe", "descriptors"), ("descriptors", "describe")])
def test_half_of_what_describes_is_refused(missing: str, have: str) -> None:
    config = toy_plugins.config(fitness={"toy_travel": {}, "toy_half_described": {"missing": missing}})
    with pytest.raises(EvaluationError, match=f"expected descriptors and describe, got {have} alone"):
        evaluate(config)


def test_a_run_needs_an_objective() -> None:
    with pytest.raises(EvaluationError, match=r"^fitness: expected at least one objective, got none"):
        evaluate(toy_plugins.config(fitness=["toy_places"]))


def test_a_descriptor_with_the_name_of_a_column_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"^descriptor push_time: expected another name than that of a column"):
        driver.begin(tmp_path / "run", bad("a column's name"))
    assert not (tmp_path / "run").exists()


def test_an_episode_that_failed_has_no_descriptors(tmp_path: Path) -> None:
    """Some genomes fail in all their episodes; with on_fault=worst the run goes on."""
    config = bad("outside", always=False, evolution={"on_fault": "worst"}, optimiser="toy_described_search")
    folder = run(tmp_path / "run", config)
    with Store.open(folder) as store:
        kept = store.generation(0, 0)
        failed = kept.genomes[:, 0] > 0
        assert 0 < failed.sum() < len(failed)
        assert np.isnan(kept.episodes.grid("descriptor")).all(axis=(1, 2)).tolist() == failed.tolist()
        assert np.isnan(kept.episodes["descriptor"]).any(axis=1).tolist() == [bool(f) for f in kept.episodes.faults]
        told = "fitness.toy_bad_places (toys 1.0): describe: expected end_x in its range from -0.5 to 0.5, got "
        assert all(fault.startswith(told) for fault in kept.episodes.faults if fault)
        state = store.state(0)
        assert state is not None
        assert np.isnan(state["described"][0]).any(axis=1).tolist() == failed.tolist()
        assert verify(store, 1).is_sound
        points = fronts.front(store)
        assert all(point.descriptors["end_x"] is not None for point in points)
        text = io.StringIO()
        export.write_json(store, text)
    rows = json.loads(text.getvalue())
    place = list(rows["columns"]).index("end_x")
    assert {row[place] is None for row in rows["episodes"]} == {True, False}


def test_the_map_has_the_best_of_each_cell(tmp_path: Path) -> None:
    folder = run(tmp_path / "run", described(team={"start": "random"}))
    picture = figures.behaviour_map(folder, cells=4)
    (mesh,) = picture.axes[0].collections
    drawn = np.ma.filled(mesh.get_array(), np.nan)
    with Store.open(folder) as store:
        found = store.individuals()
    expected = np.full((4, 4), np.nan)
    for (x, y), travel in zip(found.descriptors, found.objectives[:, 0], strict=True):
        cell = min(3, int((y + 0.5) * 4)), min(3, int((x + 0.5) * 4))
        expected[cell] = np.nanmax([expected[cell], travel])
    assert np.isfinite(expected).sum() >= 3
    assert np.array_equal(drawn.reshape(4, 4), expected, equal_nan=True)
    assert picture.axes[0].get_title("left") == f"all individuals: {np.isfinite(expected).sum()} of 16 cells filled"
    assert "behaviour_map" in dict(figures.every(folder))
    assert "kind of behaviour" in report.page([folder])


def test_a_map_needs_two_descriptors(tmp_path: Path) -> None:
    folder = run(tmp_path / "run", toy_plugins.config())
    with pytest.raises(ValueError, match="behaviour_map: expected a run with two descriptors, got 0"):
        figures.behaviour_map(folder)
    assert "behaviour_map" not in dict(figures.every(folder))

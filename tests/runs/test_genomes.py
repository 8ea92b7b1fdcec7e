# SPDX-License-Identifier: BSD-3-Clause
"""Genomes from outside: what is read of files and runs, and what is refused in one line."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import small_runs
from swarmevo import config
from swarmevo.analysis import fronts
from swarmevo.errors import ConfigError, PluginError, StoreError
from swarmevo.plugins.team import Team
from swarmevo.protocols import FloatArray, GenomeSpace
from swarmevo.runs import driver, export, verification
from swarmevo.runs.folder import CONFIG_FILE, START_FILE
from swarmevo.runs.genomes import digest_of, read_genomes
from swarmevo.runs.store import Store
from swarmevo.simulation import EpisodeKey
from swarmevo.testing import random_genomes

QUICK = config.load("quick")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_runs.make(tmp_path_factory.mktemp("runs") / "run", "evolution.trials=1")


@pytest.fixture
def space() -> GenomeSpace:
    return Team(QUICK).space


@pytest.fixture
def genomes(space: GenomeSpace) -> FloatArray:
    return random_genomes(space, 3)


def written(folder: Path, content: object, name: str = "genomes.json") -> str:
    file = folder / name
    file.write_text(content if isinstance(content, str) else json.dumps(content))
    return str(file)


# ---- what is read ----------------------------------------------------------------------------------------------------


def test_plain_lists_and_rows(tmp_path: Path, space: GenomeSpace, genomes: FloatArray) -> None:
    rows = "\n".join(",".join(map(repr, row)) for row in genomes.tolist())
    for content, name in ((genomes.tolist(), "a.json"), ({"genomes": genomes.tolist()}, "b.json"), (rows, "c.csv")):
        np.testing.assert_array_equal(read_genomes(written(tmp_path, content, name), QUICK, space), genomes)
    one = read_genomes(written(tmp_path, genomes[0].tolist()), QUICK, space)
    np.testing.assert_array_equal(one, genomes[:1])
    row = written(tmp_path, rows.split("\n")[0], "one.txt")
    np.testing.assert_array_equal(read_genomes(row, QUICK, space), genomes[:1])


def test_an_exported_controller(run: Path, tmp_path: Path, space: GenomeSpace) -> None:
    with Store.open(run) as store:
        exported, genes = export.controller(store, 3), store.genome(3)
    np.testing.assert_array_equal(read_genomes(written(tmp_path, exported), QUICK, space)[0], genes)


def test_a_run_is_its_front_or_one_of_its_individuals(run: Path, space: GenomeSpace) -> None:
    with Store.open(run) as store:
        front = np.array([store.genome(point.genome) for point in fronts.front(store)])
        third = store.genome(3)
    np.testing.assert_array_equal(read_genomes(str(run), QUICK, space), front)
    np.testing.assert_array_equal(read_genomes(f"{run}:3", QUICK, space), [third])


def test_a_smaller_controller_is_the_same_with_units_off(tmp_path: Path, space: GenomeSpace) -> None:
    """Its episodes are those of the controller that it was, to the last bit."""
    small = config.changed(config.load("quick", small_runs.SMALL), ["controller.feedforward.hidden=3"])
    genes = random_genomes(Team(small).space, 1)
    blocks = {name: block[0].tolist() for name, block in Team(small).space.split(genes).items()}
    padded = read_genomes(written(tmp_path, {"blocks": blocks}), QUICK, space)
    weights = space.split(padded)
    assert weights["hidden_switch"][0, 3:].tolist() == [0.0] * 12
    np.testing.assert_array_equal(weights["hidden_output"][0, :, -1], np.array(blocks["hidden_output"])[:, -1])  # bias
    large = Team(config.load("quick", small_runs.SMALL))
    keys = [EpisodeKey(1, 0, 0, 0)]
    hashes = [Team(small).simulate(genes, keys).hash[0], large.simulate(padded, keys).hash[0]]
    assert hashes[0] == hashes[1]


def test_a_run_of_a_smaller_controller(tmp_path: Path, space: GenomeSpace) -> None:
    small = small_runs.make(tmp_path / "small", "controller.feedforward.hidden=2", "evolution.generations=1")
    found = read_genomes(f"{small}:1", QUICK, space)
    assert (space.split(found)["hidden_switch"][0, 2:] == 0).all()


# ---- what is refused -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "expected genomes, got an empty file"),
        ("{", "expected genomes as JSON or CSV, got something else"),
        ("[" * 100_000, "expected genomes as JSON or CSV, got something else"),
        ({}, "expected a list of 257 genes, or an exported controller, got {}"),
        ({"genes": 3}, "expected a list of 257 genes, or an exported controller, got {'genes': 3}"),
        ([], "expected 257 genes (input_hidden 15x14, hidden_output 2x16, hidden_switch 15), got 0"),
        ([1.0] * 256, "got 256"),
        ([[1.0] * 257, [1.0] * 3], "genome 1: expected 257 genes"),
        (["1.0"] * 257, "gene 0: expected a number, got '1.0'"),
        ([True] * 257, "gene 0: expected a number, got True"),
        ("[" + "NaN," * 256 + "0]", "gene 0: expected a finite number, got nan"),
        ([10**400] * 257, "gene 0: expected a finite number"),
        ("1,2,word", "gene 2: expected a number, got 'word'"),
        ({"blocks": 3}, "expected blocks by name, got 3"),
        ({"blocks": {"weights": [1]}}, "block weights is unknown: expected input_hidden, hidden_output, hidden_switch"),
        ({"blocks": {"input_hidden": [[0]]}}, "block hidden_output is missing"),
        (
            {"blocks": {"input_hidden": [[0] * 14] * 3, "hidden_output": [[0] * 4] * 2, "hidden_switch": [0, 0]}},
            "block input_hidden: expected 15x14 numbers, or of fewer units in all blocks, got 3x14",
        ),
        (
            {"blocks": {"input_hidden": [[0] * 14] * 16, "hidden_output": [[0] * 17] * 2, "hidden_switch": [0] * 16}},
            "block input_hidden: expected 15x14 numbers, or of fewer units in all blocks, got 16x14",
        ),
        (
            {"blocks": {"input_hidden": [[0] * 14, [0]], "hidden_output": [[0] * 3] * 2, "hidden_switch": [0] * 2}},
            "block input_hidden 1: expected 14 entries, got 1",
        ),
    ],
)
def test_bad_files_are_one_line(tmp_path: Path, space: GenomeSpace, content: Any, message: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(message)) as raised:
        read_genomes(written(tmp_path, content), QUICK, space)
    (line,) = raised.value.errors
    assert line.startswith(str(tmp_path))
    assert len(line) < 400


def test_what_is_no_file_is_one_line(tmp_path: Path, run: Path, space: GenomeSpace) -> None:
    (tmp_path / "binary").write_bytes(b"\xff\xfe\0")
    for source, message in (
        (tmp_path / "none", "there is none"),
        (tmp_path, "another folder"),
        (tmp_path / "binary", "binary data"),
        ("a\0b", "cannot be read"),
    ):
        with pytest.raises(ConfigError, match=message):
            read_genomes(str(source), QUICK, space)
    with pytest.raises(StoreError, match="there is no genome 99"):
        read_genomes(f"{run}:99", QUICK, space)


# ---- made for something else -----------------------------------------------------------------------------------------

TURNED = "robot.sensors=[rf, touch, infrared]"
"""As many readings as the paper's sensors, in another order."""


@pytest.mark.parametrize(
    ("override", "message"),
    [
        (
            TURNED,
            "13 observations of this configuration, got one for 13, of which number 0 is infrared_0, not rf",
        ),
        (
            "robot.sensors=[infrared]",
            "8 observations of this configuration, got one for 13, of which number 8 is touch_0, not",
        ),
        ("controller=elman", "expected genes of the controller elman, got those of feedforward; set controller to"),
        ("controller.feedforward.activation=logistic", "with activation 'logistic', got 'tanh', with which they mean"),
    ],
)
def test_a_controller_made_for_something_else_is_one_line(
    run: Path, tmp_path: Path, override: str, message: str
) -> None:
    other = config.load("quick", [override])
    space = Team(other).space
    with Store.open(run) as store:
        exported = json.loads(json.dumps(export.controller(store, 3)))
    for source in (written(tmp_path, exported), written(tmp_path, [exported] * 2, "two.json"), str(run), f"{run}:3"):
        with pytest.raises(ConfigError, match=re.escape(message)) as raised:
            read_genomes(source, other, space)
        assert len(raised.value.errors) == 1


def test_genes_alone_do_not_tell_what_they_were_made_for(tmp_path: Path, genomes: FloatArray) -> None:
    other = config.load("quick", [TURNED])
    found = read_genomes(written(tmp_path, genomes.tolist()), other, Team(other).space)
    np.testing.assert_array_equal(found, genomes)


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({"observations": "all"}, "observations: expected a list of names"),
        ({"commands": [0, 1]}, "commands: expected a list of names"),
        (
            {"commands": ["left"]},
            "2 commands of this configuration, got one for 1, of which number 1 is nothing, not right",
        ),
        ({"controller": "feedforward"}, "controller: expected {name: {option: value}}"),
        ({"controller": {"feedforward": None}}, "controller: expected {name: {option: value}}"),
        ({"controller": {}}, "controller: expected {name: {option: value}}"),
        ({"controller": {"feedforward": {"colour": 3}}}, "with colour None, got 3"),
    ],
)
def test_what_a_file_tells_wrongly_is_one_line(
    tmp_path: Path, space: GenomeSpace, genomes: FloatArray, told: dict[str, Any], message: str
) -> None:
    with pytest.raises(ConfigError, match=re.escape(message)):
        read_genomes(written(tmp_path, {"genes": genomes[0].tolist(), **told}), QUICK, space)


def test_a_run_does_not_begin_from_controllers_for_other_sensors(tmp_path: Path, run: Path) -> None:
    settings = config.changed(config.load("quick", small_runs.SMALL), [TURNED, f"evolution.start={run}"])
    with pytest.raises(ConfigError, match="number 0 is infrared_0, not rf"):
        driver.begin(tmp_path / "other", settings)
    assert not (tmp_path / "other").exists()


# ---- as a start population -------------------------------------------------------------------------------------------


def begun(folder: Path, source: str, *overrides: str) -> Path:
    return small_runs.make(folder, f"evolution.start={json.dumps(source)}", "evolution.trials=2", *overrides)


def test_every_trial_begins_from_them(tmp_path: Path, genomes: FloatArray) -> None:
    source = written(tmp_path, genomes.tolist())
    run = begun(tmp_path / "run", source)
    with Store.open(run) as store:
        for trial in range(2):
            np.testing.assert_array_equal(store.generation(trial, 0).genomes[:3], genomes)
        assert store.config.evolution.start == source
        assert store.config.evolution.start_sha256 == digest_of(genomes)
        start = store.start()
    assert start is not None
    np.testing.assert_array_equal(start, genomes)


def test_the_file_is_not_needed_again(tmp_path: Path, genomes: FloatArray) -> None:
    """A run that was cut before its second trial, and whose file is gone, ends as one that never stopped."""
    source = written(tmp_path, genomes.tolist())
    whole = begun(tmp_path / "whole", source)
    settings = config.changed(config.load("quick", small_runs.SMALL), [f"evolution.start={json.dumps(source)}"])
    driver.begin(tmp_path / "cut", settings)
    Path(source).unlink()
    with Store.open(tmp_path / "cut", readonly=False) as store:
        driver.evolve(store, 1, lambda now: None)
        verified = verification.verify(store, 1)
    assert verified.is_sound
    with Store.open(whole) as one, Store.open(tmp_path / "cut") as other:
        for trial in range(2):
            for number in range(2):
                first, second = one.generation(trial, number), other.generation(trial, number)
                np.testing.assert_array_equal(first.genomes, second.genomes)
                np.testing.assert_array_equal(first.episodes["hash"], second.episodes["hash"])


def test_others_than_those_named_are_refused(tmp_path: Path, genomes: FloatArray) -> None:
    source = written(tmp_path, genomes.tolist())
    with pytest.raises(ConfigError, match="expected genomes with the SHA-256 0000"):
        begun(tmp_path / "run", source, f"evolution.start_sha256={'0' * 64!r}")
    begun(tmp_path / "run", source, f"evolution.start_sha256={digest_of(genomes)!r}")
    with pytest.raises(ConfigError, match=r"expected evolution\.start as well"):
        small_runs.make(tmp_path / "other", f"evolution.start_sha256={'0' * 64!r}")
    assert not (tmp_path / "other").exists()


def test_more_than_the_optimiser_takes_are_refused_before_a_folder_is_made(tmp_path: Path, space: GenomeSpace) -> None:
    source = written(tmp_path, random_genomes(space, 5).tolist())
    with pytest.raises(PluginError, match="expected at most the population, 4, got 5"):
        begun(tmp_path / "run", source)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("damage", ["", "{}", '{"genomes": [[1.0]]}', None])
def test_a_damaged_start_is_refused_and_named(tmp_path: Path, genomes: FloatArray, damage: str | None) -> None:
    settings = config.changed(
        config.load("quick", small_runs.SMALL), [f"evolution.start={json.dumps(written(tmp_path, genomes.tolist()))}"]
    )
    driver.begin(tmp_path / "run", settings)
    file = tmp_path / "run" / START_FILE
    if damage is None:
        file.unlink()
    else:
        file.write_text(damage)
    with Store.open(tmp_path / "run", readonly=False) as store:
        assert verification.verify(store, 1).damage == (START_FILE,)
        with pytest.raises(StoreError, match=r"start\.json: is damaged; restore it from a copy"):
            driver.evolve(store, 1, lambda now: None)


def test_a_run_without_start_has_no_such_file(run: Path) -> None:
    assert not (run / START_FILE).exists()
    assert "start_sha256: null" in (run / CONFIG_FILE).read_text()

# SPDX-License-Identifier: BSD-3-Clause
"""Whatever the bytes are, reading a configuration or a run ends with a result or with the error that is announced."""

from __future__ import annotations

import contextlib
import os
import shutil
import sqlite3
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import toy_plugins
from swarmevo import config as configuration
from swarmevo import plugins, simulation
from swarmevo.config import Config
from swarmevo.errors import ConfigError, StoreError
from swarmevo.evolution.state import decode_state
from swarmevo.runs.database import DATABASE_FILE
from swarmevo.runs.driver import begin, evolve
from swarmevo.runs.folder import CONFIG_FILE
from swarmevo.runs.store import Store

PAPER = (Path(__file__).parents[1] / "configs" / "paper.yaml").read_bytes()
EXAMPLES = os.environ.get("FUZZ_EXAMPLES")  # `make fuzz` wants many, others each time

fuzz = settings(
    max_examples=int(EXAMPLES or 100),
    deadline=None,
    derandomize=EXAMPLES is None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


def patched(content: bytes, patches: list[tuple[float, bytes]]) -> bytes:
    """Return ``content`` with bytes overwritten, each at a share of its length."""
    changed = bytearray(content)
    for share, new in patches:
        place = int(share * len(changed))
        changed[place : place + len(new)] = new
    return bytes(changed)


patches = st.lists(
    st.tuples(st.floats(0, 1, exclude_max=True), st.binary(min_size=1, max_size=12)), min_size=1, max_size=4
)


def check_lines(errors: list[str]) -> None:
    assert errors
    assert all(line and "\n" not in line for line in errors)


# ---- configurations --------------------------------------------------------------------------------------------------


def read_config(file: Path) -> None:
    """Read a configuration as ``swarmevo evolve`` does; what is read must come back."""
    try:
        found = configuration.load(file, (), lambda c: simulation.scene_errors(c) + plugins.option_errors(c))
    except ConfigError as error:
        check_lines(list(error.errors))
        return
    file.write_text(configuration.dump(found))
    assert configuration.load(file) == found


@fuzz
@given(content=st.binary(max_size=300))
def test_any_bytes_as_a_configuration(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "any.yaml").write_bytes(content)
    read_config(tmp_path / "any.yaml")


@fuzz
@given(patches=patches)
def test_a_damaged_configuration(tmp_path: Path, patches: list[tuple[float, bytes]]) -> None:
    (tmp_path / "any.yaml").write_bytes(patched(PAPER, patches))
    read_config(tmp_path / "any.yaml")


leaves = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | st.just(float("nan"))
trees = st.recursive(
    leaves, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=3)
)
sections = st.sampled_from(list(Config.model_fields)).flatmap(
    lambda name: st.tuples(
        st.just(name),
        st.dictionaries(
            st.sampled_from(
                [*getattr(type(getattr(Config(), name)), "model_fields", {"pde": 0, "feedforward": 0}), "x"]
            ),
            trees,
            max_size=3,
        )
        | trees,
    )
)


@fuzz
@given(tree=st.lists(sections, max_size=3).map(dict))
def test_any_values_in_a_configuration(tmp_path: Path, tree: dict[str, Any]) -> None:
    (tmp_path / "any.yaml").write_text(yaml.safe_dump(tree, allow_unicode=True), encoding="utf-8")
    read_config(tmp_path / "any.yaml")


@fuzz
@given(override=st.text(max_size=40) | st.from_regex(r"\A[a-z]{3,9}(\.[a-z_]{1,9}){0,2}=.{0,12}\Z"))
def test_any_override(override: str) -> None:
    with contextlib.suppress(ConfigError):
        configuration.load("paper", [override])


# ---- runs ------------------------------------------------------------------------------------------------------------


@pytest.fixture
def sound(tmp_path: Path, distribution: Callable[..., Any]) -> Path:
    """A run of two generations, and a third one in work."""
    toy_plugins.install(distribution)
    begin(tmp_path / "sound", toy_plugins.config(evolution={"generations": 2, "trials": 1}))
    with Store.open(tmp_path / "sound", readonly=False) as store:
        evolve(store, 1, lambda progress: None)
    return tmp_path / "sound"


def read_run(folder: Path) -> None:
    """Read all there is in a run, then open it for writing; nothing but a StoreError may come, in one line."""
    for readonly in (True, False):
        try:
            with Store.open(folder, readonly=readonly) as store:
                _read_all(store)
        except StoreError as error:
            check_lines([str(error)])


def _read_all(store: Store) -> None:
    readings: list[Callable[[], Any]] = [
        store.trials,
        store.totals,
        store.individuals,
        store.all_genomes,
        store.damage,
        lambda: store.genome(2),
        lambda: store.session(1),
        lambda: store.state(0),
        lambda: list(store.summaries(0)),
        lambda: store.in_flight(0, 2, np.zeros((3, 36))),
        *(partial(read, 0, n) for read in (store.generation, store.sessions, store.genome_ids) for n in range(2)),
    ]
    for read in readings:
        try:
            read()
        except StoreError as error:
            check_lines([str(error)])


def copy_of(sound: Path) -> Path:
    copy = sound.with_name("copy")
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(sound, copy)
    return copy


@fuzz
@given(patches=patches)
def test_a_damaged_database(sound: Path, patches: list[tuple[float, bytes]]) -> None:
    folder = copy_of(sound)
    database = folder / DATABASE_FILE
    database.write_bytes(patched(database.read_bytes(), patches))
    read_run(folder)


@fuzz
@given(share=st.floats(0, 1), tail=st.binary(max_size=20))
def test_a_truncated_database(sound: Path, share: float, tail: bytes) -> None:
    folder = copy_of(sound)
    database = folder / DATABASE_FILE
    content = database.read_bytes()
    database.write_bytes(content[: int(share * len(content))] + tail)
    read_run(folder)


numbers = st.integers(-(2**63), 2**63 - 1) | st.integers(-3, 70)
texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=20) | st.sampled_from(["null", "[]", "{}", "[1]"])
changes = st.one_of(
    st.tuples(
        st.sampled_from(["genome SET genes", "genome SET sha256", "in_flight SET genome"]), st.binary(max_size=40)
    ),
    st.tuples(
        st.sampled_from(
            ["optimiser SET state", "session SET provenance", "run SET config_sha256", "objective SET name"]
        ),
        texts,
    ),
    st.tuples(
        st.sampled_from(
            [
                *("run SET robots", "run SET seed", "session SET id", "objective SET number", "generation SET number"),
                *("genome SET id", "individual SET genome", "individual SET number", "episode SET repeat"),
                *("episode SET individual", "episode SET ode_messages", "episode SET hash", "episode SET session"),
            ]
        ),
        numbers,
    ),
    st.tuples(
        st.sampled_from(["objective SET low", "generation SET seconds", "episode SET push_time"]),
        st.floats(allow_nan=False),
    ),
)
deletions = st.sampled_from(
    ["run", "session", "objective", "generation", "genome", "individual", "episode", "optimiser", "in_flight"]
)


@fuzz
@given(change=changes, every=st.integers(1, 5))
@example(change=("run SET robots", 10**9), every=1)
def test_a_database_with_other_values(sound: Path, change: tuple[str, Any], every: int) -> None:
    folder = copy_of(sound)
    with contextlib.closing(sqlite3.connect(folder / DATABASE_FILE)) as database:
        place, value = change
        with contextlib.suppress(sqlite3.IntegrityError):
            database.execute(f"UPDATE {place} = ? WHERE abs(random()) % ? = 0", (value, every))
        database.commit()
    read_run(folder)


@fuzz
@given(table=deletions, share=st.integers(1, 4))
def test_a_database_with_rows_missing(sound: Path, table: str, share: int) -> None:
    folder = copy_of(sound)
    with contextlib.closing(sqlite3.connect(folder / DATABASE_FILE)) as database:
        database.execute(f"DELETE FROM {table} WHERE abs(random()) % ? = 0", (share,))
        database.commit()
    read_run(folder)


@fuzz
@given(content=st.binary(max_size=200), file=st.sampled_from([CONFIG_FILE, DATABASE_FILE, f"{DATABASE_FILE}-wal"]))
def test_any_bytes_as_a_file_of_a_run(sound: Path, content: bytes, file: str) -> None:
    folder = copy_of(sound)
    (folder / file).write_bytes(content)
    read_run(folder)


@fuzz
@given(text=texts | trees.map(repr))
@example(text='{"a": {"dtype": "<f8", "shape": [-1, 0], "base64": ""}}')
@example(text='{"a": {"dtype": "O", "shape": [1], "base64": "AAAAAAAAAAA="}}')
@example(text='{"a": {"dtype": 7, "shape": "x", "base64": []}}')
@example(text="[" * 5_000)
def test_any_text_as_a_state(text: str) -> None:
    with contextlib.suppress(ValueError):
        decode_state(text)

# SPDX-License-Identifier: BSD-3-Clause
"""What an optimiser may do besides: answer with genomes of its own, begin from given ones, keep a map."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import toy_plugins
from swarmevo.errors import PluginError
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.evolution.optimiser import CheckedOptimiser
from swarmevo.protocols import BehaviourMap


class Able(toy_plugins.Search):
    """Answers with what it began from, or with what a test wants."""

    wanted: Any = None

    def start_from(self, genomes: Any) -> None:
        if len(genomes) > 2:
            raise ValueError("genomes: expected at most 2, got more")
        self._best = genomes[0] + 0.0
        genomes[0] = 0.0

    def answer(self) -> Any:
        return self._best[np.newaxis] if self.wanted is None and self._best is not None else self.wanted


@pytest.fixture
def make(
    distribution: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[[str], CheckedOptimiser]]:
    """Return the optimiser of a name, as a run makes it."""
    toy_plugins.install(distribution)
    monkeypatch.setattr(toy_plugins, "Able", Able, raising=False)
    distribution("able", "1.0", {"swarmevo.optimisers": {"able": "toy_plugins:Able"}})
    with Evaluator(toy_plugins.config(), workers=1) as evaluator:
        yield lambda name: CheckedOptimiser(toy_plugins.config(optimiser=name), evaluator, trial=0)


def test_an_optimiser_without_an_answer_has_none(make: Callable[[str], CheckedOptimiser]) -> None:
    assert make("toy_search").answer(0).shape == (0, 36)


def test_an_answer_is_a_copy(make: Callable[[str], CheckedOptimiser], monkeypatch: pytest.MonkeyPatch) -> None:
    answers = np.ones((3, 36))
    monkeypatch.setattr(Able, "wanted", answers)
    made = make("able").answer(0)
    np.testing.assert_array_equal(made, answers)
    assert not np.shares_memory(made, answers)
    monkeypatch.setattr(Able, "wanted", answers[:0])
    assert make("able").answer(0).shape == (0, 36)


@pytest.mark.parametrize(
    ("wanted", "told"),
    [
        (np.ones(36), "expected the shape (n, 36) with n >= 0, got (36,)"),
        (np.full((1, 36), np.nan), "expected finite numbers, got nan in genome 0, gene 0"),
        ([], "expected a NumPy array, got list"),
    ],
)
def test_a_wrong_answer_is_named(
    make: Callable[[str], CheckedOptimiser], monkeypatch: pytest.MonkeyPatch, wanted: Any, told: str
) -> None:
    monkeypatch.setattr(Able, "wanted", wanted)
    expected = f"optimiser.able (able 1.0): answer, trial 0, generation 4: {told}; repair the plugin"
    with pytest.raises(PluginError, match=f"^{re.escape(expected)}"):
        make("able").answer(4)


def test_an_optimiser_begins_from_given_genomes(
    make: Callable[[str], CheckedOptimiser], monkeypatch: pytest.MonkeyPatch
) -> None:
    given = np.arange(72.0).reshape(2, 36)
    with pytest.raises(PluginError, match=r"^optimiser.able \(able 1.0\): start_from: .*read-only$"):
        make("able").start_from(given)  # it writes to them
    monkeypatch.setattr(Able, "start_from", lambda self, genomes: setattr(self, "_best", genomes[1]))
    optimiser = make("able")
    optimiser.start_from(given)
    np.testing.assert_array_equal(optimiser.answer(0), given[1:])


def test_what_an_optimiser_refuses_to_begin_from_is_one_line(make: Callable[[str], CheckedOptimiser]) -> None:
    expected = "optimiser.able (able 1.0): start_from: genomes: expected at most 2, got more"
    with pytest.raises(PluginError, match=f"^{re.escape(expected)}$"):
        make("able").start_from(np.ones((3, 36)))


def test_an_optimiser_that_cannot_begin_from_given_genomes_says_so(make: Callable[[str], CheckedOptimiser]) -> None:
    with pytest.raises(PluginError, match="expected the method start_from, to begin from given genomes, got none; "):
        make("toy_search").start_from(np.ones((1, 36)))


# ---- a map of behaviours ---------------------------------------------------------------------------------------------


class Mapping(toy_plugins.DescribedSearch):
    """Keeps whatever map a test wants."""

    wanted: Any = None

    def behaviour_map(self) -> Any:
        if isinstance(self.wanted, Exception):
            raise self.wanted
        return self.wanted


def kept(**changes: Any) -> BehaviourMap:
    """Return a map of two elites, or what a test makes of it."""
    good: dict[str, Any] = {
        "cells": (3, 4),
        "objective": "travel",
        "places": np.array([[0, 3], [2, 0]]),
        "genomes": np.ones((2, 36)),
    }
    return BehaviourMap(**(good | changes))


@pytest.fixture
def mapping(
    distribution: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[[Any], CheckedOptimiser]]:
    """Return an optimiser that keeps the given map."""
    toy_plugins.install(distribution)
    monkeypatch.setattr(toy_plugins, "Mapping", Mapping, raising=False)
    distribution("mapping", "1.0", {"swarmevo.optimisers": {"mapping": "toy_plugins:Mapping"}})
    config = toy_plugins.config(optimiser="mapping", fitness=["toy_travel", "toy_places"])

    def make(wanted: Any) -> CheckedOptimiser:
        monkeypatch.setattr(Mapping, "wanted", wanted)
        return CheckedOptimiser(config, evaluator, trial=1)

    with Evaluator(config, workers=1) as evaluator:
        yield make


def test_an_optimiser_without_a_map_has_none(make: Callable[[str], CheckedOptimiser]) -> None:
    assert make("toy_search").behaviour_map() is None


def test_a_map_is_a_copy(mapping: Callable[[Any], CheckedOptimiser]) -> None:
    given = kept()
    found = mapping(given).behaviour_map()
    assert found is not None
    assert (found.cells, found.objective) == ((3, 4), "travel")
    np.testing.assert_array_equal(found.places, given.places)
    np.testing.assert_array_equal(found.genomes, given.genomes)
    assert not np.shares_memory(found.genomes, given.genomes)
    nobody = mapping(kept(places=np.empty((0, 2), dtype=np.intp), genomes=np.empty((0, 36)))).behaviour_map()
    assert nobody is not None
    assert nobody.genomes.shape == (0, 36)


@pytest.mark.parametrize(
    ("wanted", "told"),
    [
        ([], "expected a BehaviourMap, got list"),
        (
            kept(cells=(3,)),
            "expected as cells a number for each of 2 descriptors, at least 1 and up to 1000000 in all, got (3,)",
        ),
        (
            kept(cells=(3, 0)),
            "expected as cells a number for each of 2 descriptors, at least 1 and up to 1000000 in all, got (3, 0)",
        ),
        (
            kept(cells=3),
            "expected as cells a number for each of 2 descriptors, at least 1 and up to 1000000 in all, got 3",
        ),
        (kept(cells=(6, 10**400)), "up to 1000000 in all, got (6, 1000"),
        (kept(objective=np.array(["travel"])), "expected as objective one of travel, distance, got array(['travel']"),
        (kept(genomes=np.array(3.0)), "expected an array of shape (36,), got ()"),
        (kept(objective="speed"), "expected as objective one of travel, distance, got 'speed'"),
        (kept(genomes=np.ones((2, 35))), "expected an array of shape (2, 36), got (2, 35)"),
        (kept(genomes=np.full((2, 36), np.nan)), "expected finite numbers, got nan at [0, 0]"),
        (kept(genomes=None), "expected an array of numbers, got NoneType"),
        (kept(places=np.array([[0, 3]])), "expected an array of shape (2, 2), got (1, 2)"),
        (kept(places=np.array([[0, 4], [2, 0]])), "expected as places different cells of (3, 4), each from 0, got [["),
        (kept(places=np.array([[0, 1], [0, 1]])), "expected as places different cells of (3, 4), each from 0, got [["),
        (
            kept(places=np.array([[0, 0.5], [0, 1]])),
            "expected as places different cells of (3, 4), each from 0, got [[",
        ),
        (KeyError("x"), "raised KeyError: 'x'"),
    ],
)
def test_a_wrong_map_is_named(mapping: Callable[[Any], CheckedOptimiser], wanted: Any, told: str) -> None:
    with pytest.raises(PluginError, match=r"^optimiser.mapping \(mapping 1.0\): behaviour_map, trial 1") as caught:
        mapping(wanted).behaviour_map()
    assert told in str(caught.value)

# SPDX-License-Identifier: BSD-3-Clause
"""Evolution that stands the noise: races, survivors sampled again, a last phase that refines, budgets of episodes."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import small_runs
from grids import results
from swarmevo import config
from swarmevo.analysis import fronts
from swarmevo.config import Config, Evolution
from swarmevo.errors import ConfigError, Interrupted
from swarmevo.evolution.aggregation import OverWorlds
from swarmevo.evolution.archive import Archive
from swarmevo.evolution.budget import Budget
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.evolution.results import Generation
from swarmevo.protocols import Objective
from swarmevo.runs import driver
from swarmevo.runs.store import Store
from swarmevo.runs.verification import verify
from swarmevo.testing import random_genomes

# ---- races -----------------------------------------------------------------------------------------------------------


def racing(*overrides: str) -> Config:
    race = config.load(
        "paper", ["episode.horizon=3", "evolution.seed=3", "evolution.repeats=5", "evolution.race_after=2"]
    )
    return config.changed(race, overrides)


def test_who_is_hopeless_after_some_episodes_has_no_more() -> None:
    """Who goes on is worked out anew from an evaluation in which nobody races: the best layers by the first two."""
    with Evaluator(racing(), 2) as evaluator:
        genomes = random_genomes(evaluator.space, 12)
        whole = evaluator.evaluate(genomes, 0, 0)
        raced = evaluator.evaluate(genomes, 0, 0, racing=12)
    first = whole.episodes.grid("objective")[:, :2].mean(axis=1) * [-1, 1]
    layers, left, layer = np.zeros(12, dtype=int), set(range(12)), 0
    while left:
        front = {i for i in left if not any((first[j] <= first[i]).all() and (first[j] < first[i]).any() for j in left)}
        for i in front:
            layers[i] = layer
        left, layer = left - front, layer + 1
    goes_on = layers <= np.sort(layers)[5]  # half of them, and whoever is in the layer of the sixth
    counts = np.bincount(raced.episodes.individual)
    assert counts.tolist() == np.where(goes_on, 5, 2).tolist()
    assert 6 <= goes_on.sum() < 12
    for i in range(12):
        own = whole.episodes.grid("hash")[i, : counts[i]]
        assert raced.episodes["hash"][raced.episodes.individual == i].tolist() == own.tolist()
    assert raced.costs[goes_on].tolist() == whole.costs[goes_on].tolist()


def test_a_race_that_was_cut_short_goes_on_to_the_same_bits() -> None:
    with Evaluator(racing(), 1) as evaluator:
        genomes = random_genomes(evaluator.space, 8)
        raced = evaluator.evaluate(genomes, 0, 0, racing=8)
        for share in (0.2, 0.6):
            known = raced.episodes.only(np.random.default_rng(0).random(len(raced.episodes)) < share)
            again = evaluator.evaluate(genomes, 0, 0, known=known, racing=8)
            assert again.episodes["hash"].tolist() == raced.episodes["hash"].tolist()
            assert again.costs.tolist() == raced.costs.tolist()


def test_who_does_not_race_has_all_episodes() -> None:
    with Evaluator(racing("evolution.race_keep=0"), 1) as evaluator:
        genomes = random_genomes(evaluator.space, 8)
        counts = np.bincount(evaluator.evaluate(genomes, 0, 0, racing=5).episodes.individual)
        assert counts[5:].tolist() == [5, 5, 5]
        assert Counter(counts[:5].tolist())[5] >= 1


def test_a_race_in_several_worlds_tries_each_before_it_is_decided() -> None:
    chosen = racing("worlds=[{team.robots: 2}, {team.robots: 3}]", "evolution.race_after=1", "evolution.repeats=2")
    with Evaluator(chosen, 1) as evaluator:
        found = evaluator.evaluate(random_genomes(evaluator.space, 8), 0, 0, racing=8).episodes
    counts = np.bincount(found.individual)
    assert set(counts.tolist()) == {2, 4}
    assert found["world"][found.individual == int(np.argmin(counts))].tolist() == [0, 1]


# ---- the archive -----------------------------------------------------------------------------------------------------

OBJECTIVES = [Objective("score", "maximise", (0.0, 10.0)), Objective("size", "minimise", (0.0, 10.0))]


def generation(genomes: list[float], scores: list[list[float]], sizes: list[float]) -> Generation:
    """Return genomes of one gene, with their scores in each episode."""
    shape = np.shape(scores)
    objective = np.stack([scores, np.repeat(np.array(sizes)[:, np.newaxis], shape[1], axis=1)], axis=-1)
    nothing, none = np.full(shape, np.nan), np.zeros(shape, dtype=np.uint32)
    episodes = results(
        objective=objective,
        push_time=nothing,
        homing_time=nothing[..., np.newaxis],
        ode_messages=none,
        unsolved_steps=none,
        hash=none.astype(np.uint64),
    )
    return Generation(np.array(genomes)[:, np.newaxis], episodes)


def archive() -> Archive:
    return Archive(OverWorlds(Config(), OBJECTIVES), OBJECTIVES, 1)


def genes(found: Archive, *arguments: Any) -> list[float]:
    return [float(gene) for gene in found.genomes[found.least_sampled(*arguments), 0]]


def test_the_least_sampled_of_the_front_come_first() -> None:
    found = archive()
    found.add(generation([1, 2, 3, 4], [[5, 5], [7, 7], [6, 6], [1, 1]], [1, 2, 3, 4]))
    assert genes(found, 9) == [1, 2]  # 3 and 4 are dominated
    found.add(generation([1, 5], [[5, 5], [9, 9]], [1, 3]))
    assert genes(found, 9) == [2, 5, 1]
    assert genes(found, 2) == [2, 5]


def test_a_lucky_one_falls_when_it_is_evaluated_again() -> None:
    found = archive()
    found.add(generation([1, 2], [[9, 9], [6, 6]], [1, 1]))
    assert genes(found, 9) == [1]
    found.add(generation([1], [[0, 0]], [1]))  # its mean is 4.5
    assert genes(found, 9) == [2]
    assert found.episodes.tolist() == [4, 2]


def test_those_with_enough_episodes_are_not_pushed_from_the_front_by_those_without() -> None:
    found = archive()
    found.add(generation([1], [[6, 6]], [1]))
    found.add(generation([1, 2], [[6, 6], [9, 9]], [1, 1]))
    assert genes(found, 9) == [2]
    assert genes(found, 9, 4) == [2, 1]


# ---- budgets ---------------------------------------------------------------------------------------------------------


def test_a_trial_ends_with_its_generations_or_its_episodes() -> None:
    budget = Budget(Evolution(generations=10, episodes=100, refine=0.25))
    assert [budget.is_spent(*so_far) for so_far in ((9, 99), (10, 50), (5, 100))] == [False, True, True]
    assert [budget.is_for_refining(*so_far) for so_far in ((7, 70), (8, 70), (5, 75))] == [False, True, True]
    assert not Budget(Evolution(generations=10)).is_for_refining(9, 9)


# ---- runs ------------------------------------------------------------------------------------------------------------

NOISY = (
    "evolution.generations=8",
    "evolution.trials=1",
    "evolution.population=6",
    "evolution.repeats=2",
    "evolution.resample=2",
    "evolution.refine=0.4",
    "evolution.race_after=1",
    "evolution.least_episodes=6",
    "optimiser.pde.reevaluate=once",
)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_runs.make(tmp_path_factory.mktemp("noise") / "run", *NOISY)


def test_survivors_are_sampled_again_and_nobody_meets_the_same_noise_twice(run: Path) -> None:
    with Store.open(run) as store:
        seen: set[int] = set()
        for number in range(8):
            ids = store.genome_ids(0, number)
            assert len(set(ids)) == len(ids)
            again = [id for id in ids.tolist() if id in seen]  # the optimiser itself asks for nobody twice
            assert 0 < len(again) <= 2 if 0 < number < 5 else number >= 5 or not again
            seen |= set(ids.tolist())


def test_the_last_phase_makes_nobody_new(run: Path) -> None:
    with Store.open(run) as store:
        before = set(np.concatenate([store.genome_ids(0, number) for number in range(5)]).tolist())
        for number in (5, 6, 7):
            assert set(store.genome_ids(0, number).tolist()) <= before
            counts = np.bincount(store.generation(0, number).episodes.individual)
            assert set(counts.tolist()) == {2}  # nobody races
        states = store.state(0)
        assert states is not None


def test_nobody_stands_on_the_front_with_too_few_episodes(run: Path) -> None:
    with Store.open(run) as store:
        found = fronts.front(store)
        assert found
        assert all(point.episodes >= 6 for point in found)
        assert all(low <= point.push_rate <= high for point in found for low, high in [point.push_interval])
        steps = fronts.history(store, 0)
        assert steps[-1].front_size == len(found)
        assert steps[-1].hypervolume == pytest.approx(fronts.summarise(store).trials[0].history[-1].hypervolume)


def test_while_nobody_has_enough_those_with_the_most_stand_on_the_front(tmp_path: Path) -> None:
    run = small_runs.make(tmp_path / "run", "evolution.least_episodes=1000")
    with Store.open(run) as store:
        most = int(store.individuals().episodes.max())
        assert {point.episodes for point in fronts.front(store)} == {most}
        assert [step.front_size > 0 for step in fronts.history(store, 0)] == [True, True]


def test_it_is_verified_to_the_bit(run: Path) -> None:
    with Store.open(run) as store:
        report = verify(store, workers=2)
        assert report.is_sound
        assert report.episodes == store.totals().episodes


@pytest.mark.parametrize("stops", [(3, 11, 27, 40)])
def test_a_run_that_was_cut_short_gives_the_same_bits(tmp_path: Path, run: Path, stops: tuple[int, ...]) -> None:
    settings = config.changed(config.load("quick", small_runs.SMALL), NOISY)
    folder = driver.begin(tmp_path / "run", settings)
    for most in (*stops, None):
        asked = iter(range(10**6))

        def stop(asked: Any = asked, most: int | None = most) -> bool:
            return most is not None and next(asked) >= most

        with Store.open(folder, readonly=False) as store:
            try:
                driver.evolve(store, 1, lambda now: None, stop)
            except Interrupted:
                assert most is not None
    with Store.open(folder) as again, Store.open(run) as whole:
        assert again.generations(0) == whole.generations(0) == 8
        for number in range(8):
            one, other = again.generation(0, number), whole.generation(0, number)
            assert np.array_equal(one.genomes, other.genomes)
            assert np.array_equal(one.episodes["hash"], other.episodes["hash"])


def test_a_budget_of_episodes_ends_the_run(tmp_path: Path) -> None:
    run = small_runs.make(tmp_path / "run", "evolution.generations=1000", "evolution.episodes=30")
    with Store.open(run) as store:
        spent = [store.episodes_stored(trial) for trial in (0, 1)]
        last = [len(store.generation(t, store.generations(t) - 1).episodes) for t in (0, 1)]
        assert all(30 <= episodes < 30 + size for episodes, size in zip(spent, last, strict=True))
        assert fronts.summarise(store).complete


def test_a_trial_begins_with_a_search() -> None:
    """Else there would be nobody to refine."""
    with pytest.raises(ConfigError, match=r"evolution\.refine: expected a number from 0 to 0\.9, got 1"):
        config.load("paper", ["evolution.refine=1"])
    assert not Budget(Evolution(generations=1, refine=0.9)).is_for_refining(0, 0)

# SPDX-License-Identifier: BSD-3-Clause
"""CMA-ES: the conformance kit, what it finds, its state to the bit, and its answer."""

from __future__ import annotations

import re

import cmaes
import numpy as np
import pytest

from swarmevo.evolution.state import decode_state, encode_state
from swarmevo.protocols import Block, GenomeSpace
from swarmevo.testing import CHROMOSOME, OptimiserTests
from swarmevo_rivals.cma import CMAES
from swarmevo_rivals.linear import axes_of, log_determinant, product
from swarmevo_rivals.restarts import MOST_DOUBLINGS, Schedule
from swarmevo_rivals.search import Search

REAL = GenomeSpace((Block("weights", (6,)),))
MIXED = GenomeSpace((Block("weights", (6,)), Block("switches", (2,), "switch")))
TARGET = np.linspace(-1, 2, 6)


def generator(seed=1):
    return np.random.Generator(np.random.PCG64(seed))


def make(space=REAL, population=10, objectives=1, seed=1, **options):
    return CMAES(space, population, objectives, generator(seed), **options)


# ---- the conformance kit ---------------------------------------------------------------------------------------------


class TestConformance(OptimiserTests):
    def create(self, space, population, objectives, rng):
        return CMAES(space, population, objectives, rng)


class TestConformanceWithRestarts(OptimiserTests):
    populations = (4, 7)

    def create(self, space, population, objectives, rng):
        weights = [1.0, 0.5, 0.0][:objectives]
        return CMAES(space, population, objectives, rng, restarts="bipop", weights=weights, learning_rate="adaptive")


class TestConformanceWithStarts(OptimiserTests):
    populations = (5,)

    def create(self, space, population, objectives, rng):
        return CMAES(space, population, objectives, rng, starts=3, start_generations=2)


class TestConformanceSwitchesOn(OptimiserTests):
    populations = (5,)

    def create(self, space, population, objectives, rng):
        return CMAES(space, population, objectives, rng, switches="on")


# ---- several starts --------------------------------------------------------------------------------------------------


def two_valleys(genomes):
    """Return a wide valley that is nowhere better than 0.5, and a narrow one down to 0, far from each other."""
    wide = 0.5 + 0.02 * np.square(genomes - 2).sum(axis=1)
    narrow = 0.15 * np.square(genomes + 1.3).sum(axis=1)
    return np.minimum(wide, narrow)[:, np.newaxis]


def least(generations=150, **options):
    made = make(sigma=1.0, **options)
    for _ in range(generations):
        genomes = made.ask()
        made.tell(genomes, two_valleys(genomes))
    return two_valleys(made.answer()[:1])[0, 0]


def test_of_several_starts_the_best_goes_on():
    alone = [least(seed=seed) < 0.1 for seed in range(12)]
    several = [least(seed=seed, starts=12, start_generations=20, generations=370) < 0.1 for seed in range(12)]
    assert 1 <= sum(alone) <= 8
    assert sum(several) >= 11


def test_a_start_that_goes_on_is_where_it_was():
    """It was the second of three, and asks as it would have if it had been alone, but for the generator's state."""
    made = make(sigma=1.0, starts=3, start_generations=10)
    means = []
    for _ in range(30):
        genomes = made.ask()
        means.append(genomes.mean(axis=0))
        costs = two_valleys(genomes) + (0.0 if 10 <= len(means) - 1 < 20 else 5.0)
        made.tell(genomes, costs)
    assert np.linalg.norm(made.ask().mean(axis=0) - means[19]) < np.linalg.norm(means[19] - means[29])
    assert np.linalg.norm(made.ask().mean(axis=0) - means[19]) < np.linalg.norm(means[19] - means[9])


def test_given_genomes_need_no_several_starts():
    made = make(starts=5, sigma=0.1)
    made.start_from(TARGET[np.newaxis])
    assert np.linalg.norm(made.ask().mean(axis=0) - TARGET) < 0.3
    assert made.state()["heat"] is None


# ---- what it finds ---------------------------------------------------------------------------------------------------


def sphere(genomes):
    return np.square(genomes[:, :6] - TARGET).sum(axis=1, keepdims=True)


def ellipsoid(genomes):
    return (10.0 ** np.arange(6) * np.square(genomes - TARGET)).sum(axis=1, keepdims=True)


def rastrigin(genomes):
    return (genomes**2 - 10 * np.cos(2 * np.pi * genomes) + 10).sum(axis=1, keepdims=True)


def run(optimiser, costs, generations):
    """Return what was asked for in each generation."""
    asked = []
    for _ in range(generations):
        asked.append(optimiser.ask())
        optimiser.tell(asked[-1], costs(asked[-1]))
    return asked


@pytest.mark.parametrize("population", [4, 10, 30])
@pytest.mark.parametrize("costs", [sphere, ellipsoid])
def test_its_answer_is_the_optimum(costs, population):
    optimiser = make(population=population)
    run(optimiser, costs, 12000 // population)
    np.testing.assert_allclose(optimiser.answer(), [TARGET], atol=1e-6)


def test_its_first_generation_has_the_spread_and_fair_switches():
    genomes = make(MIXED, 4000, sigma=0.5).ask()
    np.testing.assert_allclose(genomes.mean(axis=0), [0] * 6 + [0.5] * 2, atol=0.03)
    np.testing.assert_allclose(genomes.std(axis=0), 0.5, atol=0.02)
    np.testing.assert_allclose((genomes[:, 6:] >= 0.5).mean(axis=0), 0.5, atol=0.03)


def test_switches_are_found():
    def costs(genomes):
        on = genomes[:, 6:] >= 0.5
        return sphere(genomes) + np.abs(on - [1, 0]).sum(axis=1, keepdims=True)

    optimiser = make(MIXED)
    run(optimiser, costs, 200)
    np.testing.assert_allclose(optimiser.answer(), [[*TARGET, 1, 0]], atol=1e-3)


def test_switches_that_are_held_on_are_no_part_of_the_search():
    held, real = make(MIXED, switches="on"), make(REAL)
    for mixed, alone in zip(run(held, sphere, 30), run(real, sphere, 30), strict=True):
        np.testing.assert_array_equal(mixed[:, :6], alone)
        assert np.all(mixed[:, 6:] == 1)
    np.testing.assert_array_equal(held.answer()[0], [*real.answer()[0], 1, 1])


def test_objectives_are_weighted():
    def two(genomes):
        return np.column_stack([sphere(genomes), 100 * genomes[:, 0]])

    def weighted(genomes):
        return 3 * sphere(genomes) + 0.5 * 100 * genomes[:, :1]

    def plain(genomes):
        return sphere(genomes) + 100 * genomes[:, :1]

    both, single = make(objectives=2, weights=[3, 0.5]), make()
    np.testing.assert_array_equal(run(both, two, 40), run(single, weighted, 40))
    np.testing.assert_array_equal(run(make(objectives=2), two, 40), run(make(), plain, 40))


def test_where_costs_are_noisy_adaptive_learning_and_the_mean_come_nearer():
    """With fixed rates the spread collapses wherever luck was; what looks best in a generation is lucky, too."""
    errors = {}
    for learning_rate in ("fixed", "adaptive"):
        optimiser, noise, means, best = make(population=12, learning_rate=learning_rate), generator(5), [], []
        for _ in range(400):
            genomes = optimiser.ask()
            costs = sphere(genomes) + noise.normal(size=(len(genomes), 1))
            optimiser.tell(genomes, costs)
            means.append(optimiser.answer()[0])
            best.append(genomes[np.argmin(costs)])
        errors[learning_rate] = [sphere(np.array(points[-20:])).mean() for points in (means, best)]
    assert errors["adaptive"][0] < 0.2 * errors["adaptive"][1]
    assert errors["adaptive"][0] < 0.2 * errors["fixed"][0]


# ---- its answer ------------------------------------------------------------------------------------------------------


def test_it_has_no_answer_before_the_first_generation():
    optimiser = make(MIXED)
    assert optimiser.answer().shape == (0, 8)
    optimiser.ask()
    assert optimiser.answer().shape == (0, 8)


def test_the_best_search_that_is_over_is_an_answer_too():
    optimiser, ended = make(population=4, restarts="ipop"), []
    for _ in range(1000):
        mean, searches = optimiser.answer()[:1], optimiser.state()["schedule"]["doublings"]
        genomes = optimiser.ask()
        if optimiser.state()["schedule"]["doublings"] > searches:
            ended.append(rastrigin(mean)[0, 0])
            assert len(optimiser.answer()) == 1  # nothing was told of the new search yet
            np.testing.assert_allclose(rastrigin(optimiser.answer())[0, 0], min(ended), atol=1e-6)
        optimiser.tell(genomes, rastrigin(genomes))
        assert len(optimiser.answer()) == 1 + bool(ended)
    assert len(ended) >= 3
    assert ended != sorted(ended)
    assert ended != sorted(ended, reverse=True)  # so that there was one to choose


# ---- restarts --------------------------------------------------------------------------------------------------------


def sizes(optimiser, costs, generations):
    """Return the populations of the searches, in their order."""
    asked = [len(genomes) for genomes in run(optimiser, costs, generations)]
    return [one for i, one in enumerate(asked) if i == 0 or one != asked[i - 1]]


def test_without_restarts_the_distribution_of_a_search_that_is_over_stays():
    optimiser = make(restarts="none")
    run(optimiser, sphere, 400)
    answer = optimiser.answer()
    assert optimiser.state()["is_over"]
    assert {len(genomes) for genomes in run(optimiser, sphere, 20)} == {10}
    np.testing.assert_array_equal(optimiser.answer(), answer)


def test_ipop_doubles_the_population():
    assert sizes(make(population=6, restarts="ipop"), sphere, 700)[:3] == [6, 12, 24]


def test_bipop_has_small_searches_too():
    found = sizes(make(population=4, restarts="bipop"), sphere, 3000)
    assert found[:2] == [4, 8]
    assert found.index(16) > 2
    assert 8 not in found[2:]


def test_the_two_kinds_of_bipop_evaluate_as_much():
    schedule, rng, spent = Schedule("bipop", 10, 1.0), generator(), {True: 0, False: 0}
    schedule.count(1000)
    largest = 10
    for _ in range(40):
        population, sigma = schedule.follow(rng)
        is_large = population == 2 * largest
        assert is_large or (10 <= population <= largest and 0.01 <= sigma <= 1.0)
        largest = max(largest, population)
        schedule.count(100 * population)
        spent[is_large] += 100 * population
        if largest == 10 * 2**MOST_DOUBLINGS:
            break
    assert 0.4 < spent[True] / sum(spent.values()) < 0.8


def test_populations_do_not_grow_for_ever():
    schedule = Schedule("ipop", 4, 1.0)
    assert [schedule.follow(generator())[0] for _ in range(12)][-4:] == [4 * 2**MOST_DOUBLINGS] * 4


# ---- to the bit ------------------------------------------------------------------------------------------------------


OPTIONS = [
    {},
    {"learning_rate": "adaptive"},
    {"restarts": "ipop"},
    {"restarts": "bipop"},
    {"switches": "on", "restarts": "ipop", "sigma": 0.1},
]


@pytest.mark.parametrize("options", OPTIONS)
def test_a_run_that_is_interrupted_in_every_generation_has_the_same_bits(options):
    """As a run stores and reads it; past the ends of several searches."""
    whole, states = make(MIXED, 4, **options), []
    state = encode_state(whole.state())
    for generation in range(600):
        optimiser = make(MIXED, 4, seed=generation, **options)
        optimiser.restore(decode_state(state))
        genomes = optimiser.ask()
        np.testing.assert_array_equal(genomes, whole.ask())
        for each in (optimiser, whole):
            each.tell(genomes, sphere(genomes))
        state = encode_state(optimiser.state())
        assert state == encode_state(whole.state())  # nor does anything of the process's memory get into it
        np.testing.assert_array_equal(optimiser.answer(), whole.answer())
        states.append(optimiser.state())
    assert len({one["search"]["population"] for one in states}) > 1 or options.get("restarts", "none") == "none"


def test_the_state_of_a_search_by_the_library_is_refused():
    state = make().state()
    state["search"] = {"cmaes": "0.13.1", "_mean": np.zeros(6)}
    with pytest.raises(
        ValueError, match=r"^expected a search by swarmevo's own CMA-ES, got one by the library cmaes, "
    ):
        make().restore(state)


# ---- beside another author's -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("adapts", [False, True])
@pytest.mark.parametrize(("n", "population"), [(1, 4), (2, 7), (6, 4), (18, 32), (40, 15)])
def test_it_learns_what_the_library_cmaes_learns(n, population, adapts):
    """From the same points with the same costs, some of them equal."""
    ours = Search(np.full(n, 0.5), 1.3, population, adapts, generator())
    theirs = cmaes.CMA(np.full(n, 0.5), 1.3, population_size=population, lr_adapt=adapts)
    theirs._funhist_values.fill(0.0)  # the library leaves chance in it
    noise = generator(2)
    for _ in range(60):
        points = ours.ask()
        costs = (np.arange(1, n + 1) * (points - 1) ** 2).sum(axis=1) + noise.standard_normal(population)
        costs[1] = costs[0]
        ours.tell(points, costs)
        theirs.ask()
        theirs.tell(list(zip(points, costs.tolist(), strict=True)))
        known = ours.state()
        np.testing.assert_allclose(known["mean"], theirs.mean, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(known["sigma"], theirs._sigma, rtol=1e-9)
        np.testing.assert_allclose(known["covariance"], theirs._C, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(known["step_path"], theirs._p_sigma, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(known["path"], theirs._pc, rtol=1e-9, atol=1e-9)
        assert ours.is_over() == theirs.should_stop()


@pytest.mark.parametrize("costs", ["flat", "converging", "far"])
def test_it_is_over_when_the_library_says_so(costs):
    n, population = 3, 6
    ours = Search(np.zeros(n), 1.0, population, False, generator())
    theirs = cmaes.CMA(np.zeros(n), 1.0, population_size=population)
    theirs._funhist_values.fill(0.0)
    for generation in range(2000):  # noqa: B007
        points = ours.ask()
        values = {"flat": np.ones(population), "converging": (points**2).sum(axis=1), "far": points.sum(axis=1)}[costs]
        ours.tell(points, values)
        theirs.ask()
        theirs.tell(list(zip(points, values.tolist(), strict=True)))
        assert ours.is_over() == theirs.should_stop()
        if ours.is_over():
            break
    assert 10 < generation < 1000


def test_points_from_far_away_are_learnt_from():
    """As after a change of the genomes that were asked for."""
    search = Search(np.zeros(3), 1.0, 6, False, generator())
    for far in (1e3, 1e12, 1e30):
        search.tell(far * search.ask(), np.arange(6.0))
        assert np.isfinite(search.ask()).all()


def test_points_have_the_covariance_that_was_learnt():
    search = Search(np.zeros(3), 1.0, 20, False, generator())
    for _ in range(30):
        points = search.ask()
        search.tell(points, (np.array([1.0, 30.0, 900.0]) * points**2).sum(axis=1) - 20 * points[:, 0] * points[:, 1])
    known = search.state()
    points = np.concatenate([search.ask() for _ in range(10_000)])
    found = np.cov((points - known["mean"]).T) / known["sigma"] ** 2
    np.testing.assert_allclose(found, known["covariance"], rtol=0.03, atol=0.03 * known["covariance"].max())
    assert abs(known["covariance"][0, 1]) > 0.1


@pytest.mark.parametrize("n", [1, 2, 3, 7, 40])
def test_axes_are_those_that_numpy_finds(n):
    rng = generator(n)
    scales = 10.0 ** rng.uniform(-3, 3, n)
    matrix = np.cov(rng.standard_normal((n, 3 * n))).reshape(n, n) * np.outer(scales, scales)
    found = axes_of(matrix, np.eye(n))
    for values, axes in (found, axes_of(matrix, found[1]), axes_of(matrix, found[1][::-1])):
        np.testing.assert_allclose(values, np.linalg.eigvalsh(matrix), atol=1e-13 * values[-1])
        np.testing.assert_allclose(axes @ axes.T, np.eye(n), atol=1e-12)
        np.testing.assert_allclose(axes.T * values @ axes, matrix, atol=1e-13 * values[-1])
    np.testing.assert_allclose(product(axes, matrix), axes @ matrix, atol=1e-13 * values[-1])
    np.testing.assert_allclose(log_determinant(matrix), np.linalg.slogdet(matrix)[1], rtol=1e-9)


def test_axes_of_matrices_that_are_special():
    for matrix in (np.zeros((3, 3)), np.eye(4), np.ones((5, 5)), np.diag([3.0, 1e-150, 2.0]), np.full((1, 1), 7.0)):
        values, axes = axes_of(matrix, np.eye(len(matrix)))
        assert (np.diff(values) >= 0).all()
        np.testing.assert_allclose(axes.T * values @ axes, matrix, atol=1e-14)


# ---- given genomes ---------------------------------------------------------------------------------------------------


def test_it_begins_about_the_mean_of_given_genomes():
    given = np.array([[1.0, 2, 3, 4, 5, 6, 0.7, 0.1], [3.0, 2, 1, 0, 1, 2, 1.0, 0.9]])
    optimiser = make(MIXED, 4000, sigma=0.1)
    optimiser.start_from(given)
    genomes = optimiser.ask()
    np.testing.assert_allclose(genomes.mean(axis=0), [2, 2, 2, 2, 3, 4, 1.0, 0.5], atol=0.01)
    np.testing.assert_allclose(genomes.std(axis=0), 0.1, atol=0.01)


def test_it_begins_from_genomes_with_every_switch_on_where_they_are_held():
    optimiser = make(MIXED, switches="on")
    given = np.ones((1, 8))
    optimiser.start_from(given)
    assert np.all(optimiser.ask()[:, 6:] == 1)
    given[0, 7] = 0.4
    with pytest.raises(ValueError, match="got one that is off"):
        optimiser.start_from(given)


# ---- options ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"population": 3}, "population: expected a number of at least 4, got 3"),
        ({"sigma": 0.0}, "sigma: expected a number above 0, got 0.0"),
        ({"sigma": float("inf")}, "sigma: expected a number above 0, got inf"),
        ({"sigma": "wide"}, "sigma: expected a number above 0, got 'wide'"),
        ({"switches": "off"}, "switches: expected one of evolve, on, got 'off'"),
        ({"restarts": "often"}, "restarts: expected one of none, ipop, bipop, got 'often'"),
        ({"learning_rate": "slow"}, "learning_rate: expected one of fixed, adaptive, got 'slow'"),
        (
            {"weights": [1.0], "objectives": 2},
            "weights: expected a number of at least 0 for each of 2 objectives, not all 0, got [1.0]",
        ),
        (
            {"weights": [-1.0]},
            "weights: expected a number of at least 0 for each of 1 objectives, not all 0, got [-1.0]",
        ),
        (
            {"weights": [0.0, 0.0], "objectives": 2},
            "weights: expected a number of at least 0 for each of 2 objectives, not all 0, got [0.0, 0.0]",
        ),
    ],
)
def test_wrong_options_are_one_clear_line(options, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        make(**options)


def test_switches_cannot_be_held_where_there_is_nothing_else():
    with pytest.raises(ValueError, match="switches: expected evolve, as the genome has nothing but"):
        make(GenomeSpace((Block("switches", (3,), "switch"),)), switches="on")


def test_a_genome_of_one_gene_is_enough():
    optimiser = make(GenomeSpace((Block("weight", (1,)),)), 4)
    run(optimiser, lambda genomes: np.square(genomes - 3), 100)
    np.testing.assert_allclose(optimiser.answer(), [[3.0]], atol=1e-6)


def test_the_kits_network_is_searched_with_few_genomes():
    asked = run(make(CHROMOSOME, 4), lambda genomes: np.square(genomes).sum(axis=1, keepdims=True), 1000)
    assert np.square(asked[-1]).sum(axis=1).mean() < 0.01 * np.square(asked[0]).sum(axis=1).mean()

# SPDX-License-Identifier: BSD-3-Clause
"""PDE against a second implementation, against the paper's steps one by one, and against the conformance kit."""

from __future__ import annotations

import re

import numpy as np
import pytest
from reference_pde import ReferencePDE

from swarmevo import config
from swarmevo.protocols import Block, GenomeSpace, SceneInfo
from swarmevo.testing import CHROMOSOME, OptimiserTests
from swarmevo_paper.network import FeedForwardNetwork
from swarmevo_paper.pde import PDE

SCENE = SceneInfo(robots=5, control_steps=10, control_period=0.1)
PAPER = FeedForwardNetwork().space(SCENE)
PAPER_ZERO = np.zeros((1, PAPER.size))
ONE_GENE = GenomeSpace((Block("weight", (1,)),))


def generator(seed=1):
    return np.random.Generator(np.random.PCG64(seed))


# ---- the conformance kit ---------------------------------------------------------------------------------------------


class TestConformance(OptimiserTests):
    def create(self, space, population, objectives, rng):
        return PDE(space, population, objectives, rng)


class TestConformanceOnce(OptimiserTests):
    populations = (5,)

    def create(self, space, population, objectives, rng):
        return PDE(space, population, objectives, rng, reevaluate="once", mutation_rate=0.5)


class TestConformanceSelfChosenRates(OptimiserTests):
    populations = (5, 30)

    def create(self, space, population, objectives, rng):
        return PDE(space, population, objectives, rng, rates="self", acceptance="dominates")


class TestConformanceRenewDominates(OptimiserTests):
    populations = (5,)

    def create(self, space, population, objectives, rng):
        return PDE(space, population, objectives, rng, reevaluate="renew", acceptance="dominates")


# ---- the second implementation ---------------------------------------------------------------------------------------


def hidden_neurons(genomes, space):
    return np.sum(genomes[:, space.is_switch], axis=1)


def paper_like(genomes, space, generation):
    return np.stack([np.sin(genomes).sum(axis=1), hidden_neurons(genomes, space)], axis=1)


def noisy(genomes, space, generation):
    noise = np.random.default_rng(generation).normal(size=len(genomes))
    return np.stack([np.sin(genomes).sum(axis=1) + 3 * noise, hidden_neurons(genomes, space)], axis=1)


def same_noise_for_all(genomes, space, generation):
    noise = np.random.default_rng(generation).normal(size=genomes.shape[1])
    return np.stack([np.sin(genomes + noise).sum(axis=1), hidden_neurons(genomes, space)], axis=1)


def whole_numbers(genomes, space, generation):
    return np.stack([np.floor(np.abs(genomes[:, 0]) * 2), hidden_neurons(genomes, space) // 2], axis=1)


def noisy_whole_numbers(genomes, space, generation):
    noise = np.random.default_rng(generation).integers(0, 2, (len(genomes), 2))
    return whole_numbers(genomes, space, generation) + noise


def constant(genomes, space, generation):
    return np.full((len(genomes), 2), -1.5)


def one_constant(genomes, space, generation):
    return np.stack([np.zeros(len(genomes)), hidden_neurons(genomes, space)], axis=1)


def conflicting(genomes, space, generation):
    return np.stack([(genomes[:, 0] - 1) ** 2, (genomes[:, 0] + 1) ** 2], axis=1)


def three(genomes, space, generation):
    return np.column_stack([paper_like(genomes, space, generation), np.floor(np.abs(genomes[:, 1]))])


def three_continuous(genomes, space, generation):
    return np.column_stack([paper_like(genomes, space, generation), np.cos(genomes).sum(axis=1)])


def on_a_grid(genomes, space, generation):
    """Return points of a front at whole distances: many leave as much room."""
    x = np.floor(genomes[:, :2] * 4)
    return np.column_stack([x, -x.sum(axis=1)])


def side_by_side(pde, reference, costs, space, generations):
    """Run both implementations and yield after each generation, in which they asked for the same genomes."""
    for generation in range(generations):
        genomes = pde.ask()
        np.testing.assert_array_equal(genomes, reference.ask())
        values = costs(genomes, space, generation)
        pde.tell(genomes, values)
        reference.tell(values)
        yield generation


RATES = [(0.7, 0.01, 0.01), (0.3, 0.2, 0.5), (0.0, 0.0, 0.0), (1.0, 1.0, 0.1)]


@pytest.mark.parametrize("reevaluate", ["accumulate", "once", "renew"])
@pytest.mark.parametrize("rates", RATES)
@pytest.mark.parametrize(
    "costs",
    [
        paper_like,
        noisy,
        same_noise_for_all,
        whole_numbers,
        noisy_whole_numbers,
        constant,
        one_constant,
        conflicting,
        three,
        three_continuous,
        on_a_grid,
    ],
)
def test_second_implementation_makes_the_same_children(costs, rates, reevaluate):
    for population, hidden, seed in [(30, 15, 1), (4, 2, 2), (7, 3, 3)]:
        space = FeedForwardNetwork(hidden).space(SCENE)
        keywords = dict(zip(("crossover_rate", "mutation_rate", "mutation_spread"), rates, strict=True))
        keywords["reevaluate"] = reevaluate
        objectives = costs(np.zeros((1, space.size)), space, 0).shape[1]
        ours, theirs = generator(seed), generator(seed)
        pde = PDE(space, population, objectives, ours, **keywords)
        reference = ReferencePDE(population, hidden, theirs, **keywords)
        for _ in side_by_side(pde, reference, costs, space, generations=20):
            assert ours.bit_generator.state == theirs.bit_generator.state


@pytest.mark.parametrize("front", [0.0, 0.5, 0.7])
@pytest.mark.parametrize("costs", [conflicting, three_continuous, on_a_grid])
def test_second_implementation_thins_the_front_alike(costs, front):
    """Case 50."""
    space = FeedForwardNetwork(2).space(SCENE)
    objectives = costs(np.zeros((1, space.size)), space, 0).shape[1]
    pde = PDE(space, 12, objectives, generator(), front=front)
    reference = ReferencePDE(12, 2, generator(), front=front)
    sizes = [reference.n_retained for _ in side_by_side(pde, reference, costs, space, generations=30)]
    assert max(sizes) == reference.most  # it was thinned


@pytest.mark.parametrize("costs", [paper_like, noisy, same_noise_for_all, noisy_whole_numbers])
def test_second_implementation_agrees_over_the_papers_hundred_generations(costs):
    pde = PDE(PAPER, 30, 2, generator())
    reference = ReferencePDE(30, 15, generator(), 0.7, 0.01, 0.01, "accumulate")
    assert len(list(side_by_side(pde, reference, costs, PAPER, generations=100))) == 100


# ---- step 2.0: the initial population --------------------------------------------------------------------------------


def test_initial_weights_are_standard_normal_and_switches_fair():
    genomes = PDE(PAPER, 400, 2, generator()).ask()
    weights, switches = genomes[:, ~PAPER.is_switch], genomes[:, PAPER.is_switch]
    assert weights.mean() == pytest.approx(0, abs=0.01)
    assert weights.std() == pytest.approx(1, abs=0.01)
    assert set(np.unique(switches)) == {0.0, 1.0}
    assert switches.mean() == pytest.approx(0.5, abs=0.02)


def test_draws_in_the_order_of_its_docstring():
    pde, rng = PDE(PAPER, 6, 2, generator()), generator()
    genomes = pde.ask()
    np.testing.assert_array_equal(genomes[:, ~PAPER.is_switch], rng.standard_normal((6, 242)))
    np.testing.assert_array_equal(genomes[:, PAPER.is_switch], rng.random((6, 15)) < 0.5)
    pde.tell(genomes, np.array([[0, 5], [1, 4], [2, 3], [9, 9], [9, 8], [8, 9]], dtype=float))
    for _ in range(3):
        rng.choice(3, 3, replace=False)
        rng.random(31)  # links: 15 hidden neurons' inputs, their 15 outputs, the output bias
        rng.standard_normal(46)  # parts: the same, and 15 switches
        rng.random(16)  # units: 15 hidden neurons, the output bias
        rng.standard_normal(242)
    assert pde.state()["rng"] == rng.bit_generator.state


def test_given_genomes_come_first_and_the_rest_is_as_it_was_drawn():
    given = 3 + np.random.default_rng(1).random((2, CHROMOSOME.size))
    pde, random = PDE(CHROMOSOME, 6, 2, generator()), PDE(CHROMOSOME, 6, 2, generator()).ask()
    pde.start_from(given)
    genomes, real = pde.ask(), ~CHROMOSOME.is_switch
    np.testing.assert_array_equal(genomes[2:], random[2:])
    np.testing.assert_array_equal(genomes[:2, real], given[:, real])
    assert np.all(genomes[:2, ~real] == 1.0)  # a switch is on from 0.5
    pde.start_from(np.zeros((6, CHROMOSOME.size)))
    assert not pde.ask().any()


def test_more_given_genomes_than_the_population_are_refused():
    with pytest.raises(ValueError, match=r"^genomes: expected at most the population, 6, got 7; give fewer or make"):
        PDE(CHROMOSOME, 6, 2, generator()).start_from(np.zeros((7, CHROMOSOME.size)))


# ---- steps 3.1 to 3.3: who is retained -------------------------------------------------------------------------------


def retained(costs, genomes=None, population=None, **options):
    """Return which of the first generation are in the second, by index."""
    costs = np.array(costs, dtype=float)
    pde = PDE(ONE_GENE, len(costs), costs.shape[1], generator(), **{"mutation_spread": 1.0, **options})
    if genomes is not None:
        pde.restore({**pde.state(), "genomes": np.array(genomes, dtype=float)[:, np.newaxis]})
    before = pde.ask()
    pde.tell(before, costs)
    state = pde.state()
    count = np.count_nonzero(state["evaluations"])
    kept = state["genomes"][:count]
    evaluated = state["cost_sums"][:count]
    rows = [tuple(row) for row in np.hstack([before, costs])]
    return [rows.index(tuple(row)) for row in np.hstack([kept, evaluated])]


def test_the_first_layer_is_retained_in_the_populations_order():
    assert retained([[9, 9], [3, 1], [2, 2], [5, 5], [1, 3], [0, 9]]) == [1, 2, 4, 5]


def test_too_small_a_first_layer_is_filled_up_from_the_next_layers_one_at_a_time():
    assert retained([[3, 3], [2, 5], [5, 2], [1, 1], [3, 4]]) == [0, 1, 3]


def test_the_third_layer_follows_the_second():
    assert retained([[4, 4], [3, 3], [2, 2], [1, 1]]) == [1, 2, 3]


def test_equal_costs_have_one_representative():
    assert retained([[1, 2], [1, 2], [2, 1], [3, 3], [2, 1], [4, 4]]) == [0, 2, 3]


def test_equal_genomes_have_one_representative():
    assert retained([[1, 9], [2, 8], [3, 7], [4, 6], [5, 5]], genomes=[7, 7, 1, 2, 3], front=1.0) == [0, 2, 3, 4]


def test_who_shares_with_no_representative_is_one():
    # 1 has the genome of 0 and is none; so 2, with the costs of 1, is.
    assert retained([[1, 9], [2, 8], [2, 8], [4, 6], [9, 9]], genomes=[7, 7, 1, 2, 3]) == [0, 2, 3]


def test_duplicates_are_retained_only_to_make_three():
    assert retained([[1, 1], [1, 1], [2, 2], [1, 1]]) == [0, 1, 2]
    assert retained([[1, 1], [1, 1], [1, 1], [1, 1], [1, 1]]) == [0, 1, 2]


def test_population_does_not_fill_up_with_duplicates():
    pde = PDE(CHROMOSOME, 12, 2, generator(), crossover_rate=0.0, mutation_rate=0.0)  # every child is a duplicate
    for generation in range(20):
        genomes = pde.ask()
        pde.tell(genomes, paper_like(genomes, CHROMOSOME, generation))
    assert np.count_nonzero(pde.state()["evaluations"]) < 12


def test_retained_are_the_front_of_the_distinct_or_three():
    rng = np.random.default_rng(5)
    for objectives in (1, 2, 3):
        costs = rng.integers(0, 6, (30, objectives)).astype(float)
        unique = sorted(np.unique(costs, axis=0, return_index=True)[1])
        front = [i for i in unique if not any(np.all(c <= costs[i]) and np.any(c < costs[i]) for c in costs)]
        got = retained(costs)
        assert [i for i in got if i in front] == front
        assert len(got) == max(3, len(front))


# ---- a front that would fill the population --------------------------------------------------------------------------


@pytest.mark.parametrize("reevaluate", ["accumulate", "once", "renew"])
@pytest.mark.parametrize("acceptance", ["always", "dominates"])
@pytest.mark.parametrize("front", [0.0, 0.6, 1.0])
@pytest.mark.parametrize("costs", [conflicting, three_continuous])
def test_children_are_made_whatever_the_objectives(costs, front, acceptance, reevaluate):
    """Case 50: every second individual may be on the front, and none is ever left without a child."""
    for population in (4, 5, 30):
        options = {"front": front, "acceptance": acceptance, "reevaluate": reevaluate}
        pde = PDE(PAPER, population, costs(PAPER_ZERO, PAPER, 0).shape[1], generator(), **options)
        seen = set()
        for generation in range(30):
            genomes = pde.ask()
            new = {genome.tobytes() for genome in genomes} - seen
            assert new, f"generation {generation}"
            seen |= new
            pde.tell(genomes, costs(genomes, PAPER, generation))


def test_a_front_as_large_as_its_limit_is_left_alone():
    line = [[i, 9 - i] for i in range(6)]
    assert retained([*line, *[[9, 9]] * 4]) == list(range(6))
    assert len(retained([*line, [6, 3], *[[9, 9]] * 3])) == 6


def test_who_is_nearest_to_others_leaves_first():
    #        0       1       2           3           4       5       6       7       8       9
    costs = [[0, 9], [2, 7], [2.1, 6.9], [2.2, 6.8], [4, 5], [5, 4], [6, 3], [7, 2], [9, 0], [9, 9]]
    assert retained(costs, front=0.8) == [0, 1, 3, 4, 5, 6, 7, 8]
    assert retained(costs, front=0.7) == [0, 1, 4, 5, 6, 7, 8]


def test_the_last_of_those_that_are_as_near_leaves_first():
    assert retained([[i, 4 - i] for i in range(5)], front=0.8) == [0, 1, 2, 4]
    assert retained([[4 - i, i] for i in range(5)], front=0.8) == [0, 1, 2, 4]


def test_the_best_in_each_objective_stay():
    rng = np.random.default_rng(3)
    for _ in range(20):
        front = np.abs(rng.standard_normal((20, 3)))
        front /= np.linalg.norm(front, axis=1, keepdims=True)
        kept = front[retained(front, front=0.0)]  # three of them
        np.testing.assert_array_equal(kept.min(axis=0), front.min(axis=0))


def test_units_of_an_objective_do_not_matter_to_who_leaves():
    costs = np.abs(np.random.default_rng(4).standard_normal((30, 3)))
    costs /= np.linalg.norm(costs, axis=1, keepdims=True)
    assert retained(costs * [1, 1024, 2**-20]) == retained(costs)


def test_an_objective_that_is_the_same_on_the_whole_front_does_not_matter():
    assert retained([[i, 4 - i, 7] for i in range(5)], front=0.8) == [0, 1, 2, 4]


def test_the_papers_front_is_never_thinned():
    """F2 has 16 values: no front in two objectives is larger, whatever F1 does."""
    paper = config.load("paper")
    ((name, options),) = paper.optimiser.items()
    assert name == "pde"
    largest = [[i, 15 - i] for i in range(16)]
    costs = [*largest, *[[99, 99]] * (paper.evolution.population - 16)]
    assert retained(costs, **{**options, "mutation_spread": 1.0}) == list(range(16))


# ---- step 3.4: children ----------------------------------------------------------------------------------------------


def breed(space=CHROMOSOME, population=400, **options):
    """Return three parents and their many children, and each child's main parent."""
    pde = PDE(space, population, 2, generator(), **options)
    costs = np.full((population, 2), 9.0)
    costs[:3] = [[0, 2], [1, 1], [2, 0]]
    pde.tell(pde.ask(), costs)
    state = pde.state()
    assert np.all(state["main_parents"][:3] == -1)
    return state["genomes"][:3], state["genomes"][3:], state["main_parents"][3:]


def test_without_crossover_and_mutation_a_child_is_its_main_parent():
    parents, children, main = breed(crossover_rate=0.0, mutation_rate=0.0)
    np.testing.assert_array_equal(children, parents[main])


def test_every_parent_is_main_parent_about_as_often():
    _, _, main = breed()
    assert np.all(np.bincount(main) / len(main) > 0.28)


def test_a_part_shares_one_factor_and_parts_have_their_own():
    parents, children, main = breed(crossover_rate=1.0, mutation_rate=0.0)
    real = ~CHROMOSOME.is_switch
    others = parents[(main + 1) % 3] - parents[(main + 2) % 3]  # or its negative: the factor's sign is free
    factors = (children - parents[main])[:, real] / others[:, real]
    part = CHROMOSOME.part_of[real]
    means = np.stack([factors[:, part == i].mean(axis=1) for i in np.unique(part)], axis=1)
    np.testing.assert_allclose(factors, means[:, np.searchsorted(np.unique(part), part)], atol=1e-9)
    assert means.std() == pytest.approx(1, abs=0.05)
    assert np.abs(np.corrcoef(means, rowvar=False) - np.eye(means.shape[1])).max() < 0.25


def test_links_cross_over_at_their_rate_and_as_wholes():
    parents, children, main = breed(mutation_rate=0.0)
    real = ~CHROMOSOME.is_switch
    crossed = (children != parents[main])[:, real]
    link = CHROMOSOME.link_of[real]
    for i in np.unique(link):
        assert np.all(crossed[:, link == i] == crossed[:, link == i][:, :1])
    assert crossed.mean() == pytest.approx(0.7, abs=0.03)


def test_a_switch_goes_with_its_neurons_inputs():
    parents, children, main = breed(crossover_rate=0.5, mutation_rate=0.0)
    blocks, before = CHROMOSOME.split(children), CHROMOSOME.split(parents[main])
    kept = np.all(blocks["input_hidden"] == before["input_hidden"], axis=2)
    assert np.all((blocks["hidden_switch"] == before["hidden_switch"])[kept])


def test_switches_stay_switches():
    _, children, _ = breed(crossover_rate=1.0, mutation_rate=0.5)
    assert set(np.unique(children[:, CHROMOSOME.is_switch])) == {0.0, 1.0}


def test_a_switch_is_on_from_one_half():
    # Parents on, on, off: a1 + factor (a2 - a3) is 1 with a factor of no effect, or 1 +- factor, or 0 + factor * 0.
    space = GenomeSpace((Block("switch", (1,), "switch"), Block("weight", (1,))))
    pde = PDE(space, 2000, 2, generator(), crossover_rate=1.0, mutation_rate=0.0)
    state = pde.state()
    state["genomes"][:3, 0] = [1, 1, 0]
    pde.restore(state)
    costs = np.full((2000, 2), 9.0)
    costs[:3] = [[0, 2], [1, 1], [2, 0]]
    pde.tell(pde.ask(), costs)
    after = pde.state()
    on, main = after["genomes"][3:, 0], after["main_parents"][3:]
    assert not np.any(on[main == 2])  # 0 + factor * (1 - 1)
    assert on[main < 2].mean() == pytest.approx(0.6915, abs=0.03)  # P(1 + N(0, 1) >= 0.5)


def test_units_mutate_at_their_rate_and_as_wholes():
    parents, children, main = breed(crossover_rate=0.0, mutation_rate=0.2, mutation_spread=0.3)
    changed = children != parents[main]
    unit = CHROMOSOME.unit_of
    for i in np.unique(unit):
        assert np.all(changed[:, unit == i] == changed[:, unit == i][:, :1])
    assert changed.mean() == pytest.approx(0.2, abs=0.03)
    steps = (children - parents[main])[changed & ~CHROMOSOME.is_switch]
    assert steps.std() == pytest.approx(0.3, abs=0.02)
    assert steps.mean() == pytest.approx(0.0, abs=0.02)


def test_mutation_flips_switches():
    parents, children, main = breed(crossover_rate=0.0, mutation_rate=1.0, mutation_spread=0.0)
    np.testing.assert_array_equal(children[:, CHROMOSOME.is_switch], 1 - parents[main][:, CHROMOSOME.is_switch])


def test_individual_genomes_of_a_team_vary_apart():
    team = CHROMOSOME.tile(3)
    parents, children, main = breed(team, crossover_rate=0.0, mutation_rate=0.3, mutation_spread=0.1)
    changed = np.any((children != parents[main]).reshape(-1, 3, CHROMOSOME.size)[:, :, CHROMOSOME.unit_of == 0], axis=2)
    assert np.mean(changed[:, 0] & ~changed[:, 1]) > 0


# ---- options ---------------------------------------------------------------------------------------------------------


def one_generation(pde, costs):
    genomes = pde.ask()
    pde.tell(genomes, np.array(costs, dtype=float))
    return pde.state()


FIRST = [[0, 2], [1, 1], [2, 0], [9, 9], [9, 9]]
SECOND = [[0, 4], [3, 3], [4, 0], [2.5, 2.5], [9, 9]]


def test_accumulate_judges_by_the_mean_of_all_evaluations():
    pde = PDE(ONE_GENE, 5, 2, generator(), mutation_rate=1.0)
    one_generation(pde, FIRST)
    assert len(pde.ask()) == 5
    state = one_generation(pde, SECOND)
    np.testing.assert_array_equal(state["cost_sums"][:3], [[0, 6], [4, 4], [6, 0]])  # (2, 2) dominates the child
    assert state["evaluations"].tolist() == [2, 2, 2, 0, 0]


def test_renew_judges_by_the_newest_evaluation():
    pde = PDE(ONE_GENE, 5, 2, generator(), mutation_rate=1.0, reevaluate="renew")
    one_generation(pde, FIRST)
    assert len(pde.ask()) == 5
    state = one_generation(pde, SECOND)
    np.testing.assert_array_equal(state["cost_sums"][:3], [[0, 4], [4, 0], [2.5, 2.5]])  # the child dominates (3, 3)
    assert state["evaluations"].tolist() == [1, 1, 1, 0, 0]


def test_once_asks_for_children_alone():
    pde = PDE(ONE_GENE, 5, 2, generator(), mutation_rate=1.0, reevaluate="once")
    one_generation(pde, FIRST)
    children = pde.state()["genomes"][3:]
    np.testing.assert_array_equal(pde.ask(), children)
    state = one_generation(pde, SECOND[3:])
    np.testing.assert_array_equal(state["cost_sums"][:3], FIRST[:3])


@pytest.mark.parametrize(("acceptance", "survives"), [("always", True), ("dominates", False)])
def test_acceptance_decides_on_children_that_do_not_dominate_their_main_parent(acceptance, survives):
    pde = PDE(ONE_GENE, 5, 2, generator(), acceptance=acceptance, mutation_rate=1.0, front=1.0)
    state = one_generation(pde, [[0, 4], [2, 2], [4, 0], [9, 9], [9, 9]])
    child, main = state["genomes"][3], state["main_parents"][3]
    costs = np.array([[0, 4], [2, 2], [4, 0], [0, 0], [9, 9]], dtype=float)
    costs[3] = costs[main] + [-0.5, 0.5]  # better in one, worse in the other
    state = one_generation(pde, costs)
    assert (child in state["genomes"]) == survives


def test_acceptance_keeps_a_child_that_dominates_its_main_parent():
    pde = PDE(ONE_GENE, 4, 2, generator(), acceptance="dominates", mutation_rate=1.0)
    state = one_generation(pde, [[0, 4], [2, 2], [4, 0], [9, 9]])
    child, main = state["genomes"][3], state["main_parents"][3]
    costs = np.array([[0, 4], [2, 2], [4, 0], [0, 0]], dtype=float)
    costs[3] = costs[main] - [0.5, 0.0]
    assert child in one_generation(pde, costs)["genomes"]


# ---- rates of one's own ----------------------------------------------------------------------------------------------


def test_self_chosen_rates_are_drawn_in_the_order_of_the_docstring():
    pde, rng = PDE(CHROMOSOME, 4, 2, generator(), rates="self"), generator()
    rng.standard_normal((4, 22))
    rng.random((4, 4))
    rates = rng.random((4, 2))
    np.testing.assert_array_equal(pde.state()["rates"], rates)
    pde.tell(pde.ask(), np.array([[0, 5], [1, 4], [2, 3], [9, 9]], dtype=float))
    main, second, third = rng.choice(3, 3, replace=False)
    child = np.abs(rates[main] + rng.standard_normal(2) * (rates[second] - rates[third]))
    np.testing.assert_array_equal(pde.state()["rates"], [*rates[:3], child % 1])


def test_rates_stay_rates_and_go_with_their_individuals():
    pde = PDE(CHROMOSOME, 12, 2, generator(), rates="self")
    for generation in range(50):
        genomes = pde.ask()
        before = {(g.tobytes(), r.tobytes()) for g, r in zip(genomes, pde.state()["rates"], strict=True)}
        pde.tell(genomes, paper_like(genomes, CHROMOSOME, generation))
        state = pde.state()
        assert state["rates"].shape == (12, 2)
        assert np.all((state["rates"] >= 0) & (state["rates"] <= 1))
        for genome, rates, main in zip(state["genomes"], state["rates"], state["main_parents"], strict=True):
            assert main >= 0 or (genome.tobytes(), rates.tobytes()) in before


def test_an_individuals_rate_of_mutation_is_its_spread_too():
    pde = PDE(CHROMOSOME, 3000, 2, generator(), rates="self")
    pde.restore({**pde.state(), "rates": np.tile([0.0, 0.25], (3000, 1))})  # no crossover; equal rates stay so
    costs = np.full((3000, 2), 9.0)
    costs[:3] = [[0, 2], [1, 1], [2, 0]]
    pde.tell(pde.ask(), costs)
    state = pde.state()
    steps = state["genomes"][3:] - state["genomes"][state["main_parents"][3:]]
    real = ~CHROMOSOME.is_switch
    assert (steps != 0).mean() == pytest.approx(0.25, abs=0.02)
    assert steps[:, real][steps[:, real] != 0].std() == pytest.approx(0.25, abs=0.01)


def test_fixed_rates_are_not_in_the_state():
    """States of earlier versions can be restored, and look the same."""
    assert set(PDE(CHROMOSOME, 4, 2, generator()).state()) == {
        "genomes",
        "cost_sums",
        "evaluations",
        "main_parents",
        "rng",
    }


def rastrigin(distance):
    return distance**2 - 10 * np.cos(2 * np.pi * distance) + 10


@pytest.mark.parametrize(("cost", "share"), [(np.square, 0.1), (rastrigin, 0.8)])
def test_self_chosen_rates_come_far_nearer_to_the_optimum_than_the_papers(cost, share):
    space = FeedForwardNetwork(3).space(SCENE)
    target, real = 2 * generator(99).standard_normal(space.size), ~space.is_switch
    best = {}
    for rates in ("fixed", "self"):
        found = []
        for seed in range(3):
            pde = PDE(space, 30, 2, generator(seed), rates=rates)
            for _ in range(200):
                genomes = pde.ask()
                nearness = cost(genomes - target)[:, real].mean(axis=1)
                pde.tell(genomes, np.column_stack([nearness, hidden_neurons(genomes, space)]))
            found.append(nearness.min())
        best[rates] = np.median(found)
    assert best["self"] < share * best["fixed"], best


# ---- wrong options ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"crossover_rate": 1.1}, "crossover_rate: expected a number from 0 to 1, got 1.1"),
        ({"mutation_rate": -0.1}, "mutation_rate: expected a number from 0 to 1, got -0.1"),
        ({"mutation_rate": float("nan")}, "mutation_rate: expected a number from 0 to 1, got nan"),
        ({"mutation_rate": "1 %"}, "mutation_rate: expected a number from 0 to 1, got '1 %'"),
        ({"mutation_spread": -1.0}, "mutation_spread: expected a number of at least 0, got -1.0"),
        ({"mutation_spread": float("inf")}, "mutation_spread: expected a number of at least 0, got inf"),
        ({"front": 1.5}, "front: expected a number from 0 to 1, got 1.5"),
        ({"reevaluate": "never"}, "reevaluate: expected one of accumulate, once, renew, got 'never'"),
        ({"rates": "wild"}, "rates: expected one of fixed, self, got 'wild'"),
        ({"acceptance": "maybe"}, "acceptance: expected one of always, dominates, got 'maybe'"),
    ],
)
def test_wrong_options_are_one_clear_line(options, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        PDE(CHROMOSOME, 10, 2, generator(), **options)


def test_three_individuals_are_too_few():
    with pytest.raises(ValueError, match="population: expected a number of at least 4, got 3"):
        PDE(CHROMOSOME, 3, 2, generator())

# SPDX-License-Identifier: BSD-3-Clause
"""Several worlds in one evaluation: who meets what, what is stored, and how one number comes of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import small_runs
import toy_plugins
from swarmevo import config
from swarmevo.analysis import fronts
from swarmevo.config import Config
from swarmevo.errors import ConfigError, EvaluationError
from swarmevo.evolution.aggregation import OverWorlds
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.evolution.jobs import Job, Setup
from swarmevo.plugins.team import Team
from swarmevo.protocols import FloatArray, Objective
from swarmevo.runs import other_world
from swarmevo.runs.store import Store
from swarmevo.runs.verification import verify
from swarmevo.simulation import EpisodeKey
from swarmevo.testing import random_genomes
from swarmevo.views.replay import episode as replay_episode

SCORE = Objective("score", "maximise", (0.0, 10.0))
TIME = Objective("time", "minimise", (0.0, 100.0))
SIZE = Objective("size", "minimise", (0.0, 15.0), of="genome")
MEANS = np.array([[[8.0, 20.0, 3.0], [2.0, 70.0, 3.0], [5.0, 10.0, 3.0]]])
"""Of one individual in three worlds."""


def over(objectives: list[Objective], *overrides: str) -> FloatArray:
    weights = next((text for text in overrides if text.startswith("worlds")), "worlds=[{}, {}, {}]")
    rest = [text for text in overrides if not text.startswith("worlds")]
    found: FloatArray = OverWorlds(config.load("paper", [weights, *rest]), objectives)(MEANS)[0]
    return found


def test_the_mean_is_by_weight() -> None:
    found = over([SCORE, TIME, SIZE], "worlds=[{weight: 1}, {weight: 2}, {weight: 1}]")
    assert found.tolist() == [(8 + 2 * 2 + 5) / 4, (20 + 2 * 70 + 10) / 4, 3.0]


def test_a_negative_weight_wants_the_opposite() -> None:
    """Score 2 of 0 to 10 counts as 8, time 70 of 0 to 100 as 30; the genome's size is what it is."""
    found = over([SCORE, TIME, SIZE], "worlds=[{}, {weight: -2}, {}]")
    assert found.tolist() == [(8 + 2 * 8 + 5) / 4, (20 + 2 * 30 + 10) / 4, 3.0]


def test_the_worst_is_the_worst_of_each_objective() -> None:
    assert over([SCORE, TIME, SIZE], "evolution.over_worlds=worst").tolist() == [2.0, 70.0, 3.0]
    assert over([SCORE, TIME, SIZE], "evolution.over_worlds=worst", "worlds=[{weight: -1}, {}, {}]").tolist() == [
        2.0,
        80.0,
        3.0,
    ]


def test_a_quantile_counts_from_the_worst() -> None:
    quantile = "evolution.over_worlds=quantile"
    assert over([SCORE, TIME, SIZE], quantile, "evolution.worlds_quantile=0.5").tolist() == [5.0, 20.0, 3.0]
    assert over([SCORE, TIME, SIZE], quantile, "evolution.worlds_quantile=0.25").tolist() == [3.5, 45.0, 3.0]


# ---- evaluations -----------------------------------------------------------------------------------------------------

WORLDS = ["worlds=[{team.robots: 2}, {team.robots: 4, weight: 2}]", "vary.box.mass={uniform: [0.2, 0.28]}"]


def settings(*overrides: str) -> Config:
    return config.load("paper", [*WORLDS, "evolution.seed=3", "evolution.repeats=2", "episode.horizon=3", *overrides])


def test_each_individual_meets_each_world_as_often() -> None:
    chosen = settings()
    with Evaluator(chosen, 1) as evaluator:
        found = evaluator.evaluate(random_genomes(evaluator.space, 3), 0, 0)
    assert found.episodes.grid("world").tolist() == [[0, 1, 0, 1]] * 3
    assert found.episodes.grid("robots").tolist() == [[2, 4, 2, 4]] * 3
    assert np.isnan(found.episodes.grid("homing_time")[:, ::2, 2:]).all()
    assert found.episodes["homing_time"].shape == (12, 4)


def test_an_episode_is_the_one_of_its_world_alone() -> None:
    """Held against a simulation of a configuration that names no worlds and varies nothing."""
    chosen = settings()
    with Evaluator(chosen, 2) as evaluator:
        genomes = random_genomes(evaluator.space, 3)
        found = evaluator.evaluate(genomes, 1, 5)
    for repeat, robots in enumerate((2, 4, 2, 4)):
        key = EpisodeKey(3, 1, 5, repeat)
        mass = other_world.of_episode(chosen, key).box.mass
        assert 0.2 <= mass <= 0.28
        alone = config.load("paper", [f"team.robots={robots}", f"box.mass={mass!r}", "episode.horizon=3"])
        team = Team(alone)
        done = team.simulate(genomes, [key] * 3)
        assert found.episodes.grid("hash")[:, repeat].tolist() == done.hash.tolist()
        judged = [team.judge(done, genomes, i).tolist() for i in range(3)]
        assert found.episodes.grid("objective")[:, repeat].tolist() == judged


@pytest.mark.parametrize("controller", ["toy_network", "toy_linear"])
def test_the_bits_do_not_depend_on_workers_or_on_what_is_known(distribution: Any, controller: str) -> None:
    """The second one is written in Python and sees the worlds of a job at once."""
    toy_plugins.install(distribution)
    chosen = toy_plugins.config(
        controller=controller,
        worlds=[{"team.robots": 2}, {"team.robots": 4, "weight": 2}],
        vary={"box.mass": {"uniform": [0.2, 0.28]}},
    )
    with Evaluator(chosen, 1) as evaluator:
        genomes = random_genomes(evaluator.space, 5)
        one = evaluator.evaluate(genomes, 0, 2)
    with Evaluator(chosen, 3) as evaluator:
        wanted = np.zeros(20, dtype=np.bool_)
        wanted[[3, 4, 11]] = True
        three = evaluator.evaluate(genomes, 0, 2, known=one.episodes.only(wanted))
    assert one.episodes["hash"].tolist() == three.episodes["hash"].tolist()
    assert one.costs.tolist() == three.costs.tolist()


def test_an_episode_that_failed_is_known_with_its_world() -> None:
    setup = Setup(settings())
    job = Job((7,), random_genomes(setup.team.space, 1), (EpisodeKey(3, 0, 0, 1),))
    lost = setup.failed(job, "reason", 0.0)
    assert (lost["world"][0], lost["robots"][0], lost["hash"][0]) == (1, 4, 0)
    assert lost["objective"].tolist() == [[0.0, 15.0]]


# ---- what a fitness is told of its scene ----------------------------------------------------------------------------

SCENIC = """
import numpy as np
from swarmevo.protocols import Objective

class Scenic:
    channels = ()

    def __init__(self, scene, beyond: float = 0.0, odd: bool = False):
        self._scene, self._beyond = scene, beyond
        name = f"score_{scene.robots}" if odd else "score"
        self.objectives = (Objective(name, "maximise", (-scene.robots, scene.horizon)),)

    def evaluate(self, telemetry, genomes, controller):
        assert telemetry.world == self._scene.world
        return np.full((len(genomes), 1), self._scene.horizon + self._beyond)
"""


@pytest.fixture
def scenic(distribution: Any) -> None:
    distribution("scenic", "1.0", {"swarmevo.fitness": {"scenic": "scenic_worlds:Scenic"}}, scenic_worlds=SCENIC)


@pytest.mark.usefixtures("scenic")
def test_a_fitness_is_made_for_each_world_and_has_the_widest_range() -> None:
    worlds = "worlds=[{team.robots: 2}, {team.robots: 4, episode.horizon: 1}]"
    chosen = config.load("paper", [worlds, "fitness=scenic", "evolution.seed=3", "evolution.repeats=1"])
    chosen = config.changed(chosen, ["episode.horizon=2"])
    with Evaluator(chosen, 1) as evaluator:
        found = evaluator.evaluate(random_genomes(evaluator.space, 2), 0, 0)
        assert evaluator.objectives == [Objective("score", "maximise", (-4.0, 2.0))]
    assert found.episodes.grid("objective")[..., 0].tolist() == [[2.0, 1.0]] * 2


@pytest.mark.usefixtures("scenic")
def test_a_fitness_is_made_for_what_varies() -> None:
    """The range is that of the ends; each episode has its own scene."""
    vary = "vary.episode.horizon={choice: [0.5, 1, 1.5]}"
    chosen = config.load("paper", [vary, "fitness=scenic", "evolution.seed=3", "evolution.repeats=8"])
    chosen = config.changed(chosen, ["episode.horizon=0.5"])
    with Evaluator(chosen, 1) as evaluator:
        found = evaluator.evaluate(random_genomes(evaluator.space, 1), 0, 0)
        assert evaluator.objectives == [Objective("score", "maximise", (-5.0, 1.5))]
    horizons = [other_world.of_episode(chosen, EpisodeKey(3, 0, 0, i)).episode.horizon for i in range(8)]
    assert found.episodes.grid("objective")[0, :, 0].tolist() == horizons
    assert set(horizons) == {0.5, 1.0, 1.5}


@pytest.mark.usefixtures("scenic")
def test_a_fitness_must_measure_the_same_in_all_worlds() -> None:
    chosen = config.load("paper", ["worlds=[{team.robots: 2}, {team.robots: 4}]", "fitness.scenic.odd=true"])
    message = r"^fitness\.scenic \(scenic 1\.0\): objectives: expected the same in all worlds, .*score_2.*score_4"
    with pytest.raises(EvaluationError, match=message):
        Setup(chosen)


@pytest.mark.usefixtures("scenic")
def test_a_value_outside_the_widest_range_is_one_error() -> None:
    chosen = config.load("paper", ["fitness.scenic.beyond=0.5", "evolution.seed=3", "episode.horizon=1"])
    message = (
        r"^fitness\.scenic \(scenic 1\.0\): evaluate: expected score in its range from -5 to 1, got 1\.5; .*, "
        "in trial 0, generation 0, individual 0, repeat 0"
    )
    with Evaluator(chosen, 1) as evaluator, pytest.raises(EvaluationError, match=message):
        evaluator.evaluate(random_genomes(evaluator.space, 1), 0, 0)


# ---- runs ------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_runs.make(tmp_path_factory.mktemp("worlds") / "run", *WORLDS, "evolution.repeats=2")


def test_a_run_is_verified_to_the_bit(run: Path) -> None:
    with Store.open(run) as store:
        report = verify(store, workers=2)
    assert report.is_sound
    assert report.episodes == 2 * 2 * 4 * 2 * 2


def test_a_front_is_judged_as_evolution_judged_it(run: Path) -> None:
    with Store.open(run) as store, Evaluator(store.config, 1) as evaluator:
        first = store.generation(0, 0)
        again = evaluator.evaluate(first.genomes, 0, 0)
        found = store.individuals(0)
        only_once = [g for g in store.genome_ids(0, 0) if g not in store.genome_ids(0, 1)]
        for genome in only_once:
            place = store.genome_ids(0, 0).tolist().index(genome)
            stored = found.objectives[found.genome.tolist().index(genome)]
            assert stored == pytest.approx([-again.costs[place, 0], again.costs[place, 1]], rel=1e-14)


def test_rates_count_the_robots_that_were_there(run: Path) -> None:
    with Store.open(run) as store:
        found, generation = store.individuals(0), store.generation(0, 0)
        came = np.isfinite(generation.episodes["homing_time"]).sum(axis=1)
        assert np.all(came <= generation.episodes["robots"])
        assert np.all((found.homing_rate >= 0) & (found.homing_rate <= 1))
        assert store.robots == 4


def test_a_replay_is_the_stored_episode_in_its_world(run: Path) -> None:
    with Store.open(run) as store:
        for repeat, robots in enumerate((2, 4)):
            chosen = replay_episode.choose(store, repeat=repeat)
            (shown,), warning = replay_episode.episodes(store, chosen)
            assert (shown["robots"], warning) == (robots, "")


def test_what_a_run_costs_is_what_was_simulated(run: Path) -> None:
    with Store.open(run) as store:
        assert fronts.summarise(store).cost.simulated_seconds == pytest.approx(64 * 2.0)


def test_a_world_without_weight_changes_nothing(tmp_path: Path, run: Path) -> None:
    plain = small_runs.make(tmp_path / "plain", "evolution.repeats=2")
    named = small_runs.make(tmp_path / "named", "evolution.repeats=2", "worlds=[{team.robots: 3}]")

    def hashes(folder: Path) -> list[Any]:
        with Store.open(folder) as store:
            return [store.generation(t, g).episodes["hash"].tolist() for t in (0, 1) for g in (0, 1)]

    assert hashes(plain) == hashes(named) != hashes(run)


def test_an_obstacle_that_is_drawn_stands_clear(tmp_path: Path) -> None:
    """Both ends of its range can be, what is between them is mostly on the box."""
    region = "{uniform: [[-0.4, 0.345, 0], [0.4, 0.345, 0]]}"
    folder = small_runs.make(
        tmp_path / "run", "scene.obstacles=[{size: [0.04, 0.04, 0.1]}]", f"vary={{scene.obstacles.0.pose: {region}}}"
    )
    with Store.open(folder) as store:
        assert verify(store, workers=1).is_sound
        keys = [EpisodeKey(store.seed, trial, n, 0) for trial in store.trials() for n in range(50)]
        drawn = [other_world.of_episode(store.config, key).scene.obstacles[0].pose[0] for key in keys]
    assert min(map(abs, drawn)) >= 0.275 / 2 + 0.02
    assert len(set(drawn)) == len(keys)
    assert min(drawn) < -0.3 < 0.3 < max(drawn)


def test_worlds_of_which_none_can_be_are_told(tmp_path: Path) -> None:
    two = "vary={scene.obstacles.0.pose: {choice: [[0.3, 0.345, 0]]}, box.pose: {choice: [[0.3, 0.345, 0]]}}"
    with pytest.raises(
        ConfigError, match=r"^vary: expected a world .* trial 0, generation 0, repeat 0, got none; the "
    ):
        small_runs.make(tmp_path / "run", "scene.obstacles=[{size: [0.04, 0.04, 0.1], pose: [-0.4, 0, 0]}]", two)

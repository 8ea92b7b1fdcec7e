# SPDX-License-Identifier: BSD-3-Clause
"""What the hand-written controllers of ``examples/baselines.py`` score in their tasks, and random genomes beside them.

    python -m benchmarks.tasks [TASK ...] [--episodes 50] [--seed 1]

Prints the table of docs/tasks.md: for each objective that is measured in an episode the mean and its standard error.
Random genomes are those that the configuration's optimiser begins with, one for each episode.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence

import numpy as np

from benchmarks.pages import table
from examples.baselines import BASELINES
from swarmevo import plugins
from swarmevo.config import Config
from swarmevo.plugins.team import Team, load_config
from swarmevo.protocols import FloatArray
from swarmevo.simulation import EpisodeKey, Episodes, simulate_lockstep

GENERATION = 2**31
"""Of the keys of these episodes: no run has it."""


def names(settings: Config) -> list[str]:
    """Return the objectives that are measured in an episode."""
    return [one.name for one in Team(settings).objectives if one.of == "episode"]


def baseline(settings: Config, task: str, episodes: int, seed: int) -> FloatArray:
    """Return ``(episodes, objectives)`` of the task's hand-written controller."""
    team = Team(settings)
    robots = np.zeros((episodes, team.robots, 0))
    actor = BASELINES[task](team.scene.info)
    done = simulate_lockstep(team.scene, actor, robots, _keys(episodes, seed), team.channels)
    return _judged(team, done, np.zeros((episodes, team.space.size)))


def random(settings: Config, episodes: int, seed: int) -> FloatArray:
    """Return ``(episodes, objectives)`` of random genomes."""
    team = Team(settings)
    ((name, options),) = settings.optimiser.items()
    rng = np.random.default_rng(seed)
    optimiser = plugins.create("optimiser", name, options, team.space, max(episodes, 4), len(team.objectives), rng)
    genomes = optimiser.ask()[:episodes]
    return _judged(team, team.simulate(genomes, _keys(episodes, seed)), genomes)


def _keys(episodes: int, seed: int) -> list[EpisodeKey]:
    return [EpisodeKey(seed, 0, GENERATION, i) for i in range(episodes)]


def _judged(team: Team, done: Episodes, genomes: FloatArray) -> FloatArray:
    columns = [i for i, one in enumerate(team.objectives) if one.of == "episode"]
    return np.array([team.judge(done, genomes, i)[columns] for i in range(len(genomes))])


def row(task: str, episodes: int, seed: int) -> Iterator[Sequence[str]]:
    """Yield a line of the table for each objective."""
    settings = load_config(task)
    scores = [baseline(settings, task, episodes, seed), random(settings, episodes, seed)]
    for i, name in enumerate(names(settings)):
        yield [task, name, *(_mean(score[:, i]) for score in scores)]


def _mean(values: FloatArray) -> str:
    return f"{values.mean():.3f} ± {values.std(ddof=1) / len(values) ** 0.5:.3f}"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tasks")
    parser.add_argument("tasks", nargs="*", metavar="TASK", help=", ".join(BASELINES))
    parser.add_argument("--episodes", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    rows = [line for task in asked.tasks or BASELINES for line in row(task, asked.episodes, asked.seed)]
    print(table(["task", "objective", "by hand", "random"], rows), end="")


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: BSD-3-Clause
"""The tasks that ship in a second simulator: what their controllers by hand score there and in the library.

    python -m benchmarks.second_simulator.tasks [TASK ...] [--episodes 30] [--threads 2]

Prints docs/results/second-simulator-tasks.md. Objectives are written here anew, from docs/tasks.md, docs/fitness.md and
docs/paper-map.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from types import SimpleNamespace
from typing import Any, Final, NamedTuple

import numpy as np

from benchmarks.pages import table
from benchmarks.second_simulator import sensors
from benchmarks.second_simulator.episode import TIME_STEP, Mind, Outcome, observation_names, run
from benchmarks.twin import arena_of, surroundings_of
from examples.baselines import BASELINES
from swarmevo.config import Config
from swarmevo.config import load as load_config
from swarmevo.protocols import FloatArray

TASKS: Final = tuple(task for task in BASELINES if task != "paper")  # which has a page of its own
SEED: Final = 2027
ALIKE: Final = 3.0
"""Standard errors of their difference by which means may differ."""


def mind_of(task: str, config: Config) -> Mind:
    """Return a task's controller by hand, at the start of an episode."""
    scene: Any = SimpleNamespace(observation_names=observation_names(config))
    actor = BASELINES[task](scene)
    actor.start(np.zeros((1, config.team.robots, 0)))
    return lambda seen: np.clip(actor.act(seen[np.newaxis])[0], -1, 1)


# ---- objectives ------------------------------------------------------------------------------------------------------


class Paths(NamedTuple):
    """Of an episode."""

    robots: FloatArray
    """``(steps, n, 3)``"""
    movables: FloatArray
    """``(steps, m, 3)``"""
    outcome: Outcome


def paths_of(config: Config, outcome: Outcome) -> Paths:
    n = config.team.robots
    return Paths(outcome.poses[:, :n], outcome.poses[:, n:], outcome)


def corners_of(config: Config) -> FloatArray:
    """Return the arena's corners, of a round one those of the square around it: ``(n, 2)``."""
    arena = arena_of(config)
    return np.array(
        [(-arena, -arena), (arena, -arena), (arena, arena), (-arena, arena)] if isinstance(arena, float) else arena
    )


def aggregation(config: Config, paths: Paths) -> float:
    arena = arena_of(config)
    radius = arena if isinstance(arena, float) else float(np.linalg.norm(corners_of(config), axis=1).max())
    nearness = []
    for poses in paths.robots:
        middle = poses[:, :2].mean(axis=0)
        nearness.append(1 - np.linalg.norm(poses[:, :2] - middle, axis=1).mean() / radius)
    return float(np.mean(nearness))


def largest_cluster(config: Config, paths: Paths) -> float:
    places = paths.robots[-1, :, :2]
    left, largest = set(range(len(places))), 0
    while left:
        cluster, edge = set(), [left.pop()]
        while edge:
            one = edge.pop()
            cluster.add(one)
            near = {i for i in left if np.linalg.norm(places[i] - places[one]) <= 4 * config.robot.radius}
            left -= near
            edge += near
        largest = max(largest, len(cluster))
    return largest / len(places)


def coverage(config: Config, paths: Paths) -> float:
    cell, corners = 0.1, corners_of(config)
    low, count = corners.min(axis=0), np.ceil(np.ptp(corners, axis=0) / cell - 1e-9).astype(int)
    middles = low + cell * (np.stack(np.meshgrid(*map(np.arange, count), indexing="ij"), axis=-1) + 0.5)
    gaps = [sensors.gaps_to_walls(config, middles)]
    gaps += [sensors.gap_to(one, np.array(one.pose), middles) for one in surroundings_of(config).obstacles]
    free = np.min(gaps, axis=0) >= config.robot.radius
    been = np.zeros_like(free)
    for x, y in np.floor((paths.robots[..., :2].reshape(-1, 2) - low) / cell).astype(int):
        been[min(x, count[0] - 1), min(y, count[1] - 1)] = True
    return float(been[free].mean())


def delivery(config: Config, paths: Paths) -> float:
    steps = round(config.episode.horizon / config.episode.control_period)
    has_been = np.logical_or.accumulate(paths.outcome.at_goal).mean(axis=1)
    return float((has_been.sum() + has_been[-1] * (steps - len(has_been))) / steps)


def transport(config: Config, paths: Paths) -> float:
    come = []
    for i, thing in enumerate(surroundings_of(config).movables):
        ways = np.array([_way_to_goal(config, thing, pose) for pose in paths.movables[:, i]])
        nearest = 0.0 if paths.outcome.at_goal[:, i].any() else ways.min()
        come.append(1 - nearest / ways[0] if ways[0] > 0 else 1.0)
    return float(np.mean(come))


def _way_to_goal(config: Config, thing: Any, pose: FloatArray) -> float:
    """Return how far a movable is from the nearest goal [m]: its rim from a wall, its middle from a region."""
    goals = config.scene.goals
    if goals is None:
        return max(sensors.way_to_wall(config, config.arena.target_wall, thing, pose), 0.0)
    ways = []
    for goal in goals:
        if goal.region is None:
            ways.append(max(sensors.way_to_wall(config, goal.wall or "", thing, pose), 0.0))
        else:
            west, east, south, north = goal.region
            nearest = np.clip(pose[:2], (west, south), (east, north))
            ways.append(float(np.linalg.norm(pose[:2] - nearest)))
    return min(ways)


def box_pushing(config: Config, paths: Paths) -> float:
    """F1 of a world without a box: the mean of ``(1 - i) W_L W_R V S``."""
    names = observation_names(config)
    seen, strongest = paths.outcome.seen, config.emitter.strength[1]
    activity = seen[..., [i for i, name in enumerate(names) if name.startswith("infrared")]].max(axis=-1)
    left, right = np.maximum(paths.outcome.commands, 0).transpose(2, 0, 1)
    signal = strongest * seen[..., names.index("rf")]
    return float(((1 - activity) * left * right * (left + right) / 2 * signal).mean())


def homing(config: Config, paths: Paths) -> float:
    return float(np.isfinite(paths.outcome.homing_times).mean())


def _ways_to_emitter(config: Config, paths: Paths) -> FloatArray:
    """Return ``(steps, n)``: how far robots are from the emitter in the plane [m]."""
    return np.asarray(np.linalg.norm(paths.robots[..., :2] - config.emitter.position[:2], axis=-1))


def nearness(config: Config, paths: Paths) -> float:
    farthest = np.linalg.norm(corners_of(config) - config.emitter.position[:2], axis=1).max()
    return float(1 - _ways_to_emitter(config, paths).mean() / farthest)


def arrived(config: Config, paths: Paths) -> float:
    return float((_ways_to_emitter(config, paths)[-1] <= 0.2).mean())


OBJECTIVES: Final[Mapping[str, Callable[[Config, Paths], float]]] = {
    "aggregation": aggregation,
    "largest_cluster": largest_cluster,
    "coverage": coverage,
    "delivery": delivery,
    "transport": transport,
    "box_pushing": box_pushing,
    "homing": homing,
    "nearness": nearness,
    "arrived": arrived,
}


def objectives_of(config: Config) -> list[str]:
    """Return the objectives of a task that are measured in an episode."""
    return [name for name in config.fitness if name in OBJECTIVES]


def judge(config: Config, outcome: Outcome) -> list[float]:
    """Return an episode's objectives, in the order of ``objectives_of``."""
    return [OBJECTIVES[name](config, paths_of(config, outcome)) for name in objectives_of(config)]


# ---- the tests -------------------------------------------------------------------------------------------------------


def episode(task: str, number: int) -> list[float]:
    """Return the objectives of an episode in the second simulator."""
    config = load_config(task)
    rng = np.random.default_rng((SEED, TASKS.index(task), number))
    return judge(config, run(config, mind_of(task, config), rng, whole=True))


class Row(NamedTuple):
    """An objective in either simulator: means and their standard errors."""

    task: str
    objective: str
    second: tuple[float, float]
    library: tuple[float, float]

    @property
    def difference(self) -> float:
        """In standard errors."""
        error = float(np.hypot(self.second[1], self.library[1]))
        apart = abs(self.second[0] - self.library[0])
        return apart / error if error > 0 else (0.0 if apart == 0 else float("inf"))


def mean(values: FloatArray) -> tuple[float, float]:
    return float(values.mean()), float(values.std(ddof=1) / len(values) ** 0.5)


def compare(task: str, episodes: int, threads: int) -> list[Row]:
    """Test a task's controller by hand in both."""
    from benchmarks import tasks

    config = load_config(task)
    library = tasks.baseline(config, task, episodes, SEED)
    with ProcessPoolExecutor(threads) as pool:
        second = np.array(list(pool.map(partial(episode, task), range(episodes))))
    columns = [tasks.names(config).index(name) for name in objectives_of(config)]
    rows = [
        Row(task, name, mean(second[:, i]), mean(library[:, column]))
        for i, (name, column) in enumerate(zip(objectives_of(config), columns, strict=True))
    ]
    for row in rows:
        print(row, file=sys.stderr, flush=True)
    return rows


# ---- the page --------------------------------------------------------------------------------------------------------


def page(rows: Sequence[Row], episodes: int, command: str) -> str:
    """Return the page."""
    cells = [
        [row.task, row.objective, *(f"{value:.3f} ± {error:.3f}" for value, error in row[2:]), f"{row.difference:.1f}"]
        for row in rows
    ]
    alike = all(row.difference <= ALIKE for row in rows)
    return f"""# The tasks in a second simulator

Are [the tasks](../tasks.md) what their page says, or what one simulator makes of them? Their
[controllers by hand](../../examples/baselines.py) in the library and in the [second simulator](second-simulator.md),
which shares with it the numbers of the configurations alone: round and rectangular arenas, obstacles, boxes and
cylinders that are pushed, beacons that ride on them, lights, range and bearing. Bodies move by springs, dampers and
Coulomb's circles in steps of {1e6 * TIME_STEP:g} us. [Sensors](../../benchmarks/second_simulator/sensors.py), noise,
[starts](../../benchmarks/second_simulator/episode.py) and [objectives](../../benchmarks/second_simulator/tasks.py) are
written anew from the documentation. [Tests](../../tests/repository/test_second_simulator_tasks.py) hold what does not
move against the library, in random scenes and along its own episodes. Made by

```console
{command}
```

Means of {episodes} episodes in either, which start differently, with standard errors; their difference in standard
errors of it:

{table(["task", "objective", "second simulator", "library", "difference"], cells)}
No two means differ by more than {ALIKE:g} standard errors: **{"yes" if alike else "no"}**.
"""


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tasks", nargs="*", metavar="TASK", help=", ".join(TASKS))
    parser.add_argument("--episodes", type=int, default=30)
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    command = " ".join(["python -m benchmarks.second_simulator.tasks", *sys.argv[1:]])
    rows = [row for task in options.tasks or TASKS for row in compare(task, options.episodes, options.threads)]
    print(page(rows, options.episodes, command), end="")


if __name__ == "__main__":
    main()

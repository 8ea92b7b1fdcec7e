# SPDX-License-Identifier: BSD-3-Clause
"""What objects, arenas and sensors cost: scenes that differ from the paper's in one thing, in turns, on one core.

    python -m benchmarks.scenes > docs/performance/scenes.md

Robots have random networks, which drive into everything. Each row's time is over that of the paper's scene of the same
round, so that a noisy machine disturbs both.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from swarmevo.config import Config
from swarmevo.protocols import FeedForward
from swarmevo.simulation import EpisodeKey, Scene, simulate

EPISODES: Final = 16
HORIZON: Final = 60.0
"""[s]"""
HIDDEN: Final = 5

SOUTH: Final = {"start": "random", "start_region": [-0.4, 0.4, -0.44, -0.2]}
PUCK: Final = {"shape": "cylinder", "size": [0.06, 0.06, 0.03], "mass": 0.03}
BLOCK: Final = {"size": [0.08, 0.06, 0.03], "mass": 0.03}
PLACES: Final = [[x, y, x + y] for x in (-0.2, 0.0, 0.2) for y in (0.0, 0.15, 0.3)]
PILLARS: Final = [
    {"shape": "cylinder", "pose": [0.75 * np.cos(a), 0.75 * np.sin(a), 0.0]} for a in 2 * np.pi * np.arange(10) / 10
]
HEXAGON: Final = [[0.62 * np.cos(a), 0.62 * np.sin(a)] for a in 2 * np.pi * np.arange(6) / 6]
CROWD: Final = {
    "arena": {"size": 2.0},
    "team": {"robots": 20, "start": "random", "start_region": [-0.6, 0.6, -0.6, 0.6]},
}

SCENES: Final[Mapping[str, Mapping[str, Any]]] = {
    "the paper's": {},
    "the paper's, from random starts in the south": {"team": SOUTH},
    "nothing to push": {"scene": {"movables": []}},
    "no emitter": {"scene": {"emitters": []}},
    "nine pucks": {"team": SOUTH, "scene": {"movables": [PUCK | {"pose": pose} for pose in PLACES]}},
    "nine small boxes": {"team": SOUTH, "scene": {"movables": [BLOCK | {"pose": pose} for pose in PLACES]}},
    "three obstacles": {
        "team": SOUTH,
        "scene": {
            "obstacles": [
                {"shape": "box", "size": [0.1, 0.05, 0.1], "pose": [-0.2, 0.0, 0.5]},
                {"shape": "cylinder", "pose": [0.2, 0.0, 0.0]},
                {"shape": "wall", "ends": [[0.0, -0.1], [0.0, 0.2]]},
            ]
        },
    },
    "a round arena of 1.2 m": {"arena": {"shape": "circle", "size": 1.2}, "team": SOUTH},
    "a hexagon": {"arena": {"shape": "polygon", "corners": HEXAGON}, "team": SOUTH},
    "20 robots in 2 m": CROWD,
    "20 robots in 2 m, ten pillars": {**CROWD, "scene": {"obstacles": PILLARS}},
}


def _ready(settings: Mapping[str, Any]) -> tuple[Config, Scene, FeedForward]:
    config = Config.model_validate({**settings, "episode": {"horizon": HORIZON}})
    scene = Scene(config)
    rng = np.random.default_rng(0)
    shapes = (EPISODES, HIDDEN, scene.info.observations + 1), (EPISODES, scene.info.commands, HIDDEN + 1)
    weights = (2 * rng.normal(size=shape) for shape in shapes)
    return config, scene, FeedForward(*weights, np.ones((EPISODES, HIDDEN), dtype=bool))


def _seconds(scene: Scene, networks: FeedForward, robots: int) -> float:
    """Return the CPU time of all episodes [s]."""
    keys = [EpisodeKey(seed=1, trial=0, generation=0, repeat=i) for i in range(EPISODES)]
    drivers = np.repeat(np.arange(EPISODES, dtype=np.uint32)[:, None], robots, axis=1)
    start = time.process_time()
    simulate(scene, networks, keys, drivers)
    return time.process_time() - start


def table(rounds: int) -> str:
    """Return the page's table, in Markdown."""
    ready = {name: _ready(settings) for name, settings in SCENES.items()}
    times: dict[str, list[float]] = {name: [] for name in SCENES}
    for _ in range(rounds):
        for name, (config, scene, networks) in ready.items():
            times[name].append(_seconds(scene, networks, config.team.robots))
    first = times["the paper's"]
    lines = ["| scene | simulated s per CPU s | time over the paper's scene | range |", "| --- | ---: | ---: | ---: |"]
    for name, seconds in times.items():
        ratios = [here / there for here, there in zip(seconds, first, strict=True)]
        rate = EPISODES * HORIZON / statistics.median(seconds)
        spread = f"{min(ratios):.2f} to {max(ratios):.2f}"
        lines.append(f"| {name} | {rate:,.0f} | {statistics.median(ratios):.2f} | {spread} |")
    return "\n".join(lines)


def main() -> None:
    """Print the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5, help="of all scenes, one after the other")
    rounds = parser.parse_args().rounds
    print(
        "# What objects, arenas and sensors cost\n\n"
        f"Made by `python -m benchmarks.scenes --rounds {rounds}`: {EPISODES} episodes of {HORIZON:g} s with random "
        "networks, one core, in turns;\neach time over that of the paper's scene in the same round, median and range.\n"
    )
    print(table(rounds))


if __name__ == "__main__":
    main()

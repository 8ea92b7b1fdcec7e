# SPDX-License-Identifier: BSD-3-Clause
"""What objects, arenas and sensors cost: scenes that differ from another in one thing, in turns, on one core.

    python -m benchmarks.scenes > docs/performance/scenes.md

Each row's time is over that of its table's first row, which runs right before it, so that a noisy machine disturbs
both.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from examples.baselines import Explorer, Sectors
from swarmevo.config import Config
from swarmevo.protocols import Actor, FeedForward, SceneInfo
from swarmevo.simulation import EpisodeKey, Lockstep, Scene, simulate

EPISODES: Final = 24
HORIZON: Final = 60.0
"""[s]"""
HIDDEN: Final = 5

Settings = Mapping[str, Any]

BOX: Final = Config().box.model_dump()
EMITTER: Final = Config().emitter.model_dump()
SOUTH: Final = {"start": "random", "start_region": [-0.4, 0.4, -0.44, -0.2]}
PUCK: Final = {"shape": "cylinder", "size": [0.06, 0.06, 0.03], "mass": 0.03}
BLOCK: Final = {"size": [0.08, 0.06, 0.03], "mass": 0.03}
PLACES: Final = [[x, y, x + y] for x in (-0.2, 0.0, 0.2) for y in (0.0, 0.15, 0.3)]
OBSTACLES: Final[Mapping[str, Settings]] = {
    "box": {"shape": "box", "size": [0.1, 0.05, 0.1], "pose": [-0.2, 0.0, 0.5]},
    "cylinder": {"shape": "cylinder", "pose": [0.2, 0.0, 0.0]},
    "wall": {"shape": "wall", "ends": [[0.0, -0.1], [0.0, 0.2]]},
}
PILLARS: Final = [
    {"shape": "cylinder", "pose": [0.75 * np.cos(a), 0.75 * np.sin(a), 0.0]} for a in 2 * np.pi * np.arange(10) / 10
]
HEXAGON: Final = [[0.62 * np.cos(a), 0.62 * np.sin(a)] for a in 2 * np.pi * np.arange(6) / 6]
CROWD: Final = {
    "arena": {"size": 2.0},
    "team": {"robots": 20, "start": "random", "start_region": [-0.6, 0.6, -0.6, 0.6]},
}
AMONG_PILLARS: Final = {**CROWD, "scene": {"obstacles": PILLARS}}
MESSAGE: Final = {"range_and_bearing_message": 2}


def _sensing(*devices: str, **settings: Any) -> dict[str, Any]:
    return {"robot": {"sensors": devices}, **settings}


USUAL: Final = ("infrared", "touch", "rf")
CROWDS: Final[Mapping[str, Settings]] = {
    "infrared, touch, rf": CROWD,
    "and ten pillars": AMONG_PILLARS,
    "and range_and_bearing": {**AMONG_PILLARS, **_sensing(*USUAL, "range_and_bearing")},
    "and two bits of message": {**AMONG_PILLARS, **_sensing(*USUAL, "range_and_bearing", sensors=MESSAGE)},
}


@dataclass(frozen=True)
class Comparison:
    """Scenes beside each other; times are over that of the first."""

    title: str
    scenes: Mapping[str, Settings]
    drives_blindly: bool = False
    """Networks have biases alone."""


COMPARISONS: Final = (
    Comparison(
        "Scenes",
        {
            "the paper's": {},
            "the paper's, from random starts in the south": {"team": SOUTH},
            "nothing to push": {"scene": {"movables": []}},
            "no emitter": {"scene": {"emitters": []}},
            "nine pucks": {"team": SOUTH, "scene": {"movables": [PUCK | {"pose": pose} for pose in PLACES]}},
            "nine small boxes": {"team": SOUTH, "scene": {"movables": [BLOCK | {"pose": pose} for pose in PLACES]}},
            "three obstacles": {"team": SOUTH, "scene": {"obstacles": list(OBSTACLES.values())}},
            "a round arena of 1.2 m": {"arena": {"shape": "circle", "size": 1.2}, "team": SOUTH},
            "a hexagon": {"arena": {"shape": "polygon", "corners": HEXAGON}, "team": SOUTH},
        },
    ),
    Comparison(
        "One object more",
        {
            "the paper's": {},
            "a small box more": {"scene": {"movables": [BOX, BLOCK | {"pose": [0.2, 0.0, 0.2]}]}},
            "a puck more": {"scene": {"movables": [BOX, PUCK | {"pose": [0.2, 0.0, 0.0]}]}},
            **{f"an obstacle more, a {name}": {"scene": {"obstacles": [one]}} for name, one in OBSTACLES.items()},
            "an emitter more": {"scene": {"emitters": [EMITTER, EMITTER | {"position": [0.0, -0.345, 0.03]}]}},
            "an emitter more, on the box": {
                "scene": {"emitters": [EMITTER, EMITTER | {"position": [0.0, 0.0, 0.03], "rides_on": 0}]}
            },
        },
    ),
    Comparison(
        "Each sensor alone",
        {
            "none": _sensing(),
            "infrared": _sensing("infrared"),
            "infrared, 24 rays": _sensing(
                "infrared", sensors={"infrared_yaw_deg": [15.0 * i - 180 for i in range(24)]}
            ),
            "infrared that sees the box too": _sensing("infrared", sensors={"infrared_target": "all"}),
            "touch": _sensing("touch"),
            "rf": _sensing("rf"),
            "rf_bearing": _sensing("rf_bearing"),
            "range_and_bearing": _sensing("range_and_bearing"),
            "range_and_bearing, two bits of message": _sensing("range_and_bearing", sensors=MESSAGE),
            "ground": _sensing("ground"),
            "ground, with a patch": _sensing("ground", scene={"patches": [{}]}),
            "odometry": _sensing("odometry"),
            "movable_motion": _sensing("movable_motion"),
            "light": _sensing("light", scene={"emitters": [EMITTER, EMITTER | {"channel": "light"}]}),
        },
        drives_blindly=True,
    ),
    Comparison("20 robots in an arena of 2 m, driving blindly", CROWDS, drives_blindly=True),
    Comparison("20 robots in an arena of 2 m, random networks", CROWDS),
)

BY_HAND: Final[Mapping[str, Callable[[SceneInfo], Actor]]] = {
    "explore: drive on, turn away from what is ahead": Explorer,
    "gather: drive towards the others": lambda scene: Sectors(scene, "range_and_bearing", alike=True),
}
"""Controllers in the scene of ten pillars and range_and_bearing."""


HEAD: Final = """\
# What objects, arenas and sensors cost

On one core. A time is over that of its table's first row, which ran right before it: the median of the rounds, and the
range. The last column is the CPU time of a control step of 0.1 s for each robot. Networks are random and drive into
everything; those that drive blindly have biases alone, so that robots take the same ways whatever they sense: what
differs is the sensors' cost. With random networks one more sensor makes other robots of them. Where twenty find each
other and jam, the pushing is what costs. The last table has robots that a controller by hand drives.
"""


class Timed:
    """A scene that is ready to be timed."""

    def __init__(self, settings: Settings, drives_blindly: bool) -> None:
        config = Config.model_validate({**settings, "episode": {"horizon": HORIZON}})
        self.scene = Scene(config)
        rng = np.random.default_rng(0)
        # In this order biases and wheels have the same weights whatever is observed and sent.
        biases, wheels = 2 * rng.normal(size=(EPISODES, HIDDEN, 1)), 2 * rng.normal(size=(EPISODES, 2, HIDDEN + 1))
        observed = 2 * rng.normal(size=(EPISODES, HIDDEN, self.scene.info.observations))
        sent = 2 * rng.normal(size=(EPISODES, self.scene.info.commands - 2, HIDDEN + 1))
        if drives_blindly:
            observed[:] = 0
        hidden, outward = np.concatenate([observed, biases], axis=2), np.concatenate([wheels, sent], axis=1)
        self.networks = FeedForward(hidden, outward, np.ones((EPISODES, HIDDEN), dtype=bool))
        self.keys = [EpisodeKey(seed=1, trial=0, generation=0, repeat=i) for i in range(EPISODES)]
        self.drivers = np.repeat(np.arange(EPISODES, dtype=np.uint32)[:, None], config.team.robots, axis=1)
        self.steps = EPISODES * config.team.robots * round(HORIZON / config.episode.control_period)

    def seconds(self) -> float:
        """Return the CPU time of all episodes [s]."""
        start = time.process_time()
        simulate(self.scene, self.networks, self.keys, self.drivers)
        return time.process_time() - start


class ByHand:
    """Robots that a controller by hand drives; its own time does not count."""

    def __init__(self, settings: Settings, make: Callable[[SceneInfo], Actor]) -> None:
        self.config, self.make = Config.model_validate({**settings, "episode": {"horizon": HORIZON}}), make
        self.steps = EPISODES * self.config.team.robots * round(HORIZON / self.config.episode.control_period)

    def seconds(self) -> float:
        """Return the CPU time of all episodes [s]."""
        robots, spent = self.config.team.robots, 0.0
        with Lockstep(self.config, worlds=EPISODES, seed=1, threads=1) as worlds:
            actor = self.make(worlds.info)
            actor.start(np.zeros((EPISODES, robots, 1)))
            for _ in range(self.steps // EPISODES // robots):
                start = time.process_time()
                observations = worlds.observe()
                spent += time.process_time() - start
                commands = actor.act(observations)
                start = time.process_time()
                worlds.advance(commands)
                spent += time.process_time() - start
        return spent


def table(ready: Mapping[str, Timed | ByHand], rounds: int) -> str:
    """Return a table in Markdown."""
    first, *_ = ready.values()
    first.seconds()
    times: dict[str, list[float]] = {name: [] for name in ready}
    bases: dict[str, list[float]] = {name: [] for name in ready}
    for _ in range(rounds):
        for name, timed in ready.items():
            bases[name].append(first.seconds())
            times[name].append(timed.seconds())
    lines = ["| | simulated s per CPU s | time over the first | range | us for a robot's step |", f"|---|{'---:|' * 4}"]
    for name, seconds in times.items():
        ratios = [here / there for here, there in zip(seconds, bases[name], strict=True)]
        median = statistics.median(seconds)
        spread = f"{min(ratios):.2f} to {max(ratios):.2f}"
        each = 1e6 * median / ready[name].steps
        lines.append(
            f"| {name} | {EPISODES * HORIZON / median:,.0f} | {statistics.median(ratios):.2f} | {spread} | {each:.2f} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Print the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5, help="of all scenes, one after the other")
    rounds = parser.parse_args().rounds
    print(f"{HEAD}\nMade by `python -m benchmarks.scenes --rounds {rounds}`: {EPISODES} episodes of {HORIZON:g} s.")
    for comparison in COMPARISONS:
        ready = {name: Timed(settings, comparison.drives_blindly) for name, settings in comparison.scenes.items()}
        print(f"\n## {comparison.title}\n\n{table(ready, rounds)}", flush=True)
    by_hand = {name: ByHand(CROWDS["and range_and_bearing"], make) for name, make in BY_HAND.items()}
    print(f"\n## 20 robots in an arena of 2 m, by hand\n\n{table(by_hand, rounds)}", flush=True)


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: BSD-3-Clause
"""What is timed: whole episodes with sensing, network, noise and the telemetry that F1 needs.

Run as a program it times one case and prints one line of JSON, as the peers' scripts do:

    python -m benchmarks.cases roaming
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from swarmevo.config import Config
from swarmevo.protocols import FeedForward, FloatArray
from swarmevo.simulation import EpisodeKey, Episodes, Scene, library_info, simulate, simulate_lockstep

F1_CHANNELS = ("infrared", "touch", "rf", "command")


def changed(config: Config, **sections: dict[str, Any]) -> Config:
    """Return ``config`` with some keys of some sections replaced."""
    return config.model_copy(
        update={name: getattr(config, name).model_copy(update=keys) for name, keys in sections.items()}
    )


DEEPEST_OVERLAP = 1.0
"""Of bodies, beyond their bumpers' travel, in a simulation that counts [mm]."""


def sound(episodes: Episodes) -> Episodes:
    """Return the episodes if physics held in all of them: a fast simulation of something else would prove nothing."""
    deepest, unsolved = 1000 * episodes.max_penetration.max(), int(episodes.unsolved_steps.sum())
    if episodes.status.any() or unsolved or deepest > DEEPEST_OVERLAP:
        raise RuntimeError(f"expected sound episodes, got {unsolved} unsolved steps and overlaps of {deepest:.2f} mm")
    return episodes


# ---- networks ----


def random_networks(n: int) -> FeedForward:
    """Return what the first generation of an evolution looks like."""
    rng = np.random.default_rng(0)
    return FeedForward(rng.normal(size=(n, 15, 14)), rng.normal(size=(n, 2, 16)), rng.random((n, 15)) < 0.5)


def constant_network(left: float, right: float) -> FeedForward:
    """Return a network whose output units have biases alone."""
    output = np.zeros((1, 2, 16))
    output[0, :, 15] = np.arctanh([left, right])
    return FeedForward(np.zeros((1, 15, 14)), output, np.zeros((1, 15), dtype=bool))


def avoiding_network() -> FeedForward:
    """Return a network that drives on and turns away from what its front sensors see (after Braitenberg)."""
    hidden, output = np.zeros((1, 15, 14)), np.zeros((1, 2, 16))
    for sensor in range(8):
        hidden[0, sensor, sensor] = 4.0
    output[0, :, 15] = 1.5
    output[0, 1, [0, 1, 2]] = -4.0, -4.0, -1.0  # right sensors slow the right wheel... and so it turns
    output[0, 0, [5, 6, 7]] = -1.0, -3.0, -3.0
    return FeedForward(hidden, output, np.arange(15)[None] < 8)


def write_networks(path: Path, networks: FeedForward) -> None:
    """Write one network a line, as the 2-D peers read them: weights and switches row by row, with commas."""
    parts = (networks.input_hidden, networks.hidden_output, networks.hidden_switch)
    rows = np.hstack([np.asarray(part).reshape(len(networks), -1) for part in parts])
    np.savetxt(path, rows, delimiter=",", fmt="%.17g")


# ---- cases ----


def pushing_config(robots: int = 5, seconds: float = 8.0) -> Config:
    """Return a long arena with robots behind the box: they push it all the time, before it turns away."""
    size = 20.0
    south = -size / 2 + 0.6
    poses = tuple((0.0715 * (i - (robots - 1) / 2), south - 0.09 - 0.037, np.pi / 2) for i in range(robots))
    return changed(
        Config(),
        arena={"size": size},
        box={"pose": (0.0, south, 0.0)},
        team={"robots": robots, "start": "poses", "start_poses": poses, "start_jitter": (0.0, 0.0)},
        episode={"horizon": seconds},
    )


def pressed_config() -> Config:
    """Return the paper's arena with the box at its wall and five robots that press on it in vain."""
    poses = tuple((0.0715 * (i - 2), 0.41 - 0.09 - 0.037, np.pi / 2) for i in range(5))
    return changed(
        Config(),
        box={"pose": (0.0, 0.41, 0.0)},
        team={"start": "poses", "start_poses": poses, "start_jitter": (0.0, 0.0)},
    )


def scaled_config(robots: int) -> Config:
    """Return ``robots`` robots in an arena that gives each the room that five have in the paper's."""
    size = float(np.sqrt(robots / 5))
    half = size / 2 - 0.05
    return changed(
        Config(),
        arena={"size": max(size, 0.6)},
        box={"pose": (0.0, max(size, 0.6) / 2 - 0.155, 0.0)},
        team={
            "robots": robots,
            "start": "random",
            "start_region": (-half, half, -half, half - 0.25) if size > 0.7 else (-0.25, 0.25, -0.25, 0.0),
        },
    )


@dataclass(frozen=True)
class Case:
    """Something to time: ``run(threads)`` simulates episodes and returns them."""

    config: Config
    networks: FeedForward
    episodes: int

    def run(self, threads: int = 1) -> Episodes:
        scene, n = Scene(self.config), self.episodes
        drivers = np.repeat(np.arange(n, dtype=np.uint32)[:, None] % len(self.networks), scene.info.robots, axis=1)
        keys = [EpisodeKey(1, 0, 0, i) for i in range(n)]
        return sound(simulate(scene, self.networks, keys, drivers, F1_CHANNELS, threads))

    @property
    def simulated(self) -> float:
        """Simulated seconds of all episodes."""
        return self.episodes * self.config.episode.horizon


class LockstepNetworks:
    """The networks of :func:`random_networks` as NumPy computes them, for worlds in lockstep."""

    def start(self, genomes: FloatArray) -> None:
        """Take one network for each world."""
        networks = random_networks(len(genomes))
        self._hidden = np.ascontiguousarray(networks.input_hidden.transpose(0, 2, 1))
        self._output = np.ascontiguousarray(networks.hidden_output.transpose(0, 2, 1))
        self._on = networks.hidden_switch[:, None].astype(float)

    def act(self, observations: FloatArray) -> FloatArray:
        """Return the commands of all robots of all worlds: two matrix products."""
        hidden = np.tanh(observations @ self._hidden[:, :13] + self._hidden[:, 13:]) * self._on
        commands: FloatArray = np.tanh(hidden @ self._output[:, :15] + self._output[:, 15:])
        return commands


@dataclass(frozen=True)
class LockstepCase:
    """A batch of worlds with a controller written in Python."""

    worlds: int = 256
    seconds: float = 30.0

    def run(self, threads: int = 1) -> Episodes:
        scene = Scene(changed(Config(), episode={"horizon": self.seconds}))
        keys = [EpisodeKey(1, 0, 0, i) for i in range(self.worlds)]
        genomes = np.zeros((self.worlds, scene.info.robots, 1))
        return sound(simulate_lockstep(scene, LockstepNetworks(), genomes, keys, F1_CHANNELS, threads))

    @property
    def simulated(self) -> float:
        """Simulated seconds of all worlds."""
        return self.worlds * self.seconds


def case(name: str) -> Case | LockstepCase:
    """Return a case: one of ``CASES``, ``robots-N``, ``pushers-N``, or ``roaming`` or ``pushing`` ``-articulated``."""
    if name.endswith("-articulated"):
        usual = CASES[name.removesuffix("-articulated")]()
        assert isinstance(usual, Case)
        physics = {"drive": "articulated", "time_step": 0.004}
        return dataclasses.replace(usual, config=changed(usual.config, physics=physics), episodes=2)
    if name.startswith("robots-"):
        return Case(scaled_config(int(name.removeprefix("robots-"))), avoiding_network(), 4)
    if name.startswith("pushers-"):
        return Case(pushing_config(int(name.removeprefix("pushers-"))), constant_network(0.9, 0.9), 40)
    return CASES[name]()


CASES: dict[str, Callable[[], Case | LockstepCase]] = {
    "roaming": lambda: Case(Config(), avoiding_network(), 20),
    "pushing": lambda: Case(pushing_config(), constant_network(0.9, 0.9), 40),
    "pressed": lambda: Case(pressed_config(), constant_network(0.9, 0.9), 4),
    "random": lambda: Case(Config(), random_networks(40), 40),
    "lockstep": LockstepCase,
}


def measure(name: str, threads: int, repeat: int, episodes: int | None = None) -> dict[str, Any]:
    """Time a case and return simulated seconds for each CPU second (median) and for each second of the clock.

    Args:
        name: Of the case.
        threads: To run it on.
        repeat: How often it is run.
        episodes: Instead of its number.
    """
    timed, cpu_rates, rates = case(name), [], []
    if episodes and isinstance(timed, Case):
        timed = dataclasses.replace(timed, episodes=episodes)
    timed.run(threads)  # once to warm up
    for _ in range(repeat):
        cpu, clock = time.process_time(), time.perf_counter()
        timed.run(threads)
        cpu_rates.append(timed.simulated / (time.process_time() - cpu))
        rates.append(timed.simulated / (time.perf_counter() - clock))
    return {
        "peer": "swarmevo",
        "case": name,
        "version": library_info()["build"],
        "realtime_factor_per_cpu_s": round(statistics.median(cpu_rates), 1),
        "range": [round(min(cpu_rates), 1), round(max(cpu_rates), 1)],
        "realtime_factor": round(statistics.median(rates), 1),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("case", help=f"{', '.join(CASES)}, robots-N, pushers-N, or roaming or pushing -articulated")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--episodes", type=int, help="of a run, instead of the case's number")
    arguments = parser.parse_args()
    print(json.dumps(measure(arguments.case, arguments.threads, arguments.repeat, arguments.episodes)))


if __name__ == "__main__":
    main()

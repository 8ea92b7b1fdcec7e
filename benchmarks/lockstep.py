# SPDX-License-Identifier: BSD-3-Clause
"""How fast worlds are stepped from Python: ``observe`` and ``advance`` at each control step, on one core.

    python -m benchmarks.lockstep

The paper's world. Commands are arrays made beforehand, so that no controller is timed: those of robots that roam, as in
the first case of docs/performance.md, and smooth random ones, which drive into everything. Prints that page's section.
"""

from __future__ import annotations

import argparse
import itertools
import statistics
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from benchmarks.cases import avoiding_network
from swarmevo import config
from swarmevo.protocols import FloatArray
from swarmevo.simulation import Lockstep, Scene, simulate

ROOT = Path(__file__).parents[1]
WORLDS = (1, 8, 64)
MEMORY = 0.95
"""Of a smooth command from step to step: a wheel changes its mind within a second or two."""
TEXT = """\
## Stepping from Python

`Lockstep.observe` and `Lockstep.advance` at each control step of the paper's world, one thread, whole episodes.
Commands are arrays made beforehand, so that no controller is timed: "roaming" are those of the first case above,
"random" are smooth random ones, by which robots drive into everything; there nearly all is physics.

"""
HEAD = ["commands", "worlds", "control steps of a world per CPU s", "range", "simulated s per CPU s"]


def roaming_commands(scene: Scene, worlds: int) -> FloatArray:
    """Return ``(steps, worlds, robots, 2)``: what the avoiding network does in the first episodes of a lockstep."""
    with Lockstep(scene, worlds) as world:
        keys = world.keys
    everyone = np.zeros((worlds, scene.info.robots), dtype=np.uint32)
    seen = simulate(scene, avoiding_network(), keys, everyone, ["command"]).telemetry
    return np.ascontiguousarray(np.swapaxes(seen.command, 0, 1))


def random_commands(scene: Scene, worlds: int) -> FloatArray:
    """Return ``(steps, worlds, robots, 2)`` in [-1, 1]: forwards as a rule."""
    shape = (scene.info.control_steps, worlds, scene.info.robots, 2)
    smooth = np.random.default_rng(0).normal(size=shape) * np.sqrt(1 - MEMORY**2)
    for before, now in itertools.pairwise(smooth):
        now += MEMORY * before
    commands: FloatArray = np.clip(0.6 + 0.4 * smooth, -1.0, 1.0)
    return commands


COMMANDS: dict[str, Callable[[Scene, int], FloatArray]] = {"roaming": roaming_commands, "random": random_commands}


def rate(scene: Scene, commands: FloatArray, threads: int = 1, clock: Callable[[], float] = time.process_time) -> float:
    """Return control steps of a world for each second of the clock, over the first episode of each world."""
    steps, worlds = commands.shape[:2]
    with Lockstep(scene, worlds, threads=threads) as world:
        start = clock()
        for each in commands:
            world.observe()
            world.advance(each)
        seconds = clock() - start
    return float(worlds * steps / seconds)


def rows(repeat: int, sizes: Sequence[int] = WORLDS, horizon: float = 180.0) -> list[list[object]]:
    """Return the rows of the table, for numbers of worlds."""
    scene = Scene(config.load("paper", [f"episode.horizon={horizon}"]))
    found: list[list[object]] = []
    for name, make in COMMANDS.items():
        for worlds in sizes:
            commands = make(scene, worlds)
            _, *rates = [rate(scene, commands) for _ in range(repeat + 1)]  # the first warms up
            median = statistics.median(rates)
            span = f"{min(rates):,.0f} to {max(rates):,.0f}"
            found.append([name, worlds, f"{median:,.0f}", span, f"{median * scene.info.control_period:,.0f}"])
    return found


def section(found: list[list[object]]) -> str:
    """Return what docs/performance.md says."""
    rows = [HEAD, ["---"] * len(HEAD), *([str(entry) for entry in row] for row in found)]
    lines = [" | ".join(row) for row in rows]
    return TEXT + "\n".join(f"| {line} |" for line in lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=11, help="runs of each")
    print(section(rows(parser.parse_args().repeat)), end="")


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: BSD-3-Clause
"""How many steps of a world learners get, beside VMAS: environments stepped with random actions.

    python -m benchmarks.learning         on one core; VMAS needs `pip install swarmevo[bench]`
    python -m benchmarks.learning --gpu   on all cores, VMAS on a GPU of CUDA; in seconds on the clock

Prints the tables of docs/learning.md. Both have five robots with differential drive, a box, four walls, eight rays and
the strength of a signal for each robot, and a control period of 0.1 s. Ours is ``paper``: it also has four touch
sensors, noise, and F1 as its reward; its physics takes steps of 50 ms that are cut where bodies meet. VMAS gives no
reward, and takes steps of 0.1 s. Both are told the same kind of actions, smooth ones by which robots drive into
everything, made beforehand.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from benchmarks import lockstep
from benchmarks.pages import table
from benchmarks.speed import answer_of, peer
from swarmevo import config
from swarmevo.env import SwarmParallelEnv, SwarmVectorEnv
from swarmevo.simulation import Scene

PLAN = {1: (1800, 300), 64: (600, 150), 1024: (100, 60)}
"""For numbers of worlds the control steps of each world in a run of ours, and of VMAS."""
GPU_PLAN = {1024: (300, 300), 8192: (60, 150), 65536: (15, 60)}
HEAD = ("environment", "worlds", "steps of a world per CPU s", "range", "over VMAS")


def vector_rate(worlds: int, steps: int, gpu: bool = False) -> float:
    """Return steps of a world for each second of CPU time of the vectorised form; with ``gpu`` on all cores' clock."""
    settings = config.load("paper", [f"episode.horizon={steps / 10}"])
    actions = lockstep.random_commands(Scene(settings), worlds).astype(np.float32)
    clock = time.perf_counter if gpu else time.process_time
    envs = SwarmVectorEnv(settings, worlds, seed=1, threads=0 if gpu else 1)
    envs.reset()
    start = clock()
    for each in actions:
        envs.step(each)
    seconds = clock() - start
    envs.close()
    return float(worlds * steps / seconds)


def lockstep_rate(worlds: int, steps: int) -> float:
    """Return steps of a world for each second on the clock of worlds without rewards, on all cores."""
    scene = Scene(config.load("paper", [f"episode.horizon={steps / 10}"]))
    return lockstep.rate(scene, lockstep.random_commands(scene, worlds), threads=0, clock=time.perf_counter)


def parallel_rate(steps: int) -> float:
    """Return the same of a single world with an agent for each robot."""
    settings = config.load("paper", [f"episode.horizon={steps / 10}"])
    commands = lockstep.random_commands(Scene(settings), 1).astype(np.float32)
    env = SwarmParallelEnv(settings, seed=1)
    actions = [dict(zip(env.possible_agents, each[0], strict=True)) for each in commands]
    env.reset()
    start = time.process_time()
    for each in actions:
        env.step(each)
    seconds = time.process_time() - start
    env.close()
    return float(steps / seconds)


def vmas_rate(worlds: int, steps: int, gpu: bool = False) -> float | str:
    """Return the same of VMAS, or why there is none."""
    chosen = ["--nsim", str(worlds), "--seconds", str(steps / 10), "--device", "cuda" if gpu else "cpu"]
    answer = answer_of(peer("vmas", "--random", *chosen))
    if isinstance(answer, str):
        return answer
    return float(answer["realtime_factor" if gpu else "realtime_factor_per_cpu_s"]) / 0.1


def measured(
    rounds: int, plan: Mapping[int, tuple[int, int]] = PLAN, gpu: bool = False
) -> dict[tuple[str, int], list[float]]:
    """Return the rates of each environment and number of worlds, in alternating runs."""
    runners: dict[tuple[str, int], Callable[[], float | str]] = {}
    for worlds, (ours, theirs) in plan.items():
        if worlds == 1:
            runners["SwarmParallelEnv", 1] = partial(parallel_rate, ours)
        if gpu:
            runners["Lockstep", worlds] = partial(lockstep_rate, worlds, ours)
        runners["SwarmVectorEnv", worlds] = partial(vector_rate, worlds, ours, gpu)
        runners["VMAS", worlds] = partial(vmas_rate, worlds, theirs, gpu)
    rates: dict[tuple[str, int], list[float]] = {which: [] for which in runners}
    for _ in range(rounds):  # alternating: what slows the machine down slows all of them down
        for which, run in runners.items():
            rate = run()
            if isinstance(rate, str):
                print(f"{which[0]}: {rate}", file=sys.stderr)
            else:
                rates[which].append(rate)
    return rates


def rows(rates: dict[tuple[str, int], list[float]]) -> list[list[str]]:
    """Return the rows of the table; ratios are medians of those of neighbouring runs."""
    found = []
    for (name, worlds), ours in rates.items():
        if not ours:
            continue
        span = f"{min(ours):,.0f} to {max(ours):,.0f}"
        pairs = zip(ours, rates["VMAS", worlds], strict=False) if name != "VMAS" else ()
        ratios = [one / other for one, other in pairs]
        ratio = f"{statistics.median(ratios):.1f}" if ratios else ""
        found.append([name, str(worlds), f"{statistics.median(ours):,.0f}", span, ratio])
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=7, help="runs of each")
    parser.add_argument("--gpu", action="store_true", help="all cores beside VMAS on a GPU")
    arguments = parser.parse_args()
    plan, head = (GPU_PLAN, [each.replace("CPU s", "s") for each in HEAD]) if arguments.gpu else (PLAN, HEAD)
    print(table(head, rows(measured(arguments.rounds, plan, arguments.gpu))), end="")


if __name__ == "__main__":
    main()

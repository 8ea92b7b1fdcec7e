# SPDX-License-Identifier: BSD-3-Clause
"""MJX and MuJoCo Warp on a GPU beside ours on all cores, in alternating runs: the tables of docs/performance.md.

    python -m benchmarks.gpu [--rounds 2]   needs `mujoco-mjx`, JAX for the GPU, `mujoco-warp`; most is compilation

Rates are simulated seconds of all worlds for each second on the clock, medians over the rounds. Whether a peer's steps
are short enough is seen in how far the box is pushed: docs/performance.md.
"""

from __future__ import annotations

import argparse
import itertools
import os
import statistics
import sys
from collections.abc import Sequence

from benchmarks.pages import table
from benchmarks.speed import OURS, answer_of, peer

EPISODES = {"random": 4000, "pushing": 16000}
"""Of ours in a run: some seconds on 16 cores."""
CASES = {"random": ("random networks",), "pushing": ("five robots pushing the box", "--push")}
"""Of each the title, and the peers' options."""
PEERS = {"mjx": "MJX", "warp": "MuJoCo Warp"}
WORLDS = [1024, 8192]
SECONDS = 4
"""That each world of a peer is simulated, after it is compiled."""
HEAD = ("case", "simulator", "step [ms]", "worlds", "simulated s per s", "range", "ours is faster by", "box pushed [m]")


def ours(case: str) -> list[str]:
    """Return the command of a case on all cores."""
    cores = len(os.sched_getaffinity(0))
    return [*OURS, case, "--threads", str(cores), "--episodes", str(EPISODES[case]), "--repeat", "1"]


def on_gpu(script: str, config: str, step: float, worlds: int, *options: str) -> list[str]:
    """Return the command of a peer; ``step`` in ms."""
    size = ["--dt", str(step / 1000), "--nsim", str(worlds), "--seconds", str(SECONDS)]
    return peer(script, "--config", config, *size, *options)


def runners(
    cases: Sequence[str], peers: Sequence[str], steps: Sequence[float], numbers: Sequence[int]
) -> dict[tuple[str, str, str, int], list[str]]:
    """Return the command of each case, simulator, step and number of worlds; ours comes first of a case."""
    found = {}
    forms = (("tuned", "3-D"), ("planar", "no wheels or floor"))
    for case in cases:
        title, *options = CASES[case]
        found[title, "swarmevo", "", EPISODES[case]] = ours(case)
        for script, (config, form), step, worlds in itertools.product(peers, forms, steps, numbers):
            which = title, f"{PEERS[script]}, {form}", f"{step:g}", worlds
            found[which] = on_gpu(script, config, step, worlds, *options)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=2, help="runs of each")
    parser.add_argument("--worlds", type=int, nargs="+", default=WORLDS, help="of a peer")
    parser.add_argument("--peers", nargs="+", default=list(PEERS), choices=PEERS)
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=CASES)
    parser.add_argument("--steps", nargs="+", type=float, default=[10.0], help="of a peer [ms]")
    given = parser.parse_args()
    commands = runners(given.cases, given.peers, given.steps, given.worlds)
    rates: dict[tuple[str, str, str, int], list[float]] = {which: [] for which in commands}
    pushed: dict[tuple[str, str, str, int], str] = {}
    for _ in range(given.rounds):  # alternating: what slows the machine down slows all of them down
        for which, command in commands.items():
            answer = answer_of(command)
            print(f"{which}: {answer}", file=sys.stderr, flush=True)
            if not isinstance(answer, str):
                rates[which].append(float(answer["realtime_factor"]))
                if answer.get("note", {}).get("push"):
                    pushed[which] = f"{answer['note']['box_moved']:.3f}"
    rows = []
    for which, each in rates.items():
        if each:
            case, name, step, worlds = which
            best = next(rates[other] for other in rates if other[:2] == (case, "swarmevo"))
            ratios = [one / other for one, other in zip(best, each, strict=False)]
            ratio = "" if name == "swarmevo" else f"{statistics.median(ratios):,.1f}"
            span = f"{min(each):,.0f} to {max(each):,.0f}"
            rate = f"{statistics.median(each):,.0f}"
            rows.append([case, name, step, f"{worlds:,}", rate, span, ratio, pushed.get(which, "")])
    print(table(HEAD, rows), end="")


if __name__ == "__main__":
    main()

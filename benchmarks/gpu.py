# SPDX-License-Identifier: BSD-3-Clause
"""MJX on a GPU beside ours on all cores, in alternating runs: the table of docs/performance.md.

    python -m benchmarks.gpu [--rounds 2]   needs `mujoco-mjx` and JAX for the GPU; ten minutes, most of it compilation

Rates are simulated seconds of all worlds for each second on the clock, medians over the rounds.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
from collections.abc import Sequence

from benchmarks.pages import table
from benchmarks.speed import OURS, answer_of, peer

EPISODES = {"random": 4000, "pushing": 16000}
"""Of ours in a run: some seconds on 16 cores."""
CASES = {"random": ("random networks",), "pushing": ("five robots pushing the box", "--push")}
"""Of each the title, and MJX's options."""
WORLDS = [1024, 8192]
SECONDS = 4
"""That each world of MJX is simulated, after it is compiled."""
HEAD = ("case", "simulator", "worlds", "simulated s per s", "range", "ours is faster by")


def ours(case: str) -> list[str]:
    """Return the command of a case on all cores."""
    cores = len(os.sched_getaffinity(0))
    return [*OURS, case, "--threads", str(cores), "--episodes", str(EPISODES[case]), "--repeat", "1"]


def mjx(config: str, worlds: int, *options: str) -> list[str]:
    """Return the command of MJX."""
    return peer("mjx", "--config", config, "--nsim", str(worlds), "--seconds", str(SECONDS), *options)


def runners(cases: Sequence[str], numbers: Sequence[int]) -> dict[tuple[str, str, int], list[str]]:
    """Return the command of each case, simulator and number of worlds; ours comes first of a case."""
    found = {}
    for case in cases:
        title, *options = CASES[case]
        found[title, "swarmevo", EPISODES[case]] = ours(case)
        for config, name in (("tuned", "MJX, 3-D"), ("planar", "MJX, no wheels or floor")):
            for worlds in numbers:
                found[title, name, worlds] = mjx(config, worlds, *options)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=2, help="runs of each")
    parser.add_argument("--worlds", type=int, nargs="+", default=WORLDS, help="of MJX")
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=CASES)
    given = parser.parse_args()
    commands = runners(given.cases, given.worlds)
    rates: dict[tuple[str, str, int], list[float]] = {which: [] for which in commands}
    for _ in range(given.rounds):  # alternating: what slows the machine down slows all of them down
        for which, command in commands.items():
            answer = answer_of(command)
            print(f"{which}: {answer}", file=sys.stderr, flush=True)
            if not isinstance(answer, str):
                rates[which].append(float(answer["realtime_factor"]))
    rows = []
    for (case, name, worlds), each in rates.items():
        if each:
            best = rates[case, "swarmevo", next(n for c, s, n in rates if (c, s) == (case, "swarmevo"))]
            ratios = [one / other for one, other in zip(best, each, strict=False)]
            ratio = "" if name == "swarmevo" else f"{statistics.median(ratios):,.1f}"
            span = f"{min(each):,.0f} to {max(each):,.0f}"
            rows.append([case, name, f"{worlds:,}", f"{statistics.median(each):,.0f}", span, ratio])
    print(table(HEAD, rows), end="")


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: BSD-3-Clause
"""The best controllers with each number of hidden neurons, as a page of docs/results.

    python -m benchmarks.hidden_neurons RUN ... [--tests 200] > docs/results/hidden-neurons.md

A run was made by ``swarmevo evolve``. For each run and number of hidden neurons on its fronts one controller is tested:
that whose push rate in evolution has the largest lower bound (Wilson's, of 95 %). So evolution chose it, not these
tests. Those that are stored in the run are not run again: the command may be interrupted.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks import made_by
from benchmarks.pages import rate, seconds, table
from swarmevo.analysis import assessment, fronts
from swarmevo.analysis.fronts import FrontPoint
from swarmevo.plugins.team import Team
from swarmevo.runs.store import Store

SIZES: Final = (1, 2, 3, 4, 5)
HEAD: Final = (
    "run",
    "hidden neurons",
    "individual",
    "homing",
    *(f"push with {n}" for n in SIZES),
    "push after",
)


def best(store: Store) -> dict[int, FrontPoint]:
    """Return for each number of hidden neurons on the trials' fronts who pushed most in evolution, least first."""
    points = [point for trial in store.trials() for point in fronts.front(store, trial)]
    counts = Team(store.config).complexity(np.array([store.genome(point.genome) for point in points]))
    found: dict[int, FrontPoint] = {}
    for hidden, point in sorted(zip(counts.astype(int).tolist(), points, strict=True), key=lambda pair: pair[0]):
        if hidden not in found or point.push_interval[0] > found[hidden].push_interval[0]:
            found[hidden] = point
    return found


def row(store: Store, hidden: int, point: FrontPoint, tests: int) -> list[str]:
    (one,) = assessment.assess(store, SIZES, tests, genome=point.genome).controllers
    homing = np.mean([of.homing_rate for of in one.outcomes])
    times = [of.push_time for of in one.outcomes if of.robots >= 3 and of.push_time is not None]
    return [
        store.folder.name,
        str(hidden),
        str(point.genome),
        f"{100 * homing:.1f} %",
        *(rate(of.push_rate, of.tests) for of in one.outcomes),
        seconds(float(np.mean(times)) if times else None),
    ]


def length(store: Store) -> list[str]:
    """Return a run's name, how many of its trials were made, and the episodes of each."""
    trials = len(store.trials())
    episodes = fronts.summarise(store).cost.episodes // trials
    return [store.folder.name, f"{trials} of {store.config.evolution.trials}", str(episodes)]


def page(runs: Sequence[Path], tests: int) -> str:
    commands, lengths, rows = [], [], []
    for run in runs:
        with Store.open(run) as store:
            commands.append(made_by.evolution(store.config, store.folder)[1])
            lengths.append(length(store))
            rows += [row(store, hidden, point, tests) for hidden, point in best(store).items()]
    commands.append(made_by.this_command("benchmarks.hidden_neurons", *runs))
    return "\n".join(
        [
            "# The best with each number of hidden neurons\n",
            "Made by these commands:\n",
            "```console\n" + "\n".join(commands) + "\n```\n",
            table(["run", "trials", "episodes of a trial"], lengths),
            f"{tests} tests of each with each team, or as many more as the run has, 180 s, fresh seeds. Of each run "
            "and number of hidden neurons the one that pushed most in evolution: its rate there has the largest lower "
            "bound.\n",
            table(HEAD, rows),
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=Path, nargs="+")
    parser.add_argument("--tests", type=int, default=200, help="of each controller with each team")
    arguments = parser.parse_args()
    print(page(arguments.runs, arguments.tests), end="")


if __name__ == "__main__":
    main()

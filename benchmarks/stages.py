# SPDX-License-Identifier: BSD-3-Clause
"""When a search by CMA-ES decides how well it will push, as a page of docs/results.

    python -m benchmarks.stages RUN ... [--generations 50,75,100,152] [--tests 300] > docs/results/stages.md

A run was made by ``swarmevo evolve best``, with one start a trial. A search's distribution at a stage is told by the
mean of the genomes that it asked for in the generations before.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from scipy.stats import spearmanr

from benchmarks import made_by
from benchmarks.choices import JUDGING, push_rates
from benchmarks.pages import table
from swarmevo.protocols import FloatArray
from swarmevo.runs.store import Store

LAST: Final = 5
"""Generations that make a mean."""


def means(store: Store, trial: int, generations: Sequence[int]) -> FloatArray:
    """Return ``(generations, genes)``: the mean genome of the generations before each of these."""
    asked = [
        [store.genome(i) for n in range(end - LAST, end) for i in store.genome_ids(trial, n).tolist()]
        for end in generations
    ]
    return np.array([np.mean(genomes, axis=0) for genomes in asked])


def page(runs: Sequence[Path], generations: Sequence[int], tests: int) -> str:
    commands, names, genomes = [], [], []
    for run in runs:
        with Store.open(run) as store:
            commands.append(made_by.evolution(store.config, run)[1])
            for trial in store.trials():
                if store.generations(trial) >= generations[-1]:
                    names.append(f"{run.name}, {trial}")
                    genomes.append(means(store, trial, generations))
    rates = push_rates(np.concatenate(genomes), tests, JUDGING).mean(axis=1).reshape(len(names), len(generations))
    rows = [[name, *(f"{100 * rate:.1f} %" for rate in row)] for name, row in zip(names, rates, strict=True)]
    agree = [f"{spearmanr(rates[:, i], rates[:, -1]).statistic:.2f}" for i in range(len(generations) - 1)]
    return "\n".join(
        [
            "# When a search decides\n",
            "Made by these commands:\n",
            "\n".join(["```console", *commands, made_by.this_command("benchmarks.stages", *runs), "```\n"]),
            f"In how many of {tests} tests each with three, four and five robots, in the mean over them, the box "
            f"is pushed by the mean of what a search asked for in the last {LAST} of so many generations:\n",
            table(["run, trial", *map(str, generations)], rows),
            f"Rank correlation (Spearman's) with the last column: {', '.join(agree)}.\n",
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=Path, nargs="+")
    parser.add_argument(
        "--generations", default="50,75,100,125,152", help="the stages, of which the last is the search's end"
    )
    parser.add_argument("--tests", type=int, default=300, help="of each mean with each team")
    arguments = parser.parse_args()
    generations = [int(word) for word in arguments.generations.split(",")]
    print(page(arguments.runs, generations, arguments.tests), end="")


if __name__ == "__main__":
    main()

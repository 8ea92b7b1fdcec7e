# SPDX-License-Identifier: BSD-3-Clause
"""How good the best of several trials is, as a page of docs/results.

    python -m benchmarks.choices docs/results/best-1.csv ... [--trials 12] [--tests 1000] > docs/results/choices.md

A file has a row for each trial: the genome that it ended with. All are tested with one seed, as ``swarmevo test RUN``
does, and of every choice of so many trials the most successful in these tests is tested once more, with another seed:
who was chosen by tests is a little worse than they say.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from math import comb
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks import made_by
from benchmarks.pages import table
from swarmevo.analysis import assessment
from swarmevo.plugins.team import load_config
from swarmevo.protocols import FloatArray

SIZES: Final = (3, 4, 5)
CHOOSING, JUDGING = 1, 2
"""Seeds of the tests."""
GOAL: Final = 0.99
"""That each team is to push in."""
WORLD: Final = ("controller={feedforward: {hidden: 1}}", "episode.until=push")


def read(files: Sequence[Path]) -> tuple[list[str], FloatArray]:
    """Return a name for each row of the files, and the rows: ``(trials, genes)``."""
    rows = [np.loadtxt(file, delimiter=",", ndmin=2) for file in files]
    names = [f"{file.stem}, {i}" for file, of_file in zip(files, rows, strict=True) for i in range(len(of_file))]
    return names, np.concatenate(rows)


def push_rates(genomes: FloatArray, tests: int, seed: int) -> FloatArray:
    """Return ``(trials, sizes)``: how often each controller pushes with each team, in the paper's world."""
    settings = load_config("paper", [*WORLD, f"evolution.seed={seed}"])
    found = assessment.assess_genomes(settings, genomes, SIZES, tests)
    return np.array([[one.push_rate for one in controller.outcomes] for controller in found.controllers])


def chances(choosing: FloatArray, trials: int) -> FloatArray:
    """Return of each trial the share of all choices of so many in which it is the one that pushed most.

    That is in the mean over the teams; of equals the first. It is chosen with such as pushed less: of ``n`` trials the
    one that ``i`` others beat is the best of ``comb(n - 1 - i, trials - 1)`` of the ``comb(n, trials)`` choices.
    """
    order = np.argsort(-choosing.mean(axis=1), kind="stable")
    shares = np.empty(len(order))
    shares[order] = [comb(len(order) - 1 - i, trials - 1) / comb(len(order), trials) for i in range(len(order))]
    return shares


def page(files: Sequence[Path], trials: int, tests: int) -> str:
    names, genomes = read(files)
    if trials > len(genomes):
        sys.exit(f"--trials {trials}: expected at most as many as the files have rows, {len(genomes)}")
    choosing, judging = (push_rates(genomes, tests, seed) for seed in (CHOOSING, JUDGING))
    reach = judging.min(axis=1) >= GOAL
    rows = [
        [name, *(f"{100 * rate:.1f} %" for rate in (*first, *second)), "yes" if good else "no"]
        for name, first, second, good in zip(names, choosing, judging, reach, strict=True)
    ]
    head = ["file, row", *(f"{n} robots" for n in SIZES), *(f"{n} robots" for n in SIZES), f"all {100 * GOAL:g} %"]
    counts = []
    for of in sorted({max(trials >> halved, 1) for halved in range(4)}):
        share = chances(choosing, of) @ reach
        counts.append([str(of), str(comb(len(genomes), of)), f"{100 * share:.1f} %"])
    return "\n".join(
        [
            f"# The best of {trials} trials of best.yaml\n",
            "Made by this command:\n",
            f"```console\n{made_by.this_command('benchmarks.choices')}\n```\n",
            f"Each trial's controller in {tests} tests with each team until the push, of seed {CHOOSING}, by which is "
            f"chosen, and then of seed {JUDGING}, by which it is judged: whether each team pushes in {100 * GOAL:g} % "
            "or more.\n",
            table(head, rows),
            "Of every choice of so many of these trials the one that pushes most, in the mean over the teams, in the "
            f"first tests; in that share of the choices it reaches {100 * GOAL:g} % with each team in the second:\n",
            table(["trials", "choices", "reach it"], counts),
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("--trials", type=int, default=12, help="of one choice")
    parser.add_argument("--tests", type=int, default=1000, help="of each controller with each team")
    arguments = parser.parse_args()
    print(page(arguments.files, arguments.trials, arguments.tests), end="")


if __name__ == "__main__":
    main()

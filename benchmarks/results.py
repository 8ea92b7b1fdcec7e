# SPDX-License-Identifier: BSD-3-Clause
"""What a run's controllers do in fresh tests, as a page of docs/results.

    python -m benchmarks.results RUN [--repeats 200] [--robust 200] [--paper] > docs/results/NAME.md

``RUN`` was made by ``swarmevo evolve``. Tests that are stored in it are not run again, so the command may be
interrupted. Every rate has Wilson's 95 % interval. A trial's best is the first of its front: evolution chose it, not
these tests. With ``--paper`` the page has the paper's figures (written to docs/results), the clearest example of each
behaviour of its section VII, and what it says is held against what was found.
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks import made_by, results_paper
from benchmarks.pages import rate, seconds, table
from swarmevo.analysis import assessment, fronts
from swarmevo.analysis.table_ii import PAPER, Assessment, Outcome, Tested
from swarmevo.plugins.team import Team
from swarmevo.runs.store import Store

SIZES: Final = (1, 2, 3, 4, 5)
NUMBERS: Final = dict(enumerate(["No", "One", "Two", "Three", "Four", "Five", "Six", "Seven", "Eight", "Nine", "Ten"]))
DISTURBANCES: Final = {
    "as evolved": (),
    "doubled noise": ("noise.infrared=0.1", "noise.infrared_at_contact=0.01", "noise.wheels=0.1"),
    "noise of the signal, 20 %": ("noise.rf=0.2",),
    "starts anywhere in the southern half": ("team.start=random", "team.start_region=[-0.45, 0.45, -0.45, 0.0]"),
    "box 15 % lighter": ("box.mass=0.204",),
    "box 15 % heavier": ("box.mass=0.276",),
    "rigid bumpers": ("robot.bumper=rigid",),
    "articulated drive": ("physics.drive=articulated", "physics.time_step=0.004", "episode.until=push"),
}
"""Worlds that the best controller is tested in, as ``--set`` takes them."""
SLOW_TESTS: Final = 20
"""On the articulated drive, at most: an episode takes half a minute of a core, hence it also ends with the push."""


def pooled(outcomes: Sequence[Outcome]) -> tuple[float, float, int]:
    """Return homing rate, push rate and tests of outcomes with as many robots each."""
    tests = sum(one.tests for one in outcomes)
    homing = sum(one.homing_rate * one.tests for one in outcomes) / tests
    return homing, sum(one.push_rate * one.tests for one in outcomes) / tests, tests


def table_ii(rows: Sequence[Outcome]) -> str:
    paper = {row.robots: row for row in PAPER}
    return table(
        ["robots", "tests", "homing", "paper", "after", "pushing", "paper", "after"],
        [
            [
                str(row.robots),
                str(row.tests),
                rate(row.homing_rate, row.tests),
                f"{100 * paper[row.robots].homing_rate:.0f} %",
                seconds(row.homing_time),
                rate(row.push_rate, row.tests),
                f"{100 * paper[row.robots].push_rate:.0f} %",
                seconds(row.push_time),
            ]
            for row in rows
        ],
    )


def hidden_neurons(store: Store, controllers: Sequence[Tested]) -> dict[int, int]:
    """Return for each genome how many hidden neurons it uses."""
    genomes = [one.genome for one in controllers]
    counts = Team(store.config).complexity(np.array([store.genome(genome) for genome in genomes]))
    return dict(zip(genomes, counts.astype(int).tolist(), strict=True))


def by_hidden_neurons(found: Assessment, hidden: dict[int, int]) -> str:
    groups: dict[int, list[Tested]] = defaultdict(list)
    for one in found.controllers:
        groups[hidden[one.genome]].append(one)
    rows = []
    for neurons, members in sorted(groups.items()):
        outcomes = [[one for member in members for one in member.outcomes if one.robots == size] for size in SIZES]
        rates = [pooled(of_size) for of_size in outcomes if of_size]
        homing = np.average([homing for homing, _, _ in rates])
        rows.append(
            [str(neurons), str(len(members)), f"{100 * homing:.0f} %", *(rate(push, n) for _, push, n in rates)]
        )
    return table(["hidden neurons", "controllers", "homing", *(f"push with {size}" for size in SIZES)], rows)


def best_of_trials(store: Store, found: Assessment, hidden: dict[int, int]) -> str:
    tested = {(one.trial, one.genome): one for one in found.controllers}
    rows = []
    for trial in store.trials():
        first = fronts.front(store, trial)[0]
        one = tested[trial, first.genome]
        push = [f"{100 * of.push_rate:.1f} %" for of in one.outcomes]
        times = [of.push_time for of in one.outcomes if of.robots >= 3 and of.push_time is not None]
        homing = np.mean([of.homing_rate for of in one.outcomes])
        mean = seconds(float(np.mean(times)) if times else None)
        rows.append([str(trial), str(first.genome), str(hidden[first.genome]), f"{100 * homing:.1f} %", *push, mean])
    return table(
        ["trial", "individual", "hidden neurons", "homing", *(f"push with {n}" for n in SIZES), "push after"], rows
    )


def learning(store: Store) -> str:
    """Return for each trial the push rate of all episodes in each tenth of its planned generations."""
    planned = store.config.evolution.generations
    ends = sorted({planned * tenth // 10 for tenth in range(1, 11)} - {0})
    rows = []
    for trial in store.trials():
        pushed = [
            np.isfinite(store.generation(trial, number).episodes["push_time"])
            for number in range(store.generations(trial))
        ]
        parts = [pushed[start:end] for start, end in pairwise([0, *ends])]
        rows.append([str(trial), *(f"{100 * np.concatenate(part).mean():.0f} %" if part else "" for part in parts)])
    return table(["trial", *(f"to {end}" for end in ends)], rows)


def robust(store: Store, genome: int, repeats: int) -> str:
    rows = []
    for name, overrides in DISTURBANCES.items():
        print(f"{store.folder}: {name}", file=sys.stderr)
        tests = min(repeats, SLOW_TESTS) if "physics.drive=articulated" in overrides else repeats
        found = assessment.assess(store, (3, 4, 5), tests, genome=genome, overrides=overrides)
        (one,) = found.controllers
        homing = np.mean([of.homing_rate for of in one.outcomes])
        rows.append(
            [
                name,
                str(one.outcomes[0].tests),
                f"{100 * homing:.1f} %",
                *(rate(of.push_rate, of.tests) for of in one.outcomes),
            ]
        )
    return table(["world", "tests", "homing", "push with 3", "push with 4", "push with 5"], rows)


def behaviours(found: Assessment) -> str:
    shares = [[name, f"{100 * share:.1f} %"] for name, share in found.behaviours.items()]
    return table(["behaviour", "share of the robots"], shares)


def page(store: Store, repeats: int, robust_repeats: int, with_paper: bool) -> str:
    summary = fronts.summarise(store)
    trials = len(summary.trials)
    config, command = made_by.evolution(store.config, store.folder)
    found = assessment.assess(store, SIZES, repeats)
    hidden = hidden_neurons(store, found.controllers)
    cost = summary.cost
    volumes = ", ".join(f"{trial.history[-1].hypervolume:.4g}" for trial in summary.trials)
    best = assessment.most_successful(store)
    parts = [
        f"# {NUMBERS.get(trials, trials)} trial{'s' * (trials != 1)} of {config}.yaml\n",
        "Made by these two commands:\n",
        f"```console\n{command}\n{made_by.this_command('benchmarks.results', store.folder)}\n```\n",
        f"Seed {summary.seed}, {trials} of {summary.trials_planned} trials, {cost.generations} "
        f"generations, {cost.episodes} episodes, {cost.seconds / 60:.0f} minutes of evaluation. "
        f"Tests: {repeats} of each controller with each team, {found.horizon:g} s, fresh seeds.\n",
        "## All controllers of all trials' fronts\n",
        table_ii(found.rows),
        "## By hidden neurons\n",
        by_hidden_neurons(found, hidden),
        "## The best of each trial\n",
        "The first of its front, chosen by evolution.\n",
        best_of_trials(store, found, hidden),
        f"The most successful, in the mean over the teams: individual {best.genome}.\n",
        f"Hypervolume at the end of each trial: {volumes}.\n",
        "## Episodes in which the box came to the wall, by generation\n",
        "Of all that were tried in these generations, in the worlds of the evolution.\n",
        learning(store),
    ]
    if with_paper:
        parts += [*results_paper.figures(store), *results_paper.goals(store, found, hidden)]
    if found.behaviours:
        parts.append("## Behaviours of the paper's section VII\n")
        parts += results_paper.behaviours(store, found) if with_paper else [behaviours(found)]
    if robust_repeats:
        parts += [
            f"## Individual {best.genome} in other worlds\n",
            f"The most successful one, {robust_repeats} tests with each team.\n",
            robust(store, best.genome, robust_repeats),
        ]
    return "\n".join(parts)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("--repeats", type=int, default=5, help="tests of each controller with each team")
    parser.add_argument("--robust", type=int, default=0, help="tests of the best one in each other world and team")
    parser.add_argument("--paper", action="store_true", help="hold a run of paper.yaml against the paper")
    parser.add_argument("--genomes", type=Path, help="write the best of each trial here, as CSV")
    arguments = parser.parse_args()
    with Store.open(arguments.run) as store:
        if arguments.genomes:
            firsts = [store.genome(fronts.front(store, trial)[0].genome) for trial in store.trials()]
            np.savetxt(arguments.genomes, firsts, delimiter=",", fmt="%.17g")
        print(page(store, arguments.repeats, arguments.robust, arguments.paper), end="")


if __name__ == "__main__":
    main()

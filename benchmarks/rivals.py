# SPDX-License-Identifier: BSD-3-Clause
"""The paper's optimiser against all that come with swarmevo, on three tasks, with equal budgets in episodes.

    python -m benchmarks.rivals --out runs/rivals > docs/results/rivals.md

Each task is a sweep below ``--out``: all optimisers with the same seeds, one trial each. Then the fronts are tested
again on fresh seeds and compared. What is stored is not run again: the same command goes on after any end.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any, Final

import swarmevo as se
from benchmarks.pages import table
from swarmevo.analysis import comparison
from swarmevo.analysis.comparison import Comparison, Measure, Pair
from swarmevo.runs.store import Store
from swarmevo.sweeps import folder as folders

PAPER: Final = "pde"
SINGLE: Final = ("cma",)
"""They optimise the sum of the objectives' costs; here that of the first."""
FRONTS: Final = ("nsga2", "nsga3", "gde3", "sms_emoa", "moead")
MAPS: Final = ("map_elites", "cma_mae")
SURE: Final = 0.05


@dataclass(frozen=True)
class Task:
    """What is evolved."""

    config: str
    meaning: str
    fitness: tuple[str, ...]
    optimisers: tuple[str, ...]


TASKS: Final = (
    Task(
        "paper",
        "the paper's: five robots, homing and pushing (F1) against hidden neurons (F2)",
        ("box_pushing", "hidden_neurons", "box_end"),
        (PAPER, *SINGLE, "como_cma", *FRONTS, *MAPS, "random"),
    ),
    Task(
        "phototaxis",
        "three robots come to a light: nearness against hidden neurons",
        ("nearness", "hidden_neurons"),
        (PAPER, *SINGLE, "como_cma", *FRONTS, "random"),
    ),
    Task(
        "aggregation",
        "eight robots gather: aggregation against hidden neurons",
        ("aggregation", "hidden_neurons"),
        (PAPER, *SINGLE, "como_cma", *FRONTS, "random"),
    ),
)


def optimisers_of(task: Task) -> list[Any]:
    """Return what the key ``optimiser`` is given: each by its name, PDE with rates of its own as well."""
    named: list[Any] = [{"cma": {"weights": [1.0, 0.0]}} if name == "cma" else {name: {}} for name in task.optimisers]
    return [*named, {"pde": {"rates": "self"}}]


def evolve(task: Task, out: Path, seeds: int, episodes: int, population: int, repeats: int) -> None:
    """Run a task's sweep, as far as it is not stored."""
    settings = {
        "fitness": list(task.fitness),
        "evolution.trials": 1,
        "evolution.episodes": episodes,
        "evolution.generations": 1_000_000,
        "evolution.population": population,
        "evolution.repeats": repeats,
    }
    print(f"{out}: evolution", file=sys.stderr, flush=True)
    found = se.sweep(task.config, {"optimiser": optimisers_of(task)}, seeds=range(1, seeds + 1), out=out, set=settings)
    for row in found.rows:
        for failure in row.failed:
            print(f"{out}: {failure}", file=sys.stderr, flush=True)


def compared(out: Path, repeats: int) -> Comparison:
    """Test the fronts of a sweep again and compare its settings."""
    print(f"{out}: tests", file=sys.stderr, flush=True)
    with contextlib.ExitStack() as opened:
        groups: dict[str, list[Store]] = defaultdict(list)
        for run in (run for group in folders.groups([out]) for run in folders.runs_of(group)):
            store = opened.enter_context(Store.open(run))
            groups[name_of(store)].append(store)
        return comparison.compare(groups, repeats)


def name_of(store: Store) -> str:
    """Return an optimiser's name, and that its rates are its own."""
    ((name, options),) = store.config.optimiser.items()
    return f"{name}, own rates" if options.get("rates") == "self" else name


# ---- the page --------------------------------------------------------------------------------------------------------


def page(task: Task, found: Comparison) -> Iterator[str]:
    yield f"\n## {task.config}: {task.meaning}\n\n"
    volume = next(measure for measure in found.measures if measure.name == "hypervolume")
    first = next(measure for measure in found.measures if measure.name == found.objectives[0].name)
    order = sorted(volume.values, key=lambda name: -median(volume.values[name]))
    yield table(
        [
            "optimiser",
            "trials",
            "hypervolume",
            "better than PDE's",
            "p",
            f"best {first.name}",
            "better than PDE's",
            "p",
        ],
        [
            [
                name,
                str(len(volume.values[name])),
                middle(volume.values[name]),
                *effect(volume, name),
                middle(first.values[name]),
                *effect(first, name),
            ]
            for name in order
        ],
    )
    yield "".join(f"\n{note}\n" for note in found.notes)
    yield f"\n{verdict(volume)}\n"


def middle(values: Sequence[float]) -> str:
    low, high = min(values), max(values)
    return f"{median(values):.3g} ({low:.3g} to {high:.3g})"


def against_paper(measure: Measure, name: str) -> tuple[Pair, bool] | None:
    """Return the pair of an optimiser and PDE, and whether PDE is its first."""
    for pair in measure.pairs:
        if {pair.a, pair.b} == {name, PAPER}:
            return pair, pair.a == PAPER
    return None


def effect(measure: Measure, name: str) -> tuple[str, str]:
    """Return how often a trial of an optimiser is better than one of PDE, with its interval, and the p-value."""
    found = against_paper(measure, name)
    if found is None:
        return "", ""
    pair, is_first = found
    a12, low, high = (1 - pair.a12, 1 - pair.high, 1 - pair.low) if is_first else (pair.a12, pair.low, pair.high)
    if not measure.more_is_better:
        a12, low, high = 1 - a12, 1 - high, 1 - low
    return f"{100 * a12:.0f} % ({100 * low:.0f} to {100 * high:.0f})", f"{pair.p:.2g}"


def verdict(measure: Measure) -> str:
    """Return who is surely better and worse than PDE by the hypervolume."""
    better: list[str] = []
    worse: list[str] = []
    for name in measure.values:
        found = against_paper(measure, name)
        if found and found[0].p < SURE:
            (worse if (found[0].a12 > 0.5) == found[1] else better).append(name)
    told = [f"{', '.join(names)} {what}" for names, what in ((better, "better than PDE"), (worse, "worse")) if names]
    return (
        f"By the hypervolume surely: {'; '.join(told)}."
        if told
        else "By the hypervolume nobody surely differs from PDE."
    )


def head(options: argparse.Namespace) -> str:
    given = ("seeds", "episodes", "population", "repeats", "tests")
    command = " ".join(["python -m benchmarks.rivals", *(f"--{name} {getattr(options, name)}" for name in given)])
    return f"""\
# The paper's optimiser and its rivals

Made by this command, which evolves, tests and compares:

```console
{command} --tasks {" ".join(options.tasks)} --out runs/rivals > docs/results/rivals.md
```

Each optimiser had {options.episodes} episodes a trial, {options.seeds} trials with the same seeds, a population of
{options.population}, {options.repeats} repeats, and otherwise its defaults. `pde` has the rates of the task's
configuration; *own rates* is the self-adaptive one. `cma` and the map searches make the first objective better alone;
their fronts are what came by the way. All numbers are of {options.tests} tests of each controller of the fronts, on
fresh seeds. Hypervolumes are shares of what there could be; medians, least and largest over the trials. *Better than
PDE's* is how often a trial is better than one of `pde`: Vargha and Delaney's A12 with a bootstrap's 95 % interval. p is
by Mann and Whitney, adjusted by Holm for all pairs ([Comparing runs](../comparing.md)).
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("runs/rivals"))
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--episodes", type=int, default=9000)
    parser.add_argument("--population", type=int, default=30)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--tests", type=int, default=10)
    parser.add_argument("--tasks", nargs="+", choices=[task.config for task in TASKS], default=["paper"])
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    chosen = [task for task in TASKS if task.config in options.tasks]
    for task in chosen:
        evolve(task, options.out / task.config, options.seeds, options.episodes, options.population, options.repeats)
    print(head(options), end="")
    for task in chosen:
        print("".join(page(task, compared(options.out / task.config, options.tests))), end="", flush=True)


if __name__ == "__main__":
    main()

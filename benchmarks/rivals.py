# SPDX-License-Identifier: BSD-3-Clause
"""The paper's optimiser against others that come with swarmevo, on tasks that ship, with equal budgets in episodes.

    python -m benchmarks.rivals --seeds 1-20 --tasks phototaxis localisation > docs/results/rivals.md

Seed by seed, each task is evolved by all optimisers, one trial each, and the fronts are tested again on fresh seeds: a
sweep below ``--out``, which goes on after any end. What came out is kept in ``--kept``, a row a trial; seeds that
are there are not evolved again, so the trials may come from several sittings. ``--stored`` prints what is there. With
another file as ``--kept`` the rows of runs that are complete below ``--out`` are computed anew, of the same tests.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import dataclasses
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any, Final

import swarmevo as se
from benchmarks.pages import table
from swarmevo.analysis import comparison
from swarmevo.analysis.comparison import Measure, Pair
from swarmevo.runs.store import Store
from swarmevo.sweeps import folder as folders
from swarmevo.sweeps.grid import parse_seeds

KEPT: Final = Path("docs/results/rivals.csv")
PAPER: Final = "pde"
FRONTS: Final = ("nsga2", "nsga3", "gde3", "sms_emoa", "spea2", "moead")
MAPS: Final = ("map_elites", "cma_mae")
SURE: Final = 0.05


@dataclass(frozen=True)
class Task:
    """What is evolved."""

    config: str
    meaning: str
    fitness: tuple[str, ...]
    describing: tuple[str, ...]
    """The fitness that map searches need beside these, which has no objective; none: it is one of these."""


TASKS: Final = (
    Task(
        "paper",
        "the paper's: five robots, homing and pushing (F1) against hidden neurons (F2)",
        ("box_pushing", "hidden_neurons", "box_end"),
        (),
    ),
    Task(
        "phototaxis",
        "three robots come to a light: nearness against hidden neurons",
        ("nearness", "hidden_neurons"),
        ("team_end",),
    ),
    Task(
        "localisation",
        "one robot finds an emitter: F1 without its box against hidden neurons",
        ("box_pushing", "hidden_neurons"),
        ("team_end",),
    ),
    Task(
        "aggregation",
        "eight robots gather: aggregation against hidden neurons",
        ("aggregation", "hidden_neurons"),
        ("team_end",),
    ),
)

OTHERS: Final[tuple[Any, ...]] = (
    {PAPER: {}},
    {"cma": {"weights": [1.0, 0.0]}},
    {"como_cma": {}},
    *({name: {}} for name in FRONTS),
    {"random": {}},
    {PAPER: {"rates": "self"}},
)
"""What the key ``optimiser`` is given, but for the map searches."""


@dataclass(frozen=True)
class Sweep:
    """Optimisers that have the same fitness."""

    ending: str
    """Of its folder's name."""
    optimisers: tuple[Any, ...]
    fitness: tuple[str, ...]


def sweeps(task: Task) -> list[Sweep]:
    """Return those of a task: of all optimisers, or of the map searches apart from the others."""
    maps: tuple[Any, ...] = tuple({name: {}} for name in MAPS)
    if not task.describing:
        return [Sweep("", OTHERS + maps, task.fitness)]
    return [Sweep("", OTHERS, task.fitness), Sweep("-maps", maps, task.fitness + task.describing)]


@dataclass(frozen=True)
class Budget:
    """What each trial has; the options of the same names."""

    episodes: int
    population: int
    repeats: int
    tests: int


@dataclass(frozen=True, order=True)
class Trial:
    """What came of one: a row of the file."""

    task: str
    optimiser: str
    seed: int
    hypervolume: float
    """Of its front on fresh seeds by which nobody was chosen, as a share of what there could be."""
    first: float
    """Mean of the first objective of the best of its front, likewise."""


def evolved(task: Task, folder: Path, seed: int, budget: Budget) -> Iterator[Trial]:
    """Make the trials of a task with one seed, as far as they are not stored beside a folder, and test them."""
    for sweep in sweeps(task):
        yield from swept(task, sweep, folder.with_name(folder.name + sweep.ending), seed, budget)


def swept(task: Task, sweep: Sweep, folder: Path, seed: int, budget: Budget) -> list[Trial]:
    settings = {
        "fitness": list(sweep.fitness),
        "evolution.trials": 1,
        "evolution.episodes": budget.episodes,
        "evolution.generations": 1_000_000,
        "evolution.population": budget.population,
        "evolution.repeats": budget.repeats,
    }
    print(f"{folder}: evolution", file=sys.stderr, flush=True)
    found = se.sweep(task.config, {"optimiser": list(sweep.optimisers)}, seeds=[seed], out=folder, set=settings)
    if failed := [f"{row.name}: {why}" for row in found.rows for why in row.failed.values()]:
        sys.exit(f"{folder}: {failed[0]}")
    print(f"{folder}: tests", file=sys.stderr, flush=True)
    with contextlib.ExitStack() as opened:
        stores = [
            opened.enter_context(Store.open(run))
            for group in folders.groups([folder])
            for run in folders.runs_of(group)
        ]
        compared = comparison.compare({name_of(store.config.optimiser): [store] for store in stores}, budget.tests)
    assert compared.objectives[0].is_maximised, compared.objectives[0]
    return [
        Trial(task.config, group.name, seed, one.tested, one.first) for group in compared.groups for one in group.trials
    ]


def name_of(optimiser: Mapping[str, Mapping[str, Any]]) -> str:
    """Return an optimiser's name, and that its rates are its own."""
    ((name, options),) = optimiser.items()
    return f"{name}, own rates" if options.get("rates") == "self" else name


def is_kept(task: Task, seed: int, trials: Sequence[Trial]) -> bool:
    """Whether the trials have one of each optimiser."""
    wanted = {name_of(one) for sweep in sweeps(task) for one in sweep.optimisers}
    return wanted <= {one.optimiser for one in trials if (one.task, one.seed) == (task.config, seed)}


# ---- what is kept ----------------------------------------------------------------------------------------------------

MEASURED: Final = "cross-fitted"
"""By what a row's numbers were made: those of before are of the same tests that chose."""
COLUMNS: Final = [*(field.name for one in (Trial, Budget) for field in dataclasses.fields(one)), "measured"]


def read(path: Path, budget: Budget) -> list[Trial]:
    """Return the trials in a file, none if there is no such file.

    Raises:
        SystemExit: One of them had another budget, or was measured otherwise.
    """
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    for row in rows:
        if row.get("measured") != MEASURED:
            sys.exit(f"{path}: expected numbers that are {MEASURED}, got others; move it away, to compute all anew")
        if (found := Budget(*(int(row[field.name]) for field in dataclasses.fields(Budget)))) != budget:
            sys.exit(f"{path}: expected trials with {budget}, got {found}; keep them in another file with --kept")
    return [
        Trial(row["task"], row["optimiser"], int(row["seed"]), float(row["hypervolume"]), float(row["first"]))
        for row in rows
    ]


def write(path: Path, trials: Sequence[Trial], budget: Budget) -> None:
    """Write trials to a file, all or none, in the order of tasks, optimisers and seeds."""
    new = path.with_suffix(".new")
    with new.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        writer.writeheader()
        more = {**dataclasses.asdict(budget), "measured": MEASURED}
        writer.writerows(dataclasses.asdict(one) | more for one in sorted(trials))
    new.replace(path)


# ---- the page --------------------------------------------------------------------------------------------------------


def page(task: Task, trials: Sequence[Trial], wanted: int) -> Iterator[str]:
    """Return what a task's trials say, of which there are to be so many of each optimiser."""
    yield f"\n## {task.config}: {task.meaning}\n\n"
    if not trials:
        yield "None yet.\n"
        return
    volumes: dict[str, list[float]] = defaultdict(list)
    firsts: dict[str, list[float]] = defaultdict(list)
    for one in sorted(trials):
        volumes[one.optimiser].append(one.hypervolume)
        firsts[one.optimiser].append(one.first)
    volume = comparison.measure("hypervolume", True, volumes, against=PAPER)
    first = comparison.measure(task.fitness[0], True, firsts, against=PAPER)
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
            for name in sorted(volumes, key=lambda name: -median(volumes[name]))
        ],
    )
    if (least := min(map(len, volumes.values()))) < wanted:
        yield f"\n{least} of {wanted} seeds so far.\n"
    yield f"\n{verdict(volume)}\n"


def middle(values: Sequence[float]) -> str:
    low, high = min(values), max(values)
    return f"{median(values):.3g} ({low:.3g} to {high:.3g})"


def against_paper(measure: Measure, name: str) -> Pair | None:
    """Return the pair of PDE, which is its first, and an optimiser."""
    return next((pair for pair in measure.pairs if pair.b == name), None)


def effect(measure: Measure, name: str) -> tuple[str, str]:
    """Return how often a trial of an optimiser is better than one of PDE, with its interval, and the p-value."""
    pair = against_paper(measure, name)
    if pair is None:
        return "", ""
    a12, low, high = pair.a12, pair.low, pair.high
    if measure.more_is_better:
        a12, low, high = 1 - a12, 1 - high, 1 - low
    return f"{100 * a12:.0f} % ({100 * low:.0f} to {100 * high:.0f})", f"{pair.p:.2g}"


def verdict(measure: Measure) -> str:
    """Return who is surely better and worse than PDE by the hypervolume."""
    better: list[str] = []
    worse: list[str] = []
    for name in measure.values:
        pair = against_paper(measure, name)
        if pair and pair.p < SURE:
            (worse if pair.a12 > 0.5 else better).append(name)
    told = [f"{', '.join(names)} {what}" for names, what in ((better, "better than PDE"), (worse, "worse")) if names]
    return (
        f"By the hypervolume surely: {'; '.join(told)}."
        if told
        else "By the hypervolume nobody surely differs from PDE."
    )


def head(budget: Budget, seeds: str, tasks: Sequence[Task]) -> str:
    given = {"seeds": seeds, **dataclasses.asdict(budget), "tasks": " ".join(task.config for task in tasks)}
    command = " ".join(["python -m benchmarks.rivals", *(f"--{name} {value}" for name, value in given.items())])
    return f"""\
# The paper's optimiser and its rivals

Made by this command, which evolves, tests and compares:

```console
{command} --out runs/rivals > docs/results/rivals.md
```

It keeps what came of each trial in `docs/results/rivals.csv`, and evolves what is not there: without that file all.

Each optimiser had {budget.episodes} episodes a trial, the same seeds, a population of {budget.population},
{budget.repeats} repeats, and otherwise its defaults. `pde` has the rates of the task's configuration; *own rates* is
the self-adaptive one. `cma` and the map searches make the first objective better alone; their fronts are what came by
the way. The map searches, `map_elites` and `cma_mae`, have a fitness that describes besides, `box_end` on the paper's
task and `team_end` on others, which changes neither episodes nor objectives.

All numbers are of {budget.tests} tests of each controller of the fronts, on fresh seeds. Hypervolumes are shares of
what there could be. Medians, least and largest over the trials. Who is the best of a front, by the first objective or
in any direction of the hypervolume, all tests but one say, and the one left out how good it is, each in turn, so that
luck in the tests helps no larger front ([Comparing runs](../comparing.md)). *Better than PDE's* is how often a trial is
better than one of `pde`: Vargha and Delaney's A12 with a bootstrap's 95 % interval. p is by Mann and Whitney, adjusted
by Holm for the pairs shown, each optimiser with `pde` in one measure of one task; how the others differ from each other
is not tested here: `swarmevo compare` does it for all pairs.
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("runs/rivals"))
    parser.add_argument("--kept", type=Path, default=KEPT)
    parser.add_argument("--seeds", default="1-20")
    parser.add_argument("--episodes", type=int, default=1800)
    parser.add_argument("--population", type=int, default=20)
    parser.add_argument("--repeats", type=int, default=2)
    parser.add_argument("--tests", type=int, default=10)
    parser.add_argument("--tasks", nargs="+", choices=[task.config for task in TASKS], default=["paper"])
    parser.add_argument("--stored", action="store_true", help="evolve nothing")
    options = parser.parse_args()
    budget = Budget(options.episodes, options.population, options.repeats, options.tests)
    chosen = [task for task in TASKS if task.config in options.tasks]
    seeds = parse_seeds(options.seeds)
    trials = read(options.kept, budget)
    for task in chosen:
        for seed in (seed for seed in seeds if not options.stored and not is_kept(task, seed, trials)):
            folder = options.out / task.config / f"seed-{seed}"
            folder.parent.mkdir(parents=True, exist_ok=True)
            others = [one for one in trials if (one.task, one.seed) != (task.config, seed)]
            trials = [*others, *evolved(task, folder, seed, budget)]
            write(options.kept, trials, budget)
    print(head(budget, options.seeds, chosen), end="")
    for task in chosen:
        found = [one for one in trials if one.task == task.config and one.seed in seeds]
        print("".join(page(task, found, len(seeds))), end="")


if __name__ == "__main__":
    main()

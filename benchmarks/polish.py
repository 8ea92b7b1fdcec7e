# SPDX-License-Identifier: BSD-3-Clause
"""What a search by CMA-ES that has ended still finds in the worlds of the tests, with many episodes of each genome.

    swarmevo evolve best --seed 13 --trials 1 --out runs/best
    python -m benchmarks.polish runs/best --genomes docs/results/polish.csv > docs/results/polish.md

Goes on from a trial's last distribution, its mean, covariance and step, and tests the answers before and after.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.cases import changed
from benchmarks.pages import rate, seconds, table
from swarmevo import plugins
from swarmevo.analysis import assessment
from swarmevo.config import Config
from swarmevo.config import load as load_config
from swarmevo.plugins.team import Team
from swarmevo.protocols import FloatArray
from swarmevo.runs.store import Store
from swarmevo.simulation import EpisodeKey

TEAMS: Final = (3, 4, 4, 5)
"""Robots of each world; four fail most often."""
HORIZON: Final = 90.0
"""[s]; who has not pushed by then hardly ever does (docs/results/deadlocks.md)."""
TESTED: Final = (3, 4, 5)
GENERATION: Final = 2**30
"""Of the keys of the first generation here: no run has it."""


def search_of(run: Path, trial: int) -> tuple[Config, Any]:
    """Return a run's configuration and the optimiser of a trial as it was at its end."""
    with Store.open(run) as store:
        config, state = store.config, store.state(trial)
    if state is None:
        sys.exit(f"{run}: expected trial {trial}, but nothing of it is stored")
    ((name, options),) = config.optimiser.items()
    team, rng = Team(config), np.random.Generator(np.random.PCG64(1))
    optimiser = plugins.create(
        "optimiser", name, options, team.space, config.evolution.population, len(team.objectives), rng
    )
    optimiser.restore(state)
    return config, optimiser


def go_on(config: Config, optimiser: Any, generations: int, repeats: int, success: float) -> None:
    """Let an optimiser learn from the worlds of the tests, where ``success`` is its weight in ``shaped``."""
    shaped = {**config.fitness["shaped"], "success": success}
    alone = config.model_copy(update={"worlds": (), "fitness": {"shaped": shaped}})
    team = Team(alone)
    worlds = [
        team.in_world(changed(alone, team={"robots": n, "start": "row"}, episode={"horizon": HORIZON})) for n in TEAMS
    ]
    for generation in range(generations):
        genomes = optimiser.ask()
        total = np.zeros(len(genomes))
        for number, world in enumerate(worlds):
            for repeat in range(number * repeats, (number + 1) * repeats):  # the worlds of four robots draw their own
                key = EpisodeKey(config.evolution.seed or 0, 0, GENERATION + generation, repeat)
                done = world.simulate(genomes, [key] * len(genomes))
                total += [float(world.judge(done, genomes, i)[0]) for i in range(len(genomes))]
        optimiser.tell(genomes, -total[:, np.newaxis] / (len(worlds) * repeats))
        print(f"generation {generation}: median {np.median(total) / (len(worlds) * repeats):.4f}", file=sys.stderr)


def tested(config: Config, genomes: FloatArray, tests: int) -> list[list[str]]:
    """Return a line for each genome and team: rate and time of pushing."""
    seed = f"evolution.seed={config.evolution.seed}"
    world = load_config("paper", ["episode.until=push", seed]).model_copy(update={"controller": config.controller})
    return [
        [name, str(row.robots), rate(row.push_rate, tests), seconds(row.push_time)]
        for name, genes in zip(("before", "after"), genomes, strict=True)
        for row in assessment.assess_genomes(world, genes[np.newaxis], TESTED, tests, workers=0).rows
    ]


def page(config: Config, lines: Sequence[Sequence[str]], options: argparse.Namespace) -> str:
    """Return the page."""
    seed, episodes = config.evolution.seed, options.generations * options.repeats * len(TEAMS)
    each, teams = options.repeats * len(TEAMS), ", ".join(map(str, TEAMS[:-1])) + f" and {TEAMS[-1]}"
    return f"""# A search that goes on where it is tested

Does a search that has ended lack in what it learnt, or in the last per cent? The distribution with which trial
{options.trial} of `best.yaml` ended, its mean, covariance and step, goes on for {options.generations} generations in
the worlds of the tests: the paper's row, {teams} robots, {HORIZON:g} s, {each} episodes of each
genome and {episodes * config.evolution.population} in all, and `success` has the weight {options.success:g} beside
`togetherness`. That takes minutes, as teams that push end soon. Made by

```console
swarmevo evolve best --seed {seed} --trials {options.trial + 1} --out runs/best
{shlex.join(["python", "-m", "benchmarks.polish", *sys.argv[1:]])}
```

Its answer before and after, {options.tests} tests with each team on fresh seeds, until the push:

{table(["answer", "robots", "pushing", "after"], lines)}
Both genomes are in `docs/results/polish.csv`.
"""


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("--trial", type=int, default=0)
    parser.add_argument("--generations", type=int, default=30)
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--success", type=float, default=2.0, help="its weight; that of togetherness is 4")
    parser.add_argument("--tests", type=int, default=3000)
    parser.add_argument("--genomes", type=Path, help="a CSV file for both")
    options = parser.parse_args()
    config, optimiser = search_of(options.run, options.trial)
    genomes = [optimiser.answer()[0]]
    go_on(config, optimiser, options.generations, options.repeats, options.success)
    genomes.append(optimiser.answer()[0])
    if options.genomes:
        np.savetxt(options.genomes, genomes, delimiter=",", fmt="%.17g")
    print(page(config, tested(config, np.array(genomes), options.tests), options), end="")


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: BSD-3-Clause
"""Which reading of the paper comes nearest to its Table II: all of them, evolved alike.

    python -m benchmarks.readings --out runs/readings > docs/results/readings.md

Where the paper is silent, a reading of it is a few overrides of ``configs/paper.yaml``. Each is evolved from the same
seed with the same budget in episodes, in a run folder of its own below ``--out``; then all controllers of its fronts
are tested on fresh seeds, in its own world and in teams of one to five, and their table is held against the paper's.
What is stored is not run again: after Ctrl-C or ``kill -9`` the same command goes on. Half of the trials of all
readings come first, then the others; ``--stored`` runs nothing and shows what there is by then.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from benchmarks.readings_page import Found, complete_trials, found_in, page
from swarmevo.analysis import assessment
from swarmevo.config import Config
from swarmevo.errors import Interrupted, StoreError, SwarmevoError
from swarmevo.plugins.team import load_config
from swarmevo.runs import driver
from swarmevo.runs.store import Store


@dataclass(frozen=True)
class Reading:
    """A reading of the paper: ``configs/paper.yaml`` but for some keys."""

    name: str
    """Of its run folder."""
    meaning: str
    overrides: tuple[str, ...] = ()
    """``section.key=value``"""


READINGS: Final = (
    Reading("paper.yaml", "as it is"),
    Reading("repeats-1", "one episode an evaluation, not three", ("evolution.repeats=1",)),
    Reading("repeats-10", "ten episodes an evaluation", ("evolution.repeats=10",)),
    Reading(
        "mutation",
        "mutation with probability 0.1 and spread 0.5",
        ("optimiser.pde.mutation_rate=0.1", "optimiser.pde.mutation_spread=0.5"),
    ),
    Reading("individual", "a genome for each robot", ("team.genomes=individual",)),
    Reading("arena", "the source is heard in the whole arena", ("emitter.reach=arena",)),
    Reading("three", "three robots in evolution, which the text says were five", ("team.robots=3",)),
    Reading("corner", "the box near a corner", ("box.pose=[0.29, 0.345, 0]", "emitter.position=[0.29, 0.345, 0.03]")),
    Reading("touch-force", "box sensors that measure the force", ("sensors.touch_mode=force",)),
    Reading("infrared-all", "infrared sensors see the box, too", ("sensors.infrared_target=all",)),
    Reading(
        "open", "the box in the open, 0.21 m from the wall", ("box.pose=[0, 0.2, 0]", "emitter.position=[0, 0.2, 0.03]")
    ),
    Reading("dominates", "a child must dominate its main parent", ("optimiser.pde.acceptance=dominates",)),
    Reading("once", "the retained are not evaluated again", ("optimiser.pde.reevaluate=once",)),
    Reading("near", "robots start 100 mm apart", ("team.row_spacing=0.1",)),
    Reading("friction", "friction of the box 0.59, about the least at which two fail", ("physics.box_friction=0.59",)),
    Reading("renew", "the retained are judged by their newest evaluation", ("optimiser.pde.reevaluate=renew",)),
    Reading(
        "touch-graded",
        "box sensors graded over 20 mm",
        ("sensors.touch_mode=graded", "sensors.touch_range=0.02"),
    ),
    Reading("emitter-side", "the source above the face to be pushed", ("emitter.position=[0, 0.255, 0.03]",)),
    Reading("far", "robots start 200 mm apart", ("team.row_spacing=0.2",)),
    Reading("emitter-corner", "the source above a corner of the box", ("emitter.position=[0.1375, 0.255, 0.03]",)),
    Reading(
        "repeats-1-once",
        "one episode in all for each individual",
        ("evolution.repeats=1", "optimiser.pde.reevaluate=once"),
    ),
    Reading("motion", "S B is not summed, but added at the end", ("fitness.box_pushing.sum_covers=motion",)),
    Reading("no-bias", "a network without bias", ("controller.feedforward.bias=false",)),
    Reading("rigid", "rigid bumpers", ("robot.bumper=rigid",)),
)
"""In the order in which they are run: first that which the others are held against, last that whose physics is slow."""


# ---- evolution and tests ---------------------------------------------------------------------------------------------


def settings_of(reading: Reading, seed: int, trials: int, episodes: int) -> Config:
    """Return the configuration of a reading; ``episodes`` are the budget of a trial."""
    budget = (f"evolution.trials={trials}", f"evolution.episodes={episodes}", "evolution.generations=1000000")
    return load_config("paper", [*reading.overrides, f"evolution.seed={seed}", *budget])


def evolve(folder: Path, settings: Config, trials: int, workers: int) -> None:
    """Evolve the first trials of a reading, as far as they are not stored.

    Raises:
        StoreError: The folder has a run of another configuration.
    """
    if not folder.exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        driver.begin(folder, settings)
    with opened(folder, settings, readonly=False) as store, suppress(Interrupted):
        driver.evolve(store, workers, lambda now: None, stop=lambda: len(complete_trials(store)) >= trials)


def opened(folder: Path, settings: Config, readonly: bool = True) -> Store:
    """Open a reading's run.

    Raises:
        StoreError: It is of another configuration.
    """
    store = Store.open(folder, readonly=readonly)
    if store.config == settings:
        return store
    store.close()
    wanted = settings.evolution
    raise StoreError(
        f"{folder}: expected a run of this reading with seed {wanted.seed}, {wanted.trials} trials and "
        f"{wanted.episodes} episodes each, got another; choose another --out"
    )


def run(settings: Mapping[Path, Config], repeats: int, workers: int) -> None:
    """Evolve and test all readings; ``settings`` has the configuration of each folder."""
    for share in (0.5, 1.0):
        for folder, reading in settings.items():
            trials = math.ceil(share * reading.evolution.trials)
            print(f"{folder}: {trials} of {reading.evolution.trials} trials", file=sys.stderr, flush=True)
            evolve(folder, reading, trials, workers)
            with opened(folder, reading) as store:
                assessment.assess(store, repeats=repeats, workers=workers)


def stored(settings: Mapping[Path, Config]) -> Iterator[Found]:
    """Yield what there is of each reading that has been tested."""
    for folder, reading in settings.items():
        if folder.exists():
            with opened(folder, reading) as store:
                tests = assessment.stored(store)
                if tests and (found := found_in(folder.name, store, tests)):
                    yield found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the readings' runs")
    parser.add_argument("--only", nargs="+", choices=[one.name for one in READINGS], help="these readings")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--trials", type=int, default=10, help="of each reading")
    parser.add_argument("--episodes", type=int, default=900, help="budget of a trial")
    parser.add_argument("--repeats", type=int, default=5, help="tests of each controller with each team")
    parser.add_argument("--workers", type=int, default=0, help="episodes at once; 0: one for each processor")
    parser.add_argument("--stored", action="store_true", help="run nothing")
    arguments = parser.parse_args()
    readings = [one for one in READINGS if not arguments.only or one.name in arguments.only]
    settings = {
        arguments.out / one.name: settings_of(one, arguments.seed, arguments.trials, arguments.episodes)
        for one in readings
    }
    try:
        if not arguments.stored:
            run(settings, arguments.repeats, arguments.workers)
        found = list(stored(settings))
    except SwarmevoError as error:
        sys.exit(f"error: {error}")
    print(page(found, {one.name: (one.meaning, one.overrides) for one in readings}), end="")


if __name__ == "__main__":
    main()

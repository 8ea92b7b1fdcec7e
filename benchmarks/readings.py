# SPDX-License-Identifier: BSD-3-Clause
"""Which reading of the paper comes nearest to its Table II: all of them, evolved alike.

    python -m benchmarks.readings --out runs/readings > docs/results/readings.md

Where the paper is silent, a reading of it is a few overrides of ``configs/paper.yaml``. Each is evolved from the same
seed with the same budget in episodes, in a run folder of its own below ``--out``; then all controllers of its fronts
are tested on fresh seeds, in its own world and in teams of one to five, and their table is held against the paper's.
What is stored is not run again: after Ctrl-C or ``kill -9`` the same command goes on. With ``--stored`` nothing is run:
the page has the readings that are finished.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from benchmarks.readings_page import Found, found_in, page
from swarmevo import api
from swarmevo.analysis import assessment, fronts
from swarmevo.config import Config
from swarmevo.errors import StoreError, SwarmevoError
from swarmevo.plugins.team import load_config
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
    Reading("paper", "`configs/paper.yaml` as it is"),
    Reading("repeats-1", "one episode an evaluation, not three", ("evolution.repeats=1",)),
    Reading("repeats-10", "ten episodes an evaluation", ("evolution.repeats=10",)),
    Reading(
        "mutation",
        "mutation with probability 0.1 and spread 0.5",
        ("optimiser.pde.mutation_rate=0.1", "optimiser.pde.mutation_spread=0.5"),
    ),
    Reading("individual", "a genome for each robot", ("team.genomes=individual",)),
    Reading("arena", "the source is heard in the whole arena", ("emitter.reach=arena",)),
    Reading("rigid", "rigid bumpers", ("robot.bumper=rigid",)),
    Reading("infrared-all", "infrared sensors see the box, too", ("sensors.infrared_target=all",)),
    Reading(
        "open", "the box in the open, 0.21 m from the wall", ("box.pose=[0, 0.2, 0]", "emitter.position=[0, 0.2, 0.03]")
    ),
    Reading("corner", "the box near a corner", ("box.pose=[0.29, 0.345, 0]", "emitter.position=[0.29, 0.345, 0.03]")),
    Reading("dominates", "a child must dominate its main parent", ("optimiser.pde.acceptance=dominates",)),
    Reading("once", "the retained are not evaluated again", ("optimiser.pde.reevaluate=once",)),
    Reading("touch-force", "box sensors that measure the force", ("sensors.touch_mode=force",)),
    Reading("three", "three robots in evolution, which the text says were five", ("team.robots=3",)),
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
)
"""In the order in which they are run: that of the paper's configuration first, for the others are held against it."""


# ---- evolution and tests ---------------------------------------------------------------------------------------------


def settings_of(reading: Reading, seed: int, trials: int, episodes: int) -> Config:
    """Return the configuration of a reading; ``episodes`` are the budget of a trial."""
    budget = (f"evolution.trials={trials}", f"evolution.episodes={episodes}", "evolution.generations=1000000")
    return load_config("paper", [*reading.overrides, f"evolution.seed={seed}", *budget])


def is_evolved(folder: Path, settings: Config) -> bool:
    """Return whether a run folder is there, and finished.

    Raises:
        StoreError: There is a run of another configuration.
    """
    if not folder.exists():
        return False
    with Store.open(folder) as store:
        if store.config != settings:
            wanted = settings.evolution
            raise StoreError(
                f"{folder}: expected a run of this reading with seed {wanted.seed}, {wanted.trials} trials and "
                f"{wanted.episodes} episodes each, got another; choose another --out"
            )
        return fronts.is_complete(store)


def evolve(folder: Path, settings: Config, workers: int) -> None:
    """Bring a reading's run to its end."""
    if not folder.exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        api.evolve(settings, out=folder, workers=workers)
    elif not is_evolved(folder, settings):
        api.resume(folder, workers=workers)


def finished(readings: Sequence[Reading], arguments: argparse.Namespace) -> Iterator[Found]:
    """Evolve and test the readings, or, with ``--stored``, look at those that are finished."""
    for reading in readings:
        settings = settings_of(reading, arguments.seed, arguments.trials, arguments.episodes)
        folder = arguments.out / reading.name
        if arguments.stored and not is_evolved(folder, settings):
            continue
        print(reading.name, file=sys.stderr, flush=True)
        evolve(folder, settings, arguments.workers)
        with Store.open(folder) as store:
            tests = assessment.assess(store, repeats=arguments.repeats, workers=arguments.workers)
            yield found_in(reading.name, store, tests)


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
    try:
        found = list(finished(readings, arguments))
    except SwarmevoError as error:
        sys.exit(f"error: {error}")
    print(page(found, {one.name: (one.meaning, one.overrides) for one in readings}), end="")


if __name__ == "__main__":
    main()

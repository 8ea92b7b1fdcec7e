# SPDX-License-Identifier: BSD-3-Clause
"""What a controller does in a second simulator, as a page of docs/results.

    python -m benchmarks.second_simulator [CONTROLLER.json|RUN:ID] [--tests N] [--rigid-tests N] [--robots 1-5]

Who is tested: the controller that comes with swarmevo; one that ``swarmevo export --controller`` wrote, in the paper's
world; or an individual of a run, in the run's. Each with sprung and with rigid bumpers, here and in the library.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from benchmarks.cases import changed
from benchmarks.pages import rate, seconds, table
from benchmarks.second_simulator.episode import TIME_STEP, Network, Outcome, networks_of, run, team_of
from swarmevo import config as configuration
from swarmevo.analysis import assessment, shipped, table_ii
from swarmevo.cli.common import run_and_individual, team_sizes
from swarmevo.config import Config
from swarmevo.errors import ConfigError, SwarmevoError
from swarmevo.runs import export, other_world
from swarmevo.runs.store import Store

SEED: Final = 2026
"""Of the tests in either simulator; their random numbers have nothing in common."""


class Tested(NamedTuple):
    """A controller and its world."""

    title: str
    config: Config
    exported: Mapping[str, Any]
    """As ``swarmevo export --controller`` writes it."""


class Row(NamedTuple):
    """What teams of one size did in one simulator."""

    homing_rate: float
    """Share of the robots."""
    push_rate: float
    push_time: float | None
    """Mean of those that pushed [s]; None: nobody did."""


def tested(source: str | None) -> Tested:
    """Return who is to be tested.

    Raises:
        ConfigError: There is nobody of that name.
        StoreError: The run is damaged, or has no such individual.
    """
    if source is None:
        text = (files("swarmevo") / "shipped" / shipped.FILE).read_text(encoding="utf-8")
        return _of_file(shipped.TITLE, text)
    if os.path.isfile(source):
        return _of_file(Path(source).name, Path(source).read_text(encoding="utf-8"))
    folder, genome = run_and_individual(source)
    if not folder.is_dir():
        raise ConfigError(f"{source}: expected an exported controller or RUN:ID, but there is none")
    with Store.open(folder) as store:
        id, _ = assessment.watched(store, genome)
        return Tested(
            f"{folder.name}, individual {id}", other_world.test_world(store.config), export.controller(store, id)
        )


def _of_file(title: str, text: str) -> Tested:
    try:
        exported = json.loads(text)
        paper = configuration.load("paper", [f"evolution.seed={SEED}"])
        return Tested(title, paper.model_copy(update={"controller": exported["controller"]}), exported)
    except (ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"{title}: expected a controller as `swarmevo export --controller` writes it") from error


# ---- the tests -------------------------------------------------------------------------------------------------------


def in_second(config: Config, networks: Sequence[Network], robots: int, tests: int) -> Row:
    """Test a team in the second simulator."""
    world = other_world.of_size(config, robots)
    return summary([run(world, team_of(networks), np.random.default_rng((SEED, robots, i))) for i in range(tests)])


def summary(outcomes: Sequence[Outcome]) -> Row:
    """Return what episodes of one team were like."""
    homing, push = np.array([one.homing_times for one in outcomes]), np.array([one.push_time for one in outcomes])
    pushed = np.isfinite(push)
    push_time = float(push[pushed].mean()) if pushed.any() else None
    return Row(float(np.isfinite(homing).mean()), float(pushed.mean()), push_time)


def in_library(config: Config, genes: Sequence[float], sizes: Sequence[int], tests: int) -> list[Row]:
    """Test teams in the library."""
    seeded = changed(config, evolution={"seed": SEED})
    found = assessment.assess_genomes(seeded, np.array([genes]), sizes, tests, workers=1)
    rows: dict[int, table_ii.Outcome] = {row.robots: row for row in found.rows}
    return [Row(rows[size].homing_rate, rows[size].push_rate, rows[size].push_time) for size in sizes]


class Compared(NamedTuple):
    """What teams of one size did in either simulator."""

    bumper: str
    robots: int
    tests: int
    second: Row
    library: Row

    def cells(self) -> list[str]:
        """Return a line of the page's table."""
        both = (self.second, self.library)
        homing = (rate(row.homing_rate, self.tests) for row in both)
        pushing = (rate(row.push_rate, self.tests) for row in both)
        return [
            self.bumper,
            str(self.robots),
            str(self.tests),
            *homing,
            *pushing,
            *(seconds(row.push_time) for row in both),
        ]


def compare(one: Tested, sizes: Sequence[int], tests: Mapping[str, int]) -> Iterator[Compared]:
    """Test teams of these sizes with each bumper, as often as ``tests`` says of it."""
    networks = networks_of(one.exported)
    for bumper, times in tests.items():
        config = changed(one.config, robot={"bumper": bumper})
        for size, library in zip(sizes, in_library(config, one.exported["genes"], sizes, times), strict=True):
            compared = Compared(bumper, size, times, in_second(config, networks, size, times), library)
            print(compared, file=sys.stderr, flush=True)
            yield compared


# ---- the page --------------------------------------------------------------------------------------------------------

ENOUGH: Final = 3
"""Robots that move the box; fewer do not."""
ASKED: Final = 0.95
"""Share of the episodes in which enough robots are to push."""


def carries(found: Sequence[Compared]) -> bool:
    """Whether the controller does in the second simulator what is asked of it, with the bumpers that it knows."""
    first = [one for one in found if one.bumper == found[0].bumper]
    return all(one.second.push_rate >= ASKED if one.robots >= ENOUGH else one.second.push_rate == 0.0 for one in first)


def page(one: Tested, found: Sequence[Compared], command: str) -> str:
    """Return the page."""
    head = [
        "bumpers",
        "robots",
        "tests",
        *(cell for name in ("homing", "pushing", "after") for cell in (name, "library")),
    ]
    return f"""# In a second simulator

Does a controller live on a flaw of the simulator that it was evolved in? Then it fails in another. This one shares with
the library the numbers of the configuration, and nothing else. Bodies are moved by the
[planar reference](../../native/reference/planar.hpp): springs, dampers and Coulomb's circles in explicit steps of
{1e6 * TIME_STEP:g} us, where the library solves for forces in steps of
{1e3 * one.config.physics.time_step:g} ms. [Sensors](../../benchmarks/second_simulator/sensors.py),
[start, noise, network](../../benchmarks/second_simulator/episode.py) and what counts as success are NumPy, written from
the documentation, with random numbers of its own. [Tests](../../tests/repository/test_second_simulator.py) hold what
does not move against the library: at the same poses both sense and command the same. No controller was evolved or
chosen in it.

Tested: {one.title}, in episodes of {one.config.episode.horizon:g} s. Homing is the share of the robots that come within
the emitter's range, pushing that of the episodes in which the box comes to the wall, with Wilson's 95 % intervals;
times are means over those. Made by

```console
{command}
```

{table(head, (compared.cells() for compared in found))}
Pushing in at least {100 * ASKED:g} % with {ENOUGH} robots and more, never with fewer, with {found[0].bumper} bumpers:
**{"yes" if carries(found) else "no"}**.
"""


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("controller", nargs="?", metavar="CONTROLLER.json|RUN:ID")
    parser.add_argument("--tests", type=int, default=200, help="of each team with sprung bumpers; 0: none")
    parser.add_argument("--rigid-tests", type=int, default=100, help="of each team with rigid bumpers; 0: none")
    parser.add_argument("--robots", default="1-5", help="team sizes")
    arguments = parser.parse_args()
    if max(arguments.tests, arguments.rigid_tests) < 1:
        parser.error("--tests, --rigid-tests: expected at least one test")
    command = " ".join(["python -m benchmarks.second_simulator", *sys.argv[1:]])
    try:
        one = tested(arguments.controller)
        tests = {"sprung": arguments.tests, "rigid": arguments.rigid_tests}
        tried = {bumper: times for bumper, times in tests.items() if times > 0}
        found = list(compare(one, team_sizes(arguments.robots), tried))
    except SwarmevoError as error:
        parser.exit(1, f"error: {error}\n")
    print(page(one, found, command), end="")


if __name__ == "__main__":
    main()

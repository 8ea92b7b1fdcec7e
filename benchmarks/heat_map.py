# SPDX-License-Identifier: BSD-3-Clause
"""How far controllers carry beyond the world that they were evolved in, as a heat map.

    python -m benchmarks.heat_map [RUN[:ID] ...] [--tests 40]

Writes docs/results/robustness.png and robustness.md: in what share of fresh tests the box comes to the wall, when one
thing of the paper's world changes at a time. Who is tested: the controller that comes with swarmevo, and those that are
named (of a run the first of its front).
"""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from benchmarks import made_by
from benchmarks.pages import table
from swarmevo import config as configuration
from swarmevo import simulation
from swarmevo.analysis import assessment, fronts, shipped
from swarmevo.analysis.recording import simulate
from swarmevo.analysis.statistics import wilson
from swarmevo.cli.common import run_and_individual
from swarmevo.config import Config
from swarmevo.plugins.team import Team
from swarmevo.protocols import FloatArray
from swarmevo.runs import other_world
from swarmevo.runs.store import Store
from swarmevo.views.figures import style

FOLDER: Final = Path(__file__).parents[1] / "docs" / "results"
SIZES: Final = (1, 2, 3, 4, 5)
FACTORS: Final[dict[str, dict[str, Sequence[str]]]] = {
    "noise of sensors and wheels": {
        f"x {factor:g}": [
            f"noise.infrared={0.05 * factor}",
            f"noise.infrared_at_contact={0.005 * factor}",
            f"noise.wheels={0.05 * factor}",
        ]
        for factor in (0, 1, 2, 3, 4)
    },
    "noise of the signal [%]": {f"{100 * rf:g}": [f"noise.rf={rf}"] for rf in (0, 0.1, 0.2, 0.4)},
    "mass of the box [kg]": {f"{mass:g}": [f"box.mass={mass}"] for mass in (0.18, 0.204, 0.24, 0.276, 0.3)},
    "friction of the box": {f"{mu:g}": [f"physics.box_friction={mu}"] for mu in (0.5, 0.56, 0.62, 0.66, 0.7)},
    "start": {
        "row": [],
        "south": ["team.start=random", "team.start_region=[-0.45, 0.45, -0.45, 0.0]"],
        "anywhere": ["team.start=random", "team.start_region=[-0.45, 0.45, -0.45, 0.45]"],
        "turned": ["team.start_jitter=[0.01, 3.1]"],
    },
    "bumper": {"sprung": [], "rigid": ["robot.bumper=rigid"]},
}
"""What changes: for each factor its levels, as ``--set`` takes them."""


class Chosen(NamedTuple):
    """A controller and its world."""

    title: str
    config: Config
    genes: FloatArray
    origin: str = ""
    """Of its run, a sentence."""


def chosen(run: str) -> Chosen:
    folder, genome = run_and_individual(run)
    with Store.open(folder) as store:
        id = fronts.front(store)[0].genome if genome is None else assessment.watched(store, genome)[0]
        which = "the first of the front" if genome is None else f"individual {id}"
        _, command = made_by.evolution(store.config, folder)
        trials = f"{len(store.trials())} of {store.config.evolution.trials} trials"
        origin = f'"{folder.name}" is {which} of `{command}`, {trials}.'
        return Chosen(f"{folder.name}, individual {id}", other_world.test_world(store.config), store.genome(id), origin)


def push_rate(one: Chosen, overrides: Sequence[str], robots: int, tests: int) -> float:
    """Return the share of tests in which the box comes to the wall; NaN where the world has no room for them."""
    settings = configuration.changed(one.config, overrides)
    world, genes = other_world.team_of(settings, one.genes, robots)
    if simulation.scene_errors(world):
        return float("nan")
    keys = [shipped.key(seed=2026, repeat=repeat) for repeat in range(tests)]
    return float(np.isfinite(simulate(Team(world), genes, keys, channels=()).push_time).mean())


def measure(one: Chosen, tests: int) -> dict[str, FloatArray]:
    """Return for each factor ``(sizes, levels)``."""
    return {
        factor: np.array([[push_rate(one, overrides, n, tests) for overrides in levels.values()] for n in SIZES])
        for factor, levels in FACTORS.items()
    }


def draw(found: dict[str, dict[str, FloatArray]], file: Path) -> None:
    widths = [len(levels) for levels in FACTORS.values()]
    with style.picture(11.0, 0.6 + 2.1 * len(found)) as picture:
        grid = picture.add_gridspec(len(found), len(widths), width_ratios=widths)
        for row, (title, rates) in enumerate(found.items()):
            for column, (factor, values) in enumerate(rates.items()):
                axes: Any = picture.add_subplot(grid[row, column])
                axes.imshow(values, cmap="viridis", vmin=0, vmax=1, aspect="auto")
                axes.grid(False)
                for (i, j), value in np.ndenumerate(values):
                    ink = "black" if value > 0.6 else "white"
                    axes.text(j, i, f"{100 * value:.0f}", ha="center", va="center", fontsize=7, color=ink)
                axes.set_xticks(range(values.shape[1]), list(FACTORS[factor]), fontsize=6)
                axes.set_yticks(range(len(SIZES)), [str(n) for n in SIZES] if column == 0 else [], fontsize=7)
                if row == 0:
                    axes.set_title(factor, fontsize=8)
                if column == 0:
                    axes.set_ylabel(f"{textwrap.fill(title, 22)}\nrobots", fontsize=7)
        picture.savefig(file, dpi=150)


def page(everybody: Sequence[Chosen], found: dict[str, dict[str, FloatArray]], tests: int, made: str) -> Iterator[str]:
    low, high = wilson(0.9 * tests, tests)
    yield (
        "# Beyond the world of evolution\n\n"
        f"Share of {tests} fresh tests in which the box comes to the wall, in per cent, when one thing of the paper's "
        f"world changes at a time. The 95 % interval of a rate of 90 % is {100 * low:.0f} to {100 * high:.0f} %.\n\n"
        f"{' '.join([*(one.origin for one in everybody if one.origin), f'Made by `{made}`.'])}\n\n"
        "![Heat map of the tables below](robustness.png)\n"
    )
    for title, rates in found.items():
        yield f"\n## {title[0].upper()}{title[1:]}\n\n"
        head = ["changed", "to", *(f"{n} robot{'s' * (n > 1)}" for n in SIZES)]
        yield table(
            head,
            [
                [factor, level, *(f"{100 * value:.0f}" for value in values[:, j])]
                for factor, values in rates.items()
                for j, level in enumerate(FACTORS[factor])
            ],
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="*")
    parser.add_argument("--tests", type=int, default=40)
    arguments = parser.parse_args()
    everybody = [Chosen(shipped.TITLE, *shipped.best()), *map(chosen, arguments.runs)]
    found = {one.title: measure(one, arguments.tests) for one in everybody}
    FOLDER.mkdir(exist_ok=True)
    draw(found, FOLDER / "robustness.png")
    made = made_by.this_command("benchmarks.heat_map", *(run_and_individual(run)[0] for run in arguments.runs))
    text = "".join(page(everybody, found, arguments.tests, made))
    (FOLDER / "robustness.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: BSD-3-Clause
"""Why teams of best.yaml fail, as a page of docs/results.

    python -m benchmarks.deadlocks docs/results/best-1.csv ... [--tests 300] > docs/results/deadlocks.md

A file has a row for each trial: the genome that it ended with. How many teams are still at it after some times tells
whether they are slow or stuck; where robots are in the end tells what they are stuck in.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks import made_by
from benchmarks.choices import SIZES, WORLD, read
from benchmarks.pages import table
from swarmevo.analysis.recording import simulate
from swarmevo.config import Config
from swarmevo.plugins.team import Team, load_config
from swarmevo.protocols import FloatArray
from swarmevo.simulation import EpisodeKey, Episodes

SEED: Final = 3
"""Of the tests; those of docs/results/choices.md have others."""
TIMES: Final = (30.0, 45.0, 60.0, 90.0, 120.0, 179.9)
"""[s]"""
GAPS: Final = (0.065, 0.075, 0.085, 0.105)
"""Between the box and its wall at the start [m]; the first one is the paper's."""
SOUTH: Final = ((-0.04, 0.217, 1.5708), (0.04, 0.217, 1.5708))
"""Two robots before the face that is pushed, heading for it [m, m, rad]."""
PAIRS: Final = {
    "east": (*SOUTH, (0.1755, 0.306, 3.1416), (0.1755, 0.384, 3.1416)),
    "west": (*SOUTH, (-0.1755, 0.306, 0.0), (-0.1755, 0.384, 0.0)),
}
"""And two more before the face beside it."""
NEAR: Final = 0.001
"""At the face: within [m]."""
BEHIND, WEDGED = "a robot between the box and its wall", "a robot between a corner of the box and the wall"
FEW, MANY = "fewer than three at the face", "three or more at the face"
FAULTS: Final = (BEHIND, WEDGED, FEW, MANY)


def episodes_of(genomes: FloatArray, settings: Config, tests: int, channels: Sequence[str] = ()) -> list[Episodes]:
    """Return so many tests of each controller."""
    team = Team(settings)
    keys = [EpisodeKey(SEED, 0, 0, repeat) for repeat in range(tests)]
    return [simulate(team, genome, keys, channels=channels) for genome in genomes]


def fault(robots: FloatArray, box: FloatArray, settings: Config) -> str:
    """Return what a team is stuck in.

    Args:
        robots: ``(robots, 3)``: their poses in the end [m, m, rad].
        box: ``(3,)``: that of the box; its wall is in the north.
        settings: Of the team's world.
    """
    (width, depth, _), reach = settings.box.size, settings.robot.radius + NEAR
    sine, cosine = np.sin(box[2]), np.cos(box[2])
    across, along = ((robots[:, :2] - box[:2]) @ np.array([[cosine, -sine], [sine, cosine]])).T
    beside = np.abs(across) < width / 2
    if np.any(beside & (along > depth / 2)):
        return BEHIND
    to_corner = np.hypot(np.abs(across) - width / 2, along - depth / 2)
    if np.any((to_corner < reach) & (settings.arena.size / 2 - robots[:, 1] < reach)):
        return WEDGED
    pushing = beside & (along < 0) & (along > -depth / 2 - reach)
    return MANY if pushing.sum() >= 3 else FEW


def wedge(settings: Config) -> tuple[float, float]:
    """Return where a robot all but touches both the wall and the north-east corner of the box [m]."""
    away = settings.robot.radius + NEAR / 2
    (x, y, _), (width, depth, _) = settings.box.pose, settings.box.size
    wall, corner = settings.arena.size / 2, y + depth / 2
    return x + width / 2 + np.sqrt(away**2 - (wall - away - corner) ** 2).item(), wall - away


def section_of_failures(genomes: FloatArray, bumper: str, tests: int) -> list[str]:
    """Return when teams have pushed, and where robots are in the end of those that have not."""
    lasting, faults = [], []
    for robots in SIZES:
        settings = load_config("paper", [*WORLD, f"team.robots={robots}", f"robot.bumper={bumper}"])
        found = episodes_of(genomes, settings, tests, ("pose", "movables"))
        times = np.concatenate([np.nan_to_num(each.telemetry.push_time, nan=np.inf) for each in found])
        lasting.append([str(robots), str(len(times)), *(f"{100 * np.mean(times > time):.1f} %" for time in TIMES)])
        counts = Counter(
            fault(each.telemetry.pose[i, -1], each.telemetry.movables[i, -1, 0], settings)
            for each in found
            for i in np.flatnonzero(np.isnan(each.telemetry.push_time))
        )
        faults.append([str(robots), str(counts.total()), *(str(counts[kind]) for kind in FAULTS)])
    return [
        "Share of the tests in which the box is not yet at its wall after so many seconds:\n",
        table(["robots", "tests", *(f"{time:.0f} s" for time in TIMES)], lasting),
        "Where robots are in the end of those that fail after 180 s:\n",
        table(["robots", "failed", *FAULTS], faults),
    ]


def push_rates(genomes: FloatArray, tests: int, overrides: Sequence[str]) -> list[float]:
    """Return for each controller the share of the tests in which it pushes within 90 s."""
    there = load_config("paper", [*WORLD, *overrides, "episode.horizon=90"])
    return [float(np.isfinite(each.telemetry.push_time).mean()) for each in episodes_of(genomes, there, tests)]


def started(poses: Sequence[tuple[float, float, float]], *jitter: float) -> str:
    starts = f"start: poses, start_poses: {[list(pose) for pose in poses]}, start_jitter: {list(jitter)}"
    return f"team={{robots: {len(poses)}, {starts}}}"


def section_of_gaps(genomes: FloatArray, tests: int) -> list[str]:
    rows = []
    for robots in SIZES:
        pushed = []
        for gap in GAPS:
            settings = load_config("paper")
            y = (settings.arena.size - settings.box.size[1]) / 2 - gap
            places = [f"team.robots={robots}", f"box.pose=[0, {y:.3f}, 0]", f"emitter.position=[0, {y:.3f}, 0.03]"]
            pushed.append(np.mean(push_rates(genomes, tests, places)))
        rows.append([str(robots), *(f"{100 * share:.1f} %" for share in pushed)])
    return [
        "The box stands 65 mm from its wall. A robot is 70 mm wide, but its sprung bumper gives: it can squeeze in "
        "there, and is then in the way of the box. Where the box stands so far from the wall at the start, with "
        f"the emitter above it, that many teams push it within 90 s, in {tests} tests of each:\n",
        table(["robots", *(f"{1000 * gap:.0f} mm" for gap in GAPS)], rows),
    ]


def section_of_pairs(names: Sequence[str], genomes: FloatArray, tests: int) -> list[str]:
    rates = [push_rates(genomes, tests, [started(poses, 0.002, 0.3)]) for poses in PAIRS.values()]
    return [
        "Two robots do not move the box, and a robot does not see how many press. Where two begin at the south "
        "face and two at the one east or west of it, that many teams push the box within 90 s: most get out of one "
        f"of the two, and not out of its mirror image. {tests} tests of each:\n",
        table(["file, row", *(f"south and {side}" for side in PAIRS)], by_name(names, rates)),
    ]


def section_of_corners(names: Sequence[str], genomes: FloatArray, tests: int) -> list[str]:
    x, y = wedge(load_config("paper"))
    rates = [
        push_rates(genomes, tests, [started([*SOUTH, (at, y, 0.0)], 0.0002, 3.14), "robot.bumper=rigid"])
        for at in (x, -x)
    ]
    return [
        "Where two begin at the south face, and a third one where it all but touches both the wall and a corner of "
        f"the box, each with any heading, that many teams push the box within 90 s. {tests} tests of each:\n",
        table(["file, row", "north-east corner", "north-west corner"], by_name(names, rates)),
    ]


def by_name(names: Sequence[str], rates: Sequence[Sequence[float]]) -> list[list[str]]:
    return [[name, *(f"{100 * share:.0f} %" for share in shares)] for name, *shares in zip(names, *rates, strict=True)]


def page(files: Sequence[Path], tests: int) -> str:
    names, genomes = read(files)
    few = max(tests // 6, 1)
    return "\n".join(
        [
            "# Why teams fail\n",
            "Made by this command:\n",
            f"```console\n{made_by.this_command('benchmarks.deadlocks')}\n```\n",
            f"{len(genomes)} controllers, which as many trials of best.yaml ended with, in {tests} tests of each with "
            "each team in the paper's world.\n",
            *section_of_failures(genomes, "sprung", tests),
            *section_of_gaps(genomes, few),
            *section_of_pairs(names, genomes, few),
            "## With rigid bumpers\n",
            "A rigid robot does not get into the gap, but can be caught before it.\n",
            *section_of_failures(genomes, "rigid", tests),
            *section_of_corners(names, genomes, few),
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("--tests", type=int, default=300, help="of each controller with each team")
    arguments = parser.parse_args()
    print(page(arguments.files, arguments.tests), end="")


if __name__ == "__main__":
    main()

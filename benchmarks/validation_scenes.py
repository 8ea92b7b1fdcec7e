# SPDX-License-Identifier: BSD-3-Clause
"""What the parts of the validation share: scenes, wheel commands, statistics, tables and figures."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Collection, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Literal, NamedTuple, TypeVar

import matplotlib as mpl
import numpy as np
from numpy.typing import ArrayLike

from benchmarks.cases import changed
from swarmevo.config import Config
from swarmevo.protocols import FeedForward, FloatArray
from swarmevo.simulation import EpisodeKey, Episodes, Scene, library_info, simulate

mpl.use("Agg")
from matplotlib.figure import Figure  # after the choice of the backend

Drive = Literal["driven_contacts", "articulated"]
TIME_STEPS: dict[Drive, tuple[float, ...]] = {
    "driven_contacts": (0.001, 0.005, 0.01, 0.02, 0.025, 0.05),
    "articulated": (0.001, 0.002, 0.004),
}
"""The steps from 1 ms to a drive's largest that divide the default control period [s]."""
DRIVES = tuple(TIME_STEPS)
NORTH = np.pi / 2
Pose = tuple[float, float, float]
AWAY: Pose = (0.35, 0.38, 0.0)
"""A box that is in nobody's way."""

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


class Settings(NamedTuple):
    """How much to measure."""

    episodes: int = 10_000
    """Of the stress test."""
    pairs: int = 1_000
    """Episodes that are compared in distribution."""
    scenes: int = 10_000
    """Random scenes for the sensors."""
    threads: int = 2


class Section(NamedTuple):
    """A part of the page: its Markdown, and its figures by file name."""

    text: str
    figures: dict[str, Figure]


# ---- scenes ----------------------------------------------------------------------------------------------------------


def without_noise(config: Config) -> Config:
    """Return the config with exact sensors, wheels and start poses."""
    silence = dict.fromkeys(("infrared", "infrared_at_contact", "wheels", "rf"), 0.0)
    return changed(config, noise=silence, team={"start_jitter": (0.0, 0.0)})


def traction() -> float:
    """Return what a robot can push with: ``mu m g / (1 + mu h / a)`` [N].

    The friction, a height ``h`` below the centre of mass, presses a caster to the floor, ``a`` from the axle, and takes
    that load off the wheels.
    """
    physics, robot = Config().physics, Config().robot
    mu = physics.wheel_friction
    return mu * robot.mass * physics.gravity / (1 + mu * robot.centre_of_mass / robot.caster_offset)


def standing(poses: Sequence[Pose], config: Config | None = None) -> Config:
    """Return a config without noise whose robots start at the given poses."""
    team = {"robots": len(poses), "start": "poses", "start_poses": tuple(poses)}
    return changed(without_noise(config or Config()), team=team)


def wheels(commands: ArrayLike) -> FeedForward:
    """Return one network for each command ``(n, 2)`` in [-1, 1] that gives it whatever it senses."""
    targets = np.clip(np.asarray(commands, dtype=float), -1 + 1e-15, 1 - 1e-15)
    n = len(targets)
    outputs = np.zeros((n, 2, 2))
    outputs[:, :, 1] = np.arctanh(targets)
    return FeedForward(np.zeros((n, 1, 14)), outputs, np.zeros((n, 1), dtype=bool))


def random_networks(n: int, seed: int, forward: float = 0.0) -> FeedForward:
    """Return networks of up to 15 hidden neurons with normal weights; ``forward`` is added to the wheels' biases."""
    rng = np.random.default_rng(seed)
    outputs = rng.normal(size=(n, 2, 16))
    outputs[:, :, -1] += forward
    return FeedForward(rng.normal(size=(n, 15, 14)), outputs, rng.random((n, 15)) < 0.5)


def keys(n: int, seed: int = 1, first: int = 0) -> list[EpisodeKey]:
    """Return the keys of ``n`` episodes, counted from ``first``."""
    return [EpisodeKey(seed, trial=0, generation=i // 65536, repeat=i % 65536) for i in range(first, first + n)]


def drive(config: Config, commands: ArrayLike, channels: Collection[str] = (), episodes: int = 1) -> Episodes:
    """Run episodes in which each robot keeps its command ``(robots, 2)``.

    Raises:
        RuntimeError: An episode failed.
    """
    policies = wheels(commands)
    drivers = np.tile(np.arange(len(policies), dtype=np.uint32), (episodes, 1))
    return sound(simulate(Scene(config), policies, keys(episodes), drivers, channels))


def sound(done: Episodes) -> Episodes:
    """Return the episodes.

    Raises:
        RuntimeError: One of them failed.
    """
    for message in done.messages:
        if message:
            raise RuntimeError(message)
    return done


def in_parallel(work: Callable[[_Item], _Result], items: Iterable[_Item], threads: int) -> list[_Result]:
    """Return the results in the items' order. The library works while Python waits, so threads suffice."""
    library_info()  # loads the library before threads race to do so
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(work, items))


def millimetres(metres: float) -> float:
    """Return a length in [mm]."""
    return 1000 * metres


# ---- statistics ------------------------------------------------------------------------------------------------------


def turn(angle: ArrayLike) -> FloatArray:
    """Return angles [rad] reduced to [-pi, pi)."""
    return np.asarray((np.asarray(angle) + np.pi) % (2 * np.pi) - np.pi)


def ks_distance(first: ArrayLike, second: ArrayLike) -> float:
    """Return the Kolmogorov-Smirnov distance: the largest difference of two samples' cumulative distributions."""
    a, b = np.sort(np.ravel(first)), np.sort(np.ravel(second))
    everywhere = np.concatenate([a, b])
    below_a = np.searchsorted(a, everywhere, side="right") / len(a)
    below_b = np.searchsorted(b, everywhere, side="right") / len(b)
    return float(np.abs(below_a - below_b).max())


# ---- the page --------------------------------------------------------------------------------------------------------


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table; numbers to the right."""
    lines = [[str(cell) for cell in row] for row in rows]
    rules = ["---:" if all(_is_number(line[i]) for line in lines) else "---" for i in range(len(head))]
    return "\n".join("| " + " | ".join(line) + " |" for line in [list(head), rules, *lines]) + "\n"


def wrapped(text: str) -> str:
    """Return Markdown with its paragraphs and list items filled; tables, headings and images stay as they are."""
    return "\n\n".join(map(_filled, text.strip().split("\n\n"))) + "\n"


def _filled(block: str) -> str:
    if block.startswith(("|", "#", "!", "<")):
        return block
    items = re.split(r"\n(?=- )", block)
    indent = "  " if block.startswith("- ") else ""
    return "\n".join(
        textwrap.fill(item, 120, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
        for item in items
    )


def _is_number(cell: str) -> bool:
    return not cell or cell[0] in "-<0123456789"


def save(figures: dict[str, Figure], folder: Path) -> None:
    """Write the figures as PNG files, without the date or version that would change their bytes."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, figure in figures.items():
        figure.savefig(folder / name, dpi=110, metadata={"Software": None})

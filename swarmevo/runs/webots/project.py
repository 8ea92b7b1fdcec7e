# SPDX-License-Identifier: BSD-3-Clause
"""The files of a Webots project."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from swarmevo.config import Config, Surroundings, surroundings
from swarmevo.errors import OutputError
from swarmevo.protocols import FloatArray
from swarmevo.runs import files
from swarmevo.runs.networks import template
from swarmevo.runs.webots.tables import Infrared
from swarmevo.runs.webots.world import WALL, basic_time_step, world
from swarmevo.simulation.lockstep import Lockstep

PIXELS: Final = 1024
"""Of the floor's image, each way: a power of two, as textures want."""


def write(folder: Path, config: Config, title: str, programs: Sequence[str], infrared: Infrared = "evolved") -> None:
    """Write a project: a world, a controller for each program, the sources' program, the floor, a README.

    The start is that of the episode with the run's seed, trial, generation and repeat 0.

    Args:
        folder: To make; it is empty if it is there.
        config: Of the run.
        title: One line.
        programs: C99 of the controller that all robots have, or of each robot's.
        infrared: Which lookup table the world's infrared sensors have.

    Raises:
        ExportError: Webots has no such thing.
        OutputError: The folder is not empty, or cannot be written.
        SimulatorError: The episode cannot begin.
    """
    names = ["swarmevo"] if len(programs) == 1 else [f"swarmevo_{i}" for i in range(len(programs))]
    of_robots = names if len(names) > 1 else names * config.team.robots
    poses, movables = _start(config)
    text = {
        "worlds/swarmevo.wbt": world(config, title, poses, movables, of_robots, infrared),
        **{f"controllers/{name}/{name}.c": program for name, program in zip(names, programs, strict=True)},
        "controllers/swarmevo_source/swarmevo_source.c": template("webots/source").substitute(),
        **{f"controllers/{name}/Makefile": _makefile() for name in (*names, "swarmevo_source")},
        "README.md": _readme(config, title, infrared),
    }
    with files.folder_made(folder):
        if any(folder.iterdir()):
            raise OutputError(f"{folder}: expected a folder that is empty or not there; choose another name")
        for name, content in text.items():
            with files.folder_made((folder / name).parent):
                files.write(folder / name, content)
        with files.written(folder / "worlds" / "floor.png") as file:
            _paint(config, file)


def _makefile() -> str:
    return template("webots/Makefile", suffix="").template


def _start(config: Config) -> tuple[FloatArray, FloatArray]:
    with Lockstep(config, worlds=1, seed=config.evolution.seed or 0) as lockstep:
        state = lockstep.state()
        return state.channels["pose"][0], state.channels["movables"][0]


def _paint(config: Config, file: Path) -> None:
    """Write the floor's image, as far as the walls' outer faces: north is up."""
    from PIL import Image

    west, east, south, north = config.arena.bounds
    size = max(east - west, north - south) + 2 * WALL
    at = (np.arange(PIXELS) + 0.5) / PIXELS * size - size / 2
    places = np.stack(np.meshgrid((west + east) / 2 + at, (south + north) / 2 - at), axis=-1)
    grey = np.round(255 * _grey(surroundings(config), places)).astype(np.uint8)
    Image.fromarray(np.repeat(grey[..., np.newaxis], 3, axis=-1)).save(file, format="PNG")


def _grey(scene: Surroundings, places: FloatArray) -> FloatArray:
    """Return ``(...)``: the grey of the floor at places; of patches that overlap the later one is on top."""
    grey: FloatArray = np.full(places.shape[:-1], scene.grey)
    for patch in scene.patches:
        x, y, heading = patch.pose
        dx, dy = places[..., 0] - x, places[..., 1] - y
        along, across = np.cos(heading) * dx + np.sin(heading) * dy, np.cos(heading) * dy - np.sin(heading) * dx
        length, width = patch.size
        is_within = (
            np.hypot(dx, dy) <= length / 2
            if patch.shape == "cylinder"
            else (np.abs(along) <= length / 2) & (np.abs(across) <= width / 2)
        )
        grey[is_within] = patch.grey
    return grey


def _readme(config: Config, title: str, infrared: Infrared) -> str:
    period = round(1000 * config.episode.control_period)
    return template("webots/README", suffix=".md").substitute(
        title=title, step=str(basic_time_step(config)), period=str(period), infrared=infrared
    )

# SPDX-License-Identifier: BSD-3-Clause
"""Episodes side by side, a control step at a time, with a controller written in Python."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from swarmevo.errors import InvalidArgument
from swarmevo.protocols import COMMANDS, OBSERVATIONS, FloatArray, PythonController
from swarmevo.simulation._ffi import check, load
from swarmevo.simulation.episodes import Buffers, EpisodeKey, Episodes, create_batch, native_episodes
from swarmevo.simulation.scene import Scene


def simulate_lockstep(
    scene: Scene,
    controller: PythonController,
    genomes: FloatArray,
    episodes: Sequence[EpisodeKey],
    channels: Collection[str] = (),
    threads: int = 1,
) -> Episodes:
    """Run episodes side by side, a control step at a time, with a controller written in Python.

    Args:
        scene: The world.
        controller: Sees all robots of all episodes at once.
        genomes: ``(len(episodes), robots, size)``: given to the controller.
        episodes: One key for each episode.
        channels: Telemetry to record: keys of ``CHANNELS``.
        threads: Worker threads, 1 to 1024.

    Raises:
        InvalidArgument: A size or channel is wrong, or the controller's commands have a wrong shape.
        SimulatorError: The library failed as a whole. An episode that fails alone has its ``status`` set instead.
    """
    ffi, lib = load()
    n, robots = len(episodes), scene.info.robots
    if genomes.shape[:2] != (n, robots):
        raise InvalidArgument(f"genomes: expected shape ({n}, {robots}, size), got {genomes.shape}")
    buffers = Buffers(scene, n, channels)
    batch = create_batch(scene, threads)
    channels_wanted = buffers.native_channels
    check(lib.swe_lockstep_begin(batch, channels_wanted, len(channels_wanted), native_episodes(episodes), n))
    controller.start(genomes)
    for _ in range(scene.info.control_steps):
        observations = np.empty((n, robots, OBSERVATIONS))
        check(lib.swe_lockstep_observe(ffi.from_buffer("double[]", observations), observations.size, batch))
        commands = np.ascontiguousarray(controller.act(observations), dtype=np.float64)
        if commands.shape != (n, robots, COMMANDS):
            raise InvalidArgument(f"commands: expected shape {(n, robots, COMMANDS)}, got {commands.shape}")
        check(lib.swe_lockstep_advance(batch, ffi.from_buffer("double[]", commands), commands.size))
    check(lib.swe_lockstep_end(buffers.outcomes, buffers.homing_pointer(), batch))
    return buffers.collect(scene, batch)

# SPDX-License-Identifier: BSD-3-Clause
"""Genomes, scenes and telemetry that plugins are tested with."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from swarmevo import config
from swarmevo.config import Config, Episode, Team
from swarmevo.protocols import CHANNELS, Block, Channel, FloatArray, GenomeSpace, SceneInfo, Telemetry
from swarmevo.testing.checks import frozen

CHROMOSOME = GenomeSpace(
    (
        Block("input_hidden", (4, 3), units="hidden", linked="input"),
        Block("hidden_output", (2, 5), unit_axis=1, units="hidden", linked="output"),
        Block("hidden_switch", (4,), "switch", units="hidden", linked="input"),
    )
)
"""A small network, as the built-in controller lays it out."""

BOUNDED = GenomeSpace(
    (Block("weights", (3,)), Block("delays", (2,), bounds=(0.5, 4.0)), Block("gain", (1,), bounds=(0, np.inf)))
)
"""A space with genes that have bounds."""
SPACES = (CHROMOSOME, GenomeSpace((Block("weights", (7,)),)), CHROMOSOME.tile(2), BOUNDED)
"""Genomes that an optimiser must be able to drive: with and without switches, of a team, and with bounds."""


def random_genomes(space: GenomeSpace, n: int, seed: int = 0) -> FloatArray:
    """Return ``(n, size)``: real genes from N(0, 1), or anywhere between their bounds; switches on or off."""
    rng = np.random.default_rng(seed)
    genomes = rng.standard_normal((n, space.size))
    genomes[:, space.is_switch] = rng.random((n, int(space.is_switch.sum()))) < 0.5
    low, high = space.bounds
    between = np.isfinite(low) & np.isfinite(high)
    genomes[:, between] = rng.uniform(low[between], high[between], (n, int(between.sum())))
    within: FloatArray = np.clip(genomes, low, high)
    return within


def scene_of(robots: int, control_steps: int) -> SceneInfo:
    """Return the default scene with so many robots and control steps of 0.1 s."""
    return config.scene_info(Config(team=Team(robots=robots), episode=Episode(horizon=0.1 * control_steps)))


def scene_in(source: str | Path | Config, control_steps: int = 200) -> SceneInfo:
    """Return the scene of a configuration, for plugins that are for certain worlds, with so many control steps.

    Args:
        source: A YAML file, the name of a packaged configuration, or a configuration.
        control_steps: Of an episode.

    Raises:
        ConfigError: With everything that is wrong.
    """
    chosen = source if isinstance(source, Config) else config.load(source)
    period = config.scene_info(chosen).control_period
    return config.scene_info(config.changed(chosen, [f"episode.horizon={control_steps * period!r}"]))


def random_telemetry(
    channels: Sequence[str],
    episodes: int,
    steps: int = 20,
    robots: int = 5,
    seed: int = 0,
    scene: SceneInfo | None = None,
) -> Telemetry:
    """Return telemetry of no real episode, every value in its range; without the channels not asked for.

    Its world is the default one with so many ``robots`` and ``steps`` of 0.1 s, or that of ``scene``.
    """
    rng, scene = np.random.default_rng(seed), scene or scene_of(robots, steps)
    steps, period = scene.control_steps, scene.control_period

    def draw(channel: Channel) -> FloatArray:
        values = rng.uniform(channel.low, channel.high, size=(episodes, steps, *channel.sizes(scene)))
        return np.round(values) if channel.is_flag else values

    def some_time(*shape: int) -> FloatArray:
        return np.where(rng.random(shape) < 0.5, np.nan, rng.uniform(0.0, period * steps, shape))

    recorded = {name: frozen(draw(CHANNELS[name])) for name in channels}
    return Telemetry(
        period,
        frozen(some_time(episodes, scene.robots)),
        frozen(some_time(episodes)),
        channels=recorded,
        world=scene.world,
    )

# SPDX-License-Identifier: BSD-3-Clause
"""Episodes of one individual, simulated just now and judged, with all their telemetry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from swarmevo.config import Config
from swarmevo.errors import EvaluationError
from swarmevo.plugins.team import Team
from swarmevo.protocols import CHANNELS, FloatArray, Objective, Telemetry
from swarmevo.simulation import EpisodeKey, Episodes


@dataclass(frozen=True)
class Recording:
    """k episodes of one individual, with every channel, to the end of the longest."""

    config: Config
    """They were simulated in."""
    genes: FloatArray
    """``(size,)``: of the robots, or, where each has its own genome, of the team."""
    keys: tuple[EpisodeKey, ...]
    """``k``"""
    episodes: Episodes
    objectives: tuple[Objective, ...]
    """m, of all fitness functions."""
    values: FloatArray
    """``(k, m)``: as measured, each in its own direction."""
    terms: Mapping[str, FloatArray]
    """Parts of an objective, ``(k, steps)`` each, NaN after an episode's end; none, if no fitness explains itself."""
    explained: int
    """Number of that objective."""
    complexity: float
    """Hidden neurons in use."""

    def __len__(self) -> int:
        return len(self.keys)

    def __repr__(self) -> str:
        means = (f"{o.name} {value:.4g}" for o, value in zip(self.objectives, self.values.mean(axis=0), strict=True))
        episodes = f"{len(self)} episode{'s' * (len(self) != 1)}"
        return f"<{episodes} of {self.config.team.robots} robots: {', '.join(means)}>"

    @property
    def telemetry(self) -> Telemetry:
        """All channels."""
        return self.episodes.telemetry

    @property
    def best(self) -> int:
        """The episode in which the box was at the wall soonest, else that in which most robots were at the source."""
        pushed = self.telemetry.push_time
        if np.isfinite(pushed).any():
            return int(np.nanargmin(pushed))
        return int(np.isfinite(self.telemetry.homing_time).sum(axis=1).argmax())


def record(config: Config, genes: FloatArray, keys: Sequence[EpisodeKey], threads: int = 0) -> Recording:
    """Run episodes of one individual, keep their telemetry and judge them.

    Args:
        config: Of the run, or with another world or team.
        genes: ``(size,)``: of the robots, or, where each has its own genome, of the team.
        keys: One for each episode.
        threads: 0: one for each processor.

    Raises:
        EvaluationError: An episode or a fitness function failed.
        PluginError: A plugin cannot be made.
        SimulatorError: The library refuses the scene.
    """
    team = Team(config)
    episodes = simulate(team, genes, keys, threads)
    everybody = np.tile(genes, (len(keys), 1))
    explained, terms = _terms(team, episodes)
    return Recording(
        config=config,
        genes=genes,
        keys=tuple(keys),
        episodes=episodes,
        objectives=tuple(team.objectives),
        values=np.array([team.judge(episodes, everybody, i) for i in range(len(keys))]),
        terms=terms,
        explained=explained,
        complexity=float(team.complexity(genes[np.newaxis])[0]),
    )


def simulate(
    team: Team,
    genes: FloatArray,
    keys: Sequence[EpisodeKey],
    threads: int = 0,
    channels: Sequence[str] = tuple(CHANNELS),
) -> Episodes:
    """Run episodes of one individual and keep some channels; as :func:`record`, without judging them.

    Raises:
        EvaluationError: An episode failed.
    """
    everybody = np.tile(genes, (len(keys), 1))
    done = _to_the_end(team.simulate(everybody, keys, channels, threads))
    for key, status, message in zip(keys, done.status, done.messages, strict=True):
        if status:
            raise EvaluationError(f"{key}: the episode failed: {message}")
    return done


def _to_the_end(episodes: Episodes) -> Episodes:
    """Return the episodes without the steps that none of them has."""
    longest = int(episodes.steps.max(initial=0))
    channels = {name: channel[:, :longest] for name, channel in episodes.telemetry.channels.items()}
    return replace(episodes, telemetry=replace(episodes.telemetry, channels=channels))


def _terms(team: Team, episodes: Episodes) -> tuple[int, Mapping[str, FloatArray]]:
    """Return the parts of an objective in all episodes, and that objective's number."""
    explained, each = 0, []
    for i in range(len(episodes)):
        explained, parts = team.terms(episodes, i)
        each.append(parts)
    longest = int(episodes.steps.max(initial=0))
    terms = {name: np.full((len(each), longest), np.nan) for name in (each[0] if each else {})}
    for i, parts in enumerate(each):
        for name, part in parts.items():
            terms[name][i, : len(part)] = part
    return explained, terms

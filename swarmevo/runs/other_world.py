# SPDX-License-Identifier: BSD-3-Clause
"""A run's configuration with another world or team: what its controllers can meet without becoming others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

from swarmevo import config, simulation
from swarmevo.config import WORLD, Config, Worlds
from swarmevo.errors import ConfigError
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.protocols import FloatArray
from swarmevo.runs import made_for
from swarmevo.runs.store import Store
from swarmevo.simulation import EpisodeKey

FIXED: Final = {
    "team.robots": "choose the team's size with --robots, in Python with robots",
    "team.genomes": "the stored genomes are of the run's kind of team",
}
"""Keys of the world that may not be changed, and why."""


def test_world(settings: Config) -> Config:
    """Return the configuration in which controllers are tested: to the horizon, in the one world of its sections.

    What ``worlds`` and ``vary`` say of evolution is left out.
    """
    episode = settings.episode.model_copy(update={"until": "horizon"})
    return one_world(settings).model_copy(update={"episode": episode})


def one_world(settings: Config) -> Config:
    """Return the configuration without what ``worlds`` and ``vary`` say."""
    return settings.model_copy(update={"worlds": (), "vary": {}})


def ineffective(overrides: Sequence[str]) -> list[str]:
    """Return one line for each override that changes nothing where controllers of no run are tested."""
    expected = f"a key of the world ({', '.join(WORLD)}), controller, fitness or evolution.seed"
    keys = {override: override.partition("=")[0].strip() for override in overrides}
    return [
        f"--set {override}: expected {expected}; nothing else has an effect on tests"
        for override, key in keys.items()
        if key.partition(".")[0] in ("worlds", "vary", "optimiser", "evolution") and key != "evolution.seed"
    ]


def of_episode(settings: Config, key: EpisodeKey) -> Config:
    """Return the configuration of a stored episode: in its world, what varies as it was drawn."""
    return Worlds(settings).of_episode(*key, simulation.scene_errors)


def load(store: Store, overrides: Sequence[str]) -> Config:
    """Return the configuration for tests (:func:`test_world`) with other settings; the run itself is not changed.

    Args:
        store: The run.
        overrides: ``section.key=value``, of the world.

    Raises:
        ConfigError: With everything that is wrong.
        EvaluationError, PluginError, SimulatorError: The run's plugins cannot be made.
    """
    settings = test_world(store.config)
    if not overrides:
        return settings
    other = changed(settings, overrides, FIXED)
    with Evaluator(store.config, workers=1) as run, Evaluator(other, workers=1) as here:
        if run.space != here.space:
            raise ConfigError(f"--set {' '.join(overrides)}: expected the run's genome, got a controller of another")
    made_for.check_period(f"--set {' '.join(overrides)}", settings.episode.control_period, other)
    return other


def changed(settings: Config, overrides: Sequence[str], fixed: Mapping[str, str] = MappingProxyType({})) -> Config:
    """Return a controller's configuration with another world.

    Args:
        settings: The configuration.
        overrides: ``section.key=value``
        fixed: Keys of the world that may not be changed, and why.

    Raises:
        ConfigError: With everything that is wrong; a key that is none of the world's is.
    """
    if refused := [line for line in (_refusal(override, fixed) for override in overrides) if line]:
        raise ConfigError(*refused)

    def errors(found: config.Config) -> list[str]:
        wrong = config.sense_errors(settings, found) + simulation.scene_errors(found)
        return wrong or config.idle_errors(found, overrides)

    return config.changed(settings, overrides, errors)


def _refusal(override: str, fixed: Mapping[str, str]) -> str:
    """Return what is wrong with changing this key, one line; "" if nothing is."""
    key = override.partition("=")[0].strip()
    section, dot, _ = key.partition(".")
    if key in fixed:
        return f"--set {override}: expected another key; {fixed[key]}"
    if section in WORLD and (dot or not fixed):  # a whole section has the fixed keys, too
        return ""
    return f"--set {override}: expected a key of the world ({', '.join(WORLD)}); all else is as it was evolved"


def changes(run: Config, other: Config) -> list[str]:
    """Return what ``other`` has changed of a run's configuration for tests, key by key, in words."""
    evolved = test_world(run).model_dump()
    return [
        f"{section}.{key} {_shown(value)} (evolved with {_shown(evolved[section][key])})"
        for section in WORLD
        for key, value in other.model_dump()[section].items()
        if value != evolved[section][key]
    ]


def _shown(value: object) -> str:
    return str(list(value)) if isinstance(value, tuple) else str(value)


# ---- teams of other sizes --------------------------------------------------------------------------------------------


def of_size(settings: Config, robots: int) -> Config:
    """Return the configuration with a team of another size; it stands in the same row, or on the first poses.

    Raises:
        ConfigError: Each robot has a genome of its own, and there are too few.
    """
    team = settings.team
    if team.has_own_genomes and robots > team.robots:
        raise ConfigError(f"robots: expected at most {team.robots}, for each has its own genome, got {robots}")
    resized = team.model_copy(update={"robots": robots, "start_poses": team.start_poses[:robots]})
    return settings.model_copy(update={"team": resized})


def first_robots(settings: Config, genomes: FloatArray, evolved_robots: int) -> FloatArray:
    """Return of ``genomes`` ``(..., size)`` what a team needs: where each robot has its own, those of the first."""
    if not settings.team.has_own_genomes:
        return genomes
    return genomes[..., : genomes.shape[-1] // evolved_robots * settings.team.robots]


def team_of(settings: Config, genes: FloatArray, robots: int) -> tuple[Config, FloatArray]:
    """Return the configuration and the genes ``(size,)`` of an individual for a team of another size.

    Raises:
        ConfigError: As :func:`of_size`.
    """
    resized = of_size(settings, robots)
    return resized, first_robots(resized, genes, settings.team.robots)

# SPDX-License-Identifier: BSD-3-Clause
"""What an experiment is: every key with its range and default, read from YAML, checked, written back."""

from swarmevo.config.messages import did_you_mean
from swarmevo.config.models import (
    LIGHT,
    WORLD,
    Arena,
    Box,
    Config,
    Emitter,
    Episode,
    Evolution,
    Goal,
    Movable,
    Noise,
    Obstacle,
    Patch,
    Physics,
    Robot,
    Section,
    Sensors,
    Surroundings,
    Team,
    surroundings,
    world,
)
from swarmevo.config.observations import scene_info, sense_errors, smallest_observation
from swarmevo.config.overrides import as_overrides, sets
from swarmevo.config.reading import changed, dump, load, packaged, seeded
from swarmevo.config.unread import idle_errors
from swarmevo.config.worlds import World, Worlds, each_world, world_errors
from swarmevo.errors import ConfigError

__all__ = [
    "LIGHT",
    "WORLD",
    "Arena",
    "Box",
    "Config",
    "ConfigError",
    "Emitter",
    "Episode",
    "Evolution",
    "Goal",
    "Movable",
    "Noise",
    "Obstacle",
    "Patch",
    "Physics",
    "Robot",
    "Section",
    "Sensors",
    "Surroundings",
    "Team",
    "World",
    "Worlds",
    "as_overrides",
    "changed",
    "did_you_mean",
    "dump",
    "each_world",
    "idle_errors",
    "load",
    "packaged",
    "scene_info",
    "seeded",
    "sense_errors",
    "sets",
    "smallest_observation",
    "surroundings",
    "world",
    "world_errors",
]

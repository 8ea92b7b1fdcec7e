# SPDX-License-Identifier: BSD-3-Clause
"""What a genome was made for: what a robot observes and is told, and the controller that reads the genes.

Genes of another order of sensors, or of another activation, are as many: their number does not tell.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import zip_longest
from typing import Any

import numpy as np

from swarmevo.config import Config, scene_info
from swarmevo.errors import ConfigError, SwarmevoError
from swarmevo.plugins import default_options
from swarmevo.plugins.team import Team
from swarmevo.protocols import GenomeSpace, Recurrent


def check_exported(where: str, exported: Mapping[str, Any], config: Config, space: GenomeSpace) -> None:
    """Refuse an exported controller that was made for something else; what it does not tell is not asked for.

    Args:
        where: It is from, for the message.
        exported: As :func:`swarmevo.runs.export.controller` returns it, or a part of that.
        config: In which it is to act.
        space: Of an individual there.

    Raises:
        ConfigError: One line says what differs.
    """
    info = scene_info(config)
    for what, ours in (("observations", info.observation_names), ("commands", info.command_names)):
        theirs = exported.get(what)
        if theirs is not None:
            if not isinstance(theirs, list) or not all(isinstance(name, str) for name in theirs):
                raise ConfigError(f"{where}: {what}: expected a list of names, got something else")
            _check_names(where, what, theirs, ours)
    controller = exported.get("controller")
    if controller is not None:
        if not isinstance(controller, Mapping) or not [isinstance(one, Mapping) for one in controller.values()] == [
            True
        ]:
            raise ConfigError(f"{where}: controller: expected {{name: {{option: value}}}}, got something else")
        _check_controller(where, controller, config, space)
    scales = exported.get("scales")
    period = scales.get("control_period") if isinstance(scales, Mapping) else None
    if isinstance(period, float):
        check_period(where, period, config)


def check_run(where: str, run: Config, config: Config, space: GenomeSpace) -> None:
    """Refuse a run whose individuals were made for something else; arguments and errors as :func:`check_exported`."""
    theirs, ours = scene_info(run), scene_info(config)
    _check_names(where, "observations", theirs.observation_names, ours.observation_names)
    _check_names(where, "commands", theirs.command_names, ours.command_names)
    _check_controller(where, run.controller, config, space)
    check_period(where, run.episode.control_period, config)


def check_period(where: str, evolved: float, config: Config) -> None:
    """Refuse a controller that remembers its last control step where steps are of another length: it is another there.

    Args:
        where: It is from, for the message.
        evolved: The control period that it evolved with [s].
        config: In which it is to act.

    Raises:
        ConfigError: One line names both periods.
    """
    here = config.episode.control_period
    if not math.isclose(evolved, here) and _remembers_a_step(config):
        raise ConfigError(
            f"{where}: expected an episode.control_period of {evolved:g} s, with which the controller "
            f"{next(iter(config.controller))} was evolved, that remembers its last control step, got {here:g} s; set "
            "it to that, or evolve anew, say a ctrnn, whose time constants are in seconds"
        )


def _remembers_a_step(config: Config) -> bool:
    team = Team(config)
    policies = team.policies(np.clip(np.zeros(team.space.size), *team.space.bounds))
    return isinstance(policies, Recurrent) and policies.recurrence != "ctrnn"


def _check_names(where: str, what: str, theirs: Sequence[str], ours: Sequence[str]) -> None:
    for i, (there, here) in enumerate(zip_longest(theirs, ours, fillvalue="nothing")):
        if there != here:
            raise ConfigError(
                f"{where}: expected a controller for the {len(ours)} {what} of this configuration, got one for "
                f"{len(theirs)}, of which number {i} is {there:.60}, not {here}; "
                "take the robot.sensors and sensors that it was made for"
            )


def _check_controller(where: str, theirs: Mapping[str, Any], config: Config, space: GenomeSpace) -> None:
    ((name, given),) = config.controller.items()
    ((their_name, their_options),) = theirs.items()
    if their_name != name:
        raise ConfigError(
            f"{where}: expected genes of the controller {name}, got those of {their_name:.60}; set controller to that"
        )
    defaults = default_options("controller", name)
    for option in (*given, *(option for option in their_options if option not in given)):
        here, there = (options.get(option, defaults.get(option)) for options in (given, their_options))
        if here != there and not _is_laid_out_otherwise(config, name, {**given, option: there}, space):
            raise ConfigError(
                f"{where}: expected genes of a controller with {option} {here!r}, got {there!r:.60}, with which they "
                f"mean something else; set controller.{name}.{option}, or give the genes alone, as CSV"
            )


def _is_laid_out_otherwise(config: Config, name: str, options: dict[str, Any], space: GenomeSpace) -> bool:
    """Whether other options show in the genome's blocks, which are compared where they are read."""
    try:
        return Team(config.model_copy(update={"controller": {name: options}})).space != space
    except SwarmevoError:  # of a version with other options
        return False

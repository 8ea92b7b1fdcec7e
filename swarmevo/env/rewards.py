# SPDX-License-Identifier: BSD-3-Clause
"""Rewards: what the fitness functions of a configuration gain at each control step."""

from __future__ import annotations

import math
from collections.abc import Mapping
from numbers import Real

import numpy as np

from swarmevo.config import Config
from swarmevo.errors import InvalidArgument
from swarmevo.plugins.checked import CheckedFitness, check_together
from swarmevo.protocols import BoolArray, FloatArray, SceneInfo, Step


class Rewards:
    """Follows the episodes of worlds side by side.

    The rewards of an episode sum up to the weighted sum of its objectives, as evolution measures them, but for
    rounding; an objective that is minimised counts with the opposite sign.

    Args:
        config: Whose fitness plugins are asked.
        info: Of the scene.
        worlds: How many.
        weights: By objective; those not named are left out. None: 1 for each that is measured in an episode.

    Raises:
        EvaluationError: A plugin is not what it should be, or tells nothing before the end of an episode.
        InvalidArgument: A weight is no number, or of no such objective; or there is none.
        PluginError: A plugin cannot be made.
    """

    def __init__(self, config: Config, info: SceneInfo, worlds: int, weights: Mapping[str, float] | None) -> None:
        fitness = [CheckedFitness(name, options, info) for name, options in config.fitness.items()]
        every = [objective for one in fitness for objective in one.objectives]
        check_together(every, [descriptor for one in fitness for descriptor in one.descriptors])
        chosen = _weights(weights, [objective.name for objective in every if objective.of == "episode"])
        asked = [one for one in fitness if any(objective.name in chosen for objective in one.objectives)]
        objectives = [objective for one in asked for objective in one.objectives]
        self.channels = sorted({channel for one in asked for channel in one.channels})
        """What the fitness functions must be told of a step."""
        self._columns = {one.name: i for i, one in enumerate(objectives) if one.name in chosen}
        self._weights = np.array(
            [chosen.get(one.name, 0.0) * (1.0 if one.is_maximised else -1.0) for one in objectives]
        )
        self._followers = [one.stepwise(worlds) for one in asked]
        self._so_far = np.zeros((worlds, len(objectives)))

    def of(self, step: Step, moving: BoolArray) -> FloatArray:
        """Return the rewards ``(worlds,)`` of a step; 0 for worlds that are not ``moving``, whatever is told of them.

        Raises:
            EvaluationError: A plugin failed.
        """
        now = np.concatenate([follow(step) for follow in self._followers], axis=1)
        self._so_far[step.is_first & moving] = 0.0
        gains = np.where(moving[:, np.newaxis], now - self._so_far, 0.0)
        self._so_far[moving] = now[moving]
        rewards: FloatArray = (gains * self._weights).sum(axis=1)  # not @: the same bits beside any others
        return rewards

    def objectives(self, world: int) -> dict[str, float]:
        """Return what each objective with a weight has come to in a world's episode."""
        return {name: float(self._so_far[world, column]) for name, column in self._columns.items()}


def _weights(given: Mapping[str, float] | None, known: list[str]) -> dict[str, float]:
    """Return the weights that are not 0, by objective."""
    asked = dict.fromkeys(known, 1.0) if given is None else given
    if not isinstance(asked, Mapping):
        raise InvalidArgument(f"weights: expected a mapping of objectives to numbers, got {type(asked).__name__}")
    for name, weight in asked.items():
        if name not in known:
            raise InvalidArgument(f"weights: expected objectives among {', '.join(known) or 'none'}, got {name!r}")
        if not isinstance(weight, Real) or not math.isfinite(weight):
            raise InvalidArgument(f"weights: expected a finite number for {name}, got {weight!r}")
    chosen = {name: float(weight) for name, weight in asked.items() if weight}
    if not chosen:
        raise InvalidArgument(
            f"weights: expected one that is not 0 for an objective that is measured in an episode, of "
            f"{', '.join(known) or 'which fitness has none'}"
        )
    return chosen

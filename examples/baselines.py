# SPDX-License-Identifier: BSD-3-Clause
"""Controllers by hand for the tasks that come with swarmevo (docs/tasks.md).

Each is an actor as ``swarmevo.protocols.Actor`` has it: ``start(genomes)`` when episodes begin, whose genomes it does
not use, then at each control step ``act(observations)`` with ``(worlds, robots, observations)`` for speeds of the left
and the right wheel in [-1, 1]. All robots of all worlds are commanded at once; one does not know of the others.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np

from swarmevo.protocols import Actor, FloatArray, SceneInfo

LEFT_FRONT, RIGHT_FRONT = [5, 6, 7], [0, 1, 2]
"""Infrared rays of the default robot, from its left to its front and from its right (``sensors.infrared_yaw_deg``)."""


class Observed:
    """Readings by name: ``observed.infrared`` is ``(worlds, robots, rays)``."""

    def __init__(self, scene: SceneInfo, observations: FloatArray) -> None:
        names = scene.observation_names
        self._by_name = {name: observations[..., i] for i, name in enumerate(names)}

    def __getitem__(self, name: str) -> FloatArray:
        return self._by_name[name]

    def all(self, device: str) -> FloatArray:
        """Return the readings ``device_0``, ``device_1``, ... along the last axis."""
        return np.stack(
            [values for name, values in self._by_name.items() if name.rpartition("_")[0] == device], axis=-1
        )


def wheels(forward: FloatArray, turn: FloatArray) -> FloatArray:
    """Return commands that drive forward and turn to the left."""
    return np.clip(np.stack([forward - turn, forward + turn], axis=-1), -1, 1)


class Explorer:
    """Drives straight on; where it sees something ahead, turns away from it until it sees it no longer."""

    def __init__(self, scene: SceneInfo) -> None:
        self._scene = scene

    def start(self, genomes: FloatArray) -> None:
        self._side = np.zeros(genomes.shape[:2])  # where it turns to: 1 left, -1 right, 0 nowhere

    def act(self, observations: FloatArray) -> FloatArray:
        infrared = Observed(self._scene, observations).all("infrared")
        left, right = infrared[..., LEFT_FRONT].max(axis=-1), infrared[..., RIGHT_FRONT].max(axis=-1)
        is_ahead = infrared[..., [0, 1, 6, 7]].max(axis=-1) > 0.02
        self._side = np.where(is_ahead, np.where(self._side == 0, np.where(left > right, -1.0, 1.0), self._side), 0.0)
        return wheels(np.where(is_ahead, 0.0, 1.0), 0.5 * self._side)


class Homer(Explorer):
    """Explores until it hears the emitter; then drives on while the signal grows, and curves left while it falls."""

    def start(self, genomes: FloatArray) -> None:
        super().start(genomes)
        self._before = np.zeros(genomes.shape[:2])

    def act(self, observations: FloatArray) -> FloatArray:
        signal, exploring = Observed(self._scene, observations)["rf"], super().act(observations)
        is_falling, self._before = signal < self._before, signal
        is_heard = (signal > 0.1) & (self._side == 0)
        homing = wheels(np.ones_like(signal), np.where(is_falling, 0.6, 0.0))
        return np.where(is_heard[..., np.newaxis], homing, exploring)


BASELINES: Final[Mapping[str, Callable[[SceneInfo], Actor]]] = {
    "coverage": Explorer,
    "localisation": Homer,
}
"""For each task, by its configuration's name, its controller."""

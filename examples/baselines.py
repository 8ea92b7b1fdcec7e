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

TOUCH_SIDE = np.array([1.0, 1 / 3, -1 / 3, -1.0])
"""Of the default robot's touch sensors: how far to its left, of the first's 45 degrees."""


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


def towards(ahead: FloatArray, left: FloatArray) -> FloatArray:
    """Return commands that turn and drive to what is at a bearing, of which cosine and sine are given."""
    turn = np.where(ahead > 0, 0.5 * left, np.where(left >= 0, 0.5, -0.5))
    return wheels(np.maximum(ahead, 0.0), turn)


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


class Sectors(Explorer):
    """Turns to where a device with sectors all round perceives something, and drives there; explores if it is nowhere.

    Sectors are weighted by what they read, or, ``alike``, all in which there is something count as much.
    """

    def __init__(self, scene: SceneInfo, device: str, alike: bool) -> None:
        super().__init__(scene)
        self._device, self._alike = device, alike

    def act(self, observations: FloatArray) -> FloatArray:
        readings, exploring = Observed(self._scene, observations).all(self._device), super().act(observations)
        bearings = 2 * np.pi / readings.shape[-1] * np.arange(readings.shape[-1])
        weights = np.sign(readings) if self._alike else readings
        ahead, left = (weights * np.cos(bearings)).sum(axis=-1), (weights * np.sin(bearings)).sum(axis=-1)
        length = np.hypot(ahead, left)
        is_somewhere = length > 1e-9
        ahead, left = (np.divide(part, length, out=np.zeros_like(part), where=is_somewhere) for part in (ahead, left))
        return np.where(is_somewhere[..., np.newaxis], towards(ahead, left), exploring)


class Forager(Explorer):
    """Explores; pushes home what it touches, and turns after it where it slips off; turns away where home is behind."""

    def start(self, genomes: FloatArray) -> None:
        super().start(genomes)
        self._puck = np.zeros(genomes.shape[:2])  # where it was touched last: 1 on the left, -1 on the right
        self._pushing, self._leaving = (np.zeros(genomes.shape[:2]) for _ in range(2))  # control steps to go on with it

    def act(self, observations: FloatArray) -> FloatArray:
        observed = Observed(self._scene, observations)
        exploring, touch = super().act(observations), observed.all("touch")
        count, left = touch.sum(axis=-1), observed["rf_bearing_sin"]
        is_touching, is_behind = count > 0, observed["rf_bearing_cos"] < -0.5
        self._puck = np.where(is_touching, (touch * TOUCH_SIDE).sum(axis=-1) / np.maximum(count, 1), self._puck)
        self._pushing = np.where(is_behind, 0, np.where(is_touching, 11, np.maximum(self._pushing - 1, 0)))
        self._leaving = np.where(is_behind & is_touching, 15, np.maximum(self._leaving - 1, 0))

        # What is pushed off the middle goes to that side: so a puck on the left is one on its way to the left.
        turn = 0.8 * self._puck - np.where(is_touching, 0.3 * left, 0.0)
        pushing = wheels(np.full_like(turn, 0.7), turn)
        leaving = wheels(np.full_like(turn, -0.3), np.full_like(turn, 0.6))
        found = np.where((self._pushing > 0)[..., np.newaxis], pushing, exploring)
        return np.where((self._leaving > 0)[..., np.newaxis], leaving, found)


class Clearer(Explorer):
    """Drives to the nearest beacon, past robots beside it; turns square to the box that it touches, and pushes on."""

    def act(self, observations: FloatArray) -> FloatArray:
        observed = Observed(self._scene, observations)
        touch, infrared = observed.all("touch"), observed.all("infrared")
        aside = infrared[..., RIGHT_FRONT].max(axis=-1) - infrared[..., LEFT_FRONT].max(axis=-1)
        side = (touch * TOUCH_SIDE).sum(axis=-1)
        homing = towards(observed["rf_bearing_cos"], observed["rf_bearing_sin"])
        homing += 0.5 * aside[..., np.newaxis] * [-1, 1]
        pushing = wheels(np.full_like(side, 0.7), 0.3 * side + 0.15 * aside)
        return np.where((touch.max(axis=-1) > 0)[..., np.newaxis], pushing, homing)


class Pusher(Homer):
    """Homes in on the source above the box; pushes on at a face near it, and goes on round the box from a far one."""

    LEAVING = 40  # control steps away from a face: back at first, then in an arc

    def start(self, genomes: FloatArray) -> None:
        super().start(genomes)
        self._pushing, self._leaving = (np.zeros(genomes.shape[:2]) for _ in range(2))  # control steps to go on with it

    def act(self, observations: FloatArray) -> FloatArray:
        observed = Observed(self._scene, observations)
        homing, touch, signal = super().act(observations), observed.all("touch"), observed["rf"]
        is_touching = touch.max(axis=-1) > 0
        # The box moves away from the source: who has begun to push goes on while it touches.
        goes_on = is_touching & ((signal > 0.95) | (self._pushing > 0))
        self._pushing = np.where(goes_on, 10, np.maximum(self._pushing - 1, 0))
        is_wrong = is_touching & (self._pushing == 0) & (self._leaving == 0)
        self._leaving = np.where(is_wrong, self.LEAVING, np.maximum(self._leaving - 1, 0))

        pushing = wheels(np.full_like(signal, 0.7), 0.3 * (touch * TOUCH_SIDE).sum(axis=-1))
        is_backing = self._leaving > self.LEAVING - 8
        leaving = wheels(np.where(is_backing, -0.8, 0.8), np.where(is_backing, -0.4, 0.3))
        found = np.where((self._pushing > 0)[..., np.newaxis], pushing, homing)
        return np.where((self._leaving > 0)[..., np.newaxis], leaving, found)


BASELINES: Final[Mapping[str, Callable[[SceneInfo], Actor]]] = {
    "aggregation": lambda scene: Sectors(scene, "range_and_bearing", alike=True),
    "clearing": Clearer,
    "coverage": Explorer,
    "foraging": Forager,
    "localisation": Homer,
    "phototaxis": lambda scene: Sectors(scene, "light", alike=False),
    "paper": Pusher,
}
"""For each task, by its configuration's name, its controller."""

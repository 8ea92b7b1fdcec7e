# SPDX-License-Identifier: BSD-3-Clause
"""Shaped objectives in one number, for optimisers that want a single objective."""

from __future__ import annotations

import math

import numpy as np

from swarmevo.protocols import Controller, FloatArray, Follower, Objective, SceneInfo, Telemetry
from swarmevo_shaped.objectives import (
    Displacement,
    Explained,
    Homing,
    Nearness,
    Progress,
    Shaped,
    Speed,
    Success,
    Togetherness,
)


class WeightedMean:
    """The mean of the shaped objectives by their weights: each objective's plugin tells what it is.

    A weight of 0 leaves an objective out; one below 0 makes less of it better.

    Args:
        togetherness: Weight of ``togetherness``.
        progress: Weight of ``progress``.
        success: Weight of ``success``.
        speed: Weight of ``speed``.
        homing: Weight of ``homing``.
        nearness: Weight of ``nearness``.
        displacement: Weight of ``displacement``.
        needed: Option of ``togetherness``.
        power: Option of ``togetherness``.
        facing: Option of ``togetherness``.
        scene: See :class:`Shaped`.

    Raises:
        ValueError: An option is out of its range, all weights are 0, or there is nothing in the scene that an objective
            with a weight could measure.
    """

    def __init__(
        self,
        togetherness: float = 2.0,
        progress: float = 0.0,
        success: float = 1.0,
        speed: float = 0.0,
        homing: float = 0.0,
        nearness: float = 0.0,
        displacement: float = 0.0,
        needed: int = 3,
        power: float = 2.0,
        facing: float = 60.0,
        scene: SceneInfo | None = None,
    ) -> None:
        weighted: list[tuple[float, Shaped]] = [
            (togetherness, Togetherness(needed, power, facing)),
            (progress, Progress()),
            (success, Success()),
            (speed, Speed()),
            (homing, Homing()),
            (nearness, Nearness()),
            (displacement, Displacement()),
        ]
        for weight, one in weighted:
            if not isinstance(weight, (int, float)) or not math.isfinite(weight):
                raise ValueError(f"{one.name}: expected a finite number as weight, got {weight!r}")
        total = sum(abs(weight) for weight, _ in weighted)
        if total == 0:
            raise ValueError("togetherness: expected a weight that is not 0, of this objective or another")
        self._parts = [(weight / total, one) for weight, one in weighted if weight]
        if scene is not None:
            self._check(scene)
        self.channels = tuple(sorted({channel for _, one in self._parts for channel in one.channels}))
        low, high = (sum(limit(share, 0.0) for share, _ in self._parts) for limit in (min, max))
        self.objectives = (Objective("shaped", "maximise", (low, high)),)

    def _check(self, scene: SceneInfo) -> None:
        for _, one in self._parts:
            try:
                one.check(scene.world)
            except ValueError as error:
                raise ValueError(f"{one.name}: {error}") from error

    def evaluate(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> FloatArray:
        """Return ``(episodes, 1)``.

        Raises:
            ValueError: The telemetry has no world.
        """
        mean = np.zeros(len(telemetry.push_time))
        for share, one in self._parts:
            mean += share * one.values(telemetry)
        return mean[:, np.newaxis]

    def stepwise(self, worlds: int) -> Follower:
        """Return what tells the mean so far, ``(worlds, 1)``, step by step."""
        followers = [(share, one.follow(worlds)) for share, one in self._parts]
        return lambda step: np.sum([share * follow(step) for share, follow in followers], axis=0)[:, np.newaxis]

    def terms(self, telemetry: Telemetry) -> dict[str, FloatArray]:
        """Return the courses of the objectives that have one, ``(episodes, steps)``, times their shares."""
        return {one.name: share * one.course(telemetry) for share, one in self._parts if isinstance(one, Explained)}

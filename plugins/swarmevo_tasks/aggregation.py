# SPDX-License-Identifier: BSD-3-Clause
"""Aggregation: robots come together, wherever that is (Trianni 2008; Gauci et al. 2014)."""

from __future__ import annotations

from typing import Final

import numpy as np

from swarmevo.protocols import BoolArray, FloatArray, Follower, Step, Telemetry
from swarmevo_shaped.following import Total
from swarmevo_shaped.geometry import world_of
from swarmevo_shaped.objectives import Explained, Shaped
from swarmevo_tasks import geometry

ADJACENT: Final = 4.0
"""Robots of radius r whose centres are within ``4 r`` are adjacent: no other fits between them (Gauci et al. 2014)."""


class Aggregation(Explained):
    """How near the robots are to the middle of the team, over the time.

    That is 1 less their mean distance from the team's centroid (Trianni 2008), as a share of the radius of the circle
    around the arena.
    """

    name = "aggregation"
    channels = ("pose",)

    def course(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes, steps)``."""
        places = telemetry.pose[..., :2]
        away = places - places.mean(axis=-2, keepdims=True)
        distance = np.hypot(away[..., 0], away[..., 1]).mean(axis=-1)
        return np.asarray(np.clip(1 - distance / geometry.radius_of(world_of(telemetry)["arena"]), 0, 1))

    def values(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes,)``: mean over the time."""
        return np.asarray(self.course(telemetry).mean(axis=1))

    def follow(self, worlds: int) -> Follower:
        """Return what tells the sum so far over the horizon's control steps, at last over those of the episode."""
        total = Total()

        def follow(step: Step) -> FloatArray:
            steps = np.where(step.is_last, step.number + 1, step.horizon)
            return np.asarray(total(step, self.course(step.telemetry)[:, 0]) / steps)

        return follow


class LargestCluster(Shaped):
    """The share of robots that are in the largest cluster at the end (Gauci et al. 2014). A success: all are."""

    name = "largest_cluster"
    channels = ("pose",)
    success = 1.0

    def values(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes,)``: from 1 over the number of robots to 1."""
        return np.asarray(self._members(telemetry).mean(axis=-1))

    def behaviours(self, telemetry: Telemetry) -> dict[str, BoolArray]:
        """Return which robots are not in it."""
        return {"not in the largest cluster in the end": ~self._members(telemetry)}

    @staticmethod
    def _members(telemetry: Telemetry) -> BoolArray:
        """Return ``(episodes, robots)``: who is in the largest cluster at the end, of equal ones in one of them."""
        places = telemetry.pose[:, -1, :, :2]
        between = places[:, :, np.newaxis] - places[:, np.newaxis]
        linked = np.hypot(between[..., 0], between[..., 1]) <= ADJACENT * world_of(telemetry)["robot"]["radius"]
        for _ in range(places.shape[1].bit_length()):  # each time links that are twice as long
            linked = linked @ linked
        largest = linked.sum(axis=-1).argmax(axis=-1)
        return np.asarray(linked[np.arange(len(linked)), largest])

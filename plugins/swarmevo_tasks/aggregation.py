# SPDX-License-Identifier: BSD-3-Clause
"""Aggregation: robots come together, wherever that is (Trianni 2008; Gauci et al. 2014)."""

from __future__ import annotations

from typing import Final

import numpy as np

from swarmevo.protocols import FloatArray, Telemetry
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


class LargestCluster(Shaped):
    """The share of robots that are in the largest cluster at the end (Gauci et al. 2014)."""

    name = "largest_cluster"
    channels = ("pose",)

    def values(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes,)``: from 1 over the number of robots to 1."""
        places = telemetry.pose[:, -1, :, :2]
        between = places[:, :, np.newaxis] - places[:, np.newaxis]
        linked = np.hypot(between[..., 0], between[..., 1]) <= ADJACENT * world_of(telemetry)["robot"]["radius"]
        for _ in range(places.shape[1].bit_length()):  # each time links that are twice as long
            linked = linked @ linked
        return np.asarray(linked.sum(axis=-1).max(axis=-1) / places.shape[1])

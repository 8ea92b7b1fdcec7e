# SPDX-License-Identifier: BSD-3-Clause
"""What a behaviour is like, for optimisers that keep the best of each kind."""

from __future__ import annotations

import numpy as np

from swarmevo.protocols import Controller, Descriptor, FloatArray, SceneInfo, Telemetry
from swarmevo_shaped.geometry import steps_before_push


class BoxEnd:
    """Where the box is at the end, or when it touches the target wall; no objective.

    Args:
        scene: That of the episodes.

    Raises:
        ValueError: There is nothing to push in it.
    """

    objectives = ()
    channels = ("box",)

    def __init__(self, scene: SceneInfo) -> None:
        if not scene.movables:
            raise ValueError("scene: expected something to push, got no movables; choose another fitness")
        west, east, south, north = scene.arena
        self.descriptors = (Descriptor("box_end_x", (west, east)), Descriptor("box_end_y", (south, north)))

    def evaluate(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> FloatArray:
        """Return nothing, ``(episodes, 0)``."""
        return np.empty((len(genomes), 0))

    def describe(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> FloatArray:
        """Return x and y of the box's centre [m], ``(episodes, 2)``.

        They are those of the last control step before the push, whether the episode ends with it or goes on.
        """
        last = np.clip(steps_before_push(telemetry) - 1, 0, telemetry.box.shape[1] - 1)
        end: FloatArray = telemetry.box[np.arange(len(last)), last, :2]
        return end

# SPDX-License-Identifier: BSD-3-Clause
"""What a behaviour is like, for optimisers that keep the best of each kind."""

from __future__ import annotations

import numpy as np

from swarmevo.protocols import Controller, Descriptor, FloatArray, SceneInfo, Telemetry
from swarmevo_shaped.geometry import steps_before_push


class _End:
    """Where something is at the last control step before the push, whether the episode ends with it or goes on."""

    objectives = ()

    def __init__(self, what: str, scene: SceneInfo) -> None:
        west, east, south, north = scene.arena
        self.descriptors = (Descriptor(f"{what}_end_x", (west, east)), Descriptor(f"{what}_end_y", (south, north)))

    def evaluate(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> FloatArray:
        """Return nothing, ``(episodes, 0)``."""
        return np.empty((len(genomes), 0))


class BoxEnd(_End):
    """Where the box is at the end, or when it touches the target wall; no objective.

    Args:
        scene: That of the episodes.

    Raises:
        ValueError: There is nothing to push in it.
    """

    channels = ("box",)

    def __init__(self, scene: SceneInfo) -> None:
        if not scene.movables:
            raise ValueError("scene: expected something to push, got no movables; choose another fitness")
        super().__init__("box", scene)

    def describe(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> FloatArray:
        """Return x and y of the box's centre [m], ``(episodes, 2)``."""
        return _at_end(telemetry, telemetry.box)[:, :2]


class TeamEnd(_End):
    """Where the middle of the robots is at the end, or when the box touches the target wall; no objective.

    Args:
        scene: That of the episodes.
    """

    channels = ("pose",)

    def __init__(self, scene: SceneInfo) -> None:
        super().__init__("team", scene)

    def describe(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> FloatArray:
        """Return x and y of the mean of the robots' centres [m], ``(episodes, 2)``."""
        middle: FloatArray = _at_end(telemetry, telemetry.pose)[..., :2].mean(axis=1)
        return middle


def _at_end(telemetry: Telemetry, course: FloatArray) -> FloatArray:
    """Return what ``(episodes, steps, ...)`` is at each episode's end."""
    last = np.clip(steps_before_push(telemetry) - 1, 0, course.shape[1] - 1)
    end: FloatArray = course[np.arange(len(last)), last]
    return end

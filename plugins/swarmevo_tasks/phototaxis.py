# SPDX-License-Identifier: BSD-3-Clause
"""Phototaxis: robots drive to a light, or to another emitter, and stay."""

from __future__ import annotations

import numpy as np

from swarmevo.protocols import BoolArray, FloatArray, SceneInfo, Telemetry
from swarmevo_shaped.geometry import from_emitter, still_emitter
from swarmevo_shaped.objectives import Shaped


class Arrived(Shaped):
    """The share of robots that are near the emitter at the end. A success: all are.

    Args:
        within: How near its centre must be [m].
        scene: See :class:`swarmevo_shaped.objectives.Shaped`.

    Raises:
        ValueError: The option is out of its range, or the scene has not one emitter that stands still.
    """

    name = "arrived"
    channels = ("pose",)
    success = 1.0
    needs = (still_emitter,)

    def __init__(self, within: float = 0.2, scene: SceneInfo | None = None) -> None:
        super().__init__(scene)
        if not isinstance(within, (int, float)) or not 0 < within < np.inf:
            raise ValueError(f"within: expected a distance above 0 [m], got {within!r}")
        self._within = within

    def values(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes,)``."""
        return np.asarray(self._is_near(telemetry).mean(axis=-1))

    def behaviours(self, telemetry: Telemetry) -> dict[str, BoolArray]:
        """Return which robots are not."""
        return {"away from the emitter in the end": ~self._is_near(telemetry)}

    def _is_near(self, telemetry: Telemetry) -> BoolArray:
        distance, _ = from_emitter(telemetry)
        return np.asarray(distance[:, -1] <= self._within)

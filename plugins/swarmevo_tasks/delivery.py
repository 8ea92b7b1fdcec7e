# SPDX-License-Identifier: BSD-3-Clause
"""Delivery: movables are brought to goals. One that has been at a goal is delivered, wherever it goes from there."""

from __future__ import annotations

import numpy as np

from swarmevo.protocols import BoolArray, FloatArray, Telemetry
from swarmevo_shaped.geometry import check_delivery, has_pushed, steps_before_push, steps_of, world_of
from swarmevo_shaped.objectives import Explained
from swarmevo_tasks import geometry


class Delivered(Explained):
    """The share of the movables that have been at a goal."""

    name = "delivered"
    channels: tuple[str, ...] = ("at_goal",)
    needs = (check_delivery,)

    def course(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes, steps)``: the share so far."""
        return np.asarray(np.maximum.accumulate(telemetry.at_goal, axis=1).mean(axis=-1))

    def behaviours(self, telemetry: Telemetry) -> dict[str, BoolArray]:
        """Return which robots never touched a movable."""
        return {"never touched a movable": telemetry.touch.max(axis=(1, 3), initial=0) == 0}

    def values(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes,)``: the share at the end."""
        return np.where(has_pushed(telemetry), 1.0, self.course(telemetry)[:, -1])


class Delivery(Delivered):
    """The share of the movables that have been at a goal, over the time: the sooner, the better."""

    name = "delivery"

    def values(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes,)``: the mean over the horizon."""
        steps, before = steps_of(telemetry), steps_before_push(telemetry)
        means = [  # one episode at a time: an episode that ended at the last delivery has the same bits
            (one[:n].sum() + (steps - n)) / steps for one, n in zip(self.course(telemetry), before, strict=True)
        ]
        return np.array(means, dtype=np.float64)


class Transport(Delivered):
    """How much nearer the movables came to the nearest goals, as a share of their ways at the start; mean over them."""

    name = "transport"
    channels = ("movables", "at_goal")

    def course(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes, steps)``: at most so far; a movable that was delivered has come all its way."""
        world = world_of(telemetry)
        ways = np.stack(
            [
                geometry.way_to_goals(world, movable, telemetry.movables[:, :, i])
                for i, movable in enumerate(world["scene"]["movables"])
            ],
            axis=-1,
        )
        start = ways[:, :1]
        share = np.divide(start - ways, start, out=np.ones_like(ways), where=start > 0)
        come = np.maximum(share.clip(0, 1), telemetry.at_goal)
        return np.asarray(np.maximum.accumulate(come, axis=1).mean(axis=-1))

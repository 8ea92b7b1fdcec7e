# SPDX-License-Identifier: BSD-3-Clause
"""Delivery: movables are brought to goals. One that has been at a goal is delivered, wherever it goes from there."""

from __future__ import annotations

import numpy as np

from swarmevo.protocols import BoolArray, FloatArray, Follower, Step, Telemetry
from swarmevo_shaped.following import AtStart, Most, OverHorizon
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

    def follow(self, worlds: int) -> Follower:
        """Return what tells the share so far."""
        share = self._follow_course()
        return lambda step: np.where(has_pushed(step.telemetry), 1.0, share(step))

    def _follow_course(self) -> Follower:
        """Return what tells the course, step by step."""
        most = Most()
        return lambda step: most(step, step.telemetry.at_goal[:, 0]).mean(axis=-1)


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

    def follow(self, worlds: int) -> Follower:
        """Return what tells the sum so far over the horizon's control steps; at the last delivery all that is left."""
        share, mean = self._follow_course(), OverHorizon(rest=1.0)
        return lambda step: mean(step, share(step))


class Transport(Delivered):
    """How much nearer the movables came to the nearest goals, as a share of their ways at the start; mean over them."""

    name = "transport"
    channels = ("movables", "at_goal")

    def course(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes, steps)``: at most so far; a movable that was delivered has come all its way."""
        ways = _ways(telemetry)
        come = _come(telemetry, ways, ways[:, :1])
        return np.asarray(np.maximum.accumulate(come, axis=1).mean(axis=-1))

    def _follow_course(self) -> Follower:
        start, most = AtStart(), Most()

        def course(step: Step) -> FloatArray:
            ways = _ways(step.telemetry)
            return np.asarray(most(step, _come(step.telemetry, ways, start(step, ways))).mean(axis=(1, 2)))

        return course


def _ways(telemetry: Telemetry) -> FloatArray:
    """Return ``(episodes, steps, movables)``: how far each movable is from the nearest goal [m]."""
    world = world_of(telemetry)
    ways = [
        geometry.way_to_goals(world, movable, telemetry.movables[:, :, i])
        for i, movable in enumerate(world["scene"]["movables"])
    ]
    return np.stack(ways, axis=-1)


def _come(telemetry: Telemetry, ways: FloatArray, start: FloatArray) -> FloatArray:
    """Return which share of the ways at the start movables have come, all of it where they are at a goal."""
    share = np.divide(start - ways, start, out=np.ones_like(ways), where=start > 0)
    return np.asarray(np.maximum(share.clip(0, 1), telemetry.at_goal))

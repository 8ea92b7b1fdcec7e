# SPDX-License-Identifier: BSD-3-Clause
"""Objectives that lead to box pushing step by step, one a plugin; formulas and advice are in ``docs/fitness.md``.

All are from 0 to 1. What a team does after the box has touched the target wall counts neither for nor against it: hence
an episode that ends there has the same value as one that goes on.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar, Literal, get_args

import numpy as np

from swarmevo.protocols import (
    BoolArray,
    Controller,
    FloatArray,
    Follower,
    Objective,
    SceneInfo,
    Step,
    Telemetry,
    World,
)
from swarmevo_shaped import geometry
from swarmevo_shaped.following import AtStart, Most, OverHorizon
from swarmevo_shaped.geometry import free_way, has_pushed, last_steps, steps_before_push, steps_of

Moment = Literal["most", "end"]


class Shaped(ABC):
    """A fitness with one objective from 0 to 1; more is better.

    Args:
        scene: That of the episodes, which is checked at once; None: it is checked when an episode is evaluated.

    Raises:
        ValueError: There is nothing in the scene that it could measure.
    """

    name: ClassVar[str]
    """Of the objective, and of the plugin."""
    channels: tuple[str, ...] = ()
    success: float | None = None
    """From which value on an episode is a success; None: the objective says nothing of success."""
    needs: ClassVar[tuple[Callable[[World], object], ...]] = ()
    """Each raises a ValueError for a world in which there is nothing to measure."""

    def __init__(self, scene: SceneInfo | None = None) -> None:
        if scene is not None:
            self.check(scene.world)

    def check(self, world: World) -> None:
        """Refuse a world in which there is nothing to measure.

        Raises:
            ValueError: It is such a world.
        """
        for need in self.needs:
            need(world)

    @property
    def objectives(self) -> tuple[Objective]:
        """The only one."""
        return (Objective(self.name, "maximise", (0.0, 1.0), success=self.success),)

    @abstractmethod
    def values(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes,)``."""

    def evaluate(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> FloatArray:
        """Return ``(episodes, 1)``.

        Raises:
            ValueError: The telemetry has no world.
        """
        return self.values(telemetry)[:, np.newaxis]

    def follow(self, worlds: int) -> Follower:
        """Return what tells the value so far, ``(worlds,)``, step by step.

        It is that of an objective which needs no more than the last control step and the times.
        """
        return lambda step: self.values(step.telemetry)

    def stepwise(self, worlds: int) -> Follower:
        """Return the same for ``(worlds, 1)``."""
        follow = self.follow(worlds)
        return lambda step: follow(step)[:, np.newaxis]


class Explained(Shaped):
    """One that has a course: a value at each control step, of which the objective is made."""

    @abstractmethod
    def course(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes, steps)``, each in [0, 1]."""

    def terms(self, telemetry: Telemetry) -> dict[str, FloatArray]:
        """Return the course by the objective's name, for the plot beside a replay."""
        return {self.name: self.course(telemetry)}


class Togetherness(Explained):
    """How many robots touch the box's pushing face together, over the time.

    Args:
        needed: Robots that it takes to push the box; more count no more.
        power: Of the share of those robots that are there: above 1 each that joins counts for more than the one before.
        facing: Largest angle between a robot's heading and the direction of the push [deg]; 180: however it stands.
        scene: See :class:`Shaped`.

    Raises:
        ValueError: An option is out of its range, or the scene has not one box and one wall to push it to.
    """

    name = "togetherness"
    channels = ("pose", "box")
    needs = (geometry.box_and_wall,)

    def __init__(
        self, needed: int = 3, power: float = 2.0, facing: float = 60.0, scene: SceneInfo | None = None
    ) -> None:
        super().__init__(scene)
        if type(needed) is not int or not 1 <= needed <= 64:
            raise ValueError(f"needed: expected a whole number from 1 to 64, got {needed!r}")
        if not isinstance(power, (int, float)) or not 0 < power <= 10:
            raise ValueError(f"power: expected a number above 0 and up to 10, got {power!r}")
        if not isinstance(facing, (int, float)) or not 0 <= facing <= 180:
            raise ValueError(f"facing: expected a number from 0 to 180, got {facing!r}")
        self._needed, self._power, self._facing = needed, power, math.radians(facing)

    def course(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes, steps)``."""
        share = geometry.robots_at_face(telemetry, self._facing) / self._needed
        together: FloatArray = np.minimum(share, 1) ** self._power
        return together

    def values(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes,)``: mean over the horizon."""
        return _over_time(telemetry, self.course(telemetry))

    def follow(self, worlds: int) -> Follower:
        """Return what tells the sum so far over the horizon's control steps; at the push all that is left."""
        mean = OverHorizon()
        return lambda step: mean(step, self.course(step.telemetry)[:, 0])


class Progress(Explained):
    """How far the box has come to the target wall, as a share of its free way at the start.

    Args:
        measured: The ``most`` in the episode, or at its ``end``.
        scene: See :class:`Shaped`.

    Raises:
        ValueError: The option is none of its choices, or the scene has not one box and one wall to push it to.
    """

    name = "progress"
    channels = ("box",)
    needs = (geometry.box_and_wall,)

    def __init__(self, measured: Moment = "most", scene: SceneInfo | None = None) -> None:
        super().__init__(scene)
        if measured not in get_args(Moment):
            raise ValueError(f"measured: expected one of {', '.join(get_args(Moment))}, got {measured!r}")
        self._measured: Moment = measured

    def course(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes, steps)``."""
        way = free_way(telemetry)
        return _share(way[:, :1] - way, way[:, :1])

    def values(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes,)``."""
        course = self.course(telemetry)
        return np.where(has_pushed(telemetry), 1.0, course[:, -1] if self._measured == "end" else course.max(axis=1))

    def follow(self, worlds: int) -> Follower:
        """Return what tells the share so far."""
        start, most = AtStart(), Most()

        def follow(step: Step) -> FloatArray:
            way = free_way(step.telemetry)[:, 0]
            whole = start(step, way)
            share = _share(whole - way, whole)
            come = most(step, share)
            return np.where(has_pushed(step.telemetry), 1.0, share if self._measured == "end" else come)

        return follow


class Displacement(Explained):
    """How far the box came from where it stood, whatever the direction, as a share of its free way at the start.

    More counts as better: it is for worlds or terms of negative weight, where the box is to stay.
    """

    name = "displacement"
    channels = ("box",)
    needs = (geometry.box_and_wall,)

    def course(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes, steps)``."""
        moved = telemetry.box[..., :2] - telemetry.box[:, :1, :2]
        return _share(np.hypot(moved[..., 0], moved[..., 1]), free_way(telemetry)[:, :1])

    def values(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes,)``: the most."""
        return np.where(has_pushed(telemetry), 1.0, self.course(telemetry).max(axis=1))

    def follow(self, worlds: int) -> Follower:
        """Return what tells the most so far."""
        start, whole, most = AtStart(), AtStart(), Most()

        def follow(step: Step) -> FloatArray:
            place, way = step.telemetry.box[:, 0, :2], free_way(step.telemetry)[:, 0]
            moved = np.hypot(*(place - start(step, place)).T)
            share = most(step, _share(moved, whole(step, way)))
            return np.where(has_pushed(step.telemetry), 1.0, share)

        return follow


class Success(Shaped):
    """Whether the box touched the target wall."""

    name = "success"
    needs = (geometry.check_delivery,)

    def values(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes,)``: 0 or 1."""
        return has_pushed(telemetry).astype(np.float64)


class Speed(Shaped):
    """How early the box touched the target wall: the share of the horizon that was left then; never: 0."""

    name = "speed"
    needs = (geometry.check_delivery,)

    def values(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes,)``."""
        return 1 - steps_before_push(telemetry) / steps_of(telemetry)


class Homing(Shaped):
    """The share of robots that came within the emitter's range."""

    name = "homing"
    needs = (geometry.check_homing,)

    def values(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes,)``."""
        return np.where(has_pushed(telemetry), 1.0, np.isfinite(telemetry.homing_time).mean(axis=1))

    def behaviours(self, telemetry: Telemetry) -> dict[str, BoolArray]:
        """Return which robots came within the range of the emitter, but are out of it in the end."""
        emitters = geometry.world_of(telemetry)["scene"]["emitters"]
        if len(emitters) != 1 or emitters[0]["rides_on"] is not None or emitters[0]["channel"] == "light":
            return {}
        distance, _ = geometry.from_emitter(telemetry)
        is_away = distance[:, -1] > emitters[0]["range"]
        return {"left the source again": np.isfinite(telemetry.homing_time) & is_away}


class Nearness(Explained):
    """How near the robots are to the emitter, over the time: also those that are not within its range."""

    name = "nearness"
    channels = ("pose",)
    needs = (geometry.still_emitter,)

    def course(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes, steps)``: mean over the robots."""
        return geometry.nearness(telemetry)

    def values(self, telemetry: Telemetry) -> FloatArray:
        """Return ``(episodes,)``: mean over the horizon."""
        return _over_time(telemetry, self.course(telemetry))

    def follow(self, worlds: int) -> Follower:
        """Return what tells the sum so far over the horizon's control steps; at the push all that is left."""
        mean = OverHorizon()
        return lambda step: mean(step, self.course(step.telemetry)[:, 0])


def _over_time(telemetry: Telemetry, course: FloatArray) -> FloatArray:
    """Return ``(episodes,)``: the mean of a course over the horizon; from the push on it stays as it was just before.

    Were it 1 from then on, evolution would be content with a team that pushes without it, say blindly backwards.
    """
    steps, last = steps_of(telemetry), last_steps(telemetry)

    def mean(one: FloatArray, before: int) -> float:
        seen = one[: max(before, 1)]  # the box may touch the wall at the start
        return float((one[:before].sum() + (steps - before) * seen[-last:].mean()) / steps)

    # One episode at a time: the same bits whichever episodes stand beside it.
    means = [mean(one, int(n)) for one, n in zip(course, steps_before_push(telemetry), strict=True)]
    return np.array(means, dtype=np.float64)


def _share(part: FloatArray, whole: FloatArray) -> FloatArray:
    """Return ``part / whole``, cut to [0, 1]; 0 where there is no whole."""
    share = np.divide(part, whole, out=np.zeros_like(part), where=whole > 0)
    return np.clip(share, 0, 1)

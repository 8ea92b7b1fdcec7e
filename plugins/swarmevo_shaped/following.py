# SPDX-License-Identifier: BSD-3-Clause
"""What objectives remember of an episode while it goes on, in worlds side by side: ``stepwise`` of a fitness."""

from __future__ import annotations

import numpy as np

from swarmevo.protocols import FloatArray, IntArray, Step
from swarmevo_shaped.geometry import has_pushed, last_steps, steps_before_push


class _Memory:
    """Something that an episode is remembered by, ``(worlds, ...)``."""

    _value = np.zeros(0)

    def _forget(self, step: Step, now: FloatArray) -> None:
        """Take the worlds where an episode begins for new; at first all, whose shape ``now`` tells."""
        if self._value.shape != now.shape:
            self._value = np.zeros(now.shape)
        self._value[step.is_first] = 0.0


class AtStart(_Memory):
    """What something was in the first control step of the episode."""

    def __call__(self, step: Step, now: FloatArray) -> FloatArray:
        """Return it, where ``now`` is what it is in this step."""
        self._forget(step, now)
        self._value[step.is_first] = now[step.is_first]
        return self._value


class Most(_Memory):
    """The most that something at or above 0 has been in the episode."""

    def __call__(self, step: Step, now: FloatArray) -> FloatArray:
        """Return it, where ``now`` is what it is in this step."""
        self._forget(step, now)
        return np.maximum(self._value, now, out=self._value)


class Total(_Memory):
    """The sum of something over the control steps of the episode."""

    def __call__(self, step: Step, now: FloatArray) -> FloatArray:
        """Return it, where ``now`` is what it is in this step."""
        self._forget(step, now)
        return np.add(self._value, now, out=self._value)


class OverHorizon:
    """The sum of a course over the horizon, as far as it has come; at the push it gets all that is left at once.

    From the push on the course is ``rest``; None: what it was in the mean of the last second before.
    """

    def __init__(self, rest: float | None = None) -> None:
        self._total = Total()
        self._rest = rest
        self._recent = np.zeros((0, 0))
        """``(worlds, steps)``: the last values before the push; that of step k is at k modulo their number."""

    def __call__(self, step: Step, now: FloatArray) -> FloatArray:
        """Return the mean over the horizon, ``(worlds,)``, where ``now`` is the course in this step."""
        before = steps_before_push(step.telemetry)
        total = self._total(step, np.where(step.number < before, now, 0.0))
        rest = self._mean_of_recent(step, before, now) if self._rest is None else self._rest
        return np.where(has_pushed(step.telemetry), total + (step.horizon - before) * rest, total) / step.horizon

    def _mean_of_recent(self, step: Step, before: IntArray, now: FloatArray) -> FloatArray:
        last = last_steps(step.telemetry)
        if self._recent.shape != (len(now), last):
            self._recent = np.zeros((len(now), last))
        self._recent[step.is_first] = 0.0
        seen = np.maximum(before, 1)  # the box may touch the wall at the start
        counts = np.flatnonzero(step.number < seen)
        self._recent[counts, step.number[counts] % last] = now[counts]
        return np.asarray(self._recent.sum(axis=1) / np.minimum(seen, last))

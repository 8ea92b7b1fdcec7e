# SPDX-License-Identifier: BSD-3-Clause
"""The paper's two objectives (section V): F1, homing and box pushing, and F2, the number of hidden neurons."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from swarmevo.protocols import Controller, FloatArray, Follower, Objective, SceneInfo, Step, Telemetry

SumCovers = Literal["both", "motion"]

PAPERS_STRENGTH = 50.0
"""Largest signal strength S (section V)."""


class BoxPushing:
    """F1 (eq. 1): ``1/T sum[(1 - i) W_L W_R V S + S B]`` of each robot, then the mean over the robots.

    Args:
        sum_covers: Whether the sum covers ``both`` terms, or only the first (``motion``), S B being added as it is at
            the end of the episode.
        strength: Largest signal strength S, of which the objective's range is made. Nothing: that of the world's
            emitters (``emitter.strength``).
        scene: That of the episodes; None: the paper's.

    Raises:
        ValueError: An option is out of its range, or the scene has no emitter to home in on, without which F1 is 0.
    """

    channels = ("infrared", "touch", "rf", "command")

    def __init__(
        self, sum_covers: SumCovers = "both", strength: float | None = None, scene: SceneInfo | None = None
    ) -> None:
        if scene is not None and all(one["channel"] == "light" for one in scene.world["scene"]["emitters"]):
            raise ValueError("scene.emitters: expected one to home in on, got none but lights; choose another fitness")
        if strength is None:
            emitters = scene.world["scene"]["emitters"] if scene else ()
            strength = max((emitter["strength"][1] for emitter in emitters), default=PAPERS_STRENGTH)
        if sum_covers not in get_args(SumCovers):
            raise ValueError(f"sum_covers: expected one of {', '.join(get_args(SumCovers))}, got {sum_covers!r}")
        if not isinstance(strength, (int, float)) or not 0 < strength < np.inf:
            raise ValueError(f"strength: expected a number above 0, got {strength!r}")
        self._sum_covers: SumCovers = sum_covers
        self._has_pushing = scene is None or scene.movables > 0
        self.objectives = (Objective("box_pushing", "maximise", (0.0, 2.0 * strength)),)

    def evaluate(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> FloatArray:
        """Return F1 ``(episodes, 1)``."""
        episodes = zip(telemetry.infrared, telemetry.touch, telemetry.rf, telemetry.command, strict=True)
        # One episode at a time: little memory, and the same bits whichever episodes stand beside it.
        return np.array([[self._f1(*episode)] for episode in episodes]).reshape(-1, 1)

    def terms(self, telemetry: Telemetry) -> dict[str, FloatArray]:
        """Return the terms of eq. 1, ``(episodes, steps)`` each, mean over the robots; without a box the first."""
        motion, pushing = _terms(telemetry.infrared, telemetry.touch, telemetry.rf, telemetry.command)
        terms = {"homing": motion.mean(axis=-1), "pushing": pushing.mean(axis=-1)}
        return terms if self._has_pushing else {"homing": terms["homing"]}

    def stepwise(self, worlds: int) -> Follower:
        """Return what follows F1 in worlds side by side: each step adds its term of the sum over 1 to T, over T."""
        total = np.zeros(worlds)

        def follow(step: Step) -> FloatArray:
            one = step.telemetry
            motion, pushing = (term.mean(axis=(1, 2)) for term in _terms(one.infrared, one.touch, one.rf, one.command))
            total[step.is_first] = 0.0
            np.add(total, motion + pushing if self._sum_covers == "both" else motion, out=total)
            # T is known at last: an episode may end before the horizon.
            f1 = total / np.where(step.is_last, step.number + 1, step.horizon)
            return np.asarray(f1 if self._sum_covers == "both" else f1 + pushing)[:, np.newaxis]

        return follow

    def _f1(self, infrared: FloatArray, touch: FloatArray, rf: FloatArray, command: FloatArray) -> float:
        """Return F1 of one episode: channels without their first axis."""
        motion, pushing = _terms(infrared, touch, rf, command)
        if self._sum_covers == "both":
            return float(np.mean(motion + pushing, axis=0).mean())
        return float((np.mean(motion, axis=0) + pushing[-1]).mean())


class HiddenNeurons:
    """F2 (eq. 2): the number of hidden neurons in use.

    Args:
        maximum: Most hidden neurons that a genome can have, the upper end of the objective's range (paper: 15).

    Raises:
        ValueError: ``maximum`` is not above 0.
    """

    channels = ()

    def __init__(self, maximum: int = 15) -> None:
        if type(maximum) is not int or maximum < 1:
            raise ValueError(f"maximum: expected a whole number of at least 1, got {maximum!r}")
        self._maximum = maximum
        self.objectives = (Objective("hidden_neurons", "minimise", (0.0, float(maximum)), of="genome"),)

    def evaluate(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> FloatArray:
        """Return F2 ``(episodes, 1)``.

        Raises:
            ValueError: A genome uses more hidden neurons than ``maximum``.
        """
        f2 = controller.complexity(genomes)
        if np.any(f2 > self._maximum):
            raise ValueError(
                f"maximum: expected at most {self._maximum} hidden neurons, a genome uses {f2.max():g}; set it to the "
                "most that the controller can have"
            )
        return f2[:, np.newaxis]


def _terms(
    infrared: FloatArray, touch: FloatArray, rf: FloatArray, command: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return ``(1 - i) W_L W_R V S`` and ``S B``, each ``(..., robots)``."""
    i, b, s = infrared.max(axis=-1), touch.max(axis=-1), rf
    w = np.maximum(command, 0.0)  # backwards counts as standing
    w_left, w_right = w[..., 0], w[..., 1]
    v = (w_left + w_right) / 2
    return (1 - i) * w_left * w_right * v * s, s * b

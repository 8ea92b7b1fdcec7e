# SPDX-License-Identifier: BSD-3-Clause
"""Which measures of success a task has: what its scene has in it, and what its objectives call a success."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from swarmevo.config import Config, surroundings
from swarmevo.protocols import Objective
from swarmevo.simulation import layout

PUSH: Final = "push"
"""Rate of episodes in which all movables have been at a goal: in the paper's scene, the box at the target wall."""
DELIVERED: Final = "all_delivered"
"""The same rate where it is not one box that is pushed."""
HOMING: Final = "homing"
"""Rate of robots that came within the range of an emitter that they home in on."""


@dataclass(frozen=True)
class Measures:
    """Of a task. What a scene has nothing for is measured too, but says nothing, and is not shown."""

    homing: bool
    """There is an emitter that robots home in on."""
    push: bool
    """There is something to push, and a goal."""
    one_box: bool
    """What there is to push is one box."""
    paper: bool
    """The scene is of the kind of the paper's: one box, one wall, one emitter."""
    successes: tuple[Objective, ...]
    """Those that say from which value on an episode is a success."""

    @property
    def rates(self) -> list[str]:
        """Names of the rates of success, the first the one that matters most."""
        return [
            *([PUSH if self.one_box else DELIVERED] if self.push else []),
            *(objective.name for objective in self.successes),
            *([HOMING] if self.homing else []),
        ]


def measures_of(settings: Config, objectives: Sequence[Objective]) -> Measures:
    """Return a task's measures of success."""
    scene = surroundings(settings)
    movables, goals, emitters = scene.movables or (), scene.goals or (), layout.homing_emitters(scene)
    one_box = layout.has_one_box(scene)
    push = bool(movables and goals)
    return Measures(
        homing=bool(emitters),
        push=push,
        one_box=one_box,
        paper=push and one_box and len(goals) == 1 and goals[0].wall is not None and len(emitters) == 1,
        successes=tuple(one for one in objectives if one.success is not None),
    )

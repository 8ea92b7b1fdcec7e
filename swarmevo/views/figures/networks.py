# SPDX-License-Identifier: BSD-3-Clause
"""An individual's network, as nodes and weighted lines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from swarmevo.analysis import assessment
from swarmevo.config import Config
from swarmevo.plugins.team import Team
from swarmevo.protocols import FloatArray, SceneInfo
from swarmevo.views import text
from swarmevo.views.figures import style
from swarmevo.views.figures.source import Run, opened
from swarmevo.views.figures.style import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DEVICES: Final = {"infrared": style.BLUE, "touch": style.ORANGE, "rf": style.PURPLE}
"""Colours of some devices' readings; of the others they are sky-blue."""


def network(run: Run, genome: int | None = None) -> Picture:
    """Return an individual's network: what is switched on, weights as lines. Of a team of networks, the first robot's.

    Args:
        run: Whose controller is a :class:`~swarmevo.protocols.FeedForward` network.
        genome: Its id; None: the first of the front over all trials.

    Raises:
        ValueError: The controller is something else.
    """
    with opened(run) as store:
        chosen = assessment.watched(store, genome)[0]
        team = Team(store.config)
        nets, info = team.networks(store.genome(chosen)), team.scene.info
    if nets is None:
        raise ValueError("network: expected a controller that makes FeedForward networks; this run's does not")
    hidden = np.flatnonzero(nets.hidden_switch[0])
    into, out = nets.input_hidden[0, hidden], nets.hidden_output[0]
    weights_out = out[:, [*hidden, *range(len(nets.hidden_switch[0]), out.shape[1])]]  # the bias comes last
    with style.picture(5.2, 4.2) as picture:
        axes = picture.add_subplot()
        _draw_network(axes, into, weights_out, hidden.tolist(), info, nets.bias)
        return picture


def has_network(settings: Config, genome: FloatArray) -> bool:
    """Whether :func:`network` can draw a genome."""
    return Team(settings).networks(genome) is not None


def _draw_network(
    axes: Axes, into: FloatArray, out: FloatArray, hidden: Sequence[int], info: SceneInfo, bias: bool
) -> None:
    """Draw weights ``into`` ``(hidden, inputs)`` and ``out`` ``(commands, hidden + bias)``."""
    names = (*info.observation_names, *(["bias"] if bias else []))
    left, middle, right = (_column(n) for n in (len(names), len(hidden), info.commands))
    largest = max(np.abs(into).max(initial=0), np.abs(out).max(initial=0), 1e-9)
    for h, y in enumerate(middle):
        for i, start in enumerate(left):
            _weight(axes, (0, start), (1, y), into[h, i] / largest)
    for o, y in enumerate(right):
        for h, start in enumerate(middle):
            _weight(axes, (1, start), (2, y), out[o, h] / largest)
        if bias:
            _weight(axes, (0, left[-1]), (2, y), out[o, -1] / largest)
    for name, y in zip(names, left, strict=True):
        _node(axes, (0, y), _colour(name), name, "right")
    for number, y in zip(hidden, middle, strict=True):
        _node(axes, (1, y), style.GREEN, f"{number}", "above")
    for name, y in zip(info.command_names, right, strict=True):
        _node(axes, (2, y), style.INK, name, "left")
    for name, colour in (("excites", style.BLUE), ("inhibits", style.VERMILLION)):
        axes.plot([], [], color=colour, linewidth=2, label=name)
    axes.legend(loc="lower center", ncols=2, bbox_to_anchor=(0.5, -0.04))
    on = f"{text.count(len(hidden), 'hidden neuron')} switched on"
    axes.set_title(f"{on}; the widest line is a weight of {largest:.2g}", fontweight="normal", fontsize=9, loc="center")
    axes.set(xlim=(-0.55, 2.55), ylim=(-0.1, 1.05))
    axes.axis("off")


def _colour(name: str) -> str:
    """Return the colour of a network's input."""
    return style.INK if name == "bias" else DEVICES.get(name.rpartition("_")[0] or name, style.SKY)


def _column(n: int) -> FloatArray:
    """Return ``(n,)``: heights of a column's nodes, from the top."""
    span = 0.5 if n <= 3 else 1.0
    return 0.5 + span * (0.5 - (np.arange(n) + 0.5) / n) if n else np.empty(0)


def _node(axes: Axes, at: tuple[float, float], colour: str, name: str, side: str) -> None:
    axes.plot(*at, "o", color=colour, markersize=8, markeredgecolor="white", markeredgewidth=0.8, zorder=3)
    offset, align = {"right": ((-8, 0), "right"), "left": ((8, 0), "left"), "above": ((0, 8), "center")}[side]
    vertical = "bottom" if side == "above" else "center"
    axes.annotate(name, at, offset, textcoords="offset points", ha=align, va=vertical, fontsize=8)


def _weight(axes: Axes, start: tuple[float, float], end: tuple[float, float], weight: float) -> None:
    """Draw a weight in [-1, 1] of the largest."""
    colour, strength = (style.BLUE if weight > 0 else style.VERMILLION), abs(weight)
    axes.plot(*zip(start, end, strict=True), color=colour, linewidth=0.3 + 2.7 * strength, alpha=0.25 + 0.7 * strength)

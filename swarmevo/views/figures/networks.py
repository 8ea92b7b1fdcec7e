# SPDX-License-Identifier: BSD-3-Clause
"""An individual's network, as nodes and weighted lines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.patches import FancyArrowPatch

from swarmevo.analysis import assessment
from swarmevo.analysis.networks import Network, network_of
from swarmevo.config import Config
from swarmevo.plugins.team import Team
from swarmevo.protocols import Compiled, FloatArray, SceneInfo
from swarmevo.views import text
from swarmevo.views.figures import style
from swarmevo.views.figures.source import Run, opened
from swarmevo.views.figures.style import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DEVICES: Final = {"infrared": style.BLUE, "touch": style.ORANGE, "rf": style.PURPLE, "light": style.YELLOW}
"""Colours of some devices' readings; of the others they are sky-blue."""
_GAP: Final = 0.17  # between a node and the edge of the figure, inches
_LETTER: Final = 0.062  # that a letter of a name takes, inches
_LINE: Final = 0.16  # inches that a node takes in its column


def network(run: Run, genome: int | None = None, width: float = style.COLUMN) -> Picture:
    """Return an individual's network: what is switched on, weights as lines. Of a team of networks, the first robot's.

    Args:
        run: Whose controller is a network that the library runs: :class:`~swarmevo.protocols.FeedForward`,
            :class:`~swarmevo.protocols.Linear` or :class:`~swarmevo.protocols.Recurrent`.
        genome: Its id; None: the most successful.
        width: Of the figure [inches].

    Raises:
        ValueError: The controller is something else.
    """
    with opened(run) as store:
        chosen = assessment.watched(store, genome)[0]
        team = Team(store.config)
        policies, info = team.policies(store.genome(chosen)), team.scene.info
    if policies is None or isinstance(policies, Compiled):
        raise ValueError("network: expected a controller that makes networks for the library; this run's does not")
    return _picture(
        network_of(policies, info), (*info.observation_names, *(["bias"] if policies.bias else [])), info, width
    )


def has_network(settings: Config, genome: FloatArray) -> bool:
    """Whether :func:`network` can draw a genome."""
    policies = Team(settings).policies(genome)
    return policies is not None and not isinstance(policies, Compiled)


# ---- drawn -----------------------------------------------------------------------------------------------------------


def _picture(drawn: Network, inputs: Sequence[str], info: SceneInfo, width: float) -> Picture:
    outputs, hidden = info.command_names, drawn.hidden
    names = [_GAP + max([4, *map(len, names)]) * _LETTER for names in (inputs, outputs)]  # inches
    unit = max(0.5, (width - sum(names)) / 2)  # from a column to the next, inches
    margins = [room / unit for room in names]
    with style.picture(width, max(0.8 * width, _LINE * max(len(inputs), len(outputs)))) as picture:
        axes = picture.add_subplot()
        left, middle, right = (
            [(x, y) for y in _column(len(names))] for x, names in enumerate((inputs, hidden, outputs))
        )
        _weights(axes, left, middle, drawn.input_hidden / drawn.largest)
        _weights(axes, middle, right, drawn.hidden_output / drawn.largest)
        _weights(axes, left, right, drawn.input_output / drawn.largest)
        _memory(axes, [*middle, *right], middle, drawn.remembered / drawn.largest)
        for place, name in zip(left, inputs, strict=True):
            _node(axes, place, _colour(name), name, "right")
        for place, name in zip(middle, hidden, strict=True):
            _node(axes, place, style.GREEN, name, "above")
        for place, name in zip(right, outputs, strict=True):
            _node(axes, place, style.INK, name, "left")
        _legend(axes, has_memory=bool(drawn.remembered.any()))
        on = f"{text.count(len(hidden), 'hidden neuron')} switched on" if hidden else "no hidden neurons"
        style.note(axes, f"{on}; the widest line is a weight of {drawn.largest:.2g}")
        axes.set(xlim=(-margins[0], 2 + margins[1]), ylim=(-0.1, 1.05))
        axes.axis("off")
        return picture


def _legend(axes: Axes, has_memory: bool) -> None:
    for name, colour in (("excites", style.BLUE), ("inhibits", style.VERMILLION)):
        axes.plot([], [], color=colour, linewidth=2, label=name)
    if has_memory:
        axes.plot([], [], color=style.INK, linewidth=1, linestyle="--", label="recurrent (ring: on itself)")
    axes.legend(loc="lower center", ncols=3, bbox_to_anchor=(0.5, -0.04), columnspacing=1, handlelength=1.4)


def _colour(name: str) -> str:
    """Return the colour of a network's input."""
    if name == "bias":
        return style.INK
    return next((colour for device, colour in DEVICES.items() if name.startswith(device)), style.SKY)


def _column(n: int) -> FloatArray:
    """Return ``(n,)``: heights of a column's nodes, from the top."""
    span = 0.5 if n <= 3 else 1.0
    return 0.5 + span * (0.5 - (np.arange(n) + 0.5) / n) if n else np.empty(0)


Place = tuple[float, float]


def _node(axes: Axes, at: Place, colour: str, name: str, side: str) -> None:
    axes.plot(*at, "o", color=colour, markersize=8, markeredgecolor="white", markeredgewidth=0.8, zorder=3)
    offset, align = {"right": ((-8, 0), "right"), "left": ((8, 0), "left"), "above": ((0, 8), "center")}[side]
    vertical = "bottom" if side == "above" else "center"
    axes.annotate(name, at, offset, textcoords="offset points", ha=align, va=vertical, fontsize=8)


def _weights(axes: Axes, starts: Sequence[Place], ends: Sequence[Place], weights: FloatArray) -> None:
    """Draw weights ``(ends, starts)`` in [-1, 1] of the largest as lines; those of exactly 0 are none."""
    for end, row in zip(ends, weights, strict=True):
        for start, weight in zip(starts, row, strict=True):
            if weight:
                axes.plot(*zip(start, end, strict=True), **_look(weight))


def _memory(axes: Axes, starts: Sequence[Place], ends: Sequence[Place], weights: FloatArray) -> None:
    """Draw the same as dashed arrows that bend, and as a ring where a neuron hears itself."""
    for end, row in zip(ends, weights, strict=True):
        for start, weight in zip(starts, row, strict=True):
            if not weight:
                continue
            look = _look(weight)
            if start == end:
                ring = {"markeredgecolor": look["color"], "markeredgewidth": look["linewidth"], "alpha": look["alpha"]}
                axes.plot(*end, "o", markersize=14, markerfacecolor="none", **ring)
                continue
            bend = f"arc3,rad={0.35 if start[0] == end[0] else 0.2}"
            arrow: dict[str, Any] = {
                "arrowstyle": "-|>",
                "mutation_scale": 8,
                "shrinkA": 5,
                "shrinkB": 5,
                "linestyle": (0, (4, 2)),
            }
            axes.add_patch(FancyArrowPatch(start, end, connectionstyle=bend, **arrow, **look))


def _look(weight: float) -> dict[str, Any]:
    """Return colour, width and strength of the line of a weight in [-1, 1] of the largest."""
    strength = abs(weight)
    colour = style.BLUE if weight > 0 else style.VERMILLION
    return {"color": colour, "linewidth": 0.3 + 2.7 * strength, "alpha": 0.25 + 0.7 * strength}

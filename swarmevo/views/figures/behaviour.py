# SPDX-License-Identifier: BSD-3-Clause
"""What a team does in a scene: the paths of one test (the paper's Fig. 5), and where robots spend their time."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib import patches
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, PowerNorm
from matplotlib.lines import Line2D

from swarmevo.analysis import assessment
from swarmevo.analysis.recording import Recording
from swarmevo.config import LIGHT, Config, Emitter, Surroundings, surroundings
from swarmevo.protocols import FloatArray
from swarmevo.simulation import layout
from swarmevo.views import text
from swarmevo.views.figures import style
from swarmevo.views.figures.source import Run, opened
from swarmevo.views.figures.style import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

OCCUPANCY = LinearSegmentedColormap.from_list(
    "occupancy", [(0, 0.45, 0.70, 0), (0, 0.45, 0.70, 0.75), (0.9, 0.6, 0, 1)]
)
"""From nothing over blue to orange: lies on any paper, light or dark."""
CELL: Final = 0.02
"""Of the occupancy map, at most [m]."""
PATH_POINTS: Final = 480
"""Of a robot's path: as many as can be seen."""
SHADES: Final = 24
"""In which a path becomes stronger with time."""
AFTERWARDS: Final = 2.0
"""A path ends so long after all movables have come to a goal [s]."""
_LETTERS: Final = 17
"""Of a sentence in small letters, on an inch."""
_CHANNELS: Final = (style.PURPLE, style.SKY, style.VERMILLION, style.BLACK)
"""Colours of emitters by channel, in turn; lights are yellow."""
_MARGIN: Final = 0.6
"""Beside the axes [inches]."""


def paths(
    run: Run | Recording, genome: int | None = None, test: int | None = None, width: float = style.COLUMN
) -> Picture:
    """Return the paths of a team's robots in one test, and what they pushed (the paper's Fig. 5).

    Args:
        run: Or tests that :func:`swarmevo.analysis.assessment.watch` recorded.
        genome: Its id; None: the most successful.
        test: Number of the test; None: the most successful one.
        width: Of the figure [inches].
    """
    seen = _recording(run, genome)
    with style.picture(width, 0.95 * width + 0.85) as picture:
        draw_paths(picture.add_subplot(), seen, seen.best if test is None else test, width)
        return picture


def draw_paths(axes: Axes, seen: Recording, test: int, width: float) -> None:
    """Draw what :func:`paths` shows into axes of a width [inches]."""
    pose, movables = seen.telemetry.pose[test], seen.telemetry.movables[test]
    pose, movables = pose[: _shown_steps(seen, test)], movables[: _shown_steps(seen, test)]
    scene = surroundings(seen.config)
    _arena(axes, seen.config)
    _emitters(axes, scene, movables[-1])
    for movable, start, end in zip(scene.movables or (), movables[0], movables[-1], strict=True):
        _solid(axes, movable.shape, movable.size, start, fill=False, linestyle="--")
        _solid(axes, movable.shape, movable.size, end, facecolor=style.ORANGE, alpha=0.45)
    shown = np.linspace(0, len(pose) - 1, min(PATH_POINTS, len(pose))).astype(int)
    for robot in range(pose.shape[1]):
        _path(axes, pose[shown, robot, :2], style.colour(robot))
        _robot(axes, seen.config, pose[0, robot], style.colour(robot), fill=False)
        _robot(axes, seen.config, pose[-1, robot], style.colour(robot), fill=True)
    style.note(axes, textwrap.fill(_outcome(seen, test), int(_LETTERS * (width - _MARGIN))))
    marks = _marks(scene)
    style.legend(axes, len(marks), width, below=True, handles=marks, ncols=2)


def occupancy(run: Run | Recording, genome: int | None = None, width: float = style.COLUMN) -> Picture:
    """Return where a team's robots spend their time, over all tests; movables as they stand at each end.

    Args:
        run: Or tests that :func:`swarmevo.analysis.assessment.watch` recorded.
        genome: Its id; None: the most successful.
        width: Of the figure [inches].
    """
    seen = _recording(run, genome)
    places = seen.telemetry.pose[..., :2].reshape(-1, 2)
    places = places[np.isfinite(places[:, 0])]  # until an episode's end
    west, east, south, north = seen.config.arena.bounds
    cells = (_edges(west, east), _edges(south, north))
    share, _, _ = np.histogram2d(places[:, 0], places[:, 1], bins=cells)
    share *= 100 / len(places)
    with style.picture(width, 0.87 * width) as picture:
        axes = picture.add_subplot()
        _arena(axes, seen.config)
        top = max(float(np.quantile(share[share > 0], 0.99)), 1e-9)  # one hot cell must not hide the others
        image = axes.imshow(
            share.T,
            origin="lower",
            extent=(west, east, south, north),
            cmap=OCCUPANCY,
            norm=PowerNorm(0.5, 0, top),  # so that where they pass is seen beside where they stay
            zorder=1,
            interpolation="nearest",
        )
        scene = surroundings(seen.config)
        for movables, steps in zip(seen.telemetry.movables, seen.episodes.steps, strict=True):
            for movable, end in zip(scene.movables or (), movables[steps - 1], strict=True):
                _solid(axes, movable.shape, movable.size, end, fill=False, linewidth=0.9)
        if len(seen):
            _emitters(axes, scene, seen.telemetry.movables[0, 0])
        bar = picture.colorbar(
            image, ax=axes, shrink=0.75, label=f"share of the robots' time\nin {CELL * 100:g} cm cells (%)"
        )
        bar.outline.set_visible(False)
        said = f"{text.count(len(seen.episodes), 'test')}, {text.horizon(seen.config.episode.horizon)} each"
        what = "the box" if layout.has_one_box(scene) else "movables"
        style.note(axes, said + (f"\noutlines: {what} at each end" if scene.movables else ""))
        picture.draw_without_rendering()  # only then are the bar's ticks known, for which the layout leaves room
        return picture


def _marks(scene: Surroundings) -> list[Line2D]:
    """Return a legend of what is drawn in a scene."""
    grey: dict[str, Any] = {"color": style.INK, "linestyle": "none", "markersize": 6}
    marks = [
        Line2D([], [], marker="o", markerfacecolor="none", label="robot at the start", **grey),
        Line2D([], [], marker="o", label="robot at the end", **grey),
    ]
    if movables := scene.movables or ():
        what = "box" if layout.has_one_box(scene) else "movable"
        square = {**grey, "marker": "s" if movables[0].shape == "box" else "o"}
        marks.append(Line2D([], [], linestyle="--", color=style.INK, label=f"{what} at the start"))
        marks.append(Line2D([], [], **{**square, "color": style.ORANGE}, alpha=0.6, label=f"{what} at the end"))
    for one in {emitter.channel: emitter for emitter in reversed(scene.emitters or ())}.values():
        name, line = text.emitter(scene, one), "none"
        if layout.has_range(scene, one):
            name, line = f"{name} and its range", ":"
        look: dict[str, Any] = {"color": _colour(scene, one), "marker": "*", "linestyle": line, "markersize": 8}
        marks.append(Line2D([], [], **look, label=name))
    goals = scene.goals or ()
    if any(goal.wall for goal in goals):
        marks.append(Line2D([], [], color=style.GREEN, linewidth=4, label="target wall"))
    if any(goal.region for goal in goals):
        marks.append(Line2D([], [], **{**grey, "color": style.GREEN}, marker="s", alpha=0.4, label="goal"))
    if scene.obstacles:
        marks.append(Line2D([], [], **grey, marker="s", alpha=0.6, label="obstacle"))
    return marks


def _shown_steps(seen: Recording, episode: int) -> int:
    """Return how many steps of an episode are worth showing: all, or those until shortly after the push."""
    push = seen.telemetry.push_time[episode] + AFTERWARDS
    shown = np.nan_to_num(push / seen.telemetry.control_period, nan=np.inf)
    return max(2, round(float(min(shown, seen.episodes.steps[episode]))))


def _recording(run: Run | Recording, genome: int | None) -> Recording:
    if isinstance(run, Recording):
        return run
    with opened(run) as store:
        return assessment.watch(store, genome)


def _edges(low: float, high: float) -> FloatArray:
    """Return the edges of cells of equal size from one wall to the other."""
    return np.linspace(low, high, int(np.ceil((high - low) / CELL - 1e-9)) + 1)


def _outcome(seen: Recording, episode: int) -> str:
    homing, push = seen.telemetry.homing_time[episode], seen.telemetry.push_time[episode]
    scene, told = surroundings(seen.config), []
    if home := text.homing(layout.homing_emitters(scene)):
        told.append(f"{np.isfinite(homing).sum()} of {len(homing)} {home}")
    if delivered := text.delivery(scene):
        told.append(f"{delivered} {text.moment(float(push))}")
    return ", ".join(told) or f"{text.count(len(homing), 'robot')}, {text.horizon(seen.config.episode.horizon)}"


def _arena(axes: Axes, settings: Config) -> None:
    """Draw the walls, the grey of the floor, obstacles, and the goals: walls thick and green, regions a light green."""
    scene, corners = surroundings(settings), layout.outline(settings.arena)
    inside = patches.Polygon(corners, closed=True, fill=False, edgecolor=style.INK, linewidth=1.2)
    axes.add_patch(inside)
    for patch in scene.patches:
        look: dict[str, Any] = {"facecolor": str(patch.grey), "edgecolor": "none", "alpha": 0.5, "zorder": 0}
        _solid(axes, patch.shape, patch.size, np.array(patch.pose), clip_path=inside, **look)
    for obstacle in map(layout.as_box, scene.obstacles):
        _solid(axes, obstacle.shape, obstacle.size, np.array(obstacle.pose), facecolor=style.INK, alpha=0.6)
    west, east, south, north = settings.arena.bounds
    ends = {"north": ([west, east], [north, north]), "south": ([west, east], [south, south])}
    ends |= {"east": ([east, east], [south, north]), "west": ([west, west], [south, north])}
    for goal in scene.goals or ():
        if goal.wall is not None:
            axes.plot(*ends[goal.wall], color=style.GREEN, linewidth=4, solid_capstyle="butt", clip_on=False)
        elif goal.region is not None:
            x, to_x, y, to_y = goal.region
            shade: dict[str, Any] = {
                "facecolor": style.GREEN,
                "edgecolor": style.GREEN,
                "alpha": 0.25,
                "zorder": 0,
                "clip_path": inside,
            }
            axes.add_patch(patches.Rectangle((x, y), to_x - x, to_y - y, **shade))
    room = 0.01 * max(east - west, north - south)
    axes.set(xlim=(west - room, east + room), ylim=(south - room, north + room), xlabel="x (m)", ylabel="y (m)")
    axes.set_aspect("equal")
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _colour(scene: Surroundings, emitter: Emitter) -> str:
    """Return an emitter's colour, which is its channel's."""
    if emitter.channel == LIGHT:
        return style.YELLOW
    return _CHANNELS[scene.radio_channels.index(emitter.channel) % len(_CHANNELS)]


def _emitters(axes: Axes, scene: Surroundings, movables: FloatArray) -> None:
    """Draw each emitter, with its range if it has one; one that rides where the movables ``(movables, 3)`` carry it."""
    for emitter in scene.emitters or ():
        x, y = layout.emitter_places(emitter, movables)
        colour = _colour(scene, emitter)
        if layout.has_range(scene, emitter):
            axes.add_patch(patches.Circle((x, y), emitter.range, fill=False, edgecolor=colour, linestyle=":"))
        axes.plot(x, y, "*", color=colour, markersize=9, zorder=4)


def _solid(axes: Axes, shape: str, size: Sequence[float], pose: FloatArray, **look: Any) -> None:
    """Draw a box or a cylinder from above."""
    length, width = size[:2]
    x, y, heading = pose
    look = {"edgecolor": style.INK, "linewidth": 1.2, "zorder": 2} | look
    if shape == "cylinder":
        axes.add_patch(patches.Circle((x, y), length / 2, **look))
        return
    corner = (x - length / 2, y - width / 2)
    axes.add_patch(patches.Rectangle(corner, length, width, angle=np.degrees(heading), rotation_point="center", **look))


def _path(axes: Axes, points: FloatArray, colour: str) -> None:
    """Draw a path that becomes stronger with time; one point, of an episode of one step, is none."""
    if len(points) < 2:
        return
    ends = np.linspace(0, len(points) - 1, min(SHADES, len(points) - 1) + 1).astype(int)
    pieces = [points[start : end + 1] for start, end in pairwise(ends)]
    strength = np.linspace(0.25, 1, len(pieces))
    axes.add_collection(LineCollection(pieces, colors=colour, alpha=strength, linewidths=1.4, zorder=3))


def _robot(axes: Axes, settings: Config, pose: FloatArray, colour: str, fill: bool) -> None:
    """Draw a robot with a line to where it looks."""
    x, y, heading = pose
    radius = settings.robot.radius
    face = colour if fill else "none"
    axes.add_patch(patches.Circle((x, y), radius, facecolor=face, edgecolor=colour, linewidth=1.2, zorder=4))
    nose = "white" if fill else colour
    axes.plot([x, x + radius * np.cos(heading)], [y, y + radius * np.sin(heading)], color=nose, linewidth=1.2, zorder=5)

# SPDX-License-Identifier: BSD-3-Clause
"""What a team does in the arena: the paths of one test (the paper's Fig. 5), and where robots spend their time."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib import patches
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, PowerNorm

from swarmevo.analysis import assessment
from swarmevo.analysis.recording import Recording
from swarmevo.config import Config
from swarmevo.protocols import FloatArray
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
"""A path ends so long after the box has come to the wall [s]."""


def paths(run: Run | Recording, genome: int | None = None, test: int | None = None) -> Picture:
    """Return the paths of a team's robots and of the box in one test (the paper's Fig. 5).

    Args:
        run: Or tests that :func:`swarmevo.analysis.assessment.watch` recorded.
        genome: Its id; None: the first of the front over all trials.
        test: Number of the test; None: the most successful one.
    """
    seen = _recording(run, genome)
    episode = seen.best if test is None else test
    pose, box = seen.telemetry.pose[episode], seen.telemetry.box[episode]
    pose, box = pose[: _shown_steps(seen, episode)], box[: _shown_steps(seen, episode)]
    with style.picture(4.4, 4.5) as picture:
        axes = picture.add_subplot()
        _arena(axes, seen.config)
        _box(axes, seen.config, box[0], fill=False, linestyle="--")
        _box(axes, seen.config, box[-1], facecolor=style.ORANGE, alpha=0.45)
        shown = np.linspace(0, len(pose) - 1, min(PATH_POINTS, len(pose))).astype(int)
        for robot in range(pose.shape[1]):
            _path(axes, pose[shown, robot, :2], style.colour(robot))
            _robot(axes, seen.config, pose[0, robot], style.colour(robot), fill=False)
            _robot(axes, seen.config, pose[-1, robot], style.colour(robot), fill=True)
        axes.set_title(_outcome(seen, episode), fontweight="normal", fontsize=9)
        return picture


def occupancy(run: Run | Recording, genome: int | None = None) -> Picture:
    """Return where a team's robots spend their time, over all tests; the box as it stands at each end.

    Args:
        run: Or tests that :func:`swarmevo.analysis.assessment.watch` recorded.
        genome: Its id; None: the first of the front over all trials.
    """
    seen = _recording(run, genome)
    places = seen.telemetry.pose[..., :2].reshape(-1, 2)
    places = places[np.isfinite(places[:, 0])]  # until an episode's end
    half = seen.config.arena.size / 2
    cells = int(np.ceil(2 * half / CELL))
    edges = np.linspace(-half, half, cells + 1)
    share, _, _ = np.histogram2d(places[:, 0], places[:, 1], bins=(edges, edges))
    share *= 100 / len(places)
    with style.picture(5.2, 4.5) as picture:
        axes = picture.add_subplot()
        _arena(axes, seen.config)
        top = max(float(np.quantile(share[share > 0], 0.99)), 1e-9)  # one hot cell must not hide the others
        image = axes.imshow(
            share.T,
            origin="lower",
            extent=(-half, half, -half, half),
            cmap=OCCUPANCY,
            norm=PowerNorm(0.5, 0, top),  # so that where they pass is seen beside where they stay
            zorder=1,
            interpolation="nearest",
        )
        for end in seen.episodes.box_pose:
            _box(axes, seen.config, end, fill=False, linewidth=0.9)
        bar = picture.colorbar(
            image, ax=axes, shrink=0.75, label=f"share of the robots' time in {CELL * 100:g} cm cells (%)"
        )
        bar.outline.set_visible(False)
        axes.set_title(
            f"{text.count(len(seen.episodes), 'test')}, {text.horizon(seen.config.episode.horizon)} each",
            fontweight="normal",
            fontsize=9,
        )
        return picture


def _shown_steps(seen: Recording, episode: int) -> int:
    """Return how many steps of an episode are worth showing: all, or those until shortly after the box is there."""
    push = seen.telemetry.push_time[episode] + AFTERWARDS
    shown = np.nan_to_num(push / seen.telemetry.control_period, nan=np.inf)
    return max(2, round(float(min(shown, seen.episodes.steps[episode]))))


def _recording(run: Run | Recording, genome: int | None) -> Recording:
    if isinstance(run, Recording):
        return run
    with opened(run) as store:
        return assessment.watch(store, genome)


def _outcome(seen: Recording, episode: int) -> str:
    homing, push = seen.telemetry.homing_time[episode], seen.telemetry.push_time[episode]
    home = f"{np.isfinite(homing).sum()} of {len(homing)} robots at the source"
    return f"{home}, box at the wall {text.moment(float(push))}"


def _arena(axes: Axes, settings: Config) -> None:
    """Draw the walls, the target wall thick and green, and the emitter with its range."""
    half = settings.arena.size / 2
    axes.add_patch(
        patches.Rectangle((-half, -half), 2 * half, 2 * half, fill=False, edgecolor=style.INK, linewidth=1.2)
    )
    ends = {"north": ([-half, half], [half, half]), "south": ([-half, half], [-half, -half])}
    ends |= {"east": ([half, half], [-half, half]), "west": ([-half, -half], [-half, half])}
    axes.plot(*ends[settings.arena.target_wall], color=style.GREEN, linewidth=4, solid_capstyle="butt", clip_on=False)
    x, y, _ = settings.emitter.position
    axes.add_patch(patches.Circle((x, y), settings.emitter.range, fill=False, edgecolor=style.PURPLE, linestyle=":"))
    axes.plot(x, y, "*", color=style.PURPLE, markersize=9, zorder=4)
    axes.set(xlim=(-half * 1.02, half * 1.02), ylim=(-half * 1.02, half * 1.02), xlabel="x (m)", ylabel="y (m)")
    axes.set_aspect("equal")
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _box(axes: Axes, settings: Config, pose: FloatArray, **look: Any) -> None:
    length, width = settings.box.size[:2]
    x, y, heading = pose
    look = {"edgecolor": style.INK, "linewidth": 1.2, "zorder": 2} | look
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

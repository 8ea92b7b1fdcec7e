# SPDX-License-Identifier: BSD-3-Clause
"""The paper's figures and ours, with matplotlib: for a notebook, a report or a paper.

Every function takes a run (its folder, or an open :class:`~swarmevo.runs.store.Store`) and returns a figure, which
shows itself in a notebook:

>>> from swarmevo.views import figures
>>> figures.fronts("runs/first")                                # doctest: +SKIP
>>> figures.paths("runs/first").savefig("paths.pdf")            # doctest: +SKIP

Nothing global is touched: no pyplot, no style. Colours are those of Okabe and Ito, which people with any kind of colour
vision can tell apart; lines and markers differ too, for print without colour.
"""

from __future__ import annotations

import io
import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import matplotlib
import moocore
import numpy as np
from matplotlib import patches
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, PowerNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from swarmevo import plugins
from swarmevo.analysis import assessment
from swarmevo.analysis import fronts as pareto
from swarmevo.analysis.assessment import Recording
from swarmevo.config import Config
from swarmevo.errors import StoreError
from swarmevo.protocols import FeedForward, FloatArray, NativeController, Objective
from swarmevo.runs.store import Store

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Run: TypeAlias = Store | str | os.PathLike[str]
"""An open run, or its folder."""

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILLION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
"""Okabe and Ito, Color Universal Design (2008)."""
CYCLE: Final = (BLUE, ORANGE, GREEN, VERMILLION, PURPLE, SKY, YELLOW)
"""Of trials and robots: a robot has the same colour in its replay."""
INK: Final = "#1b1b1f"
"""Text, axes and whatever is black in print."""
MARKERS: Final = "osD^vPX*"
"""Of trials; one more than colours, so that the pairs of both begin anew after 56 trials only."""
STYLES: Final = ("-", "--", "-.", ":")

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

SENSORS: Final = (
    *(f"ps{i}" for i in range(8)),
    "box left", "box mid-left", "box mid-right", "box right",
    "RF",
    "bias",
)  # fmt: skip
"""Names of a network's inputs."""
WHEELS: Final = ("left wheel", "right wheel")

_STYLE: Final[Any] = {  # matplotlib types the names of its settings one by one
    "font.family": "sans-serif",
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.facecolor": "none",
    "figure.facecolor": "white",
    "grid.color": INK,
    "grid.alpha": 0.12,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "svg.fonttype": "none",
    "svg.hashsalt": "swarmevo",
    "pdf.fonttype": 42,  # text stays text
}


_GLOBAL_STYLE: Final = re.compile(r"<style[^>]*>\*.*?</style>", re.DOTALL)
"""Of matplotlib's SVG: inside a page it would be the style of all that is there."""


class Picture(Figure):
    """A figure that shows itself in a notebook, without pyplot."""

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=144)
        return buffer.getvalue()


@contextmanager
def _picture(width: float = 5.2, height: float = 3.6) -> Iterator[Picture]:
    """Give a figure to draw on, of ``width`` times ``height`` inches, in our style."""
    with matplotlib.rc_context(_STYLE):
        yield Picture(figsize=(width, height), layout="constrained")


@contextmanager
def _opened(run: Run) -> Iterator[Store]:
    if isinstance(run, Store):
        yield run
        return
    with Store.open(run) as store:
        yield store


def label(objective: Objective) -> str:
    """Return an objective's name as people read it, with the direction that is better."""
    arrow = "more" if objective.direction == "maximise" else "fewer" if _is_count(objective) else "less"
    return f"{objective.name.replace('_', ' ')} ({arrow} is better)"


def _is_count(objective: Objective) -> bool:
    return objective.name.endswith("s")


# ---- fronts ----------------------------------------------------------------------------------------------------------


def fronts(run: Run) -> Picture:
    """Return the front of each trial and, in black, that of all (the paper's Fig. 4)."""
    with _opened(run) as store, _picture() as picture:
        axes = picture.add_subplot()
        _plane_axes(axes, store.objectives)
        shown = [_points(store, pareto.front(store, trial)) for trial in store.trials()]
        for trial, points in zip(store.trials(), shown, strict=True):
            style: dict[str, Any] = {
                "color": _colour(trial),
                "marker": MARKERS[trial % len(MARKERS)],
                "linestyle": "none",
            }
            axes.plot(*points.T, **style, markersize=5, alpha=0.85, label=f"trial {trial}", zorder=3)
        front = _points(store, pareto.front(store))
        if len(store.objectives) == 2:
            end = _worst(store.objectives, np.concatenate(shown))
            _staircase(axes, store.objectives, front, end, color=INK, linewidth=1.8, zorder=2, label="global front")
        axes.plot(*front.T, "o", markersize=10, markerfacecolor="none", markeredgecolor=INK, zorder=4)
        _legend(axes, len(store.trials()) + 1)
        return picture


def attainment(run: Run) -> Picture:
    """Return which trade-offs any, half and all of the trials attained.

    Raises:
        ValueError: The run has not two objectives.
    """
    with _opened(run) as store, _picture() as picture:
        objectives, trials = store.objectives, store.trials()
        if len(objectives) != 2:
            raise ValueError(f"attainment: expected a run with two objectives, got {len(objectives)}")
        sets = [_points(store, pareto.front(store, trial)) for trial in trials]
        signs = np.array([-1.0 if o.direction == "maximise" else 1.0 for o in reversed(objectives)])
        numbers = np.repeat(np.arange(len(sets)), [len(points) for points in sets])
        shares = {"any trial": 100 / len(sets), "half of the trials": 50.0, "all trials": 100.0}
        surfaces = moocore.eaf(np.concatenate(sets) * signs, numbers, percentiles=sorted(set(shares.values())))
        axes = picture.add_subplot()
        _plane_axes(axes, objectives)
        looks = zip(shares.items(), (GREEN, BLUE, VERMILLION), STYLES, strict=False)
        for (name, share), colour, style in looks:
            surface = surfaces[np.isclose(surfaces[:, 2], share)][:, :2] * signs
            end = _worst(objectives, np.concatenate(sets))
            _staircase(axes, objectives, surface, end, color=colour, linestyle=style, linewidth=1.8, label=name)
        _legend(axes, 3)
        return picture


def hypervolume(run: Run) -> Picture:
    """Return the hypervolume of each trial over the generations and, in black, its median."""
    with _opened(run) as store, _picture() as picture:
        axes = picture.add_subplot()
        curves = [[step.hypervolume for step in pareto.history(store, trial)] for trial in store.trials()]
        for trial, curve in zip(store.trials(), curves, strict=True):
            style = STYLES[trial // len(CYCLE) % len(STYLES)]
            axes.plot(curve, color=_colour(trial), linestyle=style, linewidth=1.3, label=f"trial {trial}")
        common = min(map(len, curves), default=0)
        if len(curves) > 1 and common > 1:
            median = np.median([curve[:common] for curve in curves], axis=0)
            axes.plot(median, color=INK, linewidth=4, alpha=0.3, zorder=1.5, label="median")
        axes.set(xlabel="generation", ylabel="hypervolume")
        axes.set_ylim(bottom=0)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        _legend(axes, len(curves) + 1)
        return picture


def evolution(run: Run, trial: int | None = None) -> Picture:
    """Return one trial's individuals over generations, second and first objective (the paper's Fig. 3).

    Args:
        run: With at least two objectives.
        trial: None: the one with the largest hypervolume.

    Raises:
        ValueError: The run has one objective only.
    """
    with _opened(run) as store, _picture(5.2, 4.4) as picture:
        if len(store.objectives) < 2:
            raise ValueError("evolution: expected a run with at least two objectives, got 1")
        chosen = _best_trial(store) if trial is None else trial
        with matplotlib.rc_context({"grid.color": f"{INK}20"}):  # in 3-D, the grid's alpha is not asked for
            axes: Any = picture.add_subplot(projection="3d")
        clouds = [(s.number, _plane(s.objectives)) for s in store.summaries(chosen)]
        generations = np.repeat([number for number, _ in clouds], [len(points) for _, points in clouds])
        points = np.concatenate([points for _, points in clouds])
        best = np.concatenate([_is_front(store.objectives, points) for _, points in clouds])
        axes.scatter(generations[~best], *points[~best].T, s=7, color=SKY, alpha=0.6, linewidths=0, depthshade=False)
        axes.scatter(
            generations[best], *points[best].T, c=generations[best], cmap="viridis", s=16, alpha=1, depthshade=False,
            edgecolors=INK, linewidths=0.3,
        )  # fmt: skip
        first, second = store.objectives[:2]
        axes.set(xlabel="generation", ylabel=second.name.replace("_", " "), zlabel=first.name.replace("_", " "))
        axes.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
        picture.suptitle(f"trial {chosen}; outlined: not dominated in their generation", fontsize=9)
        for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
            axis.set_pane_color((0.5, 0.5, 0.5, 0.06))
        axes.view_init(elev=22, azim=-58)
        axes.set_box_aspect((1.25, 1, 0.85), zoom=0.92)
        return picture


def _plane(objectives: FloatArray) -> FloatArray:
    """Return ``(n, 2)`` of ``(n, m)``: the second objective across, the first one up."""
    return objectives[:, 1::-1]


def _points(store: Store, front: Sequence[pareto.FrontPoint]) -> FloatArray:
    """Return ``(n, 2)``: where a front's points stand; with one objective the trial goes across."""
    if len(store.objectives) == 1:
        return np.array([[point.trial, *point.objectives.values()] for point in front]).reshape(-1, 2)
    return _plane(np.array([list(point.objectives.values()) for point in front]).reshape(-1, len(store.objectives)))


def _plane_axes(axes: Axes, objectives: Sequence[Objective]) -> None:
    axes.set_ylabel(label(objectives[0]))
    axes.set_xlabel(label(objectives[1]) if len(objectives) > 1 else "trial")
    whole = len(objectives) == 1 or _is_count(objectives[1])
    axes.xaxis.set_major_locator(MaxNLocator(integer=True) if whole else MaxNLocator(nbins=8))
    axes.margins(0.06)


def _staircase(axes: Axes, objectives: Sequence[Objective], points: FloatArray, end: float, **style: Any) -> None:
    """Draw the edge of what two objectives' front dominates, as far as ``end`` in the second objective."""
    best_first = points[np.argsort(points[:, 0] * (1 if objectives[1].direction == "minimise" else -1))]
    axes.plot([*best_first[:, 0], end], [*best_first[:, 1], best_first[-1, 1]], drawstyle="steps-post", **style)


def _worst(objectives: Sequence[Objective], points: FloatArray) -> float:
    """Return the worst second objective among the points."""
    return float(points[:, 0].max() if objectives[1].direction == "minimise" else points[:, 0].min())


def _is_front(objectives: Sequence[Objective], plane: FloatArray) -> Any:
    maximised = [objective.direction == "maximise" for objective in objectives[1::-1]]
    return moocore.is_nondominated(plane, maximise=maximised, keep_weakly=True)


def _best_trial(store: Store) -> int:
    if not store.trials():
        raise StoreError(f"{store.folder}: expected at least one generation, but none is stored yet")
    return max(store.trials(), key=lambda trial: pareto.history(store, trial)[-1].hypervolume)


def _colour(number: int) -> str:
    return CYCLE[number % len(CYCLE)]


def _legend(axes: Axes, entries: int) -> None:
    """Put the legend inside, or, when it is long, beside the axes."""
    if entries <= 5:
        axes.legend(loc="best")
    else:
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), borderaxespad=0)


# ---- behaviour -------------------------------------------------------------------------------------------------------


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
    with _picture(4.4, 4.5) as picture:
        axes = picture.add_subplot()
        _arena(axes, seen.config)
        _box(axes, seen.config, box[0], fill=False, linestyle="--")
        _box(axes, seen.config, box[-1], facecolor=ORANGE, alpha=0.45)
        shown = np.linspace(0, len(pose) - 1, min(PATH_POINTS, len(pose))).astype(int)
        for robot in range(pose.shape[1]):
            _path(axes, pose[shown, robot, :2], _colour(robot))
            _robot(axes, seen.config, pose[0, robot], _colour(robot), fill=False)
            _robot(axes, seen.config, pose[-1, robot], _colour(robot), fill=True)
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
    half = seen.config.arena.size / 2
    cells = int(np.ceil(2 * half / CELL))
    edges = np.linspace(-half, half, cells + 1)
    share, _, _ = np.histogram2d(places[:, 0], places[:, 1], bins=(edges, edges))
    share *= 100 / len(places)
    with _picture(5.2, 4.5) as picture:
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
        tests = len(seen.episodes)
        axes.set_title(
            f"{tests} test{'s' * (tests > 1)}, {seen.config.episode.horizon:g} s each", fontweight="normal", fontsize=9
        )
        return picture


def _shown_steps(seen: Recording, episode: int) -> int:
    """Return how many steps of an episode are worth showing: all, or those until shortly after the box is there."""
    push = seen.telemetry.push_time[episode] + AFTERWARDS
    period, horizon = seen.telemetry.control_period, seen.config.episode.horizon
    return max(2, round(float(np.nan_to_num(push, nan=horizon)) / period))


def _recording(run: Run | Recording, genome: int | None) -> Recording:
    if isinstance(run, Recording):
        return run
    with _opened(run) as store:
        return assessment.watch(store, genome)


def _outcome(seen: Recording, episode: int) -> str:
    homing, push = seen.telemetry.homing_time[episode], seen.telemetry.push_time[episode]
    home = f"{np.isfinite(homing).sum()} of {len(homing)} robots at the source"
    return f"{home}, box at the wall {f'after {push:.1f} s' if np.isfinite(push) else 'never'}"


def _arena(axes: Axes, settings: Config) -> None:
    """Draw the walls, the target wall thick and green, and the emitter with its range."""
    half = settings.arena.size / 2
    axes.add_patch(patches.Rectangle((-half, -half), 2 * half, 2 * half, fill=False, edgecolor=INK, linewidth=1.2))
    ends = {"north": ([-half, half], [half, half]), "south": ([-half, half], [-half, -half])}
    ends |= {"east": ([half, half], [-half, half]), "west": ([-half, -half], [-half, half])}
    axes.plot(*ends[settings.arena.target_wall], color=GREEN, linewidth=4, solid_capstyle="butt", clip_on=False)
    x, y, _ = settings.emitter.position
    axes.add_patch(patches.Circle((x, y), settings.emitter.range, fill=False, edgecolor=PURPLE, linestyle=":"))
    axes.plot(x, y, "*", color=PURPLE, markersize=9, zorder=4)
    axes.set(xlim=(-half * 1.02, half * 1.02), ylim=(-half * 1.02, half * 1.02), xlabel="x (m)", ylabel="y (m)")
    axes.set_aspect("equal")
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _box(axes: Axes, settings: Config, pose: FloatArray, **style: Any) -> None:
    length, width = settings.box.size[:2]
    x, y, heading = pose
    style = {"edgecolor": INK, "linewidth": 1.2, "zorder": 2} | style
    corner = (x - length / 2, y - width / 2)
    axes.add_patch(
        patches.Rectangle(corner, length, width, angle=np.degrees(heading), rotation_point="center", **style)
    )


def _path(axes: Axes, points: FloatArray, colour: str) -> None:
    """Draw a path that becomes stronger with time."""
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


# ---- the network -----------------------------------------------------------------------------------------------------


def network(run: Run, genome: int | None = None) -> Picture:
    """Return an individual's network: what is switched on, weights as lines. Of a team of networks, the first robot's.

    Args:
        run: Whose controller is a :class:`~swarmevo.protocols.FeedForward` network.
        genome: Its id; None: the first of the front over all trials.

    Raises:
        ValueError: The controller is something else.
    """
    with _opened(run) as store:
        chosen = assessment.watched(store, genome)[0]
        nets = _networks(store.config, store.genome(chosen))
    if nets is None:
        raise ValueError("network: expected a controller that makes FeedForward networks; this run's does not")
    hidden = np.flatnonzero(nets.hidden_switch[0])
    into, out = nets.input_hidden[0, hidden], nets.hidden_output[0]
    weights_out = out[:, [*hidden, *range(len(nets.hidden_switch[0]), out.shape[1])]]  # the bias comes last
    with _picture(5.2, 4.2) as picture:
        axes = picture.add_subplot()
        _draw_network(axes, into, weights_out, hidden.tolist(), nets.bias)
        return picture


def _networks(settings: Config, genome: FloatArray) -> FeedForward | None:
    """Return an individual's networks, one, or one for each robot; None: the controller makes something else."""
    ((name, options),) = settings.controller.items()
    controller: Any = plugins.create("controller", name, options)
    if not isinstance(controller, NativeController):
        return None
    made = controller.policies(genome.reshape(settings.team.robots if settings.team.genomes == "individual" else 1, -1))
    return made if isinstance(made, FeedForward) else None


def has_network(settings: Config, genome: FloatArray) -> bool:
    """Whether :func:`network` can draw a genome."""
    return _networks(settings, genome) is not None


def _draw_network(axes: Axes, into: FloatArray, out: FloatArray, hidden: Sequence[int], bias: bool) -> None:
    """Draw weights ``into`` ``(hidden, inputs)`` and ``out`` ``(2, hidden + bias)``."""
    names = SENSORS if bias else SENSORS[:-1]
    left, middle, right = (_column(n) for n in (len(names), len(hidden), len(WHEELS)))
    largest = max(np.abs(into).max(initial=0), np.abs(out).max(initial=0), 1e-9)
    for h, y in enumerate(middle):
        for i, start in enumerate(left):
            _weight(axes, (0, start), (1, y), into[h, i] / largest)
    for o, y in enumerate(right):
        for h, start in enumerate(middle):
            _weight(axes, (1, start), (2, y), out[o, h] / largest)
        if bias:
            _weight(axes, (0, left[-1]), (2, y), out[o, -1] / largest)
    kinds = [BLUE] * 8 + [ORANGE] * 4 + [PURPLE] + [INK]
    for name, y, colour in zip(names, left, kinds, strict=False):
        _node(axes, (0, y), colour, name, "right")
    for number, y in zip(hidden, middle, strict=True):
        _node(axes, (1, y), GREEN, f"{number}", "above")
    for name, y in zip(WHEELS, right, strict=True):
        _node(axes, (2, y), INK, name, "left")
    for name, colour in (("excites", BLUE), ("inhibits", VERMILLION)):
        axes.plot([], [], color=colour, linewidth=2, label=name)
    axes.legend(loc="lower center", ncols=2, bbox_to_anchor=(0.5, -0.04))
    on = f"{len(hidden)} hidden neuron{'s' * (len(hidden) != 1)} switched on"
    axes.set_title(f"{on}; the widest line is a weight of {largest:.2g}", fontweight="normal", fontsize=9, loc="center")
    axes.set(xlim=(-0.55, 2.55), ylim=(-0.1, 1.05))
    axes.axis("off")


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
    colour, strength = (BLUE if weight > 0 else VERMILLION), abs(weight)
    axes.plot(*zip(start, end, strict=True), color=colour, linewidth=0.3 + 2.7 * strength, alpha=0.25 + 0.7 * strength)


# ---- all of them -----------------------------------------------------------------------------------------------------


def every(run: Run) -> Iterator[tuple[str, Picture]]:
    """Yield name and figure of all that a run can show."""
    with _opened(run) as store:
        yield "fronts", fronts(store)
        yield "hypervolume", hypervolume(store)
        if len(store.objectives) > 1:
            yield "evolution", evolution(store)
        if len(store.objectives) == 2 and len(store.trials()) > 1:
            yield "attainment", attainment(store)
        seen = assessment.watch(store)
        yield "paths", paths(seen)
        yield "occupancy", occupancy(seen)
        if has_network(seen.config, store.genome(seen.genome)):
            yield "network", network(store)


def write(run: Run, folder: str | os.PathLike[str], formats: Sequence[str] = ("pdf", "png")) -> list[Path]:
    """Write every figure of a run into a folder, which is made; return the files.

    Raises:
        OSError: The folder cannot be written.
    """
    Path(folder).mkdir(parents=True, exist_ok=True)
    files = []
    for name, picture in every(run):
        for kind in formats:
            files.append(Path(folder) / f"{name}.{kind}")
            picture.savefig(files[-1], dpi=300, metadata=_undated(kind))
    return files


def _undated(kind: str) -> dict[str, Any]:
    """Return metadata that make the same figure the same file."""
    return {"pdf": {"CreationDate": None}, "svg": {"Date": None}}.get(kind, {})


def svg(picture: Figure) -> str:
    """Return a figure as SVG for a page: without a background, ink in the page's own colour, blue as its ``--blue``."""
    buffer = io.StringIO()
    with matplotlib.rc_context(_STYLE):
        picture.savefig(buffer, format="svg", transparent=True, metadata=_undated("svg"))
    text = buffer.getvalue().replace(INK, "currentColor").replace(BLUE.lower(), f"var(--blue, {BLUE})")
    return _GLOBAL_STYLE.sub("", text[text.index("<svg") :])

# SPDX-License-Identifier: BSD-3-Clause
"""Convergence with the time step: simple motions against closed formulas, else against one of two references.

What meets walls, the box or others is held against the independent reference, a drive's free motion without a formula
against the articulated model: that is a test of the drive alone, since both drives share the rest.

Everything here is without noise, and nothing is chaotic, so trajectories are compared point by point at the control
steps.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks import reference
from benchmarks.cases import changed
from benchmarks.twin import REFERENCE_STEP
from benchmarks.validation_meetings import reference_poses, simulated_poses
from benchmarks.validation_scenes import (
    AWAY,
    DRIVES,
    NORTH,
    TIME_STEPS,
    Drive,
    Pose,
    Section,
    Settings,
    in_parallel,
    millimetres,
    standing,
    table,
    traction,
    turn,
)
from swarmevo.config import Config
from swarmevo.protocols import FloatArray

REFERENCE: tuple[Drive, float] = ("articulated", 0.0005)
LARGEST_WAY_ERROR, LARGEST_TURN_ERROR = 0.01, np.radians(1.0)
"""What the default time step must keep: of the travelled distance, and [rad]."""

_FAST, _SLOW = 0.9, 0.4  # commands


# ---- closed formulas -------------------------------------------------------------------------------------------------


def rim_speed(command: float) -> float:
    """Return the speed of a wheel's rim [m/s]."""
    robot = Config().robot
    return command * robot.top_speed * robot.wheel_radius


def pressed() -> float:
    """Return how far a robot that pushes presses its bumper in [m]."""
    return traction() / Config().robot.bumper_stiffness


def driven_way(times: FloatArray, speed: float) -> FloatArray:
    """Return the way of a robot from rest: friction accelerates it until it has its wheels' speed [m].

    In the end ``v^2 / (2 p)`` short of ``v t``, with the acceleration ``p = traction / m``.
    """
    pull = traction() / Config().robot.mass
    until = speed / pull
    return np.where(times < until, pull * times**2 / 2, speed * times - speed**2 / (2 * pull))


def driven_turn(times: FloatArray, rate: float) -> FloatArray:
    """Return the angle of a robot that spins on the spot from rest [rad].

    Both wheels carry half the weight at half the axle from the centre; a solid cylinder's inertia is ``m r^2 / 2``.
    """
    physics, robot = Config().physics, Config().robot
    pull = physics.wheel_friction * physics.gravity * robot.axle_length / robot.radius**2  # [rad/s^2]
    until = rate / pull
    return np.where(times < until, pull * times**2 / 2, rate * times - rate**2 / (2 * pull))


def sliding_way(times: FloatArray, speed: float) -> FloatArray:
    """Return the way of a box that slides until friction stops it, ``v^2 / (2 mu g)`` in the end [m]."""
    physics = Config().physics
    brake = physics.box_friction * physics.gravity
    moving = np.minimum(times, speed / brake)
    return speed * moving - brake * moving**2 / 2


def arc_radius(left: float, right: float) -> float:
    """Return the radius of the circle that a robot drives for two commands [m]."""
    return Config().robot.axle_length / 2 * (right + left) / (right - left)


# ---- the cases -------------------------------------------------------------------------------------------------------


class Trajectory(NamedTuple):
    """Poses of the robots and of the box at the control steps: ``(steps, bodies, 3)``, the box last."""

    poses: FloatArray

    def way(self) -> float:
        """Return the longest distance that a body travelled [m]."""
        steps = np.linalg.norm(np.diff(self.poses[..., :2], axis=0), axis=-1)
        return float(steps.sum(axis=0).max())


Formula = Callable[[FloatArray, FloatArray], FloatArray]
"""From start poses ``(bodies, 3)`` and times ``(steps,)`` to poses ``(steps, bodies, 3)``."""


@dataclass(frozen=True)
class Case:
    """A motion to be compared."""

    name: str
    starts: Sequence[Pose]
    commands: Sequence[tuple[float, float]]
    duration: float
    box: Pose = AWAY
    box_speed: float = 0.0  # northwards [m/s]
    formula: Formula | None = None
    meets: bool = False
    """Walls, the box or another robot."""

    def config(self) -> Config:
        """Return the scene, with the default physics."""
        return changed(
            standing(self.starts),
            box={"pose": self.box, "velocity": (0.0, self.box_speed, 0.0)},
            episode={"horizon": self.duration},
        )

    def run(self, of: tuple[Drive, float]) -> Trajectory:
        """Return what the simulator makes of it."""
        config = changed(self.config(), physics={"drive": of[0], "time_step": of[1]})
        return Trajectory(simulated_poses(config, self.commands))

    def truth(self) -> Trajectory:
        """Return the formula's trajectory, or that of the independent reference, or of the articulated model."""
        if self.meets:
            return Trajectory(reference_poses(self.config(), self.commands))
        if self.formula is None:
            return self.run(REFERENCE)
        period = Config().episode.control_period
        times = np.arange(round(self.duration / period), dtype=np.float64) * period
        return Trajectory(self.formula(np.array([*self.starts, self.box]), times))


def _at_start(starts: FloatArray, times: FloatArray) -> FloatArray:
    return np.tile(starts, (len(times), 1, 1))


def _straight(starts: FloatArray, times: FloatArray) -> FloatArray:
    poses = _at_start(starts, times)
    poses[:, 0, 1] += driven_way(times, rim_speed(_FAST))
    return poses


def _spin(starts: FloatArray, times: FloatArray) -> FloatArray:
    poses = _at_start(starts, times)
    rate = 2 * rim_speed(_SLOW) / Config().robot.axle_length
    poses[:, 0, 2] = turn(poses[:, 0, 2] + driven_turn(times, rate))
    return poses


def _slide(starts: FloatArray, times: FloatArray) -> FloatArray:
    poses = _at_start(starts, times)
    poses[:, 1, 1] += sliding_way(times, 0.5)
    return poses


def _pushers(n: int) -> list[Pose]:
    return [(0.08 * (i - (n - 1) / 2), 0.06, NORTH) for i in range(n)]


ARC = (_SLOW, 2 * _SLOW)
CASES = (
    Case("straight drive", [(0.0, -0.4, NORTH)], [(_FAST, _FAST)], 3.0, formula=_straight),
    Case("spin", [(0.0, -0.2, NORTH)], [(-_SLOW, _SLOW)], 3.0, formula=_spin),
    Case("arc", [(0.0, -0.3, NORTH)], [ARC], 5.0),
    Case("tight arc", [(0.0, -0.3, NORTH)], [(_FAST, _FAST / 3)], 5.0),
    Case("straight to a wall", [(0.3, -0.3, 0.0)], [(_FAST, _FAST)], 3.0, meets=True),
    Case("two robots head-on", [(-0.1, -0.3, 0.0), (0.1, -0.3, np.pi)], [(_FAST, _FAST)] * 2, 3.0, meets=True),
    Case("three push", _pushers(3), [(_FAST, _FAST)] * 3, 2.0, box=(0.0, 0.2, 0.0), meets=True),
    Case("four push", _pushers(4), [(_FAST, _FAST)] * 4, 2.0, box=(0.0, 0.2, 0.0), meets=True),
    Case("sliding box", [(-0.4, -0.4, NORTH)], [(0.0, 0.0)], 1.0, box=(0.0, 0.0, 0.0), box_speed=0.5, formula=_slide),
    Case("slantwise to a wall", [(0.3, -0.3, 0.3)], [(_FAST, _FAST)], 3.0, meets=True),
)


# ---- the comparison --------------------------------------------------------------------------------------------------


class Difference(NamedTuple):
    """The largest deviation from the truth in a case."""

    length: float
    """[m]"""
    share: float
    """Of the longest way in the case."""
    angle: float
    """[rad]"""

    def is_within_limits(self) -> bool:
        """Whether both errors keep to their limits."""
        return self.share <= LARGEST_WAY_ERROR and self.angle <= LARGEST_TURN_ERROR


def difference(found: Trajectory, truth: Trajectory) -> Difference:
    """Compare two trajectories."""
    apart = np.linalg.norm(found.poses[..., :2] - truth.poses[..., :2], axis=-1).max()
    way = truth.way()
    angle = np.abs(turn(found.poses[..., 2] - truth.poses[..., 2])).max()
    # Who spins on the spot travels nowhere; that case is about its angle.
    return Difference(float(apart), float(apart) / way if way > 0 else 0.0, float(angle))


def measured_radius(found: Trajectory) -> float:
    """Return the radius of the first robot's circle, from chords and turns after its start [m]."""
    steady = found.poses[5:, 0]
    chords = np.linalg.norm(np.diff(steady[:, :2], axis=0), axis=-1)
    turns = np.abs(turn(np.diff(steady[:, 2])))
    return float(chords.sum() / (2 * np.sin(turns / 2)).sum())


Differences = dict[tuple[str, Drive, float], Difference]
Steps = Mapping[Drive, Sequence[float]]


def compare(settings: Settings, steps: Steps = TIME_STEPS) -> Differences:
    """Return every case's difference from its truth, by case name, drive and time step."""
    reference.build()  # before threads race to do so
    truths = {
        case.name: truth for case, truth in zip(CASES, in_parallel(Case.truth, CASES, settings.threads), strict=True)
    }
    tasks = [
        (case, of) for case in CASES for of in [REFERENCE, *((name, step) for name in DRIVES for step in steps[name])]
    ]
    found = in_parallel(lambda task: task[0].run(task[1]), tasks, settings.threads)
    return {
        (case.name, *of): difference(trajectory, truths[case.name])
        for (case, of), trajectory in zip(tasks, found, strict=True)
    }


def steps_within_limits(differences: Differences, of: Drive) -> list[float]:
    """Return the time steps at which a drive keeps to the limits in every case."""
    steps = sorted({step for _, name, step in differences if name == of})
    return [
        s for s in steps if all(differences[name, of, s].is_within_limits() for name in (case.name for case in CASES))
    ]


# ---- the page --------------------------------------------------------------------------------------------------------


def section(settings: Settings) -> Section:
    """Measure, and write this part of the page."""
    differences = compare(settings)
    text = "\n".join([_head(), _tables(differences), _verdict(differences), _formulas(settings), _slantwise(settings)])
    return Section(text, {"convergence.png": _figure(differences)})


def _head() -> str:
    return f"""## Convergence with the time step

Simple motions without noise, compared at every control step. The truth is a closed formula where there is one (marked
with \\*: the start from rest at the friction limit, the even motion after it, the box's braking); the independent
reference (`native/reference`) where robots meet something (\\+); and for arcs the articulated model at
{REFERENCE[1] * 1000:g} ms, which is a test of the drive alone. That model's own error is the table's first column.
Errors in length are the largest of any body at any time, as a share of the longest way in the case; the limits are
{100 * LARGEST_WAY_ERROR:g} % and {np.degrees(LARGEST_TURN_ERROR):g} degree.
"""


def _tables(differences: Differences) -> str:
    pages = []
    for name in DRIVES:
        columns: list[tuple[Drive, float]] = [REFERENCE, *((name, step) for step in TIME_STEPS[name])]
        head = ["case", *(f"{step * 1000:g} ms" for _, step in columns)]
        head[1] = f"articulated, {REFERENCE[1] * 1000:g} ms"
        marked = [(case, f"{case.name}{' *' if case.formula else ' +' if case.meets else ''}") for case in CASES]
        ways = [
            [label, *(f"{100 * differences[case.name, *of].share:.2f}" for of in columns)] for case, label in marked
        ]
        turns = [
            [label, *(f"{np.degrees(differences[case.name, *of].angle):.2f}" for of in columns)]
            for case, label in marked
        ]
        pages.append(f"Error in length [%], `{name}`:\n\n{table(head, ways)}")
        pages.append(f"Error in heading [degrees], `{name}`:\n\n{table(head, turns)}")
    return "\n".join(pages)


def _verdict(differences: Differences) -> str:
    default = Config().physics.time_step
    lines = []
    for name in DRIVES:
        good = steps_within_limits(differences, name)
        listed = ", ".join(f"{step * 1000:g}" for step in good) + " ms" if good else "no time step measured"
        lines.append(f"- `{name}` keeps to both limits in all cases at: {listed}.")
    is_largest = default == max(steps_within_limits(differences, "driven_contacts"), default=0)
    return (
        "\n".join(lines)
        + f"""

The default time step of {default * 1000:g} ms is the largest allowed one that does:
**{"yes" if is_largest else "no"}**.
It can be that large because steps are of second order (`native/src/world/average.hpp`,
`native/src/world/compliant.hpp`), and cut where bumpers meet or speeds change much. The articulated model does neither:
its errors grow in proportion to the step, as those of any first-order method. Where it pushes it differs from the level
models at any step, since its robots pitch when they meet the box.

![Errors against the time step](validation/convergence.png)
"""
    )


class Figures(NamedTuple):
    """A quantity with a formula, and how to read it off a trajectory."""

    name: str
    formula: float
    case: str
    read: Callable[[Trajectory], float]


def figures_with_formulas() -> list[Figures]:
    """Return single quantities in [mm] and [deg/s]."""
    period = Config().episode.control_period
    straight, slide = np.array([3.0 - period]), np.array([1.0])
    rate = 2 * rim_speed(_SLOW) / Config().robot.axle_length
    radius, half = Config().robot.radius, Config().arena.size / 2
    return [
        Figures(
            "straight: v t - v^2 (1 + mu h / a) / (2 mu g) [mm]",
            millimetres(driven_way(straight, rim_speed(_FAST)).item()),
            "straight drive",
            lambda t: millimetres(t.poses[-1, 0, 1] - t.poses[0, 0, 1]),
        ),
        Figures(
            "spin: 2 v / axle [deg/s]",
            float(np.degrees(rate)),
            "spin",
            lambda t: float(np.degrees(turn(t.poses[-1, 0, 2] - t.poses[-2, 0, 2])) / period),
        ),
        Figures(
            "arc: radius [mm]",
            millimetres(arc_radius(*ARC)),
            "arc",
            lambda t: millimetres(measured_radius(t)),
        ),
        Figures(
            "tight arc: radius [mm]",
            millimetres(-arc_radius(_FAST, _FAST / 3)),
            "tight arc",
            lambda t: millimetres(measured_radius(t)),
        ),
        Figures(
            "sliding box: v^2 / (2 mu g) [mm]",
            millimetres(sliding_way(slide, 0.5).item()),
            "sliding box",
            lambda t: millimetres(t.poses[-1, -1, 1] - t.poses[0, -1, 1]),
        ),
        Figures(
            "at a wall: bumper pressed by mu m g / (1 + mu h / a) / k [mm]",
            millimetres(pressed()),
            "straight to a wall",
            lambda t: millimetres(t.poses[-1, 0, 0] + radius - half),
        ),
        Figures(
            "head-on: both bumpers together [mm]",
            millimetres(2 * pressed()),
            "two robots head-on",
            lambda t: millimetres(2 * radius - float(np.linalg.norm(t.poses[-1, 1, :2] - t.poses[-1, 0, :2]))),
        ),
    ]


def _formulas(settings: Settings) -> str:
    columns: list[tuple[Drive, float]] = [REFERENCE, ("driven_contacts", 0.005), ("driven_contacts", 0.05)]
    by_name = {case.name: case for case in CASES}
    rows = []
    for name, formula, case, read in figures_with_formulas():
        found = in_parallel(by_name[case].run, columns, settings.threads)
        rows.append([name, f"{formula:.3f}", *(f"{read(trajectory):.3f}" for trajectory in found)])
    head = ["quantity", "formula", *(f"{name}, {step * 1000:g} ms" for name, step in columns)]
    return f"Single figures against their formulas:\n\n{table(head, rows)}"


def _slantwise(settings: Settings) -> str:
    case = CASES[-1]  # slantwise to a wall
    columns = [REFERENCE, *((name, step) for name in DRIVES for step in TIME_STEPS[name])]
    found = in_parallel(case.run, columns, settings.threads)
    ends = np.array([trajectory.poses[-1, 0] for trajectory in [case.truth(), *found]])
    ends[:, :2] *= 1000
    ends[:, 2] = np.degrees(ends[:, 2])
    rows = [
        [name, f"{step * 1000:g}", *(f"{value:.1f}" for value in end)]
        for (name, step), end in zip([("independent reference", REFERENCE_STEP), *columns], ends, strict=True)
    ]
    return f"""A robot that drives into a wall at a slant slides along it, while friction with the wall turns it to face
the wall and its wheels slip. After {case.duration:g} s:

{table(["model", "time step [ms]", "x [mm]", "y [mm]", "heading [deg]"], rows)}"""


def _figure(differences: Differences) -> Figure:
    figure = Figure(figsize=(9, 4.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    for index, case in enumerate(CASES):
        for name, style in zip(DRIVES, ("-", "--"), strict=True):
            line = [differences[case.name, name, step] for step in TIME_STEPS[name]]
            label = case.name if style == "-" else None
            _curve(left, name, [100 * d.share for d in line], style, index, label)
            _curve(right, name, [float(np.degrees(d.angle)) for d in line], style, index, None)
    left.axhline(100 * LARGEST_WAY_ERROR, color="0.3", linewidth=0.8)
    right.axhline(np.degrees(LARGEST_TURN_ERROR), color="0.3", linewidth=0.8)
    left.set(ylabel="error in length [% of the way]", ylim=(5e-3, 100))
    right.set(ylabel="error in heading [degrees]", ylim=(5e-3, 100))
    left.plot([], [], "k-", label="driven contacts")
    left.plot([], [], "k--", label="articulated")
    figure.legend(loc="outside lower center", ncols=4, fontsize=8)
    return figure


def _curve(axes: Axes, of: Drive, values: Sequence[float], style: str, index: int, label: str | None) -> None:
    milliseconds = [1000 * step for step in TIME_STEPS[of]]
    axes.loglog(milliseconds, np.maximum(values, 1e-9), style, color=f"C{index}", marker=".", label=label)
    shown = [1000 * step for step in TIME_STEPS["driven_contacts"]]
    axes.set_xticks(shown, ["" if step == 25 else f"{step:g}" for step in shown])
    axes.minorticks_off()
    axes.set_xlabel("time step [ms]")

# SPDX-License-Identifier: BSD-3-Clause
"""At least three robots: how many it takes to move the box, against friction, time step and drive.

The force balance is ``n F > mu_box M g`` with a robot's traction ``F = mu_wheel m g / (1 + mu_wheel h / a)``: friction
at the floor, a height ``h`` below the push and the centre of mass, lays ``F h / a`` of the weight on a caster, ``a``
from the axle.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from benchmarks.validation_scenes import (
    DRIVES,
    NORTH,
    TIME_STEPS,
    Drive,
    Pose,
    Section,
    Settings,
    changed,
    drive,
    in_parallel,
    keys,
    millimetres,
    sound,
    standing,
    table,
    wheels,
)
from swarmevo.config import Config
from swarmevo.protocols import FloatArray
from swarmevo.simulator import Scene, simulate

TEAMS = (1, 2, 3, 4, 5)
STILL = 0.005
"""A box that moved less than this in a minute was not moved [m]."""
AT_WALL = 0.002
"""Distance to the wall at which the box has been pushed to it [m]."""
MINUTE = 60.0
BOX_Y = 0.2
MARGIN = 0.1
"""That the default ratio must keep from either end of the window."""

_CLOSE = 0.002  # distance between robots' and box's faces at the start [m]


def compared() -> list[tuple[Drive, float]]:
    """Return the default physics and the reference, for the smaller tables."""
    return [(Config().physics.drive, Config().physics.time_step), ("articulated", 0.005)]


def default_ratio() -> float:
    """Return the default mu_box / mu_wheel."""
    physics = Config().physics
    return physics.box_friction / physics.wheel_friction


def way_to_wall() -> float:
    """Return how far the box must go [m]."""
    config = Config()
    return config.arena.size / 2 - config.box.size[1] / 2 - BOX_Y


def row(robots: int) -> list[Pose]:
    """Return poses of robots side by side before the middle of the box's long face, looking at it.

    Five are wider than the face: the outer two stand before its corners.
    """
    config = Config()
    spacing = 0.08 if robots < 5 else 2 * config.robot.radius + 0.0005
    y = BOX_Y - config.box.size[1] / 2 - config.robot.radius - _CLOSE
    return [(spacing * (i - (robots - 1) / 2), y, NORTH) for i in range(robots)]


class Push(NamedTuple):
    """A row of robots at full speed against the box for a minute."""

    robots: int
    ratio: float
    drive: Drive
    time_step: float


def scene(push: Push) -> Config:
    """Return the config of a push, without noise."""
    config = standing(row(push.robots))
    friction = push.ratio * config.physics.wheel_friction
    return changed(
        config,
        box={"pose": (0.0, BOX_Y, 0.0)},
        physics={"drive": push.drive, "time_step": push.time_step, "box_friction": friction},
        episode={"horizon": MINUTE},
    )


def way_of_box(push: Push) -> float:
    """Return how far the box got towards the wall [m]."""
    done = drive(scene(push), np.ones((push.robots, 2)))
    return float(done.box_pose[0, 1]) - BOX_Y


def is_still(push: Push) -> bool:
    """Whether the robots did not move the box."""
    return abs(way_of_box(push)) < STILL


def is_at_wall(push: Push) -> bool:
    """Whether the robots pushed the box to the wall."""
    return way_of_box(push) > way_to_wall() - AT_WALL


def boundary(holds: Callable[[float], bool], inside: float, outside: float, precision: float) -> float:
    """Return the last ratio on the way from ``inside`` to ``outside`` at which something still holds, by bisection."""
    while abs(outside - inside) > precision:
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if holds(middle) else (inside, middle)
    return inside


class Window(NamedTuple):
    """The ratios at which two robots do not move the box and three push it to the wall."""

    drive: Drive
    time_step: float
    low: float
    high: float

    def margins(self, ratio: float) -> tuple[float, float]:
        """Return how far a ratio lies above the lower and below the upper end, relative to itself."""
        return 1 - self.low / ratio, self.high / ratio - 1


def balance(robots: int) -> float:
    """Return the ratio of frictions at which the box holds out against so many robots."""
    config = Config()
    mu, robot = config.physics.wheel_friction, config.robot
    return robots * robot.mass / (1 + mu * robot.centre_of_mass / robot.caster_offset) / config.box.mass


def window(of: tuple[Drive, float], precision: float = 0.005) -> Window:
    """Find the window of a drive and time step."""
    ratio = default_ratio()
    low = boundary(lambda r: is_still(Push(2, r, *of)), ratio, 0.9 * balance(2), precision)
    high = boundary(lambda r: is_at_wall(Push(3, r, *of)), ratio, 1.2 * balance(3), precision)
    return Window(*of, low, high)


# ---- with noise ------------------------------------------------------------------------------------------------------


def noisy_ways(robots: int, episodes: int, of: tuple[Drive, float]) -> FloatArray:
    """Return how far the box got with the default noise and start jitter ``(episodes,)`` [m]."""
    defaults = Config()
    exact = scene(Push(robots, default_ratio(), *of))
    # Room for the jitter: neighbours and box a little farther.
    gap = 2 * np.sqrt(2) * defaults.team.start_jitter[0] + 0.001
    spacing = 2 * defaults.robot.radius + gap
    y = row(robots)[0][1] - gap
    poses = tuple((spacing * (i - (robots - 1) / 2), y, NORTH) for i in range(robots))
    config = changed(
        exact,
        noise=defaults.noise.model_dump(),
        team={"start_poses": poses, "start_jitter": defaults.team.start_jitter},
    )
    drivers = np.tile(np.arange(robots, dtype=np.uint32), (episodes, 1))
    done = sound(simulate(Scene(config), wheels(np.ones((robots, 2))), keys(episodes), drivers))
    return done.box_pose[:, 1] - BOX_Y


# ---- at a slant ------------------------------------------------------------------------------------------------------


SLANTS = (0.0, 5.0, 15.0, 30.0, 45.0)
"""By how much robots look past the face's normal, towards the middle [deg]."""


def slanted_way(robots: int, slant: float, of: tuple[Drive, float]) -> float:
    """Return how far robots that push at a slant [rad] get the box in a minute [m]."""
    push = Push(robots, default_ratio(), *of)
    poses = tuple((x, y, heading + np.sign(x) * slant) for x, y, heading in row(robots))
    done = drive(changed(scene(push), team={"start_poses": poses}), np.ones((robots, 2)))
    return float(done.box_pose[0, 1]) - BOX_Y


# ---- at a corner -----------------------------------------------------------------------------------------------------


def corner_scenes() -> dict[str, list[Pose]]:
    """Return poses around a box in the arena's middle: robots before the ends of its faces."""
    config = Config()
    away_x = config.box.size[0] / 2 + config.robot.radius + _CLOSE
    away_y = config.box.size[1] / 2 + config.robot.radius + _CLOSE
    end_x, end_y = 0.12, 0.07
    return {
        "one, end of a long face": [(end_x, -away_y, NORTH)],
        "one, end of a short face": [(-away_x, -end_y, 0.0)],
        "two, same end of a long face": [(end_x, -away_y, NORTH), (end_x - 0.072, -away_y, NORTH)],
        "two, both faces of one corner": [(end_x, -away_y, NORTH), (away_x, -end_y, np.pi)],
        "two, a couple on the long faces": [(end_x, -away_y, NORTH), (-end_x, away_y, -NORTH)],
        "two, a couple on the short faces": [(-away_x, -end_y, 0.0), (away_x, end_y, np.pi)],
    }


def corner_push(poses: list[Pose], of: tuple[Drive, float]) -> tuple[float, float]:
    """Return by how much the box moved [m] and turned [rad] in a minute."""
    config = changed(
        standing(poses),
        box={"pose": (0.0, 0.0, 0.0)},
        physics={"drive": of[0], "time_step": of[1]},
        episode={"horizon": MINUTE},
    )
    done = drive(config, np.ones((len(poses), 2)), ("box",))
    assert done.telemetry.box is not None
    turned = float(np.unwrap(done.telemetry.box[0, :, 2])[-1])
    return float(np.hypot(*done.box_pose[0, :2])), turned


# ---- the page --------------------------------------------------------------------------------------------------------


def section(settings: Settings) -> Section:
    """Measure, and write this part of the page."""
    combinations = [(drive, step) for drive in DRIVES for step in TIME_STEPS[drive]]
    ratio = default_ratio()
    pushes = [Push(robots, ratio, *of) for of in combinations for robots in TEAMS]
    ways = dict(zip(pushes, in_parallel(way_of_box, pushes, settings.threads), strict=True))
    windows = in_parallel(window, combinations, settings.threads)
    text = "\n".join(
        [
            _head(),
            _default_table(ways),
            _window_table(windows, ratio),
            _slant_table(settings),
            _noise_table(settings),
            _corner_table(settings),
        ]
    )
    return Section(text, {"calibration.png": _figure(windows, settings)})


def _head() -> str:
    return f"""## At least three robots

The paper's box takes at least three robots. `n` robots move it if `n F > mu_box M g`. A robot's traction `F` is less
than `mu_wheel m g`: its own friction at the floor tips it onto a caster, which then carries `F h / a` (`h`: height of
the push and of the centre of mass; `a`: from the axle to the caster), so `F = mu_wheel m g / (1 + mu_wheel h / a)`. Two
robots move the box below `mu_box / mu_wheel` = {balance(2):.3f} and three below {balance(3):.3f}. The default ratio is
{default_ratio():g}. Robots stand in a row {1000 * _CLOSE:g} mm before the middle of the long face, look at it and drive
at full speed for {MINUTE:g} s, without noise; the wall is {millimetres(way_to_wall()):.0f} mm away. Below
{millimetres(STILL):g} mm the box counts as not moved. (The face is too short for five: the outer two push at its
corners.)
"""


def _default_table(ways: dict[Push, float]) -> str:
    combinations = dict.fromkeys((push.drive, push.time_step) for push in ways)
    rows = [
        [drive, f"{step * 1000:g}", *(f"{millimetres(ways[p]):.2f}" for p in ways if (p.drive, p.time_step) == of)]
        for of in combinations
        for drive, step in [of]
    ]
    still = all(abs(way) < STILL for push, way in ways.items() if push.robots < 3)
    pushed = all(way > way_to_wall() - AT_WALL for push, way in ways.items() if push.robots >= 3)
    return f"""Way of the box [mm] at the default ratio, by the number of robots:

{table(["drive", "time step [ms]", *(f"n = {n}" for n in TEAMS)], rows)}
One and two robots never move it: **{_yes(still)}**. Three, four and five push it to the wall: **{_yes(pushed)}**. What
one and two gain is the blow of their arrival and the softness of the contacts.
"""


def _window_table(windows: list[Window], ratio: float) -> str:
    rows = []
    for found in windows:
        below, above = found.margins(ratio)
        rows.append(
            [
                found.drive,
                f"{found.time_step * 1000:g}",
                f"{found.low:.3f}",
                f"{found.high:.3f}",
                f"{100 * below:.0f} %",
                f"{100 * above:.0f} %",
            ]
        )
    low, high = max(found.low for found in windows), min(found.high for found in windows)
    least = min(min(found.margins(ratio)) for found in windows)
    return f"""The window of `mu_box / mu_wheel` in which two do not move the box and three push it to the wall, found
by bisection to 0.005, and the default's distance from its ends:

{table(["drive", "time step [ms]", "from", "to", "margin below", "margin above"], rows)}
Common to all: {low:.3f} to {high:.3f}. The default {ratio:g} keeps {100 * least:.0f} % from either end at every time
step that it is allowed and with both drives (asked: {100 * MARGIN:.0f} %: **{_yes(least >= MARGIN)}**). The lower end
lies a little above the force balance because near it two robots' arrival alone shoves the box by millimetres before
friction stops it.

![Way of the box against the friction ratio](validation/calibration.png)
"""


def _slant_table(settings: Settings) -> str:
    columns = compared()
    teams = (2, 3)
    tasks = [(n, float(np.radians(slant)), of) for slant in SLANTS for n in teams for of in columns]
    ways = iter(in_parallel(lambda task: slanted_way(*task), tasks, settings.threads))
    rows = [[f"{slant:g}", *(f"{millimetres(next(ways)):.1f}" for _ in teams for _ in columns)] for slant in SLANTS]
    head = ["slant [deg]", *(f"n = {n}, {name}, {step * 1000:g} ms" for n in teams for name, step in columns)]
    two = [float(row[1 + i]) for row in rows[1:] for i in range(len(columns))]
    return f"""Robots that look past the normal of the face, the outer ones towards the middle. Way of the box [mm] in
{MINUTE:g} s:

{table(head, rows)}
Two robots at a slant leave the box where it is: **{_yes(max(two) < millimetres(STILL))}**. (Wheels that slip follow
Coulomb's circle, see `native/src/world_grip.hpp`. ODE alone limits the friction along and across the rolling
direction separately: a robot at a slant would pull 1.4 times as hard, and two would shift the box.)
"""


def _noise_table(settings: Settings) -> str:
    episodes = max(20, settings.pairs // 10)
    tasks = [(of, n) for of in compared() for n in TEAMS]
    ways = in_parallel(lambda task: noisy_ways(task[1], episodes, task[0]), tasks, settings.threads)
    rows = [
        [
            of[0],
            f"{of[1] * 1000:g}",
            n,
            f"{millimetres(float(np.median(way))):.1f}",
            f"{millimetres(float(way.max())):.1f}",
            f"{100 * np.mean(way >= STILL):.0f} %",
            f"{100 * np.mean(way > way_to_wall() - AT_WALL):.0f} %",
        ]
        for (of, n), way in zip(tasks, ways, strict=True)
    ]
    head = ["drive", "time step [ms]", "n", "median way [mm]", "largest way [mm]", "moved", "pushed to the wall"]
    return f"""With the default noise of wheels and start poses rows do not stay rows and slants come by themselves.
{episodes} episodes each:

{table(head, rows)}"""


def _corner_table(settings: Settings) -> str:
    columns = compared()
    scenes = corner_scenes()
    tasks = [(poses, of) for poses in scenes.values() for of in columns]
    results = in_parallel(lambda task: corner_push(*task), tasks, settings.threads)
    rows = []
    for i, name in enumerate(scenes):
        row: list[object] = [name]
        for moved, turned in results[len(columns) * i : len(columns) * (i + 1)]:
            row += [f"{millimetres(moved):.1f}", f"{np.degrees(turned):.1f}"]
        rows.append(row)
    head = ["robots"]
    for name, step in columns:
        head += [f"{name}, {step * 1000:g} ms: moved [mm]", "turned [deg]"]
    return f"""One and two robots at the box's corners, aligned with the faces' normals, after {MINUTE:g} s:

{table(head, rows)}
What this rests on: the box stands on its four corners. A box that pressed evenly on the floor would resist turning with
about half the torque, and a couple of two robots would turn it.
"""


def _yes(fact: bool) -> str:
    return "yes" if fact else "no"


def _figure(windows: list[Window], settings: Settings) -> Figure:
    """Draw the way of the box against the ratio, for both drives."""
    shown: dict[Drive, float] = {"driven_contacts": Config().physics.time_step, "articulated": 0.01}
    ratios = np.round(np.linspace(0.1, 1.2, 34), 3)
    pushes = [Push(n, float(r), name, step) for name, step in shown.items() for n in TEAMS for r in ratios]
    ways = dict(zip(pushes, in_parallel(way_of_box, pushes, settings.threads), strict=True))
    figure = Figure(figsize=(8, 4.5), layout="constrained")
    axes = figure.add_subplot()
    low, high = max(found.low for found in windows), min(found.high for found in windows)
    axes.axvspan(low, high, color="0.9", label="window")
    axes.axvline(default_ratio(), color="0.4", linestyle=":", label="default")
    axes.axhline(millimetres(STILL), color="0.4", linewidth=0.8)
    axes.text(ratios[0], millimetres(STILL) * 1.1, f"{millimetres(STILL):g} mm", color="0.4", fontsize=8)
    for n in TEAMS:
        for (name, step), style in zip(shown.items(), ("-", "--"), strict=True):
            way = [max(millimetres(ways[Push(n, float(r), name, step)]), 0.01) for r in ratios]
            label = f"{n} robot{'s' if n > 1 else ''}" if style == "-" else None
            axes.plot(ratios, way, style, color=f"C{n - 1}", marker=".", markersize=4, label=label)
    axes.plot([], [], "k-", label=f"driven contacts, {shown['driven_contacts'] * 1000:g} ms")
    axes.plot([], [], "k--", label=f"articulated, {shown['articulated'] * 1000:g} ms")
    axes.set(xlabel="mu_box / mu_wheel", ylabel=f"way of the box in {MINUTE:g} s [mm]", yscale="log", ylim=(0.05, 400))
    figure.legend(loc="outside right upper", fontsize=8)
    return figure

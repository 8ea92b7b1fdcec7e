# SPDX-License-Identifier: BSD-3-Clause
"""At least three robots: how many it takes to move the box, against friction, time step and drive.

Beside the middle of a face the box turns before it is shoved: what its four feet hold out against is their limit curve,
which is computed here from its definition, independently of ``native/src/world/limit_curve.cpp``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from benchmarks.cases import changed
from benchmarks.validation_scenes import (
    DRIVES,
    NORTH,
    TIME_STEPS,
    Drive,
    Pose,
    Section,
    Settings,
    drive,
    in_parallel,
    keys,
    millimetres,
    sound,
    standing,
    table,
    traction,
    turn,
    wheels,
)
from swarmevo.config import Config
from swarmevo.protocols import FloatArray
from swarmevo.simulation import Scene, simulate

TEAMS = (1, 2, 3, 4, 5)
STILL = 0.005
"""A box that moved less than this in a minute was not moved [m]."""
AT_WALL = 0.002
"""Distance to the wall at which the box has been pushed to it [m]."""
MINUTE = 60.0
BOX_Y = 0.2
MARGIN = 0.05
"""That the default ratio must keep from either end of the window."""
CURVE_ERROR = 0.01
"""Largest difference of a measured threshold from that of the limit curve, as a share."""
GAVE_WAY = 0.001
"""Way of a corner by which a box that is pressed has given way [m]."""

_CLOSE = 0.002  # distance between robots' and box's faces at the start [m]
_GENTLE = 0.02  # command of robots that come to press the box without a blow: they push with all their traction
_PRESSED = 20.0  # time for which they do [s]
_OPEN = 3.0  # size of an arena whose walls are out of reach [m]


def compared() -> list[tuple[Drive, float]]:
    """Return the default physics and the reference, for the smaller tables."""
    return [(Config().physics.drive, Config().physics.time_step), ("articulated", 0.004)]


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


def scene(push: Push, duration: float = MINUTE) -> Config:
    """Return the config of a push, without noise."""
    config = standing(row(push.robots))
    friction = push.ratio * config.physics.wheel_friction
    return changed(
        config,
        box={"pose": (0.0, BOX_Y, 0.0)},
        physics={"drive": push.drive, "time_step": push.time_step, "box_friction": friction},
        episode={"horizon": duration},
    )


def way_of_box(push: Push, duration: float = MINUTE) -> float:
    """Return how far the box got towards the wall [m]."""
    done = drive(scene(push, duration), np.ones((push.robots, 2)))
    return float(done.box_pose[0, 1]) - BOX_Y


def is_still(push: Push) -> bool:
    """Whether the robots did not move the box."""
    return abs(way_of_box(push)) < STILL


def is_at_wall(push: Push, duration: float = MINUTE) -> bool:
    """Whether the robots pushed the box to the wall."""
    return way_of_box(push, duration) > way_to_wall() - AT_WALL


def boundary(holds: Callable[[float], bool], inside: float, outside: float, precision: float) -> float:
    """Return the last ratio on the way from ``inside`` to ``outside`` at which something still holds, by bisection."""
    while abs(outside - inside) > precision:
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if holds(middle) else (inside, middle)
    return inside


# ---- the limit curve -------------------------------------------------------------------------------------------------


def corners() -> FloatArray:
    """Return the box's feet ``(4, 2)`` [m]."""
    length, width, _ = Config().box.size
    return np.array([(x, y) for x in (-length / 2, length / 2) for y in (-width / 2, width / 2)])


def even_feet(along: int = 56, across: int = 36) -> FloatArray:
    """Return feet all over the floor below the box ``(n, 2)`` [m]: with enough of them it presses evenly."""
    length, width, _ = Config().box.size
    x, y = ((np.arange(n) + 0.5) / n - 0.5 for n in (along, across))
    return np.array([(length * a, width * b) for a in x for b in y])


def holding_friction(feet: FloatArray, load: FloatArray) -> float:
    """Return what friction feet ``(n, 2)`` that carry alike need in all to hold out against force and torque [N].

    They hold if no motion gains more work from the load than friction takes: ``load . t <= L sum |velocity of a foot|``
    for all ``t``, each a turn about some centre, one far away if it is a translation. The motion that gains most for
    its friction is looked for on a grid of all motions, then on ever finer ones around the best.
    """
    reach = np.hypot(*feet.T).max()

    def gained(turning: FloatArray, direction: FloatArray) -> FloatArray:  # by each motion, for a unit of friction
        x, y, spin = np.cos(turning) * np.cos(direction), np.cos(turning) * np.sin(direction), np.sin(turning) / reach
        slips = np.hypot(x[..., None] - spin[..., None] * feet[:, 1], y[..., None] + spin[..., None] * feet[:, 0])
        return np.asarray((load[0] * x + load[1] * y + load[2] * spin) / slips.mean(axis=-1), dtype=np.float64)

    best, span, found = np.zeros(2), np.array([np.pi / 2, np.pi]), 0.0
    for points, narrower in [(41, 0.1), *[(13, 0.6)] * 30]:
        sides = (best + np.multiply.outer(np.linspace(-1, 1, points), span)).T
        grid = np.meshgrid(*sides, indexing="ij")
        gains = gained(*grid)
        where = np.unravel_index(gains.argmax(), gains.shape)
        best, found = np.array([side[where] for side in grid]), float(gains[where])
        span = span * narrower
    return found


class Place(NamedTuple):
    """Where robots stand side by side and press the box."""

    robots: int
    face: Literal["long", "short"]
    where: Literal["middle", "end"]

    def __str__(self) -> str:
        number = ("one", "two", "three")[self.robots - 1]
        return f"{number} {'in the middle' if self.where == 'middle' else 'at an end'} of a {self.face} face"

    def along(self) -> FloatArray:
        """Return the robots' distances from the middle of the face [m]; at its end the outermost stands before it."""
        length, width, _ = Config().box.size
        spacing = 2 * Config().robot.radius + 0.0005
        room = (length if self.face == "long" else width) / 2 - spacing * (self.robots - 1) / 2
        middle = room if self.where == "end" else 0.0
        return np.asarray(middle + spacing * (np.arange(self.robots) - (self.robots - 1) / 2), dtype=np.float64)

    def poses(self) -> list[Pose]:
        """Return where they start, around a box in the arena's middle."""
        length, width, _ = Config().box.size
        before = Config().robot.radius + _CLOSE / 4
        if self.face == "long":
            return [(float(x), -width / 2 - before, NORTH) for x in self.along()]
        return [(-length / 2 - before, float(y), 0.0) for y in self.along()]

    def threshold(self, feet: FloatArray) -> float:
        """Return the ratio of frictions below which they move a box on such feet."""
        config = Config()
        force, lever = self.robots * traction(), self.along().sum() * traction()
        load = np.array([0.0, force, lever] if self.face == "long" else [force, 0.0, -lever])
        weight = config.box.mass * config.physics.gravity
        return holding_friction(feet, load) / weight / config.physics.wheel_friction

    def gives_way(self, ratio: float, of: tuple[Drive, float]) -> bool:
        """Whether a corner of the box leaves its place when they press it."""
        config = changed(
            standing(self.poses()),
            arena={"size": _OPEN},
            box={"pose": (0.0, 0.0, 0.0)},
            emitter={"position": (0.0, 0.0, Config().emitter.position[2])},
            physics={"drive": of[0], "time_step": of[1], "box_friction": ratio * Config().physics.wheel_friction},
            episode={"horizon": _PRESSED},
        )
        done = drive(config, np.full((self.robots, 2), _GENTLE), ("box",))
        turned = np.abs(turn(done.telemetry.box[0, -1, 2]))
        return bool(np.hypot(*done.box_pose[0, :2]) + turned * np.hypot(*config.box.size[:2]) / 2 > GAVE_WAY)

    def measured(self, of: tuple[Drive, float], precision: float = 0.0005) -> float:
        """Return the threshold that robots find, by bisection within a tenth of the limit curve's."""
        expected = self.threshold(corners())
        return boundary(lambda ratio: self.gives_way(ratio, of), 0.9 * expected, 1.1 * expected, precision)


PLACES = tuple(
    Place(robots, face, where) for face in ("long", "short") for where in ("middle", "end") for robots in (1, 2, 3)
)
TWO = (Place(2, "long", "middle"), Place(2, "long", "end"), Place(2, "short", "end"))
"""Pushes that must not move the box."""


# ---- the window ------------------------------------------------------------------------------------------------------


class Window(NamedTuple):
    """The ratios at which two robots nowhere move the box and three in the middle push it to the wall."""

    drive: Drive
    time_step: float
    lows: tuple[float, ...]
    """Below which each push of ``TWO`` moves it."""
    high: float

    @property
    def low(self) -> float:
        """Below which any of them does."""
        return max(self.lows)

    def margins(self, ratio: float) -> tuple[float, float]:
        """Return how far a ratio lies above the lower and below the upper end, relative to itself."""
        return 1 - self.low / ratio, self.high / ratio - 1


def balance(robots: int) -> float:
    """Return the ratio of frictions at which the box holds out against so many robots in the middle of a face."""
    config = Config()
    return robots * traction() / (config.box.mass * config.physics.gravity) / config.physics.wheel_friction


def window(of: tuple[Drive, float], precision: float = 0.001) -> Window:
    """Find the window of a drive and time step."""
    lows = tuple(place.measured(of, precision) for place in TWO)
    high = boundary(lambda r: is_at_wall(Push(3, r, *of), _PRESSED), default_ratio(), 1.2 * balance(3), precision)
    return Window(*of, lows, high)


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
            _curve_table(settings),
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
robots in the middle move the box below `mu_box / mu_wheel` = {balance(2):.3f} and three below {balance(3):.3f}. Two at
one end of its long face turn it below {TWO[1].threshold(corners()):.3f}: its four feet hold less against force and
torque together. The default ratio is {default_ratio():g}. Robots stand in a row {1000 * _CLOSE:g} mm before the middle
of the long face, look at it and drive at full speed for {MINUTE:g} s, without noise; the wall is
{millimetres(way_to_wall()):.0f} mm away. Below {millimetres(STILL):g} mm the box counts as not moved. (The face is too
short for five: the outer two push at its corners.)
"""


def _default_table(ways: dict[Push, float]) -> str:
    combinations = dict.fromkeys((push.drive, push.time_step) for push in ways)
    rows = [
        [drive, f"{step * 1000:g}", *(_fixed(millimetres(ways[p]), 2) for p in ways if (p.drive, p.time_step) == of)]
        for of in combinations
        for drive, step in [of]
    ]
    still = all(abs(way) < STILL for push, way in ways.items() if push.robots < 3)
    pushed = all(way > way_to_wall() - AT_WALL for push, way in ways.items() if push.robots >= 3)
    return f"""Way of the box [mm] at the default ratio, by the number of robots:

{table(["drive", "time step [ms]", *(f"n = {n}" for n in TEAMS)], rows)}
One and two robots never move it: **{_yes(still)}**. Three, four and five push it to the wall: **{_yes(pushed)}**. (On
the articulated drive what sticks creeps by up to 10 um/s, `kCreep` in `native/src/world/constants.hpp`.)
"""


def _window_table(windows: list[Window], ratio: float) -> str:
    rows = []
    for found in windows:
        below, above = found.margins(ratio)
        rows.append(
            [
                found.drive,
                f"{found.time_step * 1000:g}",
                *(f"{low:.3f}" for low in found.lows),
                f"{found.high:.3f}",
                f"{100 * below:.1f} %",
                f"{100 * above:.1f} %",
            ]
        )
    low, high = max(found.low for found in windows), min(found.high for found in windows)
    least = min(min(found.margins(ratio)) for found in windows)
    head = ["drive", "time step [ms]", *(f"{place} move it below" for place in TWO)]
    head += ["three push it to the wall up to", "margin below", "margin above"]
    return f"""The window of `mu_box / mu_wheel` in which two robots nowhere move the box and three in the middle push
it to the wall, found by bisection to 0.001, and the default's distance from its ends. The two press the box without a
blow: they creep up to it at {100 * _GENTLE:g} % of full speed, at which wheels that slip push as hard as at any.

{table(head, rows)}
Common to all: {low:.3f} to {high:.3f}. The default {ratio:g} keeps {100 * least:.1f} % from either end at every time
step that it is allowed and with both drives (asked: {100 * MARGIN:.0f} %: **{_yes(least >= MARGIN)}**).

![Way of the box against the friction ratio](validation/calibration.png)
"""


def curve_errors(columns: list[tuple[Drive, float]], settings: Settings) -> dict[Place, list[float]]:
    """Return by how much the threshold of each place and column differs from the limit curve's, as a share."""
    tasks = [(place, of) for place in PLACES for of in columns]
    found = iter(in_parallel(lambda task: task[0].measured(task[1]), tasks, settings.threads))
    return {place: [next(found) / place.threshold(corners()) - 1 for _ in columns] for place in PLACES}


def _curve_table(settings: Settings) -> str:
    columns = [(Config().physics.drive, 0.005), *compared()]
    errors = curve_errors(columns, settings)
    even = {place: place.threshold(even_feet()) for place in PLACES}
    rows = [
        [
            str(place),
            f"{place.threshold(corners()):.4f}",
            *(f"{place.threshold(corners()) * (1 + error):.4f}" for error in errors[place]),
            f"{even[place]:.4f}",
        ]
        for place in PLACES
    ]
    worst = max(abs(error) for row in errors.values() for error in row)
    head = ["robots that press", "limit curve", *(f"{name}, {step * 1000:g} ms" for name, step in columns)]
    head.append("limit curve, even pressure")
    two, three = (even[place] for place in (Place(2, "long", "end"), Place(3, "long", "middle")))
    return f"""The same from theory: a box stands as long as no motion gains more work from the pushes than its feet
take by friction. This limit curve of its four corners is minimised here by brute force over all centres of rotation.
Ratio of frictions below which robots that stand side by side move the box, the outermost before the very end of the
face if they are at one:

{table(head, rows)}
Measured thresholds are within {100 * worst:.2f} % of the limit curve's (asked: {100 * CURVE_ERROR:g} %:
**{_yes(worst <= CURVE_ERROR)}**).

All this rests on four feet. A box that pressed evenly on the floor (last column, {len(even_feet())} feet) would be
moved by two robots at an end of its long face below {two:.3f}, and three in the middle move it only below {three:.3f}:
{"it has no window" if two >= three else "it has a window as well"}.
"""


def _slant_table(settings: Settings) -> str:
    columns = compared()
    teams = (2, 3)
    tasks = [(n, float(np.radians(slant)), of) for slant in SLANTS for n in teams for of in columns]
    ways = iter(in_parallel(lambda task: slanted_way(*task), tasks, settings.threads))
    rows = [[f"{slant:g}", *(_fixed(millimetres(next(ways)), 1) for _ in teams for _ in columns)] for slant in SLANTS]
    head = ["slant [deg]", *(f"n = {n}, {name}, {step * 1000:g} ms" for n in teams for name, step in columns)]
    two = [float(row[1 + i]) for row in rows[1:] for i in range(len(columns))]
    return f"""Robots that look past the normal of the face, the outer ones towards the middle. Way of the box [mm] in
{MINUTE:g} s:

{table(head, rows)}
Two robots at a slant leave the box where it is: **{_yes(max(two) < millimetres(STILL))}**. (Wheels that slip follow
Coulomb's circle, see `native/src/world/rub.hpp`. ODE alone limits the friction along and across the rolling direction
separately: a robot at a slant would pull 1.4 times as hard, and two would shift the box.)
"""


def _noise_table(settings: Settings) -> str:
    episodes: dict[Drive, int] = {
        "driven_contacts": max(20, settings.pairs // 10),
        "articulated": max(20, settings.pairs // 40),  # they cost sixty times as much
    }
    tasks = [(of, n) for of in compared() for n in TEAMS]
    ways = in_parallel(lambda task: noisy_ways(task[1], episodes[task[0][0]], task[0]), tasks, settings.threads)
    rows = [
        [
            of[0],
            f"{of[1] * 1000:g}",
            n,
            len(way),
            f"{millimetres(float(np.median(way))):.1f}",
            f"{millimetres(float(way.max())):.1f}",
            f"{100 * np.mean(way >= STILL):.0f} %",
            f"{100 * np.mean(way > way_to_wall() - AT_WALL):.0f} %",
        ]
        for (of, n), way in zip(tasks, ways, strict=True)
    ]
    head = ["drive", "time step [ms]", "n", "episodes", "median way [mm]", "largest way [mm]", "moved"]
    return f"""With the default noise of wheels and start poses rows do not stay rows and slants come by themselves:

{table([*head, "pushed to the wall"], rows)}"""


def _corner_table(settings: Settings) -> str:
    columns = compared()
    scenes = corner_scenes()
    tasks = [(poses, of) for poses in scenes.values() for of in columns]
    results = in_parallel(lambda task: corner_push(*task), tasks, settings.threads)
    rows = []
    for i, name in enumerate(scenes):
        row: list[object] = [name]
        for moved, turned in results[len(columns) * i : len(columns) * (i + 1)]:
            row += [_fixed(millimetres(moved), 1), _fixed(float(np.degrees(turned)), 1)]
        rows.append(row)
    head = ["robots"]
    for name, step in columns:
        head += [f"{name}, {step * 1000:g} ms: moved [mm]", "turned [deg]"]
    stays = all(moved < STILL for moved, _ in results)
    return f"""One and two robots at the box's corners, aligned with the faces' normals, at full speed for
{MINUTE:g} s:

{table(head, rows)}
None of them moves it by {millimetres(STILL):g} mm: **{_yes(stays)}**. What two at one end of a long face gain is the
blow of their arrival, {millimetres(_CLOSE):g} mm away: there they are but a few percent short of moving the box.
"""


def _fixed(number: float, digits: int) -> str:
    """Return a number of so many digits, without the sign of a negative zero."""
    return f"{round(number, digits) + 0.0:.{digits}f}"


def _yes(fact: bool) -> str:
    return "yes" if fact else "no"


def _figure(windows: list[Window], settings: Settings) -> Figure:
    """Draw the way of the box against the ratio, for both drives."""
    shown: dict[Drive, float] = {"driven_contacts": Config().physics.time_step, "articulated": 0.004}
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

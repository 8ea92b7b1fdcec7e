# SPDX-License-Identifier: BSD-3-Clause
"""Cylinders, obstacles, arenas of other shapes, and movables that push each other, against the independent reference.

As in ``validation_meetings``: without noise, compared at every control step. What the reference makes of such scenes
was written from docs/scenes.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from benchmarks import reference
from benchmarks.cases import changed
from benchmarks.twin import REFERENCE_STEP
from benchmarks.validation_meetings import (
    LARGEST_TURN_ERROR,
    LARGEST_WAY_ERROR,
    Difference,
    difference,
    longest_way,
    reference_poses,
)
from benchmarks.validation_scenes import (
    NORTH,
    Pose,
    Section,
    Settings,
    drive,
    in_parallel,
    millimetres,
    standing,
    table,
    traction,
)
from swarmevo.config import Config
from swarmevo.config.models import Arena, Movable, Obstacle
from swarmevo.protocols import FloatArray
from swarmevo.simulation.layout import wall_distance

STEPS: Sequence[float] = (0.001, 0.005, 0.02, 0.05)
"""Time steps of the default drive that are compared [s]."""
DEFAULT_STEP = Config().physics.time_step

_FULL, _PARKED = (1.0, 1.0), (0.0, 0.0)
_RADIUS = Config().robot.radius
_NEAR = 1e-4
"""Gap between what touches from the start on [m]."""


# ---- scenes ----------------------------------------------------------------------------------------------------------


def cylinder(diameter: float, mass: float, pose: Pose, velocity: Pose = (0.0, 0.0, 0.0), feet: float = 1.0) -> Movable:
    """Return a cylinder of ``diameter`` [m]."""
    return Movable(
        shape="cylinder", size=(diameter, diameter, 0.03), mass=mass, pose=pose, velocity=velocity, feet=feet
    )


def box(length: float, width: float, mass: float, pose: Pose, velocity: Pose = (0.0, 0.0, 0.0)) -> Movable:
    """Return a box."""
    return Movable(shape="box", size=(length, width, 0.03), mass=mass, pose=pose, velocity=velocity)


def post(diameter: float, x: float, y: float) -> Obstacle:
    """Return a cylinder that stands still."""
    return Obstacle(shape="cylinder", size=(diameter, diameter, 0.1), pose=(x, y, 0.0))


def block(length: float, width: float, pose: Pose) -> Obstacle:
    """Return a box that stands still."""
    return Obstacle(shape="box", size=(length, width, 0.1), pose=pose)


def partition(start: tuple[float, float], end: tuple[float, float]) -> Obstacle:
    """Return a wall."""
    return Obstacle(shape="wall", ends=(start, end))


OPEN = {"size": 3.0}
ROUND = {"shape": "circle", "size": 1.0}
HEXAGON = {
    "shape": "polygon",
    "corners": tuple((0.5 * float(np.cos(a)), 0.5 * float(np.sin(a))) for a in np.pi / 3 * np.arange(6)),
}


@dataclass(frozen=True)
class Case:
    """A scene and what its robots do in it."""

    name: str
    starts: Sequence[Pose]
    movables: Sequence[Movable] = ()
    obstacles: Sequence[Obstacle] = ()
    arena: Mapping[str, Any] = field(default_factory=lambda: OPEN)
    commands: Sequence[tuple[float, float]] | None = None
    """None: all drive at full speed."""
    duration: float = 1.5
    """[s]"""
    bumper: str = "sprung"

    def config(self, time_step: float | None = None) -> Config:
        """Return it with the default physics; the last control step begins at ``duration``."""
        defaults = Config()
        return changed(
            standing(self.starts),
            arena=dict(self.arena),
            scene={"movables": tuple(self.movables), "obstacles": tuple(self.obstacles), "emitters": (), "goals": ()},
            robot={"bumper": self.bumper},
            physics={"time_step": time_step or defaults.physics.time_step},
            episode={"horizon": self.duration + defaults.episode.control_period},
        )

    def held(self) -> Sequence[tuple[float, float]]:
        """Return the robots' commands."""
        return self.commands or [_FULL] * len(self.starts)

    def run(self, time_step: float | None = None) -> FloatArray:
        """Return the library's poses at the control steps: ``(steps, bodies, 3)``, robots first."""
        return _poses(self.config(time_step), self.held())

    def truth(self, reference_step: float = REFERENCE_STEP) -> FloatArray:
        """Return the reference's, likewise."""
        return reference_poses(self.config(), self.held(), time_step=reference_step)

    def difference(self, truth: FloatArray, time_step: float | None = None) -> Difference:
        """Return how far the library is from the reference's poses."""
        return difference(self.run(time_step), truth)

    def articulated(self, time_step: float = 0.001) -> Difference:
        """Return how far the articulated drive is from the reference whose pushes shift the loads of feet."""
        config = changed(self.config(time_step), physics={"drive": "articulated"})
        return difference(_poses(config, self.held()), reference_poses(config, self.held(), shift_loads=True))


def _poses(config: Config, commands: Sequence[tuple[float, float]]) -> FloatArray:
    telemetry = drive(config, commands, ("pose", "movables")).telemetry
    return np.concatenate([telemetry.pose[0], telemetry.movables[0]], axis=1)


def behind(x: float, y: float, off: float = 0.0, gap: float = _NEAR) -> Pose:
    """Return who looks north at a flat side whose middle is (x, y), ``off`` to the east of that."""
    return (x + off, y - _RADIUS - gap, NORTH)


def before(diameter: float, off: float = 0.0, gap: float = _NEAR) -> Pose:
    """Return who looks north at a cylinder in the middle of the arena, ``off`` to the east."""
    return (off, -float(np.sqrt((diameter / 2 + _RADIUS + gap) ** 2 - off**2)), NORTH)


def slantwise(degrees: float, x: float, y: float) -> Pose:
    """Return a pose at (x, y) that looks ``degrees`` to the left of east."""
    return (x, y, float(np.radians(degrees)))


_MIDDLE: Pose = (0.0, 0.0, 0.0)
_LOST: Pose = (-1.4, -1.4, NORTH)

CYLINDERS = (
    Case("one in the middle", [before(0.1)], [cylinder(0.1, 0.06, _MIDDLE)]),
    Case("one 5 mm off the middle", [before(0.1, 0.005)], [cylinder(0.1, 0.06, _MIDDLE)]),
    Case("one 20 mm off the middle", [before(0.1, 0.02)], [cylinder(0.1, 0.06, _MIDDLE)]),
    Case("narrow feet, one 20 mm off", [before(0.1, 0.02)], [cylinder(0.1, 0.06, _MIDDLE, feet=0.3)], duration=0.8),
    Case("rigid bumper, one 20 mm off", [before(0.1, 0.02)], [cylinder(0.1, 0.06, _MIDDLE)], bumper="rigid"),
    Case("two side by side", [before(0.2, 0.037), before(0.2, -0.037)], [cylinder(0.2, 0.13, _MIDDLE)], duration=1.0),
    Case("three, one from the side", [before(0.2, 0.037), before(0.2, -0.037), (0.15, 0.0, np.pi)],
         [cylinder(0.2, 0.15, _MIDDLE)]),
    Case("one in an arc", [before(0.1)], [cylinder(0.1, 0.05, _MIDDLE)], commands=[(0.9, 0.7)]),
    Case("thrown, turning", [_LOST], [cylinder(0.1, 0.05, _MIDDLE, (0.0, 0.3, 4.0))], commands=[_PARKED], duration=1.0),
)  # fmt: skip
"""A cylinder is pushed, or thrown."""

MEETINGS = (
    Case("box into a cylinder", [behind(0, -0.03)], [box(0.1, 0.06, 0.03, _MIDDLE), cylinder(0.08, 0.03, (0, 0.1, 0))]),
    Case("box into a cylinder, 20 mm off", [behind(0, -0.03)],
         [box(0.1, 0.06, 0.03, _MIDDLE), cylinder(0.08, 0.03, (0.02, 0.1, 0))]),
    Case("cylinder into a box, 20 mm off", [before(0.08)],
         [cylinder(0.08, 0.03, _MIDDLE), box(0.12, 0.06, 0.03, (0.02, 0.1, 0))]),
    Case("cylinder into a cylinder, 10 mm off", [before(0.08)],
         [cylinder(0.08, 0.03, _MIDDLE), cylinder(0.08, 0.03, (0.01, 0.1, 0))]),
    Case("box into a box, 30 mm off", [behind(0, -0.03)],
         [box(0.1, 0.06, 0.03, _MIDDLE), box(0.1, 0.06, 0.03, (0.03, 0.1, 0))]),
    Case("box into a box that stands askew", [behind(0, -0.03)],
         [box(0.1, 0.06, 0.03, _MIDDLE), box(0.1, 0.06, 0.03, (0.01, 0.11, 0.5))]),
    Case("row of three boxes, flush", [behind(0, -0.03)],
         [box(0.1, 0.06, 0.02, (0, 0.06 * i, 0)) for i in range(3)]),
    Case("two robots, a box, two cylinders", [behind(0, -0.03, 0.04), behind(0, -0.03, -0.04)],
         [box(0.2, 0.06, 0.06, _MIDDLE), cylinder(0.06, 0.02, (0.05, 0.09, 0)), cylinder(0.06, 0.02, (-0.06, 0.1, 0))]),
    Case("cylinder thrown at a cylinder, 20 mm off", [_LOST],
         [cylinder(0.08, 0.05, _MIDDLE, (0, 0.8, 0)), cylinder(0.08, 0.05, (0.02, 0.1, 0))],
         commands=[_PARKED], duration=1.0),
    Case("box thrown at a box that stands askew", [_LOST],
         [box(0.1, 0.06, 0.05, _MIDDLE, (0, 0.8, 0)), box(0.1, 0.06, 0.05, (0.03, 0.11, 0.5))],
         commands=[_PARKED], duration=1.0),
)  # fmt: skip
"""Movables push each other."""

OBSTACLES = (
    Case("box stopped by a block", [behind(0, -0.03)], [box(0.1, 0.06, 0.03, _MIDDLE)],
         [block(0.2, 0.1, (0, 0.15, 0))]),
    Case("box stopped at one end by a block", [behind(0, -0.03, -0.02)], [box(0.1, 0.06, 0.03, _MIDDLE)],
         [block(0.2, 0.1, (0.13, 0.15, 0))]),
    Case("box stopped by a post, 15 mm off", [behind(0, -0.03)], [box(0.1, 0.06, 0.03, _MIDDLE)],
         [post(0.08, 0.015, 0.13)]),
    Case("box past a post", [behind(0, -0.03)], [box(0.1, 0.06, 0.03, _MIDDLE)], [post(0.08, 0.08, 0.13)]),
    Case("cylinder stopped by a wall, slantwise", [before(0.08)], [cylinder(0.08, 0.03, _MIDDLE)],
         [partition((-0.2, 0.05), (0.2, 0.25))]),
    Case("cylinder past a post, 20 mm off", [before(0.08)], [cylinder(0.08, 0.03, _MIDDLE)], [post(0.08, 0.02, 0.13)]),
    Case("cylinder thrown at a wall, slantwise", [_LOST], [cylinder(0.08, 0.05, _MIDDLE, (0, 1.0, 0))],
         [partition((-0.2, 0.0), (0.2, 0.2))], commands=[_PARKED], duration=1.0),
    Case("robot at a block", [behind(0, 0)], (), [block(0.3, 0.05, (0, 0.1, 0))]),
    Case("robot along a block at 30 degrees, round its end", [slantwise(30, 0, 0)], (),
         [block(0.15, 0.05, (0.1, 0.09, 0))], duration=2.5),
    Case("robot at a post, 10 mm off", [behind(0, 0)], (), [post(0.1, 0.01, 0.1)]),
    Case("robot at a post, 40 mm off", [behind(0, 0)], (), [post(0.1, 0.04, 0.1)]),
    Case("robot along a wall at 60 degrees", [slantwise(60, 0, 0)], (), [partition((-0.2, 0.1), (0.4, 0.1))]),
    Case("robot at the end of a wall", [behind(0, 0, 0.01)], (), [partition((0, 0.1), (0, 0.3))]),
)  # fmt: skip
"""Obstacles stop what comes."""

ARENAS = (
    Case("robot at a round wall", [slantwise(20, 0.3, 0.0)], arena=ROUND, duration=2.0),
    Case("robot at a round wall, 150 mm off", [slantwise(0, 0.1, 0.15)], arena=ROUND, duration=3.5),
    Case("robot along a round wall", [slantwise(0, 0.0, 0.35)], arena=ROUND, duration=3.0),
    Case("robot at a hexagon's side", [slantwise(30, 0.2, 0.1)], arena=HEXAGON, duration=2.5),
    Case("robot along a hexagon's side into its corner", [slantwise(-10, 0.15, 0.2)], arena=HEXAGON, duration=3.0),
    Case("cylinder to a round wall, 100 mm off", [(0.2, 0.1, 0.0)], [cylinder(0.08, 0.03, (0.28, 0.1, 0))],
         arena=ROUND, duration=2.0),
    Case("box to a round wall, 100 mm off", [(0.2, 0.1, 0.0)], [box(0.06, 0.1, 0.03, (0.28, 0.1, 0))],
         arena=ROUND, duration=2.0),
    Case("cylinder to a hexagon's side, slantwise", [(0.1, 0.1, 0.0)], [cylinder(0.08, 0.03, (0.2, 0.1, 0))],
         arena=HEXAGON, duration=2.5),
    Case("box to a hexagon's side, slantwise", [(0.1, 0.1, 0.0)], [box(0.06, 0.1, 0.03, (0.2, 0.1, 0))],
         arena=HEXAGON, duration=2.5),
    Case("box thrown at a round wall", [(0.0, 0.0, 0.0)], [box(0.06, 0.1, 0.05, (0.3, 0.1, 0), (1.2, 0, 0))],
         arena=ROUND, commands=[_PARKED], duration=1.0),
)  # fmt: skip
"""Arenas of other shapes."""

CASES = (*CYLINDERS, *MEETINGS, *OBSTACLES, *ARENAS)


# ---- the comparison --------------------------------------------------------------------------------------------------


class Compared(NamedTuple):
    """A case's way in the reference, and the deviations from it."""

    case: Case
    way: float
    """[m]"""
    turn: float
    """Of the body that turns most [rad]."""
    own: Difference
    """Of the reference from itself at half its step."""
    differences: dict[float, Difference]
    """By time step."""
    articulated: Difference | None
    """None: it refuses rigid bumpers."""


def keeps(found: Difference) -> bool:
    """Whether a case is within the limits."""
    return found.share <= LARGEST_WAY_ERROR and found.angle <= LARGEST_TURN_ERROR


def compare(cases: Sequence[Case], settings: Settings, steps: Sequence[float] = STEPS) -> list[Compared]:
    """Compare cases."""
    reference.build()  # before threads race to do so

    def compared(case: Case) -> Compared:
        truth = case.truth()
        turned = float(np.abs(truth[-1, :, 2] - truth[0, :, 2]).max())
        own = difference(case.truth(REFERENCE_STEP / 2), truth)
        articulated = case.articulated() if case.bumper == "sprung" else None
        found = {s: case.difference(truth, s) for s in steps}
        return Compared(case, longest_way(truth), turned, own, found, articulated)

    return in_parallel(compared, cases, settings.threads)


# ---- how heavy a cylinder robots move --------------------------------------------------------------------------------

CREEPING, CREEPING_TIME = (0.1, 0.1), 3.0
"""Commands at which wheels that slip push as hard as at any, but nobody rams, for long enough that bumpers of two in a
row are pressed in [s]."""
MOVED = 0.001
"""A cylinder that has gone so far is moved [m]; without it robots get 39 mm."""


def in_a_row(robots: int) -> list[Pose]:
    """Return robots one behind the other before a cylinder of 0.2 m, which touch."""
    first_y = before(0.2)[1]
    return [(0.0, first_y - i * (2 * _RADIUS + _NEAR), NORTH) for i in range(robots)]


SIDE_BY_SIDE = [before(0.2, 0.037), before(0.2, -0.037)]


def pushed(starts: Sequence[Pose], mass: float) -> Case:
    """Return robots that creep at a cylinder of this mass [kg]."""
    return Case(
        "pushed", starts, [cylinder(0.2, mass, _MIDDLE)], commands=[CREEPING] * len(starts), duration=CREEPING_TIME
    )


def is_moved(poses: FloatArray) -> bool:
    """Whether the cylinder is."""
    return float(np.linalg.norm(poses[-1, -1, :2] - poses[0, -1, :2])) > MOVED


def heaviest(moves: Callable[[float], bool], precision: float = 1e-3) -> float:
    """Return the mass [kg] up to which a cylinder is moved, to a share of it."""
    light, heavy = 0.01, 1.0
    while heavy - light > precision * heavy:
        middle = (light + heavy) / 2
        light, heavy = (middle, heavy) if moves(middle) else (light, middle)
    return (light + heavy) / 2


class Threshold(NamedTuple):
    """The heaviest cylinder that some robots move [kg]."""

    robots: str
    formula: float | None
    reference: float
    library: dict[float, float]
    """By time step."""


def balance(robots: int) -> float:
    """Return the mass [kg] whose friction is the traction of so many robots in a row."""
    physics = Config().physics
    return robots * traction() / (physics.box_friction * physics.gravity)


def thresholds(settings: Settings, steps: Sequence[float] = STEPS) -> list[Threshold]:
    """Measure them."""
    reference.build()
    teams: list[tuple[str, list[Pose], float | None]] = [
        ("one", in_a_row(1), balance(1)),
        ("two, one behind the other", in_a_row(2), balance(2)),
        ("two side by side", SIDE_BY_SIDE, None),
    ]

    def found(team: tuple[str, list[Pose], float | None]) -> Threshold:
        name, starts, formula = team
        return Threshold(
            name,
            formula,
            heaviest(lambda mass: is_moved(pushed(starts, mass).truth())),
            {s: heaviest(lambda mass, s=s: is_moved(pushed(starts, mass).run(s))) for s in steps},  # type: ignore[misc]
        )

    return in_parallel(found, teams, settings.threads)


# ---- what grows ------------------------------------------------------------------------------------------------------


def growth(settings: Settings, times: Sequence[float] = (0.2, 1.0, 1.9)) -> dict[float, list[Difference]]:
    """Return how far a cylinder on narrow feet that is pushed off its middle is from the reference after some times."""
    reference.build()
    (case,) = (replace(case, duration=times[-1]) for case in CYLINDERS if "narrow" in case.name)
    truth, period = case.truth(), case.config().episode.control_period
    until = [round(time / period) + 1 for time in times]

    def of(step: float) -> list[Difference]:
        found = case.run(step)
        return [difference(found[:end], truth[:end]) for end in until]

    return dict(zip(STEPS, in_parallel(of, STEPS, settings.threads), strict=True))


# ---- anything anywhere -----------------------------------------------------------------------------------------------

RANDOM_ARENAS: tuple[Mapping[str, Any], ...] = (
    ROUND,
    {"shape": "rectangle", "sides": (1.0, 0.8)},
    {"shape": "polygon", "corners": ((-0.5, -0.4), (0.4, -0.5), (0.6, 0.1), (0.1, 0.55), (-0.5, 0.3))},
)


def random_case(number: int) -> Case:
    """Return four robots that drive at movables among five of these, a block and a post."""
    rng = np.random.default_rng((3, number))
    arena = RANDOM_ARENAS[number % len(RANDOM_ARENAS)]
    taken: list[tuple[float, float, float]] = []

    def place(reach: float) -> tuple[float, float]:
        while True:
            x, y = rng.uniform(-0.42, 0.42, 2).tolist()
            is_apart = all(np.hypot(x - a, y - b) > reach + r + 0.002 for a, b, r in taken)
            if is_apart and float(wall_distance(Arena(**arena), np.array([x, y]))) > reach + 0.002:
                taken.append((x, y, reach))
                return x, y

    obstacles = [block(0.1, 0.05, (*place(0.06), rng.uniform(-3, 3))), post(0.08, *place(0.04))]
    movables = []
    for is_round in (True, False, True, False, True):
        length, width = rng.uniform(0.05, 0.1, 2).tolist()
        mass, heading = rng.uniform(0.015, 0.05), rng.uniform(-3, 3)
        if is_round:
            movables.append(cylinder(length, mass, (*place(length / 2), heading)))
        else:
            movables.append(box(length, width, mass, (*place(float(np.hypot(length, width)) / 2), heading)))
    starts = []
    for _ in range(4):
        x, y = place(_RADIUS)
        aim = movables[rng.integers(len(movables))].pose
        starts.append((x, y, float(np.arctan2(aim[1] - y, aim[0] - x)) + rng.normal(0, 0.1)))
    commands = [tuple(pair) for pair in rng.uniform(0.7, 1, (4, 2)).tolist()]
    return Case(f"random {number}", starts, movables, obstacles, arena, commands)


def random_differences(number: int, steps: Sequence[float] = STEPS) -> list[Difference]:
    """Return the differences of a random case, by time step."""
    case = random_case(number)
    truth = case.truth()
    return [case.difference(truth, step) for step in steps]


# ---- the page --------------------------------------------------------------------------------------------------------


def section(settings: Settings) -> Section:
    """Measure, and write this part of the page."""
    found = compare(CASES, settings)
    parts = [_head(found), _tables(found), _growth(growth(settings)), _random(settings), _thresholds(settings)]
    return Section("\n".join(parts), {})


def _head(found: Sequence[Compared]) -> str:
    own_share, own_angle = max(c.own.share for c in found), max(c.own.angle for c in found)
    return f"""## Cylinders, obstacles, other arenas

What [scenes](scenes.md) are made of, against the independent reference, whose share in this was written from that page:
cylinders that are pushed, thrown, or stand on narrow feet; movables that push each other; obstacles and walls of other
shapes that stop robots and movables. Movables weigh 20 to 150 g, robots drive at full speed from rest, nothing has
noise, and the physics is the default. As above, errors in length are the largest of any body at any time, as a share of
the longest way in the case; the limits are {100 * LARGEST_WAY_ERROR:g} % and {np.degrees(LARGEST_TURN_ERROR):g}
degrees. (The reference itself differs, at half its step, by at most {100 * own_share:.2f} % and
{np.degrees(own_angle):.2f} degrees.) `articulated` is held against the reference with `shift_loads` and bears no
verdict: its steps are of first order.
"""


def _tables(found: Sequence[Compared]) -> str:
    head = ["case", "for [s]", "way [mm]", "turn [deg]", *(f"{millimetres(s):g} ms [%]" for s in STEPS),
            *(f"{millimetres(s):g} ms [deg]" for s in STEPS), "within both limits", "articulated, 1 ms [%]",
            "[deg]"]  # fmt: skip
    titles = {"A cylinder": CYLINDERS, "Movables push each other": MEETINGS, "Obstacles": OBSTACLES, "Arenas": ARENAS}
    parts = []
    for title, cases in titles.items():
        rows = [
            [
                c.case.name,
                f"{c.case.duration:g}",
                f"{millimetres(c.way):.0f}",
                f"{np.degrees(c.turn):.0f}",
                *(f"{100 * c.differences[s].share:.2f}" for s in STEPS),
                *(f"{np.degrees(c.differences[s].angle):.2f}" for s in STEPS),
                "yes" if keeps(c.differences[DEFAULT_STEP]) else "**no**",
                "" if c.articulated is None else f"{100 * c.articulated.share:.2f}",
                "" if c.articulated is None else f"{np.degrees(c.articulated.angle):.2f}",
            ]
            for c in found
            if c.case in cases
        ]
        parts.append(f"{title}:\n\n{table(head, rows)}")
    kept = all(keeps(c.differences[s]) for c in found for s in STEPS)
    return "\n".join([*parts, f"All cases within both limits at every time step: **{'yes' if kept else 'no'}**.\n"])


def _growth(found: Mapping[float, Sequence[Difference]]) -> str:
    rows = [
        [f"{millimetres(step):g}"]
        + [f"{millimetres(d.length):.2f}" for d in differences]
        + [f"{np.degrees(d.angle):.2f}" for d in differences]
        for step, differences in found.items()
    ]
    head = ["time step [ms]", *(f"after {t} s [mm]" for t in ("0.2", "1", "1.9")),
            *(f"after {t} s [deg]" for t in ("0.2", "1", "1.9"))]  # fmt: skip
    return f"""Who pushes a cylinder beside its middle pushes it ever farther aside, so that what differs grows. It
comes about in the first 0.2 s, when robots at rest get up to speed in touch with what they push; long steps resolve
that less well. The cylinder on narrow feet for longer:

{table(head, rows)}"""


def _random(settings: Settings) -> str:
    number = max(6, settings.pairs // 20)
    found = in_parallel(random_differences, range(number), settings.threads)
    rows = []
    for step, differences in zip(STEPS, zip(*found, strict=True), strict=True):
        lengths = np.array([millimetres(d.length) for d in differences])
        angles = np.degrees([d.angle for d in differences])
        quantiles = [f"{np.quantile(values, q):.2f}" for values in (lengths, angles) for q in (0.5, 0.9, 1.0)]
        rows.append([f"{millimetres(step):g}", *quantiles, sum(map(keeps, differences))])
    head = ["time step [ms]", "median [mm]", "90 % [mm]", "most [mm]", "median [deg]", "90 % [deg]", "most [deg]",
            "within both limits"]  # fmt: skip
    return f"""Anything anywhere: {number} random scenes of four robots that drive at some of five movables among a
block and a post, in a round, a rectangular and a five-sided arena, for 1.5 s. Most robots meet something, many each
other, and what is nearly in balance multiplies the 0.2 degrees by which long steps miss the start of an arc:

{table(head, rows)}"""


def _thresholds(settings: Settings) -> str:
    found = thresholds(settings)
    rows = [
        [
            t.robots,
            "" if t.formula is None else f"{1000 * t.formula:.1f}",
            f"{1000 * t.reference:.1f}",
            *(f"{1000 * t.library[s]:.1f}" for s in STEPS),
        ]
        for t in found
    ]
    apart = max(abs(mass / t.reference - 1) for t in found for mass in t.library.values())
    head = ["robots", "n F / (mu g) [g]", "reference [g]", *(f"{millimetres(s):g} ms [g]" for s in STEPS)]
    return f"""The heaviest cylinder of 0.2 m that robots move which creep up to it, by bisection to 0.1 %. Side by side
they look past its middle, so that they slip on it:

{table(head, rows)}
The library is within {100 * apart:.1f} % of the reference (asked: 1 %: **{"yes" if apart <= 0.01 else "no"}**).
"""

# SPDX-License-Identifier: BSD-3-Clause
"""Figures of a simulator from outside this project, and what the library and our own reference make of the same scenes.

That simulator is another author's, and shares no line with the library or with ``native/reference``: springs and
dampers, Coulomb's circles under two wheels and four feet, equal loads on the feet, explicit steps of 10 us. Its code is
not here, so its figures are constants. They were made with the parameters of each scene, feet of 4e6 N/m each, and
contacts of 30 kN/m that give back 0.05 of the speed if bumpers are rigid. For sprung ones its contacts are as soft as a
bumper, or as two in series where nothing but robots meet.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from benchmarks import reference
from benchmarks.cases import changed
from benchmarks.twin import twin
from benchmarks.validation_meetings import CASES, Case, reference_poses, simulated_poses
from benchmarks.validation_scenes import (
    NORTH,
    TIME_STEPS,
    Drive,
    Pose,
    Section,
    Settings,
    in_parallel,
    millimetres,
    table,
    turn,
)
from swarmevo.config import Config
from swarmevo.protocols import FloatArray

STEPS: Mapping[Drive, Sequence[float]] = TIME_STEPS
"""The time steps that are compared [s]."""
LARGEST_SHARE, LARGEST_ANGLE, LARGEST_BLOW_SHARE = 0.05, 0.5, 0.1
"""How far from a figure from outside one may be: a share of it or an angle [degrees], whichever is more; of a blow."""
_RIGID = {"bumper": "rigid"}
_SPRUNG = {"bumper": "sprung", "bumper_stiffness": 100.0, "bumper_damping": 4.46}
"""As much damping [N s/m] as the law of that simulator has; the default is 4.5."""
_HALF_LENGTH, _HALF_WIDTH, _RADIUS = Config().box.size[0] / 2, Config().box.size[1] / 2, Config().robot.radius
_SPACING, _GAP = 0.0725, 0.005  # of rows [m]
_MIDDLE: Pose = (0.0, 0.0, 0.0)
_BEFORE_THE_WALL: Pose = (0.0, 0.2, 0.0)  # which is 210 mm away
_FULL = (1.0, 1.0)
_LOST = (-1.4, -1.4, NORTH)  # of a robot that has no part in the scene


# ---- what is read ----------------------------------------------------------------------------------------------------


def box_heading(poses: FloatArray) -> float:
    """Return the box's heading in the end [degrees]."""
    return float(np.degrees(turn(poses[-1, -1, 2])))


def box_way(poses: FloatArray) -> float:
    """Return how far the box's middle is from its start in the end [mm]."""
    return millimetres(float(np.linalg.norm(poses[-1, -1, :2] - poses[0, -1, :2])))


def box_aside(poses: FloatArray) -> float:
    """Return how far the box has gone along x [mm]."""
    return millimetres(float(poses[-1, -1, 0] - poses[0, -1, 0]))


def robot_heading(poses: FloatArray) -> float:
    """Return the first robot's heading in the end [degrees]."""
    return float(np.degrees(turn(poses[-1, 0, 2])))


# ---- the figures -----------------------------------------------------------------------------------------------------


class Figure(NamedTuple):
    """What happens in a scene, as one number."""

    case: Case
    read: Callable[[FloatArray], float]
    outside: float
    """[degrees] or [mm]"""
    box_friction: float
    bumper: Mapping[str, Any]
    first: float | None = None
    """As the simulator's first report said it."""
    arena: float | None = None
    """Size of the arena [m], if not the case's."""

    @property
    def is_angle(self) -> bool:
        """Whether the number is an angle."""
        return self.read in (box_heading, robot_heading)

    def config(self) -> Config:
        """Return the scene, with the default drive and time step."""
        config = changed(self.case.config(), physics={"box_friction": self.box_friction}, robot=dict(self.bumper))
        return config if self.arena is None else changed(config, arena={"size": self.arena})

    def simulated(self, drive: Drive, time_step: float) -> float:
        """Return what the library says."""
        config = changed(self.config(), physics={"drive": drive, "time_step": time_step})
        return self.read(simulated_poses(config, self.case.commands))

    def referred(self, shift_loads: bool = False) -> float:
        """Return what our own reference says."""
        return self.read(reference_poses(self.config(), self.case.commands, shift_loads))

    def tolerance(self) -> float:
        """Return how far from the figure one may be [degrees] or [mm]."""
        share = LARGEST_BLOW_SHARE if self.case.is_blow else LARGEST_SHARE
        return max(share * abs(self.outside), LARGEST_ANGLE if self.is_angle else 0.0)

    def error(self, found: float) -> float:
        """Return how far a number is from the figure [degrees] or [mm]."""
        return abs(float(np.degrees(turn(np.radians(found - self.outside)))) if self.is_angle else found - self.outside)

    def keeps(self, found: float) -> bool:
        """Whether a number is within the tolerance."""
        return self.error(found) <= self.tolerance()


def _row(offset: float = 0.0, box: Pose = _MIDDLE) -> list[Pose]:
    """Return poses of three before the long face of a box."""
    y = box[1] - _HALF_WIDTH - _RADIUS - _GAP
    return [(offset + _SPACING * (i - 1), y, NORTH) for i in range(3)]


def _to_the_wall(off: int, after: float, outside: float, first: float) -> Figure:
    name = f"three, {off} mm off the middle, to the wall: turn after {after:g} s"
    case = Case(name, _row(off / 1000, _BEFORE_THE_WALL), [_FULL] * 3, after, _BEFORE_THE_WALL)
    return Figure(case, box_heading, outside, 0.58, _RIGID, first, arena=Config().arena.size)


def _in_the_open(off: int, outside: float) -> Figure:
    name = f"three, {off} mm off the middle, in the open: turn after 1.6 s"
    return Figure(Case(name, _row(off / 1000), [_FULL] * 3, 1.6, _MIDDLE), box_heading, outside, 0.62, _SPRUNG)


def _thrown(velocity: Pose, friction: float, outside: float, first: float | None = None) -> Figure:
    is_spun = velocity[0] == 0
    name = "spun at 5 rad/s: turn" if is_spun else "thrown at 0.3 m/s along its length, 3 rad/s: way"
    case = Case(name, [_LOST], [(0.0, 0.0)], 0.6, _MIDDLE, velocity)
    return Figure(case, box_heading if is_spun else box_way, outside, friction, _SPRUNG, first)


def _straight(friction: float, bumper: Mapping[str, Any], outside: float, first: float | None = None) -> Figure:
    return Figure(Case("three in the middle: way in 1.5 s", _row(), [_FULL] * 3, 1.5, _MIDDLE), box_way, outside,
                  friction, bumper, first)  # fmt: skip


def _met(name: str, what: str, read: Callable[[FloatArray], float], outside: float) -> Figure:
    (case,) = (case for case in CASES if case.name == name)
    named = Case(f"{name}: {what}", case.starts, case.commands, case.duration, case.box)
    return Figure(named, read, outside, 0.62, _SPRUNG)


_RAM = Case("one rams the middle, 30 mm away: way", [(0.0, -_HALF_WIDTH - _RADIUS - 0.03, NORTH)], [_FULL], 0.6,
            _MIDDLE, is_blow=True)  # fmt: skip

SLIDING = (
    _to_the_wall(20, 1.7, 8.48, 8.5),
    _to_the_wall(30, 1.7, 15.11, 15.0),
    _to_the_wall(60, 2.0, 27.52, 27.5),
    _in_the_open(20, 12.147),
    _in_the_open(30, 16.956),
    _in_the_open(60, 24.492),
    _thrown((0.0, 0.0, 5.0), 0.58, 6.894, 6.9),
    _thrown((0.0, 0.0, 5.0), 0.62, 6.449),
    _thrown((0.3, 0.0, 3.0), 0.58, 11.076, 11.1),
    _thrown((0.3, 0.0, 3.0), 0.62, 10.361),
    _straight(0.58, _RIGID, 181.79, 182.0),
    _straight(0.62, _SPRUNG, 175.30),
    Figure(_RAM, box_way, 0.1925, 0.58, _RIGID, 0.197),
)
"""What a box does that slides."""
MEETINGS = (
    _met("three push, one presses from the side", "box aside", box_aside, 37.33),
    _met("into each other's side, 2 s", "heading", robot_heading, -64.58),
    _met("glancing hit, 20 mm off", "heading", robot_heading, 113.44),
    _met("glancing hit, 40 mm off", "heading", robot_heading, 145.70),
    _met("a slower one from behind, 10 mm off", "heading", robot_heading, -28.96),
)
"""What robots do that meet."""
FIGURES = (*SLIDING, *MEETINGS)


# ---- the comparison --------------------------------------------------------------------------------------------------


class Compared(NamedTuple):
    """What a figure is in our own simulators."""

    figure: Figure
    reference: float
    shifting: float
    """Of the reference with the load that a push at mid height shifts to the feet ahead of it."""
    found: dict[tuple[Drive, float], float]
    """By drive and time step."""

    def keeps(self, drive: Drive, time_step: float) -> bool:
        """Whether a drive is within the tolerance at a time step."""
        return self.figure.keeps(self.found[drive, time_step])

    def largest_error(self, drive: Drive) -> float:
        """Return the largest error of a drive at any time step [degrees] or [mm]."""
        return max(self.figure.error(found) for (name, _), found in self.found.items() if name == drive)


def compare(
    settings: Settings, steps: Mapping[Drive, Sequence[float]] = STEPS, figures: Sequence[Figure] = FIGURES
) -> list[Compared]:
    """Compare figures."""
    reference.build()  # before threads race to do so

    def compared(figure: Figure) -> Compared:
        drives = [name for name in steps if name != "articulated" or figure.bumper == _SPRUNG]
        found = {(name, step): figure.simulated(name, step) for name in drives for step in steps[name]}
        return Compared(figure, figure.referred(), figure.referred(shift_loads=True), found)

    return in_parallel(compared, figures, settings.threads)


def missed(found: Sequence[Compared], drive: Drive) -> list[tuple[Compared, float]]:
    """Return which figures a drive does not keep to, and at which time steps [s]."""
    return [(c, step) for c in found for name, step in c.found if name == drive and not c.keeps(name, step)]


class Shift(NamedTuple):
    """How far rows in the open turn the box on the articulated drive from what a reference says, at most [degrees]."""

    alike: float
    """From the simulator from outside, whose feet are loaded alike."""
    shifted: float
    """From our own reference, with the loads that a push at mid height shifts."""

    def is_explanation(self) -> bool:
        """Whether the shift makes up for more than half of the difference."""
        return self.shifted < self.alike / 2


def shift(found: Sequence[Compared]) -> Shift:
    """Return it at the finest step."""
    step = STEPS["articulated"][0]
    rows = [
        c
        for c in found
        if c.figure.read is box_heading and len(c.figure.case.starts) == 3 and ("articulated", step) in c.found
    ]
    alike, shifted = zip(
        *((c.figure.error(c.found["articulated", step]), abs(c.found["articulated", step] - c.shifting)) for c in rows),
        strict=True,
    )
    return Shift(max(alike), max(shifted))


# ---- the feet of the reference ---------------------------------------------------------------------------------------

SOFT_FEET, DEFAULT_FEET = 5e4, 1e6
"""Stiffness of each foot [N/m]: of the simulator from outside, which was ours once, and ours."""
RAMMED = {5e4: 3.914, 2.5e5: 3.747, DEFAULT_FEET: 3.680, 4e6: 3.647, 1.6e7: 3.632}
"""Way of the box [mm] in the simulator from outside, by the stiffness of each foot [N/m]."""
RAMMED_STEP = 2e-6
"""That stiff feet need [s]."""
LARGEST_FOOT_ERROR = 0.02
"""Of the reference's feet, from feet that do not give."""


def rammed_by_two() -> Figure:
    """Return two that ram an end of the face, which the feet just fail to hold; the outside's feet as ours."""
    return Figure(CASES[-1], box_way, RAMMED[DEFAULT_FEET], 0.62, _SPRUNG)


def rigid_limit() -> float:
    """Return the way [mm] with feet that do not give.

    A foot's creep before it slides delays the box as its period of vibration does: errors go with the root of what a
    foot gives way, so they halve from each of the last two to the next.
    """
    return 2 * RAMMED[1.6e7] - RAMMED[4e6]


def rammed_in_reference(foot_stiffness: float | None = None) -> float:
    """Return the way [mm] in our own reference; with its default feet if no stiffness [N/m] is given."""
    figure = rammed_by_two()
    if foot_stiffness is None:
        world = twin(figure.config(), time_step=RAMMED_STEP)
    else:
        world = twin(figure.config(), time_step=RAMMED_STEP, foot_stiffness=foot_stiffness)
    world.set(figure.case.commands)
    start = world.box()
    world.go(figure.case.duration)
    return box_way(np.array([[start], [world.box()]]))


class Feet(NamedTuple):
    """Ways of the box that is rammed [mm]."""

    ours: dict[float, float]
    """In our own reference, by the stiffness of each foot [N/m]."""
    default: float
    """With its default feet."""
    library: tuple[float, float]
    """Least and largest of the default drive at all steps."""

    def share(self, way: float) -> float:
        """Return how far a way is from that with feet that do not give, as a share of that."""
        return abs(way / rigid_limit() - 1)

    def are_stiff_enough(self) -> bool:
        """Whether the reference's own feet do not matter."""
        return self.share(self.default) <= LARGEST_FOOT_ERROR


def feet(settings: Settings) -> Feet:
    """Measure them."""
    reference.build()
    *ours, default = in_parallel(rammed_in_reference, [*RAMMED, None], settings.threads)
    steps = STEPS["driven_contacts"]
    library = in_parallel(lambda s: rammed_by_two().simulated("driven_contacts", s), steps, settings.threads)
    return Feet(dict(zip(RAMMED, ours, strict=True)), default, (min(library), max(library)))


# ---- the page --------------------------------------------------------------------------------------------------------


def section(settings: Settings) -> Section:
    """Measure, and write this part of the page."""
    found = compare(settings)
    return Section("\n".join([_head(), _level(found), _articulated(found), _feet_text(feet(settings))]), {})


def _head() -> str:
    return f"""## Held against a simulator from outside

This part holds the library, and our own reference, against the figures of a simulator that another author wrote to
referee this project. It shares no line with either, and its code is not here: its figures are constants in
`benchmarks/validation_outside.py`. It is planar as well, with springs and dampers where bodies touch (30 kN/m that give
back 0.05 of the speed if bumpers are rigid), Coulomb's circles under two wheels and four feet of equal load, and
explicit steps of 10 us. Friction and bumpers are those of each row, all else is as in our defaults; its feet were
stiffened to 4e6 N/m each. Sprung bumpers have {_SPRUNG["bumper_stiffness"]:g} N/m and
{_SPRUNG["bumper_damping"]:g} N s/m here, the most damping that its law allows.

Its first report came when bumpers were rigid (a thrown box meets none) and the friction was 0.58, and did not tell from
where robots had started. A start was looked for at which it says the same once more, to its digits or 0.15 degrees:
robots {millimetres(_SPACING):g} mm apart and {millimetres(_GAP):g} mm before the box, which stands 210 mm before the
wall. (The blow it told by momentum.)

Rows push the long face of the box. A number may differ from the simulator's by {100 * LARGEST_SHARE:g} % or by
{LARGEST_ANGLE:g} degrees, whichever is more; the way of a blow by {100 * LARGEST_BLOW_SHARE:g} %.
"""


def _digits(figure: Figure, value: float) -> str:
    return f"{value:.3f}" if figure.case.is_blow else f"{value:.2f}"


def _rows(found: Sequence[Compared], drive: Drive) -> list[list[str]]:
    def row(c: Compared) -> list[str]:
        figure = c.figure
        ours = c.reference if drive == "driven_contacts" else c.shifting
        values = [figure.outside, ours, *(c.found[drive, step] for step in STEPS[drive]), c.largest_error(drive)]
        return [
            f"{figure.case.name} [{'deg' if figure.is_angle else 'mm'}]",
            f"{figure.box_friction:g}",
            str(figure.bumper["bumper"]),
            "" if figure.first is None else f"{figure.first:g}",
            *(_digits(figure, value) for value in [*values, figure.tolerance()]),
            "yes" if all(c.keeps(drive, step) for step in STEPS[drive]) else "**no**",
        ]

    return [row(c) for c in found if (drive, STEPS[drive][0]) in c.found]


def _table(found: Sequence[Compared], drive: Drive, ours: str) -> str:
    steps = [f"{millimetres(step):g} ms" for step in STEPS[drive]]
    head = ["figure", "mu_box", "bumper", "first report", "outside", ours, *steps, "largest error", "allowed", "within"]
    return table(head, _rows(found, drive))


def _named(steps: Sequence[float]) -> str:
    return ", ".join(f"{millimetres(step):g}" for step in steps) + " ms" if steps else "none"


def _listed(misses: Sequence[tuple[Compared, float]]) -> str:
    at: dict[str, list[float]] = {}
    for c, step in misses:
        at.setdefault(f"{c.figure.case.name}, mu_box {c.figure.box_friction:g}", []).append(step)
    return f" (not: {'; '.join(f'{name}, at {_named(steps)}' for name, steps in at.items())})" if at else ""


def _level(found: Sequence[Compared]) -> str:
    misses = missed(found, "driven_contacts")
    farthest = max(c.figure.error(c.reference) / c.figure.tolerance() for c in found)
    return f"""`driven_contacts`, by the time step:

{_table(found, "driven_contacts", "our reference")}
All figures within these limits at every time step with `driven_contacts`:
**{"no" if misses else "yes"}**{_listed(misses)}. Our own reference keeps to them as well:
**{"yes" if farthest <= 1 else "no"}**. It uses up to {100 * farthest:.0f} % of what is allowed, where robots touch each
other and the box: there two bumpers in series are as stiff as one in the simulator from outside.
"""


def _articulated(found: Sequence[Compared]) -> str:
    misses, explained = missed(found, "articulated"), shift(found)
    finest, *_ = STEPS["articulated"]
    return f"""`articulated`, beside our reference with the loads that a push shifts:

{_table(found, "articulated", "our reference, loads shifted")}
All figures within these limits at every time step with `articulated`:
**{"no" if misses else "yes"}**{_listed(misses)}. The drive's steps are of first order: a box that slides loses speed
too early, the more so the longer they are. Rigid bumpers it refuses: what a blow does would depend on the part of a
step into which it falls.

A push at mid height shifts about a tenth of what the feet behind carry to those ahead. Only the articulated drive does
that, whose box is free in three dimensions. At {millimetres(finest):g} ms rows in the open turn its box by up to
{explained.alike:.2f} degrees less than in the simulator from outside, but it is within {explained.shifted:.2f} degrees
of our reference with the loads shifted. So the shift explains most of this difference:
**{"yes" if explained.is_explanation() else "no"}**.
"""


def _feet_text(found: Feet) -> str:
    rows = [
        [f"{stiffness:.3g}", f"{RAMMED[stiffness]:.3f}", f"{ours:.3f}", f"{100 * found.share(ours):.1f}"]
        for stiffness, ours in found.ours.items()
    ]
    low, high = found.library
    head = ["stiffness of each foot [N/m]", "outside [mm]", "our reference [mm]", "beyond feet that do not give [%]"]
    return f"""How stiff must feet of a reference be? They stick by springs, so a blow that they just fail to hold finds
the box already on its way. Two that ram an end of the long face from 50 mm away move the box's middle by:

{table(head, rows)}
At each stiffness both simulators say the same. Feet of four times the stiffness halve the error, so those that do not
give are worth {rigid_limit():.3f} mm. Feet of {SOFT_FEET:g} N/m, which the simulator from outside came with and our
reference once had, exceed that by {100 * found.share(found.ours[SOFT_FEET]):.1f} %, those that our reference has now
({found.default:.3f} mm) by {100 * found.share(found.default):.1f} % (asked: {100 * LARGEST_FOOT_ERROR:g} %:
**{"yes" if found.are_stiff_enough() else "no"}**). The library, whose feet do not give, says {low:.3f} to {high:.3f} mm
at its time steps. The other figures of the simulator from outside are within 0.2 % of each other with either feet, the
one rigid blow within 1.2 %.
"""

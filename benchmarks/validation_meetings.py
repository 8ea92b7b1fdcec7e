# SPDX-License-Identifier: BSD-3-Clause
"""Where bodies meet: robots, box and walls against the independent reference of ``native/reference``.

The reference shares neither code nor method with the library: springs, dampers and Coulomb's circles in the plane, in
explicit steps of 10 us. Everything here is without noise and compared at every control step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from benchmarks import reference
from benchmarks.cases import changed
from benchmarks.twin import REFERENCE_STEP, twin
from benchmarks.validation_scenes import (
    AWAY,
    DRIVES,
    NORTH,
    Drive,
    Pose,
    Section,
    Settings,
    drive,
    in_parallel,
    millimetres,
    standing,
    table,
    turn,
)
from swarmevo.config import Config
from swarmevo.protocols import FloatArray

STEPS: Mapping[Drive, Sequence[float]] = {
    "driven_contacts": (0.001, 0.005, 0.01, 0.02, 0.025, 0.05),
    "articulated": (0.001, 0.004),
}
"""The time steps that are compared [s]."""
LARGEST_WAY_ERROR, LARGEST_TURN_ERROR = 0.02, np.radians(2.0)
"""What the default time step must keep: of the longest way in the case, and of any heading [rad]."""
LARGEST_BLOW_ERROR, LARGEST_BLOW_TURN_ERROR = 0.5e-3, np.radians(0.2)
"""The same of a blow that hardly moves the box [m], [rad]."""

_RADIUS, _HALF_LENGTH, _HALF_WIDTH = Config().robot.radius, Config().box.size[0] / 2, Config().box.size[1] / 2
_SPACING = 0.0715  # of robots side by side [m]
_NEAR = 1e-4  # gap of robots that start at the box [m]
_LEAST_WAY = 0.01  # a case in which nothing gets farther counts as one of this way [m]
_OPEN = 3.0  # size of an arena whose walls are out of reach [m]
_MIDDLE = (0.0, 0.0, 0.0)
_FULL, _PARKED = (1.0, 1.0), (0.0, 0.0)


# ---- either world ----------------------------------------------------------------------------------------------------


def reference_poses(
    config: Config, commands: Sequence[Sequence[float]], shift_loads: bool = False, time_step: float = REFERENCE_STEP
) -> FloatArray:
    """Return what the reference makes of held commands at the control steps: ``(steps, bodies, 3)``, the box last."""
    world, period = twin(config, shift_loads=shift_loads, time_step=time_step), config.episode.control_period
    world.set(commands)
    poses = [world.state()[:, :3]]
    for _ in range(round(config.episode.horizon / period) - 1):
        world.go(period)
        poses.append(world.state()[:, :3])
    return np.array(poses)


def simulated_poses(config: Config, commands: Sequence[Sequence[float]]) -> FloatArray:
    """Return what the library makes of it, likewise."""
    telemetry = drive(config, commands, ("pose", "box")).telemetry
    return np.concatenate([telemetry.pose[0], telemetry.box[0][:, np.newaxis]], axis=1)


# ---- the cases -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Case:
    """Bodies that meet."""

    name: str
    starts: Sequence[Pose]
    commands: Sequence[tuple[float, float]]
    duration: float
    box: Pose = AWAY
    box_velocity: Pose = (0.0, 0.0, 0.0)
    is_blow: bool = False
    """Judged by lengths and angles, since nothing gets far but the robots on their way to it."""

    def config(self) -> Config:
        """Return the scene, with the default physics; its last control step begins at ``duration``."""
        defaults = Config()
        is_open = self.box != AWAY
        return changed(
            standing(self.starts),
            arena={"size": _OPEN if is_open else defaults.arena.size},
            box={"pose": self.box, "velocity": self.box_velocity},
            emitter={"position": (0.0, 0.0, defaults.emitter.position[2])},
            episode={"horizon": self.duration + defaults.episode.control_period},
        )

    def run(self, of: tuple[Drive, float]) -> FloatArray:
        """Return the poses with a drive and a time step."""
        return simulated_poses(changed(self.config(), physics={"drive": of[0], "time_step": of[1]}), self.commands)

    def truth(self, shift_loads: bool = False, time_step: float = REFERENCE_STEP) -> FloatArray:
        """Return the reference's poses."""
        return reference_poses(self.config(), self.commands, shift_loads, time_step)


def _row(robots: int, middle: float = 0.0, gap: float = _NEAR) -> list[Pose]:
    """Return poses side by side before the long face of a box in the middle, moved along it by ``middle``."""
    y = -_HALF_WIDTH - _RADIUS - gap
    return [(middle + _SPACING * (i - (robots - 1) / 2), y, NORTH) for i in range(robots)]


def _offset_row(millimetres: int) -> Case:
    name = f"row of three, {millimetres} mm off the middle"
    return Case(name, _row(3, millimetres / 1000), [_FULL] * 3, 1.6, _MIDDLE)


OFFSETS = (0, 10, 20, 30, 60)
"""Of rows of three [mm]."""
ROWS = tuple(map(_offset_row, OFFSETS))
_FROM_THE_SIDE = (-_HALF_LENGTH - _RADIUS - 0.001, 0.0, 0.0)
_AT_THE_CORNER = (-_HALF_LENGTH - 0.02, -_HALF_WIDTH - 0.03, np.pi / 4)
_AT_THE_END = _HALF_LENGTH - 0.04  # of a pair
_TO_THE_BLOW = (0.044, 0.0455, 0.047, 0.0485, 0.05)
"""Gaps of robots that ram [m]: 50 ms at full speed are 6.4 mm, so the blow falls into all parts of a step."""

CASES = (
    *ROWS,
    Case("row of four", _row(4), [_FULL] * 4, 1.6, _MIDDLE),
    Case("three that start 0.1 mm before the box", _row(3), [_FULL] * 3, 1.0, _MIDDLE),
    Case("three push, one presses from the side", [*_row(3), _FROM_THE_SIDE], [_FULL] * 4, 2.0, _MIDDLE),
    Case("three push, one slantwise at a corner", [_AT_THE_CORNER, *_row(3)], [_FULL] * 4, 1.5, _MIDDLE),
    *(
        Case(f"glancing hit, {off} mm off", [(-0.12, 0.0, 0.0), (0.0, off / 1000, np.pi)], [_FULL] * 2, 1.5)
        for off in (20, 40, 60)
    ),
    Case("into the side of one that is parked", [(-0.15, 0.0, 0.0), (0.0, -0.03, NORTH)], [_FULL, _PARKED], 2.0),
    *(
        Case(f"into each other's side, {after:g} s", [(-0.12, 0.0, 0.0), (0.0, -0.12, NORTH)], [_FULL] * 2, after)
        for after in (1.0, 2.0)
    ),
    *(
        Case(
            f"a slower one from behind{f', {off} mm off' if off else ''}",
            [(-0.12, off / 1000, 0.0), (-0.03, 0.0, 0.0)],
            [_FULL, (0.4, 0.4)],
            2.0,
        )
        for off in (0, 10)
    ),
    *(
        Case(f"to a wall at {slant} degrees", [(0.38, -0.2, float(np.radians(slant)))], [_FULL], 2.0)
        for slant in (20, 45, 70)
    ),
    Case("a box thrown, turning", [(-1.4, -1.4, NORTH)], [_PARKED], 1.0, _MIDDLE, (0.0, 0.3, 3.0)),
    Case("a box spun", [(-1.4, -1.4, NORTH)], [_PARKED], 1.0, _MIDDLE, (0.0, 0.0, 5.0)),
    *(
        Case(
            f"two ram an end of the face from {millimetres(gap):g} mm",
            _row(2, _AT_THE_END, gap),
            [_FULL] * 2,
            2.0,
            _MIDDLE,
            is_blow=True,
        )
        for gap in _TO_THE_BLOW
    ),
)


# ---- the comparison --------------------------------------------------------------------------------------------------


class Difference(NamedTuple):
    """The largest deviation of any body from the reference, at any control step of a case."""

    length: float
    """[m]"""
    share: float
    """Of the longest way in the case."""
    angle: float
    """[rad]"""

    def keeps(self, case: Case) -> bool:
        """Whether it is within the limits of such a case."""
        if case.is_blow:
            return self.length <= LARGEST_BLOW_ERROR and self.angle <= LARGEST_BLOW_TURN_ERROR
        return self.share <= LARGEST_WAY_ERROR and self.angle <= LARGEST_TURN_ERROR


def difference(found: FloatArray, truth: FloatArray) -> Difference:
    """Compare poses ``(steps, bodies, 3)``."""
    length = float(np.linalg.norm(found[..., :2] - truth[..., :2], axis=-1).max())
    return Difference(
        length, length / max(longest_way(truth), _LEAST_WAY), float(np.abs(turn(found[..., 2] - truth[..., 2])).max())
    )


def longest_way(poses: FloatArray) -> float:
    """Return the distance from its start to its end of the body that gets farthest [m]."""
    return float(np.linalg.norm(poses[-1, :, :2] - poses[0, :, :2], axis=-1).max())


class Compared(NamedTuple):
    """A case's way in the reference, and the deviations from it."""

    case: Case
    way: float
    """[m]"""
    differences: dict[tuple[Drive, float], Difference]
    """Of ``driven_contacts`` from the reference whose feet are loaded alike, of ``articulated`` from the one whose
    loads shift."""


def compare(settings: Settings, steps: Mapping[Drive, Sequence[float]] = STEPS) -> list[Compared]:
    """Compare all cases."""
    reference.build()  # before threads race to do so

    def compared(case: Case) -> Compared:
        truths: dict[Drive, FloatArray] = {
            "driven_contacts": case.truth(),
            "articulated": case.truth(shift_loads=True),
        }
        found = {(name, s): difference(case.run((name, s)), truths[name]) for name in steps for s in steps[name]}
        return Compared(case, longest_way(truths["driven_contacts"]), found)

    return in_parallel(compared, CASES, settings.threads)


def own_error(settings: Settings) -> Difference:
    """Return how far the reference is from itself at half its step, at most in any case."""
    reference.build()
    found = in_parallel(
        lambda case: difference(case.truth(), case.truth(time_step=REFERENCE_STEP / 2)), CASES, settings.threads
    )
    return Difference(*map(max, zip(*found, strict=True)))


def final_turn(poses: FloatArray) -> float:
    """Return the box's heading in the end [rad]."""
    return float(turn(poses[-1, -1, 2]))


class Turned(NamedTuple):
    """Headings of the box after a row of three has pushed it beside its middle [rad], for each of ``OFFSETS``."""

    default: FloatArray
    fine: FloatArray
    articulated: FloatArray
    reference: FloatArray
    shifting: FloatArray
    """Of the reference, with the load that a push at mid height shifts to the feet ahead of it."""

    def apart(self) -> dict[str, float]:
        """Return largest differences [rad]: each drive from the reference that loads feet as it does, and the other."""
        return {
            "default": float(np.abs(self.default - self.reference).max()),
            "articulated": float(np.abs(self.articulated - self.shifting).max()),
            "articulated, loads alike": float(np.abs(self.articulated - self.reference).max()),
        }

    def is_explained(self) -> bool:
        """Whether the shift of loads makes up for most of the difference between the drives."""
        apart = self.apart()
        return apart["articulated"] < apart["articulated, loads alike"] / 2 and apart["default"] < LARGEST_TURN_ERROR


def turned_by_rows(settings: Settings) -> Turned:
    """Measure them."""
    reference.build()
    default = Config().physics

    def of(case: Case) -> list[float]:
        found = [case.run(of) for of in [(default.drive, default.time_step), (default.drive, 0.005), SHIFTING]]
        return [final_turn(poses) for poses in [*found, case.truth(), case.truth(shift_loads=True)]]

    return Turned(*np.array(in_parallel(of, ROWS, settings.threads)).T)


SHIFTING: tuple[Drive, float] = ("articulated", 0.004)
"""The drive whose box shifts the loads of its feet."""


# ---- the page --------------------------------------------------------------------------------------------------------


def section(settings: Settings) -> Section:
    """Measure, and write this part of the page."""
    found = compare(settings)
    text = "\n".join(
        [
            _head(own_error(settings)),
            _tables(found),
            _verdict(found),
            _blow_text(blow(settings)),
            _turned_text(turned_by_rows(settings)),
        ]
    )
    return Section(text, {"meetings.png": _figure(found)})


def _head(own: Difference) -> str:
    physics = Config().physics
    return f"""## Where bodies meet

Robots that push the box, run into each other and into walls, against the independent reference
(`native/reference/planar.cpp`: explicit steps of 10 us, which shares nothing with the library) with the same
parameters, without noise, at every control step. Robots drive at full speed. Boxes that are pushed stand in the open;
else the box is out of the way. Errors in length are the largest of any robot's or the box's place at any time, as a
share of the longest way in the case (at least {millimetres(_LEAST_WAY):g} mm); of headings, the largest of any body.
The limits for the default time step of {millimetres(physics.time_step):g} ms are {100 * LARGEST_WAY_ERROR:g} % and
{np.degrees(LARGEST_TURN_ERROR):g} degrees; of a blow, which hardly moves the box,
{millimetres(LARGEST_BLOW_ERROR):g} mm and {np.degrees(LARGEST_BLOW_TURN_ERROR):g} degrees. `articulated` is held
against the reference with `shift_loads`, since its box is free in three dimensions: a push at mid height loads the feet
ahead of it. It bears no verdict. (The reference itself differs, at half its step, by at most
{100 * own.share:.2f} % and {np.degrees(own.angle):.2f} degrees.)
"""


def _columns() -> list[tuple[Drive, float]]:
    return [(name, step) for name in DRIVES for step in STEPS[name]]


def _titles() -> list[str]:
    return [f"{millimetres(step):g} ms" if name != "articulated" else f"articulated, {millimetres(step):g} ms"
            for name, step in _columns()]  # fmt: skip


def default_difference(compared: Compared) -> Difference:
    """Return the deviation with the default physics."""
    physics = Config().physics
    return compared.differences[physics.drive, physics.time_step]


def _kept(compared: Compared) -> str:
    return "yes" if default_difference(compared).keeps(compared.case) else "**no**"


def _tables(found: list[Compared]) -> str:
    usual = [c for c in found if not c.case.is_blow]
    blows = [c for c in found if c.case.is_blow]

    def rows(of: list[Compared], show: Callable[[Difference], float]) -> list[list[str]]:
        return [
            [
                c.case.name,
                f"{c.case.duration:g}",
                f"{millimetres(c.way):.0f}",
                *(f"{show(c.differences[column]):.2f}" for column in _columns()),
                _kept(c),
            ]
            for c in of
        ]

    head = ["case", "for [s]", "way [mm]", *_titles(), "within both limits"]
    return f"""Error in length [%]:

{table(head, rows(usual, lambda d: 100 * d.share))}
Error in heading [degrees]:

{table(head, rows(usual, lambda d: float(np.degrees(d.angle))))}
Blows, error in length [mm] and, below, in heading [degrees]:

{table(head, rows(blows, lambda d: millimetres(d.length)))}
{table(head, rows(blows, lambda d: float(np.degrees(d.angle))))}"""


def _verdict(found: list[Compared]) -> str:
    missed = [c.case.name for c in found if not default_difference(c).keeps(c.case)]
    listed = "" if not missed else f" ({len(missed)} of {len(found)} do not: {'; '.join(missed)})"
    within = [
        millimetres(step)
        for step in STEPS["driven_contacts"]
        if all(c.differences["driven_contacts", step].keeps(c.case) for c in found)
    ]
    at = ", ".join(f"{step:g}" for step in within) + " ms" if within else "none"
    return f"""All cases within the limits at the default time step: **{"no" if missed else "yes"}**{listed}. Time steps
of `driven_contacts` that keep to them in all cases: {at}.

Errors hardly grow beyond steps of 10 ms: where bodies touch, longer ones are cut to what speeds allow, and where
bumpers meet. What is left is largest where robots turn each other, or one is wedged at a corner of the box: there what
a step misses grows.

![Errors against the time step](validation/meetings.png)
"""


class Blow(NamedTuple):
    """By how far corners of the box move when two robots ram an end of its face, at most [m]."""

    reference: float
    default: float
    articulated: float
    on_casters: float
    """Of the articulated robot, whose casters then all but touch the floor."""


_LOW = 1e-5  # clearance of casters that all but touch the floor [m]


def blow(settings: Settings) -> Blow:
    """Measure it for the last of the cases of two that ram."""
    case, physics = CASES[-1], Config().physics

    def of_library(of: tuple[Drive, float], clearance: float) -> float:
        config = changed(
            case.config(), physics={"drive": of[0], "time_step": of[1]}, robot={"caster_clearance": clearance}
        )
        return _way_of_corners(simulated_poses(config, case.commands))

    fine: tuple[Drive, float] = ("articulated", 0.001)
    high = Config().robot.caster_clearance
    tasks: list[tuple[tuple[Drive, float], float]] = [
        ((physics.drive, physics.time_step), high),
        (fine, high),
        (fine, _LOW),
    ]
    found = in_parallel(lambda task: of_library(*task), tasks, settings.threads)
    return Blow(_way_of_corners(case.truth()), *found)


def _way_of_corners(poses: FloatArray) -> float:
    """Return an upper bound of how far a corner of the box gets from its start [m]."""
    way = np.linalg.norm(poses[:, -1, :2] - poses[0, -1, :2], axis=1)
    turned = np.abs(turn(poses[:, -1, 2] - poses[0, -1, 2]))
    return float((way + turned * np.hypot(_HALF_LENGTH, _HALF_WIDTH)).max())


def _blow_text(found: Blow) -> str:
    return f"""Two robots at an end of the face are a few percent short of moving the box, and the bumpers' force in a
blow exceeds what wheels can push with by more than that. The last of the blows moves the box's corners by up to
{millimetres(found.reference):.1f} mm in the reference, by {millimetres(found.default):.1f} mm with the default physics,
but by {millimetres(found.articulated):.1f} mm with the articulated robot (at 1 ms): it pitches onto a caster, and its
wheels lose their load for some milliseconds. With casters that hang {millimetres(_LOW):g} mm instead of
{millimetres(Config().robot.caster_clearance):g} mm over the floor it is {millimetres(found.on_casters):.1f} mm. So the
level models are the harsher ones here.
"""


def _turned_text(turned: Turned) -> str:
    degrees = [np.degrees(column) for column in turned]
    rows = [[off, *(f"{abs(column[i]):.2f}" for column in degrees)] for i, off in enumerate(OFFSETS)]
    physics = Config().physics
    head = [
        "offset [mm]",
        f"{physics.drive}, {millimetres(physics.time_step):g} ms",
        f"{physics.drive}, 5 ms",
        f"{SHIFTING[0]}, {millimetres(SHIFTING[1]):g} ms",
        "reference",
        "reference with the push's load shift",
    ]
    apart = {name: np.degrees(value) for name, value in turned.apart().items()}
    return f"""Heading of the box after a row of three has pushed it beside its middle for {ROWS[0].duration:g} s
[degrees]:

{table(head, rows)}
A push at mid height shifts load to the feet ahead of it, as in the last column. The level drive holds the loads of the
feet equal and is within {apart["default"]:.2f} degrees of the reference that does so; the articulated one, whose box is
free in three dimensions, is within {apart["articulated"]:.2f} degrees of the reference that shifts them, but up to
{apart["articulated, loads alike"]:.2f} from the other. So the shift explains the difference between the two drives:
**{"yes" if turned.is_explained() else "no"}**.
"""


def _figure(found: list[Compared]) -> Figure:
    figure = Figure(figsize=(9, 6.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    styles = {"driven_contacts": "-", "articulated": "--"}
    usual = [c for c in found if not c.case.is_blow]
    for index, compared in enumerate(usual):
        for name in DRIVES:
            line = [compared.differences[name, step] for step in STEPS[name]]
            milliseconds = [millimetres(step) for step in STEPS[name]]
            label = compared.case.name if name == "driven_contacts" else None
            colour = f"C{index % 10}"
            marker = ".sx"[index // 10]
            left.loglog(milliseconds, [max(100 * d.share, 1e-9) for d in line], styles[name], color=colour,
                        marker=marker, markersize=4, label=label)  # fmt: skip
            right.loglog(milliseconds, [max(float(np.degrees(d.angle)), 1e-9) for d in line], styles[name],
                         color=colour, marker=marker, markersize=4)  # fmt: skip
    left.axhline(100 * LARGEST_WAY_ERROR, color="0.3", linewidth=0.8)
    right.axhline(np.degrees(LARGEST_TURN_ERROR), color="0.3", linewidth=0.8)
    left.set(ylabel="error in length [% of the way]", ylim=(5e-3, 20))
    right.set(ylabel="error in heading [degrees]", ylim=(5e-3, 20))
    shown = [millimetres(step) for step in STEPS["driven_contacts"]]
    for axes in (left, right):
        axes.set_xticks(shown, ["" if step == 25 else f"{step:g}" for step in shown])
        axes.minorticks_off()
        axes.set_xlabel("time step [ms]")
    left.plot([], [], "k-", label="driven contacts")
    left.plot([], [], "k--", label="articulated")
    figure.legend(loc="outside lower center", ncols=3, fontsize=7)
    return figure

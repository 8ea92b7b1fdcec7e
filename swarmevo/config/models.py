# SPDX-License-Identifier: BSD-3-Clause
"""Every key of a configuration: its unit, its range and its default.

This is the one home of defaults. The sections that describe the world have the names of the structs in ``swarmevo.h``
and are copied into them key by key (``simulation/scene.py``); the ranges there are the same, and a test compares them.
Readings of the paper behind the defaults: ``docs/paper-map.md``.
"""

from __future__ import annotations

import re
import reprlib
import sys
from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal, TypeAlias

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from swarmevo.config import presets

LIGHT: Final = "light"
"""The channel of emitters that light sensors alone see."""

FromList = Field(strict=False)  # YAML has lists, no tuples
Number = Annotated[float, Field(ge=-100, le=100)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Bearing = Annotated[float, Field(ge=-360, le=360)]
Extent = Annotated[float, Field(ge=0.01, le=10)]
Strength = Annotated[float, Field(ge=0, le=1e6)]
Speed = Annotated[float, Field(ge=-10, le=10)]
Shift = Annotated[float, Field(ge=0, le=1)]
Offset = Annotated[float, Field(ge=-1, le=1)]
Jitter = Annotated[float, Field(ge=0, le=3.15)]
Side = Annotated[float, Field(ge=0.2, le=100)]
Stretch = Annotated[float, Field(ge=0.001, le=1000)]
Place = Annotated[tuple[Number, Number], FromList]
Vector = Annotated[tuple[Number, Number, Number], FromList]
Spot = Annotated[tuple[Offset, Offset], FromList]
CurvePoint = Annotated[tuple[Annotated[float, Field(ge=0, le=10)], Annotated[float, Field(ge=0, le=1e6)]], FromList]


class Section(BaseModel):
    """A part of the configuration: frozen, without unknown keys, NaN or converted types."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, use_attribute_docstrings=True
    )


# ---- the world -------------------------------------------------------------------------------------------------------


class Arena(Section):
    """The walled floor."""

    shape: Literal["square", "rectangle", "circle", "polygon"] = "square"
    """A square (paper IV) or a circle of `size`, a rectangle with `sides`, or a convex polygon with `corners`."""
    size: float = Field(default=1.0, ge=0.2, le=100)
    """Inner side of the square, inner diameter of the circle [m] (paper IV: 1 m^2)."""
    sides: Annotated[tuple[Side, Side], FromList] = (2.0, 1.0)
    """Inner extent of the rectangle along x, y [m]."""
    corners: Annotated[tuple[Place, ...], FromList, Field(max_length=32)] = ()
    """x, y of the polygon's corners [m], 3 or more, counter-clockwise."""
    wall_height: float = Field(default=0.03, ge=0.005, le=1)
    """[m] (paper IV)."""
    target_wall: Literal["north", "south", "east", "west"] = "north"
    """The wall that the box is to be pushed to, where `scene.goals` names nothing; north is y = +size/2."""

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """X from, x to, y from, y to of what the walls enclose [m]."""
        if self.shape == "polygon" and self.corners:
            xs, ys = zip(*self.corners, strict=True)
            return min(xs), max(xs), min(ys), max(ys)
        width, depth = self.sides if self.shape == "rectangle" else (self.size, self.size)
        return -width / 2, width / 2, -depth / 2, depth / 2


class Movable(Section):
    """What robots can push. It stands on four feet: a box on its corners, a cylinder on its rim."""

    shape: Literal["box", "cylinder"] = "box"
    """A cylinder has its diameter twice in `size`, and its height."""
    size: Annotated[tuple[Extent, Extent, Extent], FromList] = (0.275, 0.18, 0.03)
    """Extent along its x, y, z [m] (paper IV)."""
    mass: float = Field(default=0.24, ge=0.001, le=1000)
    """[kg] (paper IV)."""
    friction: float | None = Field(default=None, ge=0, le=10)
    """Coulomb coefficient with the floor; nothing: `physics.box_friction`."""
    feet: float = Field(default=1.0, ge=0.1, le=1)
    """Where its feet stand, as a share of the way from its middle to the corners or the rim."""
    pose: Vector = (0.0, 0.345, 0.0)
    """x [m], y [m], heading [rad] of its centre at the start."""
    velocity: Annotated[tuple[Speed, Speed, Speed], FromList] = (0.0, 0.0, 0.0)
    """x [m/s], y [m/s], about the vertical [rad/s] at the start."""
    start: Literal["pose", "random"] = "pose"
    """At `pose`, or, anew in each episode, anywhere in `start_region` with any heading."""
    start_region: Annotated[tuple[Number, Number, Number, Number], FromList] = (-0.3, 0.3, -0.1, 0.3)
    """x from, x to, y from, y to of its centre [m]; with `start: random`."""


class Box(Movable):
    """What is to be pushed, where `scene.movables` names nothing."""


class Obstacle(Section):
    """What never moves, beside the arena's walls."""

    shape: Literal["box", "cylinder", "wall"] = "box"
    """A wall leads straight from one end to the other."""
    size: Annotated[tuple[Extent, Extent, Extent], FromList] = (0.1, 0.1, 0.1)
    """Extent along its x, y, z; a cylinder's diameter twice, and its height; of a wall the height alone is read [m]."""
    pose: Vector = (0.0, 0.0, 0.0)
    """x [m], y [m], heading [rad] of its centre; not of a wall."""
    ends: Annotated[tuple[Place, Place], FromList] = ((0.0, 0.0), (0.0, 0.3))
    """x, y of a wall's ends [m]."""
    thickness: float = Field(default=0.01, ge=0.01, le=1)
    """Of a wall [m]."""


def _is_a_channel(name: str) -> str:
    """Refuse a channel whose strength would be named as another one's bearing is: ``rf_bearing_cos``."""
    if name.startswith("bearing"):
        raise ValueError(f"expected a name that does not begin with bearing, got {name}")
    return name


class Emitter(Section):
    """The RF source that the robots home in on, where `scene.emitters` names nothing."""

    position: Vector = (0.0, 0.345, 0.03)
    """[m], fixed in the world: above the box's start (paper IV); or in the frame of the movable that it rides on."""
    range: float = Field(default=0.3, ge=0.01, le=1000)
    """[m] (paper IV)."""
    strength: Annotated[tuple[Strength, Strength], FromList] = (1.0, 50.0)
    """Smallest and largest signal strength S (paper eq. 1)."""
    reach: Literal["range", "arena"] = "range"
    """Whether S is heard within `range` only, or in the whole arena."""
    channel: Annotated[str, Field(pattern="^[a-z][a-z0-9_]{0,31}$"), AfterValidator(_is_a_channel)] = "rf"
    """RF receivers tell one channel from another; `light` is for light sensors alone. Robots home in on the first
    other channel."""
    rides_on: int | None = Field(default=None, ge=0, le=31)
    """The movable that carries it, by its place in the list; nothing: it stands still."""


class Goal(Section):
    """Where movables are to be brought."""

    wall: Literal["north", "south", "east", "west"] | None = None
    """Of a square or rectangular arena: reached when a movable touches it."""
    region: Annotated[tuple[Number, Number, Number, Number], FromList] | None = None
    """x from, x to, y from, y to [m]: reached when a movable's centre lies in it."""

    @model_validator(mode="after")
    def _is_one(self) -> Goal:
        if (self.wall is None) == (self.region is None):
            raise ValueError(f"expected a wall or a region, got {'neither' if self.wall is None else 'both'}")
        return self


class Patch(Section):
    """A part of the floor in another grey; of two that overlap the later one is on top."""

    shape: Literal["box", "cylinder"] = "box"
    """A rectangle, or a disc."""
    size: Annotated[tuple[Stretch, Stretch], FromList] = (0.2, 0.2)
    """Extent along its x, y; a disc's diameter twice [m]."""
    pose: Vector = (0.0, 0.0, 0.0)
    """x [m], y [m], heading [rad] of its centre."""
    grey: Fraction = 0.0
    """0 is black, 1 is white."""


class Surroundings(Section):
    """What is in the arena beside the robots: lists in the place of one box, one emitter and one wall to push it to."""

    movables: Annotated[tuple[Movable, ...], FromList, Field(max_length=32)] | None = None
    """What robots can push; an empty list: nothing. Nothing named: the `box`."""
    obstacles: Annotated[tuple[Obstacle, ...], FromList, Field(max_length=64)] = ()
    """What never moves."""
    emitters: Annotated[tuple[Emitter, ...], FromList, Field(max_length=16)] | None = None
    """What robots hear; an empty list: nothing. Nothing named: the `emitter`."""
    goals: Annotated[tuple[Goal, ...], FromList, Field(max_length=8)] | None = None
    """Where movables are to be brought; an empty list: nowhere. Nothing named: to `arena.target_wall`."""
    grey: Fraction = 1.0
    """Of the floor beside the patches; 0 is black, 1 is white."""
    patches: Annotated[tuple[Patch, ...], FromList, Field(max_length=32)] = ()
    """Parts of the floor in another grey."""

    @property
    def radio_channels(self) -> tuple[str, ...]:
        """Names of the emitters' channels but that of lights, the one that robots home in on first."""
        return tuple(dict.fromkeys(one.channel for one in self.emitters or () if one.channel != LIGHT))


Device: TypeAlias = Literal[
    "infrared", "touch", "rf", "rf_bearing", "range_and_bearing", "ground", "odometry", "movable_motion", "light"
]


def _each_once(devices: tuple[Device, ...]) -> tuple[Device, ...]:
    """Refuse a device that is named twice: each has one set of keys in the section ``sensors``."""
    for device in devices:
        if devices.count(device) > 1:
            raise ValueError(f"expected each device once, got {device} twice")
    return devices


class Robot(Section):
    """A robot's body and drive, and what it senses."""

    preset: Literal["epuck", "epuck_real", "khepera_iv", "thymio_ii"] = "epuck"
    """Whose the defaults of this section and some others are (docs/robots.md): the paper's e-puck, the real one of
    150 g, K-Team's Khepera IV, Mobsya's Thymio II. Keys that are named win."""
    sensors: Annotated[tuple[Device, ...], FromList, AfterValidator(_each_once)] = ("infrared", "touch", "rf")
    """Devices, whose readings side by side are what a controller observes; none is fine."""
    radius: float = Field(default=0.035, ge=0.005, le=1)
    """Of the body, to the rim of its bumper [m] (ARGoS, the real E-puck)."""
    height: float = Field(default=0.05, ge=0.005, le=2)
    """Top of the body, where the RF receiver is [m]."""
    mass: float = Field(default=0.08, ge=0.001, le=100)
    """[kg] (paper IV: a third of the box; a real E-puck weighs 150 g)."""
    centre_of_mass: float = Field(default=0.015, ge=0.001, le=1)
    """Height above the floor [m] (Webots)."""
    wheel_radius: float = Field(default=0.0205, ge=0.001, le=1)
    """[m] (Webots, e-puck.org)."""
    axle_length: float = Field(default=0.053, ge=0.005, le=2)
    """Between the wheels [m] (e-puck.org)."""
    top_speed: float = Field(default=6.28, ge=0.01, le=1000)
    """Of a wheel [rad/s]: 0.129 m/s on the floor (Webots)."""
    motor_torque: float = Field(default=0.02, ge=1e-6, le=100)
    """Largest of a wheel's motor [N m]; with `drive: articulated`. Twice what makes a wheel slip."""
    caster_offset: float = Field(default=0.03, ge=0.001, le=1)
    """Front and rear caster, ahead of and behind the axle [m]. The nearer, the less a robot can push with."""
    caster_clearance: float = Field(default=0.0005, ge=0, le=0.01)
    """Between casters and floor when the robot stands upright [m]; with `drive: articulated`."""
    bumper: Literal["sprung", "rigid"] = "sprung"
    """The touch sensors are a sprung bumper all round the body, which meets box, walls and robots softly; or rigid."""
    bumper_stiffness: float = Field(default=100.0, ge=1, le=1e6)
    """[N/m]. At 100 a robot that pushes with all its traction, 0.52 N, presses its bumper in by 5.2 mm."""
    bumper_damping: float = Field(default=4.5, ge=0, le=1e5)
    """[N s/m]. At 4.5 a blow at top speed has about the lowest peak force (docs/validation.md)."""
    bumper_travel: float = Field(default=0.012, ge=0.0001, le=1)
    """From the rim, which is the body's radius, inwards to a rigid stop [m]. Two robots in a row press the front one's
    bumper in by 10.5 mm; on its stop blows are rigid again."""


class Team(Section):
    """How many robots there are, and where they start."""

    robots: int = Field(default=5, ge=1, le=64)
    """Number of robots (paper IV)."""
    genomes: Literal["shared", "individual"] = "shared"
    """One genome cloned to the team, or one for each robot."""
    start: Literal["row", "poses", "random"] = "row"
    """In rows from `row_y` on, heading south, away from the emitter (paper IV); at `start_poses`; or anywhere."""
    row_y: float = Field(default=-0.4, ge=-100, le=100)
    """y of the first row's centres [m]."""
    row_spacing: float = Field(default=0.12, ge=0.001, le=100)
    """Between neighbours and between rows [m]."""
    start_poses: Annotated[tuple[Vector, ...], FromList] = ()
    """For each robot x [m], y [m], heading [rad]; with `start: poses`."""
    start_region: Annotated[tuple[Number, Number, Number, Number], FromList] = (-0.45, 0.45, -0.45, 0.15)
    """x from, x to, y from, y to [m]; with `start: random`."""
    start_jitter: Annotated[tuple[Shift, Jitter], FromList] = (0.01, 0.1)
    """Largest deviation of position [m] and heading [rad] from the start pose, drawn anew for each episode."""

    @property
    def has_own_genomes(self) -> bool:
        """Whether each robot has a genome of its own."""
        return self.genomes == "individual"

    @property
    def genomes_per_team(self) -> int:
        """How many robots' genomes an individual is made of."""
        return self.robots if self.has_own_genomes else 1


class Sensors(Section):
    """What the devices of `robot.sensors` are like."""

    infrared_yaw_deg: Annotated[tuple[Bearing, ...], FromList, Field(min_length=1, max_length=64)] = (
        -17.2,
        -45.9,
        -90.0,
        -151.5,
        151.2,
        90.0,
        45.8,
        17.1,
    )
    """Bearings of the infrared rays, left positive [deg]; here ps0 to ps7 (Webots)."""
    infrared_curve: Annotated[tuple[CurvePoint, ...], FromList, Field(min_length=2, max_length=16)] = (
        (0.0, 4095.0),
        (0.005, 3474.0),
        (0.01, 2211.0),
        (0.02, 676.0),
        (0.03, 306.0),
        (0.04, 164.0),
        (0.05, 90.0),
        (0.06, 56.0),
        (0.07, 34.0),
    )
    """Distance [m], raw value [1]; linear in between, 0 beyond (Webots <= 8.5). Readings are over the first value."""
    infrared_target: Literal["walls_and_robots", "all"] = "walls_and_robots"
    """What the infrared sensors see: at the top front, above the box, or the box too (paper IV)."""
    touch_yaw_deg: Annotated[tuple[Bearing, ...], FromList, Field(min_length=1, max_length=16)] = (
        45.0,
        15.0,
        -15.0,
        -45.0,
    )
    """Bearings of the box sensors, left positive [deg]; here the paper's four at the bottom front (paper IV)."""
    touch_half_width_deg: float = Field(default=15.0, ge=0.1, le=180)
    """Half the sector that each box sensor covers [deg]."""
    touch_range: float = Field(default=0.002, ge=0.0001, le=10)
    """Distance between body and box up to which a box sensor answers [m]."""
    touch_mode: Literal["binary", "graded", "force"] = "binary"
    """0 or 1; 1 - distance / touch_range; or the normal force over the robot's traction limit."""
    range_and_bearing_range: float = Field(default=0.7, ge=0.01, le=100)
    """Between robots' centres, up to which one perceives another [m] (ARGoS's e-puck in Francesca et al. 2014)."""
    range_and_bearing_sectors: int = Field(default=4, ge=1, le=32)
    """Sectors of equal width; the first is centred ahead, the others follow to the left."""
    range_and_bearing_message: int = Field(default=0, ge=0, le=16)
    """Bits that a robot sends in each control step to all in range: as many commands more, set where above 0. They want
    `range_and_bearing` in `robot.sensors`."""
    light_sectors: int = Field(default=8, ge=1, le=32)
    """Sectors of equal width; the first is centred ahead, the others follow to the left. Lights are emitters of the
    channel `light`."""
    ground_position: Annotated[tuple[Spot, ...], FromList, Field(min_length=1, max_length=8)] = ((0.0, 0.0),)
    """Places of the ground sensors, ahead and to the left of the robot's centre [m]."""


class Noise(Section):
    """Random disturbances, drawn anew in each control step."""

    infrared: Fraction = 0.05
    """Relative standard deviation of a reading (Webots 5 %)."""
    infrared_at_contact: Fraction = 0.005
    """The same at distance 0 (Webots 0.5 %)."""
    wheels: Fraction = 0.05
    """Largest relative error of a wheel's speed, uniform (Enki 5 %)."""
    rf: Fraction = 0.0
    """Relative standard deviation of S."""
    rf_bearing: float = Field(default=0.0, ge=0, le=3.15)
    """Standard deviation of the emitter's bearing [rad]."""
    range_and_bearing: Fraction = 0.0
    """Relative standard deviation of the distance to another robot."""
    ground: Fraction = 0.0
    """Standard deviation of a grey value."""
    odometry: Fraction = 0.0
    """Relative standard deviation of a wheel's measured speed."""
    light: Fraction = 0.0
    """Relative standard deviation of a light's strength."""


class Physics(Section):
    """Of ODE, which moves the bodies."""

    time_step: float = Field(default=0.05, ge=0.0005, le=0.05)
    """[s]. A step is cut where speeds change much in it; docs/validation.md has the errors."""
    gravity: float = Field(default=9.81, ge=0.1, le=100)
    """[m/s^2]."""
    wheel_friction: float = Field(default=1.0, ge=0, le=10)
    """Coulomb coefficient between wheel and floor."""
    box_friction: float = Field(default=0.62, ge=0, le=10)
    """Coulomb coefficient between box and floor: with 0.62 three robots move the box and two do not
    (docs/validation.md)."""
    side_friction: float = Field(default=0.2, ge=0, le=10)
    """Coulomb coefficient between robots, box and walls (docs/paper-map.md)."""
    contact_erp: float = Field(default=0.2, ge=0.01, le=1)
    """ODE's error reduction parameter of contacts."""
    contact_cfm: float = Field(default=1e-5, ge=1e-9, le=0.1)
    """ODE's constraint force mixing of contacts [s/kg]."""
    drive: Literal["driven_contacts", "articulated"] = "driven_contacts"
    """A robot is one level body whose wheels are moving contact surfaces; or, as the reference, a chassis and two wheel
    bodies on hinges with motors, free in three dimensions, at time steps up to 0.004 s and with sprung bumpers."""


class Episode(Section):
    """How long a team is tried."""

    horizon: float = Field(default=180.0, ge=0.001, le=1e5)
    """[s], a whole number of control periods (paper Table I)."""
    control_period: float = Field(default=0.1, ge=0.0005, le=10)
    """[s], a whole number of time steps."""
    until: Literal["horizon", "push"] = "horizon"
    """When an episode ends: at the horizon, or, sooner, when the box touches the target wall."""


# ---- the evolution ---------------------------------------------------------------------------------------------------


def named(value: Any) -> Any:
    """Read ``name`` as ``{name: {}}`` and a list of names likewise, a name without options as one with none."""
    if isinstance(value, str):
        return {value: {}}
    if isinstance(value, list) and all(isinstance(name, str) for name in value):
        return {name: {} for name in value}
    if isinstance(value, Mapping):
        return {name: {} if options is None else options for name, options in value.items()}
    return value


def _plain(options: dict[str, Any]) -> dict[str, Any]:
    """Refuse what YAML or JSON cannot give back: options travel as text to the run folder and to workers."""
    for name, value in options.items():
        if not _is_plain(value):
            raise ValueError(
                f"{name}: expected a finite number, text, true, false, null or a list, got {reprlib.repr(value)}"
            )
    return options


def _is_plain(value: Any) -> bool:
    if isinstance(value, Mapping):
        return all(isinstance(key, str) and _is_plain(entry) for key, entry in value.items())
    if isinstance(value, list):
        return all(map(_is_plain, value))
    if isinstance(value, int | float):
        return abs(value) <= sys.float_info.max  # JSON knows no NaN and no infinity
    if isinstance(value, str):
        return not re.search("[\ud800-\udfff]", value)  # nor UTF-8 half a character
    return value is None


def _worlds(value: Any) -> Any:
    """Take a list of ``{section.key: value}``; what is in them is checked with the rest (``worlds.py``)."""
    if not isinstance(value, list | tuple) or not all(isinstance(entry, Mapping) for entry in value):
        raise ValueError(f"expected a list of worlds, each {{section.key: value}}, got {reprlib.repr(value)}")
    return tuple(_plain(dict(entry)) for entry in value)


def _varied(value: Any) -> Any:
    """Take ``{section.key: {uniform: [low, high]}}`` or another kind of draw."""
    if not isinstance(value, Mapping) or not all(isinstance(draw, Mapping) for draw in value.values()):
        raise ValueError(f"expected {{section.key: {{uniform: [low, high]}}}}, got {reprlib.repr(value)}")
    return _plain({key: dict(draw) for key, draw in value.items()})


Differing = Annotated[tuple[dict[str, Any], ...], BeforeValidator(_worlds)]
Varying = Annotated[dict[str, dict[str, Any]], BeforeValidator(_varied)]
Options = Annotated[dict[str, Any], AfterValidator(_plain)]
Plugin = Annotated[dict[str, Options], BeforeValidator(named), Field(min_length=1, max_length=1)]
Plugins = Annotated[dict[str, Options], BeforeValidator(named), Field(min_length=1)]


class Evolution(Section):
    """The budget."""

    generations: int = Field(default=100, ge=1, le=1_000_000)
    """Number of generations (paper Table I)."""
    population: int = Field(default=30, ge=1, le=1_000_000)
    """Size of the population (paper Table I)."""
    trials: int = Field(default=1, ge=1, le=65535)
    """Independent evolutions (paper Table I: 10)."""
    repeats: int = Field(default=3, ge=1, le=65535)
    """Episodes per evaluation, in each of the worlds; objectives are their mean."""
    over_worlds: Literal["mean", "worst", "quantile"] = "mean"
    """How an objective's means in each of the `worlds` become one number: their mean, by weight; the worst; or that
    quantile, counted from the worst."""
    worlds_quantile: Fraction = 0.25
    """With `over_worlds: quantile`; 0 is the worst world, 0.5 the median, linear in between."""
    race_after: int = Field(default=0, ge=0, le=65535)
    """Repeats in each world after which the hopeless of a generation get no more; 0: all get all."""
    race_keep: Fraction = 0.5
    """Share of a generation that goes on, with `race_after`: whole non-dominated layers, the best first."""
    least_episodes: int = Field(default=0, ge=0, le=1_000_000_000)
    """Episodes that an individual must have before it may stand on a front; while none has, those with the most may."""
    resample: int = Field(default=0, ge=0, le=1_000_000)
    """Individuals of the trial's front that are evaluated again in each generation, those with the fewest episodes."""
    refine: float = Field(default=0.0, ge=0, le=0.9)
    """Last share of the budget that makes no new individuals: the front and the optimiser's answer are evaluated again
    and again, those with the fewest episodes first."""
    episodes: int | None = Field(default=None, ge=1, le=1_000_000_000_000)
    """Budget of a trial beside `generations`: it ends with the generation in which it is reached."""
    seed: int | None = Field(default=None, ge=0, le=2**63 - 1)
    """Of everything random in the run; drawn, printed and stored if not given."""
    start: str | None = Field(default=None, min_length=1, max_length=4096)
    """Genomes to begin from: a JSON or CSV file, another run for its front, or one individual of it, `RUN:ID`. They are
    stored with the run, which does not need them again (docs/testing.md)."""
    start_sha256: str | None = Field(default=None, pattern="^[0-9a-f]{64}$")
    """Of these genomes: found when the run begins. Given, they are refused if they are others."""
    on_fault: Literal["fail", "worst"] = "fail"
    """When an episode fails: end the run, or give it the worst objectives, record why, and go on."""
    episode_timeout: float | None = Field(default=None, ge=0.01, le=1e6)
    """[s] of computing that an episode may take before it counts as failed; needs a process for each worker."""


class Config(Section):
    """Everything that decides a run's result."""

    @model_validator(mode="before")
    @classmethod
    def _with_preset(cls, data: Any) -> Any:
        """Let the robot's preset stand in for defaults."""
        return presets.filled(data) if isinstance(data, Mapping) else data

    arena: Arena = Arena()
    box: Box = Box()
    emitter: Emitter = Emitter()
    scene: Surroundings = Surroundings()
    robot: Robot = Robot()
    team: Team = Team()
    sensors: Sensors = Sensors()
    noise: Noise = Noise()
    physics: Physics = Physics()
    episode: Episode = Episode()
    worlds: Differing = ()
    """The worlds that an individual is tried in: for each, what differs from the sections above, and its weight."""
    vary: Varying = Field(default={})
    """What is drawn anew in each episode: by `uniform`, `normal` or `choice`."""
    controller: Plugin = Field(default={"feedforward": {}}, validate_default=True)
    """The controller plugin and its options."""
    fitness: Plugins = Field(default={"box_pushing": {}, "hidden_neurons": {}}, validate_default=True)
    """The fitness plugins and their options; their objectives are put side by side."""
    optimiser: Plugin = Field(default={"pde": {}}, validate_default=True)
    """The optimiser plugin and its options."""
    evolution: Evolution = Evolution()


WORLD: Final = ("arena", "box", "emitter", "scene", "robot", "team", "sensors", "noise", "physics", "episode")
"""Sections that describe the world; the others say how controllers are evolved in it."""


def surroundings(config: Config) -> Surroundings:
    """Return what is in the arena, every list spelled out; box, emitter and target wall where ``scene`` names none."""
    scene, arena = config.scene, config.arena
    named = scene.movables if scene.movables is not None else (config.box,)
    friction = config.physics.box_friction
    walled = arena.shape in ("square", "rectangle")
    return scene.model_copy(
        update={
            "movables": tuple(
                movable if movable.friction is not None else movable.model_copy(update={"friction": friction})
                for movable in named
            ),
            "emitters": scene.emitters if scene.emitters is not None else (config.emitter,),
            "goals": scene.goals
            if scene.goals is not None
            else ((Goal(wall=arena.target_wall),) if walled and named else ()),
        }
    )


def world(config: Config) -> dict[str, dict[str, Any]]:
    """Return the world of ``config``: of each section in :data:`WORLD` the keys and their values, lists as tuples.

    The lists of ``scene`` are spelled out, as :func:`surroundings` has them.
    """
    plain = {name: getattr(config, name).model_dump() for name in WORLD}
    return plain | {"scene": surroundings(config).model_dump()}

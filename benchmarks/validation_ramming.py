# SPDX-License-Identifier: BSD-3-Clause
"""Fewer than three robots: what one and two get out of ramming, with everything that a search for it finds.

Strategies are start poses and wheel commands over time. A search looks for those that move the box most.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import product
from typing import Any, Literal, NamedTuple

import numpy as np
from cmaes import CMA
from matplotlib.figure import Figure

from benchmarks.cases import changed
from benchmarks.reference import Planar
from benchmarks.validation_scenes import (
    Pose,
    Section,
    Settings,
    in_parallel,
    keys,
    millimetres,
    random_networks,
    sound,
    standing,
    table,
    traction,
    turn,
)
from swarmevo.config import Config
from swarmevo.errors import InvalidArgument
from swarmevo.protocols import Compiled, FloatArray
from swarmevo.simulation import Episodes, Scene, simulate

STILL = 0.005
"""A box none of whose points moved by more than this was not moved [m]."""
TEAMS = ONE, ABREAST, ROW, TWO = "one", "two, side by side", "two, in a row", "two, anywhere"
"""Teams, as the page calls them. The middle two stand before the middle of a face."""
BOX: Pose = (0.0, 0.1, 0.0)
"""Where the box is: in the open, with room for robots on all sides."""
TRAVELS = (0.006, 0.008, 0.01, 0.011, 0.012, 0.014)
"""Of bumpers [m], for two in a row."""
HORIZON = Config().episode.horizon
PERIOD = Config().physics.time_step
"""Of the commands [s]: as fine as the physics, and so all that the default control period can do and more."""

_ROW = 2 * ctypes.sizeof(ctypes.c_double)
_NEXT_TO = 5e-4
"""Between two robots side by side [m]."""


# ---- strategies ------------------------------------------------------------------------------------------------------


class Wave(NamedTuple):
    """A square wave, in shares of a wheel's top speed."""

    mean: float = 0.0
    amplitude: float = 0.0
    period: float = 1.0
    """[s]"""
    phase: float = 0.0
    """At the start, in periods."""
    duty: float = 0.5
    """Share of the period above the mean."""

    def at(self, time: FloatArray) -> FloatArray:
        """Return the values at times [s]."""
        # A hair later, so that edges between two steps fall on the same side whatever the rounding.
        above = (time / self.period + self.phase + 1e-9) % 1 < self.duty
        return self.mean + self.amplitude * np.where(above, 1.0, -1.0)


class Drive(NamedTuple):
    """What a robot does whatever it senses."""

    forward: Wave
    turn: Wave = Wave()
    """Added to the right wheel and taken from the left one."""

    def commands(self, time: FloatArray) -> FloatArray:
        """Return left and right wheel at times [s], shape ``(len(time), 2)``."""
        forward, turning = self.forward.at(time), self.turn.at(time)
        return np.clip(np.column_stack([forward - turning, forward + turning]), -1, 1)

    def backwards(self) -> Drive:
        """Return the drive that does with the tail what this one does with the nose."""
        ahead = self.forward
        return Drive(ahead._replace(mean=-ahead.mean, amplitude=-ahead.amplitude), self.turn)


class Strategy(NamedTuple):
    """Start poses and drives, one for each robot."""

    poses: tuple[Pose, ...]
    drives: tuple[Drive, ...]

    def commands(self, time: FloatArray) -> FloatArray:
        """Return commands at times [s], shape ``(robots, len(time), 2)``."""
        return np.array([drive.commands(time) for drive in self.drives])


class Face(NamedTuple):
    """A side of the box; robots before it look at it if they look along its inward normal."""

    name: Literal["long", "short"]
    half_length: float
    """[m]"""
    half_depth: float
    """From the face to the box's middle [m]."""
    normal: float
    """Inward [rad], with the box at heading 0."""

    def pose(self, along: float, gap: float = 0.002, slant: float = 0.0) -> Pose:
        """Return the pose of a robot [m, rad].

        Args:
            along: From the middle of the face to the right of one who looks at it [m].
            gap: Between bumper and face [m].
            slant: Of its heading to the normal, anticlockwise [rad].
        """
        away = self.half_depth + Config().robot.radius + gap
        c, s = np.cos(self.normal), np.sin(self.normal)
        x, y = BOX[0] - away * c + along * s, BOX[1] - away * s - along * c
        return (float(x), float(y), float(turn(self.normal + slant)))

    def along(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return where along the face places are [m]."""
        s, c = float(np.sin(self.normal)), float(np.cos(self.normal))
        return (x - BOX[0]) * s - (y - BOX[1]) * c


def faces() -> tuple[Face, ...]:
    """Return the south, east, north and west face."""
    length, width, _ = Config().box.size
    long = (length / 2, width / 2)
    short = (width / 2, length / 2)
    return (
        Face("long", *long, np.pi / 2),
        Face("short", *short, np.pi),
        Face("long", *long, -np.pi / 2),
        Face("short", *short, 0.0),
    )


def face_before(pose: Pose) -> Face:
    """Return the face before whose middle a robot stands."""
    outward = np.arctan2(pose[1] - BOX[1], pose[0] - BOX[0])
    return min(faces(), key=lambda face: float(np.cos(face.normal - outward)))


def spacing() -> float:
    """Return the distance of two robots side by side [m]."""
    return 2 * Config().robot.radius + _NEXT_TO


class Bumper(NamedTuple):
    """What softens the blows of robots, and what holds the box against them."""

    kind: Literal["sprung", "rigid"]
    stiffness: float
    """[N/m]"""
    damping: float
    """[N s/m]"""
    travel: float
    """[m]"""
    box_friction: float

    def sections(self) -> dict[str, dict[str, Any]]:
        """Return it as changes of a config."""
        robot = {
            "bumper": self.kind,
            "bumper_stiffness": self.stiffness,
            "bumper_damping": self.damping,
            "bumper_travel": self.travel,
        }
        return {"robot": robot, "physics": {"box_friction": self.box_friction}}


def default_bumper() -> Bumper:
    """Return the default."""
    robot = Config().robot
    return Bumper(
        robot.bumper,
        robot.bumper_stiffness,
        robot.bumper_damping,
        robot.bumper_travel,
        Config().physics.box_friction,
    )


# ---- what becomes of the box -----------------------------------------------------------------------------------------


class Moved(NamedTuple):
    """How far the box got from where it was, at most."""

    way: float
    """Of its middle [m]."""
    turn: float
    """[rad]"""
    reach: float
    """What no point of it exceeded [m]."""


def moved(boxes: FloatArray) -> Moved:
    """Return how far the box got over the time, poses ``(steps, 3)``, from the first of them."""
    x, y, heading = (boxes - boxes[0]).T
    way, turned = np.hypot(x, y), np.abs(np.unwrap(heading))
    length, width, _ = Config().box.size
    reach = way + turned * np.hypot(length, width) / 2
    return Moved(float(way.max()), float(turned.max()), float(reach.max()))


def boxes_of(done: Episodes, episode: int = 0) -> FloatArray:
    """Return the box's poses ``(steps + 1, 3)`` in an episode."""
    return np.vstack([done.telemetry.box[episode], done.box_pose[episode]])


def _follow(schedule: int, _observation: int, memory: ctypes._Pointer[ctypes.c_double], command: int) -> None:
    """Give the next row of a schedule; the memory counts them."""
    row = int(memory[0])
    memory[0] = row + 1
    ctypes.memmove(command, schedule + row * _ROW, _ROW)


_POINTER = ctypes.POINTER(ctypes.c_double)
_FOLLOW = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, _POINTER, ctypes.c_void_p)(_follow)


def instants(horizon: float) -> FloatArray:
    """Return when commands change [s]."""
    return np.arange(round(horizon / PERIOD), dtype=np.float64) * PERIOD


def scene(poses: Sequence[Pose], horizon: float = HORIZON, noise: bool = False, bumper: Bumper | None = None) -> Config:
    """Return a config with the box in the open and robots at some poses."""
    config = changed(
        standing(poses),
        **(bumper or default_bumper()).sections(),
        box={"pose": BOX},
        episode={"horizon": horizon, "control_period": PERIOD},
    )
    return changed(config, noise=Config().noise.model_dump()) if noise else config


def play(strategy: Strategy, config: Config, seed: int = 1) -> Episodes:
    """Run an episode, with the channels ``box`` and ``pose``.

    Raises:
        InvalidArgument: Robots overlap each other or the box at the start.
    """
    schedule = strategy.commands(instants(config.episode.horizon)).reshape(len(strategy.drives), -1)
    address = ctypes.cast(_FOLLOW, ctypes.c_void_p).value
    assert address is not None
    policies = Compiled(address, schedule, memory=1, keep_alive=_FOLLOW)
    drivers = np.arange(len(schedule), dtype=np.uint32)[np.newaxis]
    return sound(simulate(Scene(config), policies, keys(1, seed), drivers, ("box", "pose")))


def track(
    strategy: Strategy, horizon: float = HORIZON, noise: bool = False, bumper: Bumper | None = None
) -> FloatArray:
    """Return the box's poses ``(steps + 1, 3)`` under a strategy."""
    return boxes_of(play(strategy, scene(strategy.poses, horizon, noise, bumper)))


def outcome(strategy: Strategy, horizon: float = HORIZON, noise: bool = False, bumper: Bumper | None = None) -> Moved:
    """Return what a strategy does to the box."""
    return moved(track(strategy, horizon, noise, bumper))


def outcome_in_lane(strategy: Strategy, horizon: float = HORIZON, bumper: Bumper | None = None) -> Moved:
    """Return what a strategy does to the box for as long as every robot keeps to its lane before its face."""
    done = play(strategy, scene(strategy.poses, horizon, bumper=bumper))
    x, y, _ = np.moveaxis(done.telemetry.pose[0], -1, 0)
    along = face_before(strategy.poses[0]).along(x, y)
    outside = (np.abs(along - along[0]) > LANE).any(axis=1)
    steps = int(outside.argmax()) if outside.any() else len(outside)
    return moved(boxes_of(done)[: steps + 1])


def track_in_reference(strategy: Strategy, horizon: float = HORIZON, bumper: Bumper | None = None) -> FloatArray:
    """Return the box's poses ``(steps + 1, 3)`` under a strategy in the reference simulator."""
    worn = bumper or default_bumper()
    world = Planar(
        strategy.poses,
        BOX,
        bumper=worn.kind,
        bumper_stiffness=worn.stiffness,
        bumper_damping=worn.damping,
        bumper_travel=worn.travel,
        mu_box=worn.box_friction,
    )
    boxes = [world.box()]
    for commands in strategy.commands(instants(horizon)).swapaxes(0, 1):
        world.set(commands)
        world.go(PERIOD)
        boxes.append(world.box())
    return np.array(boxes)


# ---- what comes to mind ----------------------------------------------------------------------------------------------


RHYTHMS = ((0.2, 0.75), (0.3, 0.67), (0.4, 0.625), (0.6, 0.55), (1.0, 0.55), (2.0, 0.525))
"""Periods [s] of ramming, and their share that goes forwards: a little more than half, to keep at it."""
PHASES = np.arange(8) / 8
FULL = Drive(Wave(1.0))


def ram(rhythm: tuple[float, float], phase: float = 0.0) -> Drive:
    """Return full speed to and fro."""
    period, duty = rhythm
    return Drive(Wave(0.0, 1.0, period, phase, duty))


def wriggle(period: float, amplitude: float, phase: float = 0.0) -> Drive:
    """Return full speed ahead less what turning to and fro takes."""
    return Drive(Wave(1.0 - amplitude), Wave(0.0, amplitude, period, phase))


def with_tail(strategy: Strategy) -> Strategy:
    """Return the strategy with every robot turned round and backwards."""
    poses = tuple((x, y, float(turn(heading + np.pi))) for x, y, heading in strategy.poses)
    return Strategy(poses, tuple(drive.backwards() for drive in strategy.drives))


def by_nose_and_tail(strategies: Iterable[Strategy]) -> list[Strategy]:
    """Return the strategies, each also with the tail."""
    return [either for strategy in strategies for either in (strategy, with_tail(strategy))]


def places_of_one() -> list[Pose]:
    """Return poses before the middle, the quarter and the end of a long and a short face, at two distances."""
    south, east, *_ = faces()
    return [
        face.pose(share * face.half_length, gap)
        for face, share, gap in product((south, east), (0.0, 0.5, 1.0), (0.01, 0.017))
    ]


Stand = Callable[[Face], tuple[Pose, Pose]]
"""Poses of two robots before a face."""


def abreast(face: Face, middle: float = 0.0, gap: float = 0.02) -> tuple[Pose, Pose]:
    """Return poses of two robots side by side before a face."""
    return face.pose(middle - spacing() / 2, gap), face.pose(middle + spacing() / 2, gap)


def in_a_row(face: Face, gap: float = 0.002) -> tuple[Pose, Pose]:
    """Return poses of two robots one behind the other, at as little as ``gap`` before the middle of a face."""
    return face.pose(0.0, gap), face.pose(0.0, 2 * gap + 2 * Config().robot.radius)


def rammings_of_one() -> list[Strategy]:
    """Return one robot that rams."""
    return by_nose_and_tail(Strategy((pose,), (ram(rhythm),)) for pose, rhythm in product(places_of_one(), RHYTHMS))


def wriggles_of_one() -> list[Strategy]:
    """Return one robot that presses and turns to and fro."""
    return by_nose_and_tail(
        Strategy((pose,), (wriggle(period, amplitude),))
        for pose, period, amplitude in product(places_of_one(), (0.2, 0.4, 1.0), (0.2, 0.5))
    )


def rammings_of_two(stand: Stand) -> list[Strategy]:
    """Return two robots that ram in all phases, the first or the second of them may lean instead."""
    drives = [
        *((ram(rhythm), ram(rhythm, phase)) for rhythm, phase in product(RHYTHMS, PHASES)),
        *((FULL, ram(rhythm)) for rhythm in RHYTHMS),
        *((ram(rhythm), FULL) for rhythm in RHYTHMS),
    ]
    south, east, *_ = faces()
    return by_nose_and_tail(Strategy(stand(face), both) for face, both in product((south, east), drives))


def wriggles_of_two(stand: Stand) -> list[Strategy]:
    """Return two robots that press and turn to and fro, together or against each other."""
    south, east, *_ = faces()
    return [
        Strategy(stand(face), (wriggle(period, amplitude), wriggle(period, amplitude, phase)))
        for face, period, amplitude, phase in product((south, east), (0.2, 0.4, 1.0), (0.2, 0.5), (0.0, 0.5))
    ]


def networks(robots: int, n: int, at_box: bool, horizon: float = HORIZON, threads: int = 1) -> list[Moved]:
    """Return what random networks do to the box, each robot with its own, with the default noise.

    They start anywhere, or before the face, close to it, whatever way they look.
    """
    around = [faces()[0].pose(along, 0.03) for along in (-0.08, 0.08)][:robots]
    config = scene(around, horizon, noise=True)
    team = {"start_jitter": (0.02, np.pi)} if at_box else {"start": "random", "start_poses": ()}
    drivers = np.arange(n * robots, dtype=np.uint32).reshape(n, robots)
    policies = random_networks(n * robots, seed=robots, forward=1.0)
    done = simulate(Scene(changed(config, team=team)), policies, keys(n), drivers, ("box",), threads)
    return [moved(boxes_of(sound(done), i)) for i in range(n)]


# ---- what a search finds ---------------------------------------------------------------------------------------------


LANE = 0.01
"""By how much a robot that rams the middle of a face may stray along it [m]."""
_SLANT = float(np.radians(10))  # below the angle of friction of the sides, 11 degrees: they do not slide along the face
_SHORTEST, _LONGEST = 0.1, 4.0  # periods [s]
_CANDIDATES = 20
_FIRST = 200
_STEP = 0.2


class Hunt(NamedTuple):
    """A search for the strategy that moves the box most, over vectors in the unit cube."""

    size: int
    """Of the vectors."""
    read: Callable[[FloatArray], Strategy]
    judge: Callable[[Strategy, float], Moved]


def read_wave(x: FloatArray, largest: float = 1.0) -> Wave:
    """Return the wave for five numbers from 0 to 1."""
    mean, amplitude = largest * (2 * x[0] - 1), largest * x[1]
    period = _SHORTEST * (_LONGEST / _SHORTEST) ** x[2]
    return Wave(*(_rounded(number) for number in (mean, amplitude, period, x[3], 0.05 + 0.9 * x[4])))


def read_anywhere(x: FloatArray) -> Strategy:
    """Return a strategy of robots anywhere round the box, 13 numbers for each: pose, forward and turning wave."""
    numbers = x.reshape(-1, 13)
    poses = tuple(_round_the_box(*row[:3]) for row in numbers)
    return Strategy(poses, tuple(Drive(read_wave(row[3:8]), read_wave(row[8:])) for row in numbers))


def _round_the_box(place: float, away: float, slant: float) -> Pose:
    lengths = [2 * face.half_length for face in faces()]
    i = min(int(np.searchsorted(np.cumsum(lengths), place * sum(lengths))), len(lengths) - 1)
    along = place * sum(lengths) - sum(lengths[:i]) - lengths[i] / 2
    return _rounded_pose(faces()[i].pose(along, 0.0005 + 0.06 * away, np.pi * (2 * slant - 1)))


def read_middle(face: Face, row: bool, x: FloatArray) -> Strategy:
    """Return a strategy of two robots before the middle of a face, side by side or in a row, for 24 numbers."""
    middle, apart = LANE * (2 * x[0] - 1), 0.015 * x[1]
    strategies = []
    gap = 0.0
    for side, (away, slant, *waves) in zip((-1, 1), x[2:].reshape(2, 11), strict=True):
        along = middle + (0 if row else side * (spacing() + apart) / 2)
        gap = 0.0005 + 0.03 * away + (gap + 2 * Config().robot.radius if row and side == 1 else 0)
        pose = face.pose(along, gap, _SLANT * (4 * (slant % 0.5) - 1))
        turning = read_wave(np.array([0.5, *waves[5:]]), 0.5)
        one = Strategy((pose,), (Drive(read_wave(np.array(waves[:5])), turning),))
        strategies.append(one if slant < 0.5 else with_tail(one))
    return Strategy(
        tuple(_rounded_pose(one.poses[0]) for one in strategies), tuple(one.drives[0] for one in strategies)
    )


def _rounded(number: float) -> float:
    return round(float(number), 4)  # so that what the page prints is the strategy itself


def _rounded_pose(pose: Pose) -> Pose:
    x, y, heading = pose
    return _rounded(x), _rounded(y), _rounded(heading)


def hunt(of: Hunt, budget: int, seed: int, threads: int = 1, horizon: float = HORIZON) -> tuple[Moved, Strategy]:
    """Return the strategy that moves the box most of ``budget`` tried: some at random, then CMA-ES from the best."""

    def judge(strategy: Strategy) -> Moved:
        try:
            return of.judge(strategy, horizon)
        except InvalidArgument:  # robots overlap at the start
            return Moved(0.0, 0.0, 0.0)

    rng = np.random.default_rng(seed)
    points = rng.random((min(_FIRST, budget // 2), of.size))
    found = list(zip(in_parallel(judge, map(of.read, points), threads), map(of.read, points), strict=True))
    start = points[int(np.argmax([result.reach for result, _ in found]))]
    search = CMA(start, _STEP, np.tile([0.0, 1.0], (of.size, 1)), seed=seed, population_size=_CANDIDATES)
    while len(found) < budget:
        points = np.array([search.ask() for _ in range(_CANDIDATES)])
        strategies = [of.read(point) for point in points]
        results = in_parallel(judge, strategies, threads)
        search.tell([(point, -result.reach) for point, result in zip(points, results, strict=True)])
        found += zip(results, strategies, strict=True)
    return max(found, key=lambda each: each[0].reach)


def hunts() -> dict[str, list[Hunt]]:
    """Return what is searched for, each several times."""
    south, east, *_ = faces()
    anywhere = [Hunt(13 * robots, read_anywhere, outcome) for robots in (1, 2)]
    middle = {
        row: [Hunt(24, partial(read_middle, face, row), outcome_in_lane) for face in (south, east)]
        for row in (False, True)
    }
    return {ONE: [anywhere[0]] * 4, ABREAST: middle[False] * 2, ROW: middle[True] * 2, TWO: [anywhere[1]] * 4}


# ---- at one end of a face --------------------------------------------------------------------------------------------


def bumpers() -> list[Bumper]:
    """Return the default, softer ones with as much damping relative to the critical, and other coefficients."""
    default = default_bumper()
    largest_travel = Config().robot.radius / 2
    softer = [
        default._replace(
            stiffness=stiffness,
            damping=round(default.damping * np.sqrt(stiffness / default.stiffness), 1),
            travel=min(round(default.travel * default.stiffness / stiffness, 4), largest_travel),
        )
        for stiffness in (60.0, 30.0)
    ]
    return [default, *softer, *(default._replace(box_friction=friction) for friction in (0.60, 0.64))]


def at_end(face: Face, gap: float = 0.03) -> tuple[Pose, Pose]:
    """Return poses of two robots side by side, the outer one before the very end of a face."""
    return abreast(face, face.half_length - spacing() / 2, gap)


def blow(poses: Callable[[float], tuple[Pose, ...]], bumper: Bumper) -> Moved:
    """Return what one blow does in the mean over run-ups, which fall on all phases of a time step.

    Args:
        poses: Start poses for a gap [m].
        bumper: The bumper.
    """
    blows = [
        outcome(Strategy(start, (FULL,) * len(start)), _BLOW, bumper=bumper)
        for start in map(poses, 0.03 + 0.008 * PHASES)
    ]
    return Moved(*(float(number) for number in np.mean(blows, axis=0)))


_BLOW = 2.0  # from start to rest [s]


def ramming(poses: tuple[Pose, ...], bumper: Bumper, horizon: float = HORIZON) -> tuple[Moved, Strategy]:
    """Return the most that ramming in step at any of the rhythms does, and how."""
    strategies = [Strategy(poses, (ram(rhythm),) * len(poses)) for rhythm in RHYTHMS]
    outcomes = [(outcome(strategy, horizon, bumper=bumper), strategy) for strategy in strategies]
    return max(outcomes, key=lambda each: each[0].reach)


# ---- the page --------------------------------------------------------------------------------------------------------


class Family(NamedTuple):
    """Strategies of a kind, and what each did to the box."""

    team: str
    name: str
    outcomes: list[Moved]
    strategies: list[Strategy]
    """Empty for networks."""

    def best(self) -> tuple[Moved, Strategy]:
        """Return the strategy that moved the box most."""
        return max(zip(self.outcomes, self.strategies, strict=True), key=lambda each: each[0].reach)


def families(settings: Settings) -> list[Family]:
    """Return all that comes to mind, tried."""

    def tried(team: str, name: str, strategies: list[Strategy], judge: Callable[[Strategy], Moved]) -> Family:
        return Family(team, name, in_parallel(judge, strategies, settings.threads), strategies)

    found = [
        tried(ONE, "rams", rammings_of_one(), outcome),
        tried(ONE, "rams, wheels with noise", rammings_of_one(), partial(outcome, noise=True)),
        tried(ONE, "presses and turns to and fro", wriggles_of_one(), outcome),
    ]
    for team, stand in ((ABREAST, abreast), (ROW, in_a_row)):
        found += [
            tried(team, "ram in all phases", rammings_of_two(stand), outcome_in_lane),
            tried(team, "press and turn to and fro", wriggles_of_two(stand), outcome_in_lane),
        ]
    for robots, team in ((1, ONE), (2, TWO)):
        for at_box, start in ((False, "anywhere"), (True, "at the box")):
            outcomes = networks(robots, _NETWORKS, at_box, threads=settings.threads)
            found.append(Family(team, f"random networks, with noise, from {start}", outcomes, []))
    return found


_NETWORKS = 64


def hunted(settings: Settings) -> list[Family]:
    """Return what searches find, with twice as many strategies in all as the stress test has episodes."""
    all_hunts = hunts()
    found = []
    for team, of in all_hunts.items():
        budget = max(2 * _CANDIDATES, 2 * settings.episodes // len(all_hunts) // len(of))
        best = [hunt(each, budget, seed, settings.threads) for seed, each in enumerate(of)]
        name = f"best of {len(of)} searches"
        found.append(Family(team, name, [result for result, _ in best], [strategy for _, strategy in best]))
    return found


def section(settings: Settings) -> Section:
    """Measure, and write this part of the page."""
    known, searched = families(settings), hunted(settings)
    compared = matches(known + searched)
    text = "\n".join(
        [
            _head(settings),
            _table_of_families(known, searched, settings),
            _reference_table(compared),
            _travel_table(settings),
            _end_table(settings),
            _rigid_table(settings),
        ]
    )
    return Section(text, {"ramming.png": _figure(compared)})


def _head(settings: Settings) -> str:
    robot = Config().robot
    return f"""## Fewer than three

Can one robot move the box after all, or two, by ramming it? Robots wear a {robot.bumper} bumper
({_bumper_words(default_bumper())}). The physics is the default; the box stands in the open, {millimetres(BOX[1]):g} mm
north of the arena's middle, with room on all sides. Each strategy is tried for {HORIZON:g} s: start poses, and wheel
commands that may change every {millimetres(PERIOD):g} ms. Measured are the largest way of the box's middle and its
largest turn. The box counts as moved if any of its points may have got {millimetres(STILL):g} mm away: its way, and
what its turn does to its corners.

Strategies that come to mind: to and fro at periods of {RHYTHMS[0][0]:g} to {RHYTHMS[-1][0]:g} s, with the nose and with
the tail, before the middle, the quarter and the end of a long and a short face; two with every eighth of a period
between them, or one that leans while the other rams; pressing while turning to and fro; random networks. No noise but
where it is said. Then searches *for* moving the box, {2 * settings.episodes} episodes in all: CMA-ES from the best of
{_FIRST} at random, over start poses round the box and, for each robot, a square wave ahead and one for turning (mean,
amplitude, period, phase, duty). In front of the middle of a face two robots stand up to {millimetres(LANE):g} mm off
it, and what they do counts for as long as neither strays by more than {millimetres(LANE):g} mm along the face: it is
what they do to the middle that is asked.
"""


def _bumper_words(bumper: Bumper) -> str:
    if bumper.kind == "rigid":
        return "rigid"
    return f"{bumper.stiffness:g} N/m, {bumper.damping:g} N s/m, {millimetres(bumper.travel):g} mm of travel"


def _way(result: Moved) -> str:
    return _shown(millimetres(result.way))


def _turn(result: Moved) -> str:
    return _shown(float(np.degrees(result.turn)))


def _shown(number: float) -> str:
    return f"{number:.3f}" if number < 1 else f"{number:.1f}"


def is_still(found: Iterable[Family], team: str) -> bool:
    """Whether no strategy of a team moved the box."""
    return all(result.reach < STILL for family in found if family.team == team for result in family.outcomes)


def _table_of_families(known: Sequence[Family], searched: Sequence[Family], settings: Settings) -> str:
    rows = []
    found = sorted([*known, *searched], key=lambda family: TEAMS.index(family.team))
    for family in found:
        most = max(family.outcomes, key=lambda result: result.reach)
        tried = len(family.outcomes) if family in known else 2 * settings.episodes // len(searched)
        count = sum(result.reach >= STILL for result in family.outcomes)
        rows.append([family.team, family.name, tried, _way(most), _turn(most), f"{count} of {len(family.outcomes)}"])
    verdicts = {team: _yes(is_still(found, team)) for team in (ONE, ABREAST, ROW)}
    return f"""The most that any of them does to the box:

{table(["robots", "what they do", "tried", "way [mm]", "turn [deg]", "moved it"], rows)}
One robot never moves it: **{verdicts[ONE]}**. Two that ram the middle of a face side by side never move it:
**{verdicts[ABREAST]}**. Two that ram it one behind the other never move it: **{verdicts[ROW]}**. Two anywhere, at the
ends of faces too, are not asked to: see below.
"""


class Match(NamedTuple):
    """The most effective strategy of a team, and what both simulators make of it."""

    team: str
    strategy: Strategy
    counted: Moved
    ours: FloatArray
    """The box's poses ``(steps + 1, 3)``."""
    reference: FloatArray


def matches(found: Sequence[Family]) -> list[Match]:
    """Try the most effective strategy of each team in both simulators."""
    best = {
        team: max((f.best() for f in found if f.team == team and f.strategies), key=lambda each: each[0].reach)
        for team in TEAMS
    }
    return [Match(team, how, most, track(how), track_in_reference(how)) for team, (most, how) in best.items()]


def _reference_table(compared: Sequence[Match]) -> str:
    rows = [
        [m.team, _way(m.counted), *(cell(moved(boxes)) for boxes in (m.ours, m.reference) for cell in (_way, _turn))]
        for m in compared
    ]
    words = [f"- {m.team.capitalize()}: {described(m.strategy)}." for m in compared]
    head = ["robots", "in the table above: way [mm]", "way [mm]", "turn [deg]", "reference: way [mm]", "turn [deg]"]
    return f"""The most effective of each in the reference simulator (`benchmarks/reference.py`, another method in steps
of 10 us), for {HORIZON:g} s and wherever they stray:

{table(head, rows)}
![Way of the box over time](validation/ramming.png)

They are, with poses in m and rad and speeds in shares of the top speed, turning added to the right wheel and taken from
the left one, and both clipped to [-1, 1]:

{chr(10).join(words)}
"""


def _figure(compared: Sequence[Match]) -> Figure:
    """Draw the way of the box over time in both simulators."""
    figure = Figure(figsize=(8, 4), layout="constrained")
    axes = figure.add_subplot()
    for i, match in enumerate(compared):
        for boxes, style in ((match.ours, "-"), (match.reference, "--")):
            way = np.hypot(*(boxes - boxes[0]).T[:2])
            axes.plot(
                PERIOD * np.arange(len(way)),
                millimetres(1) * np.maximum(way, 1e-6),
                style,
                color=f"C{i}",
                label=match.team if style == "-" else f"{match.team}, reference",
            )
    axes.axhline(millimetres(STILL), color="0.4", linewidth=0.8)
    axes.set(xlabel="time [s]", ylabel="way of the box [mm]", yscale="log")
    figure.legend(loc="outside right upper", fontsize=8)
    return figure


def _travel_table(settings: Settings) -> str:
    south, *_ = faces()
    default = default_bumper()
    strategies = [each for each in rammings_of_two(in_a_row) if face_before(each.poses[0]) == south][::2]
    rows = []
    for travel in TRAVELS:
        tried = partial(outcome_in_lane, bumper=default._replace(travel=travel))
        outcomes = in_parallel(tried, strategies, settings.threads)
        most = max(outcomes, key=lambda result: result.reach)
        count = sum(result.reach >= STILL for result in outcomes)
        rows.append([f"{millimetres(travel):g}", _way(most), _turn(most), f"{count} of {len(outcomes)}"])
    pressed = 2 * traction() / default.stiffness
    return f"""Two in a row both press on the front one's bumper: with all their traction by {millimetres(pressed):.1f}
mm. If that is more than its travel, it stands on its stop, and blows are rigid again. The same rammings before the long
face, with the nose, by the travel of the bumpers:

{table(["travel [mm]", "way [mm]", "turn [deg]", "moved it"], rows)}"""


def described(strategy: Strategy) -> str:
    """Return a strategy in words, with all its numbers."""
    robots = []
    for pose, drive in zip(strategy.poses, strategy.drives, strict=True):
        words = f"from ({', '.join(map(_number, pose))}) ahead {_described(drive.forward)}"
        robots.append(words + (f", turning {_described(drive.turn)}" if drive.turn != Wave() else ""))
    return "; ".join(robots)


def _described(wave: Wave) -> str:
    high, low = _number(wave.mean + wave.amplitude), _number(wave.mean - wave.amplitude)
    if high == low:
        return high
    period, phase, share = map(_number, (wave.period, wave.phase, wave.duty))
    return f"{high} for {share} of a period of {period} s, else {low}, from {phase} of it on"


def _number(number: float) -> str:
    return f"{round(number, 5) + 0:g}"


def _end_table(settings: Settings) -> str:
    south, east, *_ = faces()
    tasks = [*((south, bumper) for bumper in bumpers()), (east, default_bumper())]
    rows = in_parallel(lambda task: _end_row(*task), tasks, settings.threads)
    head = [
        "face",
        "bumper",
        "box friction",
        "a blow: way [mm]",
        "turn [deg]",
        f"{HORIZON:g} s: way [mm]",
        "turn [deg]",
        "reference: a blow: way [mm]",
        "turn [deg]",
        f"{HORIZON:g} s: way [mm]",
        "turn [deg]",
    ]
    return f"""Two robots that ram one end of a face in step *do* move the box. Pressing there they have 6 % less force
than it takes, and the blow of their arrival is more than that. One blow from 30 mm and more away, in the mean over all
phases of the time step, and the most that ramming for {HORIZON:g} s at one of the rhythms does (the outer robot before
the very end of the face; both drive straight on and to and fro, and soon slip past the turning box; with the
reference, the same rhythm):

{table(head, rows)}
Softer bumpers have as much damping relative to the critical and as much travel relative to what one robot presses them
in, up to half the radius. What holds the box there is its friction alone, so this stays a way for two to turn it. At
the end of the short face two just fail to.
"""


def _end_row(face: Face, bumper: Bumper) -> list[object]:
    single = Strategy(at_end(face), (FULL, FULL))
    most, how = ramming(at_end(face), bumper)
    results = [
        blow(partial(at_end, face), bumper),
        most,
        moved(track_in_reference(single, _BLOW, bumper)),
        moved(track_in_reference(how, bumper=bumper)),
    ]
    cells = [cell for result in results for cell in (_way(result), _turn(result))]
    return [face.name, _bumper_words(bumper), f"{bumper.box_friction:g}", *cells]


def _rigid_table(settings: Settings) -> str:
    south, *_ = faces()
    rigid = default_bumper()._replace(kind="rigid")
    stands: dict[str, Callable[[float], tuple[Pose, ...]]] = {
        "one, middle": lambda gap: (south.pose(0.0, gap),),
        "two, middle, side by side": partial(abreast, south, 0.0),
        "two, one end": partial(at_end, south),
    }
    results = in_parallel(
        lambda stand: (blow(stand, rigid), ramming(stand(0.03), rigid, _RIGID_HORIZON)[0]),
        stands.values(),
        settings.threads,
    )
    rows = [
        [name, *(cell(result) for result in both for cell in (_way, _turn))]
        for name, both in zip(stands, results, strict=True)
    ]
    head = ["robots, long face", "a blow: way [mm]", "turn [deg]", f"{_RIGID_HORIZON:g} s: way [mm]", "turn [deg]"]
    return f"""For comparison, with `robot.bumper=rigid`, where the momentum of one blow shifts the box by
{millimetres(rigid_way()):.3f} mm whatever holds it:

{table(head, rows)}"""


_RIGID_HORIZON = 30.0


def rigid_way() -> float:
    """Return how far one blow by one rigid robot at top speed moves the box [m], with the robot pushing on."""
    config = Config()
    m, big_m = config.robot.mass, config.box.mass
    speed = config.robot.top_speed * config.robot.wheel_radius
    hold = config.physics.box_friction * big_m * config.physics.gravity
    return (m * speed) ** 2 / (2 * (m + big_m) * (hold - traction()))


def _yes(fact: bool) -> str:
    return "yes" if fact else "no"

# SPDX-License-Identifier: BSD-3-Clause
"""The reference simulator of native/reference, from Python: what the product's physics is held against.

    world = Planar([(0.0, -0.15, np.pi / 2)], box=(0.0, 0.0, 0.0), bumper="rigid", mu_box=0.58)
    world.set([(1.0, 1.0)])
    world.go(2.0)
    world.box(), world.robot(0), world.largest_push

The library is built with the C++ compiler when it is first wanted and whenever its sources are newer. It knows nothing
of the product's library, and this module imports nothing of the product.
"""

from __future__ import annotations

import ctypes
import functools
import os
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "native" / "reference"
LIBRARY = ROOT / "build" / "reference" / "libplanar_reference.so"

# As the product is compiled: no fused multiply-add, so that every x86-64 gives the same bits.
COMPILE = ("-std=c++17", "-O2", "-ffp-contract=off", "-shared", "-fPIC", "-Wall", "-Wextra")

_MESSAGE_ROOM = 200
_Doubles = ctypes.POINTER(ctypes.c_double)


def build() -> Path:
    """Return the path of the library, built anew if it is missing or older than a source.

    Raises:
        RuntimeError: It does not compile; says what the compiler said.
    """
    sources = sorted(SOURCES.glob("*.cpp"))
    newest = max(path.stat().st_mtime for path in [*sources, *SOURCES.glob("*.hpp")])
    if LIBRARY.exists() and LIBRARY.stat().st_mtime >= newest:
        return LIBRARY
    LIBRARY.parent.mkdir(parents=True, exist_ok=True)
    fresh = LIBRARY.with_suffix(f".{os.getpid()}")  # then renamed: other processes may be loading the old one
    command = [os.environ.get("CXX", "g++"), *COMPILE, "-o", str(fresh), *map(str, sources)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"expected {SOURCES} to compile, got:\n{done.stderr}")
    fresh.replace(LIBRARY)
    return LIBRARY


@functools.cache
def _library() -> ctypes.CDLL:
    library = ctypes.CDLL(str(build()))
    world, integer, double = ctypes.c_void_p, ctypes.c_int, ctypes.c_double
    numbers = [ctypes.POINTER(ctypes.c_char_p), _Doubles, integer, _Doubles, integer]
    message = [ctypes.c_char_p, integer]
    signatures = {
        "create": (world, [*numbers, _Doubles, *message]),
        "create_among": (world, [*numbers, _Doubles, integer, _Doubles, integer, _Doubles, integer, *message]),
        "destroy": (None, [world]),
        "set_commands": (None, [world, _Doubles]),
        "advance": (None, [world, ctypes.c_long]),
        "read_state": (None, [world, _Doubles]),
        "read_foot_loads": (None, [world, integer, _Doubles]),
        "push": (double, [world]),
        "largest_push": (double, [world]),
        "forget_largest_push": (None, [world]),
        "energy": (double, [world]),
        "default_time_step": (double, []),
    }
    for name, (result, arguments) in signatures.items():
        function = getattr(library, f"planar_{name}")
        function.restype, function.argtypes = result, arguments
    return library


def _pointer(array: FloatArray) -> ctypes._Pointer[ctypes.c_double]:
    return array.ctypes.data_as(_Doubles)


class Movable(NamedTuple):
    """What robots push."""

    shape: Literal["box", "cylinder"]
    size: tuple[float, float]
    """Along and across its heading [m]; of a cylinder its diameter twice."""
    mass: float
    """[kg]"""
    friction: float
    """Feet on floor."""
    pose: tuple[float, float, float]
    """x [m], y [m], heading [rad] at the start."""
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """x [m/s], y [m/s], spin [rad/s] at the start."""
    feet: float = 1.0
    """Where they stand, as a share of the way from the middle to the corners or the rim."""
    push_height: float = 0.015
    """[m], used with ``shift_loads`` alone."""


class Obstacle(NamedTuple):
    """What stands still."""

    shape: Literal["box", "cylinder"]
    size: tuple[float, float]
    """As of a movable [m]."""
    pose: tuple[float, float, float]
    """x [m], y [m], heading [rad]."""


class Surroundings(NamedTuple):
    """All but robots."""

    movables: Sequence[Movable]
    obstacles: Sequence[Obstacle]
    arena: float | Sequence[tuple[float, float]]
    """The radius of a round one about the origin, or the corners of a convex one, anticlockwise [m]."""

    def numbers(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return movables ``(n, 13)``, obstacles ``(m, 6)`` and the arena as native/reference/planar_c.cpp has them."""
        movables = [
            (m.shape == "cylinder", *m.size, m.mass, m.friction, m.feet, m.push_height, *m.pose, *m.velocity)
            for m in self.movables
        ]
        obstacles = [(o.shape == "cylinder", *o.size, *o.pose) for o in self.obstacles]
        return (
            np.array(movables, dtype=np.float64).reshape(-1, 13),
            np.array(obstacles, dtype=np.float64).reshape(-1, 6),
            np.array(self.arena, dtype=np.float64),
        )


class Planar:
    """Robots, what they push, and what stands still, in the plane.

    Args:
        poses: Robots, shape (n, 3): x [m], y [m], heading [rad]; the middle of the arena is the origin.
        box: The pose likewise of the one box in a square arena, its heading is along its long side; None for a world
            without a box; or what there is in its place.
        box_velocity: vx [m/s], vy [m/s], spin [rad/s] of the one box.
        bumper: Whether robots wear a sprung bumper or all contacts are rigid.
        parameters: Any number of ``struct Parameters`` in native/reference/planar.hpp, which has names, units and
            defaults; ``shift_loads`` as well.

    Raises:
        ValueError: A parameter has no such name or is out of its range, or a pose is not finite or of another shape.
    """

    def __init__(
        self,
        poses: Sequence[Sequence[float]] | FloatArray,
        box: Sequence[float] | FloatArray | Surroundings | None = (0.0, 0.0, 0.0),
        box_velocity: Sequence[float] | FloatArray = (0.0, 0.0, 0.0),
        bumper: Literal["sprung", "rigid"] = "sprung",
        **parameters: float,
    ) -> None:
        self._world: int | None = None  # what __del__ looks for if an argument is wrong
        if bumper not in ("sprung", "rigid"):
            raise ValueError(f"bumper: expected sprung or rigid, got {bumper!r}")
        numbers = {**parameters, "sprung": float(bumper == "sprung")}
        rows = np.asarray(poses, dtype=np.float64).reshape(len(poses), 3)
        robots = np.concatenate([rows, np.zeros_like(rows)], axis=1)
        self._n = len(rows)
        names = (ctypes.c_char_p * len(numbers))(*[name.encode() for name in numbers])
        values = np.array(list(numbers.values()), dtype=np.float64)
        message = ctypes.create_string_buffer(_MESSAGE_ROOM)
        self._library = _library()
        given = (names, _pointer(values), len(numbers), _pointer(robots), self._n)
        if isinstance(box, Surroundings):
            movables, obstacles, arena = box.numbers()
            self._movables = len(movables)
            corners = len(arena) if arena.ndim else 0
            self._world = self._library.planar_create_among(
                *given, _pointer(movables), len(movables), _pointer(obstacles), len(obstacles), _pointer(arena),
                corners, message, _MESSAGE_ROOM,
            )  # fmt: skip
        else:
            self._movables = int(box is not None)
            thrown = None if box is None else np.array([*box, *box_velocity], dtype=np.float64).reshape(6)
            pointer = None if thrown is None else _pointer(thrown)
            self._world = self._library.planar_create(*given, pointer, message, _MESSAGE_ROOM)
        if not self._world:
            raise ValueError(message.value.decode())
        self.time_step = float(parameters.get("time_step", self._library.planar_default_time_step()))

    def __del__(self) -> None:
        if self._world:
            self._library.planar_destroy(self._world)

    def set(self, commands: Sequence[Sequence[float]] | FloatArray) -> None:
        """Hold wheel commands, shape (n, 2): left, right in [-1, 1], from now on.

        Raises:
            ValueError: They are of another shape or out of range.
        """
        held = np.ascontiguousarray(commands, dtype=np.float64)
        if held.shape != (self._n, 2) or not (np.abs(held) <= 1).all():
            raise ValueError(f"commands: expected shape ({self._n}, 2) within [-1, 1], got {held.tolist()}")
        self._library.planar_set_commands(self._world, _pointer(held))

    def go(self, seconds: float) -> None:
        """Simulate ``seconds``, rounded to whole steps."""
        self._library.planar_advance(self._world, round(seconds / self.time_step))

    def state(self) -> FloatArray:
        """Return x, y [m], heading [rad], vx, vy [m/s], spin [rad/s] of each robot, then of each movable."""
        state = np.zeros((self._n + self._movables, 6))
        self._library.planar_read_state(self._world, _pointer(state))
        return state

    def robot(self, i: int = 0) -> FloatArray:
        """Return a robot's pose, shape (3,): x, y [m], heading [rad]."""
        return self.state()[: self._n][i, :3]

    def box(self) -> FloatArray:
        """Return the pose of the box, or of the first movable, shape (3,): x, y [m], heading [rad].

        Raises:
            ValueError: There is none.
        """
        if not self._movables:
            raise ValueError("expected a world with a box, this one was made without")
        return self.state()[self._n, :3]

    def foot_loads(self) -> FloatArray:
        """Return the loads of the box's feet [N]: rear right, front right, rear left, front left along its heading."""
        loads = np.zeros(4)
        self._library.planar_read_foot_loads(self._world, 0, _pointer(loads))
        return loads

    @property
    def push(self) -> float:
        """Sum of the normal forces by which robots push movables now [N]."""
        return float(self._library.planar_push(self._world))

    @property
    def largest_push(self) -> float:
        """Largest sum of the normal forces by which robots have pushed movables [N]."""
        return float(self._library.planar_largest_push(self._world))

    def forget_largest_push(self) -> None:
        """Begin to look for the largest push anew."""
        self._library.planar_forget_largest_push(self._world)

    @property
    def energy(self) -> float:
        """Kinetic energy of all bodies and elastic energy of movables' feet [J]."""
        return float(self._library.planar_energy(self._world))

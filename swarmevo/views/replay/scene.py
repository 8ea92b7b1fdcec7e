# SPDX-License-Identifier: BSD-3-Clause
"""The world of a configuration as meshcat commands: what the viewer in a replay page builds its scene from.

Only what stands still is said here: shapes, colours, places within their parents. The player in ``assets/`` moves
the nodes ``/box``, ``/robots/I``, ``/robots/I/left`` and ``right``, and lights up ``/robots/I/halo``,
``/robots/I/touch/K`` and ``/arena/target``.

World frame as everywhere: metres, origin at the arena's centre on the floor, x east, y north, z up.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import umsgpack
from meshcat import transformations as tf
from meshcat.commands import SetObject, SetTransform
from meshcat.geometry import Box, Geometry, Mesh, MeshBasicMaterial, MeshLambertMaterial, MeshPhongMaterial
from meshcat.path import Path

from swarmevo.config import Config, Robot, Sensors
from swarmevo.protocols import FloatArray

Command = dict[str, Any]

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#F0E442")
"""Of robots, in turn: Okabe and Ito's, which colour-blind people tell apart."""

_WALL_THICKNESS = 0.02  # of the arena's size
_STRIPE = 0.035  # of the arena's size: width of the stripe along the target wall
_UPRIGHT = tf.rotation_matrix(math.pi / 2, [1, 0, 0])  # three.js' cylinders stand along y, ours along z
_WHEEL_WIDTH = 0.06  # of the axle's length
_BUMPER_HEIGHT = 0.3  # of the box's height: a band half-way up, where bumper and box meet
_FLOOR_LAYERS = {
    "stripe": 0.0004,
    "grid": 0.0006,
    "range": 0.0008,
    "edge": 0.001,
    "halo": 0.0016,
}  # [m], over the floor

_BODY, _CIRCUIT, _CORE, _CAP, _TYRE, _HUB = "#2fae6b", "#1d6b45", "#20262b", "#f5f6f2", "#22272b", "#d9dee2"
_BUMPER = "#7d8891"
_TOUCH, _SIGNAL, _TARGET = "#ffb000", "#7a5cff", "#1b9e8f"


@dataclass(frozen=True)
class Part:
    """A mesh at a place in its parent."""

    path: str
    geometry: Geometry
    material: MeshPhongMaterial | MeshLambertMaterial | MeshBasicMaterial
    transform: FloatArray
    """``(4, 4)``"""
    shadow: bool = True

    def commands(self) -> Iterator[Command]:
        """Yield what makes the viewer show it."""
        mesh = Mesh(self.geometry, self.material)
        for name, element in {"mesh": mesh, "geometry": mesh.geometry, "material": mesh.material}.items():
            element.uuid = f"{self.path}:{name}"  # the same page for the same replay, and not the time and this machine
        yield SetObject(mesh, path=Path(self.path.split("/"))).lower()
        yield SetTransform(self.transform, Path(self.path.split("/"))).lower()
        if not self.shadow:
            for key in ("castShadow", "receiveShadow"):
                yield {"type": "set_property", "path": f"/{self.path}/<object>", "property": key, "value": False}


def commands(config: Config) -> list[Command]:
    """Return the meshcat commands, not yet packed, that build the world of ``config``."""
    parts = [*_arena(config), *_box(config), *_emitter(config)]
    for robot in range(config.team.robots):
        path = f"robots/{robot}"
        parts += _epuck(path, config.robot, config.sensors, COLOURS[robot % len(COLOURS)], str(robot + 1))
        if config.robot.bumper == "sprung":
            parts.append(_bumper(path, config.robot, config.box.size[2]))
    return [command for part in parts for command in part.commands()]


def packed(config: Config) -> list[str]:
    """Return :func:`commands`, each as meshcat's server would send it (msgpack), in base64."""
    return [base64.b64encode(umsgpack.packb(command)).decode("ascii") for command in commands(config)]


# ---- three.js' shapes that meshcat has no class for ------------------------------------------------------------------


class _Shape(Geometry):  # type: ignore[misc]  # meshcat has no types
    """A geometry of three.js by its name and parameters."""

    def __init__(self, kind: str, **parameters: Any) -> None:
        super().__init__()
        self._data = {"type": kind, **parameters}

    def lower(self, object_data: object) -> dict[str, Any]:
        return {"uuid": self.uuid, **self._data}


class _Text:
    """A texture of black text on nothing, in the form that meshcat's viewer draws."""

    def __init__(self, text: str) -> None:
        self._data = {
            "uuid": f"text:{text}",
            "type": "_text",
            "text": text,
            "font_size": 150,
            "font_face": "sans-serif",
        }

    def lower_in_object(self, object_data: dict[str, Any]) -> str:
        object_data.setdefault("textures", []).append(self._data)
        return self._data["uuid"]  # type: ignore[return-value]


def _cylinder(radius: float, height: float, top: float | None = None) -> _Shape:
    return _Shape(
        "CylinderGeometry",
        radiusTop=radius if top is None else top,
        radiusBottom=radius,
        height=height,
        radialSegments=40,
    )


def _tube(inner: float, outer: float, low: float, high: float, yaw: float, half_width: float) -> _Shape:
    """Return the part of an upright pipe that is seen within ``half_width`` [rad] of the bearing ``yaw`` [rad]."""
    profile = [(inner, low), (outer, low), (outer, high), (inner, high), (inner, low)]
    return _Shape(
        "LatheGeometry",
        points=[{"x": x, "y": y} for x, y in profile],
        segments=32,
        phiStart=yaw - half_width + math.pi / 2,
        phiLength=2 * half_width,
    )


def _sector(inner: float, outer: float, yaw: float, half_width: float) -> _Shape:
    """Return a flat piece of a ring."""
    return _Shape(
        "RingGeometry",
        innerRadius=inner,
        outerRadius=outer,
        thetaSegments=max(6, math.ceil(half_width * 28)),
        thetaStart=yaw - half_width,
        thetaLength=2 * half_width,
    )


def _glossy(colour: str, opacity: float = 1.0, **properties: Any) -> MeshPhongMaterial:
    return MeshPhongMaterial(
        color=_number(colour), opacity=opacity, **{"shininess": 40, "specular": 0x222222, **properties}
    )


def _matt(colour: str) -> MeshLambertMaterial:
    return MeshLambertMaterial(color=_number(colour))


def _flat(colour: str, opacity: float = 1.0, map: _Text | None = None) -> MeshBasicMaterial:
    return MeshBasicMaterial(
        color=_number(colour), opacity=opacity, transparent=opacity < 1 or map is not None, map=map, depthWrite=False
    )


def _number(colour: str) -> int:
    return int(colour.removeprefix("#"), 16)


def _at(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> FloatArray:
    place: FloatArray = tf.translation_matrix([x, y, z])
    return place


# ---- the arena -------------------------------------------------------------------------------------------------------


def _arena(config: Config) -> list[Part]:
    size, height = config.arena.size, config.arena.wall_height
    thick, stripe = _WALL_THICKNESS * size, _STRIPE * size
    parts = [
        Part("arena/floor", Box([size, size, 0.01]), _matt("#eceae4"), _at(z=-0.005)),
        *_grid(size),
    ]
    for name, (x, y) in _DIRECTIONS.items():
        along = [thick, size + 2 * thick] if x else [size + 2 * thick, thick]
        middle = (size + thick) / 2
        wall = "target" if name == config.arena.target_wall else f"walls/{name}"
        place = _at(x * middle, y * middle, height / 2)
        parts.append(Part(f"arena/{wall}", Box([*along, height]), _matt("#c9cdd0"), place))
    x, y = _DIRECTIONS[config.arena.target_wall]
    along = [stripe, size] if x else [size, stripe]
    middle = (size - stripe) / 2
    place = _at(x * middle, y * middle, _FLOOR_LAYERS["stripe"])
    parts.append(Part("arena/stripe", _Shape("PlaneGeometry", width=along[0], height=along[1]), _flat(_TARGET), place))
    return parts


_DIRECTIONS = {"north": (0, 1), "south": (0, -1), "east": (1, 0), "west": (-1, 0)}


def _grid(size: float) -> Iterator[Part]:
    """Yield thin lines every tenth of the arena (10 cm in the paper's)."""
    places = np.linspace(-size / 2, size / 2, 11)[1:-1]
    for axis, extent in {"x": (0.0015, size), "y": (size, 0.0015)}.items():
        for number, place in enumerate(places.tolist()):
            line = _Shape("PlaneGeometry", width=extent[0], height=extent[1])
            where = _at(**{axis: place}, z=_FLOOR_LAYERS["grid"])
            yield Part(f"arena/grid/{axis}{number}", line, _flat("#000000", 0.06), where, shadow=False)


def _box(config: Config) -> list[Part]:
    x, y, z = config.box.size
    top = _Shape("PlaneGeometry", width=0.9 * x, height=0.85 * y)
    return [
        Part("box/body", Box([x, y, z]), _glossy("#c59a63", shininess=12), _at(z=z / 2)),
        Part("box/top", top, _flat("#ffffff", 0.16), _at(z=z + 0.0004), shadow=False),
    ]


def _emitter(config: Config) -> list[Part]:
    x, y, z = config.emitter.position
    reach = config.emitter.range
    turn = math.pi
    disc = _Shape("CircleGeometry", radius=reach, segments=96)
    parts = [
        Part("emitter/range/disc", disc, _flat(_SIGNAL, 0.10), _at(x, y, _FLOOR_LAYERS["range"]), shadow=False),
        Part(
            "emitter/range/edge",
            _sector(reach - 0.003, reach, 0, turn),
            _flat(_SIGNAL, 0.55),
            _at(x, y, _FLOOR_LAYERS["edge"]),
            shadow=False,
        ),
        Part("emitter/foot", _cylinder(0.013, 0.004), _glossy(_CORE), _at(x, y, z + 0.002) @ _UPRIGHT),
        Part("emitter/mast", _cylinder(0.0022, 0.04), _glossy(_CORE), _at(x, y, z + 0.022) @ _UPRIGHT),
        Part(
            "emitter/ball",
            _Shape("SphereGeometry", radius=0.008, widthSegments=24, heightSegments=16),
            _glossy(_SIGNAL, emissive=_number("#3a22b0")),
            _at(x, y, z + 0.045),
        ),
    ]
    for wave in range(2):  # unit rings, which the player widens
        ring = _Shape("RingGeometry", innerRadius=0.985, outerRadius=1.0, thetaSegments=96)
        place = _at(x, y, _FLOOR_LAYERS["edge"])
        parts.append(Part(f"emitter/range/wave{wave}", ring, _flat(_SIGNAL, 0.4), place, shadow=False))
    return parts


# ---- the robot -------------------------------------------------------------------------------------------------------


def _epuck(path: str, robot: Robot, sensors: Sensors, colour: str, number: str) -> list[Part]:
    """Return an E-puck: a clear green body with gaps for the wheels, the circuit board on it, a cap with its number."""
    r, deck = _hard_radius(robot), max(0.7 * robot.height, 2.05 * robot.wheel_radius)
    top = max(robot.height, deck + 0.1 * r)
    core = 0.5 * robot.axle_length * (1 - 1.6 * _WHEEL_WIDTH)
    gap = min(math.atan2(robot.wheel_radius, robot.axle_length / 2) + 0.12, 1.2)  # [rad] at either side, for a wheel
    return [
        Part(f"{path}/core", _cylinder(core, 0.9 * deck), _glossy(_CORE), _at(z=0.55 * deck) @ _UPRIGHT),
        *(
            Part(
                f"{path}/{name}",
                _tube(0.84 * r, r, 0.12 * deck, deck, yaw, math.pi / 2 - gap),
                _glossy(_BODY, 0.72, shininess=90, specular=0x666666),
                _UPRIGHT,
            )
            for name, yaw in (("front", 0.0), ("rear", math.pi))
        ),
        Part(f"{path}/board", _cylinder(r, 0.05 * r), _glossy(_CIRCUIT), _at(z=deck) @ _UPRIGHT),
        Part(
            f"{path}/ring",
            _Shape("TorusGeometry", radius=0.9 * r, tube=0.07 * r, radialSegments=10, tubularSegments=48),
            _glossy(colour),
            _at(z=deck + 0.03 * r),
        ),
        Part(
            f"{path}/cap", _cylinder(0.66 * r, top - deck, 0.62 * r), _glossy(_CAP), _at(z=(top + deck) / 2) @ _UPRIGHT
        ),
        Part(
            f"{path}/nose",
            _Shape("CircleGeometry", radius=0.3 * r, segments=3),
            _flat(colour),
            _at(x=0.36 * r, z=top + 0.0004),
            shadow=False,
        ),
        Part(
            f"{path}/number",
            _Shape("PlaneGeometry", width=1.0 * r, height=1.0 * r),
            _flat("#ffffff", map=_Text(number)),
            _at(x=-0.17 * r, z=top + 0.0006) @ tf.rotation_matrix(-math.pi / 2, [0, 0, 1]),
            shadow=False,
        ),
        *_wheels(path, robot),
        *_senses(path, robot.radius, deck, sensors),
    ]


def _hard_radius(robot: Robot) -> float:
    """Return the radius of what does not give way [m]."""
    return robot.radius - (robot.bumper_travel if robot.bumper == "sprung" else 0)


def _bumper(path: str, robot: Robot, box_height: float) -> Part:
    """Return the sprung bumper at rest. Pressed in, it sinks into what it meets, up to the body at most."""
    height = min(box_height, robot.height)
    low, high = (1 - _BUMPER_HEIGHT) * height / 2, (1 + _BUMPER_HEIGHT) * height / 2
    band = _tube(_hard_radius(robot), robot.radius, low, high, 0.0, math.pi)
    return Part(f"{path}/bumper", band, _glossy(_BUMPER, shininess=8), _UPRIGHT)


def _wheels(path: str, robot: Robot) -> Iterator[Part]:
    """Yield tyres and hubs in the frames of their axles, which the player turns."""
    r, width = robot.wheel_radius, _WHEEL_WIDTH * robot.axle_length
    for name, side in (("left", 1), ("right", -1)):
        outside = side * width / 2
        yield Part(f"{path}/{name}/tyre", _cylinder(r, width), _glossy(_TYRE, shininess=10), _at())
        yield Part(f"{path}/{name}/hub", _cylinder(0.62 * r, 0.0006), _glossy(_HUB), _at(y=outside))
        for spoke in range(2):
            bar = Box([1.16 * r, 0.0004, 0.16 * r])
            turn = tf.rotation_matrix(spoke * math.pi / 2, [0, 1, 0])
            place = _at(y=outside + side * 0.0004) @ turn
            yield Part(f"{path}/{name}/spoke{spoke}", bar, _glossy(_CORE), place)


def _senses(path: str, r: float, deck: float, sensors: Sensors) -> Iterator[Part]:
    """Yield what lights up: arcs for the box sensors, above the box, and a halo on the floor for the RF signal."""
    half = math.radians(sensors.touch_half_width_deg)
    shown = max(0.86 * half, 0.02)  # a gap between neighbours
    for number, yaw in enumerate(sensors.touch_yaw_deg):
        arc = _sector(1.08 * r, 1.42 * r, math.radians(yaw), shown)
        yield Part(f"{path}/touch/{number}", arc, _flat(_TOUCH, 0.95), _at(z=deck + 0.004), shadow=False)
    halo = _sector(1.12 * r, 1.6 * r, 0, math.pi)
    yield Part(f"{path}/halo", halo, _flat(_SIGNAL, 0.5), _at(z=_FLOOR_LAYERS["halo"]), shadow=False)


def colours(robots: int) -> Sequence[str]:
    """Return each robot's colour, for plots beside the scene."""
    return [COLOURS[robot % len(COLOURS)] for robot in range(robots)]

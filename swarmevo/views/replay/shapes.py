# SPDX-License-Identifier: BSD-3-Clause
"""What scenes are made of: meshes at places, three.js' shapes that meshcat has no class for, and materials."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
from meshcat import transformations as tf
from meshcat.commands import SetObject, SetTransform
from meshcat.geometry import Geometry, Mesh, MeshBasicMaterial, MeshLambertMaterial, MeshPhongMaterial
from meshcat.path import Path

from swarmevo.protocols import FloatArray

Command = dict[str, Any]
Material: TypeAlias = MeshPhongMaterial | MeshLambertMaterial | MeshBasicMaterial

UPRIGHT: Final = tf.rotation_matrix(math.pi / 2, [1, 0, 0])
"""three.js' cylinders stand along y, ours along z."""
FLOOR_LAYERS: Final = {
    "floor": 0.0,
    "patch": 0.0002,
    "stripe": 0.0004,
    "grid": 0.0006,
    "range": 0.0008,
    "edge": 0.001,
    "halo": 0.0016,
}
"""[m], over the floor."""
CORE: Final = "#20262b"
SIGNAL: Final = "#7a5cff"
LIGHT: Final = "#e8b400"
_SEEN_FROM_OUTSIDE: Final = {"side": 0}
"""Solids are closed, and what lies flat is seen from above. Both sides of what is clear would be drawn one after the
other, each by a program of its own that is looked up anew in each frame."""


@dataclass(frozen=True)
class Part:
    """A mesh at a place in its parent."""

    path: str
    geometry: Geometry
    material: Material
    transform: FloatArray
    """``(4, 4)``"""
    shadow: bool = True
    order: int = 0
    """When it is drawn: the lower, the sooner."""

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
        if self.order:
            path = f"/{self.path}/<object>"
            yield {"type": "set_property", "path": path, "property": "renderOrder", "value": self.order}


class Shape(Geometry):  # type: ignore[misc]  # meshcat has no types
    """A geometry of three.js by its name and parameters."""

    def __init__(self, kind: str, **parameters: Any) -> None:
        super().__init__()
        self._data = {"type": kind, **parameters}

    def lower(self, object_data: object) -> dict[str, Any]:
        """Return it as meshcat sends it."""
        return {"uuid": self.uuid, **self._data}


class Text:
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
        """Add it to an object that meshcat sends; return its id."""
        object_data.setdefault("textures", []).append(self._data)
        return self._data["uuid"]  # type: ignore[return-value]


def cylinder(radius: float, height: float, top: float | None = None) -> Shape:
    """Return a cylinder, or, with another radius at its top, a part of a cone."""
    return Shape(
        "CylinderGeometry",
        radiusTop=radius if top is None else top,
        radiusBottom=radius,
        height=height,
        radialSegments=40,
    )


def polygon(corners: FloatArray) -> Shape:
    """Return a convex polygon that lies on its back; ``corners`` ``(n, 2)`` counter-clockwise."""
    n = len(corners)
    position = np.column_stack([corners, np.zeros(n)])
    triangles = [[0, k, k + 1] for k in range(1, n - 1)]

    def attribute(values: list[float]) -> dict[str, Any]:
        return {"itemSize": 3, "type": "Float32Array", "array": values, "normalized": False}

    return Shape(
        "BufferGeometry",
        data={
            "attributes": {
                "position": attribute(position.ravel().tolist()),
                "normal": attribute([0.0, 0.0, 1.0] * n),
            },
            "index": {"type": "Uint16Array", "array": [k for triangle in triangles for k in triangle]},
        },
    )


def tube(
    inner: float, outer: float, low: float, high: float, yaw: float, half_width: float, segments: int = 32
) -> Shape:
    """Return the part of an upright pipe that is seen within ``half_width`` [rad] of the bearing ``yaw`` [rad]."""
    profile = [(inner, low), (outer, low), (outer, high), (inner, high), (inner, low)]
    return Shape(
        "LatheGeometry",
        points=[{"x": x, "y": y} for x, y in profile],
        segments=segments,
        phiStart=yaw - half_width + math.pi / 2,
        phiLength=2 * half_width,
    )


def sector(inner: float, outer: float, yaw: float, half_width: float) -> Shape:
    """Return a flat piece of a ring."""
    return Shape(
        "RingGeometry",
        innerRadius=inner,
        outerRadius=outer,
        thetaSegments=max(6, math.ceil(half_width * 28)),
        thetaStart=yaw - half_width,
        thetaLength=2 * half_width,
    )


def glossy(colour: str, opacity: float = 1.0, **properties: Any) -> MeshPhongMaterial:
    """Return a material that shines."""
    look = {**_SEEN_FROM_OUTSIDE, "shininess": 40, "specular": 0x222222, **properties}
    return MeshPhongMaterial(color=number(colour), opacity=opacity, **look)


def matt(colour: str, **properties: Any) -> MeshLambertMaterial:
    """Return a material that is lit and does not shine."""
    return MeshLambertMaterial(color=number(colour), **_SEEN_FROM_OUTSIDE, **properties)


def flat(colour: str, opacity: float = 1.0, map: Text | None = None) -> MeshBasicMaterial:
    """Return a material of the same colour in any light."""
    return MeshBasicMaterial(
        color=number(colour),
        opacity=opacity,
        transparent=opacity < 1 or map is not None,
        map=map,
        depthWrite=False,
        **_SEEN_FROM_OUTSIDE,
    )


def number(colour: str) -> int:
    """Return ``#rrggbb`` as three.js has it."""
    return int(colour.removeprefix("#"), 16)


def at(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> FloatArray:
    """Return the transform ``(4, 4)`` to a place [m]."""
    place: FloatArray = tf.translation_matrix([x, y, z])
    return place


def turned(x: float, y: float, heading: float, z: float = 0.0) -> FloatArray:
    """Return the transform ``(4, 4)`` to a pose [m, m, rad] at a height [m]."""
    place: FloatArray = at(x, y, z) @ tf.rotation_matrix(heading, [0, 0, 1])
    return place

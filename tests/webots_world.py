# SPDX-License-Identifier: BSD-3-Clause
"""A reader of Webots world files, and what a world must be like: written from Webots' reference manual (R2022a) alone.

https://cyberbotics.com/doc/reference/nodes-and-api-functions: the fields of each node and their types. A class of nodes
has the fields of the node that it derives from as well.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

TRANSFORM = "translation SFVec3f, rotation SFRotation, children MFNode, scale SFVec3f"
SOLID = (
    f"{TRANSFORM}, "
    "name SFString, model SFString, description SFString, contactMaterial SFString, "
    "immersionProperties MFNode, boundingObject SFNode, physics SFNode, locked SFBool, "
    "radarCrossSection SFFloat, recognitionColors MFColor, linearVelocity SFVec3f, angularVelocity "
    "SFVec3f"
)
NODES = {
    "WorldInfo": "title SFString, info MFString, gravity SFFloat, CFM SFFloat, ERP SFFloat, basicTimeStep "
    "SFFloat, FPS SFFloat, optimalThreadCount SFInt32, physicsDisableTime SFFloat, coordinateSystem "
    "SFString, lineScale SFFloat, randomSeed SFInt32, contactProperties MFNode",
    "Viewpoint": "fieldOfView SFFloat, orientation SFRotation, position SFVec3f, near SFFloat, far SFFloat",
    "Background": "skyColor MFColor, luminosity SFFloat",
    "DirectionalLight": "ambientIntensity SFFloat, color SFColor, direction SFVec3f, intensity SFFloat, on SFBool, "
    "castShadows SFBool",
    "ContactProperties": "material1 SFString, material2 SFString, coulombFriction MFFloat, frictionRotation SFVec2f, "
    "rollingFriction SFVec3f, bounce SFFloat, bounceVelocity SFFloat, forceDependentSlip MFFloat, "
    "softERP SFFloat, softCFM SFFloat",
    "Group": "children MFNode",
    "Transform": TRANSFORM,
    "Solid": SOLID,
    "Robot": f"{SOLID}, "
    "controller SFString, controllerArgs MFString, customData SFString, supervisor SFBool, "
    "synchronization SFBool, battery MFFloat, cpuConsumption SFFloat, selfCollision SFBool, window "
    "SFString, remoteControl SFString",
    "DistanceSensor": f"{SOLID}, "
    "lookupTable MFVec3f, type SFString, numberOfRays SFInt32, aperture SFFloat, gaussianWidth "
    "SFFloat, resolution SFFloat",
    "TouchSensor": f"{SOLID}, type SFString, lookupTable MFVec3f, resolution SFFloat",
    "Emitter": f"{SOLID}, "
    "type SFString, range SFFloat, maxRange SFFloat, aperture SFFloat, channel SFInt32, baudRate "
    "SFInt32, byteSize SFInt32, bufferSize SFInt32",
    "Receiver": f"{SOLID}, "
    "type SFString, aperture SFFloat, channel SFInt32, baudRate SFInt32, byteSize SFInt32, "
    "bufferSize SFInt32, signalStrengthNoise SFFloat, directionNoise SFFloat",
    "HingeJoint": "jointParameters SFNode, device MFNode, endPoint SFNode, position SFFloat",
    "HingeJointParameters": "position SFFloat, axis SFVec3f, anchor SFVec3f, minStop SFFloat, maxStop SFFloat, "
    "springConstant SFFloat, dampingConstant SFFloat, staticFriction SFFloat",
    "RotationalMotor": "name SFString, acceleration SFFloat, consumptionFactor SFFloat, controlPID SFVec3f, "
    "maxVelocity SFFloat, minPosition SFFloat, maxPosition SFFloat, maxTorque SFFloat, multiplier SFFloat, sound "
    "SFString",
    "PositionSensor": "name SFString, noise SFFloat, resolution SFFloat",
    "Physics": "density SFFloat, mass SFFloat, centerOfMass MFVec3f, inertiaMatrix MFVec3f, damping SFNode",
    "Shape": "appearance SFNode, geometry SFNode, castShadows SFBool, isPickable SFBool",
    "PBRAppearance": "baseColor SFColor, baseColorMap SFNode, transparency SFFloat, roughness SFFloat, metalness "
    "SFFloat, emissiveColor SFColor, IBLStrength SFFloat",
    "ImageTexture": "url MFString, repeatS SFBool, repeatT SFBool, filtering SFInt32",
    "Box": "size SFVec3f",
    "Cylinder": "bottom SFBool, height SFFloat, radius SFFloat, side SFBool, top SFBool, subdivision SFInt32",
    "Sphere": "radius SFFloat, ico SFBool, subdivision SFInt32",
    "Plane": "size SFVec2f",
}
FIELDS = {kind: dict(one.split() for one in fields.split(", ")) for kind, fields in NODES.items()}
NUMBERS = {"Vec2f": 2, "Vec3f": 3, "Rotation": 4, "Color": 3, "Float": 1, "Int32": 1}
GEOMETRIES = {"Box", "Cylinder", "Sphere", "Plane"}
SOLIDS = {kind for kind, fields in FIELDS.items() if "boundingObject" in fields}
DEVICES = SOLIDS - {"Solid", "Robot"} | {"RotationalMotor", "PositionSensor"}
PERMITTED = {  # for a field of nodes, which may stand there
    "contactProperties": {"ContactProperties"},
    "children": SOLIDS | {"Shape", "Group", "Transform", "HingeJoint"},
    "boundingObject": GEOMETRIES | {"Shape", "Group", "Transform"},
    "physics": {"Physics"},
    "jointParameters": {"HingeJointParameters"},
    "device": {"RotationalMotor", "PositionSensor"},
    "endPoint": {"Solid"},
    "appearance": {"PBRAppearance"},
    "geometry": GEOMETRIES,
    "baseColorMap": {"ImageTexture"},
}
TYPES = {
    "DistanceSensor": {"generic", "infra-red", "sonar", "laser"},
    "TouchSensor": {"bumper", "force", "force-3d"},
    "Emitter": {"radio", "serial", "infra-red"},
    "Receiver": {"radio", "serial", "infra-red"},
}
LEAST = {  # smallest allowed; -1 is allowed besides where it means "none"
    **dict.fromkeys(("radius", "height", "mass", "range", "channel", "maxVelocity", "maxTorque", "basicTimeStep"), 0.0),
    **dict.fromkeys(("signalStrengthNoise", "directionNoise", "bounce", "softERP", "transparency", "roughness"), 0.0),
}
TOKEN = re.compile(r'\s*(?:#[^\n]*|("(?:[^"\\]|\\.)*")|([{}\[\]])|([^\s{}\[\]"#]+))')


@dataclass
class WorldNode:
    """A node of a world file."""

    kind: str
    fields: dict[str, Any] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Any:
        return self.fields[name]

    def get(self, name: str, default: Any = None) -> Any:
        return self.fields.get(name, default)

    def below(self) -> Iterator[WorldNode]:
        """Yield this node and all below it."""
        yield self
        for value in self.fields.values():
            for one in value if isinstance(value, list) else [value]:
                if isinstance(one, WorldNode):
                    yield from one.below()


def read(text: str) -> list[WorldNode]:
    """Return the nodes of a world; raise ValueError at what is no world, an unknown node or field, a wrong type."""
    header, _, rest = text.partition("\n")
    if not re.fullmatch(r"#VRML_SIM R20\d\d[ab] utf8", header):
        raise ValueError(f"header {header!r}")
    return list(_Reader(rest).nodes())


class _Reader:
    def __init__(self, text: str) -> None:
        self._tokens, at = [], 0
        while text[at:].strip():
            match = TOKEN.match(text, at)
            if match is None:
                raise ValueError(f"unreadable: {text[at : at + 40]!r}")
            self._tokens += [token for token in match.groups() if token]
            at = match.end()
        self._at = 0

    def _next(self) -> str:
        self._at += 1
        return self._tokens[self._at - 1]

    def _is(self, token: str) -> bool:
        return self._at < len(self._tokens) and self._tokens[self._at] == token

    def nodes(self) -> Iterator[WorldNode]:
        while self._at < len(self._tokens):
            yield self._node()

    def _node(self) -> WorldNode:
        one = WorldNode(self._next())
        if one.kind not in FIELDS:
            raise ValueError(f"no node {one.kind}")
        if self._next() != "{":
            raise ValueError(f"{one.kind}: expected {{")
        while not self._is("}"):
            name = self._next()
            if name not in FIELDS[one.kind] or name in one.fields:
                raise ValueError(f"{one.kind} has no field {name}, or has it twice")
            one.fields[name] = self._value(f"{one.kind}.{name}", name, FIELDS[one.kind][name])
        self._next()
        return one

    def _value(self, place: str, name: str, kind: str) -> Any:
        if kind.startswith("SF"):
            return self._single(place, name, kind[2:])
        if not self._is("["):
            return [self._single(place, name, kind[2:])]
        self._next()
        found = []
        while not self._is("]"):
            found.append(self._single(place, name, kind[2:]))
        self._next()
        return found

    def _single(self, place: str, name: str, kind: str) -> Any:
        if kind == "Node":
            one = self._node()
            if one.kind not in PERMITTED[name]:
                raise ValueError(f"{place}: {one.kind} may not stand there")
            return one
        token = self._next()
        if kind == "String":
            if not token.startswith('"'):
                raise ValueError(f"{place}: {token} is no string")
            return re.sub(r"\\(.)", r"\1", token[1:-1])
        if kind == "Bool":
            return {"TRUE": True, "FALSE": False}[token]
        if kind == "Int32":
            return int(token)
        numbers = [float(token), *(float(self._next()) for _ in range(NUMBERS[kind] - 1))]
        if not all(map(math.isfinite, numbers)):
            raise ValueError(f"{place}: {numbers}")
        return numbers[0] if kind == "Float" else tuple(numbers)


def check(nodes: list[WorldNode], project: Path) -> None:
    """Raise AssertionError at a world that Webots would complain of."""
    kinds = [one.kind for one in nodes]
    assert kinds[0] == "WorldInfo"
    assert kinds.count("Viewpoint") == 1
    materials = {one[name] for one in nodes[0]["contactProperties"] for name in ("material1", "material2")}
    _check_names(nodes)
    for top in nodes:
        for one in top.below():
            _check_node(one, project, materials)
    in_robots = {id(one) for top in nodes for robot in top.below() if robot.kind == "Robot" for one in robot.below()}
    for top in nodes:
        for one in top.below():
            assert one.kind not in DEVICES or id(one) in in_robots, f"a device outside a robot: {one}"


def _check_names(solids: list[WorldNode]) -> None:
    """Siblings have names of their own, and so have all devices of a robot."""
    for one in solids:
        if one.kind == "Robot":
            devices = [device["name"] for device in one.below() if device.kind in DEVICES]
            assert len(devices) == len(set(devices)), devices
    siblings = [one["name"] for one in solids if one.kind in SOLIDS]
    assert len(siblings) == len(set(siblings)), siblings
    assert not any(":" in name for name in siblings)
    for one in solids:
        joined = [child["endPoint"] for child in one.get("children", []) if child.kind == "HingeJoint"]
        _check_names([*one.get("children", []), *joined])


def _check_node(one: WorldNode, project: Path, materials: set[str]) -> None:
    if one.kind in SOLIDS:
        assert one.get("physics") is None or one.get("boundingObject") is not None, one["name"]
        assert one.get("boundingObject") is None or one.get("contactMaterial") in materials, one["name"]
        x, y, z, _ = one.get("rotation", (0, 0, 1, 0))
        assert abs(math.hypot(x, y, z) - 1) < 1e-6
    if one.kind == "TouchSensor":
        assert one.get("boundingObject") is not None
    if one.kind in TYPES:
        assert one["type"] in TYPES[one.kind]
    if one.kind == "Robot":
        program = one["controller"]
        assert (project / "controllers" / program / f"{program}.c").is_file()
        assert (project / "controllers" / program / "Makefile").is_file()
    if one.kind == "ImageTexture":
        assert all((project / "worlds" / name).is_file() for name in one["url"])
    if one.kind == "Physics":
        assert (one.get("density", 1000.0) == -1) == (one.get("mass", -1.0) > 0)
        assert len(one.get("inertiaMatrix", [])) in (0, 2)
        assert not one.get("inertiaMatrix") or len(one["centerOfMass"]) == 1
    if "lookupTable" in one.fields:
        distances = [row[0] for row in one["lookupTable"]]
        assert distances == sorted(set(distances))
        assert distances[0] >= 0
    for name, value in one.fields.items():
        if name in LEAST:
            assert value >= LEAST[name] or value == -1, (name, value)
        if name == "size":
            assert min(value) > 0, value

# SPDX-License-Identifier: BSD-3-Clause
"""Keys of the world that nothing reads, because another key says that something else stands in their place.

>>> from swarmevo.config import load
>>> reason(load("paper"), "box.mass")
''
>>> reason(load("paper", ["scene.movables=[]"]), "box.mass")
'scene.movables stands in the place of the box'
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from swarmevo.config.models import Config, Section
from swarmevo.config.worlds import Worlds


def reason(config: Config, key: str) -> str:
    """Return why nothing reads a key of a world, in words; empty: something does."""
    return next((why for other, why in _unread(config) if f"{key}.".startswith(f"{other}.")), "")


def idle_errors(config: Config, overrides: Sequence[str] = ()) -> list[str]:
    """Return a line for each key that is given and that nothing reads.

    A section of a file may hold what a world of ``worlds`` reads, or what is left of another file: of these keys only
    those of lists' entries and of the arena are looked at.

    Args:
        config: With sound worlds.
        overrides: ``section.key=value``, that made it.
    """
    worlds = [world.config for world in Worlds(config)]
    keys = [override.partition("=")[0].strip() for override in overrides]
    return [
        *(line for key in keys for line in _lines(key, key, [config, *worlds])),
        *(line for key in config.vary for line in _lines(f"vary.{key}", key, worlds)),
        *(
            line
            for i, entry in enumerate(config.worlds)
            for key in entry
            for line in _lines(f"worlds[{i}].{key}", key, [worlds[i]])
        ),
        *(line for key in _meant(config) for line in _lines(key, key, [config, *worlds])),
    ]


def _lines(where: str, key: str, worlds: Sequence[Config]) -> list[str]:
    """Return what is wrong with a key if none of these worlds reads it."""
    reasons = [reason(world, key) for world in worlds]
    return [f"{where}: expected another key; nothing reads it, for {reasons[0]}"] if all(reasons) else []


def _meant(config: Config) -> Iterator[str]:
    """Yield keys of lists' entries and of the arena that have another value than their default."""
    sections: list[tuple[str, Section]] = [("arena", config.arena)]
    for name in ("movables", "obstacles"):
        sections += [(f"scene.{name}.{i}", entry) for i, entry in enumerate(getattr(config.scene, name) or ())]
    for where, section in sections:
        for key, field in type(section).model_fields.items():
            if getattr(section, key) != field.default:
                yield f"{where}.{key}"


def _unread(config: Config) -> Iterator[tuple[str, str]]:
    """Yield each key that nothing reads, and why."""
    scene, arena, team = config.scene, config.arena, config.team
    if scene.movables is not None:
        yield "box", "scene.movables stands in the place of the box"
    if scene.emitters is not None:
        yield "emitter", "scene.emitters stands in the place of the emitter"
    if scene.goals is not None:
        yield "arena.target_wall", "scene.goals stands in the place of the target wall"
    if arena.shape in ("circle", "polygon"):
        yield "arena.target_wall", f"a {arena.shape} has no such wall; name scene.goals"
    movables = scene.movables if scene.movables is not None else (config.box,)
    if all(movable.friction is not None for movable in movables):
        yield "physics.box_friction", "each movable has a friction of its own, if there is any"
    for key, shapes in (("size", ("square", "circle")), ("sides", ("rectangle",)), ("corners", ("polygon",))):
        if arena.shape not in shapes:
            yield f"arena.{key}", f"arena.shape is {arena.shape}"
    for key, start in (("row_y", "row"), ("row_spacing", "row"), ("start_poses", "poses"), ("start_region", "random")):
        if team.start != start:
            yield f"team.{key}", f"team.start is {team.start}"
    for i, movable in enumerate(movables):
        where = "box" if scene.movables is None else f"scene.movables.{i}"
        yield f"{where}.{'pose' if movable.start == 'random' else 'start_region'}", f"{where}.start is {movable.start}"
    for i, obstacle in enumerate(scene.obstacles):
        where = f"scene.obstacles.{i}"
        for key in ("pose",) if obstacle.shape == "wall" else ("ends", "thickness"):
            yield f"{where}.{key}", f"{where}.shape is {obstacle.shape}"

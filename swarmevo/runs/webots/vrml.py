# SPDX-License-Identifier: BSD-3-Clause
"""Nodes and their text in the format of Webots' world files, which is near to that of VRML97."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

Vector: TypeAlias = tuple[float, ...]
Value: TypeAlias = "bool | int | float | str | Vector | Node | Sequence[Node] | Sequence[str] | Sequence[Vector]"


@dataclass(frozen=True)
class Node:
    """A node: its type and its fields. A tuple of numbers is a vector, a list one of nodes, texts or vectors."""

    kind: str
    fields: dict[str, Value]


def node(kind: str, **fields: Value) -> Node:
    """Return a node."""
    return Node(kind, fields)


def text(nodes: Sequence[Node], header: str) -> str:
    """Return a file of these nodes."""
    return "".join(line + "\n" for line in (header, *(line for one in nodes for line in _node(one, ""))))


def _node(one: Node, indent: str) -> Iterator[str]:
    yield f"{indent}{one.kind} {{"
    for name, value in one.fields.items():
        yield from _field(name, value, indent + "  ")
    yield f"{indent}}}"


def _field(name: str, value: Value, indent: str) -> Iterator[str]:
    if isinstance(value, Node):
        first, *rest = _node(value, indent)
        yield f"{indent}{name} {first.lstrip()}"
        yield from rest
    elif isinstance(value, list):
        yield f"{indent}{name} ["
        for entry in value:
            yield from _node(entry, indent + "  ") if isinstance(entry, Node) else [f"{indent}  {_plain(entry)}"]
        yield f"{indent}]"
    else:
        yield f"{indent}{name} {_plain(value)}"


def _plain(value: object) -> str:
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        return f'"{escaped}"'
    if isinstance(value, tuple):
        return " ".join(map(_plain, value))
    if isinstance(value, int):
        return str(value)
    assert isinstance(value, float)
    return f"{value:.10g}" if value else "0"

# SPDX-License-Identifier: BSD-3-Clause
"""What to say about a wrong entry of a configuration: where, what was expected, what came, what to do; one line."""

from __future__ import annotations

import difflib
import re
import reprlib
from collections.abc import Iterable, Sequence
from types import UnionType
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin

from annotated_types import Ge, Le, MaxLen, MinLen
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from swarmevo.config import yaml as config_yaml
from swarmevo.config.models import Config, Section

PLUGINS: Final = ("controller", "fitness", "optimiser")
"""Keys whose values are plugins, by name."""


def explain(problem: ErrorDetails) -> str:
    """Return one line for one of pydantic's errors: where, what was expected, what came, what to do."""
    kind, path, value = problem["type"], problem["loc"], problem["input"]
    if kind == "extra_forbidden":
        return _unknown(*path)
    if kind == "value_error":
        reason = problem["msg"].removeprefix("Value error, ")
        return f"{_dotted(path)}{': ' if reason.startswith('expected') else '.'}{reason}"
    if kind == "missing":  # no key is required: it is a list that is too short
        path = path[:-1]
    expected, unit = expected_at(path), _unit(path)
    return f"{_dotted(path)}: expected {expected}{unit and f' [{unit}]'}, got {shown(value)}{_hint(value, unit)}"


def _unknown(*path: Any) -> str:
    """Return the line about a key that is none."""
    *section, key = path
    if len(section) > 1:  # in a list
        return _unknown_entry(path)
    known = keys_of(*section)
    elsewhere = [f"{name}.{key}" for name in Config.model_fields if key in keys_of(name)]
    close = elsewhere or [".".join((*section, name)) for name in nearest(key, known)]
    if close:
        return f"{_dotted(path)}: unknown key; did you mean {close[0]}?"
    return f"{_dotted(path)}: unknown key; {' '.join(section) or 'the configuration'} has {', '.join(known)}"


def _unknown_entry(path: tuple[int | str, ...]) -> str:
    known = list(_at(path[:-1])[1].model_fields)
    hint = did_you_mean(str(path[-1]), known) or f"; it has {', '.join(known)}"
    return f"{_dotted(path)}: unknown key{hint}"


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return the end of an error line: the nearest of the known words, or nothing if none is near."""
    return "".join(f"; did you mean {match}?" for match in nearest(word, known))


def keys_of(section: str = "") -> list[str]:
    """Return the keys of a section, or the sections; a plugin's options are not known here."""
    model = Config.model_fields[section].annotation if section else Config
    return list(model.model_fields) if isinstance(model, type) and issubclass(model, Section) else []


def nearest(word: str, known: Iterable[str]) -> list[str]:
    """Return the nearest of the known words; none if none is near."""
    return difflib.get_close_matches(word, known, n=1)


def _at(path: tuple[int | str, ...]) -> tuple[FieldInfo | None, Any, list[Any]]:
    """Return the last field that ``path`` leads through, and type and bounds of what belongs at its end."""
    field: FieldInfo | None = None
    kind: Any = Config
    bounds: list[Any] = []
    for step in path:
        if isinstance(kind, type) and issubclass(kind, Section):
            field = kind.model_fields[str(step)]
            kind, bounds = _unwrapped(field.annotation, field.metadata)
        elif get_origin(kind) is tuple:
            entries = _entries(kind)
            kind, bounds = entries[int(step) if len(entries) > 1 else 0]
    return field, kind, bounds


def default_list(path: tuple[int | str, ...]) -> Sequence[Any] | None:
    """Return the list that is at ``path`` by default, empty if nothing is; None: no list belongs there."""
    try:
        field, kind, _ = _at(path)
    except (KeyError, IndexError):
        return None
    if field is None or get_origin(kind) is not tuple:
        return None
    default: Sequence[Any] | None = field.default
    return default or ()


def _unwrapped(annotation: Any, bounds: Iterable[Any] = ()) -> tuple[Any, list[Any]]:
    """Return an annotation without "or nothing", and its bounds."""
    inner = [choice for choice in get_args(annotation) if choice is not type(None)]
    if get_origin(annotation) in (Union, UnionType) and len(inner) == 1:
        return _unwrapped(inner[0], bounds)
    if get_origin(annotation) is Annotated:
        return inner[0], [bound for info in inner[1:] for bound in getattr(info, "metadata", ())]
    return annotation, list(bounds)


def _type(path: tuple[int | str, ...]) -> tuple[Any, list[Any]]:
    """Return type and bounds of what belongs at ``path``, which may lead into lists."""
    _, kind, bounds = _at(path)
    return kind, bounds


def expected_at(path: tuple[int | str, ...]) -> str:
    """Describe what belongs at ``path``."""
    if path[0] not in PLUGINS:
        return _describe(*_type(path))
    if len(path) > 1:
        return "options, {option: value}"
    one = any(isinstance(bound, MaxLen) for bound in _at(path)[2])
    return f"{'one plugin' if one else 'plugins'} by name, {{name: {{option: value}}}}"


def _entries(annotation: Any) -> list[tuple[Any, list[Any]]]:
    """Return type and bounds of each entry of an annotated tuple."""
    return [_unwrapped(entry) for entry in get_args(annotation) if entry is not ...]


def _describe(annotation: Any, bounds: Iterable[Any], plural: bool = False) -> str:
    if get_origin(annotation) is Literal:
        return "one of " + ", ".join(get_args(annotation))
    if get_origin(annotation) is tuple:
        entries = _entries(annotation)
        kind, limits = entries[0]
        if isinstance(kind, type) and issubclass(kind, Section):
            return f"a list of sections ({', '.join(kind.model_fields)}){_at_most(bounds)}"
        same = all(entry == entries[0] for entry in entries)
        many = "lists of " if plural else "a list of "
        return many + _count(annotation, bounds) + _describe(kind, limits if same else (), plural=True)
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return f"a section ({', '.join(annotation.model_fields)})"
    if annotation is str:
        patterns = [pattern for bound in bounds if (pattern := getattr(bound, "pattern", None))]
        return f"text that matches {patterns[0]}" if patterns else "text"
    number = "number" if annotation is float else "whole number"
    low = [f" from {_bound(bound.ge)}" for bound in bounds if isinstance(bound, Ge)]
    high = [f" to {_bound(bound.le)}" for bound in bounds if isinstance(bound, Le)]
    return "".join([f"{number}s" if plural else f"a {number}", *low, *high])


def _count(annotation: Any, bounds: Iterable[Any]) -> str:
    """Return how many entries a tuple has, in words that end in a space."""
    if get_args(annotation)[-1] is not ...:
        return f"{len(get_args(annotation))} "
    least = next((bound.min_length for bound in bounds if isinstance(bound, MinLen)), None)
    most = next((bound.max_length for bound in bounds if isinstance(bound, MaxLen)), None)
    if least is None:
        return ""
    return f"{least} " if least == most else f"{least} to {most} "


def _at_most(bounds: Iterable[Any]) -> str:
    return "".join(f", at most {bound.max_length}" for bound in bounds if isinstance(bound, MaxLen))


def _bound(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _unit(path: tuple[int | str, ...]) -> str:
    """Return the unit of what belongs at ``path``, as the field's docstring has it in brackets; "" if none."""
    field, kind, _ = _at(path) if len(path) > 1 else (None, None, None)
    units = re.findall(r"\[([^]]+)\]", (field.description if field else "") or "")
    if len(units) > 1 and get_origin(kind) is not tuple:
        units = [units[int(path[-1])]]
    return "" if units == ["1"] else ", ".join(units)


def _dotted(path: Iterable[int | str]) -> str:
    names = [f"[{part}]" if isinstance(part, int) else f".{part}" for part in path]
    return ascii("".join(names).removeprefix("."))[1:-1]


def shown(value: Any) -> str:
    """Return a value as one short line, in YAML's words."""
    words = {None: "nothing", True: "true", False: "false"}
    if value is None or isinstance(value, bool):
        return words[value]
    if isinstance(value, dict):
        return f"the keys {reprlib.repr(list(value))[1:-1]}" if value else "no keys"
    return reprlib.repr(value)


def _hint(value: Any, unit: str) -> str:
    """Say what to do about text in the place of a number."""
    if not isinstance(value, str):
        return ""
    if type(config_yaml.plain(config_yaml.parse(value)[0])) in (int, float):
        return "; write it without quotes"
    if re.match(r"[-+]?[0-9.]+ *[^0-9. ]+$", value):
        return f"; write the number alone, in {unit}" if unit else "; write the number alone"
    return ""

# SPDX-License-Identifier: BSD-3-Clause
"""A plugin's options: the parameters of its factory that the host does not pass, with the types that it names.

Options come from YAML and are stored and sent as JSON. What an annotation says is held against the value: a number for
``float``, a list for ``tuple[float, ...]``, a choice for ``Literal``. An option without an annotation, or with one that
pydantic does not know, such as an array, is passed on as it is.
"""

from __future__ import annotations

import copy
import inspect
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from inspect import Parameter
from types import SimpleNamespace
from typing import Any, get_type_hints

from pydantic import TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from swarmevo.config.messages import shown
from swarmevo.config.yaml import Written, plain

HOST_PARAMETERS = {
    "controller": (),
    "fitness": (),
    "optimiser": ("space", "population", "objectives", "rng"),
}
"""What the host passes to each kind's factory, in this order."""
OFFERED_PARAMETERS = {"controller": (), "fitness": ("scene",), "optimiser": ("problem",)}
"""What it passes by name to the factories that have such a parameter; all others are options."""

Factory = Callable[..., Any]

_EXPECTED = {
    "a valid string": "text",
    "a valid number": "a number",
    "a valid integer": "a whole number",
    "a valid boolean": "true or false",
    "a valid array": "a list",
    "a valid list": "a list",
    "a valid tuple": "a list",
    "an object": "a mapping",
    "a valid dictionary": "a mapping",
}
"""Pydantic's words, and ours."""


@dataclass(frozen=True)
class Option:
    """An option of a plugin."""

    parameter: Parameter
    type: TypeAdapter[Any] | None
    """Of its annotation; None: it has none that pydantic knows."""

    @property
    def name(self) -> str:
        """The parameter's."""
        return self.parameter.name

    @property
    def takes_any_name(self) -> bool:
        """Whether it stands for all options that have no parameter of their own."""
        return self.parameter.kind is Parameter.VAR_KEYWORD

    @property
    def is_required(self) -> bool:
        """Whether it has no default."""
        return self.parameter.default is Parameter.empty and not self.takes_any_name

    def problem(self, value: Any) -> str:
        """Return why a plain value is none for this option, in words that follow its name; nothing: it is one."""
        errors = self._errors(value)
        if not errors:
            return ""
        expected = " or ".join(dict.fromkeys(map(_expected, errors)))
        return f"expected {expected}, got {shown(value)}"

    def taken(self, value: Any) -> Any:
        """Return a plain value, which has no problem, as the factory takes it: a copy, of the annotated type."""
        if self.type is None or self._is_default(value):
            return copy.deepcopy(value)
        made = self.type.validate_json(json.dumps(value), strict=True)
        return copy.deepcopy(value) if isinstance(made, Iterator) else made  # an iterator is used up by one look at it

    def settled(self, value: Any) -> Any:
        """Return plain data of what is written: as YAML reads it, but as text what must be text."""
        read = plain(value)
        text = value
        for error in self._errors(read):
            text = _with_text(text, list(error["loc"]))
        text = plain(text)
        return read if self._errors(text) else text

    def _errors(self, value: Any) -> list[ErrorDetails]:
        if self.type is None or self._is_default(value):
            return []
        try:
            self.type.validate_json(json.dumps(value), strict=True)
        except ValidationError as error:
            return error.errors(include_url=False)
        return []

    def _is_default(self, value: Any) -> bool:
        return value is None and self.parameter.default is None


def options(kind: str, factory: Factory) -> list[Option] | None:
    """Return the options of a factory; None: it has no signature that Python knows."""
    try:
        parameters = list(inspect.signature(factory).parameters.values())
    except (TypeError, ValueError):
        return None
    for _ in HOST_PARAMETERS[kind]:
        if parameters and parameters[0].kind in (Parameter.POSITIONAL_ONLY, Parameter.POSITIONAL_OR_KEYWORD):
            parameters.pop(0)
    return [
        _option(factory, parameter)
        for parameter in parameters
        if parameter.kind is not Parameter.VAR_POSITIONAL and parameter.name not in OFFERED_PARAMETERS[kind]
    ]


def taken_of(factory: Factory, offered: Mapping[str, Any]) -> dict[str, Any]:
    """Return those of the offered arguments that a factory has a parameter for."""
    try:
        parameters = inspect.signature(factory).parameters
    except (TypeError, ValueError):
        return {}
    return {name: value for name, value in offered.items() if name in parameters}


def settled(kind: str, factory: Factory, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return options as plain data, of options as they are written."""
    known = options(kind, factory) or []
    return {
        name: option.settled(value) if (option := of_name(known, name)) else plain(value)
        for name, value in given.items()
    }


def of_name(known: Sequence[Option], name: str) -> Option | None:
    """Return the option that takes a name; None: none does."""
    named = [option for option in known if option.name == name and not option.takes_any_name]
    return next(iter(named or [option for option in known if option.takes_any_name]), None)


def _option(factory: Factory, parameter: Parameter) -> Option:
    annotation = parameter.annotation
    try:
        if isinstance(annotation, str):
            holder = SimpleNamespace(__annotations__={"it": annotation})
            annotation = get_type_hints(holder, _namespace(factory), include_extras=True)["it"]
        known = TypeAdapter(annotation) if annotation is not Parameter.empty else None
    except Exception:  # it may name what exists for type checkers only, or what pydantic does not know
        known = None
    return Option(parameter.replace(annotation=annotation), known)


def _namespace(factory: Factory) -> dict[str, Any]:
    """Return the names that a factory's annotations may use."""
    is_class = isinstance(factory, type)
    function = inspect.getattr_static(factory, "__init__") if is_class else getattr(factory, "func", factory)
    return getattr(inspect.unwrap(function), "__globals__", {})


def _with_text(value: Any, path: list[int | str]) -> Any:
    """Return data with the text of what is written at ``path``, which may name members of unions too."""
    if isinstance(value, Written):
        return str(value)
    for i, key in enumerate(path):
        if isinstance(value, list) and isinstance(key, int) and key < len(value):
            return [*value[:key], _with_text(value[key], path[i + 1 :]), *value[key + 1 :]]
        if isinstance(value, Mapping) and key in value:
            return {**value, key: _with_text(value[key], path[i + 1 :])}
    return value


def _expected(error: ErrorDetails) -> str:
    """Return what was expected, in our words, and where in a list or a mapping."""
    said = error["msg"].removeprefix("Input should be ")
    inside = "".join(f"[{part}]" for part in error["loc"] if isinstance(part, int))
    if error["type"] == "missing":
        said = "a value"
    elif error["type"] == "too_long":
        said = f"at most {error['ctx']['max_length']} entries"
    return _EXPECTED.get(said, said) + (f" at {inside}" if inside else "")

# SPDX-License-Identifier: BSD-3-Clause
"""YAML as configurations have it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

import yaml

MOST_VALUES: Final = 20_000
"""In a text, an alias counted as all that it stands for."""
DEEPEST: Final = 50
"""Levels of lists and mappings in each other."""


class Written(str):
    """A number, true or false as it is written, such as ``1e5`` or ``off``: who wants text has it."""

    value: float | bool

    def __new__(cls, text: str, value: float | bool) -> Written:
        """Return a text with what YAML makes of it."""
        written = super().__new__(cls, text)
        written.value = value
        return written

    def __deepcopy__(self, memo: object) -> Written:
        return self  # immutable


def plain(data: Any) -> Any:
    """Return data with the values of what is written in it."""
    if isinstance(data, Written):
        return data.value
    if isinstance(data, Mapping):
        return {key: plain(value) for key, value in data.items()}
    return [plain(value) for value in data] if isinstance(data, list) else data


class _Loader(yaml.SafeLoader):
    """YAML as JSON knows it: 1e-5 is a number, 010 is ten, dates are text; keys are text, each given once."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}  # noqa: RUF012 (PyYAML's own shape)

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.errors: list[str] = []
        self._sizes: dict[yaml.Node, int] = {}
        self._values = self._depth = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        before = self._values
        self._depth += 1
        self._check(self._depth <= DEEPEST, f"nested too deeply, expected at most {DEEPEST} levels")
        node = super().compose_node(parent, index)
        self._depth -= 1
        if node is not None and node in self._sizes:  # an alias
            self._values += self._sizes[node]
        elif node is not None:
            self._values += 1
            self._sizes[node] = self._values - before
        self._check(
            self._values <= MOST_VALUES, f"expected at most {MOST_VALUES} values, aliases written out, got more"
        )
        return node

    def _check(self, fine: bool, problem: str) -> None:
        if not fine:
            mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=mark)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = True) -> dict[Any, Any]:
        mapping: dict[str, Any] = {}
        lines: dict[str, int] = {}
        for key_node, value_node in node.value:
            key, line = str(key_node.value), key_node.start_mark.line + 1
            if not isinstance(key_node, yaml.ScalarNode):
                self.errors.append(f"line {line}: expected a name before the colon, got a list or a mapping")
            elif key in mapping:
                self.errors.append(f"line {line}: {key} is given twice, first in line {lines[key]}")
            else:
                mapping[key], lines[key] = self.construct_object(value_node, deep=True), line
        return mapping

    def construct_bool(self, node: yaml.ScalarNode) -> Written:
        return Written(node.value, self.construct_yaml_bool(node))

    def construct_integer(self, node: yaml.ScalarNode) -> Written:
        return Written(node.value, int(node.value.replace("_", "")))

    def construct_float(self, node: yaml.ScalarNode) -> Written:
        return Written(node.value, self.construct_yaml_float(node))


_TAG = "tag:yaml.org,2002:"
for _tag, _pattern, _first in (
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("bool", r"(?i:yes|no|true|false|on|off)", list("yYnNtTfFoO")),
    ("int", r"[-+]?[0-9][0-9_]*", list("-+0123456789")),
    ("float", r"[-+]?([0-9][0-9_]*\.?[0-9_]*|\.[0-9][0-9_]*)([eE][-+]?[0-9]+)?", list("-+.0123456789")),
    ("float", r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)", list("-+.")),
):
    _Loader.add_implicit_resolver(_TAG + _tag, re.compile(rf"(?:{_pattern})\Z"), _first)
_Loader.yaml_constructors = {
    _TAG + "null": _Loader.construct_yaml_null,
    _TAG + "bool": _Loader.construct_bool,
    _TAG + "int": _Loader.construct_integer,
    _TAG + "float": _Loader.construct_float,
    _TAG + "str": _Loader.construct_yaml_str,
    _TAG + "seq": _Loader.construct_yaml_seq,
    _TAG + "map": _Loader.construct_mapping,
    None: _Loader.construct_undefined,
}


class _Dumper(yaml.SafeDumper):
    """Writes what :class:`_Loader` reads back."""

    yaml_implicit_resolvers = _Loader.yaml_implicit_resolvers

    def ignore_aliases(self, data: Any) -> bool:
        return True

    def represent_in_one_line(self, data: Sequence[Any]) -> yaml.Node:
        return self.represent_sequence(_TAG + "seq", data, flow_style=True)


_Dumper.add_representer(list, _Dumper.represent_in_one_line)
_Dumper.add_representer(tuple, _Dumper.represent_in_one_line)


def parse(text: str) -> tuple[Any, list[str]]:
    """Return the data in a YAML text, numbers and truth values as :class:`Written`, and its errors, one line each."""
    try:
        loader = _Loader(text)
        return loader.get_single_data(), loader.errors
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        return None, [where + ", ".join(filter(None, (error.context, error.problem)))]
    except (yaml.YAMLError, ValueError) as error:
        return None, [str(error).split("\n")[0]]


def dump(data: Any) -> str:
    """Return plain data as a YAML text, which gives the same by :func:`parse` and :func:`plain`."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, width=120)

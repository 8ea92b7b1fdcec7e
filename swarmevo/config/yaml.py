# SPDX-License-Identifier: BSD-3-Clause
"""YAML as configurations have it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import yaml


class _Loader(yaml.SafeLoader):
    """YAML as JSON knows it: 1e-5 is a number, 010 is ten, dates are text; keys are text, each given once."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}  # noqa: RUF012 (PyYAML's own shape)

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.errors: list[str] = []

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

    def construct_integer(self, node: yaml.ScalarNode) -> int:
        return int(node.value.replace("_", ""))


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
    _TAG + "bool": _Loader.construct_yaml_bool,
    _TAG + "int": _Loader.construct_integer,
    _TAG + "float": _Loader.construct_yaml_float,
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
    """Return the data in a YAML text, and its errors, one line each."""
    try:
        loader = _Loader(text)
        return loader.get_single_data(), loader.errors
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        return None, [where + ", ".join(filter(None, (error.context, error.problem)))]
    except RecursionError:
        return None, ["nested too deeply"]
    except (yaml.YAMLError, ValueError) as error:
        return None, [str(error).split("\n")[0]]


def dump(data: Any) -> str:
    """Return plain data as a YAML text, from which :func:`parse` reads the same."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, width=120)

# SPDX-License-Identifier: BSD-3-Clause
"""Keys that lead through lists: ``scene.movables.0.mass``, ``box.pose.2``. Entries count from 0.

>>> value_at(Config(), "box.size.1")
0.18
>>> problem(Config(), "box.size.3")
'expected an entry of box.size, 0 to 2, got 3'
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from swarmevo.config.messages import did_you_mean, shown
from swarmevo.config.models import Config, Section


def is_entry(step: str) -> bool:
    """Whether a step of a key can be the place of an entry in a list."""
    return re.fullmatch("[0-9]{1,9}", step) is not None


def no_entry(where: str, entries: Sequence[Any], step: str) -> str:
    """Return why a step leads to none of a list's entries, in words; "": it does."""
    if is_entry(step) and int(step) < len(entries):
        return ""
    if not entries:
        return f"expected an entry of {where}, which has none, got {step}"
    return f"expected an entry of {where}, 0 to {len(entries) - 1}, got {step}"


def without_brackets(key: str) -> str:
    """Return a key with its entries as they are written: ``scene.movables[0]`` is ``scene.movables.0``."""
    return re.sub(r"\[([0-9]+)\]", r".\1", key)


def problem(config: Config, key: str) -> str:
    """Return why there is nothing at a key, in words; "": there is something."""
    value: Any = config
    passed: list[str] = []
    for step in key.split("."):
        where = ".".join(passed)
        if isinstance(value, Section):
            if step not in type(value).model_fields:
                known = list(type(value).model_fields)
                return f"unknown key{did_you_mean(step, known) or f'; {where} has ' + ', '.join(known)}"
            value = getattr(value, step)
        elif isinstance(value, tuple):
            if wrong := no_entry(where, value, step):
                return wrong
            value = value[int(step)]
        elif value is None:
            return f"expected an entry of {where}, which names nothing here; name it whole"
        else:
            return f"expected {where} alone, which is {shown(value)} and has no entries"
        passed.append(step)
    return ""


def value_at(config: Config, key: str) -> Any:
    """Return what is at a key that has no :func:`problem`."""
    value: Any = config
    for step in key.split("."):
        value = value[int(step)] if isinstance(value, tuple) else getattr(value, step)
    return value


def with_value(config: Config, key: str, value: Any) -> Config:
    """Return a configuration with another value, which is in its range, at a key that has no :func:`problem`."""
    changed: Config = _with(config, key.split("."), value)
    return changed


def _with(within: Any, steps: Sequence[str], value: Any) -> Any:
    if not steps:
        return value
    step, *rest = steps
    if isinstance(within, tuple):
        i = int(step)
        return (*within[:i], _with(within[i], rest, value), *within[i + 1 :])
    return within.model_copy(update={step: _with(getattr(within, step), rest, value)})

# SPDX-License-Identifier: BSD-3-Clause
"""An optimiser's state as text: JSON with arrays, all bits kept, nothing executed when it is read."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

DEEPEST: Final = 100
"""Dicts and lists in one another that a state may have: JSON that is deeper could not be read again everywhere."""

_ARRAY_KEYS: Final = {"dtype", "shape", "base64"}


def encode_state(state: Mapping[str, Any]) -> str:
    """Return ``state`` as JSON.

    Args:
        state: Numbers, strings, None, arrays, and dicts (with strings as keys) and lists of these. An array becomes
            ``{"dtype", "shape", "base64"}``; whole numbers keep all their digits, floats all their bits.

    Raises:
        TypeError: Anything else is in it, or it is in itself or too deep; the message says where.
    """
    if not isinstance(state, Mapping):
        raise TypeError(f"expected a mapping, got {type(state).__name__}")
    try:
        return json.dumps(_plain(state, "state", ()))
    except ValueError as error:  # a number with too many digits to be read again
        raise TypeError(f"state: {error}") from error


def decode_state(text: str) -> dict[str, Any]:
    """Return what :func:`encode_state` was given, tuples as lists.

    Raises:
        ValueError: It is no such text.
    """
    try:
        state = json.loads(text, object_hook=_array_or_dict)
    except (TypeError, RecursionError) as error:
        raise ValueError(f"expected what encode_state returns: {error}") from error
    if not isinstance(state, dict):
        raise ValueError(f"expected a JSON object, got {type(state).__name__}")
    return state


def _plain(value: Any, where: str, around: tuple[int, ...]) -> Any:
    """Return ``value`` made of what JSON knows; ``around`` are the ids of what it is in."""
    if id(value) in around:
        raise TypeError(f"{where}: expected no cycles, but it is in itself")
    if len(around) > DEEPEST:
        raise TypeError(f"{where[:60]}...: expected at most {DEEPEST} dicts and lists in one another, got more")
    if isinstance(value, np.ndarray):
        return _plain_array(value, where)
    if isinstance(value, np.generic):
        return _plain(value.item(), where, (*around, id(value)))
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Mapping):
        if not all(isinstance(key, str) for key in value) or set(value) == _ARRAY_KEYS:
            raise TypeError(f"{where}: expected strings as keys, other than those of an array, got {list(value)}")
        inside = (*around, id(value))
        return {key: _plain(entry, f"{where}[{key!r}]", inside) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        inside = (*around, id(value))
        return [_plain(entry, f"{where}[{i}]", inside) for i, entry in enumerate(value)]
    raise TypeError(f"{where}: expected a number, string, None, array, dict or list, got {type(value).__name__}")


def _plain_array(array: NDArray[Any], where: str) -> dict[str, Any]:
    if array.dtype.kind not in "biufc":
        raise TypeError(f"{where}: expected an array of numbers, got dtype {array.dtype}")
    content = base64.b64encode(array.tobytes()).decode("ascii")
    return {"dtype": array.dtype.str, "shape": list(array.shape), "base64": content}


def _array_or_dict(value: dict[str, Any]) -> Any:
    if set(value) != _ARRAY_KEYS:
        return value
    content = base64.b64decode(value["base64"], validate=True)
    return np.frombuffer(content, dtype=value["dtype"]).reshape(value["shape"]).copy()

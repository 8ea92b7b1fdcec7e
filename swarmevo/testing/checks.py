# SPDX-License-Identifier: BSD-3-Clause
"""How the tests of the kit fail, and what they do to arrays and states."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np

from swarmevo.protocols import FloatArray

Array = TypeVar("Array", bound=np.ndarray[Any, Any])


def require(condition: bool, message: str) -> None:
    """Fail a test; unlike ``assert`` also under ``python -O``, and with the message alone."""
    if not condition:
        raise AssertionError(message)


def accepted(what: str, check: Callable[..., Any], *values: object) -> Any:
    """Return what a check of the host makes of what a plugin returned."""
    try:
        return check(*values)
    except ValueError as error:
        raise AssertionError(f"{what}: {error}") from error


def require_array(what: str, array: object, shape: tuple[int | None, ...]) -> None:
    """Require a finite float64 array; ``None`` in ``shape`` is any length."""
    expected = "(" + ", ".join("n" if n is None else str(n) for n in shape) + ")"
    plain = isinstance(array, np.ndarray) and not isinstance(array, np.ma.MaskedArray)
    require(plain, f"{what}: expected an array {expected}, got {type(array).__name__}")
    values = np.asarray(array)
    fits = values.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, values.shape, strict=True))
    require(fits, f"{what}: expected the shape {expected}, got {values.shape}")
    require(values.dtype == np.float64, f"{what}: expected float64, got {values.dtype}")
    require(bool(np.all(np.isfinite(values))), f"{what}: expected finite numbers, got NaN or infinity")


def frozen(array: Array) -> Array:
    """Return the array, read-only from now on."""
    array.setflags(write=False)
    return array


def scribble(array: FloatArray) -> None:
    """Overwrite an array that may be written to: nobody should rely on it any more."""
    if array.base is None:
        array.setflags(write=True)
    if array.flags.writeable:
        array.fill(np.nan)


def to_json(state: object) -> str:
    """Return ``state`` as JSON; fail on anything that is not a number, string, None, array, dict or list."""
    return json.dumps(_plain(state, "state"))


def _plain(value: object, where: str) -> object:
    if isinstance(value, np.generic):
        return _plain(value.item(), where)
    if value is None or type(value) in (bool, int, float, str):
        return value
    if isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        return {"array": value.tolist(), "dtype": value.dtype.str, "shape": value.shape}
    if isinstance(value, Mapping):
        require(all(type(key) is str for key in value), f"{where}: expected strings as keys, got {list(value)}")
        return {key: _plain(item, f"{where}[{key!r}]") for key, item in value.items()}
    if isinstance(value, list):
        return [_plain(item, f"{where}[{i}]") for i, item in enumerate(value)]
    kind = f"{type(value).__module__}.{type(value).__name__}"
    raise AssertionError(f"{where}: expected a number, string, None, array, dict or list, got {kind}")


def from_json(text: str) -> Any:
    """Return the state that :func:`to_json` made this text of."""

    def decode(item: dict[str, Any]) -> Any:
        if set(item) == {"array", "dtype", "shape"}:
            return np.array(item["array"], dtype=item["dtype"]).reshape(item["shape"])
        return item

    return json.loads(text, object_hook=decode)

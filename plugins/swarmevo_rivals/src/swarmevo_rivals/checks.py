# SPDX-License-Identifier: BSD-3-Clause
"""Options that are refused."""

from __future__ import annotations

import math


def require_count(name: str, value: object) -> None:
    """Refuse what is no whole number of at least 1."""
    if type(value) is not int or value < 1:
        raise ValueError(f"{name}: expected a whole number of at least 1, got {value!r}")


def require_positive(name: str, value: object) -> None:
    """Refuse what is no finite number above 0."""
    if not isinstance(value, (int, float)) or not 0 < value < math.inf:
        raise ValueError(f"{name}: expected a number above 0, got {value!r}")


def require_choice(name: str, value: object, choices: tuple[str, ...]) -> None:
    """Refuse what is none of ``choices``."""
    if value not in choices:
        raise ValueError(f"{name}: expected one of {', '.join(choices)}, got {value!r}")

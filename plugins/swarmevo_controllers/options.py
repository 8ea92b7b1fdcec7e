# SPDX-License-Identifier: BSD-3-Clause
"""Checks of options that several controllers have."""

from __future__ import annotations

from typing import Final

MOST_HIDDEN: Final = 1024
"""Largest number of hidden neurons that the library runs."""


def check_hidden(hidden: object) -> None:
    """Refuse what is no number of hidden neurons.

    Raises:
        ValueError: It is not.
    """
    if type(hidden) is not int or not 1 <= hidden <= MOST_HIDDEN:
        raise ValueError(f"hidden: expected a whole number from 1 to {MOST_HIDDEN}, got {hidden!r}")


def check_bias(bias: object) -> None:
    """Refuse what is neither true nor false.

    Raises:
        ValueError: It is not.
    """
    if not isinstance(bias, bool):
        raise ValueError(f"bias: expected true or false, got {bias!r}")


def check_choice(name: str, value: object, choices: tuple[str, ...]) -> None:
    """Refuse what is not among ``choices``.

    Raises:
        ValueError: It is not.
    """
    if value not in choices:
        raise ValueError(f"{name}: expected one of {', '.join(choices)}, got {value!r}")

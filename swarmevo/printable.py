# SPDX-License-Identifier: BSD-3-Clause
"""Text from outside, such as paths and what plugins say, as a terminal, a figure or a table may have it."""

from __future__ import annotations

import unicodedata
from typing import Final

_UNSEEN: Final = {"Cc", "Cf", "Cs", "Zl", "Zp"}
"""Unicode's categories of control characters, of what changes how others are shown, surrogates, and line ends."""


def printable(text: str, keep: str = "") -> str:
    """Return text with an escape in place of each character that would act and not be seen.

    Args:
        text: Any; it may have surrogates, as undecodable paths do.
        keep: Characters that stay as they are.
    """
    if text.isprintable():
        return text
    return "".join(_shown(letter) if letter not in keep else letter for letter in text)


def _shown(letter: str) -> str:
    return ascii(letter)[1:-1] if unicodedata.category(letter) in _UNSEEN else letter

# SPDX-License-Identifier: BSD-3-Clause
"""Everything that swarmevo raises on purpose. The message is one line: what was expected, what came, what to do."""

from __future__ import annotations

import re
from collections import Counter
from typing import Final

_SHOWN: Final = 3
"""Lines of a kind, where there are more: twenty robots outside of the arena are one mistake."""


class SwarmevoError(Exception):
    """Base of all errors of swarmevo. ``errors`` holds one line for each thing that is wrong.

    Of many lines that differ only in their numbers and in what came: the first ones and how many more there are.
    """

    def __init__(self, *errors: str) -> None:
        errors = _few(errors)
        super().__init__("; ".join(errors))
        self.errors = errors

    def __reduce__(self) -> tuple[type[SwarmevoError], tuple[str, ...], dict[str, object]]:
        return type(self), self.errors, self.__dict__  # errors travel between processes


class ConfigError(SwarmevoError):
    """A configuration cannot be used."""


class PluginError(SwarmevoError):
    """A plugin cannot be found, loaded or made. A line names the plugin, its distribution and what to do."""


class EvaluationError(SwarmevoError):
    """A plugin returned what it must not, or an episode failed. The line names it."""


class ClusterError(EvaluationError):
    """The cluster cannot be used, or is gone."""


class StoreError(SwarmevoError):
    """A run folder cannot be made, read or written. What was stored before is intact."""


class FolderExistsError(StoreError):
    """A new run was to be made in a folder that is there already; the folder was not touched."""


class OutputError(SwarmevoError):
    """A file cannot be written. What was there before is intact, and nothing new is left."""


class SimulatorError(SwarmevoError, RuntimeError):
    """The native library failed or refused."""


class InvalidArgument(SimulatorError, ValueError):  # noqa: N818 - as the library's SWE_INVALID_ARGUMENT
    """A value, size or pointer was not acceptable to the native library; nothing was done."""


class ExportError(SwarmevoError):
    """A controller cannot be exported in the way asked for."""


class ReplayError(SwarmevoError):
    """An episode cannot be shown, or not as it was."""


class Interrupted(Exception):  # noqa: N818 - asked for, not an error
    """What was going on was asked to stop, and did."""


def _few(lines: tuple[str, ...]) -> tuple[str, ...]:
    """Return lines; of a kind with two more than are shown, the first ones, the last of which tells how many more."""
    kinds = [re.sub(r"\d+(\.\d+)?", "#", line.partition(", got ")[0]) for line in lines]
    total, seen = Counter(kinds), Counter[str]()
    found = []
    for line, kind in zip(lines, kinds, strict=True):
        seen[kind] += 1
        left = total[kind] - _SHOWN
        if left < 2 or seen[kind] < _SHOWN:
            found.append(line)
        elif seen[kind] == _SHOWN:
            found.append(f"{line} (and {left} more like this)")
    return tuple(found)

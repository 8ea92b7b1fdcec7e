# SPDX-License-Identifier: BSD-3-Clause
"""Everything that swarmevo raises on purpose. The message is one line: what was expected, what came, what to do."""

from __future__ import annotations


class SwarmevoError(Exception):
    """Base of all errors of swarmevo. ``errors`` holds one line for each thing that is wrong."""

    def __init__(self, *errors: str) -> None:
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

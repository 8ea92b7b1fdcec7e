# SPDX-License-Identifier: BSD-3-Clause
"""Plugins: finding, checking and making them; what they return, checked."""

from swarmevo.errors import PluginError
from swarmevo.plugins.registry import (
    GROUPS,
    HOST_PARAMETERS,
    Factory,
    PluginEntry,
    Report,
    check,
    create,
    discover,
    find,
    load,
    option_errors,
)

__all__ = [
    "GROUPS",
    "HOST_PARAMETERS",
    "Factory",
    "PluginEntry",
    "PluginError",
    "Report",
    "check",
    "create",
    "discover",
    "find",
    "load",
    "option_errors",
]

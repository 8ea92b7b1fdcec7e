# SPDX-License-Identifier: BSD-3-Clause
"""Plugins: finding, checking and making them; what they return, checked."""

from swarmevo.errors import PluginError
from swarmevo.plugins.options import HOST_PARAMETERS, OFFERED_PARAMETERS, Factory
from swarmevo.plugins.registry import (
    GROUPS,
    INSTALL_RIVALS,
    RIVALS,
    PluginEntry,
    Report,
    check,
    create,
    default_options,
    discover,
    find,
    load,
    option_errors,
    settled_options,
    takes,
)

__all__ = [
    "GROUPS",
    "HOST_PARAMETERS",
    "INSTALL_RIVALS",
    "OFFERED_PARAMETERS",
    "RIVALS",
    "Factory",
    "PluginEntry",
    "PluginError",
    "Report",
    "check",
    "create",
    "default_options",
    "discover",
    "find",
    "load",
    "option_errors",
    "settled_options",
    "takes",
]

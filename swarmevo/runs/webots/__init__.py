# SPDX-License-Identifier: BSD-3-Clause
"""A project for Webots: the scene as a world, the controller as C, a README. Source: Webots' reference manual."""

from swarmevo.runs.webots.controller import source
from swarmevo.runs.webots.project import write

__all__ = ["source", "write"]

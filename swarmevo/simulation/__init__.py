# SPDX-License-Identifier: BSD-3-Clause
"""Scenes and episodes in the native library. NumPy in, NumPy out."""

from swarmevo.errors import InvalidArgument, SimulatorError
from swarmevo.simulation._ffi import parse_types
from swarmevo.simulation.episodes import EpisodeKey, Episodes, simulate
from swarmevo.simulation.library import library_info, selftest
from swarmevo.simulation.lockstep import Lockstep, State, simulate_lockstep
from swarmevo.simulation.policies import check_policies
from swarmevo.simulation.scene import Scene, scene_errors, start_poses

__all__ = [
    "EpisodeKey",
    "Episodes",
    "InvalidArgument",
    "Lockstep",
    "Scene",
    "SimulatorError",
    "State",
    "check_policies",
    "library_info",
    "parse_types",
    "scene_errors",
    "selftest",
    "simulate",
    "simulate_lockstep",
    "start_poses",
]

# SPDX-License-Identifier: BSD-3-Clause
"""The public interface in Python: runs, their fronts and individuals. What it needs is done in the packages below."""

from swarmevo.api.individuals import Controller, Elites, Episodes, Front, Individual, Rates, Replay, best
from swarmevo.api.runs import Run, evolve, load_config, open, resume
from swarmevo.api.sweeps import sweep

__all__ = [
    "Controller",
    "Elites",
    "Episodes",
    "Front",
    "Individual",
    "Rates",
    "Replay",
    "Run",
    "best",
    "evolve",
    "load_config",
    "open",
    "resume",
    "sweep",
]

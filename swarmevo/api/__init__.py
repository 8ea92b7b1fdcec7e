# SPDX-License-Identifier: BSD-3-Clause
"""The public interface in Python: runs, their fronts and individuals. What it needs is done in the packages below."""

from swarmevo.api.individuals import Episodes, Front, Individual, Rates, Replay
from swarmevo.api.runs import Run, evolve, load_config, open, resume

__all__ = ["Episodes", "Front", "Individual", "Rates", "Replay", "Run", "evolve", "load_config", "open", "resume"]

# SPDX-License-Identifier: BSD-3-Clause
"""The configurations that come with swarmevo under ids of Gymnasium, for ``gymnasium.make_vec``."""

from __future__ import annotations

from typing import Any

import gymnasium

from swarmevo import config as configuration
from swarmevo.env.vector import SwarmVectorEnv


def register() -> None:
    """Make ``swarmevo/NAME-v0`` known for each packaged configuration; again is fine."""
    for name in configuration.packaged():
        id = f"swarmevo/{name}-v0"
        if id not in gymnasium.registry:
            gymnasium.register(id, vector_entry_point=make, kwargs={"config": name})


def make(num_envs: int, config: str, **options: Any) -> SwarmVectorEnv:
    """Return ``num_envs`` worlds of a configuration; ``options`` are those of :class:`SwarmVectorEnv`."""
    return SwarmVectorEnv(config, num_envs, **options)

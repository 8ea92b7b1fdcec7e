# SPDX-License-Identifier: BSD-3-Clause
"""Worlds for reinforcement learning, beside evolution: PettingZoo's and Gymnasium's interfaces over ``Lockstep``.

Needs ``pip install 'swarmevo[rl]'``. Rewards are what the configuration's fitness functions gain at each control step.
``gymnasium.make_vec("swarmevo/NAME-v0")`` knows the packaged configurations once this is imported.
"""

try:
    import gymnasium  # noqa: F401
    import pettingzoo  # noqa: F401
except ImportError as error:
    raise ImportError(
        f"swarmevo.env: expected PettingZoo and Gymnasium installed, got no {error.name}; pip install 'swarmevo[rl]'"
    ) from None

from swarmevo.env.parallel import SwarmParallelEnv
from swarmevo.env.registration import register
from swarmevo.env.vector import SwarmVectorEnv

register()

__all__ = ["SwarmParallelEnv", "SwarmVectorEnv"]

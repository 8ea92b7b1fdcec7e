# SPDX-License-Identifier: BSD-3-Clause
"""Evolves controllers for swarms of simulated robots, with several objectives at once.

    import swarmevo as se

    se.best().replay().save("best.html")             # the controller that comes with it: robots that push the box

    run = se.evolve("paper", seed=1, out="runs/paper", set={"evolution.generations": 50})
    run = se.resume("runs/paper")                    # after an interruption, to the same bits
    run = se.open("runs/paper")                      # to look at, while it is being written too

    front = run.front()                              # non-dominated individuals; front.rows, front.frame()
    one = front.best("box_pushing")
    one.objectives, one.genes, one.trial, one.generation

    one.replay().save("one.html")                    # its stored episode once more, checked bit by bit
    one.replay(seed=7)                               # another one; shows itself in a notebook
    episodes = one.simulate(episodes=1000, robots=3, set={"noise.infrared": 0.1})
    episodes.telemetry.pose, episodes.push_time      # NumPy arrays
    one.test(episodes=300)                           # rates with confidence intervals

    se.figures.paper(run)                            # Figs. 3 to 5 as one plate; .savefig("plate.pdf")

    with se.Lockstep("paper", worlds=64, seed=1) as world:
        observations = world.observe()               # (worlds, robots, 13)
        world.advance(0 * observations[..., :2])     # commands (worlds, robots, 2)
        world.state().pose                           # (worlds, robots, 3)
        world.reset(worlds=[3, 5])

Names are loaded when they are first used. Plugins are written against :mod:`swarmevo.protocols` alone and tested with
:mod:`swarmevo.testing`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from swarmevo._version import __version__

if TYPE_CHECKING:
    from swarmevo.api import (
        Controller,
        Elites,
        Episodes,
        Front,
        Individual,
        Rates,
        Replay,
        Run,
        best,
        evolve,
        load_config,
        open,
        resume,
        sweep,
    )
    from swarmevo.config import Config
    from swarmevo.errors import (
        ConfigError,
        EvaluationError,
        Interrupted,
        InvalidArgument,
        PluginError,
        ReplayError,
        SimulatorError,
        StoreError,
        SwarmevoError,
    )
    from swarmevo.simulation import Lockstep
    from swarmevo.views import figures

_HOMES = {
    "swarmevo.api": (
        "Controller", "Elites", "Episodes", "Front", "Individual", "Rates", "Replay", "Run", "best",
        "evolve", "load_config", "open", "resume", "sweep",
    ),
    "swarmevo.config": ("Config",),
    "swarmevo.errors": (
        "ConfigError", "EvaluationError", "Interrupted", "InvalidArgument", "PluginError", "ReplayError",
        "SimulatorError", "StoreError", "SwarmevoError",
    ),
    "swarmevo.simulation": ("Lockstep",),
}  # fmt: skip
_HOME = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "Config",
    "ConfigError",
    "Controller",
    "Elites",
    "Episodes",
    "EvaluationError",
    "Front",
    "Individual",
    "Interrupted",
    "InvalidArgument",
    "Lockstep",
    "PluginError",
    "Rates",
    "Replay",
    "ReplayError",
    "Run",
    "SimulatorError",
    "StoreError",
    "SwarmevoError",
    "__version__",
    "best",
    "evolve",
    "figures",
    "load_config",
    "open",
    "resume",
    "sweep",
]


def __getattr__(name: str) -> Any:
    if name == "figures":
        return import_module("swarmevo.views.figures")
    if name not in _HOME:
        raise AttributeError(f"module 'swarmevo' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

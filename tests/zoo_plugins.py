# SPDX-License-Identifier: BSD-3-Clause
"""Toys each method of which can be made to misbehave, at any time: see :func:`misbehave`."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

import toy_plugins
from swarmevo.config import Config
from swarmevo.protocols import Controller, FloatArray, GenomeSpace, SceneInfo, Telemetry
from zoo_deeds import NAMED, Deed

DEED: Final = "SWARMEVO_ZOO"
"""Variable of the environment that makes a new process misbehave: ``zoo_travel.evaluate=sys.exit(0)``."""

_deeds: dict[str, Deed] = {}
if os.environ.get(DEED):
    _where, _, _name = os.environ[DEED].partition("=")
    _deeds[_where] = NAMED[_name]


def install(distribution: Callable[..., Any]) -> None:
    """Make the toys known, as the distribution ``zoo 1.0``."""
    toy_plugins.install(distribution)
    here = __name__
    groups = {
        "swarmevo.controllers": {"zoo_network": f"{here}:Network", "zoo_linear": f"{here}:Linear"},
        "swarmevo.fitness": {
            "zoo_travel": f"{here}:Travel",
            "zoo_explained": f"{here}:Explained",
            "zoo_places": f"{here}:Places",
        },
        "swarmevo.optimisers": {"zoo_search": f"{here}:Search", "zoo_answering": f"{here}:Answering"},
    }
    distribution("zoo", "1.0", groups)


PLUGINS: Final[Mapping[str, Mapping[str, Any]]] = {
    "zoo_network": {"controller": "zoo_network"},
    "zoo_linear": {"controller": "zoo_linear"},
    "zoo_travel": {"fitness": ["zoo_travel"]},
    "zoo_places": {"fitness": ["toy_travel", "zoo_places"]},
    "zoo_search": {"optimiser": "zoo_search"},
    "zoo_answering": {"optimiser": "zoo_answering"},
    "zoo_explained": {"fitness": ["zoo_explained"]},
}
"""How each is chosen."""


def config(plugin: str, **evolution: Any) -> Config:
    """Return a run of a moment with one of these plugins."""
    short = {"generations": 3, "population": 2, "trials": 1, "repeats": 1, **evolution}
    if plugin == "zoo_answering":
        short["refine"] = 0.7  # from the second generation on: only then is it asked for an answer
    return toy_plugins.config(episode={"horizon": 0.3}, evolution=short, **PLUGINS[plugin])


def misbehave(plugin: str, method: str, deed: Deed) -> None:
    """Have a method do ``deed`` from now on, until :func:`calm`."""
    _deeds[f"{plugin}.{method}"] = deed


def calm() -> None:
    """Have all methods do what they should."""
    _deeds.clear()


def _done(where: str, sound: Any) -> Any:
    deed = _deeds.get(where)
    return deed(sound) if deed else sound


class Network(toy_plugins.Network):
    def space(self, scene: SceneInfo) -> Any:
        return _done("zoo_network.space", super().space(scene))

    def policies(self, genomes: FloatArray) -> Any:
        return _done("zoo_network.policies", super().policies(genomes))

    def complexity(self, genomes: FloatArray) -> Any:
        return _done("zoo_network.complexity", super().complexity(genomes))


class Linear(toy_plugins.Linear):
    def start(self, genomes: FloatArray) -> None:
        super().start(genomes)
        _done("zoo_linear.start", None)

    def act(self, observations: FloatArray) -> Any:
        return _done("zoo_linear.act", super().act(observations))


class Travel(toy_plugins.Travel):
    @property
    def objectives(self) -> Any:  # type: ignore[override]
        return _done("zoo_travel.objectives", toy_plugins.Travel.objectives)

    @property
    def channels(self) -> Any:  # type: ignore[override]
        return _done("zoo_travel.channels", toy_plugins.Travel.channels)

    def evaluate(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> Any:
        return _done("zoo_travel.evaluate", super().evaluate(telemetry, genomes, controller))


class Places(toy_plugins.Places):
    @property
    def descriptors(self) -> Any:  # type: ignore[override]
        return _done("zoo_places.descriptors", self._sound)

    @descriptors.setter
    def descriptors(self, given: Any) -> None:
        self._sound = given

    def describe(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> Any:
        return _done("zoo_places.describe", super().describe(telemetry, genomes, controller))


class Explained(toy_plugins.Travel):
    def terms(self, telemetry: Telemetry) -> Any:
        way = np.linalg.norm(np.diff(telemetry.pose[..., :2], axis=1, prepend=0.0), axis=-1).mean(axis=-1)
        return _done("zoo_explained.terms", {"way": way})


class Search(toy_plugins.Search):
    def __init__(self, space: GenomeSpace, population: int, objectives: int, rng: np.random.Generator) -> None:
        super().__init__(space, population, objectives, rng)
        _done("zoo_search.factory", None)

    def ask(self) -> Any:
        return _done("zoo_search.ask", super().ask())

    def tell(self, genomes: FloatArray, costs: FloatArray) -> None:
        super().tell(genomes, costs)
        _done("zoo_search.tell", None)

    def state(self) -> Any:
        return _done("zoo_search.state", super().state())

    def restore(self, state: Mapping[str, Any]) -> None:
        super().restore(state)
        _done("zoo_search.restore", None)


class Answering(Search):
    def answer(self) -> Any:
        return _done("zoo_answering.answer", np.zeros((1, self.ask().shape[1])))

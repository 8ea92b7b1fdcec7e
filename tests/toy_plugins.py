# SPDX-License-Identifier: BSD-3-Clause
"""Small plugins, sound and broken ones, and a run of a second or less to try them in."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from swarmevo.config import Config
from swarmevo.protocols import (
    CENSUS_CHANNELS,
    Block,
    Compiled,
    Controller,
    Descriptor,
    FeedForward,
    FloatArray,
    GenomeSpace,
    Objective,
    Problem,
    SceneInfo,
    Telemetry,
)

HIDDEN = 2


def config(**sections: Any) -> Config:
    """Return a configuration of toys: two robots, a horizon of one second; sections update it."""
    base: dict[str, Any] = {
        "episode": {"horizon": 1.0},
        "team": {"robots": 2},
        "controller": "toy_network",
        "fitness": ["toy_travel", "toy_neurons"],
        "optimiser": "toy_search",
        "evolution": {"generations": 3, "population": 4, "trials": 2, "repeats": 2, "seed": 7},
    }
    for name, section in sections.items():
        merge = isinstance(section, dict) and name in ("episode", "team", "evolution")
        base[name] = base[name] | section if merge else section
    return Config.model_validate(base)


def install(distribution: Callable[..., Any]) -> None:
    """Make the toys known, as the distribution ``toys 1.0``."""
    here = __name__
    groups = {
        "swarmevo.controllers": {
            "toy_network": f"{here}:Network",
            "toy_linear": f"{here}:Linear",
            "toy_direct": f"{here}:Direct",
            "toy_bad_controller": f"{here}:BadController",
            "toy_odd_controller": f"{here}:OddController",
        },
        "swarmevo.fitness": {
            "toy_travel": f"{here}:Travel",
            "toy_neurons": f"{here}:Neurons",
            "toy_reach": f"{here}:Reach",
            "toy_places": f"{here}:Places",
            "toy_bad_places": f"{here}:BadPlaces",
            "toy_half_described": f"{here}:half_described",
            "toy_bad_fitness": f"{here}:BadFitness",
        },
        "swarmevo.optimisers": {
            "toy_search": f"{here}:Search",
            "toy_described_search": f"{here}:DescribedSearch",
            "toy_bad_optimiser": f"{here}:BadOptimiser",
        },
    }
    distribution("toys", "1.0", groups)


# ---- controllers -----------------------------------------------------------------------------------------------------


class Network:
    """Two hidden neurons, run by the library."""

    def space(self, scene: SceneInfo) -> GenomeSpace:
        return GenomeSpace(
            (
                Block("input_hidden", (HIDDEN, 14)),
                Block("hidden_output", (2, HIDDEN + 1), unit_axis=1),
                Block("hidden_switch", (HIDDEN,), "switch"),
            )
        )

    def policies(self, genomes: FloatArray) -> Any:
        weights = self._split(genomes)
        return FeedForward(weights["input_hidden"], weights["hidden_output"], weights["hidden_switch"] >= 0.5)

    def complexity(self, genomes: FloatArray) -> FloatArray:
        used: FloatArray = np.sum(self._split(genomes)["hidden_switch"] >= 0.5, axis=1, dtype=np.float64)
        return used

    def _split(self, genomes: FloatArray) -> dict[str, FloatArray]:
        return self.space(SceneInfo(1, 1, 1.0)).split(genomes)


class Direct(Network):
    """Genomes as the parameters of a compiled function, which does not exist."""

    def policies(self, genomes: FloatArray) -> Any:
        return Compiled(function=1, parameters=genomes, memory=3)


class BadController(Network):
    """Makes the policies that ``fault`` names."""

    def __init__(self, fault: str) -> None:
        self._fault = fault

    def policies(self, genomes: FloatArray) -> Any:
        if self._fault == "raises":
            raise KeyError("nobody\nhome")
        if self._fault == "nan":
            return super().policies(np.full_like(genomes, np.nan))
        return {"count": super().policies(genomes[:0]), "type": "none"}[self._fault]


class OddController(Network):
    """Returns what ``fault`` names, which looks like what is wanted."""

    def __init__(self, fault: str) -> None:
        self._fault = fault

    def space(self, scene: SceneInfo) -> GenomeSpace:
        blocks: Any = {
            "scalar block": (Block("gain", ()),),
            "twin blocks": (Block("gain", (1,)), Block("gain", (2,))),
            "no blocks": (),
            "block of text": ("gain",),
        }
        return GenomeSpace(blocks[self._fault]) if self._fault in blocks else super().space(scene)

    def complexity(self, genomes: FloatArray) -> Any:
        found = super().complexity(genomes)
        return {"scalar complexity": 3.0, "column complexity": found[:, np.newaxis]}.get(self._fault, found)

    def policies(self, genomes: FloatArray) -> Any:
        made = super().policies(genomes)
        off = np.zeros((len(genomes), HIDDEN))
        odd: dict[str, dict[str, Any]] = {
            "activation": {"activation": "relu"},
            "switch 0.7": {"hidden_switch": off + 0.7},
            "switch nan": {"hidden_switch": off + np.nan},
            "switch 256": {"hidden_switch": off.astype(np.int64) + 256},
            "switch -1": {"hidden_switch": off.astype(np.int8) - 1},
            "bias": {"bias": 1},
            "complex weights": {"input_hidden": made.input_hidden + 1j},
            "list weights": {"input_hidden": made.input_hidden.tolist()},
        }
        compiled = {"no function": Compiled(0, genomes), "real memory": Compiled(1, genomes, memory=1.5)}  # type: ignore[arg-type]
        return compiled.get(self._fault) or dataclasses.replace(made, **odd.get(self._fault, {}))


class Linear:
    """Sensors to wheels, in Python."""

    def __init__(self, fault: str = "") -> None:
        self._fault = fault

    def space(self, scene: SceneInfo) -> GenomeSpace:
        return GenomeSpace((Block("weights", (2, 13)), Block("bias", (2,))))

    def complexity(self, genomes: FloatArray) -> FloatArray:
        return np.zeros(len(genomes))

    def start(self, genomes: FloatArray) -> None:
        self._weights = genomes[..., :26].reshape(*genomes.shape[:2], 2, 13)
        self._bias = genomes[..., 26:]

    def act(self, observations: FloatArray) -> Any:
        if self._fault == "raises":
            raise KeyError("nobody\nhome")
        if self._fault == "shape":
            return np.zeros(3)
        return np.tanh((self._weights @ observations[..., np.newaxis])[..., 0] + self._bias)


# ---- fitness ---------------------------------------------------------------------------------------------------------


class Travel:
    """How far the team went, and how near its last pose is to the target wall."""

    objectives = (Objective("travel", "maximise", (0.0, 1.0)), Objective("distance", "minimise", (0.0, 1.0)))
    channels = ("pose",)

    def evaluate(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> FloatArray:
        assert set(telemetry.channels) == {"pose"}
        assert not telemetry.pose.flags.writeable
        place = telemetry.pose[..., :2]
        travel = np.linalg.norm(np.diff(place, axis=1), axis=-1).sum(axis=(1, 2))
        return np.stack([travel, 0.5 - place[:, -1, :, 1].mean(axis=1)], axis=1)


class Neurons:
    """How many hidden neurons there are, and some channels nobody needs."""

    objectives = (Objective("neurons", "minimise", (0.0, float(HIDDEN))),)
    channels = ("command", "rf")

    def evaluate(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> FloatArray:
        assert "command" in telemetry.channels
        return controller.complexity(genomes)[:, np.newaxis]


class Reach:
    """Mean x of the robots at the end, of which 0.0 is enough; who is west of that is known by name."""

    channels = ("pose",)

    def __init__(self, success: Any = 0.0, fault: str = "") -> None:
        self.objectives = (Objective("reach", "maximise", (-1.0, 1.0), success=success),)
        self._fault = fault

    def evaluate(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> Any:
        return telemetry.pose[:, -1, :, 0].mean(axis=1, keepdims=True)

    def behaviours(self, telemetry: Telemetry) -> Any:
        assert all(name in telemetry.channels for name in CENSUS_CHANNELS)
        if self._fault == "raises":
            raise RuntimeError("no eyes")
        west = telemetry.pose[:, -1, :, 0] < 0
        bad = {"shape": west[:, :1], "numbers": west + 0.5, "text": "west"}
        return {"in the west": bad.get(self._fault, west), "everybody": np.ones(west.shape)}


class Places:
    """Where the first robot is at the end; no objective."""

    objectives = ()
    channels = ("pose",)

    def __init__(self, scene: SceneInfo) -> None:
        half = scene.world["arena"]["size"] / 2
        self.descriptors: Any = (Descriptor("end_x", (-half, half)), Descriptor("end_y", (-half, half)))

    def evaluate(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> FloatArray:
        return np.empty((len(genomes), 0))

    def describe(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> Any:
        return telemetry.pose[:, -1, 0, :2]


class BadPlaces(Places):
    """Does what ``fault`` names, in every episode or only in those of genomes that begin with a number above 0."""

    def __init__(self, scene: SceneInfo, fault: str, always: bool = True) -> None:
        super().__init__(scene)
        self._fault, self._always = fault, always
        one = Descriptor("end_x", (0.0, 1.0))
        self.descriptors = {
            "no Descriptor": ("end_x",),
            "an Objective": (Objective("end_x", "minimise", (0.0, 1.0)),),
            "twins": (one, one),
            "an objective's name": (Descriptor("travel", (0.0, 1.0)),),
            "a column's name": (Descriptor("push_time", (-1.0, 1.0)),),
            "no range": (Descriptor("end_x", (1.0, 1.0)),),
            "blank": (Descriptor(" ", (0.0, 1.0)),),
            "none": (),
            "not iterable": one,
        }.get(fault, self.descriptors)

    def describe(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> Any:
        sound = super().describe(telemetry, genomes, controller)
        if not self._always and genomes[0, 0] <= 0:
            return sound
        if self._fault == "raises":
            raise KeyError("nobody\nhome")
        return {
            "nan": sound * np.nan,
            "one": sound[:, :1],
            "three": np.ones((1, 3)),
            "vector": sound[0],
            "text": [["left", "right"]],
            "nothing": None,
            "outside": sound + 7,
        }.get(self._fault, sound[:, : len(self.descriptors)])


def half_described(scene: SceneInfo, missing: str) -> Any:
    """Return a fitness that lacks half of what describes."""
    sound = Places(scene)
    names = {"objectives", "channels", "evaluate", "descriptors", "describe"} - {missing}
    return SimpleNamespace(**{name: getattr(sound, name) for name in names})


class BadFitness:
    """Does what ``fault`` names."""

    def __init__(self, fault: str) -> None:
        self._fault = fault
        good = Objective("good", "minimise", (0.0, 1.0))
        self.objectives: Any = {
            "no objective": (),
            "not iterable": good,
            "no Objective": ("good",),
            "direction": (Objective("good", "up", (0.0, 1.0)),),  # type: ignore[arg-type]
            "of": (Objective("good", "minimise", (0.0, 1.0), of="world"),),  # type: ignore[arg-type]
            "range": (Objective("good", "minimise", (1.0, 1.0)),),
            "infinite": (Objective("good", "minimise", (0.0, np.inf)),),
            "no pair": (Objective("good", "minimise", 1.0),),  # type: ignore[arg-type]
            "wide": (Objective("good", "minimise", (0.0, 1e308)),),
            "text range": (Objective("good", "minimise", ("0", "1")),),  # type: ignore[arg-type]
            "name": (Objective(3, "minimise", (0.0, 1.0)),),  # type: ignore[arg-type]
            "blank": (Objective(" ", "minimise", (0.0, 1.0)),),
            "escape": (Objective("\x1b[2J", "minimise", (0.0, 1.0)),),
            "surrogate": (Objective("\udcff", "minimise", (0.0, 1.0)),),
            "other types": (Objective(np.str_("good"), "minimise", np.array([0, 1], np.float32)),),  # type: ignore[arg-type]
            "same name": (Objective("neurons", "minimise", (0.0, 1.0)),),
        }.get(fault, (good,))
        if fault.startswith("named "):
            self.objectives = (Objective(fault.removeprefix("named "), "minimise", (0.0, 1.0)),)
        self.channels: Any = ("sonar",) if fault == "channel" else ()

    def evaluate(self, telemetry: Telemetry, genomes: FloatArray, controller: Controller) -> Any:
        if self._fault == "raises":
            raise KeyError("nobody\nhome")
        return {
            "shape": np.zeros(1),
            "nan": np.array([[np.nan]]),
            "text": [["much"]],
            "none": None,
            "complex": np.array([[0.5 + 1j]]),
            "masked": np.ma.masked_array([[0.5]], [[True]]),
            "huge": [[10**400]],
            "long": np.array([[np.longdouble("1e400")]]),
            "largest": [[1e308]],
            "outside": [[1.001]],
            "below": [[-0.001]],
            "other types": [[np.float32(0.25)]],
        }.get(self._fault, np.zeros((1, 1)))


# ---- optimisers ------------------------------------------------------------------------------------------------------


class Search:
    """Mutants of the best so far, one more of them in each generation. Its state has all that a state may have."""

    def __init__(self, space: GenomeSpace, population: int, objectives: int, rng: np.random.Generator) -> None:
        self._size, self._population, self._rng = space.size, population, rng
        self._best: FloatArray | None = None
        self._least = np.inf
        self._told = 0

    def ask(self) -> Any:
        self._asked = self._rng.standard_normal((self._population + self._told, self._size))
        if self._best is not None:
            self._asked[1:] = self._best + 0.5 * self._asked[1:]
        return self._asked

    def tell(self, genomes: FloatArray, costs: FloatArray) -> None:
        assert not genomes.flags.writeable
        assert not costs.flags.writeable
        self._asked[:] = np.nan  # what was given away is ours to spoil
        leader = int(costs[:, 0].argmin())
        if costs[leader, 0] < self._least:
            self._best, self._least = genomes[leader].copy(), float(costs[leader, 0])
        self._told += 1

    def state(self) -> dict[str, Any]:
        return {"best": self._best, "least": self._least, "told": self._told, "rng": self._rng.bit_generator.state}

    def restore(self, state: Mapping[str, Any]) -> None:
        assert self._told == 0
        self._best, self._least, self._told = state["best"], state["least"], state["told"]
        self._rng.bit_generator.state = state["rng"]


class DescribedSearch(Search):
    """Is told descriptors, and what the problem is."""

    def __init__(
        self, space: GenomeSpace, population: int, objectives: int, rng: np.random.Generator, problem: Problem
    ) -> None:
        super().__init__(space, population, objectives, rng)
        self.problem = problem
        self._described: list[Any] = []

    def tell(self, genomes: FloatArray, costs: FloatArray, descriptors: FloatArray) -> None:  # type: ignore[override]
        assert not descriptors.flags.writeable
        assert descriptors.shape == (len(genomes), len(self.problem.descriptors))
        assert costs.shape == (len(genomes), len(self.problem.objectives))
        super().tell(genomes, costs)
        self._described.append(descriptors)

    def state(self) -> dict[str, Any]:
        return {**super().state(), "described": list(self._described)}

    def restore(self, state: Mapping[str, Any]) -> None:
        super().restore(state)
        self._described = list(state["described"])


class BadOptimiser(Search):
    """Does what ``fault`` names, in generation ``at``."""

    def __init__(
        self,
        space: GenomeSpace,
        population: int,
        objectives: int,
        rng: np.random.Generator,
        *,
        fault: str,
        at: int = 1,
    ) -> None:
        super().__init__(space, population, objectives, rng)
        self._fault, self._at = fault, at

    def ask(self) -> Any:
        genomes = super().ask()
        if self._told != self._at:
            return genomes
        if self._fault == "ask raises":
            raise KeyError("nobody\nhome")
        spoilt = genomes.copy()
        spoilt[1, 2] = np.nan
        return {
            "list": genomes.tolist(),
            "dtype": genomes.astype(np.float32),
            "axes": genomes[0],
            "size": genomes[:, 1:],
            "none": genomes[:0],
            "nan": spoilt,
        }.get(self._fault, genomes)

    def tell(self, genomes: FloatArray, costs: FloatArray) -> None:
        if self._fault == "tell raises" and self._told == self._at:
            raise KeyError("nobody\nhome")
        if self._fault == "tell writes" and self._told == self._at:
            costs[0] = 0.0
        super().tell(genomes, costs)

    def state(self) -> dict[str, Any]:
        if self._fault == "state" and self._told == self._at + 1:
            return {"rng": self._rng}
        return super().state()

    def restore(self, state: Mapping[str, Any]) -> None:
        if self._fault == "restore raises":
            raise KeyError("nobody\nhome")
        super().restore(state)

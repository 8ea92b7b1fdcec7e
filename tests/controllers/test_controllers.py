# SPDX-License-Identifier: BSD-3-Clause
"""Linear and recurrent controllers: their genomes, and what the library makes of them, held against the equations."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import toy_plugins
from swarmevo import plugins
from swarmevo.config import Config
from swarmevo.errors import InvalidArgument
from swarmevo.protocols import FloatArray, Linear, NativeController, NativePolicies, Recurrent, SceneInfo
from swarmevo.runs import driver, verification
from swarmevo.runs.store import Store
from swarmevo.simulation import EpisodeKey, Scene, simulate
from swarmevo.simulation._ffi import load
from swarmevo.simulation.policies import native_policies
from swarmevo.testing import ControllerTests, failures, random_genomes
from swarmevo_controllers.linear import LinearController
from swarmevo_controllers.recurrent import CTRNN, Elman, Jordan

SCENE = SceneInfo(robots=5, control_steps=10, control_period=0.1)
WIDE = SceneInfo(
    robots=5,
    control_steps=10,
    control_period=0.2,
    observation_names=tuple(f"infrared_{i}" for i in range(21)),
    command_names=("left", "right", "bit_0", "bit_1"),
)
STEPS = 30

CONTROLLERS: dict[str, Callable[..., Any]] = {
    "linear": LinearController,
    "elman": Elman,
    "jordan": Jordan,
    "ctrnn": CTRNN,
}
RECURRENT = ["elman", "jordan", "ctrnn"]


# ---- as the conformance kit wants them -------------------------------------------------------------------------------


class TestLinear(ControllerTests):
    def create(self) -> Any:
        return LinearController()


class TestElman(ControllerTests):
    def create(self) -> Any:
        return Elman()


class TestJordan(ControllerTests):
    def create(self) -> Any:
        return Jordan(hidden=1, bias=False, activation="logistic")


class TestCTRNN(ControllerTests):
    def create(self) -> Any:
        return CTRNN()


@pytest.mark.parametrize("kind", CONTROLLERS)
def test_any_number_of_observations_and_commands(kind: str) -> None:
    class Wide(ControllerTests):
        scene = WIDE

        def create(self) -> Any:
            return CONTROLLERS[kind]()

    assert not failures(Wide())
    assert isinstance(CONTROLLERS[kind](), NativeController)


# ---- genomes ---------------------------------------------------------------------------------------------------------


def test_genomes_have_the_blocks_of_the_documentation() -> None:
    def shapes(controller: Any, scene: SceneInfo) -> dict[str, tuple[int, ...]]:
        return {block.name: block.shape for block in controller.space(scene).blocks}

    assert shapes(LinearController(), SCENE) == {"input_output": (2, 14)}
    assert shapes(LinearController(bias=False), WIDE) == {"input_output": (4, 21)}
    layers = {"input_hidden": (3, 14), "hidden_output": (2, 4), "hidden_switch": (3,)}
    assert shapes(Elman(3), SCENE) == layers | {"context_hidden": (3, 3)}
    assert shapes(Jordan(3), SCENE) == layers | {"context_hidden": (3, 2)}
    assert shapes(CTRNN(3), SCENE) == layers | {"context_hidden": (3, 3), "time_constant": (3,)}
    assert shapes(Jordan(3, bias=False), WIDE) == {
        "input_hidden": (3, 21),
        "context_hidden": (3, 4),
        "hidden_output": (4, 3),
        "hidden_switch": (3,),
    }


def test_a_hidden_neuron_mutates_as_a_whole_and_crosses_over_in_two_links() -> None:
    space = CTRNN(hidden=4).space(SCENE)
    unit, link = (space.split(numbers) for numbers in (space.unit_of, space.link_of))
    for h in range(4):
        for inputs in ("input_hidden", "context_hidden", "time_constant"):
            assert np.all(unit[inputs][h] == unit["hidden_switch"][h])
            assert np.all(link[inputs][h] == link["hidden_switch"][h])
        assert np.all(unit["hidden_output"][:, h] == unit["hidden_switch"][h])
        assert np.all(link["hidden_output"][:, h] != link["hidden_switch"][h])


def test_complexity_counts_hidden_neurons_that_are_on() -> None:
    for kind in RECURRENT:
        controller = CONTROLLERS[kind](hidden=3)
        space = controller.space(SCENE)
        genomes = np.zeros((3, space.size))
        genomes[:, space.is_switch] = [[0, 0, 0], [1, 1, 1], [0.5, 0.49, 1]]
        np.testing.assert_array_equal(controller.complexity(genomes), [0, 3, 2])
    np.testing.assert_array_equal(LinearController().complexity(np.ones((2, 28))), [0, 0])


def test_any_gene_is_a_time_constant_within_the_range() -> None:
    controller = CTRNN(hidden=6, time_constants=(0.2, 5.0))
    space = controller.space(SCENE)
    genomes = np.zeros((1, space.size))
    genes = np.array([-1e308, -2.0, 0.0, 2.0, 40.0, 1e308])
    space.split(genomes)["time_constant"][0] = genes
    made = controller.policies(genomes).time_constants
    assert made is not None
    expected = [0.2, 0.2 * 25 ** (1 / (1 + math.e**2)), 1.0, 0.2 * 25 ** (1 / (1 + math.e**-2)), 5.0, 5.0]
    np.testing.assert_allclose(made[0], expected, rtol=1e-12)


@pytest.mark.parametrize("kind", CONTROLLERS)
def test_genomes_of_another_size_are_refused(kind: str) -> None:
    controller = CONTROLLERS[kind]()
    with pytest.raises(ValueError, match=r"^genomes: expected space\(scene\) to be asked for first"):
        controller.policies(np.zeros((1, 3)))
    size = controller.space(SCENE).size
    with pytest.raises(ValueError, match=f"expected {size} entries along the last axis, got 3"):
        controller.policies(np.zeros((1, 3)))


@pytest.mark.parametrize(
    ("kind", "options", "message"),
    [
        ("linear", {"bias": 1}, "bias: expected true or false, got 1"),
        ("linear", {"activation": "relu"}, "activation: expected one of identity, tanh, logistic, got 'relu'"),
        ("elman", {"hidden": 0}, "hidden: expected a whole number from 1 to 1024, got 0"),
        ("jordan", {"hidden": True}, "hidden: expected a whole number from 1 to 1024, got True"),
        ("elman", {"bias": None}, "bias: expected true or false, got None"),
        ("jordan", {"activation": "identity"}, "activation: expected one of tanh, logistic, got 'identity'"),
        ("ctrnn", {"reach": -1.0}, "reach: expected a number of at least 0, got -1.0"),
        ("ctrnn", {"reach": math.nan}, "reach: expected a number of at least 0, got nan"),
        ("ctrnn", {"integration": "rk4"}, "integration: expected one of exponential, euler, got 'rk4'"),
        *(
            ("ctrnn", {"time_constants": given}, f"time_constants: expected two numbers of seconds above 0, {rest}")
            for given, rest in [
                ((0.0, 1.0), "the shortest and the longest, got [0.0, 1.0]"),
                ((1e-300, 1e300), "the shortest and the longest, got [1e-300, 1e+300]"),
                ((2.0, 1.0), "the shortest and the longest, got [2.0, 1.0]"),
                ((1.0, math.inf), "the shortest and the longest, got [1.0, inf]"),
            ]
        ),
    ],
)
def test_wrong_options_are_one_clear_line(kind: str, options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        CONTROLLERS[kind](**options)


def test_a_step_of_eulers_wants_no_time_constant_below_the_control_period() -> None:
    controller = CTRNN(integration="euler")
    controller.space(SCENE)
    with pytest.raises(ValueError, match=r"^time_constants: expected none below the control period of 0\.2 s with"):
        controller.space(WIDE)


# ---- equations -------------------------------------------------------------------------------------------------------


def act(policies: NativePolicies, observations: FloatArray, scene: SceneInfo) -> Iterator[FloatArray]:
    """Yield the library's commands ``(steps, commands)`` for ``observations`` ``(steps, observations)``, of each."""
    ffi, _ = load()
    made, _alive = native_policies(policies, scene)
    for policy in made:
        memory, commands = np.zeros(policy.memory), np.empty((len(observations), scene.commands))
        for x, command in zip(observations, commands, strict=True):
            pointers = (ffi.from_buffer("double[]", array) for array in (x, memory, command))
            policy.function(policy.parameters, *pointers)
        yield commands


def logistic(x: FloatArray) -> FloatArray:
    y: FloatArray = 1 / (1 + np.exp(-x))
    return y


HIDDEN: dict[str, Callable[[FloatArray], FloatArray]] = {"tanh": np.tanh, "logistic": logistic}
OUTPUT: dict[str, Callable[[FloatArray], FloatArray]] = {
    "identity": lambda x: x,
    "tanh": np.tanh,
    "logistic": lambda x: 2 * logistic(x) - 1,
}


def by_the_equations(kind: str, genes: dict[str, FloatArray], options: dict[str, Any], x: FloatArray, dt: float) -> Any:
    """Return ``(steps, commands)``: one network as docs/controllers.md writes it, on columns."""
    f, g, bias = HIDDEN.get(options["activation"]), OUTPUT[options["activation"]], options["bias"]

    def with_bias(weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        return (weights[:, :-1], weights[:, -1]) if bias else (weights, np.zeros(len(weights)))

    if kind == "linear":
        w, b = with_bias(genes["input_output"])
        return np.array([g(w @ now + b) for now in x])
    assert f is not None
    on = genes["hidden_switch"] >= 0.5
    w, theta = with_bias(genes["input_hidden"])
    v, b = with_bias(genes["hidden_output"])
    r, commands = genes["context_hidden"], []
    y = h = np.zeros(len(on))
    o = np.zeros(len(v))
    for now in x:
        if kind == "elman":
            h = on * f(w @ now + r @ h + theta)
        elif kind == "jordan":
            h = on * f(w @ now + r @ o + theta)
        else:
            shortest, longest = options["time_constants"]
            tau = shortest * (longest / shortest) ** logistic(genes["time_constant"])
            heard = w @ now + r @ (on * f(y + theta))
            if options["integration"] == "euler":
                y = y + dt / tau * (heard - y)
            else:
                y = heard + np.exp(-dt / tau) * (y - heard)
            h = on * f(y + theta)
        o = g(v @ h + b)
        commands.append(o)
    return np.array(commands)


@pytest.mark.parametrize("scene", [SCENE, WIDE], ids=["paper", "wide"])
@pytest.mark.parametrize("bias", [True, False])
@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("linear", {"activation": "identity"}),
        ("linear", {"activation": "tanh"}),
        ("linear", {"activation": "logistic"}),
        *((kind, {"activation": name, "hidden": 6}) for kind in RECURRENT[:2] for name in HIDDEN),
        *(
            ("ctrnn", {"activation": name, "hidden": 6, "time_constants": (0.2, 4.0), "integration": how})
            for name in HIDDEN
            for how in ("exponential", "euler")
        ),
    ],
    ids=str,
)
def test_the_library_computes_the_equations(kind: str, options: dict[str, Any], bias: bool, scene: SceneInfo) -> None:
    options = {**options, "bias": bias}
    controller = CONTROLLERS[kind](**options)
    space = controller.space(scene)
    genomes = random_genomes(space, 4)
    x = np.random.default_rng(3).random((STEPS, scene.observations))
    found = list(act(controller.policies(genomes), x, scene))
    for genome, commands in zip(genomes, found, strict=True):
        expected = by_the_equations(kind, space.split(genome), options, x, scene.control_period)
        np.testing.assert_allclose(commands, expected, rtol=0, atol=1e-8)  # differences in the last bit grow


def test_an_exponential_step_is_exact_while_the_input_stands_still() -> None:
    """One neuron that hears nothing but the sensors: y(t) = I (1 - exp(-t / tau)), whatever the control period."""
    tau, weight, end = 0.7, 1.5, 2.0
    for period in (0.05, 0.1, 0.4):
        scene = SceneInfo(robots=1, control_steps=1, control_period=period)
        inputs, outputs = np.zeros((1, 1, 13)), np.zeros((1, 2, 1))
        inputs[0, 0, 0], outputs[0, :, 0] = weight, 1.0
        one = Recurrent(
            "ctrnn", inputs, np.zeros((1, 1, 1)), outputs, np.ones((1, 1), bool), np.array([[tau]]), bias=False
        )
        steps = round(end / period)
        (commands,) = act(one, np.ones((steps, 13)), scene)
        assert commands[-1, 0] == pytest.approx(np.tanh(np.tanh(weight * (1 - math.exp(-end / tau)))), abs=1e-12)


# ---- episodes --------------------------------------------------------------------------------------------------------


def short(**sections: Any) -> Config:
    return Config.model_validate({"episode": {"horizon": 2.0}, "team": {"robots": 3}} | sections)


@pytest.mark.parametrize("kind", RECURRENT)
def test_memory_is_each_robots_own_and_empty_when_an_episode_starts(kind: str) -> None:
    """Every robot's commands follow from what it alone has observed since the start, episode after episode."""
    scene = Scene(short(noise={"wheels": 0.0}))
    controller = CONTROLLERS[kind](hidden=4)
    genomes = random_genomes(controller.space(scene.info), 2)
    policies = controller.policies(genomes)
    done = simulate(
        scene, policies, [EpisodeKey(1, 0, 0, i) for i in range(2)], None, ["infrared", "touch", "rf", "command"]
    )
    strongest = scene.info.world["emitter"]["strength"][1]
    seen = done.telemetry
    x = np.concatenate([seen.infrared, seen.touch, seen.rf[..., np.newaxis] / strongest], axis=-1)
    for episode in range(2):
        one = controller.policies(genomes[episode : episode + 1])
        for robot in range(3):
            (commands,) = act(one, np.ascontiguousarray(x[episode, :, robot]), scene.info)
            np.testing.assert_allclose(seen.command[episode, :, robot], commands, rtol=0, atol=1e-9)


@pytest.mark.parametrize("kind", CONTROLLERS)
def test_a_scene_with_other_sensors(kind: str) -> None:
    sensors = {"infrared_yaw_deg": [30.0, 0.0, -30.0]}
    scene = Scene(short(robot={"sensors": ["rf", "infrared"]}, sensors=sensors))
    controller = CONTROLLERS[kind]()
    policies = controller.policies(random_genomes(controller.space(scene.info), 1))
    inputs = policies.input_output if isinstance(policies, Linear) else policies.input_hidden
    assert inputs.shape[2] == 4 + 1
    assert simulate(scene, policies, [EpisodeKey(1, 0, 0, 0)]).status.tolist() == [0]


def test_what_does_not_fit_the_scene_is_refused() -> None:
    scene, keys = Scene(short()), [EpisodeKey(1, 0, 0, 0)]
    controller = Elman(hidden=2)
    controller.space(WIDE)
    too_wide = controller.policies(np.zeros((1, controller.space(WIDE).size)))
    with pytest.raises(
        InvalidArgument, match=r"input_hidden: expected an array of shape \(1, 2, 14\), got \(1, 2, 22\)"
    ):
        simulate(scene, too_wide, keys)
    with pytest.raises(
        InvalidArgument, match=r"input_output: expected an array of shape \(1, 2, 14\), got \(1, 2, 13\)"
    ):
        simulate(scene, Linear(np.zeros((1, 2, 13))), keys)
    with pytest.raises(InvalidArgument, match="activation: expected identity, tanh or logistic, got 'relu'"):
        simulate(scene, Linear(np.zeros((1, 2, 14)), activation="relu"), keys)  # type: ignore[arg-type]
    sound = CTRNN(hidden=2)
    genomes = np.zeros((1, sound.space(SCENE).size))
    given: dict[str, Any] = {name: getattr(sound.policies(genomes), name) for name in Recurrent.__dataclass_fields__}
    for change, message in [
        ({"recurrence": "lstm"}, "recurrence: expected elman, jordan or ctrnn, got 'lstm'"),
        ({"integration": 1}, "integration: expected exponential or euler, got 1"),
        ({"time_constants": None}, "time_constants: expected an array of shape"),
        ({"time_constants": np.zeros((1, 2))}, "time_constants: expected finite numbers of seconds, above 0, got 0"),
        ({"time_constants": np.full((1, 2), 0.05), "integration": "euler"}, "at least the control period of 0.1"),
        ({"recurrence": "elman"}, "time_constants: expected None for elman; only ctrnn has them"),
        ({"context_hidden": np.zeros((1, 2, 3))}, "context_hidden: expected an array of shape"),
        ({"hidden_switch": np.ones((1, 2))}, "hidden_switch: expected booleans"),
    ]:
        with pytest.raises(InvalidArgument, match=re.escape(message)):
            simulate(scene, Recurrent(**given | change), keys)


# ---- evolution -------------------------------------------------------------------------------------------------------


@pytest.fixture
def _toys(distribution: Callable[..., Any]) -> None:
    toy_plugins.install(distribution)


@pytest.mark.usefixtures("_toys")
@pytest.mark.parametrize("optimiser", ["pde", "cma"])
@pytest.mark.parametrize("kind", CONTROLLERS)
def test_it_evolves_and_is_verified_and_resumed(kind: str, optimiser: str, tmp_path: Path) -> None:
    """A run that was left after two generations ends with the bits of one that was not."""
    options: dict[str, Any] = {"cma": {"weights": [1.0, 1.0, 0.0]}} if optimiser == "cma" else {"pde": {}}
    settings = toy_plugins.config(
        controller=kind,
        fitness=["toy_travel", "hidden_neurons"],
        optimiser=options,
        evolution={"trials": 1, "generations": 4},
    )
    whole, cut = (driver.begin(tmp_path / name, settings) for name in ("whole", "cut"))

    class Enough(Exception):  # noqa: N818 - no error
        pass

    def leave_after_two(progress: Any) -> None:
        with Store.open(cut) as store:
            if store.generations(0) == 2:
                raise Enough

    with Store.open(cut, readonly=False) as store, pytest.raises(Enough):
        driver.evolve(store, 1, leave_after_two)
    hashes = []
    for folder in (whole, cut):
        with Store.open(folder, readonly=False) as store:
            driver.evolve(store, 1, lambda progress: None)
            assert store.generations(0) == 4
            hashes.append([store.generation(0, number).episodes["hash"].tolist() for number in range(4)])
            assert verification.verify(store, 1).is_sound
    assert hashes[0] == hashes[1]


@pytest.mark.usefixtures("_toys")
def test_an_impossible_step_of_eulers_is_refused_before_a_run() -> None:
    settings = toy_plugins.config(
        controller={"ctrnn": {"integration": "euler", "time_constants": [0.05, 1.0]}}, fitness="hidden_neurons"
    )
    (line,) = plugins.option_errors(settings)
    assert line.startswith("controller.ctrnn")
    assert "time_constants: expected none below the control period of 0.1 s" in line


def test_optimisers_are_told_the_bounds_of_a_ctrnn() -> None:
    space = CTRNN(hidden=2, reach=3.0).space(SCENE)
    assert [block.bounds for block in space.blocks] == [
        None if b.kind == "switch" else (-3.0, 3.0) for b in space.blocks
    ]
    assert space.blocks[-1].name == "time_constant"
    for unbounded in (CTRNN(reach=0), Elman(), Jordan()):
        assert np.isinf(unbounded.space(SCENE).bounds).all()
    optimiser = plugins.create("optimiser", "pde", {}, space, 20, 2, np.random.default_rng(1))
    genes = optimiser.ask()[:, ~space.is_switch]
    assert 2.5 < np.abs(genes).max() <= 3

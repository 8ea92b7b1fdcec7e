# SPDX-License-Identifier: BSD-3-Clause
"""A conformance kit for authors of plugins: what every optimiser, controller and fitness must do.

In a test file of the plugin, inherit the tests and say how the plugin is made; pytest finds the rest::

    from swarmevo.testing import OptimiserTests

    class TestHillClimber(OptimiserTests):
        def create(self, space, population, objectives, rng):
            return HillClimber(space, population, objectives, rng, spread=0.1)

Without pytest, ``failures(TestHillClimber())`` runs the tests and returns what went wrong.
"""

from __future__ import annotations

import inspect
import itertools
import json
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, get_args, get_type_hints

import numpy as np

from swarmevo import config, returned
from swarmevo.config import Config, Episode, Team
from swarmevo.protocols import (
    CENSUS_CHANNELS,
    CHANNELS,
    AnsweringOptimiser,
    Block,
    BoolArray,
    Channel,
    Compiled,
    Controller,
    DescribingFitness,
    Descriptor,
    Fitness,
    FloatArray,
    GenomeSpace,
    Linear,
    NativeController,
    NativePolicies,
    Objective,
    Optimiser,
    Problem,
    PythonController,
    Recurrent,
    SceneInfo,
    StartableOptimiser,
    Step,
    StepwiseFitness,
    Telemetry,
    WatchingFitness,
    takes_descriptors,
)

Array = TypeVar("Array", bound=np.ndarray[Any, Any])

CHROMOSOME = GenomeSpace(
    (
        Block("input_hidden", (4, 3), units="hidden", linked="input"),
        Block("hidden_output", (2, 5), unit_axis=1, units="hidden", linked="output"),
        Block("hidden_switch", (4,), "switch", units="hidden", linked="input"),
    )
)
"""A small network, as the built-in controller lays it out."""

BOUNDED = GenomeSpace(
    (Block("weights", (3,)), Block("delays", (2,), bounds=(0.5, 4.0)), Block("gain", (1,), bounds=(0, np.inf)))
)
"""A space with genes that have bounds."""
SPACES = (CHROMOSOME, GenomeSpace((Block("weights", (7,)),)), CHROMOSOME.tile(2), BOUNDED)
"""Genomes that an optimiser must be able to drive: with and without switches, of a team, and with bounds."""


def failures(tests: object) -> list[str]:
    """Run every ``test_`` method of ``tests`` and return one line for each that fails."""
    lines = []
    for name in sorted(name for name in dir(tests) if name.startswith("test_")):
        try:
            getattr(tests, name)()
        except Exception as error:
            lines.append(f"{name}: {error or type(error).__name__}")
    return lines


def random_genomes(space: GenomeSpace, n: int, seed: int = 0) -> FloatArray:
    """Return ``(n, size)``: real genes from N(0, 1), or anywhere between their bounds; switches on or off."""
    rng = np.random.default_rng(seed)
    genomes = rng.standard_normal((n, space.size))
    genomes[:, space.is_switch] = rng.random((n, int(space.is_switch.sum()))) < 0.5
    low, high = space.bounds
    between = np.isfinite(low) & np.isfinite(high)
    genomes[:, between] = rng.uniform(low[between], high[between], (n, int(between.sum())))
    within: FloatArray = np.clip(genomes, low, high)
    return within


def scene_of(robots: int, control_steps: int) -> SceneInfo:
    """Return the default scene with so many robots and control steps of 0.1 s."""
    return config.scene_info(Config(team=Team(robots=robots), episode=Episode(horizon=0.1 * control_steps)))


def scene_in(source: str | Path | Config, control_steps: int = 200) -> SceneInfo:
    """Return the scene of a configuration, for plugins that are for certain worlds, with so many control steps.

    Args:
        source: A YAML file, the name of a packaged configuration, or a configuration.
        control_steps: Of an episode.

    Raises:
        ConfigError: With everything that is wrong.
    """
    chosen = source if isinstance(source, Config) else config.load(source)
    period = config.scene_info(chosen).control_period
    return config.scene_info(config.changed(chosen, [f"episode.horizon={control_steps * period!r}"]))


def random_telemetry(
    channels: Sequence[str],
    episodes: int,
    steps: int = 20,
    robots: int = 5,
    seed: int = 0,
    scene: SceneInfo | None = None,
) -> Telemetry:
    """Return telemetry of no real episode, every value in its range; without the channels not asked for.

    Its world is the default one with so many ``robots`` and ``steps`` of 0.1 s, or that of ``scene``.
    """
    rng, scene = np.random.default_rng(seed), scene or scene_of(robots, steps)
    steps, period = scene.control_steps, scene.control_period

    def draw(channel: Channel) -> FloatArray:
        values = rng.uniform(channel.low, channel.high, size=(episodes, steps, *channel.sizes(scene)))
        return np.round(values) if channel.is_flag else values

    def some_time(*shape: int) -> FloatArray:
        return np.where(rng.random(shape) < 0.5, np.nan, rng.uniform(0.0, period * steps, shape))

    recorded = {name: _frozen(draw(CHANNELS[name])) for name in channels}
    return Telemetry(
        period,
        _frozen(some_time(episodes, scene.robots)),
        _frozen(some_time(episodes)),
        channels=recorded,
        world=scene.world,
    )


# ---- optimisers ------------------------------------------------------------------------------------------------------


class Case(NamedTuple):
    """What an optimiser is created for."""

    space: GenomeSpace
    population: int
    objectives: int
    descriptors: int

    @property
    def problem(self) -> Problem:
        """Objectives and descriptors in whose ranges all is that these tests tell."""
        return Problem(
            tuple(Objective(f"objective_{i}", "minimise", (0.0, 100.0)) for i in range(self.objectives)),
            tuple(Descriptor(f"descriptor_{i}", (-1.0, 1.0)) for i in range(self.descriptors)),
        )


class OptimiserTests:
    """Tests that every optimiser must pass. Override :meth:`create`, and what the optimiser is meant for."""

    spaces: Sequence[GenomeSpace] = SPACES
    populations: Sequence[int] = (4, 5, 30)
    objectives: Sequence[int] = (1, 2, 3)
    descriptors: Sequence[int] = (0, 2)
    """Of an optimiser whose ``tell`` takes them; all others are told none."""

    def create(self, space: GenomeSpace, population: int, objectives: int, rng: np.random.Generator) -> Optimiser:
        """Return a new optimiser. An override with a fifth parameter, ``problem``, gets a :class:`Problem` there."""
        raise NotImplementedError("create: expected an override that returns the optimiser to test")

    def test_has_the_methods_of_an_optimiser(self) -> None:
        """It has ask, tell, state and restore."""
        optimiser = self._create(Case(self.spaces[0], self.populations[0], self.objectives[0], self.descriptors[-1]))
        _require(isinstance(optimiser, Optimiser), "optimiser: expected the methods ask, tell, state and restore")

    def test_asks_for_genomes(self) -> None:
        """It asks for at least one genome of the right length, every gene a finite float64 within its bounds."""
        for case in self._cases():
            _run(self._create(case), case, random_costs, 4)

    def test_same_rng_same_run(self) -> None:
        """The same RNG and the same costs give the same genomes, ties among the costs or not."""
        for case in self._cases():
            for costs in COSTS:
                one, two = (_run(self._create(case), case, costs, 6) for _ in range(2))
                _require_equal_runs(one, two, f"a second run from the same RNG, with {_title(costs)}")

    def test_continues_from_its_state(self) -> None:
        """A fresh optimiser with another RNG continues from a state that went through JSON."""
        for case in self._cases():
            for costs in COSTS:
                interrupted = self._create(case)
                _run(interrupted, case, costs, 3)
                stored = _to_json(interrupted.state())
                expected = _run(interrupted, case, costs, 4, start=3)
                resumed = self._create(case, seed=2)
                resumed.restore(_from_json(stored))
                continued = _run(resumed, case, costs, 4, start=3)
                _require_equal_runs(expected, continued, f"the run continued from a state, with {_title(costs)}")

    def test_state_before_the_first_generation(self) -> None:
        """A state taken before anything was asked restores a run from its start."""
        for case in self._cases():
            optimiser = self._create(case)
            stored = _to_json(optimiser.state())
            resumed = self._create(case, seed=2)
            resumed.restore(_from_json(stored))
            one, two = (_run(each, case, random_costs, 3) for each in (optimiser, resumed))
            _require_equal_runs(one, two, "the run restored to its start")

    def test_state_is_a_snapshot(self) -> None:
        """A state does not change while the run goes on."""
        for case in self._cases():
            optimiser = self._create(case)
            _run(optimiser, case, random_costs, 2)
            state = optimiser.state()
            before = _to_json(state)
            _run(optimiser, case, random_costs, 2, start=2)
            _require(_to_json(state) == before, "state: expected a copy, but it changed while the run went on")

    def test_leaves_the_callers_arrays_alone(self) -> None:
        """It neither writes to the arrays it is told nor relies on what becomes of them afterwards."""
        for case in self._cases():
            expected = _run(self._create(case), case, random_costs, 4)
            optimiser = self._create(case)
            for generation, genomes in enumerate(expected):
                asked, told = optimiser.ask(), _frozen(genomes.copy())
                told_with = [_frozen(array) for array in _told(optimiser, case, random_costs, genomes, generation)]
                _require(np.array_equal(asked, genomes), "ask, tell: expected copies, but a caller's array is in use")
                optimiser.tell(told, *told_with)
                for array in (asked, told, *told_with):
                    _scribble(array)

    def test_uses_no_other_randomness(self) -> None:
        """It leaves the global RNGs of Python and NumPy alone."""
        for case in self._cases():
            before = random.getstate(), _to_json(np.random.get_state(legacy=False))
            _run(self._create(case), case, random_costs, 3)
            after = random.getstate(), _to_json(np.random.get_state(legacy=False))
            _require(before == after, "rng: expected no randomness but the generator's, but a global RNG was used")

    def test_answers_without_a_trace(self) -> None:
        """Its answer, if it has one, is genomes, the same in a restored run; asking for it changes nothing."""
        for case in self._cases():
            optimiser, resumed, unasked = self._create(case), self._create(case, seed=2), self._create(case)
            if not isinstance(optimiser, AnsweringOptimiser) or not isinstance(resumed, AnsweringOptimiser):
                return
            for generation in range(3):
                stored, answer = _to_json(optimiser.state()), optimiser.answer()
                _require_array("answer", answer, (None, case.space.size))
                _returned("answer", returned.check_bounds, answer, case.space)
                resumed.restore(_from_json(stored))
                _require(np.array_equal(resumed.answer(), answer), "answer: expected the same from a restored run")
                _scribble(answer)
                _require(_to_json(optimiser.state()) == stored, "answer: expected it to change nothing, but it did")
                one, two = (_run(each, case, random_costs, 1, generation) for each in (optimiser, unasked))
                _require_equal_runs(one, two, "a run that was not asked for its answer")

    def test_begins_from_given_genomes(self) -> None:
        """If it can begin from given genomes, they make a difference, and the run is restored from its start, too."""
        for case in self._cases():
            for k in (1, 3):
                optimiser, resumed, other = self._create(case), self._create(case, seed=2), self._create(case)
                if not isinstance(optimiser, StartableOptimiser):
                    return
                given = _frozen(np.clip(3 + random_genomes(case.space, k, seed=5), *case.space.bounds))
                optimiser.start_from(given)
                _scribble(given)
                resumed.restore(_from_json(_to_json(optimiser.state())))
                begun, again, random = (_run(each, case, random_costs, 3) for each in (optimiser, resumed, other))
                _require_equal_runs(begun, again, "the run restored to its start from given genomes")
                differs = not np.array_equal(begun[0], random[0])
                _require(differs, "start_from: expected other genomes than those of a run from its own, got the same")

    def _create(self, case: Case, seed: int = 1) -> Optimiser:
        create: Callable[..., Optimiser] = self.create
        takes_problem = "problem" in inspect.signature(create).parameters
        more = {"problem": case.problem} if takes_problem else {}
        rng = np.random.Generator(np.random.PCG64(seed))
        return create(case.space, case.population, case.objectives, rng, **more)

    def _cases(self) -> Iterator[Case]:
        first = Case(self.spaces[0], self.populations[0], self.objectives[0], self.descriptors[-1])
        descriptors = self.descriptors if takes_descriptors(self._create(first)) else (0,)
        for sizes in itertools.product(self.spaces, self.populations, self.objectives, descriptors):
            yield Case(*sizes)


Costs = Callable[[FloatArray, int, int], FloatArray]
"""``costs(genomes, objectives, generation) -> (n, objectives)``"""


def random_costs(genomes: FloatArray, objectives: int, generation: int) -> FloatArray:
    """Return noisy costs without ties."""
    noise = np.random.default_rng(generation).random((len(genomes), objectives))
    return np.add(np.mean(np.abs(genomes), axis=1, keepdims=True), noise)


def integer_costs(genomes: FloatArray, objectives: int, generation: int) -> FloatArray:
    """Return whole numbers, many of them equal."""
    return np.stack([np.floor(2 * np.abs(genomes[:, i])) for i in range(objectives)], axis=1)


def constant_costs(genomes: FloatArray, objectives: int, generation: int) -> FloatArray:
    """Return zeros: any order that is not decided by the optimiser itself shows."""
    return np.zeros((len(genomes), objectives))


COSTS: tuple[Costs, ...] = (random_costs, integer_costs, constant_costs)


def descriptors_of(genomes: FloatArray, descriptors: int, generation: int) -> FloatArray:
    """Return ``(n, descriptors)`` in [-1, 1]; the last genome failed in all its episodes in every other generation."""
    described = np.tanh(genomes[:, :descriptors])
    if generation % 2:
        described[-1] = np.nan
    return described


def _told(optimiser: Optimiser, case: Case, costs: Costs, genomes: FloatArray, generation: int) -> list[FloatArray]:
    """Return what an optimiser is told of its genomes: costs, and descriptors if it takes them."""
    told = [costs(genomes, case.objectives, generation)]
    return [*told, descriptors_of(genomes, case.descriptors, generation)] if takes_descriptors(optimiser) else told


def _run(optimiser: Optimiser, case: Case, costs: Costs, n: int, start: int = 0) -> list[FloatArray]:
    """Drive ``optimiser`` for ``n`` generations and return what it asked for, each ``(any, size)``."""
    asked = []
    for generation in range(start, start + n):
        genomes = optimiser.ask()
        _require_array("ask", genomes, (None, case.space.size))
        _require(len(genomes) >= 1, "ask: expected at least one genome, got none")
        _returned("ask", returned.check_bounds, genomes, case.space)
        asked.append(genomes.copy())
        optimiser.tell(genomes, *_told(optimiser, case, costs, genomes, generation))
    return asked


def _require_equal_runs(expected: list[FloatArray], got: list[FloatArray], what: str) -> None:
    for i, (one, two) in enumerate(zip(expected, got, strict=True)):
        _require(np.array_equal(one, two), f"ask: expected the same genomes from {what}; the call {i + 1} differs")


def _title(costs: Costs) -> str:
    return str(getattr(costs, "__name__", costs)).replace("_", " ")


# ---- controllers -----------------------------------------------------------------------------------------------------


class ControllerTests:
    """Tests that every controller must pass. Override :meth:`create`."""

    scene = scene_of(robots=5, control_steps=20)

    def create(self) -> Controller:
        """Return a new controller."""
        raise NotImplementedError("create: expected an override that returns the controller to test")

    def test_has_the_methods_of_a_controller(self) -> None:
        """It is a controller, and either a native or a Python one."""
        controller = self.create()
        _require(isinstance(controller, Controller), "controller: expected the methods space and complexity")
        kinds = isinstance(controller, NativeController) + isinstance(controller, PythonController)
        _require(kinds == 1, "controller: expected either policies(), or start() and act()")

    def test_lays_out_a_genome(self) -> None:
        """Its space has well-formed blocks, and is the same whenever it is asked."""
        space = _returned("space", returned.space, self.create().space(self.scene))
        _require(self.create().space(self.scene) == space, "space: expected the same space in every call")

    def test_tells_complexity(self) -> None:
        """Complexity is a finite number for each genome, whatever genomes stand beside it."""
        controller, genomes = self._controller_and_genomes(6)
        complexity = controller.complexity(genomes)
        _require_array("complexity", complexity, (6,))
        _require(bool(np.all(complexity >= 0)), "complexity: expected no negative number")
        single = np.concatenate([controller.complexity(genomes[i : i + 1]) for i in range(6)])
        _require(np.array_equal(complexity, single), "complexity: expected the same for a genome on its own")

    def test_makes_native_policies(self) -> None:
        """A native controller makes one sound policy of each genome, whatever genomes stand beside it."""
        controller, genomes = self._controller_and_genomes(6)
        if not isinstance(controller, NativeController):
            return
        policies = controller.policies(genomes)
        _require(len(policies) == 6, f"policies: expected one for each of 6 genomes, got {len(policies)}")
        _require_sound_policies(policies, self.scene)
        single = np.concatenate([_parameters(controller.policies(genomes[i : i + 1])) for i in range(6)])
        _require(np.array_equal(_parameters(policies), single), "policies: expected the same for a genome on its own")

    def test_acts(self) -> None:
        """A Python controller's commands have their shape and range."""
        for commands in self._act(worlds=slice(None)):
            _require_array("act", commands, (4, self.scene.robots, self.scene.commands))
            _require(bool(np.all(np.abs(commands) <= 1)), "act: expected commands in [-1, 1]")

    def test_acts_the_same_in_every_batch(self) -> None:
        """A world's commands do not depend on the worlds beside it: results must not depend on the chunking."""
        everybody = self._act(worlds=slice(None))
        for world in range(4):
            alone = self._act(worlds=slice(world, world + 1))
            same = all(np.array_equal(one[world : world + 1], two) for one, two in zip(everybody, alone, strict=True))
            _require(same, "act: expected the same bits for a world on its own")

    def test_start_forgets(self) -> None:
        """An episode does not depend on the one before."""
        controller, _ = self._controller_and_genomes(1)
        first, second = (self._act(worlds=slice(None), controller=controller) for _ in range(2))
        same = all(np.array_equal(one, two) for one, two in zip(first, second, strict=True))
        _require(same, "start: expected it to forget the episode before")

    def _controller_and_genomes(self, n: int) -> tuple[Controller, FloatArray]:
        controller = self.create()
        return controller, _frozen(random_genomes(controller.space(self.scene), n))

    def _act(self, worlds: slice, controller: Controller | None = None) -> list[FloatArray]:
        """Return the commands of an episode in some of four worlds; none if the controller is not a Python one."""
        controller = controller or self.create()
        if not isinstance(controller, PythonController):
            return []
        space, robots = controller.space(self.scene), self.scene.robots
        genomes = random_genomes(space, 4 * robots).reshape(4, robots, space.size)
        observations = np.random.default_rng(0).random((self.scene.control_steps, 4, robots, self.scene.observations))
        controller.start(_frozen(genomes[worlds].copy()))
        return [controller.act(_frozen(step[worlds].copy())).copy() for step in observations]


def _require_sound_policies(policies: NativePolicies, scene: SceneInfo) -> None:
    if isinstance(policies, Compiled):
        _require(policies.function != 0, "policies: expected the function's address, got 0")
        _require(policies.memory >= 0, f"policies: expected memory of at least 0 doubles, got {policies.memory}")
        _require_array("policies: parameters", policies.parameters, (len(policies), None))
        return
    known = get_args(get_type_hints(type(policies))["activation"])
    _require(policies.activation in known, f"policies: expected {' or '.join(known)}, got {policies.activation!r}")
    inputs = scene.observations + policies.bias
    if isinstance(policies, Linear):
        _require_array("policies: input_output", policies.input_output, (len(policies), scene.commands, inputs))
        return
    n, hidden = policies.hidden_switch.shape
    _require(policies.hidden_switch.dtype == np.bool_, "policies: hidden_switch: expected booleans")
    _require_array("policies: input_hidden", policies.input_hidden, (n, hidden, inputs))
    _require_array("policies: hidden_output", policies.hidden_output, (n, scene.commands, hidden + policies.bias))
    if isinstance(policies, Recurrent):
        context = scene.commands if policies.recurrence == "jordan" else hidden
        _require_array("policies: context_hidden", policies.context_hidden, (n, hidden, context))
        if policies.recurrence == "ctrnn":
            _require_array("policies: time_constants", policies.time_constants, (n, hidden))


def _parameters(policies: NativePolicies) -> FloatArray:
    """Return all numbers of each policy, ``(n, numbers)``."""
    members = (getattr(policies, member.name) for member in fields(policies))
    arrays = [member.reshape(len(policies), -1) for member in members if isinstance(member, np.ndarray)]
    return np.concatenate([array.astype(np.float64) for array in arrays], axis=1)


# ---- fitness ---------------------------------------------------------------------------------------------------------


class SwitchCounter:
    """A controller that can do no more than count the switches that are on."""

    def space(self, scene: SceneInfo) -> GenomeSpace:
        """Return a network's layout."""
        return CHROMOSOME

    def complexity(self, genomes: FloatArray) -> FloatArray:
        """Return ``(n,)``: switches that are on, at most 4."""
        return np.asarray((genomes[:, CHROMOSOME.is_switch] >= 0.5).sum(axis=1), dtype=np.float64)


class FitnessTests:
    """Tests that every fitness must pass.

    Override :meth:`create`; :meth:`controller` if it needs a certain one; ``scene`` (:func:`scene_in`) if it is for
    certain worlds.
    """

    scene = scene_of(robots=5, control_steps=200)

    def create(self) -> Fitness:
        """Return a new fitness; one that takes a scene gets ``self.scene``."""
        raise NotImplementedError("create: expected an override that returns the fitness to test")

    def controller(self) -> Controller:
        """Return the controller whose genomes are judged."""
        return SwitchCounter()

    def test_has_the_members_of_a_fitness(self) -> None:
        """It has objectives, channels and evaluate."""
        _require(isinstance(self.create(), Fitness), "fitness: expected objectives, channels and evaluate")

    def test_names_its_objectives(self) -> None:
        """It has objectives, or descriptors, each with a name and a finite range, an objective with a direction."""
        fitness = self.create()
        names = [*(one.name for one in _objectives(fitness)), *(one.name for one in _descriptors(fitness))]
        _require(len(names) >= 1, "objectives: expected at least one, got none")
        _require(len(set(names)) == len(names), f"objectives: expected unique names, got {names}")

    def test_names_its_channels(self) -> None:
        """It asks for channels that exist."""
        unknown = set(self.create().channels) - set(CHANNELS)
        _require(not unknown, f"channels: expected some of {', '.join(CHANNELS)}; got {', '.join(sorted(unknown))}")

    def test_judges_episodes(self) -> None:
        """It returns a finite float64 in the objective's range for each episode and objective."""
        fitness = self.create()
        self._require_in_range("evaluate", fitness.evaluate, _objectives(fitness))

    def test_judges_an_episode_the_same_in_every_batch(self) -> None:
        """An episode's value does not depend on the episodes beside it, to the last bit."""
        self._require_the_same("evaluate", self.create().evaluate)

    def test_describes_episodes(self) -> None:
        """If it has descriptors, it describes each episode by finite float64 in their ranges, as it judges it."""
        fitness = self.create()
        names = [name for name in ("descriptors", "describe") if hasattr(fitness, name)]
        _require(len(names) != 1, f"descriptors: expected descriptors and describe, got {' '.join(names)} alone")
        if isinstance(fitness, DescribingFitness):
            self._require_in_range("describe", fitness.describe, _descriptors(fitness))
            self._require_the_same("describe", fitness.describe)

    def test_knows_behaviours_by_name(self) -> None:
        """If it knows behaviours, it says of each robot whether it showed them, whatever episodes stand beside."""
        fitness = self.create()
        if not isinstance(fitness, WatchingFitness):
            return
        channels = sorted({*fitness.channels, *CENSUS_CHANNELS})
        every = fitness.behaviours(self._telemetry(range(7), channels))
        for name, shown in every.items():
            _returned(f"behaviours: {name}", returned.flags, shown, (7, self.scene.robots))
        for batch in ([0], [3], [2, 4]):
            some = fitness.behaviours(self._telemetry(batch, channels))
            _require(list(some) == list(every), f"behaviours: expected always {list(every)}, got {list(some)}")
            for name, shown in some.items():
                same = np.array_equal(shown, every[name][batch])
                _require(same, f"behaviours: {name}: expected the same for the episodes {batch} of 7 on their own")

    def test_follows_episodes(self) -> None:
        """If it is told of every step, it comes to what it says of the whole episode, whatever worlds are beside it."""
        fitness = self.create()
        if not isinstance(fitness, StepwiseFitness):
            return
        episodes = [self._course(i) for i in range(7)]
        genomes = _frozen(random_genomes(self.controller().space(self.scene), 7))
        together, alone = (self._follow(fitness, episodes, worlds) for worlds in (3, 1))
        for i, one in enumerate(episodes):
            whole = fitness.evaluate(one.telemetry, genomes[i : i + 1], self.controller())[0]
            for objective, expected, *ends in zip(_objectives(fitness), whole, together[i], alone[i], strict=True):
                low, high = objective.range
                found = ends[int(np.argmax(np.abs(np.array(ends) - expected)))]
                _require(
                    abs(found - expected) <= returned.ROUNDING * (high - low),
                    f"stepwise: {objective.name}: expected {expected} after the last step of an episode, as "
                    f"evaluate says of it, got {found}",
                )
            same = np.array_equal(together[i], alone[i])
            _require(same, f"stepwise: expected the same bits for episode {i} of 7 without worlds beside it")

    def _course(self, i: int) -> _Course:
        """Return an episode of seven; every other one ends at a push, each at another step."""
        one, steps = self._telemetry([i], self.create().channels), self.scene.control_steps
        push = one.push_time
        if i % 2:
            steps = 1 + 37 * i % steps
            push = np.array([steps * one.control_period])
        late = one.homing_time > steps * one.control_period
        channels = {name: _frozen(array[:, :steps]) for name, array in one.channels.items()}
        homing = np.where(late, np.nan, one.homing_time)
        return _Course(replace(one, homing_time=_frozen(homing), push_time=_frozen(push), channels=channels), steps)

    def _follow(self, fitness: StepwiseFitness, episodes: Sequence[_Course], worlds: int) -> list[FloatArray]:
        """Return what each episode comes to, where worlds side by side have one after the other.

        A world without another one stands still: it has its last step again and again.
        """
        follow, ends = fitness.stepwise(worlds), {}
        plans = [
            [(i, k) for i in range(world, len(episodes), worlds) for k in range(episodes[i].steps)]
            for world in range(worlds)
        ]
        for now in range(max(map(len, plans))):
            goes_on = np.array([now < len(plan) for plan in plans])
            places = [plan[min(now, len(plan) - 1)] for plan in plans]
            step = _step(episodes, places, goes_on, self.scene.control_steps)
            values = follow(step)
            _require_array("stepwise", values, (worlds, len(_objectives(fitness))))
            ends.update({places[world][0]: values[world].copy() for world in np.flatnonzero(step.is_last)})
        return [ends[i] for i in range(len(episodes))]

    def _require_in_range(self, method: str, ask: _Ask, measured: Sequence[Objective | Descriptor]) -> None:
        values = self._ask(ask, range(7))
        _require_array(method, values, (7, len(measured)))
        _returned(method, returned.check_range, values, measured)

    def _require_the_same(self, method: str, ask: _Ask) -> None:
        values = self._ask(ask, range(7))
        for batch in ([0], [3], [6, 5, 4, 3, 2, 1, 0], [2, 4]):
            same = np.array_equal(self._ask(ask, batch), values[batch])
            _require(same, f"{method}: expected the same bits for the episodes {batch} of 7 on their own")

    def _ask(self, ask: _Ask, batch: Sequence[int]) -> FloatArray:
        """Judge or describe some of seven episodes, all arrays read-only."""
        controller = self.controller()
        genomes = _frozen(random_genomes(controller.space(self.scene), 7)[list(batch)])
        return ask(self._telemetry(batch, self.create().channels), genomes, controller)

    def _telemetry(self, batch: Sequence[int], channels: Sequence[str]) -> Telemetry:
        """Return some of seven episodes, all arrays read-only."""
        scene = self.scene if self.scene.world else scene_of(self.scene.robots, self.scene.control_steps)
        everything, rows = random_telemetry(channels, 7, scene=scene), list(batch)
        return replace(
            everything,
            homing_time=_frozen(everything.homing_time[rows]),
            push_time=_frozen(everything.push_time[rows]),
            channels={name: _frozen(getattr(everything, name)[rows]) for name in channels},
        )


class _Course(NamedTuple):
    """An episode with its length in control steps."""

    telemetry: Telemetry
    steps: int


def _step(episodes: Sequence[_Course], places: Sequence[tuple[int, int]], goes_on: BoolArray, horizon: int) -> Step:
    """Return the control steps of episodes, given by (episode, number), side by side; all arrays read-only.

    Where a world does not go on, nothing ends.
    """
    numbers = np.array([number for _, number in places], dtype=np.intp)
    several = [episodes[i].telemetry for i, _ in places]
    times: FloatArray = np.multiply(numbers + 1, several[0].control_period, dtype=np.float64)

    def come(time: list[FloatArray], until: FloatArray) -> FloatArray:
        together = np.concatenate(time)
        return _frozen(np.where(together <= until, together, np.nan))

    telemetry = replace(
        several[0],
        homing_time=come([one.homing_time for one in several], times[:, np.newaxis]),
        push_time=come([one.push_time for one in several], times),
        channels={
            name: _frozen(
                np.concatenate([one.channels[name][:, k : k + 1] for one, (_, k) in zip(several, places, strict=True)])
            )
            for name in several[0].channels
        },
    )
    ends = goes_on & np.array([number + 1 == episodes[i].steps for i, number in places])
    return Step(telemetry, _frozen(numbers), _frozen(ends), horizon)


_Ask = Callable[[Telemetry, FloatArray, Controller], FloatArray]
"""``evaluate`` or ``describe``."""


def _objectives(fitness: Fitness) -> list[Objective]:
    return [_returned("objectives", returned.objective, one) for one in fitness.objectives]


def _descriptors(fitness: Fitness) -> list[Descriptor]:
    given = fitness.descriptors if isinstance(fitness, DescribingFitness) else ()
    return [_returned("descriptors", returned.descriptor, one) for one in given]


# ---- checks ----------------------------------------------------------------------------------------------------------


def _require(condition: bool, message: str) -> None:
    """Fail a test; unlike ``assert`` also under ``python -O``, and with the message alone."""
    if not condition:
        raise AssertionError(message)


def _returned(what: str, check: Callable[..., Any], *values: object) -> Any:
    """Return what a check of the host makes of what a plugin returned."""
    try:
        return check(*values)
    except ValueError as error:
        raise AssertionError(f"{what}: {error}") from error


def _require_array(what: str, array: object, shape: tuple[int | None, ...]) -> None:
    """Require a finite float64 array; ``None`` in ``shape`` is any length."""
    expected = "(" + ", ".join("n" if n is None else str(n) for n in shape) + ")"
    plain = isinstance(array, np.ndarray) and not isinstance(array, np.ma.MaskedArray)
    _require(plain, f"{what}: expected an array {expected}, got {type(array).__name__}")
    values = np.asarray(array)
    fits = values.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, values.shape, strict=True))
    _require(fits, f"{what}: expected the shape {expected}, got {values.shape}")
    _require(values.dtype == np.float64, f"{what}: expected float64, got {values.dtype}")
    _require(bool(np.all(np.isfinite(values))), f"{what}: expected finite numbers, got NaN or infinity")


def _frozen(array: Array) -> Array:
    array.setflags(write=False)
    return array


def _scribble(array: FloatArray) -> None:
    if array.base is None:
        array.setflags(write=True)
    if array.flags.writeable:
        array.fill(np.nan)


def _to_json(state: object) -> str:
    """Return ``state`` as JSON; fail on anything that is not a number, string, None, array, dict or list."""
    return json.dumps(_plain(state, "state"))


def _plain(value: object, where: str) -> object:
    if isinstance(value, np.generic):
        return _plain(value.item(), where)
    if value is None or type(value) in (bool, int, float, str):
        return value
    if isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        return {"array": value.tolist(), "dtype": value.dtype.str, "shape": value.shape}
    if isinstance(value, Mapping):
        _require(all(type(key) is str for key in value), f"{where}: expected strings as keys, got {list(value)}")
        return {key: _plain(item, f"{where}[{key!r}]") for key, item in value.items()}
    if isinstance(value, list):
        return [_plain(item, f"{where}[{i}]") for i, item in enumerate(value)]
    kind = f"{type(value).__module__}.{type(value).__name__}"
    raise AssertionError(f"{where}: expected a number, string, None, array, dict or list, got {kind}")


def _from_json(text: str) -> Any:
    def decode(item: dict[str, Any]) -> Any:
        if set(item) == {"array", "dtype", "shape"}:
            return np.array(item["array"], dtype=item["dtype"]).reshape(item["shape"])
        return item

    return json.loads(text, object_hook=decode)

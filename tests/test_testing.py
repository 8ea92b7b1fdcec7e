# SPDX-License-Identifier: BSD-3-Clause
"""The conformance kit: sound plugins pass, each kind of broken plugin is caught and told why."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pytest

from swarmevo.protocols import (
    CHANNELS,
    BehaviourMap,
    Block,
    Compiled,
    Descriptor,
    FeedForward,
    GenomeSpace,
    Objective,
    SceneInfo,
)
from swarmevo.testing import (
    CHROMOSOME,
    ControllerTests,
    FitnessTests,
    OptimiserTests,
    SwitchCounter,
    failures,
    random_genomes,
    random_telemetry,
    scene_in,
)
from swarmevo_paper.fitness import BoxPushing

# ---- plugins that pass -----------------------------------------------------------------------------------------------


class RandomSearch:
    """Asks for random genomes and keeps the best."""

    def __init__(self, space, population, objectives, rng):
        self.shape, self.rng, self.best, self.bounds = (population, space.size), rng, None, space.bounds

    def ask(self):
        genomes = np.clip(self.rng.standard_normal(self.shape), *self.bounds)
        if self.best is not None:
            genomes[0] = self.best
        return genomes

    def tell(self, genomes, costs):
        self.best = genomes[np.argmin(costs[:, 0])].copy()

    def state(self):
        return {"best": self.best, "rng": self.rng.bit_generator.state}

    def restore(self, state):
        self.best = state["best"]
        self.rng.bit_generator.state = state["rng"]


class Climber(RandomSearch):
    """Random search round the best so far, which is its answer and may be given."""

    def ask(self):
        genomes = self.rng.standard_normal(self.shape)
        return np.clip(genomes if self.best is None else self.best + genomes, *self.bounds)

    def answer(self):
        return np.empty((0, self.shape[1])) if self.best is None else self.best[np.newaxis].copy()

    def start_from(self, genomes):
        self.best = genomes.mean(axis=0)


class Mapper(RandomSearch):
    """Keeps the best of each half of the first descriptor's range, if there is one."""

    def __init__(self, space, population, objectives, rng, problem):
        super().__init__(space, population, objectives, rng)
        assert len(problem.objectives) == objectives
        self.problem, self.elites = problem, {}

    def tell(self, genomes, costs, descriptors):
        assert descriptors.shape == (len(genomes), len(self.problem.descriptors))
        super().tell(genomes, costs)
        for i, described in enumerate(descriptors):
            if len(described) and not np.isnan(described[0]):
                middle = sum(self.problem.descriptors[0].range) / 2
                self.elites[str(described[0] > middle)] = genomes[i].copy()

    def ask(self):
        genomes = super().ask()
        for i, elite in enumerate(self.elites.values()):
            genomes[-1 - i] = elite
        return genomes

    def state(self):
        return {**super().state(), "elites": dict(self.elites)}

    def restore(self, state):
        super().restore(state)
        self.elites = dict(state["elites"])


class Reflex:
    """A Python controller with memory: two weights for each wheel, a running mean of the RF strength."""

    def space(self, scene):
        return GenomeSpace((Block("weights", (2, 2)),))

    def complexity(self, genomes):
        return np.zeros(len(genomes))

    def start(self, genomes):
        self.weights, self.memory = genomes.reshape(*genomes.shape[:2], 2, 2).copy(), np.zeros(genomes.shape[:2])

    def act(self, observations):
        self.memory = 0.9 * self.memory + 0.1 * observations[..., -1]
        return np.tanh(self.weights[..., 0] * self.memory[..., None] + self.weights[..., 1])


class Machine:
    """A native controller with a compiled function, as far as one can tell from Python."""

    def space(self, scene):
        return GenomeSpace((Block("weights", (4,)),))

    def complexity(self, genomes):
        return np.zeros(len(genomes))

    def policies(self, genomes):
        return Compiled(function=4096, parameters=genomes, memory=2)


class Homing:
    """A fitness that needs no channels: the share of robots that came home."""

    objectives = (Objective("homing", "maximise", (0.0, 1.0)),)
    channels = ()

    def evaluate(self, telemetry, genomes, controller):
        return np.isfinite(telemetry.homing_time).mean(axis=1, keepdims=True)


class ShareOfTime(Homing):
    """Knows the horizon and the team of the episodes that it is tried with."""

    def evaluate(self, telemetry, genomes, controller):
        assert telemetry.world["episode"]["horizon"] == FitnessTests.scene.control_steps * 0.1
        assert telemetry.world["team"]["robots"] == FitnessTests.scene.robots
        assert telemetry.world["box"]["size"] == (0.275, 0.18, 0.03)
        return np.nan_to_num(telemetry.push_time / telemetry.world["episode"]["horizon"])[:, np.newaxis]


class Pushed(Homing):
    """Tells whether the box was pushed, too."""

    descriptors = (Descriptor("pushed", (0.0, 1.0)),)

    def describe(self, telemetry, genomes, controller):
        return np.isfinite(telemetry.push_time)[:, np.newaxis].astype(float)


class OnlyPushed(Pushed):
    """Tells nothing else."""

    objectives = ()

    def evaluate(self, telemetry, genomes, controller):
        return np.empty((len(genomes), 0))


def mapper_failures(factory):
    class Tests(OptimiserTests):
        populations, objectives = (4, 5), (1, 2)

        def create(self, space, population, objectives, rng, problem):
            return factory(space, population, objectives, rng, problem)

    return failures(Tests())


def optimiser_failures(factory):
    class Tests(OptimiserTests):
        populations, objectives = (4, 5), (1, 2)

        def create(self, *arguments):
            return factory(*arguments)

    return failures(Tests())


def controller_failures(factory):
    class Tests(ControllerTests):
        def create(self):
            return factory()

    return failures(Tests())


def fitness_failures(factory):
    class Tests(FitnessTests):
        def create(self):
            return factory()

    return failures(Tests())


def test_sound_plugins_pass():
    assert optimiser_failures(RandomSearch) == []
    assert optimiser_failures(Climber) == []
    assert controller_failures(Reflex) == []
    assert controller_failures(Machine) == []
    assert fitness_failures(Homing) == []
    assert fitness_failures(ShareOfTime) == []
    assert mapper_failures(Mapper) == []
    assert fitness_failures(Pushed) == []
    assert fitness_failures(OnlyPushed) == []


def test_create_must_be_overridden():
    for tests in (OptimiserTests, ControllerTests, FitnessTests):
        lines = failures(tests())
        assert lines
        assert all("create: expected an override" in line for line in lines)


# ---- optimisers that do not ------------------------------------------------------------------------------------------


class OnlyAsksAndTells:
    ask, tell = RandomSearch.ask, RandomSearch.tell

    def __init__(self, *arguments):
        RandomSearch.__init__(self, *arguments)


class WrongLength(RandomSearch):
    def ask(self):
        return super().ask()[:, 1:]


class Single(RandomSearch):
    def ask(self):
        return super().ask().astype(np.float32)


class NotANumber(RandomSearch):
    def ask(self):
        return super().ask() * np.nan


class Nobody(RandomSearch):
    def ask(self):
        return super().ask()[:0]


class AsksForAList(RandomSearch):
    def ask(self):
        return super().ask().tolist()


class OwnRandomness(RandomSearch):
    def __init__(self, space, population, objectives, rng):
        super().__init__(space, population, objectives, np.random.default_rng())


class GlobalNumpy(RandomSearch):
    def ask(self):
        np.random.rand()
        return super().ask()


class GlobalPython(RandomSearch):
    def ask(self):
        random.random()
        return super().ask()


class IgnoresBounds(RandomSearch):
    def ask(self):
        return self.rng.standard_normal(self.shape)


class ForgetsItsRng(RandomSearch):
    def state(self):
        return {"best": self.best, "rng": np.random.PCG64(0).state}


class ForgetsTheBest(RandomSearch):
    def state(self):
        return {"best": None, "rng": self.rng.bit_generator.state}


class StateIsAnObject(RandomSearch):
    def state(self):
        return {**super().state(), "self": self}


class StateIsAlive(RandomSearch):
    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.history = []

    def tell(self, genomes, costs):
        super().tell(genomes, costs)
        self.history.append(float(costs[0, 0]))

    def state(self):
        return {**super().state(), "history": self.history}


class WritesToCosts(RandomSearch):
    def tell(self, genomes, costs):
        costs -= costs.min()
        super().tell(genomes, costs)


class KeepsTheCallersArray(RandomSearch):
    def tell(self, genomes, costs):
        self.best = genomes[0]


class TiesByTheCallsOfAll(RandomSearch):
    """Breaks ties by something outside the run."""

    calls = 0

    def tell(self, genomes, costs):
        TiesByTheCallsOfAll.calls += 1
        best = np.flatnonzero(costs[:, 0] == costs[:, 0].min())
        self.best = genomes[best[TiesByTheCallsOfAll.calls % len(best)]].copy()


class AnswersOneGenome(Climber):
    def answer(self):
        return super().answer().ravel()


class AnswersAtRandom(Climber):
    def answer(self):
        return super().answer() + self.rng.standard_normal(self.shape[1])


class AnswersFromMemory(Climber):
    def tell(self, genomes, costs):
        super().tell(genomes, costs)
        self.last = genomes[:1].copy()

    def answer(self):
        return getattr(self, "last", super().answer())


class AnswersItsOwnArray(Climber):
    def answer(self):
        return super().answer() if self.best is None else self.best[np.newaxis]


class ForgetsWhereItStarts(Climber):
    def start_from(self, genomes):
        pass


class StartsFromTheCallersArray(Climber):
    def start_from(self, genomes):
        self.best = genomes[0]


class DoesNotStoreItsStart(Climber):
    def start_from(self, genomes):
        self.start = genomes.mean(axis=0)

    def ask(self):
        return super().ask() + getattr(self, "start", 0)


class OneElite(RandomSearch):
    """Keeps one elite, in one cell over no descriptors: the first that it asked for."""

    first = None

    def tell(self, genomes, costs):
        self.first = genomes[0].copy() if self.first is None else self.first
        super().tell(genomes, costs)

    def behaviour_map(self):
        kept = np.empty((0, self.shape[1])) if self.first is None else self.first[np.newaxis].copy()
        return BehaviourMap((), "objective_0", np.empty((len(kept), 0), dtype=np.intp), kept)

    def state(self):
        return {**super().state(), "first": self.first}

    def restore(self, state):
        super().restore(state)
        self.first = state["first"]


class MapsOfAnotherProblem(OneElite):
    def behaviour_map(self):
        return replace(super().behaviour_map(), objective="speed")


class MapsAStranger(OneElite):
    def behaviour_map(self):
        found = super().behaviour_map()
        return replace(found, genomes=found.genomes / 2)


class ForgetsItsElite(OneElite):
    def restore(self, state):
        RandomSearch.restore(self, state)


class MapsItsOwnArray(OneElite):
    def behaviour_map(self):
        found = super().behaviour_map()
        return found if self.first is None else replace(found, genomes=self.first[np.newaxis])


class MapsAtRandom(OneElite):
    def behaviour_map(self):
        self.rng.random()
        return super().behaviour_map()


class MapsInLists(OneElite):
    """Which the host takes, too, as it does arrays that nobody may write to."""

    def behaviour_map(self):
        found = super().behaviour_map()
        found.genomes.flags.writeable = False
        return replace(found, places=found.places.tolist()) if len(found.genomes) else found


@pytest.mark.parametrize("kind", [OneElite, MapsInLists])
def test_a_map_may_be_kept(kind):
    assert optimiser_failures(kind) == []


@pytest.mark.parametrize(
    ("broken", "test", "reason"),
    [
        (MapsOfAnotherProblem, "test_maps", "expected as objective one of objective_0, got 'speed'"),
        (MapsAStranger, "test_maps", "behaviour_map: expected genomes that it asked for, got another"),
        (ForgetsItsElite, "test_maps", "behaviour_map: expected the same from a restored run"),
        (MapsItsOwnArray, "test_maps", "behaviour_map: expected it to change nothing"),
        (MapsAtRandom, "test_maps", "behaviour_map: expected it to change nothing"),
        (AnswersOneGenome, "test_answers", "answer: expected the shape (n, "),
        (AnswersAtRandom, "test_answers", "expected it to change nothing"),
        (AnswersFromMemory, "test_answers", "answer: expected the same from a restored run"),
        (AnswersItsOwnArray, "test_answers", "expected it to change nothing"),
        (ForgetsWhereItStarts, "test_begins", "start_from: expected other genomes"),
        (StartsFromTheCallersArray, "test_begins", "ask: expected finite numbers"),
        (DoesNotStoreItsStart, "test_begins", "from given genomes; the call 1 differs"),
        (OnlyAsksAndTells, "test_has_the_methods", "expected the methods ask, tell, state and restore"),
        (WrongLength, "test_asks_for_genomes", "ask: expected the shape (n, "),
        (Single, "test_asks_for_genomes", "ask: expected float64, got float32"),
        (NotANumber, "test_asks_for_genomes", "ask: expected finite numbers"),
        (IgnoresBounds, "test_asks_for_genomes", "ask: expected genes within the controller's bounds"),
        (Nobody, "test_asks_for_genomes", "ask: expected at least one genome, got none"),
        (AsksForAList, "test_asks_for_genomes", "ask: expected an array (n, "),
        (OwnRandomness, "test_same_rng_same_run", "a second run from the same RNG"),
        (GlobalNumpy, "test_uses_no_other_randomness", "a global RNG was used"),
        (GlobalPython, "test_uses_no_other_randomness", "a global RNG was used"),
        (ForgetsItsRng, "test_continues_from_its_state", "continued from a state"),
        (ForgetsTheBest, "test_continues_from_its_state", "continued from a state"),
        (StateIsAnObject, "test_continues_from_its_state", "state['self']: expected a number, string, None, array"),
        (StateIsAlive, "test_state_is_a_snapshot", "state: expected a copy"),
        (WritesToCosts, "test_leaves_the_callers_arrays_alone", "read-only"),
        (KeepsTheCallersArray, "test_leaves_the_callers_arrays_alone", "a caller's array is in use"),
        (TiesByTheCallsOfAll, "test_same_rng_same_run", "costs; the call"),
    ],
)
def test_broken_optimisers_are_caught(broken, test, reason):
    lines = optimiser_failures(broken)
    assert any(line.startswith(test) and reason in line for line in lines), lines


class KeepsTheCallersDescriptors(Mapper):
    def tell(self, genomes, costs, descriptors):
        super().tell(genomes, costs, descriptors)
        self.elites["described"] = np.full(self.shape[1], descriptors[:1].sum())
        self.last = descriptors

    def ask(self):
        return super().ask() + (np.nansum(self.last) if getattr(self, "last", None) is not None else 0)


class WritesToDescriptors(Mapper):
    def tell(self, genomes, costs, descriptors):
        descriptors[:] = 0
        super().tell(genomes, costs, descriptors)


class ForgetsItsMap(Mapper):
    def state(self):
        return {**super().state(), "elites": {}}


class BelievesWhatFailed(Mapper):
    """Takes the mean of all descriptors, which is NaN where a genome failed."""

    def tell(self, genomes, costs, descriptors):
        super().tell(genomes, costs, descriptors)
        self.elites["mean"] = np.full(self.shape[1], descriptors.mean() if descriptors.size else 0.0)


@pytest.mark.parametrize(
    ("broken", "test", "reason"),
    [
        (KeepsTheCallersDescriptors, "test_leaves_the_callers_arrays_alone", "a caller's array is in use"),
        (WritesToDescriptors, "test_leaves_the_callers_arrays_alone", "read-only"),
        (ForgetsItsMap, "test_continues_from_its_state", "continued from a state"),
        (BelievesWhatFailed, "test_asks_for_genomes", "ask: expected finite numbers"),
    ],
)
def test_broken_optimisers_that_are_told_descriptors_are_caught(broken, test, reason):
    lines = mapper_failures(broken)
    assert any(line.startswith(test) and reason in line for line in lines), lines


# ---- controllers that do not -----------------------------------------------------------------------------------------


class Both(Reflex):
    def policies(self, genomes):
        return Compiled(1, genomes)


class TwinBlocks(Reflex):
    def space(self, scene):
        return GenomeSpace((Block("weights", (2,)), Block("weights", (2,))))


class NoGenes(Machine):
    def space(self, scene):
        return GenomeSpace(())


class NoUnitAxis(Machine):
    def space(self, scene):
        return GenomeSpace((Block("weights", (4,), unit_axis=1),))


class ComplexityOfTheBatch(Machine):
    def complexity(self, genomes):
        return np.full(len(genomes), float(len(genomes)))


class OneComplexity(Machine):
    def complexity(self, genomes):
        return 0.0


class OnePolicy(Machine):
    def policies(self, genomes):
        return Compiled(4096, genomes[:1])


class NullFunction(Machine):
    def policies(self, genomes):
        return Compiled(0, genomes)


class WrongWeights(Machine):
    def policies(self, genomes):
        n = len(genomes)
        return FeedForward(np.zeros((n, 2, 13)), np.zeros((n, 2, 3)), np.zeros((n, 2), dtype=bool), bias=True)


class TooFast(Reflex):
    def act(self, observations):
        return 2 * super().act(observations)


class OneWheel(Reflex):
    def act(self, observations):
        return super().act(observations)[..., :1]


class LooksAtTheNeighbourWorld(Reflex):
    def act(self, observations):
        return super().act(observations) * observations.mean()


class Remembers(Reflex):
    memory = None

    def start(self, genomes):
        before = self.memory
        super().start(genomes)
        self.memory = self.memory if before is None else before


@pytest.mark.parametrize(
    ("broken", "test", "reason"),
    [
        (SwitchCounter, "test_has_the_methods", "either policies(), or start() and act()"),
        (Both, "test_has_the_methods", "either policies(), or start() and act()"),
        (TwinBlocks, "test_lays_out_a_genome", "expected blocks of different names"),
        (NoGenes, "test_lays_out_a_genome", "expected at least one gene"),
        (NoUnitAxis, "test_lays_out_a_genome", "expected a unit_axis of the shape (4,), got 1"),
        (ComplexityOfTheBatch, "test_tells_complexity", "for a genome on its own"),
        (OneComplexity, "test_tells_complexity", "complexity: expected an array (6), got float"),
        (OnePolicy, "test_makes_native_policies", "expected one for each of 6 genomes, got 1"),
        (NullFunction, "test_makes_native_policies", "expected the function's address, got 0"),
        (WrongWeights, "test_makes_native_policies", "input_hidden: expected the shape (6, 2, 14), got (6, 2, 13)"),
        (TooFast, "test_acts:", "expected commands in [-1, 1]"),
        (OneWheel, "test_acts:", "expected the shape (4, 5, 2), got (4, 5, 1)"),
        (LooksAtTheNeighbourWorld, "test_acts_the_same_in_every_batch", "for a world on its own"),
        (Remembers, "test_start_forgets", "expected it to forget the episode before"),
    ],
)
def test_broken_controllers_are_caught(broken, test, reason):
    lines = controller_failures(broken)
    assert any(line.startswith(test) and reason in line for line in lines), lines


# ---- fitness functions that do not -----------------------------------------------------------------------------------


class NoObjectives(Homing):
    objectives = ()


class NoDirection(Homing):
    objectives = (Objective("homing", "better", (0.0, 1.0)),)


class EndlessRange(Homing):
    objectives = (Objective("homing", "maximise", (0.0, float("inf"))),)


class UnknownChannel(Homing):
    channels = ("odour",)


class Flat(Homing):
    def evaluate(self, telemetry, genomes, controller):
        return super().evaluate(telemetry, genomes, controller)[:, 0]


class MeanHomingTime(Homing):
    def evaluate(self, telemetry, genomes, controller):
        return telemetry.homing_time.mean(axis=1, keepdims=True)  # NaN where a robot never came home


class OutOfRange(Homing):
    def evaluate(self, telemetry, genomes, controller):
        return 2 + super().evaluate(telemetry, genomes, controller)


class Relative(Homing):
    def evaluate(self, telemetry, genomes, controller):
        values = super().evaluate(telemetry, genomes, controller)
        return values / max(1.0, len(values) / 2)


class WritesToTelemetry(Homing):
    def evaluate(self, telemetry, genomes, controller):
        telemetry.homing_time[:] = 0.0
        return super().evaluate(telemetry, genomes, controller)


class EndlessDescriptor(Pushed):
    descriptors = (Descriptor("pushed", (0.0, float("inf"))),)


class TwinNames(Pushed):
    descriptors = (Descriptor("homing", (0.0, 1.0)),)


class DescribesAlone(Homing):
    describe = Pushed.describe


class DescribesFlat(Pushed):
    def describe(self, telemetry, genomes, controller):
        return super().describe(telemetry, genomes, controller)[:, 0]


class DescribesOutOfRange(Pushed):
    def describe(self, telemetry, genomes, controller):
        return 2 + super().describe(telemetry, genomes, controller)


class DescribesRelatively(Pushed):
    def describe(self, telemetry, genomes, controller):
        return np.full((len(genomes), 1), 1 / len(genomes))


class Pace(Homing):
    """How fast wheels turn, over the time: ``stepwise`` is right."""

    channels = ("command",)

    def evaluate(self, telemetry, genomes, controller):
        return np.abs(telemetry.command).mean(axis=(2, 3)).mean(axis=1, keepdims=True)

    def stepwise(self, worlds):
        total = np.zeros(worlds)
        return lambda step: self.follow(total, step)[:, np.newaxis]

    def follow(self, total, step):
        total[self.begins(step)] = 0
        total[:] += np.abs(step.telemetry.command).mean(axis=(1, 2, 3))
        return total / np.where(step.is_last, step.number + 1, step.horizon)

    def begins(self, step):
        return step.is_first


class NeverForgets(Pace):
    def begins(self, step):
        return np.zeros(len(step.number), dtype=bool)


class ForgetsAllWithOne(Pace):
    def begins(self, step):
        return np.full(len(step.number), step.is_first.any())


class AddsUpToLess(Pace):
    def follow(self, total, step):
        super().follow(total, step)
        return total / step.horizon  # an episode that ends early has fewer steps


class LooksAside(Pace):
    def follow(self, total, step):
        return super().follow(total, step) + 1e-12 * len(total)


class FollowsFlat(Pace):
    def stepwise(self, worlds):
        total = np.zeros(worlds)
        return lambda step: self.follow(total, step)


def test_a_fitness_that_follows_episodes_passes():
    assert fitness_failures(Pace) == []


@pytest.mark.parametrize(
    ("broken", "test", "reason"),
    [
        (NeverForgets, "test_follows_episodes", "after the last step of an episode, as evaluate says of it, got"),
        (ForgetsAllWithOne, "test_follows_episodes", "homing: expected 0."),
        (LooksAside, "test_follows_episodes", "expected the same bits for episode 0 of 7 without worlds beside it"),
        (AddsUpToLess, "test_follows_episodes", "homing: expected 0."),
        (FollowsFlat, "test_follows_episodes", "stepwise: expected the shape (3, 1), got (3,)"),
        (EndlessDescriptor, "test_names_its_objectives", "pushed: expected as range two finite numbers"),
        (TwinNames, "test_names_its_objectives", "expected unique names, got ['homing', 'homing']"),
        (DescribesAlone, "test_describes_episodes", "expected descriptors and describe, got describe alone"),
        (DescribesFlat, "test_describes_episodes", "describe: expected the shape (7, 1), got (7,)"),
        (DescribesOutOfRange, "test_describes_episodes", "describe: expected pushed in its range from 0 to 1"),
        (DescribesRelatively, "test_describes_episodes", "describe: expected the same bits"),
        (NoObjectives, "test_names_its_objectives", "expected at least one, got none"),
        (NoDirection, "test_names_its_objectives", "expected the direction maximise or minimise, got 'better'"),
        (EndlessRange, "test_names_its_objectives", "expected as range two finite numbers"),
        (UnknownChannel, "test_names_its_channels", "got odour"),
        (Flat, "test_judges_episodes", "expected the shape (7, 1), got (7,)"),
        (MeanHomingTime, "test_judges_episodes", "expected finite numbers, got NaN"),
        (OutOfRange, "test_judges_episodes", "expected homing in its range from 0 to 1"),
        (Relative, "test_judges_an_episode_the_same_in_every_batch", "expected the same bits"),
        (WritesToTelemetry, "test_judges_episodes", "read-only"),
    ],
)
def test_broken_fitness_functions_are_caught(broken, test, reason):
    lines = fitness_failures(broken)
    assert any(line.startswith(test) and reason in line for line in lines), lines


# ---- what the kit makes ----------------------------------------------------------------------------------------------


class OfTwoPucks:
    """Is for worlds with two movables and one robot."""

    objectives = (Objective("apart", "maximise", (0.0, 10.0)),)
    channels = ("movables",)

    def __init__(self, scene):
        if len(scene.world["scene"]["movables"] or ()) != 2:
            raise ValueError("scene.movables: expected two")
        self.scene = scene

    def evaluate(self, telemetry, genomes, controller):
        assert telemetry.world == self.scene.world
        assert telemetry.homing_time.shape[1:] == (1,)
        assert telemetry.control_period == 0.05
        apart = np.abs(telemetry.movables[..., 0, 0] - telemetry.movables[..., 1, 0])
        return apart.mean(axis=1, keepdims=True) % 10


def test_a_fitness_is_tested_in_the_world_that_it_is_for(tmp_path):
    world = tmp_path / "pucks.yaml"
    world.write_text(
        "scene: {movables: [{}, {pose: [0.0, -0.2, 0.0]}]}\nteam: {robots: 1}\nepisode: {control_period: 0.05}\n"
    )

    class Tests(FitnessTests):
        scene = scene_in(world, control_steps=30)

        def create(self):
            return OfTwoPucks(self.scene)

    assert Tests.scene.control_steps == 30
    assert failures(Tests()) == []
    assert (
        "scene.movables: expected two"
        in failures(type("Default", (FitnessTests,), {"create": lambda self: OfTwoPucks(self.scene)})())[0]
    )


def test_random_telemetry_has_the_shapes_of_the_protocol():
    telemetry = random_telemetry(list(CHANNELS), episodes=3, steps=10, robots=2)
    assert telemetry.homing_time.shape == (3, 2)
    assert telemetry.push_time.shape == (3,)
    for name, channel in CHANNELS.items():
        assert getattr(telemetry, name).shape == (3, 10, *channel.sizes(SceneInfo(2, 10, 0.1)))
        assert not getattr(telemetry, name).flags.writeable
        values = getattr(telemetry, name)
        assert np.all((channel.low <= values) & (values <= channel.high))
        assert not channel.is_flag or not values.size or set(np.unique(values)) == {0.0, 1.0}
    assert "pose" not in random_telemetry(BoxPushing.channels, episodes=1).channels


def test_random_genomes_have_switches_that_are_on_or_off():
    genomes = random_genomes(CHROMOSOME, 50)
    assert genomes.shape == (50, CHROMOSOME.size)
    assert set(np.unique(genomes[:, CHROMOSOME.is_switch])) == {0.0, 1.0}


def test_switch_counter_counts_switches():
    assert SwitchCounter().space(SceneInfo(5, 10, 0.1)) == CHROMOSOME
    assert SwitchCounter().complexity(np.ones((2, CHROMOSOME.size))).tolist() == [4.0, 4.0]

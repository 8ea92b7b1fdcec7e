# SPDX-License-Identifier: BSD-3-Clause
"""What every fitness must do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from swarmevo import returned
from swarmevo.protocols import (
    CENSUS_CHANNELS,
    CHANNELS,
    BoolArray,
    Controller,
    DescribingFitness,
    Descriptor,
    Fitness,
    FloatArray,
    GenomeSpace,
    Objective,
    SceneInfo,
    Step,
    StepwiseFitness,
    Telemetry,
    WatchingFitness,
)
from swarmevo.testing.checks import accepted, frozen, require, require_array
from swarmevo.testing.data import CHROMOSOME, random_genomes, random_telemetry, scene_of


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
        require(isinstance(self.create(), Fitness), "fitness: expected objectives, channels and evaluate")

    def test_names_its_objectives(self) -> None:
        """It has objectives, or descriptors, each with a name and a finite range, an objective with a direction."""
        fitness = self.create()
        names = [*(one.name for one in _objectives(fitness)), *(one.name for one in _descriptors(fitness))]
        require(len(names) >= 1, "objectives: expected at least one, got none")
        require(len(set(names)) == len(names), f"objectives: expected unique names, got {names}")

    def test_names_its_channels(self) -> None:
        """It asks for channels that exist."""
        unknown = set(self.create().channels) - set(CHANNELS)
        require(not unknown, f"channels: expected some of {', '.join(CHANNELS)}; got {', '.join(sorted(unknown))}")

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
        require(len(names) != 1, f"descriptors: expected descriptors and describe, got {' '.join(names)} alone")
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
            accepted(f"behaviours: {name}", returned.flags, shown, (7, self.scene.robots))
        for batch in ([0], [3], [2, 4]):
            some = fitness.behaviours(self._telemetry(batch, channels))
            require(list(some) == list(every), f"behaviours: expected always {list(every)}, got {list(some)}")
            for name, shown in some.items():
                same = np.array_equal(shown, every[name][batch])
                require(same, f"behaviours: {name}: expected the same for the episodes {batch} of 7 on their own")

    def test_follows_episodes(self) -> None:
        """If it is told of every step, it comes to what it says of the whole episode, whatever worlds are beside it."""
        fitness = self.create()
        if not isinstance(fitness, StepwiseFitness):
            return
        episodes = [self._course(i) for i in range(7)]
        genomes = frozen(random_genomes(self.controller().space(self.scene), 7))
        together, alone = (self._follow(fitness, episodes, worlds) for worlds in (3, 1))
        for i, one in enumerate(episodes):
            whole = fitness.evaluate(one.telemetry, genomes[i : i + 1], self.controller())[0]
            for objective, expected, *ends in zip(_objectives(fitness), whole, together[i], alone[i], strict=True):
                low, high = objective.range
                found = ends[int(np.argmax(np.abs(np.array(ends) - expected)))]
                require(
                    abs(found - expected) <= returned.ROUNDING * (high - low),
                    f"stepwise: {objective.name}: expected {expected} after the last step of an episode, as "
                    f"evaluate says of it, got {found}",
                )
            same = np.array_equal(together[i], alone[i])
            require(same, f"stepwise: expected the same bits for episode {i} of 7 without worlds beside it")

    def _course(self, i: int) -> _Course:
        """Return an episode of seven; every other one ends at a push, each at another step."""
        one, steps = self._telemetry([i], self.create().channels), self.scene.control_steps
        push = one.push_time
        if i % 2:
            steps = 1 + 37 * i % steps
            push = np.array([steps * one.control_period])
        late = one.homing_time > steps * one.control_period
        channels = {name: frozen(array[:, :steps]) for name, array in one.channels.items()}
        homing = np.where(late, np.nan, one.homing_time)
        return _Course(replace(one, homing_time=frozen(homing), push_time=frozen(push), channels=channels), steps)

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
            require_array("stepwise", values, (worlds, len(_objectives(fitness))))
            ends.update({places[world][0]: values[world].copy() for world in np.flatnonzero(step.is_last)})
        return [ends[i] for i in range(len(episodes))]

    def _require_in_range(self, method: str, ask: _Ask, measured: Sequence[Objective | Descriptor]) -> None:
        values = self._ask(ask, range(7))
        require_array(method, values, (7, len(measured)))
        accepted(method, returned.check_range, values, measured)

    def _require_the_same(self, method: str, ask: _Ask) -> None:
        values = self._ask(ask, range(7))
        for batch in ([0], [3], [6, 5, 4, 3, 2, 1, 0], [2, 4]):
            same = np.array_equal(self._ask(ask, batch), values[batch])
            require(same, f"{method}: expected the same bits for the episodes {batch} of 7 on their own")

    def _ask(self, ask: _Ask, batch: Sequence[int]) -> FloatArray:
        """Judge or describe some of seven episodes, all arrays read-only."""
        controller = self.controller()
        genomes = frozen(random_genomes(controller.space(self.scene), 7)[list(batch)])
        return ask(self._telemetry(batch, self.create().channels), genomes, controller)

    def _telemetry(self, batch: Sequence[int], channels: Sequence[str]) -> Telemetry:
        """Return some of seven episodes, all arrays read-only."""
        scene = self.scene if self.scene.world else scene_of(self.scene.robots, self.scene.control_steps)
        everything, rows = random_telemetry(channels, 7, scene=scene), list(batch)
        return replace(
            everything,
            homing_time=frozen(everything.homing_time[rows]),
            push_time=frozen(everything.push_time[rows]),
            channels={name: frozen(getattr(everything, name)[rows]) for name in channels},
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
        return frozen(np.where(together <= until, together, np.nan))

    telemetry = replace(
        several[0],
        homing_time=come([one.homing_time for one in several], times[:, np.newaxis]),
        push_time=come([one.push_time for one in several], times),
        channels={
            name: frozen(
                np.concatenate([one.channels[name][:, k : k + 1] for one, (_, k) in zip(several, places, strict=True)])
            )
            for name in several[0].channels
        },
    )
    ends = goes_on & np.array([number + 1 == episodes[i].steps for i, number in places])
    return Step(telemetry, frozen(numbers), frozen(ends), horizon)


_Ask = Callable[[Telemetry, FloatArray, Controller], FloatArray]
"""``evaluate`` or ``describe``."""


def _objectives(fitness: Fitness) -> list[Objective]:
    return [accepted("objectives", returned.objective, one) for one in fitness.objectives]


def _descriptors(fitness: Fitness) -> list[Descriptor]:
    given = fitness.descriptors if isinstance(fitness, DescribingFitness) else ()
    return [accepted("descriptors", returned.descriptor, one) for one in given]

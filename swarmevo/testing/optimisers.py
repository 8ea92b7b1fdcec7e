# SPDX-License-Identifier: BSD-3-Clause
"""What every optimiser must do."""

from __future__ import annotations

import inspect
import itertools
import random
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from swarmevo import returned
from swarmevo.protocols import (
    AnsweringOptimiser,
    Descriptor,
    FloatArray,
    GenomeSpace,
    MappingOptimiser,
    Objective,
    Optimiser,
    Problem,
    StartableOptimiser,
    takes_descriptors,
)
from swarmevo.testing.checks import accepted, from_json, frozen, require, require_array, scribble, to_json
from swarmevo.testing.data import SPACES, random_genomes


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
        require(isinstance(optimiser, Optimiser), "optimiser: expected the methods ask, tell, state and restore")

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
                stored = to_json(interrupted.state())
                expected = _run(interrupted, case, costs, 4, start=3)
                resumed = self._create(case, seed=2)
                resumed.restore(from_json(stored))
                continued = _run(resumed, case, costs, 4, start=3)
                _require_equal_runs(expected, continued, f"the run continued from a state, with {_title(costs)}")

    def test_state_before_the_first_generation(self) -> None:
        """A state taken before anything was asked restores a run from its start."""
        for case in self._cases():
            optimiser = self._create(case)
            stored = to_json(optimiser.state())
            resumed = self._create(case, seed=2)
            resumed.restore(from_json(stored))
            one, two = (_run(each, case, random_costs, 3) for each in (optimiser, resumed))
            _require_equal_runs(one, two, "the run restored to its start")

    def test_state_is_a_snapshot(self) -> None:
        """A state does not change while the run goes on."""
        for case in self._cases():
            optimiser = self._create(case)
            _run(optimiser, case, random_costs, 2)
            state = optimiser.state()
            before = to_json(state)
            _run(optimiser, case, random_costs, 2, start=2)
            require(to_json(state) == before, "state: expected a copy, but it changed while the run went on")

    def test_leaves_the_callers_arrays_alone(self) -> None:
        """It neither writes to the arrays it is told nor relies on what becomes of them afterwards."""
        for case in self._cases():
            expected = _run(self._create(case), case, random_costs, 4)
            optimiser = self._create(case)
            for generation, genomes in enumerate(expected):
                asked, told = optimiser.ask(), frozen(genomes.copy())
                told_with = [frozen(array) for array in _told(optimiser, case, random_costs, genomes, generation)]
                require(np.array_equal(asked, genomes), "ask, tell: expected copies, but a caller's array is in use")
                optimiser.tell(told, *told_with)
                for array in (asked, told, *told_with):
                    scribble(array)

    def test_uses_no_other_randomness(self) -> None:
        """It leaves the global RNGs of Python and NumPy alone."""
        for case in self._cases():
            before = random.getstate(), to_json(np.random.get_state(legacy=False))
            _run(self._create(case), case, random_costs, 3)
            after = random.getstate(), to_json(np.random.get_state(legacy=False))
            require(before == after, "rng: expected no randomness but the generator's, but a global RNG was used")

    def test_answers_without_a_trace(self) -> None:
        """Its answer, if it has one, is genomes, the same in a restored run; asking for it changes nothing."""
        for case in self._cases():
            optimiser, resumed, unasked = self._create(case), self._create(case, seed=2), self._create(case)
            if not isinstance(optimiser, AnsweringOptimiser) or not isinstance(resumed, AnsweringOptimiser):
                return
            for generation in range(3):
                stored, answer = to_json(optimiser.state()), optimiser.answer()
                require_array("answer", answer, (None, case.space.size))
                accepted("answer", returned.check_bounds, answer, case.space)
                resumed.restore(from_json(stored))
                require(np.array_equal(resumed.answer(), answer), "answer: expected the same from a restored run")
                scribble(answer)
                require(to_json(optimiser.state()) == stored, "answer: expected it to change nothing, but it did")
                one, two = (_run(each, case, random_costs, 1, generation) for each in (optimiser, unasked))
                _require_equal_runs(one, two, "a run that was not asked for its answer")

    def test_maps_without_a_trace(self) -> None:
        """Its map, if it has one, is of genomes asked for, and the same in a restored run; a look changes nothing."""
        for case in self._cases():
            optimiser, resumed, unasked = self._create(case), self._create(case, seed=2), self._create(case)
            if not isinstance(optimiser, MappingOptimiser) or not isinstance(resumed, MappingOptimiser):
                return
            asked: list[FloatArray] = []
            for generation in range(3):
                stored, found = to_json(optimiser.state()), optimiser.behaviour_map()
                kept = accepted("behaviour_map", returned.behaviour_map, found, case.space, case.problem)
                known = {genome.tobytes() for genomes in asked for genome in genomes}
                strange = any(genome.tobytes() not in known for genome in kept.genomes)
                require(not strange, "behaviour_map: expected genomes that it asked for, got another")
                resumed.restore(from_json(stored))
                again = resumed.behaviour_map()
                same = (again.cells, again.objective) == (kept.cells, kept.objective)
                same &= np.array_equal(again.places, kept.places) and np.array_equal(again.genomes, kept.genomes)
                require(same, "behaviour_map: expected the same from a restored run")
                for array in (found.places, found.genomes):
                    if isinstance(array, np.ndarray) and array.flags.writeable:
                        array[:] = -1
                require(
                    to_json(optimiser.state()) == stored, "behaviour_map: expected it to change nothing, but it did"
                )
                one, two = (_run(each, case, random_costs, 1, generation) for each in (optimiser, unasked))
                _require_equal_runs(one, two, "a run that was not asked for its map")
                asked += one

    def test_begins_from_given_genomes(self) -> None:
        """If it can begin from given genomes, they make a difference, and the run is restored from its start, too."""
        for case in self._cases():
            for k in (1, 3):
                optimiser, resumed, other = self._create(case), self._create(case, seed=2), self._create(case)
                if not isinstance(optimiser, StartableOptimiser):
                    return
                given = frozen(np.clip(3 + random_genomes(case.space, k, seed=5), *case.space.bounds))
                optimiser.start_from(given)
                scribble(given)
                resumed.restore(from_json(to_json(optimiser.state())))
                begun, again, random = (_run(each, case, random_costs, 3) for each in (optimiser, resumed, other))
                _require_equal_runs(begun, again, "the run restored to its start from given genomes")
                differs = not np.array_equal(begun[0], random[0])
                require(differs, "start_from: expected other genomes than those of a run from its own, got the same")

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
        require_array("ask", genomes, (None, case.space.size))
        require(len(genomes) >= 1, "ask: expected at least one genome, got none")
        accepted("ask", returned.check_bounds, genomes, case.space)
        asked.append(genomes.copy())
        optimiser.tell(genomes, *_told(optimiser, case, costs, genomes, generation))
    return asked


def _require_equal_runs(expected: list[FloatArray], got: list[FloatArray], what: str) -> None:
    for i, (one, two) in enumerate(zip(expected, got, strict=True)):
        require(np.array_equal(one, two), f"ask: expected the same genomes from {what}; the call {i + 1} differs")


def _title(costs: Costs) -> str:
    return str(getattr(costs, "__name__", costs)).replace("_", " ")

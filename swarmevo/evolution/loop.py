# SPDX-License-Identifier: BSD-3-Clause
"""The loop: ask the optimiser, evaluate, tell it, store. Nothing here knows what the optimiser does.

All that a generation depends on is the optimiser's state after the one before, and both are stored in one transaction.
So a run that was killed and continued, however often, gives the same bits as one that never was. Results are kept as
they come: of a generation that was cut short only the jobs in work are run again.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Final, TypeAlias

import moocore
import numpy as np

from swarmevo import config as configuration
from swarmevo import plugins
from swarmevo.config import Config
from swarmevo.errors import ConfigError, EvaluationError, PluginError, StoreError
from swarmevo.evolution.evaluation import (
    Backend,
    Evaluation,
    Evaluator,
    JobResult,
    ThreadBackend,
    never,
    to_costs,
)
from swarmevo.plugins.checked import one_line, plugin_title
from swarmevo.protocols import FloatArray, GenomeSpace, Objective, Optimiser
from swarmevo.runs.provenance import provenance
from swarmevo.runs.store import Generation, InFlight, Store, encode_state
from swarmevo.testing import random_genomes

OPTIMISER_STREAM: Final = 0x0B7
"""Sets the optimiser's random numbers apart from the episodes'."""
RECENT_GENERATIONS: Final = 20
"""The time to go is estimated from so many."""


@dataclass(frozen=True)
class Progress:
    """Where a run stands after a generation."""

    trial: int
    """From 0."""
    generation: int
    """From 0; it has just been stored."""
    generations: int
    """In each trial."""
    trials: int
    episodes: int
    """Stored so far, in all trials."""
    episodes_per_second: float
    """In this generation."""
    best: Mapping[str, float]
    """For each objective the best mean in this generation."""
    front_size: int
    """Points that no other of this generation dominates; equal ones count once."""
    eta_seconds: float
    """To the end of the run."""


MakeBackend: TypeAlias = Callable[[str, int], Backend]
"""From a configuration as JSON and a number of workers."""


def begin(folder: str | os.PathLike[str], config: Config) -> None:
    """Make the folder of a new run, ready for :func:`evolve`.

    Args:
        folder: Must not exist.
        config: With a seed (``config.seeded``).

    Raises:
        ConfigError, EvaluationError, PluginError, SimulatorError: The configuration cannot be run; no folder is made.
        StoreError: The folder exists or cannot be made.
    """
    rehearse(config)
    with Evaluator(config, workers=1) as evaluator:
        _Guarded(config, evaluator, trial=0)
        text, origin = configuration.dump(config), origin_of(config, evaluator)
        Store.create(folder, text, origin, evaluator.objectives, evaluator.robots, evaluator.seed).close()


def rehearse(config: Config) -> None:
    """Evaluate an individual once, to find what shows only then: plugins that do not fit together, say.

    It has random weights and every switch on, so that it is as large as any that evolution can come upon. Nothing is
    done where a failed episode is to be recorded, not to end the run (``evolution.on_fault: worst``).

    Raises:
        ConfigError: The evaluation failed.
        EvaluationError, PluginError, SimulatorError: The plugins or the scene cannot be made.
    """
    if config.evolution.on_fault == "worst":
        return
    evolution = config.evolution.model_copy(update={"repeats": 1})
    with Evaluator(config.model_copy(update={"evolution": evolution}), workers=1) as evaluator:
        largest = random_genomes(evaluator.space, 1)
        largest[:, evaluator.space.is_switch] = 1.0
        try:
            evaluator.evaluate(largest, trial=0, generation=0)
        except EvaluationError as error:
            raise ConfigError(f"{error} (found on trial, in an individual with every switch on)") from error


def extend(store: Store, generations: str) -> int:
    """Change how many generations a run shall have; return the new number.

    Args:
        store: Open for writing.
        generations: In each trial: ``N``, or ``+N`` for so many more than now.

    Raises:
        ConfigError: It is no such number, too large, or fewer than a trial already has.
        StoreError: The folder cannot be written.
    """
    if not re.fullmatch(r"\+?[0-9]{1,9}", generations):
        raise ConfigError(f"generations: expected a whole number, or +N for so many more, got {generations!r}")
    now = store.config
    wanted = int(generations) + (now.evolution.generations if generations.startswith("+") else 0)
    stored = max((store.generations(trial) for trial in store.trials()), default=0)
    if wanted < stored:
        raise ConfigError(f"generations: expected at least the {stored} that are stored, got {wanted}")
    extended = configuration.load(store.config_path, [f"evolution.generations={wanted}"])
    if extended != now:
        store.replace_config(configuration.dump(extended))
    return wanted


def origin_of(config: Config, evaluator: Evaluator) -> dict[str, Any]:
    """Return the provenance of what is evaluated here and now."""
    chosen = {"controller": config.controller, "fitness": config.fitness, "optimiser": config.optimiser}
    found = [str(plugins.find(kind, name)) for kind, names in chosen.items() for name in names]
    return {**provenance(configuration.dump(config), found, evaluator.library), **evaluator.machines}


def evolve(
    store: Store,
    workers: int,
    observe: Callable[[Progress], None],
    stop: Callable[[], bool] = never,
    backend: MakeBackend = ThreadBackend,
) -> None:
    """Run every trial of a run from its last stored generation to the end.

    Args:
        store: Open for writing.
        workers: Episodes to run at once; 0 is one for each processor. The results do not depend on it.
        observe: Told after each generation.
        stop: Asked between jobs; when true, the jobs in work are dropped; the run can be continued.
        backend: Where episodes run. The results do not depend on it.

    Raises:
        EvaluationError, PluginError, SimulatorError: Something failed; the generations stored before are kept.
        Interrupted: ``stop`` said so.
        StoreError: The folder cannot be written, or its plugins now measure something else.
    """
    config = store.config
    with Evaluator(config, workers, backend) as evaluator:
        check_objectives(store, evaluator)
        store.begin_session(origin_of(config, evaluator))
        run = _Run(store, config, evaluator, observe, stop)
        for trial in range(config.evolution.trials):
            run.finish(trial)


class _Run:
    """A run in progress."""

    def __init__(
        self,
        store: Store,
        config: Config,
        evaluator: Evaluator,
        observe: Callable[[Progress], None],
        stop: Callable[[], bool],
    ) -> None:
        self._store = store
        self._config = config
        self._evaluator = evaluator
        self._observe = observe
        self._stop = stop
        self._episodes = store.totals().episodes
        evolution = config.evolution
        self._to_go = sum(max(0, evolution.generations - store.generations(t)) for t in range(evolution.trials))
        self._recent: list[float] = []  # seconds of the latest generations

    def finish(self, trial: int) -> None:
        """Run what is missing of a trial."""
        first, last = self._store.generations(trial), self._config.evolution.generations
        if first >= last:
            return
        optimiser = _Guarded(self._config, self._evaluator, trial)
        optimiser.restore(self._store.state(trial), first)
        for generation in range(first, last):
            self._step(optimiser, trial, generation)

    def _step(self, optimiser: _Guarded, trial: int, generation: int) -> None:
        started = perf_counter()
        genomes = optimiser.ask(generation)
        evaluation, seconds = self._evaluate(genomes, trial, generation)
        optimiser.tell(generation, genomes, evaluation.costs)
        state = optimiser.state(generation)
        self._store.append(trial, generation, _record(genomes, evaluation, seconds), state)
        self._recent = [*self._recent, perf_counter() - started][-RECENT_GENERATIONS:]
        self._episodes += evaluation.hash.size
        self._to_go -= 1
        self._observe(self._progress(trial, generation, evaluation))

    def _evaluate(self, genomes: FloatArray, trial: int, generation: int) -> tuple[Evaluation, float]:
        """Run what is not kept of a generation; return all of it, and the seconds that it took in all sessions."""
        kept = self._store.in_flight(trial, generation, genomes)

        def keep(result: JobResult, seconds: float) -> None:
            episodes = _in_flight(result, self._config.evolution.repeats, kept.seconds + seconds)
            self._store.keep(trial, generation, genomes, episodes)

        known = _known(kept, self._config.evolution.repeats)
        evaluation = self._evaluator.evaluate(genomes, trial, generation, self._stop, known, keep)
        return evaluation, kept.seconds + evaluation.seconds

    def _progress(self, trial: int, generation: int, evaluation: Evaluation) -> Progress:
        evolution = self._config.evolution
        return Progress(
            trial=trial,
            generation=generation,
            generations=evolution.generations,
            trials=evolution.trials,
            episodes=self._episodes,
            episodes_per_second=evaluation.hash.size / self._recent[-1],
            best=_best(self._evaluator.objectives, evaluation.costs),
            front_size=int(np.count_nonzero(moocore.is_nondominated(evaluation.costs))),
            eta_seconds=self._to_go * sum(self._recent) / len(self._recent),
        )


def _in_flight(result: JobResult, repeats: int, seconds: float) -> InFlight:
    individual, repeat = np.divmod(result.places, repeats)
    return InFlight(**result.results(), individual=individual, repeat=repeat, seconds=seconds)


def _known(kept: InFlight, repeats: int) -> JobResult:
    return JobResult(
        **kept.results(),
        places=kept.individual * repeats + kept.repeat,
        faults=("",) * len(kept.hash),
        seconds=kept.seconds,
    )


def _record(genomes: FloatArray, evaluation: Evaluation, seconds: float) -> Generation:
    return Generation(**evaluation.results(), genomes=genomes, faults=evaluation.faults, seconds=seconds)


def _best(objectives: list[Objective], costs: FloatArray) -> dict[str, float]:
    least = to_costs(objectives, costs.min(axis=0))  # a second time: back to the objectives' own directions
    return {objective.name: float(value) for objective, value in zip(objectives, least, strict=True)}


def check_objectives(store: Store, evaluator: Evaluator) -> None:
    """Refuse plugins that measure something else than those that the run began with.

    Raises:
        StoreError: They do.
    """
    if (now := tuple(evaluator.objectives)) != store.objectives:
        raise StoreError(
            f"{store.folder}: expected the objectives {store.objectives}, the plugins now have {now}; "
            "install the versions of the plugins that the run began with"
        )


# ---- the optimiser, checked ------------------------------------------------------------------------------------------


class _Guarded:
    """The configured optimiser of a trial; what it returns is checked, what it raises is explained.

    It gets copies and gives copies: nothing that it does later changes what was evaluated or stored.
    """

    def __init__(self, config: Config, evaluator: Evaluator, trial: int) -> None:
        ((self._name, options),) = config.optimiser.items()
        self._title = plugin_title("optimiser", self._name)
        self._trial = trial
        self._space: GenomeSpace = evaluator.space
        rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence([evaluator.seed, trial, OPTIMISER_STREAM])))
        self._made: Optimiser = plugins.create(
            "optimiser",
            self._name,
            options,
            evaluator.space,
            config.evolution.population,
            len(evaluator.objectives),
            rng,
        )

    def restore(self, state: Mapping[str, Any] | None, generation: int) -> None:
        """Continue from a stored state; None: begin."""
        if state is not None:
            self._call("restore", generation, state)

    def ask(self, generation: int) -> FloatArray:
        """Return the genomes to evaluate, ``(n, size)``."""
        genomes = self._call("ask", generation)
        wrong = self._wrong_with(genomes)
        if wrong:
            raise self._error("ask", generation, wrong)
        return np.array(genomes, order="C")

    def _wrong_with(self, genomes: object) -> str:
        size = self._space.size
        if not isinstance(genomes, np.ndarray):
            return f"expected a NumPy array, got {type(genomes).__name__}"
        if genomes.dtype != np.float64:
            return f"expected dtype float64, got {genomes.dtype}"
        if genomes.ndim != 2 or genomes.shape[0] < 1 or genomes.shape[1] != size:
            return f"expected the shape (n, {size}) with n >= 1, got {genomes.shape}"
        if not (finite := np.isfinite(genomes)).all():
            row, column = np.argwhere(~finite)[0]
            return f"expected finite numbers, got {genomes[row, column]} in genome {row}, gene {column}"
        return ""

    def tell(self, generation: int, genomes: FloatArray, costs: FloatArray) -> None:
        """Tell the costs ``(n, m)`` of the genomes just asked for."""
        told = genomes.copy(), costs.copy()
        for array in told:
            array.flags.writeable = False
        self._call("tell", generation, *told)

    def state(self, generation: int) -> str:
        """Return the optimiser's state as it is stored."""
        state = self._call("state", generation)
        try:
            return encode_state(state)
        except TypeError as error:
            raise self._error("state", generation, str(error)) from error

    def _call(self, method: str, generation: int, *arguments: object) -> Any:
        try:
            return getattr(self._made, method)(*arguments)
        except Exception as error:  # whatever a stranger's plugin raises
            raise self._error(method, generation, f"raised {one_line(error)}") from error

    def _error(self, method: str, generation: int, reason: str) -> PluginError:
        return PluginError(
            f"{self._title}: {method}, trial {self._trial}, generation {generation}: {reason}; repair the plugin, then "
            "continue the run: all generations before are stored"
        )

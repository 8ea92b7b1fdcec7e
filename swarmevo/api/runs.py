# SPDX-License-Identifier: BSD-3-Clause
"""Runs: begun, continued, opened."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from swarmevo import config as configuration
from swarmevo.analysis import assessment, elites, fronts, tracking
from swarmevo.analysis.assessment import REPEATS
from swarmevo.analysis.fronts import FrontPoint, Summary
from swarmevo.analysis.table_ii import Assessment
from swarmevo.api.individuals import Elites, Front, Individual
from swarmevo.config import Config
from swarmevo.errors import ConfigError
from swarmevo.evolution.loop import Progress
from swarmevo.evolution.threads import MakeBackend, ThreadBackend
from swarmevo.plugins import team, trackers
from swarmevo.plugins.team import never
from swarmevo.protocols import Objective
from swarmevo.runs import driver, verification
from swarmevo.runs.store import Store
from swarmevo.views import notebook, text


def load_config(source: str | os.PathLike[str] | None = None, set: Mapping[str, Any] | None = None) -> Config:
    """Read a configuration and check all of it: keys, the world, the plugins and their options.

    Args:
        source: A YAML file, or the bare name of a packaged configuration, such as ``paper``; None is ``quick``.
        set: ``{"section.key": value}``, which win over the file.

    Raises:
        ConfigError: With everything that is wrong.
    """
    return team.load_config(_named(source), configuration.as_overrides(set or {}))


def _named(source: str | os.PathLike[str] | None) -> str | None:
    """Return the file or name of a configuration."""
    try:
        return os.fspath(source) if source else None
    except TypeError:
        expected = "a YAML file, the name of a packaged configuration or a Config"
        raise ConfigError(
            f"config: expected {expected}, got {type(source).__name__}; single keys are for set"
        ) from None


def evolve(
    config: str | os.PathLike[str] | Config | None = None,
    *,
    seed: int | None = None,
    out: str | os.PathLike[str] | None = None,
    set: Mapping[str, Any] | None = None,
    workers: int = 0,
    scheduler: str | None = None,
    log: Sequence[str] = (),
    observe: Callable[[Progress], None] = lambda now: None,
    stop: Callable[[], bool] = never,
) -> Run:
    """Evolve controllers in a new run folder. The same bits as the command line with the same seed.

    Args:
        config: A YAML file, the name of a packaged configuration, or one already read; None is ``quick``.
        seed: Random seed of the run; drawn and stored if omitted.
        out: The run folder to make, which must not exist; else a new ``runs/NAME-DATE-SEED``, with a number
            behind it where another run has that name.
        set: ``{"section.key": value}``, which win over the configuration.
        workers: Episodes to run at once; 0 is one for each processor. The results do not depend on it.
        scheduler: Address of a Dask cluster to run on, such as ``tcp://host:8786``, instead of ``workers`` here. The
            results do not depend on it.
        log: Names of trackers, such as ``tensorboard``, which are told the numbers of each generation.
        observe: Told after each generation, once it is stored.
        stop: Asked between jobs; when true, the run ends with :class:`swarmevo.errors.Interrupted` and can be resumed.

    Raises:
        ConfigError: The configuration cannot be used, a key is set twice, or ``workers`` with ``scheduler``; no folder
            is made.
        EvaluationError, PluginError, SimulatorError: Something failed; the generations before are stored.
        StoreError: The folder exists or cannot be written.
    """
    given = configuration.as_overrides(set or {}) + ([] if seed is None else [f"evolution.seed={seed}"])
    if isinstance(config, Config):
        settings, name = configuration.changed(config, given), "run"
    else:
        source = _named(config)
        settings, name = team.load_config(source, given), Path(source or "quick").stem
    settings = configuration.seeded(settings)
    _backend(scheduler, workers)  # refused before a folder is made
    trackers.check(log)
    folder = driver.begin(out, settings, name=name)
    return resume(folder, workers=workers, scheduler=scheduler, log=log, observe=observe, stop=stop)


def resume(
    folder: str | os.PathLike[str],
    *,
    generations: int | str | None = None,
    workers: int = 0,
    scheduler: str | None = None,
    log: Sequence[str] = (),
    observe: Callable[[Progress], None] = lambda now: None,
    stop: Callable[[], bool] = never,
    accept_changed_plugin: bool = False,
) -> Run:
    """Go on with an interrupted or finished run; the result is that of a run never interrupted.

    Args:
        folder: Of the run.
        generations: Make the run longer: so many in all, or ``"+N"`` for so many more.
        workers: As in :func:`evolve`.
        scheduler: As in :func:`evolve`.
        log: As in :func:`evolve`; what earlier generations lack there is made up for.
        observe: As in :func:`evolve`.
        stop: As in :func:`evolve`.
        accept_changed_plugin: Go on though a plugin is not what it was: results of both are then in one run.

    Raises:
        ConfigError: ``generations`` is refused, or ``workers`` with ``scheduler``.
        EvaluationError, PluginError, SimulatorError: As :func:`evolve`.
        StoreError: The folder is no run, is being written by another process, cannot be written, or a plugin was
            changed.
    """
    backend = _backend(scheduler, workers)
    with Store.open(folder, readonly=False) as store:
        if generations is not None:
            driver.extend(store, str(generations), accept_changed_plugin)
        with tracking.tracked(store, log, observe, warnings.warn) as tell:
            driver.evolve(store, workers, tell, stop, backend, accept_changed_plugin)
    return Run(folder)


def _backend(scheduler: str | None, workers: int) -> MakeBackend:
    if scheduler is None:
        return ThreadBackend
    if workers:
        raise ConfigError(f"workers: expected 0 with a scheduler, whose workers are used, got {workers}")
    from swarmevo.evolution import cluster  # Dask is an extra

    return cluster.backend(scheduler, lambda line: None)


def open(folder: str | os.PathLike[str]) -> Run:
    """Open a run to look at it; possible at any time, while it is being written too.

    Raises:
        StoreError: It is no run folder, of another schema version, or damaged.
    """
    return Run(folder)


class Run:
    """A run folder, read anew with every question: it may be growing.

    Every method raises StoreError where the folder cannot be read.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder)
        with self.store() as store:
            self.config: Config = store.config
            self.seed: int = store.seed
            self.objectives: tuple[Objective, ...] = store.objectives

    def __fspath__(self) -> str:
        """Return the folder, so that figures take a run too."""
        return str(self.folder)

    def store(self) -> Store:
        """Open the folder to read all that is in it; use as a context manager."""
        return Store.open(self.folder)

    def summary(self) -> Summary:
        """Return fronts, hypervolume by generation and cost, as ``swarmevo show`` tells them."""
        with self.store() as store:
            return fronts.summarise(store)

    def front(self, trial: int | None = None) -> Front:
        """Return the non-dominated individuals of a trial, or of all trials; the best first objective first."""
        with self.store() as store:
            points = fronts.front(store, trial)
            return Front(self._individuals(store, points), self.objectives, self.folder.name)

    def elites(self, trial: int | None = None) -> Elites | None:
        """Return the map of behaviours that the optimiser of a trial keeps; None: it keeps none.

        Args:
            trial: None: the better elite of each cell, of all trials.

        Raises:
            EvaluationError, PluginError, SimulatorError, StoreError: As :func:`swarmevo.analysis.elites.elites`.
        """
        with self.store() as store:
            found = elites.elites(store, trial)
            return Elites(self._individuals(store, found.points), found, self.folder.name) if found else None

    def _individuals(self, store: Store, points: Sequence[FrontPoint]) -> list[Individual]:
        return [Individual(self.folder, self.config, point, store.genome(point.genome)) for point in points]

    def table_ii(self, sizes: tuple[int, ...] | None = None, repeats: int = REPEATS, workers: int = 0) -> Assessment:
        """Test the controllers of all fronts on fresh seeds in teams of some sizes: the paper's Table II.

        Without ``sizes`` they are one to five, and that which was evolved.
        Tests add up in the run folder: only those are run that are not stored, and there may be more than ``repeats``.

        Raises:
            ConfigError, EvaluationError, SimulatorError, StoreError: As :func:`swarmevo.analysis.assessment.assess`.
        """
        with self.store() as store:
            return assessment.assess(store, sizes, repeats, workers=workers)

    def verify(self, sample: int | None = None, workers: int = 0) -> verification.Report:
        """Simulate stored evaluations anew, all or a random sample, and compare them bit by bit.

        Raises:
            EvaluationError, PluginError, SimulatorError: The run's configuration cannot be run here.
        """
        with self.store() as store:
            return verification.verify(store, workers, sample)

    def __repr__(self) -> str:
        return f"<Run {self.folder}: {self._facts()['trials']}, seed {self.seed}>"

    def _repr_html_(self) -> str:
        return notebook.facts(f"Run {self.folder.name}", self._facts())

    def _facts(self) -> dict[str, str]:
        planned = self.config.evolution
        with self.store() as store:
            totals = store.totals()
            stored = text.grouped(sum(store.generations(trial) for trial in range(planned.trials)))
        every = planned.trials * planned.generations
        return {
            "trials": f"{text.count(planned.trials, 'trial')}, {stored} of {text.count(every, 'generation')}",
            "episodes": text.count(totals.episodes, "episode"),
            "objectives": ", ".join(text.label(objective) for objective in self.objectives),
            "seed": str(self.seed),
            "folder": str(self.folder),
        }

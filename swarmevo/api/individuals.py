# SPDX-License-Identifier: BSD-3-Clause
"""Individuals of a run: on a front, simulated, tested, replayed."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Self, overload

from swarmevo import config as configuration
from swarmevo.analysis import assessment, elites, shipped
from swarmevo.analysis.fronts import FrontPoint
from swarmevo.analysis.measures import Measures, measures_of
from swarmevo.analysis.recording import Recording, record
from swarmevo.analysis.statistics import wilson
from swarmevo.analysis.table_ii import Outcome, outcome
from swarmevo.config import Config, Surroundings, surroundings
from swarmevo.errors import InvalidArgument, SwarmevoError
from swarmevo.protocols import FloatArray, IntArray, Objective
from swarmevo.runs import files, other_world
from swarmevo.runs.store import Store
from swarmevo.runs.tests import GENERATION
from swarmevo.simulation import EpisodeKey, layout
from swarmevo.views import notebook, text
from swarmevo.views.replay import data as replay_data
from swarmevo.views.replay import episode as replay_episode
from swarmevo.views.replay import page as replay_page

_MOST_EPISODES: Final = 65535
"""With one seed: their keys count them in 16 bits."""


class _Individuals(Sequence["Individual"]):
    """Some individuals of a run, in an order."""

    def __init__(self, individuals: Sequence[Individual], objectives: Sequence[Objective], run: str) -> None:
        self._individuals = list(individuals)
        self.objectives = tuple(objectives)
        self._run = run

    def _part(self, i: slice) -> Self:
        return type(self)(self._individuals[i], self.objectives, self._run)

    @overload
    def __getitem__(self, i: int) -> Individual: ...
    @overload
    def __getitem__(self, i: slice) -> Self: ...
    def __getitem__(self, i: int | slice) -> Individual | Self:
        """Return an individual, or some of them."""
        return self._part(i) if isinstance(i, slice) else self._individuals[i]

    def __len__(self) -> int:
        return len(self._individuals)

    def __iter__(self) -> Iterator[Individual]:
        return iter(self._individuals)

    def best(self, objective: str | None = None) -> Individual:
        """Return the best individual in an objective; None is the first.

        Raises:
            SwarmevoError: There is no such objective, or there is nobody.
        """
        names = [one.name for one in self.objectives]
        name = objective or names[0]
        if name not in names:
            raise SwarmevoError(
                f"{type(self).__name__.lower()}: expected one of the objectives {', '.join(names)}, got {name!r}"
            )
        if not self._individuals:
            raise SwarmevoError(f"{type(self).__name__.lower()}: expected at least one individual, got none")
        largest = self.objectives[names.index(name)].is_maximised
        return (max if largest else min)(self._individuals, key=lambda one: one.objectives[name])

    @property
    def rows(self) -> list[dict[str, Any]]:
        """For each individual its objectives, its descriptors and what else is known of it, by name."""
        return [one.row for one in self._individuals]

    def frame(self) -> Any:
        """Return the rows as a pandas DataFrame.

        Raises:
            ImportError: pandas is not installed.
        """
        import pandas

        return pandas.DataFrame(self.rows)

    def __repr__(self) -> str:
        names = ", ".join(objective.name for objective in self.objectives)
        return f"<{type(self).__name__} of {self._run}: {text.count(len(self), 'individual')}; {names}>"

    def _repr_html_(self) -> str:
        return notebook.table(f"{type(self).__name__} of {self._run}", self.rows)


class Front(_Individuals):
    """Non-dominated individuals, the best first objective first."""


class Elites(_Individuals):
    """The map of behaviours that an optimiser keeps: the best that it knows of each kind, in the order of cells."""

    def __init__(self, individuals: Sequence[Individual], found: elites.Elites, run: str) -> None:
        super().__init__(individuals, [found.objective], run)
        self._found = found

    @property
    def cells(self) -> tuple[int, ...]:
        """Along each descriptor."""
        return self._found.cells

    @property
    def places(self) -> IntArray:
        """``(k, descriptors)``: the cell of each, from 0 at the lower end of each range."""
        return self._found.places

    @property
    def coverage(self) -> float:
        """Share of the cells that have an elite."""
        return self._found.coverage

    @property
    def qd_score(self) -> float:
        """Sum over the elites of how much better each is than the worst end of the objective's range."""
        return self._found.qd_score

    def _part(self, i: slice) -> Self:
        found = dataclasses.replace(self._found, points=self._found.points[i], places=self._found.places[i])
        return type(self)(self._individuals[i], found, self._run)


class Controller:
    """A controller to simulate, test and replay: :func:`swarmevo.best` is one."""

    def __init__(self, config: Config, genes: FloatArray, title: str, trial: int = 0) -> None:
        self._config, self._title = config, title
        self.genes = genes
        self.trial = trial

    def simulate(
        self,
        episodes: int = 1,
        *,
        robots: int | None = None,
        set: Mapping[str, Any] | None = None,
        seed: int | None = None,
        threads: int = 0,
    ) -> Episodes:
        """Simulate episodes that evolution never saw, keep all their telemetry and judge them.

        Args:
            episodes: How many.
            robots: Size of the team; None is the run's.
            set: ``{"section.key": value}``: another world than the run's.
            seed: Of everything random; None is the run's. The same gives the same bits.
            threads: 0 is one for each processor.

        Raises:
            ConfigError: Something is refused.
            EvaluationError: An episode or a plugin failed.
            SimulatorError: The world does not take such a team.
        """
        config, genes = self._world(robots, set)
        found = record(config, genes, self._keys(episodes, seed), threads)
        return Episodes(**{field.name: getattr(found, field.name) for field in dataclasses.fields(found)})

    def test(
        self,
        episodes: int = 300,
        *,
        robots: int | None = None,
        set: Mapping[str, Any] | None = None,
        seed: int | None = None,
        confidence: float = 0.95,
    ) -> Rates:
        """Return how often it succeeds in episodes that evolution never saw, and how sure that is.

        Args:
            episodes: How many; the first are those of ``swarmevo test``.
            robots: As in :meth:`simulate`.
            set: As in :meth:`simulate`.
            seed: As in :meth:`simulate`.
            confidence: That an interval holds the true rate.

        Raises:
            ConfigError, EvaluationError, SimulatorError: As :meth:`simulate`.
        """
        config, genes = self._world(robots, set)
        keys = self._keys(episodes, seed)
        evolution = config.evolution.model_copy(update={"seed": keys[0].seed})
        settings = config.model_copy(update={"evolution": evolution})
        return Rates(*assessment.assess_one(settings, genes, episodes, self.trial), confidence, surroundings(settings))

    def replay(
        self, *, seed: int | None = None, robots: int | None = None, set: Mapping[str, Any] | None = None
    ) -> Replay:
        """Return an episode to look at, in a notebook or as a page of its own.

        Args:
            seed: Of the episode; None is the configuration's.
            robots: As in :meth:`simulate`.
            set: As in :meth:`simulate`.

        Raises:
            ConfigError, EvaluationError, SimulatorError: As :meth:`simulate`.
        """
        config, genes = self._world(robots, set)
        (key,) = self._keys(1, seed)
        recording = record(config, genes, [key], threads=1)
        return Replay(self._title, [replay_data.data(recording, self._title, f"seed {key.seed}")])

    def _world(self, robots: int | None, set: Mapping[str, Any] | None) -> tuple[Config, FloatArray]:
        config = other_world.changed(self._config, _overrides(set))
        return other_world.team_of(config, self.genes, config.team.robots if robots is None else robots)

    def _keys(self, episodes: int, seed: int | None) -> list[EpisodeKey]:
        chosen = self._config.evolution.seed if seed is None else seed
        assert chosen is not None  # a run's configuration has one
        if not 0 <= chosen < 2**64:
            raise InvalidArgument(f"seed: expected 0 to 2**64 - 1, got {chosen}")
        if not 1 <= episodes <= _MOST_EPISODES:
            raise InvalidArgument(f"episodes: expected 1 to {_MOST_EPISODES}, got {episodes}")
        return [EpisodeKey(chosen, self.trial, GENERATION, repeat) for repeat in range(episodes)]

    def __repr__(self) -> str:
        return f"<Controller: {self._title}>"


class Individual(Controller):
    """A genome of a run, and what its stored episodes say of it."""

    def __init__(self, folder: Path, config: Config, point: FrontPoint, genes: FloatArray) -> None:
        super().__init__(config, genes, f"{folder.resolve().name}, individual {point.genome}", point.trial)
        self._folder, self._point = folder, point
        self.id = point.genome
        self.objectives = dict(point.objectives)
        self.descriptors = dict(point.descriptors)
        self.generation = point.last_generation
        """In which it was last evaluated."""

    @property
    def row(self) -> dict[str, Any]:
        """What is known of it, by name."""
        known = dataclasses.asdict(self._point)
        return {**known.pop("objectives"), **known.pop("descriptors"), **known}

    def replay(
        self, *, seed: int | None = None, robots: int | None = None, set: Mapping[str, Any] | None = None
    ) -> Replay:
        """Return an episode to look at, in a notebook or as a page of its own.

        Args:
            seed: Of a new episode. None: the most successful stored one, which is simulated once more and compared bit
                by bit.
            robots: As in :meth:`simulate`; not the stored episode then.
            set: As in :meth:`simulate`; not the stored episode then.

        Raises:
            ConfigError, EvaluationError, SimulatorError: As :meth:`simulate`.
            ReplayError: The trajectory is not the stored one.
        """
        if seed is not None:
            return super().replay(seed=seed, robots=robots, set=set)
        with Store.open(self._folder) as store:
            chosen = replay_episode.chosen_of(store, self.id, self.trial)
            sizes = [] if robots is None else [robots]
            shown, _ = replay_episode.episodes(store, chosen, sizes, overrides=_overrides(set))
        return Replay(self._title, shown)

    def _world(self, robots: int | None, set: Mapping[str, Any] | None) -> tuple[Config, FloatArray]:
        with Store.open(self._folder) as store:
            config = other_world.load(store, _overrides(set))
        return other_world.team_of(config, self.genes, config.team.robots if robots is None else robots)

    def __repr__(self) -> str:
        values = ", ".join(f"{name} {value:.4g}" for name, value in self.objectives.items())
        return f"<Individual {self.id} of trial {self.trial}: {values}>"

    def _repr_html_(self) -> str:
        return notebook.facts(f"Individual {self.id}", dict(notebook.named(self.row)))


class Episodes(Recording):
    """Episodes of one individual: ``telemetry``, objectives as ``values``, ``push_time`` and ``homing_time``."""

    @property
    def push_time(self) -> FloatArray:
        """``(episodes,)`` [s]; NaN: the box never came to the wall."""
        return self.telemetry.push_time

    @property
    def homing_time(self) -> FloatArray:
        """``(episodes, robots)`` [s]; NaN: it never came within the emitter's range."""
        return self.telemetry.homing_time

    def _repr_html_(self) -> str:
        found = outcome(self.config.team.robots, self.homing_time, self.push_time, self.objectives, self.values)
        means = {
            text.words(o.name): text.number(value)
            for o, value in zip(self.objectives, self.values.mean(axis=0), strict=True)
        }
        rates = _rates(found, measures_of(self.config, self.objectives), surroundings(self.config))
        title = f"{text.count(len(self), 'episode')} of one individual"
        return notebook.facts(title, {**means, **{name: said for name, said, _ in rates}})


@dataclass(frozen=True)
class Rates:
    """How often an individual succeeds. An interval is Wilson's, with the episodes as the independent trials."""

    outcome: Outcome
    """Rates and times, and means of the objectives."""
    measures: Measures
    """Which of them say something of the task."""
    confidence: float
    scene: Surroundings
    """What there is, which says how the rates are called."""

    @property
    def push(self) -> tuple[float, float]:
        """Interval of the share of episodes in which the box came to the wall."""
        return self._interval(self.outcome.push_rate)

    @property
    def homing(self) -> tuple[float, float]:
        """Interval of the share of robots that came within the emitter's range."""
        return self._interval(self.outcome.homing_rate)

    @property
    def successes(self) -> dict[str, tuple[float, float]]:
        """For each objective that says what a success is, the interval of the share of episodes that were one."""
        return {name: self._interval(rate) for name, rate in self.outcome.success_rates.items()}

    def _interval(self, rate: float) -> tuple[float, float]:
        return wilson(rate * self.outcome.tests, self.outcome.tests, self.confidence)

    def _facts(self) -> dict[str, str]:
        facts = {}
        for name, said, rate in _rates(self.outcome, self.measures, self.scene):
            low, high = self._interval(rate)
            facts[name] = f"{said} ({self.confidence:.0%} interval {low:.1%} to {high:.1%})"
        means = {text.words(name): text.mean(*one) for name, one in self.outcome.objectives.items()}
        return facts if self.measures.paper else {**facts, **means}

    def __repr__(self) -> str:
        said = "; ".join(f"{name} {value}" for name, value in self._facts().items())
        return f"<{text.count(self.outcome.tests, 'episode')}, {text.count(self.outcome.robots, 'robot')}: {said}>"

    def _repr_html_(self) -> str:
        return notebook.facts(text.count(self.outcome.tests, "episode"), self._facts())


class Replay:
    """Episodes as a page that plays them and needs no network; shows itself in a notebook."""

    def __init__(self, title: str, episodes: list[dict[str, Any]]) -> None:
        self._title, self._episodes = title, episodes

    @property
    def html(self) -> str:
        """The page."""
        return replay_page.render(self._episodes, self._title)

    def save(self, file: str | os.PathLike[str]) -> Path:
        """Write the page and return its file.

        Raises:
            OutputError: It cannot be written.
        """
        files.write(Path(file), self.html)
        return Path(file)

    def __repr__(self) -> str:
        return f"<Replay of {self._title}; .save(FILE) writes a page>"

    def _repr_html_(self) -> str:
        return notebook.frame(self.html)


def best() -> Controller:
    """Return the controller that comes with swarmevo, in the paper's world."""
    return Controller(*shipped.best(), shipped.TITLE)


def _overrides(set: Mapping[str, Any] | None) -> list[str]:
    return configuration.as_overrides(set or {})


def _rates(found: Outcome, measures: Measures, scene: Surroundings) -> Iterator[tuple[str, str, float]]:
    """Yield of each rate of success its name, what is said of it, and the rate."""
    if measures.homing:
        yield (
            text.homing(layout.homing_emitters(scene)),
            text.rate(found.homing_rate, found.homing_time),
            found.homing_rate,
        )
    if measures.push:
        yield text.delivery(scene), text.rate(found.push_rate, found.push_time), found.push_rate
    for objective in measures.successes:
        rate = found.success_rates[objective.name]
        yield text.plain(text.success(objective)), text.percent(rate), rate

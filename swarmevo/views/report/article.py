# SPDX-License-Identifier: BSD-3-Clause
"""What a report shows of a run, as its template takes it: tiles, tables, figures and where it comes from."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from markupsafe import Markup

from swarmevo.analysis import assessment
from swarmevo.analysis.fronts import FrontPoint
from swarmevo.errors import EvaluationError
from swarmevo.protocols import Objective
from swarmevo.runs.folder import CONFIG_FILE
from swarmevo.runs.store import Store
from swarmevo.views import figures, html, text
from swarmevo.views.report import tables
from swarmevo.views.report.run import Run
from swarmevo.views.report.tables import Table


@dataclass(frozen=True)
class Tile:
    """A number that stands out."""

    name: str
    value: str
    aside: str
    """A remark."""


@dataclass(frozen=True)
class Figure:
    """A drawing and what is said of it."""

    drawing: Markup
    caption: str


@dataclass(frozen=True)
class Article:
    """All that is shown of a run."""

    run: Run
    tiles: list[Tile]
    individual: bool
    """Each robot has a genome of its own."""
    front: Table
    networks: list[tuple[FrontPoint, Markup]]
    """Of the points whose controllers are networks."""
    evolution: list[Figure]
    behaviour: list[Figure]
    behaviour_fault: str
    """Why there are none of them: a test failed; else empty."""
    untested: int
    """Controllers on the fronts without some of the tests."""
    table_ii: Table | None
    """None, as those below: the run was not tested."""
    robustness: Table | None
    gap: Table | None
    test_command: str
    origin: list[tuple[str, str]]
    """Names and values."""
    config: str
    """YAML."""


def article(store: Store, run: Run) -> Article:
    """Return what is shown of a run."""
    tests = run.tests
    behaviour, fault = _behaviour(store, run)
    return Article(
        run=run,
        tiles=list(_tiles(run)),
        individual=store.config.team.has_own_genomes,
        front=tables.front(run),
        networks=list(_networks(store, run)),
        evolution=list(_evolution(store)),
        behaviour=behaviour,
        behaviour_fault=fault,
        untested=tests.untested if tests else 0,
        table_ii=tables.table_ii(run, tests) if tests else None,
        robustness=tables.robustness(run, tests) if tests else None,
        gap=tables.gap(store.objectives[0], tests) if tests else None,
        test_command=f"swarmevo test {shlex.quote(str(store.folder))}",
        origin=_origin(store, run),
        config=(store.folder / CONFIG_FILE).read_text(encoding="utf-8"),
    )


def _tiles(run: Run) -> Iterator[Tile]:
    summary, cost = run.summary, run.summary.cost
    best, first = summary.front[0], summary.objectives[0].name  # the front begins with the best first objective
    beside = [f"{text.words(name)} {text.number(value)}" for name, value in best.objectives.items() if name != first]
    aside = ", ".join([f"individual {best.genome}", *beside])
    if summary.measures.rates:
        name, rate = run.rates(run.opened)[0]
        yield Tile(
            name, text.percent(rate), f"individual {run.opened.genome}, {text.count(run.opened.episodes, 'episode')}"
        )
    yield Tile(f"best mean {text.words(first)}", text.number(best.objectives[first]), aside)
    yield Tile("front", text.count(len(summary.front), "point"), f"over {text.count(len(summary.trials), 'trial')}")
    volumes = [trial.history[-1].hypervolume for trial in summary.trials]
    yield Tile("hypervolume", text.number(max(volumes)), f"best of {text.count(len(volumes), 'trial')}")
    aside = f"in {text.duration(cost.seconds)}: {text.speed(cost)}"
    yield Tile("simulated", text.duration(cost.simulated_seconds), aside)


# ---- figures ---------------------------------------------------------------------------------------------------------


def overlays(runs: Sequence[tuple[Run, Path]]) -> tuple[list[Figure], list[str]]:
    """Return fronts and hypervolumes of those runs that share their objectives, and the names of the others."""
    groups: list[tuple[list[Objective], dict[str, Path]]] = []
    for run, folder in runs:
        same = next((group for objectives, group in groups if objectives == run.summary.objectives), None)
        if same is None:
            groups.append((run.summary.objectives, {run.name: folder}))
        else:
            same[run.name] = folder
    made: list[Figure] = []
    for _, group in groups:
        if len(group) > 1:
            whose = "the runs" if len(groups) == 1 else ", ".join(group)
            fronts, volumes = figures.fronts_of_runs(group, width=6.2), figures.hypervolume_of_runs(group, width=6.2)
            made.append(_figure(fronts, f"The global fronts of {whose}."))
            caption = "Hypervolume over the generations: each run's median, and, thin, its trials."
            made.append(_figure(volumes, caption))
    return made, [name for _, group in groups if len(group) == 1 for name in group]


def _figure(picture: figures.Picture, caption: str) -> Figure:
    return Figure(html.drawing(figures.svg(picture)), caption)


def _networks(store: Store, run: Run) -> Iterator[tuple[FrontPoint, Markup]]:
    for point in run.points:
        with suppress(EvaluationError):  # the controller fails now: the point has no replay, and says why
            if figures.has_network(store.config, store.genome(point.genome)):
                yield point, html.drawing(figures.svg(figures.network(store, point.genome)))


def _evolution(store: Store) -> Iterator[Figure]:
    yield _figure(
        figures.hypervolume(store, figures.SCREEN), "Hypervolume over the generations, judged by what was known then."
    )
    if len(store.objectives) > 1:
        caption = "All individuals of one trial over the generations (the paper's Fig. 3)."
        yield _figure(figures.evolution(store, width=figures.SCREEN), caption)
        caption = "The same in the plane of the objectives."
        yield _figure(figures.evolution(store, flat=True, width=figures.SCREEN), caption)
    if len(store.objectives) == 2 and len(store.trials()) > 1:
        caption = "Attainment: the trade-offs that any, half and all of the trials reached."
        yield _figure(figures.attainment(store, figures.SCREEN), caption)
    if len(store.descriptors) > 1:
        caption = "The best individual of each kind of behaviour, of all trials; white: nobody behaved so."
        yield _figure(figures.behaviour_map(store, width=figures.SCREEN), caption)


def _behaviour(store: Store, run: Run) -> tuple[list[Figure], str]:
    """Return figures of the best controller's fresh tests; or none, and why one of these failed."""
    best, _ = assessment.watched(store)
    try:
        seen = assessment.watch(store, best)
    except EvaluationError as error:
        return [], f"individual {best}: {error}"
    paths = _figure(
        figures.paths(seen, width=figures.SCREEN), f"Paths of individual {best} in a fresh test (the paper's Fig. 5)."
    )
    occupancy = _figure(figures.occupancy(seen, width=figures.SCREEN), "Where its robots spend their time.")
    return [paths, occupancy], ""


# ---- where it comes from ---------------------------------------------------------------------------------------------


def _origin(store: Store, run: Run) -> list[tuple[str, str]]:
    cost = run.summary.cost
    stored = {key: value for key, value in store.session(1).items() if key != "plugin_files"}  # too many for a page
    facts = {text.words(key): str(value) for key, value in _flat(stored) if value not in (None, "", [])}
    spent = f"{text.duration(cost.simulated_seconds)} simulated in {text.duration(cost.seconds)}"
    facts |= {"cost": f"{text.count(cost.episodes, 'episode')}, {spent}", "physics": text.physics(cost)}
    return list(facts.items())


def _flat(values: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield what is in nested dictionaries, with the keys that lead there."""
    for key, value in values.items():
        if isinstance(value, dict):
            yield from ((f"{key} {inner}", entry) for inner, entry in _flat(value))
        else:
            yield key, ", ".join(map(str, value)) if isinstance(value, list) else value

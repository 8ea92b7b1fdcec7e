# SPDX-License-Identifier: BSD-3-Clause
"""A report of one or several runs: one HTML page that needs no network.

The page holds everything: figures as SVG in the page's own ink, numbers as tables, and the episodes of the controllers
on the fronts for the player of ``replay.py``, which is in it once. Text from a run, which may come from a stranger, is
escaped.
"""

from __future__ import annotations

import html
import importlib.resources
import json
import shlex
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from swarmevo import __version__
from swarmevo.analysis import assessment, fronts
from swarmevo.analysis.assessment import Assessment
from swarmevo.analysis.fronts import FrontPoint, Summary
from swarmevo.errors import StoreError
from swarmevo.protocols import Objective
from swarmevo.runs.store import CONFIG_FILE, PROVENANCE_FILE, Store
from swarmevo.views import figures, text
from swarmevo.views.replay import data as replay_data
from swarmevo.views.replay import episode as replay_episode
from swarmevo.views.replay import page as replay_page

FILE: Final = "report.html"
"""In a run's folder, if no other place is asked for."""
MOST_REPLAYS: Final = 24
"""Episodes in a page, of each run: about 0.2 MB each. The front over all trials comes first."""


def write(folders: Sequence[Path], file: Path, observe: Callable[[str], None] = lambda what: None) -> Path:
    """Write a report of runs and return its file.

    Args:
        folders: Of the runs, each with at least one generation.
        file: Is overwritten.
        observe: Told what is being done, one line each.

    Raises:
        EvaluationError: An episode failed.
        StoreError: A run cannot be read.
        OSError: The file cannot be written.
    """
    content = page(folders, observe)
    file.parent.mkdir(parents=True, exist_ok=True)
    unfinished = file.with_name(f"{file.name}.tmp")
    unfinished.write_text(content, encoding="utf-8")
    unfinished.replace(file)
    return file


def write_figures(folders: Sequence[Path], folder: Path) -> list[Path]:
    """Write the figures of runs as PDF and PNG, of several runs each into a folder of its own; return the files."""
    several = len(folders) > 1
    return [file for run in folders for file in figures.write(run, folder / _name(run) if several else folder)]


def page(folders: Sequence[Path], observe: Callable[[str], None] = lambda what: None) -> str:
    """Return the report of runs as HTML."""
    sections, data = [], []
    for number, folder in enumerate(folders):
        with Store.open(folder) as store:
            run = _Run.of(store, number, observe)
            sections.append(_section(store, run, observe))
            data.append(_data(store, run))
    names = [_name(folder) for folder in folders]
    content = {
        "title": html.escape(f"{', '.join(names)} · swarmevo"),
        "style": f"<style>{_asset('report.css')}</style>",
        "player": replay_page.page_head(),
        "navigation": _navigation(names),
        "runs": "\n".join(sections),
        "version": html.escape(__version__),
        "data": replay_page.json_script("report-data", data),
        "script": f"<script>{_asset('report.js')}</script>",
    }
    filled = _asset("page.html")
    for key, value in content.items():
        filled = filled.replace(f"<!--{key}-->", value)
    return filled


def _asset(name: str) -> str:
    return (importlib.resources.files("swarmevo.views.report") / "assets" / name).read_text(encoding="utf-8")


def _name(folder: Path) -> str:
    return folder.resolve().name


# ---- what a page knows of a run --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Run:
    """A run, its points and their episodes."""

    number: int
    """In the page."""
    name: str
    summary: Summary
    tests: Assessment | None
    points: list[FrontPoint]
    """Of the fronts of all trials."""
    best: set[tuple[int, int]]
    """(trial, genome) of those on the front over all trials."""
    episodes: dict[tuple[int, int], dict[str, Any]]
    """(trial, genome): an episode for the player."""

    @classmethod
    def of(cls, store: Store, number: int, observe: Callable[[str], None]) -> _Run:
        summary = fronts.summarise(store)
        if not summary.front:
            raise StoreError(f"{store.folder}: expected at least one generation to report, but none is stored yet")
        best = [(point.trial, point.genome) for point in summary.front]
        points = [point for trial in summary.trials for point in trial.front]
        replayed = sorted(points, key=lambda point: (point.trial, point.genome) not in best)[:MOST_REPLAYS]
        episodes = {}
        for i, point in enumerate(replayed, 1):
            observe(f"{_name(store.folder)}: replay {i} of {len(replayed)}")
            episodes[point.trial, point.genome] = _episode(store, point)
        return cls(number, _name(store.folder), summary, assessment.load(store.folder), points, set(best), episodes)

    def tested(self, point: FrontPoint) -> assessment.Tested | None:
        """Return what the tests say of a point, if it was tested."""
        controllers = self.tests.controllers if self.tests else []
        return next((one for one in controllers if (one.trial, one.genome) == (point.trial, point.genome)), None)


def _episode(store: Store, point: FrontPoint) -> dict[str, Any]:
    """Return the last stored episode of a point, simulated once more; where the bits differ it says so itself."""
    chosen = replay_episode.choose(store, point.genome, point.last_generation)
    recording, warning = replay_episode.replay(store, chosen, force=True)
    where = f"trial {point.trial}, generation {chosen.key.generation}"
    return replay_data.data(recording, f"Controller {point.genome}", where, warning)


def _data(store: Store, run: _Run) -> dict[str, Any]:
    """Return what the page's script needs of a run. What all its episodes share is said once."""
    episodes = list(run.episodes.values())
    return {
        "objectives": [
            {"name": text.words(o.name), "label": text.label(o), "maximise": o.direction == "maximise"}
            for o in store.objectives
        ],
        "points": [_point(store, run, point) for point in run.points],
        "scene": episodes[0]["scene"] if episodes else [],
        "episodes": [{key: value for key, value in episode.items() if key != "scene"} for episode in episodes],
    }


def _point(store: Store, run: _Run, point: FrontPoint) -> dict[str, Any]:
    key = point.trial, point.genome
    tested = run.tested(point)
    return {
        "trial": point.trial,
        "genome": point.genome,
        "values": list(point.objectives.values()),
        "front": key in run.best,
        "episode": list(run.episodes).index(key) if key in run.episodes else None,
        "facts": _facts(store, point, tested),
        "command": f"swarmevo replay {shlex.quote(f'{store.folder}:{point.genome}')}",
    }


def _facts(store: Store, point: FrontPoint, tested: assessment.Tested | None) -> list[tuple[str, str]]:
    """Return what is said of a point beside the chart: names and values."""
    facts = [(text.words(name), text.number(value)) for name, value in point.objectives.items()]
    facts += [
        ("robots at the source", text.rate(point.homing_rate, point.homing_time)),
        ("box at the wall", text.rate(point.push_rate, point.push_time)),
        ("judged by", text.count(point.episodes, "episode")),
        ("lived in", f"trial {point.trial}, generations {point.first_generation} to {point.last_generation}"),
    ]
    if tested is not None:
        first = store.objectives[0].name
        facts.append((f"{text.words(first)} in fresh tests", text.number(tested.tested[first])))
        shown = [f"{label} {text.percent(share)}" for label, share in tested.behaviours.items() if share >= 0.05]
        facts.append(("robots in fresh tests", ", ".join(shown) or "none of section VII's"))
    return facts


# ---- pieces of the page ----------------------------------------------------------------------------------------------


def _navigation(names: Sequence[str]) -> str:
    """Return links to the runs, if there are several."""
    if len(names) < 2:
        return ""
    links = "".join(f'<a href="#run-{number}">{html.escape(name)}</a>' for number, name in enumerate(names))
    return f'<nav aria-label="Runs">{links}</nav>'


def _section(store: Store, run: _Run, observe: Callable[[str], None]) -> str:
    """Return all that is shown of a run."""
    observe(f"{run.name}: figures")
    parts = [
        _header(run),
        _explorer(store, run),
        _evolution(store),
        _behaviour(store, run),
        _tests(store, run),
        _provenance(store, run),
    ]
    return f'<article id="run-{run.number}" class="run" data-run="{run.number}">{"".join(parts)}</article>'


def _header(run: _Run) -> str:
    summary, cost = run.summary, run.summary.cost
    state = "" if summary.complete else " It is not complete yet."
    lede = (
        f"{text.count(summary.trials_planned, 'trial')} of {text.count(summary.generations_planned, 'generation')}; "
        f"{text.count(cost.episodes, 'episode')} of {text.count(cost.genomes, 'controller')}, "
        f"seed {summary.seed}.{state}"
    )
    tiles = "".join(
        f'<div class="tile"><dt>{html.escape(name)}</dt><dd>{html.escape(value)}</dd><dd class="aside">'
        f"{html.escape(aside)}</dd></div>"
        for name, value, aside in _tiles(run)
    )
    return (
        f'<header><p class="kicker">swarmevo report</p><h1>{html.escape(run.name)}</h1>'
        f'<p class="lede">{html.escape(lede)}</p><dl class="tiles">{tiles}</dl></header>'
    )


def _tiles(run: _Run) -> Iterator[tuple[str, str, str]]:
    """Yield the numbers that stand out: name, value, and a remark."""
    summary, cost = run.summary, run.summary.cost
    best, first = summary.front[0], summary.objectives[0].name  # the front begins with the best first objective
    beside = [f"{text.words(name)} {text.number(value)}" for name, value in best.objectives.items() if name != first]
    yield (
        f"best {text.words(first)}",
        text.number(best.objectives[first]),
        ", ".join([f"controller {best.genome}", *beside]),
    )
    pusher = max(summary.front, key=lambda point: (point.push_rate, point.episodes))
    yield (
        "box at the wall",
        text.percent(pusher.push_rate),
        f"controller {pusher.genome}, {text.count(pusher.episodes, 'episode')}",
    )
    yield "front", text.count(len(summary.front), "point"), f"over {text.count(len(summary.trials), 'trial')}"
    volumes = [trial.history[-1].hypervolume for trial in summary.trials]
    yield "hypervolume", text.number(max(volumes)), f"best of {text.count(len(volumes), 'trial')}"
    yield "simulated", text.duration(cost.simulated_seconds), f"in {text.duration(cost.seconds)}: {text.speed(cost)}"


def _explorer(store: Store, run: _Run) -> str:
    """Return the front to click on, the stage that replays play on, and the table of the same points."""
    drawings = "".join(_drawing(store, point) for point in run.points)
    alone = store.config.team.genomes == "individual"
    whose = "Its first robot's" if alone else "Its"
    return f"""
<section class="explorer" aria-label="Pareto front">
<h2>Pareto front</h2>
<p class="note">Each point is a controller; those of one trial share colour and shape. The line is the front over all
trials. Choose a point to see its robots.</p>
<div class="columns">
<div class="card chart" data-chart></div>
<div class="card stage" data-stage><p class="hint">Choose a point of the front to play its episode.</p></div>
<div class="side">
<div class="card"><h3 data-title></h3><dl class="facts" data-facts></dl>
<p class="command"><code data-command></code></p></div>
<figure class="card" data-network-place hidden><div class="picture"></div>
<figcaption>{whose} network: the hidden neurons that are switched on, by their place in the genome.</figcaption>
</figure>
</div>
</div>
<details class="card"><summary>The same as a table</summary>{_front_table(run)}</details>
{drawings}
</section>"""


def _drawing(store: Store, point: FrontPoint) -> str:
    """Return a point's network, to be shown when the point is chosen; nothing if its controller is no network."""
    if not figures.has_network(store.config, store.genome(point.genome)):
        return ""
    drawn = figures.svg(figures.network(store, point.genome))
    return f'<template data-network="{point.trial}:{point.genome}">{drawn}</template>'


def _front_table(run: _Run) -> str:
    names = [text.words(objective.name) for objective in run.summary.objectives]
    rows = [
        [
            *(text.number(value) for value in point.objectives.values()),
            text.rate(point.homing_rate, point.homing_time),
            text.rate(point.push_rate, point.push_time),
            str(point.episodes),
            str(point.trial),
            str(point.genome),
            "yes" if (point.trial, point.genome) in run.best else "",
        ]
        for point in run.points
    ]
    return _table(
        [*names, "robots at the source", "box at the wall", "episodes", "trial", "controller", "global front"], rows
    )


def _evolution(store: Store) -> str:
    pictures = [_figure(figures.hypervolume(store), "Hypervolume over the generations, judged by what was known then.")]
    if len(store.objectives) > 1:
        caption = "All individuals of one trial over the generations (the paper's Fig. 3)."
        pictures.append(_figure(figures.evolution(store), caption))
    if len(store.objectives) == 2 and len(store.trials()) > 1:
        caption = "Attainment: the trade-offs that any, half and all of the trials reached."
        pictures.append(_figure(figures.attainment(store), caption))
    return f'<section><h2>Evolution</h2><div class="gallery">{"".join(pictures)}</div></section>'


def _behaviour(store: Store, run: _Run) -> str:
    seen = assessment.watch(store)
    pictures = [
        _figure(
            figures.paths(seen),
            f"Paths of controller {seen.genome} in a fresh test (the paper's Fig. 5). Circles: the start; discs: the "
            "end; star and dotted circle: the emitter and its range; green: the target wall.",
        ),
        _figure(
            figures.occupancy(seen),
            "Where its robots spend their time. Outlines: the box at the end of each test.",
        ),
    ]
    return f'<section><h2>Behaviour</h2><div class="gallery">{"".join(pictures)}</div>{_census(run)}</section>'


def _census(run: _Run) -> str:
    """Return the census of behaviours, if the run was tested."""
    if run.tests is None:
        return ""
    bars = "".join(
        f'<dt>{html.escape(label)}</dt><dd><span class="bar"><i style="width:{share:.1%}"></i></span>'
        f"{text.percent(share)}</dd>"
        for label, share in run.tests.behaviours.items()
    )
    return (
        '<div class="card"><h3>What the robots learned besides</h3><p class="note">Share of robots in the tests of all '
        f'controllers that showed a behaviour of the paper\'s section VII.</p><dl class="bars">{bars}</dl></div>'
    )


# ---- the tests -------------------------------------------------------------------------------------------------------


def _tests(store: Store, run: _Run) -> str:
    tests = run.tests
    if tests is None:
        command = html.escape(f"swarmevo test {shlex.quote(str(store.folder))}")
        return (
            '<section><h2>Tests</h2><p class="note">The controllers were not tested on fresh seeds yet. Make the '
            f"paper's Table II with <code>{command}</code>, then this report again.</p></section>"
        )
    stale = "The run has gone on since these tests. " if tests.is_stale(store) else ""
    note = (
        f"{stale}{text.count(len(tests.controllers), 'controller')} of all trials' fronts, "
        f"{text.count(tests.repeats, 'test')} each on fresh seeds; in small print the paper's Table II. "
        f"Max: never within {text.horizon(tests.horizon)}."
    )
    return (
        f'<section><h2>Tests</h2><p class="note">{html.escape(note)}</p>{_table_ii(tests)}'
        f"{_robustness(tests)}{_gap(store.objectives[0], tests)}</section>"
    )


def _table_ii(tests: Assessment) -> str:
    paper = {row.robots: row for row in assessment.PAPER}
    rows = []
    for row in tests.rows:
        beside = paper.get(row.robots)
        rows.append(
            [
                str(row.robots),
                _beside(text.percent(row.homing_rate), beside and text.percent(beside.homing_rate)),
                text.percent(row.any_home_rate),
                text.percent(row.all_home_rate),
                _beside(text.time_taken(row.homing_time), beside and text.time_taken(beside.homing_time)),
                _beside(text.percent(row.push_rate), beside and text.percent(beside.push_rate)),
                _beside(text.time_taken(row.push_time), beside and text.time_taken(beside.push_time)),
            ]
        )
    heads = ["robots", "robots at the source", "any", "all", "time taken", "box at the wall", "time taken"]
    return f"<h3>Table II</h3>{_table(heads, rows, escape=False)}"


def _beside(ours: str, theirs: str | None) -> str:
    return f"{ours} <small>{theirs}</small>" if theirs else ours


def _robustness(tests: Assessment) -> str:
    if not tests.robustness:
        return ""
    rows = [[one.name, one.changes, *text.outcome(one.outcome)] for one in tests.robustness]
    heads = ["world", "changes", "robots at the source", "time taken", "box at the wall", "time taken"]
    return f'<div class="words"><h3>Robustness</h3>{_table(heads, rows)}</div>'


def _gap(objective: Objective, tests: Assessment) -> str:
    """Return how the controllers fare beside what evolution thought of them."""
    rows = [
        [
            str(one.genome),
            str(one.trial),
            text.number(one.evolved[objective.name]),
            text.number(one.tested[objective.name]),
            text.difference(one.tested[objective.name] - one.evolved[objective.name]),
        ]
        for one in tests.controllers
    ]
    heads = ["controller", "trial", "in evolution", "in fresh tests", "difference"]
    return (
        f'<details class="card"><summary>{html.escape(text.words(objective.name))}: evolution and fresh tests</summary>'
        '<p class="note">Who is selected for good luck loses it on fresh seeds.</p>'
        f"{_table(heads, rows)}</details>"
    )


# ---- where it comes from ---------------------------------------------------------------------------------------------


def _provenance(store: Store, run: _Run) -> str:
    cost = run.summary.cost
    origin: dict[str, Any] = json.loads((store.folder / PROVENANCE_FILE).read_text(encoding="utf-8"))
    facts = {text.words(key): value for key, value in _flat(origin) if value not in (None, "", [])}
    facts |= {
        "cost": f"{text.count(cost.episodes, 'episode')}, {text.duration(cost.simulated_seconds)} simulated "
        f"in {text.duration(cost.seconds)}",
        "physics": text.physics(cost),
    }
    entries = "".join(f"<dt>{html.escape(key)}</dt><dd>{html.escape(str(value))}</dd>" for key, value in facts.items())
    settings = html.escape((store.folder / CONFIG_FILE).read_text(encoding="utf-8"))
    return (
        f'<section><h2>Where it comes from</h2><dl class="facts wide">{entries}</dl>'
        f'<details class="card"><summary>Configuration</summary><pre>{settings}</pre></details></section>'
    )


def _flat(values: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        if isinstance(value, dict):
            yield from ((f"{key} {inner}", entry) for inner, entry in _flat(value))
        else:
            yield key, ", ".join(map(str, value)) if isinstance(value, list) else value


# ---- HTML ------------------------------------------------------------------------------------------------------------


def _figure(picture: figures.Picture, caption: str) -> str:
    drawn, said = figures.svg(picture), html.escape(caption)
    return f'<figure class="card"><div class="picture">{drawn}</div><figcaption>{said}</figcaption></figure>'


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]], escape: bool = True) -> str:
    head = "".join(f'<th scope="col">{html.escape(name)}</th>' for name in heads)
    body = "".join(
        f"<tr>{''.join(f'<td>{html.escape(cell) if escape else cell}</td>' for cell in row)}</tr>" for row in rows
    )
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'

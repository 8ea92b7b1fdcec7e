# SPDX-License-Identifier: BSD-3-Clause
"""What the page shows of a run, as its script takes it: text where people read it, numbers where they are drawn."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from datetime import datetime
from typing import Any, Final

import numpy as np

from swarmevo.analysis.course import Standing, Step
from swarmevo.analysis.following import Following, Progress
from swarmevo.config import Config
from swarmevo.printable import printable
from swarmevo.views import text

MOST_POINTS: Final = 600
"""Of all trials' fronts that are drawn, those of the front over all trials first."""
MOST_STEPS: Final = 300
"""Generations of a trial whose hypervolume is drawn: a line of so many points looks the same as one of all."""

_RANKS: Final = {"running": 0, "opening": 1, "killed": 1, "stopped": 1, "finished": 1, "broken": 2}


def order(name: str, progress: Progress) -> tuple[Any, ...]:
    """Return a key for sorting: what runs comes first, then what ran last."""
    last = datetime.fromisoformat(progress.last).timestamp() if progress.last else 0.0
    return _RANKS[progress.state], -last, name


def listed(id: str, name: str, run: Following) -> dict[str, Any]:
    """Return what the list of runs says of one."""
    progress = run.progress
    return {
        "id": id,
        "name": printable(name),
        "state": progress.state,
        "said": _said(run),
        "about": _about(progress.config) if progress.config else "",
        "share": progress.share,
        "done": _done(progress),
        "left": _left(progress),
        "faults": progress.faults,
        "last": progress.last,
    }


def detail(id: str, name: str, run: Following) -> dict[str, Any]:
    """Return all that is shown of the run that was chosen."""
    return {
        **listed(id, name, run),
        "folder": printable(str(run.folder)),
        "tiles": list(_tiles(run)),
        "untaken": run.untaken,
        "objectives": [
            {"name": text.words(o.name), "label": text.label(o), "maximise": o.is_maximised} for o in run.objectives
        ],
        "beyond": text.not_drawn(run.objectives),
        "points": _points(run),
        "undrawn": max(0, sum(map(len, run.fronts)) - MOST_POINTS),
        "reference": ", ".join(f"{text.words(o.name)} {text.number(o.worst)}" for o in run.objectives),
        "courses": [_course(trial, steps) for trial, steps in enumerate(run.steps) if steps],
        "faulty": [
            {
                "place": f"trial {fault.trial}, generation {fault.generation}, repeat {fault.repeat}",
                "genome": fault.genome,
                "text": printable(fault.text),
            }
            for fault in reversed(run.faults)
        ],
    }


# ---- words -----------------------------------------------------------------------------------------------------------


def _about(config: Config) -> str:
    """Return what a run is, in a line."""
    names = [" + ".join(chosen) for chosen in (config.optimiser, config.controller, config.fitness)]
    return ", ".join([*map(text.words, names), text.count(config.team.robots, "robot")])


def _done(progress: Progress) -> str:
    if progress.config is None:
        return ""
    evolution, stored = progress.config.evolution, progress.generations
    of_all = f"{text.grouped(sum(stored))} of {text.count(evolution.generations * evolution.trials, 'generation')}"
    return of_all if evolution.trials == 1 else f"{of_all} in {text.count(evolution.trials, 'trial')}"


def _left(progress: Progress) -> str:
    return "" if progress.eta_seconds is None else f"{text.duration(progress.eta_seconds)} left"


def _said(run: Following) -> str:
    """Return what there is to say of a run's state, in a line."""
    progress, go_on = run.progress, f"go on with: swarmevo resume {shlex.quote(str(run.folder))}"
    if progress.state == "killed":
        return printable(f"{progress.said}, which wrote it, ended without a word; {go_on}")
    if progress.state == "stopped":
        return printable(f"stopped before its end; {go_on}")
    return printable(progress.said) if progress.state == "broken" else ""


def _tiles(run: Following) -> Iterator[tuple[str, str, str]]:
    """Yield numbers that stand out: what, how much, and a remark."""
    progress = run.progress
    yield "done", text.percent(progress.share), _left(progress) or progress.state
    steps = [trial for trial in run.steps if trial]
    if steps:
        first, fronts = run.objectives[0], [front for front in run.fronts if front]
        sign = 1 if first.is_maximised else -1
        best = max((one for front in fronts for one in front), key=lambda one: sign * one.values[0])
        yield f"best mean {text.words(first.name)}", text.number(best.values[0]), f"individual {best.genome}"
        volumes = [trial[-1].hypervolume for trial in steps]
        yield "hypervolume", text.number(max(volumes)), f"best of {text.count(len(volumes), 'trial')}"
        yield "front", text.count(len(run.global_front()), "point"), f"over {text.count(len(steps), 'trial')}"
    speed = progress.episodes / progress.seconds if progress.seconds else 0.0
    yield "episodes", text.grouped(progress.episodes), text.throughput(speed, "episodes")
    yield "failed episodes", text.grouped(progress.faults), "of all stored"


# ---- what is drawn ---------------------------------------------------------------------------------------------------


def _points(run: Following) -> list[dict[str, Any]]:
    """Return the points of the trials' fronts, those of the front over all trials first, if not all can be drawn."""
    best = run.global_front()
    every = [(trial, one) for trial, front in enumerate(run.fronts) for one in front]
    kept = sorted(every, key=lambda place: (place[0], place[1].genome) not in best)[:MOST_POINTS]
    return [_point(run, trial, one, (trial, one.genome) in best) for trial, one in kept]


def _point(run: Following, trial: int, one: Standing, is_best: bool) -> dict[str, Any]:
    named = zip(run.objectives, one.values, strict=True)
    return {
        "trial": trial,
        "genome": one.genome,
        "generation": one.last_generation,
        "values": one.values,
        "front": is_best,
        "facts": [
            *((text.words(objective.name), text.number(value)) for objective, value in named),
            ("judged by", text.count(one.episodes, "episode")),
            ("lived in", f"trial {trial}, {text.generations(one.first_generation, one.last_generation)}"),
        ],
        "command": printable(f"swarmevo replay {shlex.quote(f'{run.folder}:{one.genome}')}"),
    }


def _course(trial: int, steps: Sequence[Step]) -> dict[str, Any]:
    """Return a trial's hypervolume, of some generations if there are many; the last one is among them."""
    places = np.unique(np.linspace(0, len(steps) - 1, MOST_STEPS).round().astype(int)).tolist()
    return {
        "trial": trial,
        "generations": [steps[i].generation for i in places],
        "hypervolumes": [steps[i].hypervolume for i in places],
    }

# SPDX-License-Identifier: BSD-3-Clause
"""A run of ``configs/paper.yaml`` beside the paper: its figures, what it says, and the behaviours that it tells of."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from benchmarks import made_by
from benchmarks.pages import table
from swarmevo.analysis import assessment, census, fronts
from swarmevo.analysis.bench import test_key
from swarmevo.analysis.recording import Recording, simulate
from swarmevo.analysis.table_ii import PAPER, Assessment, Tested
from swarmevo.plugins.team import Team
from swarmevo.protocols import CENSUS_CHANNELS, FloatArray
from swarmevo.runs import other_world
from swarmevo.runs.store import Store
from swarmevo.views import figures as draw
from swarmevo.views.replay import episode as replays

FOLDER: Final = Path(__file__).parents[1] / "docs" / "results"
DPI: Final = 100
SMALL_DPI: Final = 60
PAPERS_FRONT: Final = (1, 2)
"""Hidden neurons of the paper's two global points (VI)."""
NEEDED: Final = 3
"""Robots that it takes to push the box."""
HEADINGS: Final = {"north": np.pi / 2, "west": np.pi, "south": -np.pi / 2, "east": 0.0}
"""To a wall [rad]."""
FACING: Final = np.pi / 3
"""A robot drives towards it up to this angle [rad]."""


def picture(store: Store, name: str, drawn: draw.Picture, meaning: str, dpi: float = DPI) -> str:
    """Write a picture to docs/results and return what shows it."""
    file = f"{store.folder.name}-{name}.png"
    drawn.savefig(FOLDER / file, dpi=dpi)
    return f"![{meaning}]({file})"


def figures(store: Store) -> list[str]:
    """Return the paper's Figs. 3, 4 and 5."""
    return [
        "## Figures 3, 4 and 5\n",
        "All individuals of the trial with the largest hypervolume:\n",
        picture(store, "evolution", draw.evolution(store), "F1 and hidden neurons over the generations") + "\n",
        "The fronts of all trials, and the global one:\n",
        picture(store, "fronts", draw.fronts(store), "F1 over hidden neurons") + "\n",
        "A test of the first controller of the global front:\n",
        picture(store, "paths", draw.paths(store, fronts.front(store)[0].genome), "Paths of the robots and of the box")
        + "\n",
    ]


# ---- what the paper says ---------------------------------------------------------------------------------------------


class Rates(NamedTuple):
    """Of some controllers; ``(controllers, sizes)``, in per cent."""

    homing: FloatArray
    push: FloatArray

    def mean(self, of: str, robots: int) -> str:
        """Return the mean rate of ``homing`` or ``push`` with a number of robots."""
        return f"{getattr(self, of)[:, robots - 1].mean():.1f} %"


def rates(controllers: Sequence[Tested]) -> Rates:
    """Return the rates of controllers that were tested in all teams of the paper."""
    homing = [[of.homing_rate for of in one.outcomes] for one in controllers]
    push = [[of.push_rate for of in one.outcomes] for one in controllers]
    return Rates(*(100 * np.array(one).reshape(len(controllers), len(PAPER)) for one in (homing, push)))


def goals(store: Store, found: Assessment, hidden: dict[int, int]) -> Iterator[str]:
    """Yield what the paper found, what was found here, and why it differs."""
    first = {trial: fronts.front(store, trial)[0].genome for trial in store.trials()}
    best = [one for one in found.controllers if one.genome == first[one.trial]]
    every, bests = rates(found.controllers), rates(best)
    failed = int(((bests.homing[:, -1] < 50) | (bests.push[:, -1] == 0)).sum())
    ours = sorted(hidden[point.genome] for point in fronts.front(store))
    yield "## Beside the paper\n"
    rows = [
        ["trials that failed", "0", f"{failed} of {len(best)}", ""],
        ["hidden neurons on the global front", _listed(PAPERS_FRONT), _listed(ours), ""],
    ]
    for of, word in (("homing", "homing"), ("push", "pushing")):
        for row in PAPER if of == "push" else PAPER[NEEDED - 1 :]:
            paper = 100 * (row.push_rate if of == "push" else row.homing_rate)
            means = [getattr(one, of)[:, row.robots - 1].mean() for one in (every, bests)]
            name = f"{word}, {row.robots} robot{'s' * (row.robots > 1)}"
            rows.append([name, f"{paper:.1f} %", *(f"{mean:.1f} % ({mean - paper:+.1f})" for mean in means)])
    yield table(["", "the paper", "all controllers (difference)", "the best of each trial (difference)"], rows)
    yield "A trial failed if its best brings less than half of five robots home, or never pushes with five.\n"
    yield from _reasons(store, found.controllers, best, hidden)


def _reasons(
    store: Store, controllers: Sequence[Tested], best: Sequence[Tested], hidden: dict[int, int]
) -> Iterator[str]:
    blind = [one for one in controllers if hidden[one.genome] == 0]
    yield "Why:\n"
    if 0 < len(blind) < len(controllers):
        of_blind, of_others = rates(blind), rates([one for one in controllers if hidden[one.genome] > 0])
        yield (
            f"- {len(blind)} of the {len(controllers)} controllers have no hidden neuron, so that their commands are "
            f"constant. With three robots they home in {of_blind.mean('homing', 3)} and push in "
            f"{of_blind.mean('push', 3)} of the tests; the others home in {of_others.mean('homing', 3)} and push in "
            f"{of_others.mean('push', 3)}, with five robots in {of_others.mean('push', 5)}."
        )
    push = rates(best).push
    more, less = int((push[:, 4] > push[:, 2]).sum()), int((push[:, 4] < push[:, 2]).sum())
    yield (
        f"- Evolution tried teams of {store.config.team.robots} only. Of {len(best)} trials' bests {more} push more "
        f"often with five robots than with three, {less} less often; in the paper the rate falls from "
        f"{100 * PAPER[2].push_rate:.0f} to {100 * PAPER[4].push_rate:.0f} %."
    )
    yield (
        "- F1 rewards touching the box where the signal is strong, on any side, so a robot stays where it came to. "
        "The box moves only while three drive against it the same way, and of five robots more often three are on the "
        "face to be pushed. In the bests' tests, from when a first robot is home until the box is at the wall:\n"
    )
    shares = [
        [f"{robots} robots", *(f"{100 * share:.1f} %" for share in pressing(store, best, robots))] for robots in (3, 5)
    ]
    yield table(
        ["team", "a robot drives against it", "at least three do", "at least three do, towards the wall"], shares
    )


def pressing(store: Store, controllers: Sequence[Tested], robots: int) -> tuple[float, float, float]:
    """Return in what share of the time a robot drives against the box, three do, and three do towards the wall.

    Over five tests of each controller, from when a first robot is home until the box is at the wall.
    """
    settings = other_world.of_size(other_world.test_world(store.config), robots)
    team, wall = Team(settings), HEADINGS[settings.arena.target_wall]
    one_does, three_do, three_towards = [], [], []
    for one in controllers:
        genes = other_world.first_robots(settings, store.genome(one.genome), store.config.team.robots)
        keys = [test_key(store.config, one.trial, repeat) for repeat in range(assessment.REPEATS)]
        seen = simulate(team, genes, keys, channels=CENSUS_CHANNELS).telemetry
        for i in range(len(keys)):
            channels = {name: seen.channels[name][i] for name in CENSUS_CHANNELS}
            episode = census.Episode(settings, homing_time=seen.homing_time[i], **channels)
            begin, end = (np.nan_to_num(of[i], nan=np.inf).min() for of in (seen.homing_time, seen.push_time))
            moments = np.arange(episode.steps) * episode.period
            during = (moments >= begin) & (moments < end)
            towards = np.cos(episode.pose[..., 2] - wall) >= np.cos(FACING)
            one_does.append(episode.pushes[during].mean(axis=1))
            three_do.append(episode.pushes[during].sum(axis=1) >= NEEDED)
            three_towards.append((episode.pushes & towards)[during].sum(axis=1) >= NEEDED)
    a, b, c = (np.concatenate(of) for of in (one_does, three_do, three_towards))
    return (float(a.mean()), float(b.mean()), float(c.mean())) if len(a) else (0.0, 0.0, 0.0)


def _listed(numbers: Sequence[int]) -> str:
    return ", ".join(map(str, numbers))


# ---- behaviours ------------------------------------------------------------------------------------------------------


class Example(NamedTuple):
    """A stored episode that shows a behaviour."""

    share: float
    """Of its robots that do."""
    f1: float
    chosen: replays.Chosen
    recording: Recording


def behaviours(store: Store, found: Assessment) -> Iterator[str]:
    """Yield how often each behaviour is seen, and where it is clearest."""
    found_in = clearest(store)
    rows, pictures = [], []
    for label, share in found.behaviours.items():
        example = found_in.get(label)
        rows.append([label, f"{100 * share:.1f} %", *_told(store, example)])
        if example:
            drawn = draw.paths(example.recording, test=0)
            pictures.append((label, picture(store, label.replace(" ", "-").lower(), drawn, label, SMALL_DPI)))
    yield table(["behaviour", "share of the robots in all tests", "clearest", "replay"], rows)
    yield (
        "Clearest is, of the last episodes that each controller of the fronts was judged by, the one in which most "
        "robots show it, of equal ones that of the highest F1; if none does, of the last generation's first episodes. "
        "A replay is compared with the stored episode.\n"
    )
    if pictures:
        labels, shown = zip(*pictures, strict=True)
        yield table(labels, [shown])


def _told(store: Store, example: Example | None) -> list[str]:
    if example is None:
        return ["not seen", ""]
    chosen, robots = example.chosen, example.recording.config.team.robots
    where = f"{made_by.page_path(store.folder)}:{chosen.genome}"
    command = f"`swarmevo replay {where} --generation {chosen.key.generation} --repeat {chosen.key.repeat}`"
    return [f"{example.share * robots:.0f} of {robots} robots, trial {chosen.key.trial}", command]


def clearest(store: Store) -> dict[str, Example]:
    """Return for each behaviour the episode in which most robots show it; none, if no robot does.

    Of the last episodes of the fronts' controllers; if none shows it, of the last generations' first episodes.
    """
    config = store.config.evolution
    found: dict[str, Example] = {}
    for trial in store.trials():
        for point in fronts.front(store, trial):
            for repeat in range(config.repeats):
                _look(store, replays.choose(store, point.genome, point.last_generation, repeat), found, census.LABELS)
    missing = [label for label in census.LABELS if label not in found]
    for trial in store.trials() if missing else ():
        last = store.generations(trial) - 1
        for genome in store.genome_ids(trial, last).tolist():
            _look(store, replays.choose(store, genome, last), found, missing)
    return found


def _look(store: Store, chosen: replays.Chosen, found: dict[str, Example], labels: Iterable[str]) -> None:
    """Keep an episode for those behaviours that it shows more clearly than what was found before."""
    recording, _ = replays.replay(store, chosen)
    shares = census.census(recording.config, recording.telemetry)
    for label in labels:
        example = Example(shares[label], float(recording.values[0, 0]), chosen, recording)
        if shares[label] > 0 and (label not in found or example[:2] > found[label][:2]):
            found[label] = example

# SPDX-License-Identifier: BSD-3-Clause
"""Chaotic cases: teams that roam and teams that push, compared in distribution between drives and time steps.

After a few collisions the trajectories of two models have nothing to do with each other, however good the models are.
What must agree is what happens on average: the distributions over many episodes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from benchmarks.cases import changed
from benchmarks.validation_scenes import (
    NORTH,
    Drive,
    Pose,
    Section,
    Settings,
    keys,
    ks_distance,
    millimetres,
    random_networks,
    sound,
    table,
    turn,
    wheels,
)
from swarmevo.config import Config
from swarmevo.plugins import create
from swarmevo.protocols import FeedForward, Fitness, FloatArray
from swarmevo.simulation import Scene, simulate

RESOLUTION = 0.001
"""Of places [m] and headings [rad] in the comparison."""
MOVED = 0.005
"""A box that moved at least this far counts as moved [m]."""

_CHUNK = 50  # episodes whose telemetry is held at once


class Model(NamedTuple):
    """A drive, a time step and the keys that it is run with."""

    drive: Drive
    time_step: float
    sample: int = 0

    def __str__(self) -> str:
        return f"{self.drive}, {self.time_step * 1000:g} ms{', other keys' if self.sample else ''}"


class Kind(NamedTuple):
    """A kind of episodes."""

    name: str
    share: float
    """Of all episodes."""
    horizon: float
    """[s]"""
    at_box: bool
    """Whether robots start at the side from which the box is to be pushed, looking at it; else anywhere."""
    forward: float | None
    """Added to the biases of the random networks' wheels, so that robots do not rest; None: full speed ahead."""

    def scene(self, model: Model) -> Config:
        """Return the config of its episodes, with the default noise."""
        config = changed(
            Config(),
            physics={"drive": model.drive, "time_step": model.time_step},
            episode={"horizon": self.horizon},
        )
        if self.at_box:
            box = (0.0, 0.0, 0.0)
            return changed(config, box={"pose": box}, team={"start": "poses", "start_poses": before_box(config)})
        room = config.arena.size / 2 - config.robot.radius - 0.005
        return changed(config, team={"start": "random", "start_region": (-room, room, -room, room)})

    def networks(self, episodes: int) -> FeedForward:
        """Return a network for each episode."""
        if self.forward is None:
            return wheels(np.ones((episodes, 2)))
        return random_networks(episodes, seed=7, forward=self.forward)


def before_box(config: Config) -> tuple[Pose, ...]:
    """Return poses in two rows before the long face of a box in the middle, with room for the jitter."""
    if config.team.robots != len(_BEFORE_FACE):
        raise ValueError(f"expected {len(_BEFORE_FACE)} robots, got {config.team.robots}")
    gap = 2 * np.sqrt(2) * config.team.start_jitter[0] + 0.001
    pitch = 2 * config.robot.radius + gap
    first = -config.box.size[1] / 2 - config.robot.radius - gap
    return tuple((pitch * column, first - pitch * line, NORTH) for column, line in _BEFORE_FACE)


_BEFORE_FACE = ((-1, 0), (0, 0), (1, 0), (-0.5, 1), (0.5, 1))  # in steps along the face and away from it

KINDS = (
    Kind("roaming", 0.4, 30.0, False, 2.0),
    Kind("networks at the box", 0.4, 8.0, True, 3.0),
    Kind("full speed at the box", 0.2, 3.0, True, None),
)
MOST_STILL = 0.5
"""Share of episodes in which the box may stay where it is: else the comparison says nothing about pushing."""


class Sample(NamedTuple):
    """What came out of the episodes, those of one kind after the other."""

    box: FloatArray
    """``(n, 3)``: x [m], y [m], heading [rad] at the end."""
    way: FloatArray
    """``(n,)``: how far the box got [m]."""
    robots: FloatArray
    """``(n, robots, 2)``: x, y at the end [m]."""
    f1: FloatArray
    """``(n,)``"""

    def moved(self) -> float:
        """Return the share of episodes in which the box moved."""
        return float(np.mean(self.way >= MOVED))

    def part(self, episodes: slice) -> Sample:
        """Return some of the episodes."""
        return Sample(*(values[episodes] for values in self))

    def that_push(self) -> Sample:
        """Return the episodes that start at the box."""
        return self.part(slice(counts(len(self.f1))[0], None))

    def by_kind(self) -> list[Sample]:
        """Return the episodes of each of ``KINDS``."""
        ends = np.cumsum(counts(len(self.f1)))
        return [self.part(slice(end - n, end)) for end, n in zip(ends, counts(len(self.f1)), strict=True)]


def counts(episodes: int) -> list[int]:
    """Return how many episodes there are of each kind."""
    number = [round(kind.share * episodes) for kind in KINDS[1:]]
    return [episodes - sum(number), *number]


def run(model: Model, settings: Settings) -> Sample:
    """Run the episodes of a model: the same networks and, within a sample, the same keys for all models."""
    parts = [
        _run(model, kind, n, 2 * i + model.sample, settings.threads)
        for i, (kind, n) in enumerate(zip(KINDS, counts(settings.pairs), strict=True))
    ]
    return Sample(*map(np.concatenate, zip(*parts, strict=True)))


def _run(model: Model, kind: Kind, n: int, seed: int, threads: int) -> Sample:
    config = kind.scene(model)
    fitness = create("fitness", "box_pushing", {})
    assert isinstance(fitness, Fitness)
    controller = create("controller", "feedforward", {})
    world, networks, parts = Scene(config), kind.networks(n), []
    start = np.array(config.box.pose[:2])
    for first in range(0, n, _CHUNK):
        chosen = np.arange(first, min(first + _CHUNK, n), dtype=np.uint32)
        drivers = np.repeat(chosen[:, np.newaxis], config.team.robots, axis=1)
        names = keys(len(chosen), seed=1 + seed, first=first)
        done = sound(simulate(world, networks, names, drivers, (*fitness.channels, "pose"), threads))
        genomes = np.zeros((len(chosen), 1))  # F1 does not look at them
        parts.append(
            Sample(
                done.box_pose,
                np.linalg.norm(done.box_pose[:, :2] - start, axis=1),
                done.telemetry.pose[:, -1, :, :2],
                fitness.evaluate(done.telemetry, genomes, controller)[:, 0],
            )
        )
    return Sample(*map(np.concatenate, zip(*parts, strict=True)))


def _coarse(values: FloatArray) -> FloatArray:
    """Return places [m] and headings [rad] rounded.

    Many boxes do not move and many robots stand at walls: micrometres, by which soft contacts differ, would count as
    much as metres.
    """
    return np.asarray(np.round(values / RESOLUTION) * RESOLUTION)


QUANTITIES: dict[str, Callable[[Sample], FloatArray]] = {
    "way of box": lambda sample: _coarse(sample.way),
    "turn of box": lambda sample: _coarse(turn(sample.box[:, 2])),
    "F1": lambda sample: sample.f1,
    "box x": lambda sample: _coarse(sample.box[:, 0]),
    "box y": lambda sample: _coarse(sample.box[:, 1]),
    "robots' x": lambda sample: _coarse(sample.robots[..., 0]),
    "robots' y": lambda sample: _coarse(sample.robots[..., 1]),
}
"""What is compared, at the end of the episode."""


def distances(first: Sample, second: Sample) -> dict[str, float]:
    """Return the Kolmogorov-Smirnov distance of each quantity."""
    return {name: ks_distance(of(first), of(second)) for name, of in QUANTITIES.items()}


def critical_distance(n: int) -> float:
    """Return the distance that two samples of ``n`` from one distribution exceed in 5 % of cases."""
    return 1.358 * float(np.sqrt(2 / n))


def judged(first: Sample, second: Sample) -> dict[str, tuple[float, float]]:
    """Return, of what each episode gives one number for, the distance and the one that is critical.

    Of all episodes, and of those that start at the box.
    """
    found = {}
    for which, a, b in [("", first, second), (" when pushing", first.that_push(), second.that_push())]:
        critical = critical_distance(len(a.f1))
        for name, distance in distances(a, b).items():
            if not name.startswith("robots"):  # those of one episode are not independent
                found[name + which] = (distance, critical)
    return found


def are_alike(first: Sample, second: Sample) -> bool:
    """Whether samples cannot be told apart."""
    return all(distance <= critical for distance, critical in judged(first, second).values())


# ---- the page --------------------------------------------------------------------------------------------------------


REFERENCE = Model("articulated", 0.004)


def section(settings: Settings) -> Section:
    """Measure, and write this part of the page."""
    default = Model(Config().physics.drive, Config().physics.time_step)
    others = [Model("driven_contacts", step) for step in (0.02, 0.01, 0.005)]
    samples = {model: run(model, settings) for model in [default, default._replace(sample=1), *others, REFERENCE]}
    text = "\n".join([_head(settings), _distances(samples, settings), _averages(samples)])
    return Section(text, {"distribution.png": _figure(samples)})


def _head(settings: Settings) -> str:
    roaming, networks, full = counts(settings.pairs)
    anywhere, at_box, ahead = KINDS
    return f"""## Chaotic cases, in distribution

Five robots in the paper's arena, with the default noise: {settings.pairs} episodes, networks and keys the same for all
models. Trajectories part after the first collisions, so the distributions at the end of the episodes are compared.

- {roaming} episodes of {anywhere.horizon:g} s in which robots with random networks, one for each episode, start
anywhere (normal weights, {anywhere.forward:g} added to the wheels' biases so that they do not rest).
- {networks} of {at_box.horizon:g} s in which they start in two rows before the long face of a box in the middle and
look at it, {at_box.forward:g} added to their biases.
- {full} of {ahead.horizon:g} s in which they start so and drive at full speed whatever they sense.

(The paper's horizon is {Config().episode.horizon:g} s; shortened here to afford the articulated drive, which runs at 20
to 60 times real time while robots push, and so that not all boxes are at the wall in the end.) Both drives share the
box and the sides of the bodies: that they agree is a test of the drive, and of the time step.
"""


def _distances(samples: dict[Model, Sample], settings: Settings) -> str:
    first, again, *finer, reference = samples
    chance = [f"{first} and the same with other keys", *_cells(distances(samples[first], samples[again]))]
    rows = [
        [f"{one} and {other}", *_cells(distances(samples[one], samples[other]))]
        for one, other in [*((first, model) for model in finer), *((model, reference) for model in (first, *finer))]
    ]
    pushing = settings.pairs - counts(settings.pairs)[0]
    shares = {model: sample.moved() for model, sample in samples.items()}
    steps = "\n".join(f"- {model}: {_verdict(samples[first], samples[model])}" for model in finer)
    return f"""Kolmogorov-Smirnov distances, from 0 to 1, of places and headings rounded to
{millimetres(RESOLUTION):g} mm and mrad (many robots stand at walls, where micrometres would count as much as metres):

{table(["between", *QUANTITIES], [chance, *rows])}
The first line is how far two samples of one physics are apart by chance. Two samples of {settings.pairs} from one
distribution exceed {critical_distance(settings.pairs):.3f} in 5 % of cases, two of {pushing}
{critical_distance(pushing):.3f}. (Robots of one episode are not independent, so this holds for the quantities of whole
episodes: of the box, and F1. And networks and keys are common to the models, so chance alone parts them by less.)
Judged are all episodes, and those {pushing} that start at the box.

The box moves in at least {100 * (1 - MOST_STILL):g} % of episodes with every model:
**{"yes" if min(shares.values()) >= 1 - MOST_STILL else "no"}** ({100 * min(shares.values()):.0f} to
{100 * max(shares.values()):.0f} %).

The default against smaller time steps:

{steps}

{first} against the drive that is its reference:

- {reference}: {_verdict(samples[first], samples[reference])}

![Distributions of the end of the episodes](validation/distribution.png)
"""


def _cells(values: dict[str, float]) -> list[str]:
    return [f"{value:.3f}" for value in values.values()]


def _verdict(first: Sample, second: Sample) -> str:
    """Say whether two samples can be told apart."""
    found = judged(first, second)
    worst = max(found, key=lambda name: found[name][0] / found[name][1])
    distance, critical = found[worst]
    said = "**can be told apart**" if distance > critical else "**cannot be told apart**"
    return f"{said}; most by {worst}, {distance:.3f} of {critical:.3f}"


def _averages(samples: dict[Model, Sample]) -> str:
    reference = samples[REFERENCE]
    rows = []
    for model, sample in samples.items():
        share, n = sample.moved(), len(sample.way)
        apart = np.linalg.norm(sample.robots - reference.robots, axis=-1)
        rows.append(
            [
                str(model),
                f"{100 * share:.1f} +- {100 * np.sqrt(share * (1 - share) / n):.1f}",
                *(f"{100 * kind.moved():.0f}" for kind in sample.by_kind()),
                f"{millimetres(sample.way.mean()):.1f} +- {millimetres(sample.way.std() / np.sqrt(n)):.1f}",
                f"{sample.f1.mean():.4f} +- {sample.f1.std() / np.sqrt(n):.4f}",
                f"{millimetres(float(np.median(apart))):.0f}" if model.sample == 0 and model != REFERENCE else "",
                f"{100 * np.mean(np.abs(sample.way - reference.way) > MOVED):.1f}"
                if model.sample == 0 and model != REFERENCE
                else "",
            ]
        )
    head = [
        "model",
        "box moved [% of episodes]",
        *(f"of {kind.name} [%]" for kind in KINDS),
        "mean way of box [mm]",
        "mean F1",
        "median distance of a robot from where the reference has it [mm]",
        f"way of box differs by more than {millimetres(MOVED):g} mm [% of episodes]",
    ]
    return f"""Averages with their standard errors, and how far the single episodes part:

{table(head, rows)}"""


def _figure(samples: dict[Model, Sample]) -> Figure:
    figure = Figure(figsize=(9, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    for index, (model, sample) in enumerate(samples.items()):
        style = ":" if model.sample else "-"
        share = np.arange(1, len(sample.f1) + 1) / len(sample.f1)
        way = np.sort(np.maximum(millimetres(1) * sample.way, 0.01))
        left.step(way, share, style, color=f"C{index}", label=str(model), where="post")
        right.step(np.sort(sample.f1), share, style, color=f"C{index}", where="post")
    left.set(xscale="log", xlabel="way of the box [mm]", ylabel="share of episodes")
    right.set(xscale="symlog", xlabel="F1")
    figure.legend(loc="outside lower center", ncols=3, fontsize=8)
    return figure

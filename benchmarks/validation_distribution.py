# SPDX-License-Identifier: BSD-3-Clause
"""Chaotic cases: teams with random networks, compared in distribution between drives and time steps.

After a few collisions the trajectories of two models have nothing to do with each other, however good the models are.
What must agree is what happens on average: the distributions over many episodes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from benchmarks.validation_scenes import (
    Drive,
    Section,
    Settings,
    changed,
    keys,
    ks_distance,
    millimetres,
    random_networks,
    sound,
    table,
    without_noise,
)
from swarmevo.config import Config
from swarmevo.plugins import create
from swarmevo.protocols import Fitness, FloatArray
from swarmevo.simulator import Scene, simulate

HORIZON = 30.0
FORWARD = 2.0
"""Added to the biases of the random networks' wheels: restless robots meet each other and the box."""
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


class Sample(NamedTuple):
    """What came out of the episodes."""

    box: FloatArray
    """``(n, 3)``: x [m], y [m], heading [rad] at the end."""
    robots: FloatArray
    """``(n, robots, 2)``: x, y at the end [m]."""
    f1: FloatArray
    """``(n,)``"""

    def moved(self) -> FloatArray:
        """Return ``(n,)``: how far the box got [m]."""
        start = np.array(Config().box.pose[:2])
        return np.asarray(np.linalg.norm(self.box[:, :2] - start, axis=1))


def scene(model: Model, noise: bool = True) -> Config:
    """Return a config in which robots start anywhere."""
    room = Config().arena.size / 2 - Config().robot.radius - 0.005
    config = Config() if noise else without_noise(Config())
    return changed(
        config,
        team={"start": "random", "start_region": (-room, room, -room, room)},
        physics={"drive": model.drive, "time_step": model.time_step},
        episode={"horizon": HORIZON},
    )


def run(model: Model, settings: Settings) -> Sample:
    """Run the episodes of a model: the same networks and, within a sample, the same keys for all models."""
    config = scene(model)
    fitness = create("fitness", "box_pushing", {})
    assert isinstance(fitness, Fitness)
    controller = create("controller", "feedforward", {})
    world, n = Scene(config), settings.pairs
    networks = random_networks(n, seed=7, forward=FORWARD)
    boxes, robots, f1 = [], [], []
    for first in range(0, n, _CHUNK):
        chosen = np.arange(first, min(first + _CHUNK, n), dtype=np.uint32)
        drivers = np.repeat(chosen[:, np.newaxis], config.team.robots, axis=1)
        names = keys(len(chosen), seed=1 + model.sample, first=first)
        done = sound(simulate(world, networks, names, drivers, (*fitness.channels, "pose"), settings.threads))
        assert done.telemetry.pose is not None
        boxes.append(done.box_pose)
        robots.append(done.telemetry.pose[:, -1, :, :2])
        genomes = np.zeros((len(chosen), 1))  # F1 does not look at them
        f1.append(fitness.evaluate(done.telemetry, genomes, controller)[:, 0])
    return Sample(np.concatenate(boxes), np.concatenate(robots), np.concatenate(f1))


def _coarse(values: FloatArray) -> FloatArray:
    """Return places [m] and headings [rad] rounded.

    Most boxes have hardly moved and many robots stand at walls: micrometres, by which soft contacts differ, would count
    as much as metres.
    """
    return np.asarray(np.round(values / RESOLUTION) * RESOLUTION)


QUANTITIES: dict[str, Callable[[Sample], FloatArray]] = {
    "box x": lambda sample: _coarse(sample.box[:, 0]),
    "box y": lambda sample: _coarse(sample.box[:, 1]),
    "box heading": lambda sample: _coarse(sample.box[:, 2]),
    "way of box": lambda sample: _coarse(sample.moved()),
    "robots' x": lambda sample: _coarse(sample.robots[..., 0]),
    "robots' y": lambda sample: _coarse(sample.robots[..., 1]),
    "F1": lambda sample: sample.f1,
}
"""What is compared, at the end of the episode."""


def distances(first: Sample, second: Sample) -> dict[str, float]:
    """Return the Kolmogorov-Smirnov distance of each quantity."""
    return {name: ks_distance(of(first), of(second)) for name, of in QUANTITIES.items()}


def critical_distance(n: int) -> float:
    """Return the distance that two samples of ``n`` from one distribution exceed in 5 % of cases."""
    return 1.358 * float(np.sqrt(2 / n))


# ---- the page --------------------------------------------------------------------------------------------------------


REFERENCE = Model("articulated", 0.005)


def section(settings: Settings) -> Section:
    """Measure, and write this part of the page."""
    default = Model(Config().physics.drive, Config().physics.time_step)
    others = [Model("driven_contacts", step) for step in (0.02, 0.01, 0.005)]
    samples = {model: run(model, settings) for model in [default, default._replace(sample=1), *others, REFERENCE]}
    text = "\n".join([_head(settings), _distances(samples, settings), _averages(samples)])
    return Section(text, {"distribution.png": _figure(samples)})


def _head(settings: Settings) -> str:
    return f"""## Chaotic cases, in distribution

Five robots with random networks (normal weights, {FORWARD:g} added to the wheels' biases so that they do not rest)
start anywhere in the paper's arena, with the default noise, for {HORIZON:g} s: {settings.pairs} episodes, each with its
own network; networks and keys are the same for all models. (The paper's horizon is {Config().episode.horizon:g} s;
shortened here to afford the reference.) Trajectories part after the first collisions, so the distributions at the end
of the episodes are compared.
"""


def _distances(samples: dict[Model, Sample], settings: Settings) -> str:
    first, again, *_ = samples
    chance = distances(samples[first], samples[again])
    found = {model: distances(sample, samples[REFERENCE]) for model, sample in samples.items() if not model.sample}
    found.pop(REFERENCE)
    rows = [[f"{first} and the same with other keys", *_cells(chance)]]
    rows += [[f"{model} and {REFERENCE}", *_cells(values)] for model, values in found.items()]
    critical = critical_distance(settings.pairs)
    verdicts = "\n".join(f"- {model}: {_verdict(values, critical)}" for model, values in found.items())
    return f"""Kolmogorov-Smirnov distances, from 0 to 1, of places and headings rounded to
{millimetres(RESOLUTION):g} mm and mrad (many robots stand at walls, where micrometres would count as much as metres):

{table(["between", *QUANTITIES], rows)}
The first line is how far two samples of one physics are apart by chance. Two samples of {settings.pairs} from one
distribution exceed {critical:.3f} in 5 % of cases (robots of one episode are not independent, so this holds for the
quantities of whole episodes: of the box, and F1). Against the reference:

{verdicts}

![Distributions of the end of the episodes](validation/distribution.png)
"""


def _cells(values: dict[str, float]) -> list[str]:
    return [f"{value:.3f}" for value in values.values()]


def _verdict(values: dict[str, float], critical: float) -> str:
    """Say whether a model's box and F1 can be told from the reference's."""
    whole = {name: value for name, value in values.items() if not name.startswith("robots")}
    worst = max(whole, key=whole.__getitem__)
    if whole[worst] <= critical:
        return "**cannot be told apart** in box and F1"
    return f"**can be told apart**, most by {worst} ({whole[worst]:.3f}); F1 by {whole['F1']:.3f}"


def _averages(samples: dict[Model, Sample]) -> str:
    reference = samples[REFERENCE]
    rows = []
    for model, sample in samples.items():
        moved = sample.moved()
        share, n = float(np.mean(moved >= MOVED)), len(moved)
        apart = np.linalg.norm(sample.robots - reference.robots, axis=-1)
        rows.append(
            [
                str(model),
                f"{100 * share:.1f} +- {100 * np.sqrt(share * (1 - share) / n):.1f}",
                f"{millimetres(float(moved.mean())):.2f} +- {millimetres(float(moved.std()) / np.sqrt(n)):.2f}",
                f"{sample.f1.mean():.4f} +- {sample.f1.std() / np.sqrt(n):.4f}",
                f"{millimetres(float(np.median(apart))):.0f}" if model.sample == 0 and model != REFERENCE else "",
                f"{100 * np.mean(np.abs(moved - reference.moved()) > MOVED):.1f}"
                if model.sample == 0 and model != REFERENCE
                else "",
            ]
        )
    head = [
        "model",
        "box moved [% of episodes]",
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
        way = np.sort(np.maximum(millimetres(1) * sample.moved(), 0.01))
        left.step(way, share, style, color=f"C{index}", label=str(model), where="post")
        right.step(np.sort(sample.f1), share, style, color=f"C{index}", where="post")
    left.set(xscale="log", xlabel="way of the box [mm]", ylabel="share of episodes")
    right.set(xscale="symlog", xlabel="F1")
    figure.legend(loc="outside lower center", ncols=3, fontsize=8)
    return figure

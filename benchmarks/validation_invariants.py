# SPDX-License-Identifier: BSD-3-Clause
"""What must hold whatever the robots do: many random teams, large ones too; and mirror images."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from benchmarks.cases import changed
from benchmarks.validation_scenes import (
    Section,
    Settings,
    keys,
    millimetres,
    random_networks,
    sound,
    table,
    turn,
    without_noise,
)
from swarmevo.config import Config
from swarmevo.protocols import FeedForward, FloatArray
from swarmevo.simulation import Episodes, Scene, simulate

DEEPEST = 0.001
"""Overlap that nothing may exceed, beyond the travel of bumpers [m]."""
FALLEN = 0.5
"""Cosine of the tilt below which a body has fallen over."""
MOST_MESSAGES = 10
"""Of ODE's solver, in a million steps."""
HORIZON = 60.0

_CHUNK = 500


# ---- stress ----------------------------------------------------------------------------------------------------------


class Crowd(NamedTuple):
    """A team size, an arena that it fits into and its share of the episodes."""

    robots: int
    arena: float  # [m]
    share: float


CROWDS = (Crowd(1, 1.0, 0.3), Crowd(5, 1.0, 0.5), Crowd(20, 2.0, 0.2))


class Stress(NamedTuple):
    """The worst of all episodes of a crowd."""

    crowd: Crowd
    episodes: int
    steps: int
    failed: int
    """Episodes with a status other than 0: a body's state not finite, an error of ODE."""
    penetration: FloatArray
    """``(episodes,)`` [m]"""
    lift: FloatArray
    """``(episodes,)`` [m]"""
    upright: FloatArray
    """``(episodes,)``"""
    messages: int
    unsolved: int
    moved: int
    """Episodes in which the box moved by more than 5 mm."""

    def messages_per_million(self) -> float:
        """Return the warnings of ODE's solver in a million steps."""
        return 1e6 * self.messages / self.steps

    def fallen(self) -> int:
        """Return in how many episodes a body fell over."""
        return int((self.upright < FALLEN).sum())


def scene(crowd: Crowd) -> Config:
    """Return a config in which the crowd starts anywhere around a box in the middle."""
    room = crowd.arena / 2 - Config().robot.radius - 0.001
    return changed(
        Config(),
        arena={"size": crowd.arena},
        box={"pose": (0.0, 0.0, 0.0)},
        team={"robots": crowd.robots, "start": "random", "start_region": (-room, room, -room, room)},
        episode={"horizon": HORIZON},
    )


def stress(crowd: Crowd, episodes: int, threads: int) -> Stress:
    """Run random networks, every third of them with a bias to drive on."""
    config = scene(crowd)
    world, parts = Scene(config), []
    for first in range(0, episodes, _CHUNK):
        n = min(_CHUNK, episodes - first)
        networks = random_networks(n, seed=first + crowd.robots)
        networks.hidden_output[::3, :, -1] += 2.0
        drivers = np.repeat(np.arange(n, dtype=np.uint32)[:, np.newaxis], crowd.robots, axis=1)
        parts.append(simulate(world, networks, keys(n, first=first), drivers, threads=threads))
    steps = round(HORIZON / config.physics.time_step)
    failed = sum(int((part.status != 0).sum()) for part in parts)
    start = np.array(config.box.pose[:2])
    return Stress(
        crowd,
        episodes,
        steps * episodes,
        failed,
        _joined(parts, "max_penetration"),
        _joined(parts, "max_lift"),
        _joined(parts, "min_upright"),
        int(_joined(parts, "ode_messages").sum()),
        int(_joined(parts, "unsolved_steps").sum()),
        sum(int((np.linalg.norm(part.box_pose[:, :2] - start, axis=1) > 0.005).sum()) for part in parts),
    )


def _joined(parts: list[Episodes], name: str) -> FloatArray:
    return np.concatenate([getattr(part, name)[part.status == 0] for part in parts])


# ---- mirror images ---------------------------------------------------------------------------------------------------


class Mirror(NamedTuple):
    """How far two mirror images part."""

    times: FloatArray
    """``(steps,)`` [s]"""
    deviation: FloatArray
    """``(episodes, steps)``: largest distance of a robot or the box from its mirror image [m]."""


def mirrored(config: Config, poses: FloatArray) -> Config:
    """Return the config mirrored at x = 0, with the given start poses ``(robots, 3)`` mirrored.

    Sensors keep their numbers and move to the other side, so that a genome needs only its wheels swapped.
    """
    flipped = [(-x, y, float(turn(np.pi - heading))) for x, y, heading in poses]
    x, y, heading = config.box.pose
    bearings = ("infrared_yaw_deg", "touch_yaw_deg")
    sensors = {name: tuple(-yaw for yaw in getattr(config.sensors, name)) for name in bearings}
    ex, ey, ez = config.emitter.position
    return changed(
        config,
        team={"start": "poses", "start_poses": tuple(flipped)},
        box={"pose": (-x, y, -heading)},
        emitter={"position": (-ex, ey, ez)},
        sensors=sensors,
    )


def with_swapped_wheels(networks: FeedForward) -> FeedForward:
    """Return the networks' mirror images."""
    return FeedForward(networks.input_hidden, networks.hidden_output[:, ::-1].copy(), networks.hidden_switch)


def random_poses(config: Config, episodes: int) -> FloatArray:
    """Return random start poses ``(episodes, robots, 3)``, as the simulator draws them."""
    robots = config.team.robots
    room = config.arena.size / 2 - config.robot.radius - 0.005
    drawn = changed(
        config,
        team={"start": "random", "start_region": (-room, room, -room, room)},
        episode={"horizon": config.episode.control_period},
    )
    drivers = np.zeros((episodes, robots), dtype=np.uint32)
    done = sound(simulate(Scene(drawn), random_networks(1, 0), keys(episodes), drivers, ("pose",)))
    return done.telemetry.pose[:, 0]


def mirror(episodes: int, horizon: float, config: Config | None = None) -> Mirror:
    """Run random teams and their mirror images, without noise."""
    plain = changed(without_noise(config or Config()), box={"pose": (0.05, 0.1, 0.3)}, episode={"horizon": horizon})
    networks = random_networks(episodes, seed=11, forward=1.0)
    swapped = with_swapped_wheels(networks)
    deviations = []
    for i, poses in enumerate(random_poses(plain, episodes)):
        started = changed(plain, team={"start": "poses", "start_poses": tuple(map(tuple, poses))})
        here = _places(started, networks, i)
        there = _places(mirrored(started, poses), swapped, i)
        there[..., 0] *= -1
        deviations.append(np.linalg.norm(here - there, axis=-1).max(axis=1))
    deviation = np.array(deviations)
    times = np.arange(deviation.shape[1], dtype=np.float64) * plain.episode.control_period
    return Mirror(times, deviation)


def _places(config: Config, networks: FeedForward, policy: int) -> FloatArray:
    """Return where robots and box are: ``(steps, bodies, 2)``."""
    drivers = np.full((1, config.team.robots), policy, dtype=np.uint32)
    telemetry = sound(simulate(Scene(config), networks, keys(1), drivers, ("pose", "box"))).telemetry
    return np.concatenate([telemetry.pose[0, :, :, :2], telemetry.box[0, :, np.newaxis, :2]], axis=1)


# ---- the page --------------------------------------------------------------------------------------------------------


def section(settings: Settings) -> Section:
    """Measure, and write this part of the page."""
    found = [stress(crowd, round(settings.episodes * crowd.share), settings.threads) for crowd in CROWDS]
    images = mirror(episodes=max(20, settings.pairs // 10), horizon=30.0)
    text = "\n".join([_stress_text(found), _mirror_text(images)])
    return Section(text, {"mirror.png": _figure(images)})


def _stress_text(found: list[Stress]) -> str:
    rows = [
        [
            stress.crowd.robots,
            f"{stress.crowd.arena:g}",
            stress.episodes,
            f"{stress.steps / 1e6:.1f}",
            stress.failed,
            f"{millimetres(float(stress.penetration.max())):.2f}",
            int((stress.penetration > DEEPEST).sum()),
            f"{millimetres(float(stress.lift.max())):.1f}",
            f"{np.degrees(np.arccos(stress.upright.min())):.1f}",
            stress.fallen(),
            stress.messages,
            f"{stress.messages_per_million():.2f}",
            stress.unsolved,
            stress.moved,
        ]
        for stress in found
    ]
    head = [
        "robots",
        "arena [m]",
        "episodes",
        "million steps",
        "failed (NaN, ODE errors)",
        "deepest overlap [mm]",
        f"episodes beyond {millimetres(DEEPEST):g} mm",
        "highest lift [mm]",
        "largest tilt [deg]",
        "fallen",
        "ODE messages",
        "per million steps",
        "unsolved steps",
        "episodes in which the box moved",
    ]
    total = sum(stress.episodes for stress in found)
    deepest = max(float(stress.penetration.max()) for stress in found)
    beyond = sum(int((stress.penetration > DEEPEST).sum()) for stress in found)
    rate = 1e6 * sum(stress.messages for stress in found) / sum(stress.steps for stress in found)
    fallen = sum(stress.fallen() for stress in found)
    return f"""## Invariants under stress

{total} episodes of {HORIZON:g} s with the default physics and noise: random networks, robots starting anywhere around
a box
in the middle.

{table(head, rows)}
- No state that is not a number, no error of ODE: **{_yes(not any(stress.failed for stress in found))}**.
- Overlaps below {millimetres(DEEPEST):g} mm, beyond what bumpers may be pressed in: **{_yes(deepest <= DEEPEST)}**; the
deepest of any two bodies, walls or floor is {millimetres(deepest):.2f} mm, {beyond} of {total} episodes go beyond.
- Robots that fell over: {fallen}. The default drive keeps bodies level, and refuses robots that would tip; with the
articulated one they may fall: not an error, but an outcome (`min_upright`).
- ODE messages per million steps: {rate:.2f} (limit {MOST_MESSAGES}: **{_yes(rate < MOST_MESSAGES)}**). Each makes the
step be taken back and tried again with softer contacts; steps that no further try mended
are the column before the last.
"""


def _mirror_text(images: Mirror) -> str:
    marks = [1.0, 3.0, 10.0, 29.9]
    rows = []
    for mark in marks:
        index = int(np.searchsorted(images.times, mark - 1e-9))
        now = images.deviation[:, : index + 1].max(axis=1)
        rows.append(
            [
                f"{mark:g}",
                f"{millimetres(float(np.median(now))):.1e}",
                f"{millimetres(float(np.quantile(now, 0.9))):.1e}",
                f"{millimetres(float(now.max())):.1e}",
                f"{100 * np.mean(now < 1e-6):.0f} %",
                f"{100 * np.mean(now < 1e-3):.0f} %",
            ]
        )
    head = ["within [s]", "median [mm]", "90 % [mm]", "largest [mm]", "below 1 um", "below 1 mm"]
    return f"""### Mirror images

{len(images.deviation)} random teams without noise, and the same mirrored at x = 0: start poses, box, emitter and
sensors' bearings
mirrored, the networks' wheels swapped. The largest distance between a body and its mirror image's mirror image so far:

{table(head, rows)}
Rounding differs between the images (contacts come to the solver in another order), and collisions and sensors that
switch multiply small differences. {_verdict_on_sides(images)}

![Growth of the distance between mirror images](validation/mirror.png)
"""


def _verdict_on_sides(images: Mirror) -> str:
    """Judge the first second, in which rounding has not grown much."""
    first = images.deviation[:, images.times <= 1.0].max(axis=1)
    together = float(np.mean(first < 1e-9))
    if together >= 0.75:
        return f"After a second {100 * together:.0f} % are within a nanometre: nothing in the physics prefers a side."
    return (
        f"**After a second only {100 * together:.0f} % are within a nanometre: that is faster than rounding grows, so "
        "some contact model is not quite symmetric.**"
    )


def _yes(fact: bool) -> str:
    return "yes" if fact else "no"


def _figure(images: Mirror) -> Figure:
    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.add_subplot()
    deviation = np.maximum(millimetres(1) * images.deviation, 1e-13)
    axes.plot(images.times, deviation.T, color="0.8", linewidth=0.6)
    for share, style in ((0.5, "C0-"), (0.9, "C1-")):
        axes.plot(images.times, np.quantile(deviation, share, axis=0), style, label=f"{100 * share:.0f} % below")
    axes.set(yscale="log", xlabel="time [s]", ylabel="distance from the mirror image [mm]")
    axes.legend()
    return figure

# SPDX-License-Identifier: BSD-3-Clause
"""An episode as the player takes it: small integers in base64."""

from __future__ import annotations

import base64
import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from swarmevo.analysis.recording import Recording
from swarmevo.config import LIGHT, Config, scene_info, surroundings
from swarmevo.protocols import WHEELS, FloatArray
from swarmevo.simulation import layout
from swarmevo.views import text
from swarmevo.views.replay import networks, scene
from swarmevo.views.replay.senses import senses

FORMAT: Final = 4
"""Of an episode's data, for the player."""

MOST_BYTES: Final = 4_000_000
"""Of an episode's control steps in a page: 58 minutes of the paper's team. A longer episode is thinned."""

_LARGEST: Final = 32767  # of 16-bit integers with a sign


def data(
    recording: Recording, title: str, subtitle: str = "", warning: str = "", most_bytes: int = MOST_BYTES
) -> dict[str, Any]:
    """Return an episode as the player takes it: numbers, text and base64, to be written as JSON.

    Args:
        recording: The episode.
        title: Names it.
        subtitle: Says where it is from.
        warning: Shown with it, if any.
        most_bytes: If its control steps take more, only one of several is kept, which the captions tell: as ``thinned``
            there is one of how many. The player interpolates.
    """
    count = recording.telemetry.pose.shape[1]
    steps = chunk(recording, range(count))
    every = math.ceil(sum(map(len, _texts(steps))) / most_bytes)
    shown = [("control steps shown", f"1 of {every}, {recording.config.episode.control_period * every:.3g} s apart")]
    return {
        **head(recording, title, subtitle, every),
        **outcome(recording),
        "horizon": _seconds(recording),
        "facts": facts(recording) + (shown if every > 1 else []),
        "warning": warning,
        "chunks": [steps if every == 1 else chunk(recording, range(0, count, every))],
    }


def _texts(steps: dict[str, Any]) -> list[str]:
    return [*(array for array in steps.values() if isinstance(array, str)), *steps["terms"]]


def head(recording: Recording, title: str, subtitle: str, every: int = 1) -> dict[str, Any]:
    """Return what is known of an episode as soon as it has begun."""
    config = recording.config
    surrounding, span = surroundings(config), _span(config)
    homing, drawn = layout.homing_emitters(surrounding), networks.drawn(recording)
    return {
        "format": FORMAT,
        "title": title,
        "subtitle": subtitle,
        "robots": config.team.robots,
        "colours": scene.colours(config.team.robots),
        "period": config.episode.control_period * every,
        "thinned": every,
        "horizon": config.episode.horizon,
        "arena": {"bounds": config.arena.bounds, "planes": scene.clipping(config)},
        "ground": {"grey": surrounding.grey, "patches": [patch.grey for patch in surrounding.patches]},
        "movables": [{"shape": movable.shape, "size": movable.size} for movable in surrounding.movables or ()],
        "emitters": [
            {
                "position": emitter.position,
                "range": emitter.range,
                "rides_on": emitter.rides_on,
                "label": text.emitter(surrounding, emitter),
            }
            for emitter in surrounding.emitters or ()
        ],
        "homing": [None] * config.team.robots if homing else None,
        "senses": senses(config),
        "observations": scene_info(config).observations,
        "message": scene_info(config).message,
        "networks": drawn,
        "hidden": max((len(one["hidden"]) for one in drawn), default=0),
        "at": f"at the {text.source(homing)}" if len(homing) == 1 else f"at a {text.source(homing)}",
        "delivery": text.delivery(surrounding),
        "distance": text.delivery_distance(surrounding),
        "legend": _legend(config),
        "robot": {
            "radius": config.robot.radius,
            "wheel": config.robot.wheel_radius,
            "axle": config.robot.axle_length,
            "speed": config.robot.top_speed,
            "bumper": config.robot.bumper,
            "height": config.robot.height,
        },
        "unit": {"position": span / _LARGEST, "heading": math.pi / _LARGEST, "gap": 2 * span / _LARGEST},
        "terms": list(recording.terms),
        "explained": text.words(recording.objectives[recording.explained].name) if recording.terms else "",
        "scene": scene.packed(config),
    }


def _span(config: Config) -> float:
    """Return twice the largest coordinate in the arena [m]: the paper's is as long as a side."""
    return 2 * max(map(abs, config.arena.bounds))


def _legend(config: Config) -> list[tuple[str, str]]:
    """Return what the scene shows: kinds of marks, and their names."""
    seen, sensed = surroundings(config), config.robot.sensors
    goals = seen.goals or ()
    marks = {
        ("signal", "RF signal"): bool(seen.radio_channels),
        ("light", "light"): any(emitter.channel == LIGHT for emitter in seen.emitters or ()),
        ("infrared", "infrared"): "infrared" in sensed,
        ("touch", "box sensor" if layout.has_one_box(seen) else "touch sensor"): "touch" in sensed
        and bool(seen.movables),
        ("heard", "range and bearing"): "range_and_bearing" in sensed and config.team.robots > 1,
        ("message", "with a message"): scene_info(config).message > 0 and config.team.robots > 1,
        ("bumper", "bumper"): config.robot.bumper == "sprung",
        ("target", "target wall"): any(goal.wall for goal in goals),
        ("region", "goal"): any(goal.region for goal in goals),
    }
    return [mark for mark, is_shown in marks.items() if is_shown]


def outcome(recording: Recording) -> dict[str, Any]:
    """Return what is known of an episode when it is over."""
    telemetry = recording.telemetry
    has_source = bool(layout.homing_emitters(surroundings(recording.config)))
    return {
        "homing": [_time(time) for time in telemetry.homing_time[0].tolist()] if has_source else None,
        "push": _time(float(telemetry.push_time[0])),
        "facts": facts(recording),
    }


def _seconds(recording: Recording) -> float:
    """Return how long the episode is [s]."""
    episode, steps = recording.config.episode, int(recording.episodes.steps[0])
    is_whole = steps == round(episode.horizon / episode.control_period)
    return episode.horizon if is_whole else steps * episode.control_period


def facts(recording: Recording) -> list[tuple[str, str]]:
    """Return an episode's caption: labels and values."""
    telemetry = recording.telemetry
    home = np.sort(telemetry.homing_time[0][~np.isnan(telemetry.homing_time[0])])
    robots = recording.config.team.robots
    said = [
        (text.words(objective.name), text.number(value))
        for objective, value in zip(recording.objectives, recording.values[0].tolist(), strict=True)
    ]
    if recording.complexity not in recording.values[0]:  # else an objective tells it
        said.append(("hidden neurons", f"{recording.complexity:g}"))
    seen = surroundings(recording.config)
    if homing := text.homing(layout.homing_emitters(seen)):
        came = ", ".join([f"{len(home)} of {robots}", *([text.span(home.tolist())] if len(home) else [])])
        said.append((homing, came))
    if delivered := text.delivery(seen):
        said.append((delivered, text.moment(float(telemetry.push_time[0]))))
    is_over = recording.config.episode.until == "push" and not math.isnan(telemetry.push_time[0])
    if len(seen.movables or ()) > 1 and seen.goals and not is_over:
        end = int(telemetry.at_goal[0, int(recording.episodes.steps[0]) - 1].sum())
        said.append(("at a goal in the end", f"{end} of {len(seen.movables or ())}"))
    return said


def chunk(recording: Recording, steps: range) -> dict[str, Any]:
    """Return some control steps of an episode as arrays of small integers in base64, and their number.

    An array's axes are those of the telemetry behind the episode; ``command`` is of the wheels, ``gap`` is the distance
    between a goal and the movable nearest to one, and is empty where nothing is to be brought anywhere. Of the steps
    that are left out, commands and terms are in the mean, and neither a touch nor a message is lost.
    """
    config, telemetry = recording.config, recording.telemetry

    def channel(name: str) -> FloatArray:
        return telemetry.channels[name][0, steps.start : steps.stop : steps.step]

    def most(name: str) -> FloatArray:
        return np.maximum.reduceat(telemetry.channels[name][0, steps.start : steps.stop], starts, axis=0)

    def mean(values: FloatArray) -> FloatArray:
        sums: FloatArray = np.add.reduceat(values[steps.start : steps.stop], starts, axis=0)
        return sums / lengths.reshape(-1, *[1] * (values.ndim - 1))

    starts = np.arange(0, steps.stop - steps.start, steps.step)
    lengths = np.diff(starts, append=steps.stop - steps.start)

    span = _span(config)
    scale = np.array([span, span, math.pi])
    touch = [name.startswith("touch_") for name in scene_info(config).observation_names]
    gap = layout.delivery_distance(config, channel("movables"), channel("at_goal"))
    return {
        "steps": len(steps),
        "pose": _integers(channel("pose") / scale, np.int16),
        "movables": _integers(channel("movables") / scale, np.int16),
        "command": _integers(mean(telemetry.channels["command"][0, ..., : len(WHEELS)]), np.int8),
        "observation": _integers(np.where(touch, most("observation"), channel("observation")), np.int8),
        "hidden": _integers(networks.activations(recording)[steps.start : steps.stop : steps.step], np.int8),
        "message": _integers(most("message"), np.uint8),
        "at_goal": _integers(most("at_goal"), np.uint8),
        "gap": "" if gap is None else _integers(gap / (2 * span), np.int16),
        "terms": [_floats(mean(series[0])) for series in recording.terms.values()],
    }


def _integers(fractions: FloatArray, kind: type[np.integer[Any]]) -> str:
    """Return ``fractions`` of 1 as integers of a kind, whose largest stands for 1."""
    limits = np.iinfo(kind)
    return _base64(np.clip(np.rint(fractions * limits.max), limits.min, limits.max).astype(kind))


def _floats(values: FloatArray) -> str:
    return _base64(values.astype("<f4"))


def _base64(array: NDArray[Any]) -> str:
    return base64.b64encode(array.astype(array.dtype.newbyteorder("<")).tobytes()).decode("ascii")


def _time(time: float) -> float | None:
    return None if math.isnan(time) else round(time, 3)

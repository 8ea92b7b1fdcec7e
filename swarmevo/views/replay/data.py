# SPDX-License-Identifier: BSD-3-Clause
"""An episode as the player takes it: small integers in base64."""

from __future__ import annotations

import base64
import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from swarmevo.analysis.recording import Recording
from swarmevo.config import Config
from swarmevo.protocols import FloatArray
from swarmevo.views import text
from swarmevo.views.replay import scene

FORMAT: Final = 1
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
    count = len(recording.telemetry.box[0])
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
    size, strength = config.arena.size, config.emitter.strength
    return {
        "format": FORMAT,
        "title": title,
        "subtitle": subtitle,
        "robots": config.team.robots,
        "colours": scene.colours(config.team.robots),
        "period": config.episode.control_period * every,
        "thinned": every,
        "horizon": config.episode.horizon,
        "arena": size,
        "emitter": {"position": config.emitter.position, "range": config.emitter.range, "strength": strength},
        "robot": {
            "radius": config.robot.radius,
            "wheel": config.robot.wheel_radius,
            "axle": config.robot.axle_length,
            "speed": config.robot.top_speed,
            "bumper": config.robot.bumper,
            "touch": scene.touch_sensors(config),
        },
        "unit": {"position": size / _LARGEST, "heading": math.pi / _LARGEST, "gap": 2 * size / _LARGEST},
        "terms": list(recording.terms),
        "explained": f"F{recording.explained + 1}" if recording.terms else "",
        "scene": scene.packed(config),
    }


def outcome(recording: Recording) -> dict[str, Any]:
    """Return what is known of an episode when it is over."""
    telemetry = recording.telemetry
    return {
        "homing": [_time(time) for time in telemetry.homing_time[0].tolist()],
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
        (f"F{number}, {text.words(objective.name)}", text.number(value))
        for number, (objective, value) in enumerate(
            zip(recording.objectives, recording.values[0].tolist(), strict=True), start=1
        )
    ]
    if recording.complexity not in recording.values[0]:  # else an objective tells it
        said.append(("hidden neurons", f"{recording.complexity:g}"))
    came = ", ".join([f"{len(home)} of {robots}", *([text.span(home.tolist())] if len(home) else [])])
    push = float(telemetry.push_time[0])
    return [
        *said,
        ("robots at the source", came),
        ("box at the wall", text.moment(push)),
    ]


def chunk(recording: Recording, steps: range) -> dict[str, Any]:
    """Return some control steps of an episode as arrays of small integers in base64, and their number.

    An array's axes are those of the telemetry behind the episode; ``rf`` is over the strongest signal, ``gap`` is the
    distance between box and target wall. Of the steps that are left out, commands and terms are in the mean, and no
    touch is lost.
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

    scale = np.array([config.arena.size, config.arena.size, math.pi])
    strongest = max(config.emitter.strength[1], 1e-9)
    return {
        "steps": len(steps),
        "pose": _integers(channel("pose") / scale, np.int16),
        "box": _integers(channel("box") / scale, np.int16),
        "command": _integers(mean(telemetry.channels["command"][0]), np.int8),
        "touch": _integers(most("touch"), np.uint8),
        "rf": _integers(channel("rf") / strongest, np.uint8),
        "contact": _integers(most("box_contact"), np.uint8),
        "gap": _integers(_gap(config, channel("box")) / (2 * config.arena.size), np.int16),
        "terms": [_floats(mean(series[0])) for series in recording.terms.values()],
    }


def _gap(config: Config, box: FloatArray) -> FloatArray:
    """Return the distance ``(steps,)`` [m] between the box's nearest corner and the target wall."""
    axis, sign = {"east": (0, 1), "west": (0, -1), "north": (1, 1), "south": (1, -1)}[config.arena.target_wall]
    length, width, _ = config.box.size
    cosine, sine = np.abs(np.cos(box[:, 2])), np.abs(np.sin(box[:, 2]))
    reach = (length * cosine + width * sine if axis == 0 else length * sine + width * cosine) / 2
    gap: FloatArray = config.arena.size / 2 - sign * box[:, axis] - reach
    return gap


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

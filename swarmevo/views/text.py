# SPDX-License-Identifier: BSD-3-Clause
"""Numbers, times, rates, counts and names as text: once, for console, report, replays and figures.

A number and its unit stay on one line: between them is a no-break space, and a narrow one between thousands; what is
compared has its mathematical sign. :func:`plain` takes these back for a console, where people search and copy.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from datetime import timedelta
from typing import TYPE_CHECKING, Final

from swarmevo.printable import printable

if TYPE_CHECKING:
    from swarmevo.analysis.fronts import Cost
    from swarmevo.analysis.measures import Measures
    from swarmevo.analysis.table_ii import Outcome, PaperRow
    from swarmevo.config import Emitter, Surroundings
    from swarmevo.protocols import Objective

_GAP: Final = "\N{NO-BREAK SPACE}"
_THOUSANDS: Final = "\N{NARROW NO-BREAK SPACE}"

_LEAST: Final = "\N{GREATER-THAN OR EQUAL TO}"
_MOST: Final = "\N{LESS-THAN OR EQUAL TO}"

NEVER: Final = "Max"
"""The paper's word in Table II for a time that was never reached."""
STANDSTILL: Final = "no new genome; the optimiser asked only for those that the trial had before"
"""Of a generation, as a warning."""


# ---- names -----------------------------------------------------------------------------------------------------------


def words(name: str) -> str:
    """Return a name of code as people read it."""
    return printable(name).replace("_", " ")


def label(objective: Objective) -> str:
    """Return an objective's name as people read it, with the direction that is better."""
    return f"{words(objective.name)} ({'more' if objective.is_maximised else 'less'} is better)"


def not_drawn(objectives: Sequence[Objective]) -> str:
    """Return which objectives a chart of the first two does not have; empty: it has all."""
    names = ", ".join(words(objective.name) for objective in objectives[2:])
    return f"not drawn: {names}, in which a point may be better" if names else ""


def source(emitters: Sequence[Emitter]) -> str:
    """Return what the emitters are that robots home in on: a source, heard within its range only, or a beacon."""
    is_hidden = all(emitter.reach == "range" and emitter.rides_on is None for emitter in emitters)
    return "source" if is_hidden else "beacon"


def emitter(scene: Surroundings, one: Emitter) -> str:
    """Return what an emitter is called in its scene."""
    alike = [other for other in scene.emitters or () if other.channel == one.channel]
    return source(alike) if one.channel in scene.radio_channels[:1] else words(one.channel)


def homing(emitters: Sequence[Emitter]) -> str:
    """Return which robots have homed in on the emitters; empty: there is nothing to home in on."""
    return f"robots at {'a' if len(emitters) > 1 else 'the'} {source(emitters)}" if emitters else ""


def delivery(scene: Surroundings) -> str:
    """Return what a push is in a scene: that all movables have been at a goal; empty: there is nothing to bring."""
    movables, goals = scene.movables or (), scene.goals or ()
    if not movables or not goals:
        return ""
    if len(movables) > 1:
        return "all at a goal"
    return f"{movables[0].shape} at the {'wall' if all(goal.wall for goal in goals) else 'goal'}"


def delivery_distance(scene: Surroundings) -> str:
    """Return what is nearest to a goal, and to which; empty: nothing is to be brought anywhere."""
    goals = scene.goals or ()
    if not delivery(scene):
        return ""
    movables = scene.movables or ()
    what = movables[0].shape if len(movables) == 1 else "nearest movable"
    if len(goals) > 1:
        return f"{what} to a goal"
    return f"{what} to {'target wall' if goals[0].wall else 'goal'}"


# ---- numbers ---------------------------------------------------------------------------------------------------------


def number(value: float) -> str:
    """Return a number to four digits."""
    return f"{value:.4g}"


def difference(value: float) -> str:
    """Return a difference with its sign, to three digits."""
    return f"{value:+.3g}"


def throughput(rate: float, what: str) -> str:
    """Return how many things are done in a second, to three digits."""
    return f"{rate:.3g} {what}/s"


def percent(share: float) -> str:
    """Return a share in [0, 1] as whole percents."""
    return f"{share:.0%}"


def percent_within(share: float, interval: tuple[float, float]) -> str:
    """Return a share in [0, 1] as whole percents, with the interval that it is known within: ``73% (58-84)``."""
    low, high = interval
    return f"{percent(share)} ({100 * low:.0f}-{100 * high:.0f})"


def grouped(value: float) -> str:
    """Return a whole number with gaps between thousands."""
    return f"{value:,.0f}".replace(",", _THOUSANDS)


def count(value: int, what: str) -> str:
    """Return a number of things; ``what`` is the singular of a regular noun."""
    return f"{grouped(value)} {what}{'s' * (value != 1)}"


def generations(first: int, last: int) -> str:
    """Return from which generation to which."""
    return f"generation {first}" if first == last else f"generations {first} to {last}"


def plain(text: str) -> str:
    """Return text as a console has it: ordinary spaces, none between thousands, and signs that keys have."""
    return text.replace(_THOUSANDS, "").replace(_GAP, " ").replace(_LEAST, ">=").replace(_MOST, "<=")


# ---- times -----------------------------------------------------------------------------------------------------------


def seconds(time: float) -> str:
    """Return a time in seconds to a tenth."""
    return f"{time:.1f}{_GAP}s"


def horizon(time: float) -> str:
    """Return a time in seconds that somebody has set, as it was set."""
    return f"{time:g}{_GAP}s"


def time_taken(time: float | None) -> str:
    """Return a mean time as Table II has it; None: nobody succeeded."""
    return NEVER if time is None else seconds(time)


def moment(time: float) -> str:
    """Return when something happened in an episode; NaN: never."""
    return "never" if math.isnan(time) else f"after {seconds(time)}"


def span(times: Sequence[float]) -> str:
    """Return the first and the last of sorted times."""
    first, last = seconds(times[0]), seconds(times[-1])
    return first if first == last else f"{times[0]:.1f} to {last}"


def duration(time: float) -> str:
    """Return a length of time in seconds in the unit that suits it."""
    if time < 60:
        return f"{time:.0f}{_GAP}s"
    if time < 3600:
        return f"{time / 60:.0f}{_GAP}min"
    if time < 48 * 3600:
        return f"{time / 3600:.1f}{_GAP}h"
    return f"{timedelta(seconds=time) / timedelta(days=1):.1f}{_GAP}days"


def clock(time: float) -> str:
    """Return a length of time in seconds as ``h:mm:ss``: to the second, and of one width while it runs."""
    return str(timedelta(seconds=round(time)))


# ---- results ---------------------------------------------------------------------------------------------------------


def rate(share: float, time: float | None) -> str:
    """Return a share that succeeded, and after which mean time, if any did."""
    return percent(share) + (f", after {seconds(time)}" if time is not None else "")


def outcome(found: Outcome | PaperRow) -> list[str]:
    """Return what tests gave: share and mean time of the robots at the source, then of the box at the wall."""
    return [*came_home(found), *pushed(found)]


def came_home(found: Outcome | PaperRow) -> list[str]:
    """Return the share of robots that came to the source, and after which mean time."""
    return [percent(found.homing_rate), time_taken(found.homing_time)]


def pushed(found: Outcome | PaperRow) -> list[str]:
    """Return the share of tests in which all movables were at a goal, and after which mean time."""
    return [percent(found.push_rate), time_taken(found.push_time)]


def measured(found: Outcome, measures: Measures) -> list[str]:
    """Return what tests gave in each of a task's measures; :func:`measured_heads` has the heads."""
    return [
        *(came_home(found) if measures.homing else []),
        *(pushed(found) if measures.push else []),
        *(percent(share) for share in found.success_rates.values()),
        *([] if measures.paper else [mean(*one) for one in found.objectives.values()]),
    ]


def measured_heads(measures: Measures, objectives: Iterable[str], homing: str, push: str) -> list[str]:
    """Return what the cells of :func:`measured` are.

    Args:
        measures: Of the task.
        objectives: Names of those that are measured in an episode.
        homing: What it is called where robots come to the source.
        push: What it is called where all movables are at a goal.
    """
    return [
        *([homing, "time taken"] if measures.homing else []),
        *([push, "time taken"] if measures.push else []),
        *map(success, measures.successes),
        *([] if measures.paper else map(words, objectives)),
    ]


def success(objective: Objective) -> str:
    """Return from which value of an objective on an episode is a success."""
    assert objective.success is not None
    return f"{words(objective.name)} {_LEAST if objective.is_maximised else _MOST} {number(objective.success)}"


def mean(value: float, error: float | None) -> str:
    """Return a mean and its standard error, if it is known."""
    return number(value) if error is None else f"{number(value)}{_GAP}±{_GAP}{error:.2g}"


def speed(cost: Cost) -> str:
    """Return how fast a run was simulated."""
    ratio = cost.simulated_seconds / cost.seconds if cost.seconds else 0.0
    return f"{grouped(ratio)} times real time"


def physics(cost: Cost) -> str:
    """Return what went wrong in a run's episodes, as a list of counts."""
    counts = [f"{count(cost.ode_messages, 'warning')} of ODE", count(cost.unsolved_steps, "unsolved step")]
    if cost.faults:
        counts.append(count(cost.faults, "failed episode"))
    return ", ".join(counts)

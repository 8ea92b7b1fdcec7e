# SPDX-License-Identifier: BSD-3-Clause
"""A stored episode, simulated once more, judged, and compared with what is stored."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from swarmevo.analysis import assessment, shipped
from swarmevo.analysis.measures import DELIVERED, HOMING, PUSH, measures_of
from swarmevo.analysis.recording import Recording, record
from swarmevo.config import Config
from swarmevo.errors import ReplayError
from swarmevo.evolution.results import Results
from swarmevo.protocols import FloatArray
from swarmevo.runs import other_world
from swarmevo.runs.store import Store
from swarmevo.runs.verification import explain
from swarmevo.simulation import EpisodeKey
from swarmevo.views.replay.data import chunk, data, head, outcome

_FIRST_SECONDS: Final = 10.0  # of a streamed episode


@dataclass(frozen=True)
class Chosen:
    """A stored episode of an individual."""

    genome: int
    """The individual's id in the store."""
    genes: FloatArray
    """``(size,)``"""
    key: EpisodeKey
    hash: int
    """Of its trajectory, as stored."""
    session: int
    """That ran it."""
    fault: str
    """Why it failed, as stored; empty: it did not."""


# ---- which episode ---------------------------------------------------------------------------------------------------


def choose(store: Store, genome: int | None = None, generation: int | None = None, repeat: int | None = None) -> Chosen:
    """Return one of an individual's stored episodes.

    Args:
        store: The run.
        genome: The individual's id; None: the most successful (:func:`swarmevo.analysis.assessment.most_successful`).
        generation: In which it was evaluated; None: any, or with a ``repeat`` the last one.
        repeat: Which of that evaluation's episodes; None: the most successful one, of equals that of the last
            generation with the lowest number.

    Raises:
        ReplayError: The run has no such episode.
        StoreError: The run cannot be read.
    """
    return chosen_of(store, *_individual(store, genome), generation, repeat)


def chosen_of(
    store: Store, genome: int, trial: int, generation: int | None = None, repeat: int | None = None
) -> Chosen:
    """Return one of the stored episodes of an individual of a trial, from 0; see :func:`choose`.

    With a ``generation`` no other one is read.

    Raises:
        ReplayError: There is no such episode.
        StoreError: The run cannot be read.
    """
    lives = store.lives(genome, trial, generation)
    if len(lives.generation) == 0:
        others = store.lives(genome, trial).generation
        raise ReplayError(
            f"{store.folder}: individual {genome} was not evaluated in generation {generation}"
            + (f", but in {others[0]}" if len(others) else "")
        )
    if repeat is None:
        i = _most_successful(store, lives.episodes)
    else:
        its_own = np.flatnonzero(lives.generation == lives.generation[0])
        if not 0 <= repeat < len(its_own):
            raise ReplayError(f"{store.folder}: expected a repeat from 0 to {len(its_own) - 1}, got {repeat}")
        i = int(its_own[repeat])
    key = EpisodeKey(store.seed, trial, int(lives.generation[i]), int(lives.episodes.repeat[i]))
    hash, fault = int(lives.episodes["hash"][i]), lives.episodes.faults[i]
    return Chosen(genome, store.genome(genome), key, hash, int(lives.session[i]), fault)


def _most_successful(store: Store, episodes: Results) -> int:
    """Return the first of those episodes that did not fail and succeeded best in what matters most in the task."""
    measures = measures_of(store.config, store.objectives)
    rates = {
        **dict.fromkeys((PUSH, DELIVERED), ~np.isnan(episodes["push_time"])),
        HOMING: np.count_nonzero(~np.isnan(episodes["homing_time"]), axis=1) / episodes["robots"],
    }
    rates |= {one.name: one.is_success(episodes["objective"][:, k]) for k, one in enumerate(store.objectives)}
    ranked = [[fault == "" for fault in episodes.faults], *(rates[rate] for rate in measures.rates)]
    return int(np.lexsort([-np.asarray(rate, dtype=np.float64) for rate in reversed(ranked)])[0])


def _individual(store: Store, genome: int | None) -> tuple[int, int]:
    """Return an individual's id and a trial that it lived in."""
    if genome is None:
        if not store.trials():
            raise ReplayError(f"{store.folder}: there is no individual yet; go on with: swarmevo resume {store.folder}")
        return assessment.watched(store)
    found = store.individuals()
    places = np.flatnonzero(found.genome == genome)
    if len(places) == 0:
        raise ReplayError(f"{store.folder}: there is no individual {genome}; see: swarmevo show {store.folder}")
    return genome, int(found.trial[places[0]])


# ---- once more -------------------------------------------------------------------------------------------------------


def replay(store: Store, chosen: Chosen, force: bool = False) -> tuple[Recording, str]:
    """Simulate a stored episode once more.

    Returns:
        The recording, and a warning: empty if it is the stored episode to the last bit.

    Raises:
        EvaluationError: It fails now.
        ReplayError: It failed when it was run, or it is another one; ``force`` tries the former and shows the latter.
    """
    if chosen.fault and not force:
        raise ReplayError(
            f"individual {chosen.genome}, repeat {chosen.key.repeat}: nothing to show, the stored episode failed: "
            f"{chosen.fault}; choose another one with --repeat or --generation"
        )
    recording = record(other_world.of_episode(store.config, chosen.key), chosen.genes, [chosen.key], threads=1)
    found = int(recording.episodes.hash[0])
    if found == chosen.hash:
        return recording, ""
    difference = (
        f"individual {chosen.genome}: the trajectory is not the stored one "
        f"(hash {found:016x} instead of {chosen.hash:016x}): {'; '.join(explain(store, chosen.session))}"
    )
    if not force:
        raise ReplayError(f"{difference}; --force shows it all the same")
    return recording, difference


def episodes(
    store: Store, chosen: Chosen, robots: Sequence[int] = (), force: bool = False, overrides: Sequence[str] = ()
) -> tuple[list[dict[str, Any]], str]:
    """Return an episode as :func:`data`, once more with the run's team, or with teams of other sizes.

    Args:
        store: The run.
        chosen: Of it.
        robots: Team sizes; none: that of the run.
        force: Show another trajectory than the stored one, with a warning.
        overrides: In another world (:func:`swarmevo.runs.other_world.load`): not the stored episode, with a warning.

    Returns:
        The episodes, and the warning, empty if there is none.

    Raises:
        ConfigError: An override is refused, or a size, as :func:`swarmevo.runs.other_world.of_size`.
        ReplayError: As :func:`replay`.
    """
    settings = other_world.load(store, overrides)
    changes = other_world.changes(store.config, settings)
    name = f"{store.folder.resolve().name}, individual {chosen.genome}"
    key = chosen.key
    place = f"seed {key.seed}, trial {key.trial}, generation {key.generation}, repeat {key.repeat}"
    elsewhere = f"another world than the stored episode's: {', '.join(changes)}; its trajectory is not compared"
    shown, warning = [], ""
    own_size = other_world.of_episode(store.config, key).team.robots
    for size in robots or [settings.team.robots if changes else own_size]:
        if size == own_size and not changes:
            recording, said = replay(store, chosen, force)
        else:
            recording = record(*other_world.team_of(settings, chosen.genes, size), [key], threads=1)
            said = elsewhere if changes else ""
        warning = warning or said
        title = name if len(robots) < 2 else f"{size} robot" + "s" * (size > 1)
        subtitle = place if len(robots) < 2 else f"{name}, seed {key.seed}"
        shown.append(data(recording, title, subtitle, said))
    return shown, warning


def shipped_episodes(
    repeat: int = 0, robots: Sequence[int] = (), overrides: Sequence[str] = ()
) -> list[dict[str, Any]]:
    """Return an episode of the shipped controller as :func:`data`, with teams of some sizes; none: the paper's five.

    Raises:
        ConfigError: An override is refused.
    """
    paper, genes = shipped.best()
    config = other_world.changed(paper, overrides)
    key = shipped.key(repeat=repeat)
    place = ", ".join([f"seed {key.seed}, repeat {key.repeat}", *overrides])
    shown = []
    for size in robots or [config.team.robots]:
        title = shipped.TITLE if len(robots) < 2 else f"{size} robot" + "s" * (size > 1)
        recording = record(*other_world.team_of(config, genes, size), [key], threads=1)
        shown.append(data(recording, title, place))
    return shown


def stream(config: Config, genes: FloatArray, key: EpisodeKey, title: str, subtitle: str) -> Iterator[tuple[str, Any]]:
    """Simulate an episode and yield what is known as soon as it is.

    The episode is simulated for 10 s, then from its start for twice as long, and so on: together at most twice the
    work, in any controller's own way of running. An episode's beginning does not depend on its horizon.

    Yields:
        ``("head", ...)``, then ``("chunk", ...)`` as often as needed, then ``("outcome", ...)``.
    """
    period, total = config.episode.control_period, round(config.episode.horizon / config.episode.control_period)
    done = 0
    while done < total:
        end = min(total, max(2 * done, math.ceil(_FIRST_SECONDS / period)))
        horizon = config.episode.horizon if end == total else end * period
        episode = config.episode.model_copy(update={"horizon": horizon})
        recording = record(config.model_copy(update={"episode": episode}), genes, [key], threads=1)
        if done == 0:
            yield (
                "head",
                {**head(recording, title, subtitle), "horizon": config.episode.horizon, "warning": "", "chunks": []},
            )
        yield "chunk", chunk(recording, range(done, recording.telemetry.pose.shape[1]))
        done = total if recording.telemetry.pose.shape[1] < end else end
    yield "outcome", outcome(recording)

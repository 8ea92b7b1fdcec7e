# SPDX-License-Identifier: BSD-3-Clause
"""An individual of a run that may still evolve, replayed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from swarmevo.analysis.measures import measures_of
from swarmevo.config import surroundings
from swarmevo.runs.following import FollowedStore
from swarmevo.runs.records import Lives
from swarmevo.views import text
from swarmevo.views.replay import data as replay_data
from swarmevo.views.replay import episode as replay_episode

MOST_BYTES: Final = 1_000_000
"""Of an episode's control steps, as in a report."""


def replayed(folder: Path, trial: int, generation: int, genome: int, repeat: int | None = None) -> dict[str, Any]:
    """Return one of an individual's episodes of a generation for the player, simulated once more.

    Of the run only that generation is read. Where the bits differ, the episode says so itself.

    Args:
        folder: Of the run.
        trial: From 0.
        generation: From 0.
        genome: The individual's id.
        repeat: From 0; None: the most successful one.

    Returns:
        What :func:`swarmevo.views.replay.data.data` returns; its ``repeat``; and for each repeat a line, ``repeats``.

    Raises:
        EvaluationError: It fails now.
        ReplayError: There is none, or it failed when it was run.
        StoreError: The run cannot be read, or the generation is not as it was stored.
    """
    with FollowedStore.open(folder) as store:
        store.arrival(trial, generation)
        chosen = replay_episode.chosen_of(store, genome, trial, generation, repeat)
        if chosen.fault:
            replay_episode.replay(store, chosen)  # says why there is nothing to show
        recording, warning = replay_episode.replay(store, chosen, force=True)
        repeats = list(_lines(store, store.lives(genome, trial, generation)))
    where = f"trial {trial}, generation {generation}, repeat {chosen.key.repeat}"
    shown = replay_data.data(recording, f"Individual {genome}", where, warning, MOST_BYTES)
    return {**shown, "repeat": chosen.key.repeat, "repeats": repeats}


def _lines(store: FollowedStore, lives: Lives) -> Iterator[str]:
    """Yield for each episode of a generation its number, its world where there are several, and how it ended."""
    measures, scene, episodes = measures_of(store.config, store.objectives), surroundings(store.config), lives.episodes
    worlds = len(store.config.worlds)
    for i, fault in enumerate(episodes.faults):
        told = [f"{episodes.repeat[i]}"]
        if worlds > 1:
            told.append(f"world {episodes['world'][i]}")
        if fault:
            told.append("failed")
        elif measures.push:
            time = float(episodes["push_time"][i])
            told.append("not pushed" if np.isnan(time) else f"{text.delivery(scene)} after {time:.1f} s")
        elif measures.homing:
            home = int(np.count_nonzero(~np.isnan(episodes["homing_time"][i])))
            told.append(f"{home} of {text.count(int(episodes['robots'][i]), 'robot')} home")
        yield ", ".join(told)

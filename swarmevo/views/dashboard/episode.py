# SPDX-License-Identifier: BSD-3-Clause
"""An individual of a run that may still evolve, replayed."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from swarmevo.runs.following import FollowedStore
from swarmevo.views.replay import data as replay_data
from swarmevo.views.replay import episode as replay_episode

MOST_BYTES: Final = 1_000_000
"""Of an episode's control steps, as in a report."""


def replayed(folder: Path, trial: int, generation: int, genome: int) -> dict[str, Any]:
    """Return an individual's most successful episode of a generation for the player, simulated once more.

    Of the run only that generation is read. Where the bits differ, the episode says so itself.

    Raises:
        EvaluationError: It fails now.
        ReplayError: There is none, or it failed when it was run.
        StoreError: The run cannot be read, or the generation is not as it was stored.
    """
    with FollowedStore.open(folder) as store:
        store.arrival(trial, generation)
        chosen = replay_episode.chosen_of(store, genome, trial, generation)
        if chosen.fault:
            replay_episode.replay(store, chosen)  # says why there is nothing to show
        recording, warning = replay_episode.replay(store, chosen, force=True)
    where = f"trial {trial}, generation {generation}, repeat {chosen.key.repeat}"
    return replay_data.data(recording, f"Individual {genome}", where, warning, MOST_BYTES)

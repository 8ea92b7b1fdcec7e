# SPDX-License-Identifier: BSD-3-Clause
"""How much of a trial is done, and whether it still searches."""

from __future__ import annotations

from swarmevo.config import Evolution


class Budget:
    """Of a trial: ``evolution.generations``, and ``evolution.episodes`` if that is reached sooner."""

    def __init__(self, evolution: Evolution) -> None:
        self._generations, self._episodes, self._refine = evolution.generations, evolution.episodes, evolution.refine

    def share(self, generations: int, episodes: int) -> float:
        """Return how much is spent with so many generations and episodes, from 0 to 1."""
        of_episodes = 0.0 if self._episodes is None else episodes / self._episodes
        return min(1.0, max(generations / self._generations, of_episodes))

    def is_spent(self, generations: int, episodes: int) -> bool:
        """Return whether the trial is over."""
        return self.share(generations, episodes) >= 1.0

    def is_for_refining(self, generations: int, episodes: int) -> bool:
        """Return whether the next generation evaluates again what is there (``evolution.refine``)."""
        return self._refine > 0 and self.share(generations, episodes) >= 1.0 - self._refine

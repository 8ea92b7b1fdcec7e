# SPDX-License-Identifier: BSD-3-Clause
"""The controller that comes with swarmevo: evolved by the packaged configuration ``best``, for the paper's world."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np

from swarmevo import config as configuration
from swarmevo.config import Config
from swarmevo.protocols import FloatArray
from swarmevo.runs.tests import GENERATION
from swarmevo.simulation import EpisodeKey

FILE = "best.json"
"""In the package's folder ``shipped``; as ``swarmevo export --controller`` writes it."""
TITLE = "the controller that comes with swarmevo"
SEED = 1
"""Of its episodes, if none is chosen."""


class Shipped(NamedTuple):
    """A controller and the configuration in which it acts."""

    config: Config
    """The paper's world, with this controller."""
    genes: FloatArray
    """``(size,)``"""


def best(seed: int = SEED) -> Shipped:
    """Return the shipped controller; ``seed``: of the configuration.

    Raises:
        ConfigError: The installation is damaged.
    """
    stored: dict[str, Any] = json.loads((files("swarmevo") / "shipped" / FILE).read_text(encoding="utf-8"))
    paper = configuration.load("paper", [f"evolution.seed={seed}"])
    return Shipped(paper.model_copy(update={"controller": stored["controller"]}), np.array(stored["genes"]))


def key(seed: int = SEED, repeat: int = 0) -> EpisodeKey:
    """Return the key of an episode to show, as those of tests."""
    return EpisodeKey(seed, 0, GENERATION, repeat)

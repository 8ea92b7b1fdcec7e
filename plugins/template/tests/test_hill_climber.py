# SPDX-License-Identifier: BSD-3-Clause
"""The conformance kit's tests, and the optimiser's own."""

from __future__ import annotations

import numpy as np
import pytest
from swarmevo_hill_climber import HillClimber

from swarmevo.protocols import Block, GenomeSpace
from swarmevo.testing import OptimiserTests

SPACE = GenomeSpace((Block("weights", (3,)),))


class TestHillClimber(OptimiserTests):
    """Inherits every test that an optimiser must pass."""

    def create(self, space, population, objectives, rng):
        return HillClimber(space, population, objectives, rng)


def test_climbs():
    optimiser = HillClimber(SPACE, 5, 1, np.random.default_rng(1))
    for _ in range(500):
        genomes = optimiser.ask()
        optimiser.tell(genomes, np.sum(genomes**2, axis=1, keepdims=True))
    assert np.all(optimiser.state()["costs"] < 0.05)


def test_rejects_a_spread_of_zero():
    with pytest.raises(ValueError, match="spread"):
        HillClimber(SPACE, 5, 1, np.random.default_rng(1), spread=0.0)

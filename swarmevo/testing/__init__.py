# SPDX-License-Identifier: BSD-3-Clause
"""A conformance kit for authors of plugins: what every optimiser, controller and fitness must do.

In a test file of the plugin, inherit the tests and say how the plugin is made; pytest finds the rest::

    from swarmevo.testing import OptimiserTests

    class TestHillClimber(OptimiserTests):
        def create(self, space, population, objectives, rng):
            return HillClimber(space, population, objectives, rng, spread=0.1)

Without pytest, ``failures(TestHillClimber())`` runs the tests and returns what went wrong.
"""

from __future__ import annotations

from swarmevo.testing.controllers import ControllerTests
from swarmevo.testing.data import (
    BOUNDED,
    CHROMOSOME,
    SPACES,
    random_genomes,
    random_telemetry,
    scene_in,
    scene_of,
)
from swarmevo.testing.fitness import FitnessTests, SwitchCounter
from swarmevo.testing.optimisers import OptimiserTests

__all__ = [
    "BOUNDED",
    "CHROMOSOME",
    "SPACES",
    "ControllerTests",
    "FitnessTests",
    "OptimiserTests",
    "SwitchCounter",
    "failures",
    "random_genomes",
    "random_telemetry",
    "scene_in",
    "scene_of",
]


def failures(tests: object) -> list[str]:
    """Run every ``test_`` method of ``tests`` and return one line for each that fails."""
    lines = []
    for name in sorted(name for name in dir(tests) if name.startswith("test_")):
        try:
            getattr(tests, name)()
        except Exception as error:
            lines.append(f"{name}: {error or type(error).__name__}")
    return lines

# SPDX-License-Identifier: BSD-3-Clause
"""The controller passes swarmevo's tests for controllers, and computes what it says."""

from __future__ import annotations

import numpy as np

from swarmevo.config import Config
from swarmevo.simulation import EpisodeKey, Scene, simulate
from swarmevo.testing import ControllerTests, random_genomes
from swarmevo_lowpass import LowPass


class TestLowPass(ControllerTests):
    def create(self):
        return LowPass()


def test_an_episode_is_driven_by_smoothed_readings():
    scene = Scene(Config.model_validate({"episode": {"horizon": 3.0}, "team": {"robots": 2}}))
    controller = LowPass()
    space = controller.space(scene.info)
    genomes = random_genomes(space, 2)
    keys = [EpisodeKey(1, 0, 0, repeat) for repeat in range(2)]
    seen = simulate(
        scene, controller.policies(genomes), keys, channels=["infrared", "touch", "rf", "command"]
    ).telemetry
    strongest = scene.info.world["emitter"]["strength"][1]
    observed = np.concatenate([seen.infrared, seen.touch, seen.rf[..., np.newaxis] / strongest], axis=-1)
    for genome, steps, commands in zip(genomes, observed, seen.command, strict=True):
        genes = space.split(genome)
        share, smooth = 1 / (1 + np.exp(-genes["speeds"])), np.zeros((2, 13))
        for reading, command in zip(steps, commands, strict=True):
            smooth = smooth + share * (reading - smooth)
            expected = np.tanh(smooth @ genes["weights"][:, :-1].T + genes["weights"][:, -1])
            np.testing.assert_allclose(command, expected, rtol=0, atol=1e-12)

# SPDX-License-Identifier: BSD-3-Clause
"""What a process for episodes does once is done before the time limit counts."""

from __future__ import annotations

import sys
from subprocess import run

import pytest

FIRST_EPISODE = """
import numpy as np
from cffi import FFI
from swarmevo import config
from swarmevo.evolution import jobs
from swarmevo.plugins.team import Team
from swarmevo.simulation import EpisodeKey

settings = config.load("quick", ["controller=NAME", "evolution.seed=1", "episode.horizon=1"])
jobs._warm_up(settings.model_dump_json())
parse, parsed = FFI._typeof_locked, []
FFI._typeof_locked = lambda ffi, name: parsed.append(name) or parse(ffi, name)
genomes = np.zeros((1, Team(settings).space.size))
jobs._run_here(settings.model_dump_json(), jobs.Job((0,), genomes, (EpisodeKey(1, 0, 0, 0),)))
print(len(parsed), *parsed)
"""


@pytest.mark.parametrize("controller", ["feedforward", "linear", "ctrnn", "elman"])
def test_the_first_episode_parses_no_type_of_the_library(controller: str) -> None:
    done = run(
        [sys.executable, "-c", FIRST_EPISODE.replace("NAME", controller)], capture_output=True, text=True, check=True
    )
    assert done.stdout == "0\n"

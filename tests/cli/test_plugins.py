# SPDX-License-Identifier: BSD-3-Clause
"""Listing and checking plugins."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

import swarmevo
from cli.conftest import Swarmevo


def test_plugins_lists_them(swarmevo_: Swarmevo) -> None:
    done = swarmevo_("plugins")
    assert done.code == 0
    assert re.search(rf"optimiser +pde +swarmevo {re.escape(swarmevo.__version__)} +swarmevo_paper\.pde:PDE", done.out)


def test_plugins_check(swarmevo_: Swarmevo, distribution: Callable[..., Path]) -> None:
    sound = swarmevo_("plugins", "check", "pde")
    assert sound.code == 0
    assert "crossover_rate: float = 0.7" in sound.out
    distribution("wrecks", "1", {"swarmevo.fitness": {"wreck": "wreck:Wreck"}}, wreck="import nowhere_to_be_found")
    assert swarmevo_("plugins").code == 0
    broken = swarmevo_("plugins", "check", "wreck")
    assert broken.code == 1
    assert "No module named 'nowhere_to_be_found'" in broken.out
    unknown = swarmevo_("plugins", "check", "wrek")
    assert (unknown.code, unknown.errors) == (2, ["wrek: no such plugin; did you mean wreck?"])


NORTHERN = """
class Northern:
    channels = ()
    objectives = ()

    def __init__(self, scene):
        {check}

    def evaluate(self, telemetry, genomes, controller):
        return []
"""


@pytest.mark.parametrize(
    ("check", "code", "said"),
    [
        (
            "raise ValueError('arena.shape: expected a circle')",
            0,
            "but not for the default world: arena.shape: expected a circle try it",
        ),
        ("raise TypeError('of another kind')", 1, "broken: fitness.northern: TypeError: of another kind"),
    ],
)
def test_a_fitness_that_is_for_other_worlds_is_sound(
    swarmevo_: Swarmevo, distribution: Callable[..., Path], check: str, code: int, said: str
) -> None:
    group = {"swarmevo.fitness": {"northern": "northern:Northern"}}
    distribution("north", "1", group, northern=NORTHERN.format(check=check))
    checked = swarmevo_("plugins", "check", "northern")
    assert checked.code == code
    assert said in " ".join(checked.out.split())
    assert ("  sound" in checked.out) == (not code)
    doctor = swarmevo_("doctor")
    (line,) = [line for line in doctor.out.splitlines() if "fitness northern" in line]
    assert line.startswith("FAIL" if code else "ok")

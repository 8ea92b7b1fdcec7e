# SPDX-License-Identifier: BSD-3-Clause
"""Listing and checking plugins."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

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

# SPDX-License-Identifier: BSD-3-Clause
"""Checking the installation."""

from __future__ import annotations

from itertools import pairwise

import pytest

from cli.conftest import Swarmevo
from conftest import Distribution
from swarmevo import plugins, simulation
from swarmevo.views import doctor


def test_doctor_finds_nothing(swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch) -> None:
    built = simulation.library_info()["build"]
    monkeypatch.setattr(doctor, "sources_hash", lambda checkout: built[-16:])  # somebody may be working on them
    done = swarmevo_("doctor")
    assert done.code == 0
    assert {line[:4] for line in done.out.splitlines()} == {"ok  "}
    assert "ODE" in done.out


def test_doctor_says_what_to_do(swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> None:
        raise simulation.SimulatorError("the assertion was not caught")

    monkeypatch.setattr(simulation, "selftest", fail)
    monkeypatch.setattr(plugins, "discover", list)
    done = swarmevo_("doctor")
    assert done.code == 1
    assert "FAIL  ODE: SimulatorError: the assertion was not caught" in done.out
    assert "FAIL  optimiser pde: not installed" in done.out
    assert "what to do: reinstall swarmevo" in done.out


def test_doctor_says_which_configurations_want_the_rivals(swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch) -> None:
    own = [entry for entry in plugins.discover() if entry.distribution != "swarmevo-rivals"]
    monkeypatch.setattr(plugins, "discover", lambda: own)
    done = swarmevo_("doctor")
    lines = done.out.splitlines()
    told = {line: advice for line, advice in pairwise(lines) if "  configuration " in line}
    lacking, install = "optimiser.cma of swarmevo-rivals is not installed", plugins.INSTALL_RIVALS
    assert done.code == 0
    assert told == {
        f"warn  configuration {name}: {lacking}": f"      what to do: {install}" for name in ("best", "robust")
    }


def test_a_plugin_that_wants_a_library_more_is_no_fault(swarmevo_: Swarmevo, distribution: Distribution) -> None:
    """As cma_mae where swarmevo-rivals was installed without pyribs."""
    source = """
        class Choosy:
            def __init__(self, space, population, objectives, rng):
                raise ImportError("choosy needs pychoosy: pip install 'choosers[more]'")
    """
    distribution("choosers", "1", {"swarmevo.optimisers": {"choosy": "choosy:Choosy"}}, choosy=source)
    done = swarmevo_("doctor")
    lines = done.out.splitlines()
    (line,) = [line for line in lines if "optimiser choosy" in line]
    assert done.code == 0
    assert line.startswith("warn  optimiser choosy: optimiser.choosy: ImportError: choosy needs pychoosy: pip install ")
    assert lines[lines.index(line) + 1] == "      what to do: if you want choosy, install what it needs"
    assert swarmevo_("plugins", "check", "choosy").code == 1

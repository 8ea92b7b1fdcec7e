# SPDX-License-Identifier: BSD-3-Clause
"""Checking the installation."""

from __future__ import annotations

import pytest

from cli.conftest import Swarmevo
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

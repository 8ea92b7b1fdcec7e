# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import hashlib
import json
import math
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import swarmevo
from swarmevo import plugins
from swarmevo.runs import provenance as module
from swarmevo.runs.provenance import provenance
from swarmevo.simulation import library


def test_provenance_names_what_a_result_may_depend_on() -> None:
    pde = plugins.find("optimiser", "pde")
    origin = provenance("seed: 1\n", [pde], {"build": "ODE 0.16"})
    assert origin["swarmevo"] == swarmevo.__version__
    assert origin["config_sha256"] == hashlib.sha256(b"seed: 1\n").hexdigest()
    assert origin["plugins"] == [f"optimiser.pde (swarmevo {swarmevo.__version__}, swarmevo_paper.pde:PDE)"]
    assert origin["plugin_files"] == {"optimiser.pde": pde.files}
    assert origin["library"] == {"build": "ODE 0.16", "sha256": None}
    assert (origin["python"], origin["numpy"]) == (sys.version, np.__version__)
    assert origin["cpu"]
    assert json.loads(json.dumps(origin)) == origin


def test_builds_of_one_version_are_told_apart(tmp_path: Path) -> None:
    (tmp_path / "lib.so").write_bytes(b"code")
    origin = provenance("", [], {"path": str(tmp_path / "lib.so")})
    assert origin["library"]["sha256"] == hashlib.sha256(b"code").hexdigest()
    assert provenance("", [], {"path": str(tmp_path / "gone.so")})["library"]["sha256"] is None


def test_no_other_repository_is_taken_for_ours(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / ".git").mkdir()
    installed = tmp_path / "venv" / "swarmevo" / "provenance.py"
    monkeypatch.setattr(module, "__file__", str(installed))
    assert provenance("", [], {})["git_revision"] is None


def test_a_checkout_that_git_cannot_describe_has_no_revision(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / ".git").mkdir()
    monkeypatch.setattr(module, "__file__", str(tmp_path / "swarmevo" / "provenance.py"))
    assert provenance("", [], {})["git_revision"] is None


def test_a_libm_is_told_from_one_that_rounds_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    """One bit of one value in a hundred is enough: glibc's versions differ about as often."""
    libm = library.libm.__wrapped__  # it is the same for all of a process
    usual = libm()
    assert re.fullmatch("[0-9a-f]{8}", usual)
    assert libm() == usual
    tanh = math.tanh
    monkeypatch.setattr(math, "tanh", lambda x: math.nextafter(tanh(x), 2) if round(250 * x) % 100 == 0 else tanh(x))
    assert libm() != usual

# SPDX-License-Identifier: BSD-3-Clause
"""Flipped bits in the files of runs: a short version of ``python -m benchmarks.bit_flips``."""

from __future__ import annotations

import random
import sys
from collections import Counter
from pathlib import Path

import pytest

# The benchmarks are not installed. At the end of the path: the installed swarmevo comes first.
sys.path.append(str(Path(__file__).parents[2]))

from benchmarks import bit_flips
from benchmarks.bit_flips import Flip, Trial
from swarmevo.runs.database import DATABASE_FILE
from swarmevo.runs.folder import CONFIG_FILE, PROVENANCE_FILE


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return bit_flips.finished_run(tmp_path_factory.mktemp("finished") / "run")


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return bit_flips.killed_run(tmp_path_factory.mktemp("killed") / "run")


@pytest.mark.parametrize("state", ["finished", "killed"])
def test_no_flipped_bit_changes_a_number_silently(state: str, request: pytest.FixtureRequest) -> None:
    """Cases 3, 4 and 54: each is harmless, refused in one line or named by ``verify``."""
    sound: Path = request.getfixturevalue(state)
    found = bit_flips.tally(Trial(sound, state == "finished"), sound, 30, random.Random(7))
    verdicts = Counter[str]()
    for (_, verdict), count in found.items():
        verdicts[verdict] += count
    assert not verdicts["silent"]
    assert verdicts["refused"] > 5
    assert verdicts["harmless"] > 1


def test_flips_are_told_apart(finished: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The check itself could fail: without our checksums a flip is silent."""
    trial = Trial(finished, is_finished=True)
    provenance = (finished / PROVENANCE_FILE).read_bytes().index(b"swarmevo")
    assert trial.flip(Flip(PROVENANCE_FILE, provenance, 0))[0] == "found"
    horizon = Flip(CONFIG_FILE, (finished / CONFIG_FILE).read_bytes().index(b"horizon: 1") + len("horizon: "), 1)
    assert trial.flip(horizon)[0] == "refused"
    provenance_in_database = (finished / DATABASE_FILE).read_bytes().index(b'"created"') + 1
    text = Flip(DATABASE_FILE, provenance_in_database, 0)
    assert trial.flip(text)[0] == "refused"
    monkeypatch.setattr("swarmevo.runs.integrity.damaged_rows", lambda *_: iter(()))
    assert trial.flip(text)[0] == "silent"

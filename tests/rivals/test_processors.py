# SPDX-License-Identifier: BSD-3-Clause
"""An evolution is the same to the bit whatever NumPy and its linear algebra compute with, as docs/install.md says."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

PROCESSORS = {
    "this": {},
    "of 2013, with three threads": {
        "OPENBLAS_CORETYPE": "Haswell",
        "NPY_DISABLE_CPU_FEATURES": "X86_V4,AVX512_ICL,AVX512F,AVX512_SKX",
        **dict.fromkeys(("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"), "3"),
    },
    "of 2008": {
        "OPENBLAS_CORETYPE": "Nehalem",
        "NPY_DISABLE_CPU_FEATURES": "X86_V3,X86_V4,AVX512_ICL,AVX2,FMA3,AVX512F,AVX512_SKX",
    },
}
"""What NumPy and OpenBLAS are told to compute with, as far as this one can do it; names of either version of NumPy."""

SAME = {
    "pde": "optimiser={pde: {mutation_rate: 0.1, mutation_spread: 0.5}}",
    "pde, own rates": "optimiser={pde: {rates: self}}",
    "cma": "optimiser={cma: {sigma: 2.0, weights: [1, 1, 0]}}",
    "cma, adaptive": "optimiser={cma: {learning_rate: adaptive, restarts: bipop}}",
    "map_elites": "optimiser=map_elites",
    "random": "optimiser=random",
}
"""Optimisers whose runs are the same everywhere."""

# Sensors, networks, physics and all of a shaped fitness as well.
PROGRAM = """
import hashlib, sqlite3, sys
from pathlib import Path
import small_runs

for name, optimiser in zip(sys.argv[2::2], sys.argv[3::2]):
    folder = small_runs.make(
        Path(sys.argv[1]) / name, optimiser, "fitness=[togetherness, nearness, progress, box_end]", "team.start=random",
        "controller={feedforward: {hidden: 3}}", "evolution.trials=1", "evolution.generations=8",
        "evolution.population=8", "episode.horizon=6",
    )
    bits = hashlib.sha256()
    with sqlite3.connect(folder / "run.sqlite") as run:
        for table in ("genome", "individual", "episode"):
            for row in run.execute(f"SELECT * FROM {table} ORDER BY 1, 2, 3"):
                bits.update(repr(row).encode())
    print(name, bits.hexdigest(), sep=": ")
"""


def bits_on(processor: str, folder: Path) -> dict[str, str]:
    """Return the hash of each optimiser's run."""
    folder.mkdir()
    path = os.pathsep.join([str(Path(__file__).parents[1]), *filter(None, sys.path)])
    runs = [word for name, setting in SAME.items() for word in (name, setting)]
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(folder), *runs],
        env={**os.environ, **PROCESSORS[processor], "PYTHONPATH": path},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return dict(line.split(": ") for line in done.stdout.splitlines())


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    return bits_on("this", tmp_path_factory.mktemp("runs") / "here")


@pytest.mark.parametrize("processor", list(PROCESSORS)[1:])
def test_an_evolution_is_the_same(processor: str, here: dict[str, str], tmp_path: Path) -> None:
    assert list(here) == list(SAME)
    assert len(set(here.values())) == len(SAME)
    assert bits_on(processor, tmp_path / "there") == here


def test_the_docs_name_them() -> None:
    page = (Path(__file__).parents[2] / "docs" / "install.md").read_text()
    (named,) = re.findall(r"on every evolution by ([^.(]+?)(?:\.|,\nwhich| \()", page)
    assert set(re.findall(r"`(\w+)`", named)) == {name.partition(",")[0] for name in SAME}

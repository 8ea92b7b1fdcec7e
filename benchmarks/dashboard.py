# SPDX-License-Identifier: BSD-3-Clause
"""How much the dashboard reads and computes for a large run: ``python -m benchmarks.dashboard [INDIVIDUALS]``.

A run of so many made-up individuals, 100,000 if nothing is said, with two objectives and three episodes each, is
followed as the dashboard does: once from the beginning, then for each of some generations that are added.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter
from typing import Final

import numpy as np

from swarmevo import config
from swarmevo.analysis import fronts
from swarmevo.config import Config
from swarmevo.evolution.results import COLUMNS, Generation, Results, Sizes
from swarmevo.protocols import FloatArray, Objective
from swarmevo.runs.store import Store
from swarmevo.views.dashboard.watch import Watch

OBJECTIVES: Final = (Objective("score", "maximise", (0.0, 1.0)), Objective("cost", "minimise", (0.0, 1.0)))
POPULATION, REPEATS, ADDED = 100, 3, 10


def generation(rng: np.random.Generator, elite: FloatArray | None) -> Generation:
    """Return made-up individuals: new ones, and ten of before that are evaluated again."""
    genomes = rng.random((POPULATION, 4))
    if elite is not None:
        genomes[:10] = elite
    quality = genomes[:, :2] / np.linalg.norm(genomes[:, :2], axis=1, keepdims=True) * genomes[:, 2:3]
    values = np.repeat(np.clip(quality, 0, 1), REPEATS, axis=0) * rng.uniform(0.9, 1.0, (POPULATION * REPEATS, 2))
    sizes, n = Sizes(len(OBJECTIVES), 1, 0), POPULATION * REPEATS
    cells = {c.name: np.zeros((n, len(c.cells(sizes))) if c.axis else n, dtype=c.dtype) for c in COLUMNS}
    cells |= {"objective": np.column_stack([values[:, 0], 1 - values[:, 1]]), "robots": np.ones(n, dtype=np.uint32)}
    individual, repeat = np.indices((POPULATION, REPEATS)).reshape(2, -1)
    return Generation(
        genomes, Results(individual=individual, repeat=repeat, values=cells, faults=("",) * n, seconds=1.0)
    )


def grow(store: Store, generations: int, seed: int) -> Iterator[None]:
    """Append generations, one each time that this is asked."""
    rng, elite = np.random.default_rng(seed), None
    for _ in range(generations):
        made = generation(rng, elite)
        elite = made.genomes[np.argsort(-made.episodes["objective"][::REPEATS, 0])[:10]]
        store.append(0, store.generations(0), made, "{}")
        yield


def main() -> None:
    """Print what each look takes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("individuals", type=int, nargs="?", default=100_000, metavar="INDIVIDUALS")
    planned = parser.parse_args().individuals // POPULATION
    evolution = {"generations": planned + ADDED, "population": POPULATION, "repeats": REPEATS, "trials": 1}
    settings = Config.model_validate({"team": {"robots": 1}, "evolution": evolution})
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "run"
        with Store.create(folder, config.dump(settings), {}, OBJECTIVES, 1, 1) as store:
            for _ in grow(store, planned, seed=1):
                pass
            follow(Path(place), store)


def follow(place: Path, store: Store) -> None:
    """Follow a run from the beginning, then as it grows."""
    watch = Watch(place)
    started = perf_counter()
    watch.look()
    (id,) = watch.ids
    print(f"first look: {perf_counter() - started:.2f} s")
    pieces, started, more = 0, perf_counter(), True
    while more:
        snapshot, more = watch.look([id])
        pieces += 1
    whole = perf_counter() - started
    print(f"all of {store.totals().individuals:,} individuals: {whole:.1f} s, in {pieces} pieces")
    print(f"the page is told {len(snapshot.details[id]) / 1000:.0f} kB")
    seconds = []
    for _ in grow(store, ADDED, seed=2):
        started = perf_counter()
        watch.look([id])
        seconds.append(perf_counter() - started)
    print(f"a generation more: {1000 * np.median(seconds):.0f} ms, {POPULATION * REPEATS} episodes read")
    started = perf_counter()
    watch.look([id])
    print(f"nothing new: {1000 * (perf_counter() - started):.1f} ms")
    started = perf_counter()
    fronts.summarise(store)
    print(f"for comparison, the whole run anew, as swarmevo show: {perf_counter() - started:.1f} s")


if __name__ == "__main__":
    main()

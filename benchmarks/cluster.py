# SPDX-License-Identifier: BSD-3-Clause
"""What a Dask cluster costs, against threads on the same cores: efficiency, overhead per task, sizes of messages.

    python benchmarks/cluster.py [--workers 2] [--rounds 5]

Starts a scheduler and workers of one thread on this machine. Prints what ``docs/cluster.md`` reports, as JSON. Where
other programs run too, the times that clocks show mean little; processor time, of all processes together, does.
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from distributed import Client

from swarmevo import config
from swarmevo.config import Config
from swarmevo.evolution import cluster
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.evolution.jobs import Job, run_job
from swarmevo.evolution.threads import Backend, ThreadBackend
from swarmevo.simulation import EpisodeKey
from swarmevo.testing import random_genomes

MakeBackend = Callable[[str, int], Backend]


@contextmanager
def started(workers: int) -> Iterator[tuple[str, list[int]]]:
    """Start a scheduler and workers; yield its address and their process ids, the scheduler's first."""
    dask = [sys.executable, "-m", "dask"]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scheduler.json"

        def start(*arguments: str) -> subprocess.Popen[bytes]:
            null = subprocess.DEVNULL
            return subprocess.Popen([*dask, *arguments], stdout=null, stderr=null, cwd=folder)

        options = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file)]
        processes = [start("scheduler", *options)]
        try:
            while not (file.exists() and file.read_text().rstrip().endswith("}")):  # written by now
                time.sleep(0.1)
            address = json.loads(file.read_text())["address"]
            worker = ["worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
            processes += [start(*worker) for _ in range(workers)]
            with Client(address, set_as_default=False) as client:
                client.wait_for_workers(workers, timeout=60)
            yield address, [process.pid for process in processes]
        finally:
            for process in processes:
                process.kill()
                process.wait()


@dataclass(frozen=True)
class Cost:
    """Of a generation: medians [s]."""

    clock: float
    processor: float
    """Of this process, the scheduler and the workers."""


class Comparison:
    """Generations on several backends in turns."""

    def __init__(self, workers: int, backends: dict[str, MakeBackend], processes: list[int]) -> None:
        self._workers, self._backends, self._processes = workers, backends, processes

    def run(self, settings: Config, population: int, rounds: int) -> dict[str, Cost]:
        """Return the cost of a generation on each backend."""
        evaluators = {name: Evaluator(settings, self._workers, backend) for name, backend in self._backends.items()}
        genomes = random_genomes(evaluators["local"].space, population)
        measured: dict[str, list[Cost]] = {name: [] for name in evaluators}
        for number in range(rounds + 1):  # the first warms up
            for name, evaluator in evaluators.items():
                before = self._processor_time()
                clock = evaluator.evaluate(genomes, 0, number).seconds
                measured[name].append(Cost(clock, self._processor_time() - before))
        for evaluator in evaluators.values():
            evaluator.close()
        return {name: _median(costs[1:]) for name, costs in measured.items()}

    def _processor_time(self) -> float:
        others = sum(_ticks(process) for process in self._processes) / os.sysconf("SC_CLK_TCK")
        return time.process_time() + others


def _median(costs: list[Cost]) -> Cost:
    return Cost(statistics.median(c.clock for c in costs), statistics.median(c.processor for c in costs))


def _ticks(process: int) -> int:
    user, system = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[11:13]
    return int(user) + int(system)


def messages(settings: Config, episodes: int) -> dict[str, int]:
    """Return the sizes in bytes of what a task of some episodes sends."""
    with Evaluator(settings, 1) as evaluator:
        genomes = random_genomes(evaluator.space, 1).repeat(episodes, axis=0)
    keys = tuple(EpisodeKey(1, 0, 0, repeat) for repeat in range(episodes))
    job, text = Job((0,) * episodes, genomes, keys), settings.model_dump_json()
    result = run_job(text, job)
    return {"configuration": len(text), "job": len(pickle.dumps(job)), "result": len(pickle.dumps(result))}


def resident(process: int) -> int:
    """Return the memory of a process [MB]."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") // 10**6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()

    long = config.load("paper", ["evolution.seed=1", "evolution.repeats=3"])
    short = config.load("paper", ["evolution.seed=1", "evolution.repeats=1", "episode.horizon=0.1"])
    with started(given.workers) as (address, processes):
        backends: dict[str, MakeBackend] = {
            "local": ThreadBackend,
            "cluster": cluster.backend(address, lambda line: None),
        }
        comparison = Comparison(given.workers, backends, processes)
        full = comparison.run(long, 30, given.rounds)
        before = resident(processes[0])
        tiny = comparison.run(short, 1000, given.rounds)
        with Client(address, set_as_default=False) as client:
            began = time.perf_counter()
            client.gather(client.map(np.negative, range(2000), pure=False))
            dask_alone = (time.perf_counter() - began) / 2000
        found = {
            "episodes": {"of": long.episode.horizon, "in a generation": 90},
            "seconds of a generation": {name: asdict(cost) for name, cost in full.items()},
            "efficiency, by clock": full["local"].clock / full["cluster"].clock,
            "efficiency, by processor time": full["local"].processor / full["cluster"].processor,
            "overhead per evaluation [ms]": 1000 * (full["cluster"].processor - full["local"].processor) / 90,
            "seconds of 1000 empty episodes": {name: asdict(cost) for name, cost in tiny.items()},
            "Dask alone per task [ms]": 1000 * dask_alone,
            "bytes of a task of 1": messages(long, 1),
            "bytes of a task of 16": messages(long, 16),
            "scheduler [MB]": {"before": before, "after": resident(processes[0])},
        }
    print(json.dumps(found, indent=2))


if __name__ == "__main__":
    main()

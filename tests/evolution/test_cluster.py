# SPDX-License-Identifier: BSD-3-Clause
"""A real scheduler and real workers on this machine: the same bits as without them, whatever dies."""

from __future__ import annotations

import json
import os
import re
import socket
import sqlite3
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swarmevo as se
from conftest import Distribution
from swarmevo import cli
from swarmevo import config as configuration
from swarmevo.cli import common
from swarmevo.config import Config
from swarmevo.errors import ClusterError, EvaluationError, Interrupted
from swarmevo.evolution import cluster
from swarmevo.evolution.cluster import DaskBackend
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.plugins.team import never
from swarmevo.runs.database import DATABASE_FILE
from swarmevo.runs.driver import begin, evolve
from swarmevo.runs.store import Store

pytest.importorskip("distributed")
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")

SETTINGS = [
    *("episode.horizon=10", "team.robots=2", "evolution.seed=3"),
    *("evolution.generations=3", "evolution.population=6", "evolution.trials=1", "evolution.repeats=3"),
]
OTHER_VERSION = "from swarmevo import _version\n_version.__version__ = '0.0.9'\n"


def settings(*more: str) -> Config:
    return configuration.changed(configuration.load("quick", SETTINGS), more)


class Cluster:
    """A scheduler and its workers, each a process that can be killed."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._file = folder / "scheduler.json"
        self._scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", self._file)
        while not (self._file.exists() and self._file.read_text().rstrip().endswith("}")):  # written by now
            assert self._scheduler.poll() is None
            os.sched_yield()
        self.address = str(json.loads(self._file.read_text())["address"])
        self.workers: list[subprocess.Popen[bytes]] = []

    def _start(self, *arguments: object) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", *map(str, arguments), "--no-dashboard"]
        log = (self._folder / "log").open("ab")
        with log:
            return subprocess.Popen(command, cwd=self._folder, stdout=log, stderr=log, start_new_session=True)

    def add(self, workers: int = 1, *options: object) -> None:
        for _ in range(workers):
            self.workers.append(self._start("worker", self.address, "--no-nanny", "--nthreads", "1", *options))

    def wait_for(self, workers: int) -> None:
        from distributed import Client

        with Client(self.address, set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=60)

    def kill_worker(self) -> None:
        worker = self.workers.pop()
        worker.kill()
        worker.wait()

    def kill_scheduler(self) -> None:
        self._scheduler.kill()
        self._scheduler.wait()

    def stop(self) -> None:
        while self.workers:
            self.kill_worker()
        self.kill_scheduler()


@pytest.fixture(scope="module")
def steady(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """A scheduler and two workers that nobody kills."""
    started = Cluster(tmp_path_factory.mktemp("steady"))
    started.add(2)
    started.wait_for(2)
    yield started
    started.stop()


@pytest.fixture
def mortal(tmp_path: Path) -> Iterator[Cluster]:
    """A scheduler without workers."""
    started = Cluster(tmp_path)
    yield started
    started.stop()


@pytest.fixture(scope="module")
def local(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """What the run stores without a cluster."""
    folder = tmp_path_factory.mktemp("local") / "run"
    begin(folder, settings())
    with Store.open(folder, readonly=False) as store:
        evolve(store, 1, lambda progress: None)
    return content(folder)


def content(folder: Path) -> dict[str, list[tuple[Any, ...]]]:
    """Return all that a run stored, but sessions and times."""
    with closing(sqlite3.connect(folder / DATABASE_FILE)) as database:
        tables = {table: database.execute(f"SELECT * FROM {table}").fetchall() for table in ("genome", "optimiser")}
        rows = database.execute("SELECT * FROM episode").fetchall()
        assert database.execute("SELECT COUNT(*) FROM in_flight").fetchone() == (0,)
    return {**tables, "episode": [(*row[:2], *row[3:]) for row in rows]}


def rows(folder: Path) -> int:
    """Return how many episodes are stored or kept."""
    with closing(sqlite3.connect(folder / DATABASE_FILE)) as database:
        return sum(len(database.execute(f"SELECT 1 FROM {table}").fetchall()) for table in ("episode", "in_flight"))


def go_on(folder: Path, address: str, stop: Callable[[], bool] = never) -> list[str]:
    """Go on with a run, or begin it, on a cluster; return what was said."""
    if not folder.exists():
        begin(folder, settings())
    said: list[str] = []
    with Store.open(folder, readonly=False) as store:
        evolve(store, 1, lambda progress: None, stop, cluster.backend(address, said.append))
    return said


class At:
    """Never stops, but does something when asked for the so-manieth time."""

    def __init__(self, times: int, action: Callable[[], None]) -> None:
        self._left, self._action = times, action

    def __call__(self) -> bool:
        self._left -= 1
        if self._left == 0:
            self._action()
        return False


# ---- the same bits ---------------------------------------------------------------------------------------------------


def test_a_cluster_gives_the_bits_of_one_machine(tmp_path: Path, steady: Cluster, local: Any) -> None:
    said = go_on(tmp_path / "run", steady.address)
    assert content(tmp_path / "run") == local
    assert said == [f"scheduler {steady.address}: 2 workers, 2 threads"]
    with Store.open(tmp_path / "run") as store:
        origin = store.session(int(store.sessions(0, 0)[0]))
        assert origin["worker_cpus"] == [origin["cpu"]]


def test_a_sweep_on_a_cluster_gives_the_bits_of_one_machine(tmp_path: Path, steady: Cluster, local: Any) -> None:
    chosen = dict(setting.split("=") for setting in SETTINGS if not setting.startswith(("evolution.seed", "team")))
    shared = {key: int(value) for key, value in chosen.items()}
    grid = {"team.robots": [2, 3]}
    found = se.sweep("quick", grid, seeds=[3], set=shared, out=tmp_path / "s", scheduler=steady.address, workers=2)
    assert [row.state for row in found.rows] == ["complete", "complete"]
    assert content(tmp_path / "s" / "robots=2" / "seed-3") == local


def test_jobs_are_as_many_as_threads_need(steady: Cluster) -> None:
    with closing(DaskBackend(settings().model_dump_json(), steady.address, lambda line: None)) as backend:
        assert backend.slots == 2


def test_a_run_on_a_cluster_stops_and_goes_on_anywhere(tmp_path: Path, steady: Cluster, local: Any) -> None:
    folder = tmp_path / "run"
    answers = iter([False] * 25 + [True])
    with pytest.raises(Interrupted):
        go_on(folder, steady.address, lambda: next(answers))
    assert rows(folder) > 0
    with Store.open(folder, readonly=False) as store:
        evolve(store, 1, lambda progress: None)
    assert content(folder) == local


def test_an_error_in_an_episode_is_that_of_one_machine(steady: Cluster) -> None:
    config = settings()
    with Evaluator(config, 1, cluster.backend(steady.address, lambda line: None)) as evaluator:
        genomes = np.full((2, evaluator.space.size), np.nan)
        with pytest.raises(EvaluationError, match="policies were refused: input_hidden: expected finite numbers"):
            evaluator.evaluate(genomes, 0, 0)


# ---- what dies -------------------------------------------------------------------------------------------------------


def test_a_worker_that_dies_costs_nothing(tmp_path: Path, mortal: Cluster, local: Any) -> None:
    mortal.add(2)
    mortal.wait_for(2)
    go_on(tmp_path / "run", mortal.address, At(5, mortal.kill_worker))
    assert content(tmp_path / "run") == local


def test_all_workers_may_die_and_others_come(
    tmp_path: Path, mortal: Cluster, local: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    mortal.add(2)
    mortal.wait_for(2)

    def replace() -> None:
        mortal.kill_worker()
        mortal.kill_worker()
        mortal.add(1)

    monkeypatch.setattr(cluster, "_COUNT_SECONDS", 0.0)
    said = go_on(tmp_path / "run", mortal.address, At(25, replace))
    assert content(tmp_path / "run") == local
    assert f"scheduler {mortal.address}: no worker; waiting for some" in said


def test_without_a_scheduler_the_run_ends_and_says_how_to_go_on(
    tmp_path: Path, mortal: Cluster, local: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    mortal.add(1)
    mortal.wait_for(1)
    monkeypatch.chdir(tmp_path)
    begin(tmp_path / "run", settings())
    asked = At(25, mortal.kill_scheduler)
    monkeypatch.setattr(common.StopOnSignal, "__call__", lambda self: asked())
    with pytest.raises(SystemExit) as exit:
        cli.main(["resume", "run", "--scheduler", mortal.address])
    assert exit.value.code == 1
    assert capsys.readouterr().err.splitlines()[-2:] == [
        f"go on with: swarmevo resume run --scheduler {mortal.address}",
        f"error: {mortal.address}: the scheduler is gone; start it again, then go on",
    ]
    assert rows(tmp_path / "run") > 0
    with Store.open(tmp_path / "run", readonly=False) as store:
        evolve(store, 1, lambda progress: None)
    assert content(tmp_path / "run") == local


# ---- what is refused -------------------------------------------------------------------------------------------------


def test_a_worker_of_another_version_is_refused(tmp_path: Path, mortal: Cluster) -> None:
    (tmp_path / "other.py").write_text(OTHER_VERSION)
    mortal.add(1, "--preload", "other.py")
    mortal.wait_for(1)
    with pytest.raises(
        ClusterError, match=r"worker tcp://\S+: has swarmevo 0\.0\.9 instead of .*; install the same"
    ) as error:
        go_on(tmp_path / "run", mortal.address)
    assert "\n" not in str(error.value)


KEEN = """
    from swarmevo.protocols import Objective

    class Keen:
        objectives = (Objective("keen", "maximise", (0.0, 100.0)),)
        channels = ()

        def evaluate(self, telemetry, genomes, controller):
            return abs(genomes[:, :1])
"""


def test_a_worker_that_has_a_plugin_from_before_its_change_is_refused(
    tmp_path: Path, mortal: Cluster, distribution: Distribution, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 52: the worker goes on with what it has imported."""
    site = distribution("keen", "1.0", {"swarmevo.fitness": {"keen": "keen_on_dask:Keen"}}, keen_on_dask=KEEN)
    monkeypatch.setenv("PYTHONPATH", str(site))
    mortal.add(1)
    mortal.wait_for(1)
    begin(tmp_path / "first", settings("fitness=keen"))
    go_on(tmp_path / "first", mortal.address)

    (site / "keen_on_dask.py").write_text(textwrap.dedent(KEEN).replace("abs", "3 * abs"))
    del sys.modules["keen_on_dask"]  # as in a new process
    begin(tmp_path / "second", settings("fitness=keen"))
    with pytest.raises(ClusterError) as error:
        go_on(tmp_path / "second", mortal.address)
    message = str(error.value)
    assert re.match(
        r"worker tcp://\S+: has fitness\.keen keen 1\.0 \(files \w{12}\) instead of keen 1\.0 \(files \w{12}\); "
        r"install the same there and start it again, or stop it$",
        message,
    )
    assert rows(tmp_path / "second") == 0


def test_a_scheduler_that_is_not_there_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 0.5)
    for address in ("tcp://127.0.0.1:9", "no address"):
        with pytest.raises(ClusterError, match="no Dask scheduler answers; start one with: dask scheduler"):
            DaskBackend(settings().model_dump_json(), address, lambda line: None)


def test_without_a_scheduler_no_folder_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 0.5)
    with pytest.raises(SystemExit) as exit:
        cli.main(["evolve", "quick", "--out", "run", "--scheduler", "tcp://127.0.0.1:9"])
    assert exit.value.code == 1
    message = "error: tcp://127.0.0.1:9: no Dask scheduler answers; start one with: dask scheduler"
    assert capsys.readouterr().err.splitlines() == [message]
    assert list(tmp_path.iterdir()) == []


def test_without_dask_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ClusterError, match=r"--scheduler needs Dask: pip install 'swarmevo\[dask\]'"):
        DaskBackend(settings().model_dump_json(), "tcp://127.0.0.1:9", lambda line: None)


def test_dask_is_imported_for_a_cluster_alone() -> None:
    code = (
        "import sys\nfrom swarmevo.evolution import cluster\nfrom swarmevo.evolution import loop\n"
        "print({'dask', 'distributed'} & set(sys.modules) or 'none')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "none\n"


def test_a_scheduler_behind_tls_needs_certificates() -> None:
    """Case 72."""
    with pytest.raises(ClusterError, match="expected certificates in Dask's configuration"):
        cluster.backend("tls://127.0.0.1:1", print)(settings().model_dump_json(), 1)


def test_another_servers_port_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 72: what takes connections but is no scheduler, such as the dashboard, was waited for without an end."""
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        with pytest.raises(ClusterError, match="no Dask scheduler answers"):
            cluster.backend(address, print)(settings().model_dump_json(), 1)

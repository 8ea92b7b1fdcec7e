# SPDX-License-Identifier: BSD-3-Clause
"""``--log mlflow``: what MLflow's own client reads back, whatever ended the run."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
import yaml

from cli.conftest import SMALL, Swarmevo
from cli.conftest import swarmevo_ as swarmevo_

mlflow = pytest.importorskip("mlflow")
pytest.importorskip("sqlalchemy")
pytestmark = pytest.mark.filterwarnings("ignore")  # MLflow of its own libraries


@pytest.fixture(autouse=True)
def no_server(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)


def client(uri: str = "") -> Any:
    return mlflow.MlflowClient(tracking_uri=uri or f"sqlite:///{Path('run/mlflow/mlflow.db').absolute()}")


def runs(uri: str = "") -> dict[str, Any]:
    """Return MLflow's runs by their names."""
    experiment = client(uri).get_experiment_by_name("swarmevo")
    return {run.info.run_name: run for run in client(uri).search_runs([experiment.experiment_id])}


def series(run: Any, name: str, uri: str = "") -> list[tuple[int, float]]:
    return [(one.step, one.value) for one in client(uri).get_metric_history(run.info.run_id, name)]


def test_each_generation_is_there_once_with_what_show_says(swarmevo_: Swarmevo) -> None:
    done = swarmevo_("evolve", "small.yaml", "--seed", 1, "--out", "run", "--log", "mlflow")
    assert done.code == 0, done.err
    assert not done.errors
    shown, found = json.loads(swarmevo_("show", "run", "--json").out), runs()
    assert set(found) == {f"run trial {trial['trial']}" for trial in shown["trials"]}
    for trial in shown["trials"]:
        run = found[f"run trial {trial['trial']}"]
        for name in ("box_pushing", "hidden_neurons"):
            expected = [(step["generation"], pytest.approx(step["best"][name])) for step in trial["history"]]
            assert series(run, f"best/{name}") == expected
        for name in ("front_size", "new_genomes", "episodes"):
            assert series(run, name) == [(step["generation"], step[name]) for step in trial["history"]]
        assert run.data.params["evolution.population"] == str(yaml.safe_load(SMALL)["evolution"]["population"])
        assert run.info.status == "FINISHED"


def test_after_kill_9_no_generation_is_twice_or_missing(tmp_path: Path, swarmevo_: Swarmevo) -> None:
    Path("small.yaml").write_text(SMALL)
    chosen = "--set", "evolution.generations=150", "--seed", "1", "--trials", "1"
    command = [sys.executable, "-m", "swarmevo", "evolve", "small.yaml", *chosen, "--out", "run"]
    killed = subprocess.Popen([*command, "--log", "mlflow"], cwd=tmp_path, stderr=subprocess.PIPE)
    while not Path("run/mlflow/trial-0").exists():
        assert killed.poll() is None
        time.sleep(0.05)
    killed.kill()
    killed.communicate()
    assert swarmevo_("resume", "run", "--log", "mlflow").code == 0
    (run,) = runs().values()
    assert [step for step, _ in series(run, "episodes")] == list(range(150))


def test_a_store_elsewhere_takes_several_runs(swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch) -> None:
    uri = f"sqlite:///{Path('everybody.db').absolute()}"
    monkeypatch.setenv("MLFLOW_TRACKING_URI", uri)
    for seed in (1, 2):
        chosen = "--seed", seed, "--trials", 1, "--out", f"seed-{seed}"
        assert swarmevo_("evolve", "small.yaml", *chosen, "--log", "mlflow").code == 0
    found = runs(uri)
    assert set(found) == {"seed-1 trial 0", "seed-2 trial 0"}
    assert found["seed-2 trial 0"].data.params["evolution.seed"] == "2"
    assert not Path("seed-1/mlflow/mlflow.db").exists()


def test_a_store_that_does_not_answer_is_a_warning(swarmevo_: Swarmevo, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MLFLOW_TRACKING_URI", "sqlite:////dev/null/at/all.db")
    done = swarmevo_("evolve", "small.yaml", "--seed", 1, "--trials", 1, "--out", "run", "--log", "mlflow")
    assert done.code == 0
    assert "mlflow" in done.err
    assert len(json.loads(swarmevo_("show", "run", "--json").out)["trials"][0]["history"]) == 2

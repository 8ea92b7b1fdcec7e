# SPDX-License-Identifier: BSD-3-Clause
"""Case 52: a plugin whose code is changed under a run, as happens with editable installs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

import toy_plugins
from conftest import Distribution
from swarmevo import config
from swarmevo.api import runs
from swarmevo.errors import PluginError, StoreError
from swarmevo.evolution import processes
from swarmevo.runs import driver
from swarmevo.runs.provenance import changed_files
from swarmevo.runs.store import Store

KEEN = """
    from keen.constants import WEIGHT
    from swarmevo.protocols import Objective

    class Keen:
        objectives = (Objective("keen", "maximise", (0.0, 100.0)),)
        channels = ()

        def evaluate(self, telemetry, genomes, controller):
            return WEIGHT * abs(genomes[:, :1])
"""
SETTINGS = [
    *("fitness=keen", "episode.horizon=1", "evolution.generations=2", "evolution.population=4"),
    *("evolution.trials=1", "evolution.repeats=1", "evolution.seed=1"),
]

Outcome = tuple[int, str, str]
Run = Callable[..., Outcome]


@pytest.fixture
def site(distribution: Distribution) -> Path:
    """Where the plugin lies: a package of two modules."""
    site = distribution("keen", "1.0", {"swarmevo.fitness": {"keen": "keen.fitness:Keen"}}, fitness=KEEN)
    (site / "keen").mkdir()
    (site / "fitness.py").rename(site / "keen" / "fitness.py")
    (site / "keen" / "__init__.py").write_text("")
    (site / "keen" / "constants.py").write_text("WEIGHT = 1.0\n")
    return site


@pytest.fixture
def swarmevo_(site: Path, tmp_path: Path) -> Run:
    """Run a command in a process of its own, which imports the plugin as it is then."""

    def run(*arguments: str) -> Outcome:
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(site), *filter(None, sys.path)])}
        command = [sys.executable, "-B", "-m", "swarmevo", *arguments]
        done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False)
        return done.returncode, done.stdout, done.stderr

    return run


def test_a_run_is_not_resumed_with_another_version_of_a_plugin(swarmevo_: Run, site: Path, tmp_path: Path) -> None:
    settings = [word for setting in SETTINGS for word in ("--set", setting)]
    assert swarmevo_("evolve", "--out", "run", *settings)[0] == 0
    (site / "keen" / "constants.py").write_text("WEIGHT = 3.0  # of another size\n")

    code, _, err = swarmevo_("resume", "run", "--generations", "+1")
    assert code == 1
    assert [line for line in err.splitlines() if line.startswith("error")] == [
        "error: run: a plugin was changed since the run's last session: keen/constants.py (fitness.keen); undo that, "
        "or have both in one run: --accept-changed-plugin"
    ]
    with Store.open(tmp_path / "run") as store:
        assert store.config.evolution.generations == store.generations(0) == 2

    code, out, _ = swarmevo_("verify", "run")
    assert code == 1
    assert "  session 1: keen/constants.py of fitness.keen was changed\n" in out

    warning = (
        "warning: run: a plugin was changed since the run's last session: keen/constants.py (fitness.keen); "
        "what is simulated now need not be what was evolved"
    )
    for simulating in (["test", "run", "--repeats", "1"], ["report", "run"], ["export", "run", "--controller", "1"]):
        code, _, err = swarmevo_(*simulating)
        assert code == 0
        assert err.splitlines().count(warning) == 1
    assert "warning" not in swarmevo_("show", "run")[2]

    code, _, err = swarmevo_("resume", "run", "--generations", "+1", "--accept-changed-plugin")
    assert code == 0, err
    assert swarmevo_("resume", "run", "--generations", "+1")[0] == 0  # the change is known by now
    code, out, _ = swarmevo_("verify", "run", "--json")
    found = json.loads(out)
    assert {difference["generation"] for difference in found["differences"]} == {0, 1}
    assert found["explanations"] == ["session 1: keen/constants.py of fitness.keen was changed"]


def test_the_interface_in_python_refuses_as_well(
    distribution: Distribution, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    toy_plugins.install(distribution)
    run = tmp_path / "run"
    runs.evolve(toy_plugins.config(), out=run)
    monkeypatch.setattr(driver, "plugin_files", lambda entries: {"optimiser.toy_search": {"toy_plugins.py": "other"}})
    for generations in (None, "+1"):
        with pytest.raises(StoreError, match=r"toy_plugins\.py \(optimiser\.toy_search\); undo that"):
            runs.resume(run, generations=generations)
    assert runs.open(run).config.evolution.generations == 3
    runs.resume(run, accept_changed_plugin=True)


def test_a_process_that_imports_a_changed_plugin_is_refused(site: Path, tmp_path: Path) -> None:
    """A process for episodes may start late in a run: the one before it hung, say."""
    settings = config.load("quick", [*SETTINGS, "evolution.episode_timeout=60"])

    def change(progress: Any) -> None:
        (site / "keen" / "constants.py").write_text("WEIGHT = 3.0  # of another size\n")
        processes.dismiss()

    with pytest.raises(PluginError) as error:
        runs.evolve(settings, out=tmp_path / "run", observe=change)
    message = str(error.value)
    assert "fitness.keen keen 1.0 (files " in message
    assert message.endswith(
        "a plugin was changed while the run went on; undo that, then resume, or go on with --accept-changed-plugin"
    )
    assert "\n" not in message
    with Store.open(tmp_path / "run") as store:
        assert store.generations(0) == 1


# ---- provenances -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("then", "now", "changed"),
    [
        ({"a": {"x": "1"}}, {"a": {"x": "1"}}, {}),
        ({"a": {"x": "1"}, "b": {"x": "1"}}, {"b": {"x": "2"}, "a": {"x": "2"}}, {"x": ["a", "b"]}),
        ({"a": {"x": "1", "y": "1"}}, {"a": {"x": "1", "z": "1"}}, {"y": ["a"], "z": ["a"]}),
        ({}, {"a": {"x": "1"}}, {}),
        ({"a": 3}, {"a": {"x": "1"}}, {}),
        ("damaged", {"a": {"x": "1"}}, {}),
        (None, {"a": {"x": "1"}}, {}),
    ],
)
def test_changed_files(then: Any, now: Mapping[str, Any], changed: Mapping[str, Any]) -> None:
    assert changed_files({"plugin_files": then}, {"plugin_files": now}) == changed
    assert list(changed_files({"plugin_files": then}, {"plugin_files": now})) == sorted(changed)

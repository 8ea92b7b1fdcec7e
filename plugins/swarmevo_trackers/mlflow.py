# SPDX-License-Identifier: BSD-3-Clause
"""A run in MLflow: a run of its own for each trial, in a database in the run's folder or on a server."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from swarmevo.protocols import TrackedRun

if TYPE_CHECKING:
    from mlflow import MlflowClient

EXPERIMENT: Final = "swarmevo"
MOST_PARAMETERS: Final = 100
"""That MLflow takes at once."""


class MLflow:
    """Logs into ``mlflow/mlflow.db`` in the run's folder, or where ``MLFLOW_TRACKING_URI`` says.

    ``mlflow/trial-N`` in the run's folder has the id that MLflow gave the trial. A generation is sent at once; a store
    that keeps it in parts is sent those again that it lacks.
    """

    def __init__(self, run: TrackedRun) -> None:
        os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")  # nobody asked to tell anyone of this run
        try:
            import mlflow
        except ImportError as error:
            raise ImportError("needs MLflow: pip install 'swarmevo[mlflow]'") from error
        for talker in ("mlflow", "alembic"):
            logging.getLogger(talker).setLevel(logging.WARNING)
        self._connect = mlflow.MlflowClient
        self._run, self._folder = run, Path(run.folder) / "mlflow"
        self._connected: MlflowClient | None = None
        self._begun: dict[int, str] = {}

    def logged(self, trial: int) -> int:
        """See :class:`swarmevo.protocols.Tracker`."""
        if not self._place(trial).exists():
            return 0
        id = self._place(trial).read_text().strip()
        names = self._client.get_run(id).data.metrics
        steps = [self._client.get_metric_history(id, name) for name in names]
        return min((max(one.step for one in history) + 1 for history in steps), default=0)

    def log(self, trial: int, generation: int, scalars: Mapping[str, float]) -> None:
        """See :class:`swarmevo.protocols.Tracker`."""
        from mlflow.entities import Metric

        if trial not in self._begun:
            self._begun[trial] = self._begin(trial)
        now = int(1000 * time.time())
        metrics = [Metric(name, float(value), now, generation) for name, value in scalars.items()]
        self._client.log_batch(self._begun[trial], metrics)

    def close(self) -> None:
        """See :class:`swarmevo.protocols.Tracker`."""
        for id in self._begun.values():
            self._client.set_terminated(id)

    @property
    def _client(self) -> MlflowClient:
        if self._connected is None:
            self._folder.mkdir(exist_ok=True)
            own = f"sqlite:///{self._folder.absolute() / 'mlflow.db'}"
            self._connected = self._connect(tracking_uri=os.environ.get("MLFLOW_TRACKING_URI") or own)
        return self._connected

    def _begin(self, trial: int) -> str:
        """Return the id of a trial's run, which goes on, or is made with the configuration as its parameters."""
        from mlflow.entities import Param

        if self._place(trial).exists():
            id = self._place(trial).read_text().strip()
            self._client.update_run(id, status="RUNNING")
            return id
        tags = {"swarmevo.folder": self._run.folder, "swarmevo.trial": str(trial)}
        name = f"{self._run.name} trial {trial}"
        id = str(self._client.create_run(self._experiment(), tags=tags, run_name=name).info.run_id)
        parameters = [Param(key, value) for key, value in _leaves(self._run.config)]
        for start in range(0, len(parameters), MOST_PARAMETERS):
            self._client.log_batch(id, params=parameters[start : start + MOST_PARAMETERS])
        self._place(trial).write_text(id)
        return id

    def _experiment(self) -> str:
        found = self._client.get_experiment_by_name(EXPERIMENT)
        if found is not None:
            return str(found.experiment_id)
        mine = None if os.environ.get("MLFLOW_TRACKING_URI") else (self._folder / "artifacts").absolute().as_uri()
        return str(self._client.create_experiment(EXPERIMENT, artifact_location=mine))

    def _place(self, trial: int) -> Path:
        return self._folder / f"trial-{trial}"


def _leaves(values: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, str]]:
    """Yield ``section.key`` and what stands there."""
    for key, value in values.items():
        if isinstance(value, Mapping) and value:
            yield from _leaves(value, f"{path}{key}.")
        else:
            yield f"{path}{key}", str(value)

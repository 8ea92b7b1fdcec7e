# SPDX-License-Identifier: BSD-3-Clause
"""A run for Weights & Biases: offline, in the run's folder, from where ``wandb sync`` takes it to a server."""

from __future__ import annotations

import json
import os
import secrets
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from swarmevo.protocols import TrackedRun

if TYPE_CHECKING:
    import wandb

PROJECT: Final = "swarmevo"


class WeightsAndBiases:
    """Writes ``wandb/offline-run-*`` in the run's folder, one for each session and trial; no network is used.

    ``wandb/trial-N`` has the id that all sessions of a trial share. W&B writes in blocks of 32 KiB, and what it had not
    written is lost with a process that is killed: what is logged is known from W&B's files themselves.
    """

    def __init__(self, run: TrackedRun) -> None:
        os.environ.setdefault("WANDB_ERROR_REPORTING", "false")  # nobody asked to tell anyone of this run
        try:
            import wandb
        except ImportError as error:
            raise ImportError("needs Weights & Biases: pip install 'swarmevo[wandb]'") from error
        self._init = wandb.init
        self._settings = wandb.Settings(silent=True, console="off", disable_git=True, save_code=False)
        self._settings.x_disable_stats = self._settings.x_disable_meta = True
        self._run, self._folder = run, Path(run.folder) / "wandb"
        self._begun: dict[int, wandb.Run] = {}

    def logged(self, trial: int) -> int:
        """See :class:`swarmevo.protocols.Tracker`."""
        if not self._place(trial).exists():
            return 0
        id = self._place(trial).read_text().strip()
        files = sorted(self._folder.glob(f"offline-run-*/run-{id}.wandb"))
        return max((step + 1 for file in files for step in _steps(file)), default=0)

    def log(self, trial: int, generation: int, scalars: Mapping[str, float]) -> None:
        """See :class:`swarmevo.protocols.Tracker`."""
        if trial not in self._begun:
            self._begun[trial] = self._begin(trial)
        self._begun[trial].log(dict(scalars), step=generation, commit=True)

    def close(self) -> None:
        """See :class:`swarmevo.protocols.Tracker`."""
        for run in self._begun.values():
            run.finish()

    def _begin(self, trial: int) -> wandb.Run:
        self._folder.mkdir(exist_ok=True)
        if not self._place(trial).exists():
            self._place(trial).write_text(secrets.token_hex(4))
        return self._init(
            project=PROJECT,
            id=self._place(trial).read_text().strip(),
            name=f"{self._run.name} trial {trial}",
            group=self._run.name,
            config=dict(self._run.config),
            dir=self._run.folder,
            mode="offline",
            reinit="create_new",
            settings=self._settings,
        )

    def _place(self, trial: int) -> Path:
        return self._folder / f"trial-{trial}"


def _steps(file: Path) -> Iterator[int]:
    """Yield the step of each row of a ``.wandb`` file."""
    from wandb.proto import wandb_internal_pb2

    for content in _records(file.read_bytes()):
        record: Any = wandb_internal_pb2.Record.FromString(content)
        for item in record.history.item:
            if list(item.nested_key) == ["_step"]:
                yield json.loads(item.value_json)


_BLOCK, _FILE_HEADER, _HEADER = 32768, 7, struct.Struct("<IHB")
_FULL, _FIRST, _MIDDLE, _LAST = 1, 2, 3, 4


def _records(content: bytes) -> Iterator[bytes]:
    """Yield the records of a log in LevelDB's format, as far as they were written; W&B has no reader for Python."""
    place, record = _FILE_HEADER, b""
    while place + _HEADER.size <= len(content):
        if (left := _BLOCK - place % _BLOCK) < _HEADER.size:
            place += left
            continue
        _, length, kind = _HEADER.unpack_from(content, place)
        place += _HEADER.size
        part = content[place : place + length]
        if len(part) < length or not _FULL <= kind <= _LAST:
            return
        place += length
        record = part if kind in (_FULL, _FIRST) else record + part
        if kind in (_FULL, _LAST):
            yield record

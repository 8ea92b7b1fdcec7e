# SPDX-License-Identifier: BSD-3-Clause
"""A run in TensorBoard: event files in its folder, a series for each trial."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swarmevo.protocols import TrackedRun

if TYPE_CHECKING:
    from tensorboard.summary.writer.event_file_writer import EventFileWriter


class TensorBoard:
    """Writes ``tensorboard/trial-N`` in the run's folder: ``tensorboard --logdir RUN`` shows it.

    A generation is one record, which is written as a whole or is not there: what a killed process has logged is known
    from the files themselves.
    """

    def __init__(self, run: TrackedRun) -> None:
        try:
            from tensorboard.summary.writer import event_file_writer
        except ImportError as error:
            raise ImportError("needs TensorBoard: pip install 'swarmevo[tensorboard]'") from error
        self._make = event_file_writer.EventFileWriter
        self._folder = Path(run.folder) / "tensorboard"
        self._writers: dict[int, EventFileWriter] = {}

    def logged(self, trial: int) -> int:
        """See :class:`swarmevo.protocols.Tracker`."""
        return max((event.step + 1 for event in self._events(trial) if event.HasField("summary")), default=0)

    def log(self, trial: int, generation: int, scalars: Mapping[str, float]) -> None:
        """See :class:`swarmevo.protocols.Tracker`."""
        from tensorboard.compat.proto.event_pb2 import Event

        if trial not in self._writers:
            self._writers[trial] = self._make(str(self._place(trial)))
        event = Event(wall_time=time.time(), step=generation)
        for name, value in scalars.items():
            event.summary.value.add(tag=name, simple_value=value)
        self._writers[trial].add_event(event)
        self._writers[trial].flush()

    def close(self) -> None:
        """See :class:`swarmevo.protocols.Tracker`."""
        for writer in self._writers.values():
            writer.close()

    def _place(self, trial: int) -> Path:
        return self._folder / f"trial-{trial}"

    def _events(self, trial: int) -> Iterator[Any]:
        """Yield what is in the files of a trial; what a killed process left half written is passed over."""
        from tensorboard.backend.event_processing.event_file_loader import EventFileLoader

        for file in sorted(self._place(trial).glob("events.out.tfevents.*")):
            yield from EventFileLoader(str(file)).Load()

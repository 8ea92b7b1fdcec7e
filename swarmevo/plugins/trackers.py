# SPDX-License-Identifier: BSD-3-Clause
"""Trackers: found, made and called. What one does wrong is told, and is its fault alone: the run goes on without it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

from swarmevo.errors import ConfigError, PluginError
from swarmevo.plugins import registry
from swarmevo.plugins.calls import blamed, message, one_line
from swarmevo.protocols import TrackedRun, Tracker

_NOWHERE = TrackedRun(name="run", folder="", seed=0, config={})


def check(names: Sequence[str]) -> None:
    """Refuse trackers that cannot be used; nothing is written.

    Raises:
        ConfigError: One is named twice.
        PluginError: One is not installed, or lacks the library that it needs.
    """
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(f"--log {name}: given twice; leave one out")
        made = CheckedTracker(name, _NOWHERE)
        made.close()


class CheckedTracker:
    """A tracker of a name, of a run.

    Raises:
        PluginError: It is not installed, cannot be made, or does something wrong.
    """

    def __init__(self, name: str, run: TrackedRun) -> None:
        self.name = name
        entry = registry.find("tracker", name)
        self._called = f"{entry.kind}.{entry.name} ({entry.origin})"
        factory = registry.load(entry)

        def refused(error: BaseException) -> PluginError:
            return PluginError(f"--log {name}: {message(error) if isinstance(error, ImportError) else one_line(error)}")

        with blamed(refused, f"{entry}: factory"):
            made = factory(run)
            sound = isinstance(made, Tracker)
        if not sound:
            raise PluginError(f"{entry}: expected the methods logged, log and close, got {type(made).__name__}")
        self._tracker: Tracker = made

    def logged(self, trial: int) -> int:
        """See :class:`Tracker`."""
        with self._blamed("logged"):
            found = self._tracker.logged(trial)
        if isinstance(found, bool) or not isinstance(found, int) or found < 0:
            raise PluginError(f"{self._called}: logged: expected a number of generations, got {found!r}")
        return found

    def log(self, trial: int, generation: int, scalars: Mapping[str, float]) -> None:
        """See :class:`Tracker`."""
        with self._blamed("log"):
            self._tracker.log(trial, generation, scalars)

    def close(self) -> None:
        """See :class:`Tracker`."""
        with self._blamed("close"):
            self._tracker.close()

    @contextmanager
    def _blamed(self, method: str) -> Iterator[None]:
        def explain(error: BaseException) -> PluginError:
            return PluginError(f"{self._called}: {method}: raised {one_line(error)}")

        with blamed(explain, f"{self._called}: {method}"):
            yield

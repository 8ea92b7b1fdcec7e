# SPDX-License-Identifier: BSD-3-Clause
"""Sweeps, begun and continued."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from swarmevo import config as configuration
from swarmevo.errors import ConfigError
from swarmevo.plugins.team import never
from swarmevo.sweeps import extension, planning, runner
from swarmevo.sweeps import folder as folders
from swarmevo.sweeps import grid as grids
from swarmevo.sweeps.folder import Sweep
from swarmevo.sweeps.outcome import Findings
from swarmevo.sweeps.runner import Progress


def sweep(
    config: str | os.PathLike[str] | None,
    grid: Mapping[str, Sequence[Any]],
    *,
    seeds: Sequence[int] = range(1, 6),
    out: str | os.PathLike[str] | None = None,
    set: Mapping[str, Any] | None = None,
    workers: int = 0,
    scheduler: str | None = None,
    log: Sequence[str] = (),
    observe: Callable[[Progress], None] = lambda now: None,
    stop: Callable[[], bool] = never,
) -> Findings:
    """Evolve with each setting of a grid and each seed: the runs, and their bits, of ``swarmevo sweep``.

    Args:
        config: A YAML file, or the name of a packaged configuration; None is ``quick``.
        grid: ``{"section.key": values}``; of several keys, all combinations.
        seeds: Of the runs with each setting.
        out: The sweep's folder. If it is that of this sweep, perhaps with fewer values or seeds, go on with it and
            leave what is complete; it must not be anything else. None: a new one in ``runs``.
        set: ``{"section.key": value}``, of all settings.
        workers: Episodes to run at once; with a scheduler, runs at once. 0 is one for each processor. The results do
            not depend on it.
        scheduler: Address of a Dask cluster to run the episodes on.
        log: Names of trackers, such as ``tensorboard``, which each run has.
        observe: Told when a run has ended, and every tenth of a second.
        stop: Asked now and then; when true, the sweep ends with :class:`swarmevo.errors.Interrupted` and can be gone
            on with.

    Returns:
        What was found in each setting. A run that failed does not keep others from theirs, and its setting says why.

    Raises:
        ConfigError: A setting cannot be used, or the folder is something else's; nothing is written.
        ClusterError: The cluster cannot be used, or is gone.
        StoreError: The folder cannot be written, or somebody else runs the sweep.
    """
    if workers < 0:
        raise ConfigError(f"workers: expected a number of at least 0, got {workers}")
    numbers = grids.checked_seeds(list(seeds))
    source = os.fspath(config) if config else None
    overrides = configuration.as_overrides(set or {})
    settings = planning.settings(source, overrides, grids.of_values(grid), numbers)
    place = Path(out) if out is not None else None
    there = folders.begun(place)
    settings, numbers = extension.extended(there, settings, numbers)
    settings = planning.rehearsed(settings, numbers[0], stop, there.settings if there else [])
    whole = Sweep(place or folders.fresh(Path(source or "quick").stem), settings, numbers)
    whole.create(there)
    return runner.run(whole, workers, observe, stop, scheduler, log)

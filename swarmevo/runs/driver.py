# SPDX-License-Identifier: BSD-3-Clause
"""Beginning, continuing and extending runs: evolution with a run folder as its journal."""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Callable, Iterable, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any, Final

from swarmevo import config as configuration
from swarmevo import plugins
from swarmevo.config import Config
from swarmevo.errors import ConfigError, ExportError, FolderExistsError, Interrupted, StoreError
from swarmevo.evolution import loop
from swarmevo.evolution.budget import Budget
from swarmevo.evolution.evaluation import Evaluator
from swarmevo.evolution.loop import Progress
from swarmevo.evolution.optimiser import CheckedOptimiser
from swarmevo.evolution.threads import MakeBackend, ThreadBackend
from swarmevo.plugins import PluginEntry
from swarmevo.plugins.team import never
from swarmevo.protocols import FloatArray
from swarmevo.runs import export, genomes
from swarmevo.runs.provenance import changed_files, plugin_files, provenance
from swarmevo.runs.store import Store

_SHOWN_FILES: Final = 3
"""Of a plugin that was changed."""


def begin(
    folder: str | os.PathLike[str] | None, config: Config, stop: Callable[[], bool] = never, name: str = "run"
) -> Path:
    """Make the folder of a new run, ready for :func:`evolve`, and return it.

    Args:
        folder: Must not exist; None: a new one in ``runs``, of the name, the date and the seed.
        config: With a seed (``config.seeded``).
        stop: Asked during the rehearsal.
        name: Of the configuration.

    Raises:
        ConfigError, EvaluationError, PluginError, SimulatorError: The configuration cannot be run; no folder is made.
        Interrupted: ``stop`` said so; no folder is made.
        StoreError: The folder exists or cannot be made.
    """
    loop.rehearse(config, stop)
    if stop():
        raise Interrupted
    with Evaluator(config, workers=1) as evaluator:
        check_names(evaluator)
        config, start = resolved_start(config, evaluator)
        text, origin = configuration.dump(config), origin_of(config, evaluator)
        for chosen in _default_folders(name, config) if folder is None else [Path(folder)]:
            try:
                Store.create(
                    chosen,
                    text,
                    origin,
                    evaluator.objectives,
                    evaluator.robots,
                    evaluator.seed,
                    start,
                    evaluator.descriptors,
                ).close()
            except FolderExistsError:
                if folder is not None:
                    raise
            else:
                break
    return chosen


def resolved_start(config: Config, evaluator: Evaluator) -> tuple[Config, FloatArray | None]:
    """Read the genomes that a new run begins from, and make its optimiser once, which refuses what it cannot take.

    Returns:
        The configuration with their SHA-256, and the genomes ``(k, size)``; None: the optimiser begins on its own.

    Raises:
        ConfigError: They cannot be read, or are not those that ``evolution.start_sha256`` names.
        PluginError: The optimiser cannot be made, or cannot begin from them.
    """
    optimiser, evolution = CheckedOptimiser(config, evaluator, trial=0), config.evolution
    if evolution.start is None:
        if evolution.start_sha256 is not None:
            raise ConfigError("evolution.start_sha256: expected evolution.start as well, which tells where they are")
        return config, None
    start = genomes.read_genomes(evolution.start, config, evaluator.space)
    digest = genomes.digest_of(start)
    if evolution.start_sha256 not in (None, digest):
        raise ConfigError(
            f"evolution.start: expected genomes with the SHA-256 {evolution.start_sha256}, got {evolution.start} with "
            f"{digest}; put those back, or begin another run from these: evolution.start_sha256=null"
        )
    optimiser.start_from(start)
    return config.model_copy(update={"evolution": evolution.model_copy(update={"start_sha256": digest})}), start


def _default_folders(name: str, config: Config) -> Iterable[Path]:
    """Return the folders that a run may be made in which got none: the first, unless another run has just taken it."""
    first = f"{name}-{datetime.now():%Y%m%d-%H%M%S}-{config.evolution.seed}"
    return (Path("runs") / (f"{first}-{i}" if i > 1 else first) for i in itertools.count(1))


def evolve(
    store: Store,
    workers: int,
    observe: Callable[[Progress], None],
    stop: Callable[[], bool] = never,
    backend: MakeBackend = ThreadBackend,
    accept_changed_plugin: bool = False,
) -> None:
    """Run every trial of a run from its last stored generation to the end.

    Args:
        store: Open for writing.
        workers: Episodes to run at once; 0 is one for each processor. The results do not depend on it.
        observe: Told after each generation.
        stop: Asked between jobs; when true, the jobs in work are dropped; the run can be continued.
        backend: Where episodes run. The results do not depend on it.
        accept_changed_plugin: Go on though a plugin is not what it was: results of both are then in one run.

    Raises:
        EvaluationError, PluginError, SimulatorError: Something failed; the generations stored before are kept.
        Interrupted: ``stop`` said so.
        StoreError: The folder cannot be written, or its plugins were changed or now measure something else.
    """
    with Evaluator(store.config, workers, backend) as evaluator:
        check_objectives(store, evaluator)
        if not accept_changed_plugin:
            check_plugin_files(store)
        store.begin_session(origin_of(store.config, evaluator))
        loop.evolve(store, store.config, evaluator, observe, stop)


def extend(store: Store, generations: str, accept_changed_plugin: bool = False) -> int:
    """Change how many generations a run shall have; return the new number.

    Args:
        store: Open for writing.
        generations: In each trial: ``N``, or ``+N`` for so many more than now.
        accept_changed_plugin: As for :func:`evolve`, which would refuse to go on.

    Raises:
        ConfigError: It is no such number, too large, or fewer than a trial already has.
        StoreError: The folder cannot be written, or a plugin was changed.
    """
    if not accept_changed_plugin:
        check_plugin_files(store)
    if not re.fullmatch(r"\+?[0-9]{1,9}", generations):
        raise ConfigError(f"generations: expected a whole number, or +N for so many more, got {generations!r}")
    now = store.config
    wanted = int(generations) + (now.evolution.generations if generations.startswith("+") else 0)
    stored = max((store.generations(trial) for trial in store.trials()), default=0)
    if wanted < stored:
        raise ConfigError(f"generations: expected at least the {stored} that are stored, got {wanted}")
    extended = configuration.changed(store.config, [f"evolution.generations={wanted}"])
    if extended != now:
        store.replace_config(configuration.dump(extended))
    return wanted


def how_it_was_left(store: Store) -> str:
    """Return that the process which wrote a run last did not close it, and where it was; "": it did, or still writes.

    Nothing else tells what ends a process at once.
    """
    if not store.left_by:
        return ""
    budget, kept = (
        Budget(store.config.evolution),
        {t: store.generations(t) for t in range(store.config.evolution.trials)},
    )
    unfinished = (trial for trial, n in kept.items() if not budget.is_spent(n, store.episodes_stored(trial)))
    place = next((f"in trial {trial}, generation {kept[trial]}" for trial in unfinished), "at its end")
    return (
        f"{store.left_by}, which wrote the run last, ended without a word {place}: it was killed, its machine stopped, "
        "the run was moved, or a plugin ended it (os._exit)"
    )


def origin_of(config: Config, evaluator: Evaluator) -> dict[str, Any]:
    """Return the provenance of what is evaluated here and now."""
    return {**provenance(configuration.dump(config), _entries(config), evaluator.library), **evaluator.machines}


def _entries(config: Config) -> list[PluginEntry]:
    chosen = {"controller": config.controller, "fitness": config.fitness, "optimiser": config.optimiser}
    return [plugins.find(kind, name) for kind, names in chosen.items() for name in names]


def check_plugin_files(store: Store) -> None:
    """Refuse plugins whose files are not those that the run went on with so far.

    Raises:
        PluginError: A plugin is not installed.
        StoreError: They are not.
    """
    if changed := _changed(store, _entries(store.config)):
        raise StoreError(f"{changed}; undo that, or have both in one run: --accept-changed-plugin")


def changed_plugins(store: Store) -> str:
    """Return that controller or fitness are not what a run went on with so far, and their files; "": they are."""
    entries = [entry for entry in _entries(store.config) if entry.kind != "optimiser"]
    changed = _changed(store, entries)
    return changed and f"{changed}; what is simulated now need not be what was evolved"


def _changed(store: Store, entries: Sequence[PluginEntry]) -> str:
    changed = changed_files(store.provenance, {"plugin_files": plugin_files(entries)})
    if not changed:
        return ""
    shown = [f"{file} ({', '.join(names)})" for file, names in changed.items()]
    more = f" and {len(shown) - _SHOWN_FILES} more" if len(shown) > _SHOWN_FILES else ""
    return f"{store.folder}: a plugin was changed since the run's last session: {', '.join(shown[:_SHOWN_FILES])}{more}"


def check_names(evaluator: Evaluator) -> None:
    """Refuse objectives and descriptors whose names are not theirs alone in the exports.

    Raises:
        ConfigError: There is one.
    """
    try:
        export.check_names([*evaluator.objectives, *evaluator.descriptors], evaluator.robots)
    except ExportError as error:
        raise ConfigError(*error.errors) from error


def check_objectives(store: Store, evaluator: Evaluator) -> None:
    """Refuse plugins that measure something else than those that the run began with.

    Raises:
        StoreError: They do.
    """
    for what in ("objectives", "descriptors"):
        if (now := tuple(getattr(evaluator, what))) != (then := getattr(store, what)):
            raise StoreError(
                f"{store.folder}: expected the {what} {then}, the plugins now have {now}; "
                "install the versions of the plugins that the run began with"
            )

# SPDX-License-Identifier: BSD-3-Clause
"""Going on with a sweep, perhaps with more seeds or more values of the grid: what is there stays as it is."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from swarmevo.config import Config
from swarmevo.errors import ConfigError
from swarmevo.sweeps.folder import Sweep
from swarmevo.sweeps.grid import Names, Setting


def extended(there: Sweep | None, settings: Sequence[Setting], seeds: Sequence[int]) -> tuple[list[Setting], list[int]]:
    """Return the settings and the seeds of a sweep, those that are there already as they are there.

    Args:
        there: What was begun; None: nothing was.
        settings: All that are wanted, as :func:`swarmevo.sweeps.planning.settings` returns them.
        seeds: All that are wanted.

    Raises:
        ConfigError: Something that is there is not wanted, or differs.
    """
    if there is None:
        return list(settings), list(seeds)
    _require_all_of(there, settings, seeds)
    known = {tuple(one.values.values()): one for one in there.settings}
    names = Names(one.name for one in there.settings)
    starts = {one.config.evolution.start: one.config.evolution.start_sha256 for one in there.settings}
    merged = [
        known.get(tuple(one.values.values())) or _with_start(dataclasses.replace(one, name=names.of(one.name)), starts)
        for one in settings
    ]
    grid = there.grid
    for key, labels in grid.items():
        labels += [label for label in dict.fromkeys(one.values[key] for one in settings) if label not in labels]
    merged.sort(key=lambda one: [grid[key].index(label) for key, label in one.values.items()])
    return merged, [*there.seeds, *(seed for seed in seeds if seed not in there.seeds)]


def _require_all_of(there: Sweep, settings: Sequence[Setting], seeds: Sequence[int]) -> None:
    """Refuse what would leave out or change a run that is there."""
    wanted = Sweep(there.folder, settings, seeds)
    given = {tuple(one.values.values()): one for one in settings}
    found = ""
    if wanted.keys != there.keys or not all(tuple(one.values.values()) in given for one in there.settings):
        found = f"another grid: {_shown(there.grid)}, not {_shown(wanted.grid)}"
    elif not set(there.seeds) <= set(seeds):
        found = f"other seeds: {_shown(there.seeds)}, not {_shown(wanted.seeds)}"
    else:
        differences = (_difference(given[tuple(one.values.values())].config, one.config) for one in there.settings)
        if key := next(filter(None, differences), ""):
            found = f"another configuration, which differs in {key}"
    if found:
        raise ConfigError(
            f"{there.folder}: exists already, with {found}; give all that it has, and what is to be added, "
            "or choose another name"
        )


def _with_start(new: Setting, starts: dict[str | None, str | None]) -> Setting:
    """Return a setting that begins from the genomes with which the others with the same file have begun."""
    evolution = new.config.evolution
    digest = evolution.start_sha256 or starts.get(evolution.start)
    changed = new.config.model_copy(update={"evolution": evolution.model_copy(update={"start_sha256": digest})})
    return dataclasses.replace(new, config=changed)


def _shown(value: dict[str, list[str]] | list[int]) -> str:
    if isinstance(value, dict):
        return " ".join(f"{key}={','.join(labels)}" for key, labels in value.items()) or "none"
    return ",".join(map(str, value))


def _difference(one: Config, other: Config) -> str:
    """Return a key in which two configurations differ; "": they are the same, as far as was known at the beginning."""
    here, there = one.model_dump(mode="json"), other.model_dump(mode="json")
    if here["evolution"]["start_sha256"] is None:  # found when a sweep begins
        there["evolution"]["start_sha256"] = None
    for section, value in here.items():
        if value != there[section]:
            keys = [key for key in value if value[key] != there[section].get(key)] if isinstance(value, dict) else []
            return ".".join([section, *keys[:1]])
    return ""

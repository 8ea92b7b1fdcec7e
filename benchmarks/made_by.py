# SPDX-License-Identifier: BSD-3-Clause
"""The commands that made what a page shows."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from examples.baselines import BASELINES
from swarmevo.config import Config
from swarmevo.errors import ConfigError
from swarmevo.plugins.team import load_config

CONFIGS: Final = ("best", "robust", "shaped", "quick", *BASELINES)
"""That come with swarmevo."""
OPTIONS: Final = {"optimiser": "--plugin", "evolution.seed": "--seed", "evolution.trials": "--trials"}
"""Of ``swarmevo evolve``, for keys that have one."""


def evolution(settings: Config, run: Path) -> tuple[str, str]:
    """Return the name of the configuration that a run is nearest to, and the command that evolves it once more."""
    found = {name: _changes(load_config(name), settings) for name in CONFIGS}
    name = min(found, key=lambda one: len(found[one]))
    values = {key: value if isinstance(value, str) else json.dumps(value) for key, value in found[name].items()}
    words = [word for key, option in OPTIONS.items() if key in values for word in (option, values[key])]
    words += [word for key in values if key not in OPTIONS for word in ("--set", f"{key}={values[key]}")]
    source = name if _makes(name, values, settings) else f"{page_path(run)}/config.yaml"
    return name, shlex.join(["swarmevo", "evolve", source, *(words if source == name else ()), "--out", page_path(run)])


def this_command(module: str, *runs: Path) -> str:
    """Return the command line of this process, with the runs where a page has them."""
    words = shlex.join(["python", "-m", module, *sys.argv[1:]])
    for run in runs:
        words = words.replace(str(run), page_path(run))
    return words


def page_path(run: Path) -> str:
    """Return where a run is, as a page tells it: wherever it lies on this machine."""
    return f"runs/{run.name}"


def _changes(base: Config, settings: Config) -> dict[str, Any]:
    """Return each key that ``settings`` have other than ``base``, with its value."""
    known = _keys(base)
    found = {key: value for key, value in _keys(settings).items() if key not in known or known[key] != value}
    if settings.fitness.keys() > base.fitness.keys():  # one more: a list of names would drop the options of the others
        del found["fitness"]
    return found


def _keys(settings: Config) -> dict[str, Any]:
    """Return ``section.key``, ``section.plugin.option``, and lists as they are."""
    found: dict[str, Any] = {}
    for section, values in settings.model_dump().items():
        if section in ("worlds", "vary"):
            found[section] = values
        elif section in ("controller", "fitness", "optimiser"):
            found[section] = next(iter(values)) if len(values) == 1 else list(values)
            for plugin, options in values.items():
                found |= {f"{section}.{plugin}": {}} if section == "fitness" and not options else {}
                found |= {f"{section}.{plugin}.{option}": value for option, value in options.items()}
        else:
            found |= {f"{section}.{key}": value for key, value in values.items()}
    return found


def _makes(name: str, values: Mapping[str, str], settings: Config) -> bool:
    """Return whether a configuration with these overrides is the run's."""
    try:
        return load_config(name, [f"{key}={value}" for key, value in values.items()]) == settings
    except ConfigError:  # --set cannot take an option away
        return False

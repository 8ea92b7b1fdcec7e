# SPDX-License-Identifier: BSD-3-Clause
"""Finding, checking and making plugins.

Plugins are entry points of installed distributions. Finding them imports none of them: a broken one does no harm until
it is chosen.
"""

from __future__ import annotations

import inspect
import os
import sys
from collections import Counter
from collections.abc import Mapping, Sequence, Set
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from importlib import metadata
from typing import Any

import numpy as np

from swarmevo import returned
from swarmevo.config import Config, Team, did_you_mean, scene_info
from swarmevo.config.yaml import plain
from swarmevo.errors import PluginError
from swarmevo.plugins import sources
from swarmevo.plugins.calls import blamed, message, one_line
from swarmevo.plugins.options import Factory, Option, of_name, settled, taken_of
from swarmevo.plugins.options import options as options_of
from swarmevo.protocols import (
    Block,
    Controller,
    Descriptor,
    Fitness,
    GenomeSpace,
    NativeController,
    Objective,
    Optimiser,
    Problem,
    PythonController,
)

GROUPS = {
    "controller": "swarmevo.controllers",
    "fitness": "swarmevo.fitness",
    "optimiser": "swarmevo.optimisers",
}
"""Entry-point group of each kind of plugin that a configuration names."""
_ALL_GROUPS = {**GROUPS, "tracker": "swarmevo.trackers"}
"""Of those that decide nothing, too."""

RIVALS = frozenset(
    {"cma", "cma_mae", "como_cma", "gde3", "map_elites", "moead", "nsga2", "nsga3", "random", "sms_emoa", "spea2"}
)
"""The optimisers of swarmevo-rivals, which may not be installed."""
INSTALL_RIVALS = "pip install swarmevo_rivals-*.whl, or plugins/swarmevo_rivals of a checkout"

_PROTOCOLS: dict[str, tuple[type, ...]] = {
    "controller": (NativeController, PythonController),
    "fitness": (Fitness,),
    "optimiser": (Optimiser,),
}

_ANY_SPACE = GenomeSpace((Block("genome", (8,)),))
_ANY_PROBLEM = Problem(
    (Objective("one", "minimise", (0.0, 1.0)), Objective("two", "minimise", (0.0, 1.0))),
    (Descriptor("place", (0.0, 1.0)),),
)
_ANY_OFFER: Mapping[str, Mapping[str, Any]] = {
    "controller": {},
    "fitness": {"scene": scene_info(Config())},
    "optimiser": {"problem": _ANY_PROBLEM},
}


@dataclass(frozen=True)
class PluginEntry:
    """A plugin as its distribution announces it; nothing of it has been imported."""

    kind: str
    """A key of ``GROUPS``, or ``tracker``."""
    name: str
    target: str
    """``module:attribute``"""
    distribution: str
    version: str
    clash: bool
    """Another distribution announces the same name."""

    @property
    def origin(self) -> str:
        """Distribution and version."""
        return f"{self.distribution} {self.version}"

    @property
    def files(self) -> sources.Files:
        """What it is made of, as it was when it was imported; see :func:`swarmevo.plugins.sources.files`."""
        return sources.files(self.target, self.distribution)

    def __str__(self) -> str:
        return f"{self.kind}.{self.name} ({self.origin}, {self.target})"


@dataclass(frozen=True)
class Report:
    """What came of loading a plugin."""

    entry: PluginEntry
    options: tuple[str, ...]
    """As in the factory's signature, with annotations and defaults."""
    error: str | None
    """One line; None: nothing is wrong."""
    elsewhere: str | None = None
    """Why a sound plugin is not for the default world, as one line; None: it is."""
    lacks_library: bool = False
    """Its factory asks for a library that is not installed."""


# ---- finding ---------------------------------------------------------------------------------------------------------


def discover() -> list[PluginEntry]:
    """Return all installed plugins, by kind and name, without importing any."""
    return list(_installed(tuple((path, _changed(path)) for path in sys.path)))


def _changed(path: str) -> int:
    """Return when something was last added to a folder or taken from it; 0: it is no folder."""
    with suppress(OSError):
        return os.stat(path or ".").st_mtime_ns
    return 0


@lru_cache(maxsize=8)  # reading the metadata of all distributions takes longer than a small episode
def _installed(paths: tuple[tuple[str, int], ...]) -> list[PluginEntry]:
    """Return what is installed in ``paths``, each with the time of its last change."""
    points = [(kind, point) for kind, group in _ALL_GROUPS.items() for point in metadata.entry_points(group=group)]
    claims = Counter((kind, point.name) for kind, point in points)
    entries = [
        PluginEntry(
            kind=kind,
            name=point.name,
            target=point.value,
            distribution=point.dist.name if point.dist else "unknown",
            version=point.dist.version if point.dist else "",
            clash=claims[kind, point.name] > 1,
        )
        for kind, point in points
    ]
    return sorted(entries, key=lambda entry: (entry.kind, entry.name, entry.distribution))


def find(kind: str, name: str) -> PluginEntry:
    """Return the plugin of a kind and name.

    Raises:
        PluginError: There is none, or more than one.
    """
    entries = [entry for entry in discover() if entry.kind == kind]
    matches = _named(name, entries, f"{kind}.{name}", RIVALS if kind == "optimiser" else frozenset())
    if len(matches) > 1:
        owners = " and ".join(entry.origin for entry in matches)
        raise PluginError(f"{kind}.{name}: expected one distribution with this plugin, got {owners}; uninstall one")
    return matches[0]


def _named(name: str, entries: Sequence[PluginEntry], place: str, rivals: Set[str]) -> list[PluginEntry]:
    matches = [entry for entry in entries if entry.name == name]
    if not matches and name in rivals:
        raise PluginError(f"{place}: it is a plugin of swarmevo-rivals, which is not installed; {INSTALL_RIVALS}")
    if not matches:
        known = sorted({entry.name for entry in entries})
        hint = did_you_mean(name, {*known, *rivals}) or f"; installed: {', '.join(known) or 'none'}"
        raise PluginError(f"{place}: no such plugin{hint}")
    return matches


def load(entry: PluginEntry) -> Factory:
    """Import a plugin and return its factory.

    Raises:
        PluginError: The import fails, or what it gives cannot be called.
    """
    point = metadata.EntryPoint(entry.name, entry.target, _ALL_GROUPS[entry.kind])
    files = entry.files

    def refused(error: BaseException) -> PluginError:
        return PluginError(f"{entry}: cannot be loaded: {_reason(error)}; repair or uninstall it")

    with blamed(refused, f"{entry}: import"):
        factory = point.load()
    sources.note_import(entry.target, files)
    if not callable(factory):
        raise PluginError(f"{entry}: expected a factory that can be called, got {type(factory).__name__}")
    return factory  # type: ignore[no-any-return]  # callable() has told


def check(name: str) -> list[Report]:
    """Load every plugin of a name, of whatever kind, and make it with its defaults.

    Raises:
        PluginError: There is none.
    """
    return [_report(entry) for entry in _named(name, discover(), name, RIVALS)]


# ---- making ----------------------------------------------------------------------------------------------------------


def create(kind: str, name: str, options: Mapping[str, Any], *args: Any, **offered: Any) -> Any:
    """Load a plugin, check its options and make it.

    Args:
        kind: A key of ``GROUPS``.
        name: Of the entry point.
        options: Keyword arguments of the factory.
        *args: What the host passes: ``HOST_PARAMETERS[kind]``.
        **offered: What it passes to a factory that takes it: ``OFFERED_PARAMETERS[kind]``.

    Raises:
        PluginError: With everything that is wrong.
    """
    entry = find(kind, name)
    factory = load(entry)
    known = options_of(kind, factory)
    if known is None:
        return _make(entry, factory, options, *args)
    host = taken_of(factory, offered)
    if wrong := _option_errors(entry, known, options):
        raise PluginError(*wrong)
    taken = {name: option.taken(value) for name, value in options.items() if (option := of_name(known, name))}
    return _make(entry, factory, taken, *args, **host)


def takes(kind: str, name: str, parameter: str) -> bool:
    """Return whether a plugin's factory has one of ``OFFERED_PARAMETERS[kind]``.

    Raises:
        PluginError: The plugin cannot be loaded.
    """
    return bool(taken_of(load(find(kind, name)), {parameter: None}))


def default_options(kind: str, name: str) -> dict[str, Any]:
    """Return the options of a plugin that have a default, with it, as plain data; none if the factory has no signature.

    Raises:
        PluginError: The plugin cannot be loaded.
    """
    defaults = {
        option.name: option.parameter.default
        for option in options_of(kind, load(find(kind, name))) or ()
        if not option.takes_any_name and not option.is_required
    }
    return {option: list(value) if isinstance(value, tuple) else value for option, value in defaults.items()}


def settled_options(kind: str, name: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return a plugin's options as plain data, of options as they are written (:func:`swarmevo.config.load`).

    Where its factory wants text, ``1e5`` and ``off`` are text; else they are what YAML says.
    """
    with suppress(PluginError):  # told by `option_errors`
        return settled(kind, load(find(kind, name)), given)
    plain_options: dict[str, Any] = plain(given)
    return plain_options


def option_errors(config: Config) -> list[str]:
    """Return all that is wrong with the plugins of a configuration and their options, one line each.

    Every plugin is made once, on trial, so that values which its factory refuses are found before anything is run.
    """
    errors: list[str] = []
    controllers = _try_all("controller", config.controller, errors)
    judges = _try_all("fitness", config.fitness, errors, scene=scene_info(config))
    try:
        space = _space(config, *controllers.values())
        problem = _problem(judges)
    except PluginError as error:
        return [*errors, *error.errors]
    host = (space, config.evolution.population, len(problem.objectives), np.random.default_rng(0))
    _try_all("optimiser", config.optimiser, errors, *host, problem=problem)
    return errors


def _try_all(
    kind: str, chosen: Mapping[str, Mapping[str, Any]], errors: list[str], *args: Any, **offered: Any
) -> dict[str, Any]:
    """Make the chosen plugins of a kind, by name; append what is wrong to ``errors``."""
    made = {}
    for name, options in chosen.items():
        try:
            made[name] = create(kind, name, options, *args, **offered)
        except PluginError as error:
            errors += error.errors
    return made


def _space(config: Config, controller: Controller | None = None) -> GenomeSpace:
    """Return the genome that the optimiser will see, or any if there is no controller to ask."""
    if controller is None:
        return _ANY_SPACE
    name = next(iter(config.controller))
    with blamed(lambda error: PluginError(f"controller.{name}: {_reason(error)}")):
        return individual_space(returned.space(controller.space(scene_info(config))), config.team)


def _problem(judges: Mapping[str, Fitness]) -> Problem:
    """Return the problem that the optimiser will see, or any if no fitness function can be made."""
    objectives = [one for name, judge in judges.items() for one in _measured(name, judge, "objectives")]
    descriptors = [one for name, judge in judges.items() for one in _measured(name, judge, "descriptors")]
    return Problem(tuple(objectives) or _ANY_PROBLEM.objectives, tuple(descriptors))


def _measured(name: str, judge: Fitness, what: str) -> list[Any]:
    """Return a fitness function's objectives, or its descriptors, of which it may have none."""
    check = {"objectives": returned.objective, "descriptors": returned.descriptor}[what]
    with blamed(lambda error: PluginError(f"fitness.{name}: {what}: {_reason(error)}")):
        return [check(one) for one in (getattr(judge, what) if has(judge, what) else ())]


def individual_space(robot: GenomeSpace, team: Team) -> GenomeSpace:
    """Return the layout of an individual, of a robot's."""
    return robot.tile(team.robots) if team.has_own_genomes else robot


def _make(entry: PluginEntry, factory: Factory, options: Mapping[str, Any], *args: Any, **offered: Any) -> Any:
    def refused(error: BaseException) -> PluginError:
        # Where the message begins with an option, it reads as that option's place in the configuration.
        reason = _reason(error)
        mark = "." if reason.split(":")[0] in options else ": "
        return PluginError(f"{entry.kind}.{entry.name}{mark}{reason} (refused by {entry.origin})")

    with blamed(refused, f"{entry}: factory"):
        plugin = factory(*args, **offered, **options)
        lacking = [_lacking(plugin, protocol) for protocol in _PROTOCOLS[entry.kind]]  # a property is code, too
    if all(lacking):
        raise PluginError(f"{entry}: expected the methods of the protocol, got none called {' or '.join(lacking)}")
    return plugin


def _report(entry: PluginEntry) -> Report:
    options: tuple[str, ...] = ()
    elsewhere, lacks_library = None, False
    try:
        factory = load(entry)
        known = options_of(entry.kind, factory) or [] if entry.kind in GROUPS else []
        options = tuple(str(option.parameter) for option in known)
        if entry.kind in GROUPS and not any(option.is_required for option in known):
            host = (_ANY_SPACE, 8, 2, np.random.default_rng(0)) if entry.kind == "optimiser" else ()
            offered = taken_of(factory, _ANY_OFFER[entry.kind])
            try:
                _make(entry, factory, {}, *host, **offered)
            except PluginError as error:
                lacks_library = isinstance(error.__cause__, ImportError)
                if "scene" not in offered or not isinstance(error.__cause__, ValueError):
                    raise
                elsewhere = _reason(error.__cause__)  # it knows which worlds it is for
        find(entry.kind, entry.name)
        return Report(entry, options, None, elsewhere)
    except PluginError as error:
        return Report(entry, options, str(error), lacks_library=lacks_library)


# ---- what is wrong ---------------------------------------------------------------------------------------------------


def _option_errors(entry: PluginEntry, known: Sequence[Option], given: Mapping[str, Any]) -> list[str]:
    """Return what is wrong with options, one line each."""
    path, owner = f"{entry.kind}.{entry.name}", entry.origin
    names = [option.name for option in known if not option.takes_any_name]
    has = f"; {entry.name} has {', '.join(names) or 'no options'}"
    errors = []
    for name, value in given.items():
        option = of_name(known, name)
        if option is None:
            errors.append(f"{path}.{name}: unknown option of {owner}{did_you_mean(name, names) or has}")
        elif problem := option.problem(value):
            errors.append(f"{path}.{name}: {problem} (annotated so in {owner})")
    return errors + [
        f"{path}.{option.name}: expected a value, got none; {owner} has no default for it"
        for option in known
        if option.is_required and option.name not in given
    ]


def _lacking(plugin: object, protocol: type) -> str:
    """Return the names in ``protocol`` that a plugin does not have."""
    names = {name for base in protocol.__mro__ for name in vars(base) if not name.startswith("_")}
    return ", ".join(sorted(name for name in names if not has(plugin, name)))


def has(plugin: object, name: str) -> bool:
    """Return whether a plugin has an attribute, without asking a property, which may raise, what it is."""
    return inspect.getattr_static(plugin, name, None) is not None or hasattr(plugin, name)


def _reason(error: BaseException) -> str:
    """Return an exception's message as one line; with its type unless it is a ValueError."""
    said = message(error)
    return said if said and isinstance(error, ValueError) else one_line(error)

# SPDX-License-Identifier: BSD-3-Clause
"""A run for other programs: every episode as CSV or JSON, a controller as JSON or as C for an E-puck or for Webots."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, Literal, TextIO

import numpy as np

from swarmevo._version import __version__
from swarmevo.config import Config, scene_info, surroundings
from swarmevo.errors import ExportError
from swarmevo.evolution.results import COLUMNS, Column, Sizes
from swarmevo.plugins.team import Team
from swarmevo.printable import printable
from swarmevo.protocols import Descriptor, FloatArray, Objective
from swarmevo.runs import webots
from swarmevo.runs.networks import Network, RecurrentNetwork, as_c, literal, plain, template
from swarmevo.runs.networks import networks as native_networks
from swarmevo.runs.store import Store
from swarmevo.runs.webots.tables import Infrared
from swarmevo.simulation import layout

FORMAT: Final = 1
"""Of the JSON that this module writes."""
Target = Literal["epuck", "webots"]

_FORMULA: Final = ("=", "+", "-", "@", "\uff1d", "\uff0b", "\uff0d", "\uff20")
"""What a formula of a spreadsheet begins with, in the width of East Asian text too."""


# ---- episodes --------------------------------------------------------------------------------------------------------


BEFORE: Final = {
    "trial": "from 0",
    "generation": "from 0",
    "individual": "place in the generation, from 0",
    "repeat": "from 0; with the run's seed, trial and generation it keys everything random in the episode",
    "genome": "id of the individual's genome, as `swarmevo show` prints it; equal genomes have one id",
}
"""Columns of an exported episode before those of ``COLUMNS``, with their meanings."""
AFTER: Final = {
    "session": "that ran it; provenance of each in the JSON export and in run.sqlite",
    "fault": "why it failed, and has the worst objectives; empty: it did not",
}
"""Those behind."""


def check_names(measured: Sequence[Objective | Descriptor], robots: int) -> None:
    """Refuse objectives and descriptors that have the name of another column, so that no two columns have one name.

    Raises:
        ExportError: One has.
    """
    sizes = Sizes(objectives=0, robots=robots)
    taken = {*BEFORE, *(cell for column in COLUMNS for cell in column.cells(sizes)), *AFTER}
    for one in measured:
        if one.name in taken:
            what = "descriptor" if isinstance(one, Descriptor) else "objective"
            raise ExportError(
                f"{what} {one.name}: expected another name than that of a column of the exports; rename it in its "
                "fitness plugin"
            )


def columns(store: Store) -> dict[str, str]:
    """Return the columns of :func:`episodes` with their meanings, in order.

    Raises:
        ExportError: An objective or a descriptor has the name of another column.
    """
    check_names([*store.objectives, *store.descriptors], store.robots)
    return {**BEFORE, **{name: meaning for column in COLUMNS for name, meaning in _cells(store, column)}, **AFTER}


def _cells(store: Store, column: Column) -> Iterator[tuple[str, str]]:
    """Yield name and meaning of each cell of a column; objectives and descriptors have their own names."""
    if column.axis == "objectives":
        for one in store.objectives:
            low, high = one.range
            yield one.name, f"objective, to {one.direction}, from {low:g} to {high:g}; {column.meaning}"
    elif column.axis == "descriptors":
        for each in store.descriptors:
            low, high = each.range
            yield each.name, f"descriptor, from {low:g} to {high:g}; {column.meaning}"
    elif column.dtype is np.uint64:
        yield column.name, f"{column.meaning}, as 16 hexadecimal digits"
    else:
        yield from ((cell, column.meaning) for cell in column.cells(store.sizes))


def episodes(store: Store) -> Iterator[tuple[Any, ...]]:
    """Yield every stored episode as a row of :func:`columns`; None where a cell is empty."""
    for trial in store.trials():
        for number in range(store.generations(trial)):
            yield from _generation(store, trial, number)


def _generation(store: Store, trial: int, number: int) -> Iterator[tuple[Any, ...]]:
    stored, genomes = store.generation(trial, number).episodes, store.genome_ids(trial, number)
    sessions = store.sessions(trial, number)
    hexadecimal = [column.dtype is np.uint64 for column in COLUMNS for _ in column.cells(store.sizes)]
    for i, (individual, repeat, *cells) in enumerate(stored.rows()):
        shown = (f"{cell:016x}" if as_hex else cell for cell, as_hex in zip(cells, hexadecimal, strict=True))
        fault = stored.faults[i] or None
        yield (trial, number, individual, repeat, int(genomes[individual]), *shown, int(sessions[i]), fault)


def write_csv(store: Store, out: TextIO) -> None:
    """Write every episode as a line of CSV after one with the columns' names; numbers keep all their bits.

    Text that a spreadsheet would take for a formula begins with an apostrophe; control characters are shown, escaped.
    """
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(map(_cell, columns(store)))
    writer.writerows(map(_cell, row) for row in episodes(store))


def _cell(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    shown = printable(value)
    return f"'{shown}" if shown.startswith(_FORMULA) else shown


def write_json(store: Store, out: TextIO) -> None:
    """Write configuration, provenance, genomes and episodes as one JSON object; a row stands in one line."""
    sessions = {
        int(id): store.session(int(id))
        for trial in store.trials()
        for number in range(store.generations(trial))
        for id in np.unique(store.sessions(trial, number))
    }
    head = {
        "format": FORMAT,
        "swarmevo": __version__,
        "config": store.config.model_dump(mode="json"),
        "sessions": sessions,
        "objectives": [
            {
                "name": one.name,
                "direction": one.direction,
                "range": list(one.range),
                **({} if one.success is None else {"success": one.success}),
            }
            for one in store.objectives
        ],
        "descriptors": [{"name": one.name, "range": list(one.range)} for one in store.descriptors],
        "columns": columns(store),
    }
    out.write("{\n")
    for name, value in head.items():
        out.write(f"{json.dumps(name)}: {json.dumps(value, allow_nan=False)},\n")
    _write_rows(out, "genomes", ([id, store.genome(id).tolist()] for id in store.all_genomes()))
    out.write(",\n")
    _write_rows(out, "episodes", episodes(store))
    out.write("\n}\n")


def _write_rows(out: TextIO, name: str, rows: Iterator[Sequence[Any]]) -> None:
    out.write(f"{json.dumps(name)}: [")
    for i, row in enumerate(rows):
        out.write(",\n" if i else "\n")
        out.write(json.dumps(row, allow_nan=False))
    out.write("]")


# ---- a controller ----------------------------------------------------------------------------------------------------


def controller(store: Store, genome: int) -> dict[str, Any]:
    """Return all there is to know about a controller, as plain data.

    Args:
        store: Of the run.
        genome: Its id, as ``swarmevo show`` prints it.

    Raises:
        EvaluationError: The controller plugin takes genomes of another size.
        PluginError: The run's controller plugin cannot be made.
        StoreError: There is no such genome.
    """
    config, genes = store.config, store.genome(genome)
    team = Team(config)
    team.check(genes[np.newaxis])
    return {
        "format": FORMAT,
        "swarmevo": __version__,
        "run": str(store.folder),
        "genome": genome,
        "controller": config.controller,
        "genes": genes.tolist(),
        "blocks": {name: block.tolist() for name, block in team.space.split(genes).items()},
        "networks": [plain(network) for network in networks(team, genes)],
        "observations": team.scene.info.observation_names,
        "commands": team.scene.info.command_names,
        "scales": _scales(config),
    }


def networks(team: Team, genes: FloatArray) -> list[Network]:
    """Return the networks of a genome: one, or one for each robot where each has its own; none if it is no network.

    Raises:
        EvaluationError: The controller plugin failed.
    """
    return native_networks(team.policies(genes), team.scene.info.control_period)


def source(store: Store, genome: int, target: Target, robot: int = 0, infrared: Infrared = "evolved") -> str:
    """Return a controller as C99 source that needs no other file.

    Args:
        store: Of the run.
        genome: Its id.
        target: A function for an E-puck's firmware, which is given observations where the robot has other sensors than
            the paper's, or a whole Webots controller.
        robot: Whose, where each robot has a genome of its own.
        infrared: For Webots, which lookup table the world's infrared sensors have.

    Raises:
        ExportError: The controller is no network of the library, there is no such robot, or Webots has not one of its
            sensors.
        PluginError: The controller plugin cannot be made.
        StoreError: There is no such genome.
    """
    found = _written(store, genome)
    if not 0 <= robot < len(found):
        most = f"0 to {len(found) - 1}" if len(found) > 1 else "0, for all robots have the same genome"
        raise ExportError(f"robot: expected {most}, got {robot}")
    return _source(store, genome, target, found, robot, infrared)


def webots_project(store: Store, genome: int, folder: Path, infrared: Infrared = "evolved") -> None:
    """Write a Webots project: the run's world, with the controller of each robot.

    Args:
        store: Of the run.
        genome: Its id.
        folder: To make; it is empty if it is there.
        infrared: Which lookup table the world's infrared sensors have.

    Raises:
        ExportError: As :func:`source`; or Webots has not what is in the scene.
        OutputError: The folder is not empty, or cannot be written.
        PluginError, StoreError: As :func:`source`.
        SimulatorError: The run's first episode cannot begin.
    """
    found = _written(store, genome)
    programs = [_source(store, genome, "webots", found, robot, infrared) for robot in range(len(found))]
    webots.write(folder, store.config, _title(store, f"Genome {genome}"), programs, infrared)


def _written(store: Store, genome: int) -> list[Network]:
    """Return the networks of a genome that can be written as C."""
    config = store.config
    found = networks(Team(config), store.genome(genome))
    if not found:
        name = next(iter(config.controller))
        raise ExportError(
            f"controller {name}: expected networks that the library runs, to write as C, got another kind"
        )
    if not config.robot.sensors:
        raise ExportError("robot.sensors: expected one at least to write as C, got none; write the controller as JSON")
    period = 1000 * config.episode.control_period
    if isinstance(found[0], RecurrentNetwork) and abs(period - round(period)) > 1e-6:
        raise ExportError(
            f"episode.control_period: expected whole milliseconds to write a controller with a memory as C, got "
            f"{period:g} ms, which would be {round(period)} ms there; write the controller as JSON"
        )
    return found


def _source(store: Store, genome: int, target: Target, found: Sequence[Network], robot: int, infrared: Infrared) -> str:
    config, network = store.config, found[robot]
    own = f", robot {robot}" if len(found) > 1 else ""
    values = {
        **_values(config),
        "title": _title(store, f"Genome {genome}{own}"),
        "description": network.description,
    }
    parts = [template("head").substitute(values), as_c(network)]
    if target == "webots":
        return "".join([*parts, webots.source(config, infrared)])
    signals = len(surroundings(config).radio_channels)
    is_read = all(device in _OBSERVE for device in config.robot.sensors) and signals <= 1
    names = ["observe", "motors", "epuck"] if is_read else ["motors", "observed"]
    return "".join([*parts, *(template(name).substitute(values) for name in names)])


def _title(store: Store, what: str) -> str:
    return _comment(f"{what} of the run {store.folder.name}, written by swarmevo {__version__}.")


def _scales(config: Config) -> dict[str, float]:
    """Return what turns a robot's readings into observations, and commands into speeds."""
    scene = surroundings(config)
    return {
        "infrared_largest": config.sensors.infrared_curve[0][1],
        "signal_least": layout.signal_range(scene)[0],
        "signal_most": layout.signal_scale(scene),
        "top_speed": config.robot.top_speed,
        "control_period": config.episode.control_period,
    }


def _places(names: Sequence[str]) -> str:
    return "".join(f"    SWARMEVO_{name.upper()} = {place},\n" for place, name in enumerate(names))


_OBSERVE: Final = {
    "infrared": "    for (i = 0; i < SWARMEVO_INFRARED; ++i)\n"
    "        *next++ = limited(infrared[i] / SWARMEVO_INFRARED_LARGEST, 0.0, 1.0);\n",
    "touch": "    for (i = 0; i < SWARMEVO_TOUCH; ++i) *next++ = limited(touch[i], 0.0, 1.0);\n",
    "rf": "    *next++ =\n"
    "        limited(signal_strength, SWARMEVO_SIGNAL_LEAST, SWARMEVO_SIGNAL_MOST) / SWARMEVO_SIGNAL_MOST;\n",
}
"""For each device that an exported program can read itself: how its readings are scaled."""


def _values(config: Config) -> Mapping[str, str]:
    """Return what the templates need to know of the scene."""
    scales = {name: literal(value) for name, value in _scales(config).items() if name != "control_period"}
    info = scene_info(config)
    return {
        **scales,
        "observations": str(info.observations),
        "commands": str(info.commands),
        "infrared": str(info.infrared),
        "touch": str(info.touch),
        "names": ", ".join(info.observation_names) or "none",
        "first": info.observation_names[0].upper(),
        "messages": ", then the bits of the message: set where above 0" * (info.message > 0),
        "observe": "".join(_OBSERVE.get(device, "") for device in config.robot.sensors),
        "observation_places": _places(info.observation_names),
        "command_places": _places(info.command_names),
        "control_period_ms": str(round(1000 * config.episode.control_period)),
    }


def _comment(text: str) -> str:
    """Return text that cannot end a comment of C or begin a line of its own."""
    return "".join(letter if letter.isprintable() else "?" for letter in text).replace("*/", "* /").replace("/*", "/ *")

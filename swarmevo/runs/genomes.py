# SPDX-License-Identifier: BSD-3-Clause
"""Genomes from outside: written by hand, exported, or of another run.

A source is

- a JSON file: what ``swarmevo export --controller`` writes, a list of genes, a list of such lists, or ``{"genomes":
  [...]}`` with one;
- a CSV file: a row for each genome, without a head;
- another run, ``RUN``, for its front over all trials, or ``RUN:ID``, for one of its individuals.

Where a source tells a genome's blocks, as an exported controller and a run do, it may have fewer units, such as hidden
neurons, than are wanted: what lacks is zero, and switched off. What it tells of what they were made for is compared.
"""

from __future__ import annotations

import csv
import json
import math
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import moocore
import numpy as np

from swarmevo.config import Config
from swarmevo.errors import ConfigError
from swarmevo.evolution.costs import to_costs
from swarmevo.plugins.team import Team
from swarmevo.protocols import Block, FloatArray, GenomeSpace
from swarmevo.runs import checksums, made_for
from swarmevo.runs.database import DATABASE_FILE
from swarmevo.runs.store import Store

_LARGEST_FILE: Final = 256 * 2**20  # [bytes]: a hundred thousand of the paper's genomes as text


def read_genomes(source: str, config: Config, space: GenomeSpace) -> FloatArray:
    """Return the genomes ``(k, space.size)`` of a source, k at least 1.

    Args:
        source: A file, ``RUN`` or ``RUN:ID``.
        config: In which they are to act.
        space: Of the individuals that are wanted there.

    Raises:
        ConfigError: It cannot be read, or holds no such genomes, or they were made for other sensors or another
            controller. One line says where.
        PluginError: The controller of a run is not installed.
        StoreError: A run is damaged.
    """
    folder, individual = _run_and_individual(source)
    if os.path.isfile(folder / DATABASE_FILE):
        return _of_run(source, folder, individual, config, space)
    text = _text(source)
    try:
        if source.lower().endswith(".csv") or not text.lstrip().startswith(("[", "{")):
            found: Any = [[_parsed(cell) for cell in row] for row in csv.reader(text.splitlines()) if row]
        else:
            found = json.loads(text)
    except (ValueError, RecursionError, csv.Error) as error:
        raise ConfigError(f"{source}: expected genomes as JSON or CSV, got something else: {error}") from error
    if isinstance(found, Mapping) and "genomes" in found:
        found = found["genomes"]
    several = found if isinstance(found, list) and found and isinstance(found[0], list | Mapping) else [found]
    return np.array([_genome(_where(source, i, several), one, config, space) for i, one in enumerate(several)])


def digest_of(genomes: FloatArray) -> str:
    """Return what tells genomes ``(k, size)`` from all others, in hexadecimal digits."""
    return checksums.of_genes(genomes).hex()


def _where(source: str, i: int, several: Sequence[Any]) -> str:
    return f"{source}: genome {i}" if len(several) > 1 else source


# ---- from a file -----------------------------------------------------------------------------------------------------


def _text(source: str) -> str:
    try:
        with open(source, "rb") as stream:
            data = stream.read(_LARGEST_FILE + 1)
        if len(data) > _LARGEST_FILE:
            raise ConfigError(f"{source}: expected genomes in a file of at most {_LARGEST_FILE} bytes")
        text = data.decode("utf-8-sig")
    except FileNotFoundError:
        raise ConfigError(f"{source}: expected a file of genomes or a run, but there is none") from None
    except IsADirectoryError:
        raise ConfigError(f"{source}: expected a file of genomes or a run, got another folder") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{source}: expected genomes as JSON or CSV in UTF-8, got binary data") from None
    except (OSError, ValueError) as error:
        raise ConfigError(f"{source!s:.200}: cannot be read: {error}".replace("\0", "\\0")) from None
    if not text.strip():
        raise ConfigError(f"{source}: expected genomes, got an empty file")
    return text


def _parsed(cell: str) -> float | str:
    try:
        return float(cell)
    except ValueError:
        return cell


def _genome(where: str, found: Any, config: Config, space: GenomeSpace) -> FloatArray:
    """Return a genome ``(size,)`` of what a file has of it."""
    if isinstance(found, Mapping):
        made_for.check_exported(where, found, config, space)
    if isinstance(found, Mapping) and "blocks" in found:
        return _fitted(where, found["blocks"], space)
    genes = found.get("genes") if isinstance(found, Mapping) else found
    if not isinstance(genes, list):
        raise ConfigError(
            f"{where}: expected a list of {space.size} genes, or an exported controller, got {_short(found)}"
        )
    return _sized(where, _numbers(f"{where}, gene", genes, (len(genes),)), space)


def _sized(where: str, genes: FloatArray, space: GenomeSpace) -> FloatArray:
    if len(genes) != space.size:
        layout = ", ".join(f"{block.name} {'x'.join(map(str, block.shape))}" for block in space.blocks)
        raise ConfigError(f"{where}: expected {space.size} genes ({layout}), got {len(genes)}")
    return genes


def _numbers(where: str, found: Any, shape: tuple[int, ...]) -> FloatArray:
    """Return nested lists as an array, which has this shape."""
    if not shape:
        if isinstance(found, bool) or not isinstance(found, int | float):
            raise ConfigError(f"{where}: expected a number, got {_short(found)}")
        try:
            number = float(found)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise ConfigError(f"{where}: expected a finite number, got {_short(found)}")
        return np.float64(number)  # type: ignore[return-value]
    if not isinstance(found, list) or len(found) != shape[0]:
        got = f"{len(found)}" if isinstance(found, list) else _short(found)
        raise ConfigError(f"{where}: expected {shape[0]} entries, got {got}")
    return np.array([_numbers(f"{where} {i}", one, shape[1:]) for i, one in enumerate(found)]).reshape(shape)


def _short(found: Any) -> str:
    text = repr(found)
    return text if len(text) <= 60 else f"{text[:57]}..."


# ---- blocks ----------------------------------------------------------------------------------------------------------


def _fitted(where: str, blocks: Any, space: GenomeSpace) -> FloatArray:
    """Return a genome ``(size,)`` of named arrays, in which there may be fewer units."""
    if not isinstance(blocks, Mapping):
        raise ConfigError(f"{where}: expected blocks by name, got {_short(blocks)}")
    names = [block.name for block in space.blocks]
    for name in (*blocks, *names):
        if name not in names or name not in blocks:
            what = "unknown" if name not in names else "missing"
            raise ConfigError(f"{where}: block {name} is {what}: expected {', '.join(names)}, got {', '.join(blocks)}")
    arrays = {}
    for block in space.blocks:
        arrays[block.name] = _numbers(f"{where}: block {block.name}", blocks[block.name], _shape(blocks[block.name]))
    return np.concatenate([_padded(where, block, arrays, space).ravel() for block in space.blocks])


def _shape(found: Any) -> tuple[int, ...]:
    shape = []
    while isinstance(found, list):
        shape.append(len(found))
        found = found[0] if found else None
    return tuple(shape)


def _padded(where: str, block: Block, arrays: Mapping[str, FloatArray], space: GenomeSpace) -> FloatArray:
    """Return a block with the units that lack, before what belongs to no unit, such as the weights of a bias."""
    given, axis = arrays[block.name], block.unit_axis
    family = [one for one in space.blocks if one.units == block.units] if block.units else [block]
    fits = len(given.shape) == len(block.shape)
    if fits and all(len(arrays[one.name].shape) > one.unit_axis for one in family):
        have = min(arrays[one.name].shape[one.unit_axis] for one in family)
        want = min(one.shape[one.unit_axis] for one in family)
        wider = list(given.shape)
        wider[axis] = max(0, want - have)
        units, others = np.split(given, [have], axis=axis)
        given = np.concatenate([units, np.zeros(wider), others], axis=axis)
    if given.shape != block.shape:
        shown = "x".join(map(str, block.shape))
        got = "x".join(map(str, arrays[block.name].shape)) or "a number"
        raise ConfigError(
            f"{where}: block {block.name}: expected {shown} numbers, or of fewer units in all blocks, got {got}"
        )
    return given


# ---- from a run ------------------------------------------------------------------------------------------------------


def _run_and_individual(source: str) -> tuple[Path, int | None]:
    folder, _, individual = source.rpartition(":")
    if not os.path.exists(source) and re.fullmatch("[0-9]{1,18}", individual):
        return Path(folder), int(individual)
    return Path(source), None


def _of_run(source: str, folder: Path, individual: int | None, config: Config, space: GenomeSpace) -> FloatArray:
    with Store.open(folder) as store:
        made_for.check_run(source, store.config, config, space)
        if individual is None:
            found = store.individuals()
            if not len(found.genome):
                raise ConfigError(f"{source}: expected a run with a front, but no generation is stored yet")
            least = min(store.config.evolution.least_episodes, int(found.episodes.max()))
            known = np.flatnonzero(found.episodes >= least)
            costs = to_costs(store.objectives, found.objectives[known])
            front = np.flatnonzero(moocore.is_nondominated(costs))
            ids = found.genome[known[front[np.argsort(costs[front, 0], kind="stable")]]].tolist()
        else:
            ids = [individual]
        genomes = [store.genome(id) for id in dict.fromkeys(ids)]
        if all(len(genes) == space.size for genes in genomes):
            return np.array(genomes)
        theirs = Team(store.config).space
        blocks = [{name: block.tolist() for name, block in theirs.split(genes).items()} for genes in genomes]
        return np.array(
            [_fitted(f"{source}: individual {id}", one, space) for id, one in zip(ids, blocks, strict=True)]
        )

# SPDX-License-Identifier: BSD-3-Clause
"""The files that a plugin is made of: they tell what a version number does not, where a plugin is still being written.

A process runs what it has imported, whatever becomes of the files. So they are read right before the import, and what
was read stands for as long as the module is loaded.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterator, Mapping
from importlib import metadata, util
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from weakref import WeakKeyDictionary

Files = Mapping[str, str]
"""SHA-256 by path, which begins with the package or is the module's: ``swarmevo_paper/pde.py``, ``my_plugin.py``."""

_HOST = "swarmevo"
_EDITABLE = ("__editable__", "_editable_")  # modules that installers write to find the others; made anew each time

_read: WeakKeyDictionary[ModuleType, Files] = WeakKeyDictionary()  # a cache: what loaded modules were when imported


def files(target: str, distribution: str) -> Files:
    """Return the files of a plugin, without importing it.

    They are those of the package, or the module, that holds it, and of its distribution's other packages and modules
    as far as the distribution names them; not caches, hidden files, nor what other distributions install.

    Args:
        target: ``module:attribute``
        distribution: Its name; need not be installed.
    """
    root = _root(target)
    loaded = sys.modules.get(root)
    if loaded is not None and loaded in _read:
        return _read[loaded]
    names = {root, *_others(distribution)}
    found = {path: _sha256(file) for name in sorted(names) for path, file in _files(name)}
    if loaded is not None:
        _read[loaded] = found
    return found


def note_import(target: str, before: Files) -> None:
    """Note that a plugin was imported, from the files as they were right ``before``."""
    if (loaded := sys.modules.get(_root(target))) is not None:
        _read.setdefault(loaded, before)


def _root(target: str) -> str:
    """Return the first package or module on the way to a target that is more than a namespace."""
    parts = target.partition(":")[0].split(".")
    names = [".".join(parts[: i + 1]) for i in range(len(parts))]
    return next((name for name in names if (spec := _spec(name)) is None or spec.has_location), names[0])


def _others(distribution: str) -> Iterator[str]:
    """Yield the names of a distribution's packages and modules; of swarmevo none: its plugins' packages are apart."""
    if distribution == _HOST:
        return
    try:
        found = metadata.distribution(distribution)
    except metadata.PackageNotFoundError:
        return
    names = set((found.read_text("top_level.txt") or "").split())  # of setuptools, for editable installs too
    names |= {file.parts[0].removesuffix(".py") for file in found.files or () if file.suffix == ".py"}
    yield from (name for name in names if name.isidentifier() and name != _HOST and not name.startswith(_EDITABLE))


def _files(name: str) -> Iterator[tuple[str, Path]]:
    """Yield each file of a package or module, and the path by which it is known."""
    spec = _spec(name)
    if spec is None:
        return
    parents, folders = name.split("."), spec.submodule_search_locations
    if folders is None:
        parents.pop()
        folders = [spec.origin] if spec.origin and spec.has_location else []
        if parents:  # a folder without __init__.py is taken for a package
            folders = [str(Path(file).parent) for file in folders]
    for place in map(Path, folders):
        there = next(path for path in (place, *place.parents) if path.exists())
        if there.is_file():  # a module, or an archive that holds it
            yield there.name, there
        elif there == place:
            for file in filter(Path.is_file, sorted(place.rglob("*"))):
                inside = file.relative_to(place)
                if not any(part.startswith(".") or part == "__pycache__" for part in inside.parts):
                    yield "/".join([*parents, *inside.parts]), file


def _spec(name: str) -> ModuleSpec | None:
    try:
        return util.find_spec(name)
    except (ImportError, ValueError):  # its parent is not there; it was loaded by other means than an import
        return None


def _sha256(file: Path) -> str:
    with file.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()

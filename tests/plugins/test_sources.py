# SPDX-License-Identifier: BSD-3-Clause
"""Which files a plugin is made of, and as of when."""

from __future__ import annotations

import hashlib
import importlib
import sys
import zipfile
from collections.abc import Mapping
from pathlib import Path

import pytest

import toy_plugins
from conftest import Distribution
from swarmevo import plugins
from swarmevo.plugins import sources


def sha256(content: str) -> str:
    return hashlib.sha256(content.encode()).hexdigest()


def write(folder: Path, files: Mapping[str, str]) -> None:
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content)


# ---- which files -----------------------------------------------------------------------------------------------------


def test_a_package_with_all_that_is_in_it(distribution: Distribution) -> None:
    """Case 52: weights and compiled code as well as sources; no caches, nothing hidden."""
    site = distribution("hills", "1.0", {})
    made_of = {"hilly/__init__.py": "", "hilly/deep/climb.py": "a", "hilly/deep/w.bin": "b", "hilly/native.so": "c"}
    write(site, made_of | {"hilly/deep/__pycache__/climb.pyc": "d", "hilly/.climb.py.swp": "e"})
    found = sources.files("hilly.deep.climb:Climber", "hills")
    assert found == {name: sha256(content) for name, content in made_of.items()}
    assert "hilly" not in sys.modules


def test_a_single_module(distribution: Distribution) -> None:
    """Case 52."""
    distribution("hills", "1.0", {}, lone_hill="a")
    assert sources.files("lone_hill:Climber", "hills") == {"lone_hill.py": sha256("a")}
    assert "lone_hill" not in sys.modules


def test_a_module_that_lies_elsewhere_on_the_path(distribution: Distribution) -> None:
    """Case 52: as an editable install has it."""
    distribution("toys", "1.0", {})
    source = Path(toy_plugins.__file__).read_text()
    assert sources.files("toy_plugins:Network", "toys") == {"toy_plugins.py": sha256(source)}


@pytest.mark.parametrize("record", ["top_level.txt", "RECORD"])
def test_what_else_its_distribution_names(distribution: Distribution, record: str) -> None:
    """Case 52: a helper beside the plugin's module is a part of it."""
    site = distribution("hills", "1.0", {}, steep_hill="import steep_help", steep_help="a", others_help="b")
    (info,) = site.glob("*.dist-info")
    lines = {
        "top_level.txt": "steep_hill\nsteep_help\n",
        "RECORD": "steep_hill.py,,\nsteep_help.py,,\n../../bin/others_help.py,,\n__editable___hills_finder.py,,\n",
    }
    (info / record).write_text(lines[record])
    assert set(sources.files("steep_hill:Climber", "hills")) == {"steep_hill.py", "steep_help.py"}


def test_a_package_in_a_namespace_without_the_others_there(
    distribution: Distribution, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site = distribution("hills", "1.0", {})
    write(site, {"alps/eiger/__init__.py": "a", "alps/eiger/face.py": "b"})
    write(tmp_path / "other", {"alps/jura/hill.py": "c"})
    monkeypatch.syspath_prepend(str(tmp_path / "other"))
    found = sources.files("alps.eiger.face:Climber", "hills")
    assert found == {"alps/eiger/__init__.py": sha256("a"), "alps/eiger/face.py": sha256("b")}
    assert sources.files("alps.jura.hill:Climber", "none") == {"alps/jura/hill.py": sha256("c")}


def test_a_module_in_a_folder_that_is_no_package_comes_with_the_folder(distribution: Distribution) -> None:
    site = distribution("hills", "1.0", {})
    write(site, {"bare/hill.py": "a", "bare/help.py": "b", "bare/deep/data.bin": "c"})
    assert set(sources.files("bare.hill:Climber", "hills")) == {"bare/hill.py", "bare/help.py", "bare/deep/data.bin"}


def test_an_archive_is_one_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    archive = tmp_path / "hills.zip"
    with zipfile.ZipFile(archive, "w") as opened:
        opened.writestr("zipped_hill/__init__.py", "")
    monkeypatch.syspath_prepend(str(archive))
    digest = hashlib.sha256(archive.read_bytes()).hexdigest()
    assert sources.files("zipped_hill:Climber", "hills") == {"hills.zip": digest}


def test_the_built_ins_are_their_package_and_not_all_of_swarmevo() -> None:
    assert set(plugins.find("optimiser", "pde").files) == {
        f"swarmevo_paper/{name}.py" for name in ("__init__", "fitness", "network", "pde")
    }


def test_what_cannot_be_found_has_no_files() -> None:
    for target in ("nowhere_to_be_found:A", "nowhere_to_be_found.b:A", "sys:path"):
        assert sources.files(target, "none") == {}


# ---- as of when ------------------------------------------------------------------------------------------------------

CLIMBER = "class Climber:\n    def __init__(self, *host): ...\n    ask = tell = state = restore = None\n"


def test_a_loaded_plugin_is_what_it_was_when_it_was_imported(distribution: Distribution) -> None:
    """Case 52: whatever becomes of its files, until another process imports it, or this one anew."""
    site = distribution("hills", "1.0", {"swarmevo.optimisers": {"eager": "eager_hill:Climber"}}, eager_hill=CLIMBER)
    entry = plugins.find("optimiser", "eager")
    plugins.load(entry)
    before = dict(entry.files)
    write(site, {"eager_hill.py": CLIMBER + "# changed\n"})
    assert entry.files == before == {"eager_hill.py": sha256(CLIMBER)}
    del sys.modules["eager_hill"]
    importlib.invalidate_caches()
    assert entry.files == {"eager_hill.py": sha256(CLIMBER + "# changed\n")}


def test_a_change_during_the_import_is_not_taken_for_what_was_imported(distribution: Distribution) -> None:
    source = CLIMBER + "with open(__file__, 'a') as file:\n    file.write('# changed')\n"
    distribution("hills", "1.0", {"swarmevo.optimisers": {"odd": "odd_hill:Climber"}}, odd_hill=source)
    entry = plugins.find("optimiser", "odd")
    plugins.load(entry)
    assert entry.files == {"odd_hill.py": sha256(source)}

# SPDX-License-Identifier: BSD-3-Clause
"""The example of a controller in C: it is built into a wheel, which installs, evolves and passes its own tests."""

from __future__ import annotations

import re
import shutil
import zipfile
from pathlib import Path

import pytest

from authors import BUILD_PRODUCTS, OFFLINE, PIP, install, python

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "native_controller"

pytestmark = pytest.mark.skipif(shutil.which("cmake") is None, reason="needs cmake")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the wheel that an author would build."""
    folder = tmp_path_factory.mktemp("author")
    copied = shutil.copytree(EXAMPLE, folder / "native_controller", ignore=BUILD_PRODUCTS)
    done = python(*PIP, "wheel", *OFFLINE, "--wheel-dir", folder / "wheels", copied, path=folder, cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    (built,) = (folder / "wheels").iterdir()
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return install(wheel, tmp_path_factory.mktemp("installed"))


def test_the_wheel_has_the_compiled_library_and_is_for_any_python(wheel: Path) -> None:
    assert re.fullmatch(r"swarmevo_lowpass-0\.1\.0-py3-none-(linux|manylinux)\w+\.whl", wheel.name)
    assert "swarmevo_lowpass/liblowpass.so" in zipfile.ZipFile(wheel).namelist()


def test_its_own_tests_pass(installed: Path) -> None:
    done = python("-m", "pytest", "-q", "-p", "no:cacheprovider", EXAMPLE / "tests", path=installed, cwd=installed)
    assert done.returncode == 0, done.stdout + done.stderr


def test_it_evolves_and_is_verified(installed: Path, tmp_path: Path) -> None:
    settings = ["episode.horizon=2.0", "evolution.generations=2", "evolution.population=4", "evolution.repeats=1"]
    options = [
        word for setting in ["controller=lowpass", "fitness=togetherness", *settings] for word in ("--set", setting)
    ]
    command = ["evolve", "--seed", "1", "--workers", "1", "--out", tmp_path / "run", *options]
    done = python("-m", "swarmevo", *command, path=installed, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    verified = python("-m", "swarmevo", "verify", tmp_path / "run", path=installed, cwd=tmp_path)
    assert verified.returncode == 0, verified.stderr
    refused = python(
        "-m", "swarmevo", "export", tmp_path / "run", "--controller", 1, "--as", "epuck", path=installed, cwd=tmp_path
    )
    assert "controller lowpass: expected networks that the library runs" in refused.stderr


def test_the_documentation_shows_the_function_of_the_example() -> None:
    """The page has it without its comments."""
    (shown,) = re.findall(r"^```c\n(.*?)^```", (ROOT / "docs" / "controllers.md").read_text(), re.MULTILINE | re.DOTALL)
    source = re.sub(r" */\*.*?\*/", "", (EXAMPLE / "src" / "lowpass.c").read_text(), flags=re.DOTALL)
    assert shown in source

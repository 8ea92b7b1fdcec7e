# SPDX-License-Identifier: BSD-3-Clause
"""How the project is built and what it gives away: nothing used is unnamed, nothing promised is left out of CI."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from packaging.requirements import Requirement
from packaging.version import Version

from conftest import SLOWEST, pytest_collection_modifyitems

ROOT = Path(__file__).parents[2]
MAKEFILE, CI = (ROOT / "Makefile").read_text(), (ROOT / ".ci" / "run").read_text()
NOTICE = (ROOT / "NOTICE").read_text()
BUILD_TOOLS = {"Threads", "PkgConfig"}  # of the system and of CMake


def made_by_ci() -> set[str]:
    """Return the targets that ``.ci/run`` makes."""
    return {target for line in re.findall(r"^make (.*)$", CI, re.MULTILINE) for target in line.split()}


def test_ci_builds_the_docs_and_every_page_is_reached() -> None:
    """Case 40."""
    assert "docs" in made_by_ci()
    assert "sphinx-build -W " in MAKEFILE
    pages = {page.stem for kind in ("*.md", "*.ipynb") for page in (ROOT / "docs").glob(kind)} - {"index"}
    groups = re.findall(r"^```{toctree}\n(.*?)^```", (ROOT / "docs/index.md").read_text(), re.MULTILINE | re.DOTALL)
    assert all(group.startswith(":caption: ") for group in groups)
    assert max(len(group.split("\n\n")[1].splitlines()) for group in groups) < 10  # a list that is looked through
    listed = [page for group in groups for page in re.findall(r"^(?:README <)?([a-z_-]+)>?$", group, re.MULTILINE)]
    assert sorted(listed) == sorted(pages)


def test_ci_runs_sanitizers_and_a_short_fuzz() -> None:
    """Case 41: and the fuzzers' runtime library is on the list of packages."""
    assert {"sanitize", "fuzz-native", "FUZZ_SECONDS=5"} <= made_by_ci()
    (packages,) = re.findall(r"^FUZZ_PACKAGES := (.*)$", MAKEFILE, re.MULTILINE)
    assert set(packages.split()) == {"clang", "libclang-rt-dev"}


def test_the_slowest_files_of_tests_are_there_and_begin_first() -> None:
    slowest = [ROOT / "tests" / file for file in SLOWEST]
    assert all(file.is_file() for file in slowest)
    items: list[Any] = [SimpleNamespace(path=file) for file in (Path(__file__), *reversed(slowest))]
    pytest_collection_modifyitems(items)
    assert [item.path for item in items] == [*slowest, Path(__file__)]


def test_development_and_ci_install_pinned_versions_of_all_that_is_declared() -> None:
    """Case 42: and no pin is below a declared bound."""
    pins = pinned("constraints.txt")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    rivals = tomllib.loads((ROOT / "plugins/swarmevo_rivals/pyproject.toml").read_text())["project"]
    needed = [one for one in rivals["dependencies"] if one != "swarmevo"] + rivals["optional-dependencies"]["ribs"]
    declared_by_all = project["dependencies"] + extras["test"] + extras["lint"] + extras["docs"] + needed
    for declared in map(Requirement, declared_by_all):
        assert pins[declared.name.lower()] in declared.specifier, declared
    installs = re.findall(
        r"\$\(BIN\)/pip install -q (?!\"\$\$)(.*)$", MAKEFILE, re.MULTILINE
    )  # but for ruff, of its own pin
    assert len(installs) == 3
    assert all("-c constraints.txt" in install and "RIVALS)" in install for install in installs)


def pinned(file: str) -> dict[str, str]:
    return dict(line.split("==") for line in (ROOT / file).read_text().splitlines() if "==" in line)


def test_ci_runs_tests_with_the_lower_bounds_of_all_that_is_declared() -> None:
    """Case 42: with those of before, no command started."""
    assert "test-lowest" in made_by_ci()
    pins = pinned("constraints-lowest.txt")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    tools = [one for one in extras["test"] if Requirement(one).name in ("pytest", "hypothesis")]
    for declared in map(Requirement, project["dependencies"] + extras["pandas"] + extras["dask"] + tools):
        (bound,) = declared.specifier
        assert bound.operator == ">="
        assert Version(pins[declared.name.lower()]) == Version(bound.version), declared


def test_the_notice_names_what_the_library_is_made_of() -> None:
    """Case 43."""
    cmake = (ROOT / "CMakeLists.txt").read_text()
    used = set(re.findall(r"(?:find_package|pkg_check_modules)\((\w+?)3? ", cmake)) - BUILD_TOOLS
    assert used == {"ODE", "Eigen", "doctest"}
    for name in [*used, "MeshCat", "three.js"]:
        assert name in NOTICE, name
    assert "Russell L. Smith" in NOTICE
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["license-files"] == ["LICENSE", "NOTICE"]
    assert (ROOT / "SECURITY.md").is_file()

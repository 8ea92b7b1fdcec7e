# SPDX-License-Identifier: BSD-3-Clause
"""Wheel and conda recipe: what they declare is what the project declares, and CI builds and tries the wheel."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import yaml
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
RECIPE: dict[str, Any] = yaml.safe_load((ROOT / "packaging/conda/recipe.yaml").read_text())
CONDA_NAMES = {"meshcat": "meshcat-python", "matplotlib": "matplotlib-base", "moocore": "python-moocore"}


def test_the_recipe_has_the_projects_version_and_what_it_needs() -> None:
    assert RECIPE["context"]["version"] == PROJECT["version"]
    assert f">={RECIPE['context']['python_min']}" == PROJECT["requires-python"]
    declared = {
        f"{CONDA_NAMES.get(one.name, one.name)} {one.specifier}" for one in map(Requirement, PROJECT["dependencies"])
    }
    assert set(RECIPE["requirements"]["run"]) == {"python >=${{ python_min }}", *declared}
    building = tomllib.loads((ROOT / "pyproject.toml").read_text())["build-system"]["requires"]
    assert {one.replace(">=", " >=") for one in building} <= set(RECIPE["requirements"]["host"])


def test_wheel_and_recipe_have_the_same_ode() -> None:
    cmake = (ROOT / "packaging/ode/CMakeLists.txt").read_text()
    (version,), (sha256,) = re.findall(r"set\(version (\S+)\)", cmake), re.findall(r"set\(sha256 (\w{64})\)", cmake)
    archive = RECIPE["source"][1]
    assert (RECIPE["context"]["ode"], archive["sha256"]) == (version, sha256)
    there = [url.replace("${{ ode }}", "${version}") for url in archive["url"]]
    assert re.findall(r"https?://\S+\.tar\.gz", cmake) == there
    assert "-DCMAKE_BUILD_TYPE=Debug" in cmake  # else ODE's own CMake files switch its assertions off


def test_ci_builds_the_wheel_and_tries_it() -> None:
    ci, makefile = (ROOT / ".ci" / "run").read_text(), (ROOT / "Makefile").read_text()
    assert re.search(r"^make .*\btest-wheel\b", ci, re.MULTILINE)
    assert re.search(r"^test-wheel: wheel ", makefile, re.MULTILINE)
    check = (ROOT / "packaging/manylinux/check").read_text()
    for line in ('"$own" doctor', '"$own" verify system', 'evolve "$own" quick', '"$bin/swarmevo" verify own'):
        assert line in check


def test_the_wheel_of_swarmevo_rivals_is_built_beside_it_and_tried_with_it() -> None:
    """What best.yaml needs: without it the README's result cannot be made."""
    build, makefile = (ROOT / "packaging/manylinux/build").read_text(), (ROOT / "Makefile").read_text()
    assert re.search(r'pip" wheel .* -w "\$dist" "\$root/plugins/swarmevo_rivals"$', build, re.MULTILINE)
    assert re.search(r"^\tpackaging/manylinux/check .* dist/\*\.whl$", makefile, re.MULTILINE)
    check = (ROOT / "packaging/manylinux/check").read_text()
    for line in ('"${wheels[@]}"', 'evolve "$own" best own-best', '"$bin/swarmevo" verify own-best'):
        assert line in check

# SPDX-License-Identifier: BSD-3-Clause
"""The template is a distribution of its own: it installs, is found, passes its tests and knows little of swarmevo."""

from __future__ import annotations

import ast
import importlib.metadata
import shutil
import sys
from pathlib import Path

import pytest

from authors import BUILD_PRODUCTS, install, python

TEMPLATE = Path(__file__).parents[2] / "plugins" / "template"


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    """A copy of the template, as an author would make it."""
    return shutil.copytree(TEMPLATE, tmp_path_factory.mktemp("author") / "template", ignore=BUILD_PRODUCTS)


@pytest.fixture(scope="module")
def installed(copied, tmp_path_factory):
    """A folder into which the template is installed, without the network."""
    return install(copied, tmp_path_factory.mktemp("installed"))


def test_installs_one_module_with_one_entry_point(installed):
    (distribution,) = importlib.metadata.distributions(path=[str(installed)])
    (entry_point,) = distribution.entry_points
    assert distribution.metadata["Name"] == "swarmevo-hill-climber"
    assert (entry_point.group, entry_point.name) == ("swarmevo.optimisers", "hill_climber")
    assert (installed / "swarmevo_hill_climber.py").is_file()


def test_is_found_and_loaded_through_its_entry_point(installed):
    script = (
        "from importlib.metadata import entry_points; "
        "(found,) = entry_points(group='swarmevo.optimisers', name='hill_climber'); "
        "print(found.dist.name, found.load().__module__)"
    )
    done = python("-c", script, path=installed, cwd=installed)
    assert done.stdout.split() == ["swarmevo-hill-climber", "swarmevo_hill_climber"], done.stderr


def test_swarmevo_lists_it(installed):
    done = python("-m", "swarmevo", "plugins", path=installed, cwd=installed)
    assert done.returncode == 0, done.stderr
    assert "hill_climber" in done.stdout
    assert "swarmevo-hill-climber" in done.stdout


def test_swarmevo_evolves_with_it(installed, tmp_path):
    run = tmp_path / "run"
    settings = ["episode.horizon=2.0", "evolution.generations=3", "evolution.population=4", "evolution.repeats=1"]
    command = ["evolve", "--plugin", "hill_climber", "--seed", "1", "--out", run]
    options = ["--set", "optimiser.hill_climber.spread=0.2", *settings]
    done = python("-m", "swarmevo", *command, *options, path=installed, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    shown = python("-m", "swarmevo", "show", run, "--json", path=installed, cwd=tmp_path)
    assert shown.returncode == 0, shown.stderr
    assert "box_pushing" in shown.stdout


def test_its_own_tests_pass(installed, copied):
    done = python("-m", "pytest", "-q", "-p", "no:cacheprovider", copied / "tests", path=installed, cwd=copied)
    assert done.returncode == 0, done.stdout + done.stderr


def test_imports_nothing_but_numpy_and_the_protocols():
    imported = set()
    for file in (TEMPLATE / "src").glob("**/*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Import):
                imported |= {alias.name for alias in node.names}
            if isinstance(node, ast.ImportFrom):
                imported.add(node.module)
    assert imported - sys.stdlib_module_names - {"collections.abc"} == {"numpy", "swarmevo.protocols"}

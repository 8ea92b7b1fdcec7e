# SPDX-License-Identifier: BSD-3-Clause
"""The program as a whole: help, version, wrong usage, arguments that several verbs have."""

from __future__ import annotations

import pkgutil
import subprocess
import sys
from importlib import metadata

import pytest

import swarmevo
from cli.conftest import Swarmevo
from swarmevo import cli


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys\nfrom swarmevo.cli import main\n"
        "try: main(['--help'])\n"
        "finally: print(*(set('numpy pydantic moocore cffi yaml matplotlib rich'.split()) & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "evolve" in done.stdout
    assert done.stdout.splitlines()[-1] == ""


def test_every_module_but_common_is_a_verb() -> None:
    modules = {module.name for module in pkgutil.iter_modules(cli.__path__)}
    assert modules - {"common"} == set(cli.VERBS)


def test_version(swarmevo_: Swarmevo) -> None:
    assert swarmevo_("--version").out == f"swarmevo {swarmevo.__version__}\n"
    assert swarmevo.__version__ == metadata.version("swarmevo")


@pytest.mark.parametrize(
    "arguments",
    [
        ["evolv"],
        ["evolve", "--sed", "1"],
        ["evolve", "--seed", "x"],
        ["show"],
        ["show", "nowhere"],
        ["resume", "nowhere"],
    ],
)
def test_wrong_usage(swarmevo_: Swarmevo, arguments: list[str]) -> None:
    done = swarmevo_(*arguments)
    assert done.code == 2
    assert done.out == ""
    assert done.err


def test_module_and_script_are_the_same() -> None:
    done = subprocess.run([sys.executable, "-m", "swarmevo", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"swarmevo {swarmevo.__version__}\n"


@pytest.mark.parametrize("workers", ["0", "-1", "many", "1.5", "10000"])
def test_wrong_workers(swarmevo_: Swarmevo, workers: str) -> None:
    done = swarmevo_("evolve", "small.yaml", f"--workers={workers}")
    assert done.code == 2
    assert done.errors == [f"--workers: expected auto or a whole number from 1 to 9999, got {workers!r}"]

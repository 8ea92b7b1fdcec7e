# SPDX-License-Identifier: BSD-3-Clause
"""Fixtures that several test files share."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Callable, Mapping
from pathlib import Path

import hypothesis
import pytest

hypothesis.settings.register_profile("untimed", deadline=None)  # how long an example takes is the machine's business
hypothesis.settings.load_profile("untimed")

Distribution = Callable[..., Path]

SLOWEST = (
    *("evolution/test_zoo.py", "rivals/test_cma.py", "repository/test_validation.py", "views/test_replay.py"),
    *("views/test_report.py", "repository/test_bit_flips.py", "views/test_report_page.py", "rivals/test_pareto.py"),
    "paper/test_pde.py",
)
"""Files of one to four minutes, the slowest first."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the slowest files, so that no process is left alone with one of them at the end."""
    rank = {Path(__file__).parent / file: i for i, file in enumerate(SLOWEST)}
    items.sort(key=lambda item: rank.get(item.path, len(rank)))


@pytest.fixture
def distribution(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Distribution:
    """Return a function that installs a distribution for the length of a test; see :func:`installer`."""
    return installer(tmp_path, monkeypatch)


def installer(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Distribution:
    """Return a function that installs a distribution, as pip would, until ``monkeypatch`` is undone.

    ``distribution(name, version, {group: {plugin: target}}, **modules)`` writes each module's source beside the
    metadata into ``folder`` and puts that on the path.
    """

    def install(name: str, version: str, groups: Mapping[str, Mapping[str, str]], **modules: str) -> Path:
        site = folder / "site-packages" / name
        info = site / f"{name.replace('-', '_')}-{version}.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
        lines = [
            f"[{group}]\n" + "".join(f"{plugin} = {target}\n" for plugin, target in plugins.items())
            for group, plugins in groups.items()
        ]
        (info / "entry_points.txt").write_text("\n".join(lines))
        for module, source in modules.items():
            (site / f"{module}.py").write_text(textwrap.dedent(source))
            monkeypatch.delitem(sys.modules, module, raising=False)  # of a test before, which called it the same
        monkeypatch.syspath_prepend(str(site))
        return site

    return install

# SPDX-License-Identifier: BSD-3-Clause
"""How the docs are built: what lies beside them is linked, and what the interface shows can be read."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
INDEX = """\
# Index

[back](../README.md), [there](../README.md#two-commands), [steps](../examples/first_steps.ipynb),
[ours](../CONTRIBUTING.md)

```{toctree}
readme
first_steps
```

```{eval-rst}
.. autofunction:: swarmevo.evolve
```
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build a few pages as ``make docs`` does; return where they are."""
    pytest.importorskip("myst_nb")
    folder = tmp_path_factory.mktemp("checkout")
    (folder / "docs").mkdir()
    (folder / "examples").mkdir()
    for file in ("CONTRIBUTING.md", "docs/conf.py", "docs/readme.md", "examples/first_steps.ipynb"):
        shutil.copy(ROOT / file, folder / file)
    (folder / "docs" / "first_steps.ipynb").symlink_to("../examples/first_steps.ipynb")
    (folder / "docs" / "index.md").write_text(INDEX)
    (folder / "README.md").write_text("# All\n\n## Two commands\n\n[in](docs/index.md), [out](CONTRIBUTING.md)\n")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "docs", "pages"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return folder / "pages"


def links(page: Path) -> dict[str, str]:
    """Return where the links of a page lead, by their words."""
    found = re.findall(r'<a class="[^"]*reference[^"]*" href="([^"]*)">(?:<span[^>]*>)?(\w+)<', page.read_text())
    return {words: link for link, words in found}


def test_what_is_a_page_is_linked_as_one(built: Path) -> None:
    there = links(built / "index.html")
    assert there["back"] == "readme.html"
    assert there["there"] == "readme.html#two-commands"
    assert 'id="two-commands"' in (built / "readme.html").read_text()
    assert there["steps"] == "first_steps.html"
    assert there["ours"] == "repository/CONTRIBUTING.md.txt"
    assert (built / there["ours"]).read_text() == (ROOT / "CONTRIBUTING.md").read_text()


def test_the_page_of_the_readme_leads_where_it_does(built: Path) -> None:
    there = links(built / "readme.html")
    assert (there["in"], there["out"]) == ("index.html", "repository/CONTRIBUTING.md.txt")


def test_the_notebook_is_a_page(built: Path) -> None:
    page = re.sub("<[^>]*>", "", (built / "first_steps.html").read_text())
    assert "First steps" in page
    assert "best.replay(seed=7, robots=3)" in page


def test_a_function_as_a_default_is_shown_as_it_is_written(built: Path) -> None:
    (signature,) = re.findall(
        r'<dt class="sig[^"]*" id="swarmevo.evolve">(.*?)</dt>', (built / "index.html").read_text(), re.S
    )
    shown = re.sub("<[^>]*>", "", signature)
    assert "observe=lambda now: ..., stop=never)" in shown


def test_the_footer_says_whose_it_is(built: Path) -> None:
    said = re.sub(r"\s+", " ", (built / "index.html").read_text())
    assert "Copyright &#169; 2026, the swarmevo developers, BSD-3-Clause" in said

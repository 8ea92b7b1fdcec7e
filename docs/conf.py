# SPDX-License-Identifier: BSD-3-Clause
"""How Sphinx builds these pages: ``make docs``."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.transforms.post_transforms import SphinxPostTransform
from sphinx.util.osutil import relative_uri

from swarmevo import __version__

ROOT = Path(__file__).resolve().parents[1]
PAGES = {ROOT / "README.md": "readme", ROOT / "examples" / "first_steps.ipynb": "first_steps"}
"""Files beside docs/ that are pages here, too."""

project = "swarmevo"
author = "The swarmevo developers"
copyright = "2026, the swarmevo developers, BSD-3-Clause"
release = __version__
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True  # as they are written: of a function Python shows where it lies
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
html_theme = "furo"
myst_enable_extensions = ["deflist"]
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_execution_excludepatterns = ["first_steps.ipynb"]  # it takes minutes, and tests run it
myst_heading_anchors = 3  # so that pages can link to headings, as on GitHub


class LinksOutOfTheDocs(SphinxPostTransform):
    """Makes a link to a file or folder beside docs/ one to its page, or to a copy of its text.

    For these pages may stand alone.
    """

    default_priority = 8  # before MyST gives them up

    def run(self, **kwargs: Any) -> None:
        """Replace them."""
        for node in list(self.document.findall(addnodes.pending_xref)):
            if node["reftype"] == "myst" and (target := self._beside_docs(node)):
                there = self.app.builder.get_target_uri(PAGES[target]) if target in PAGES else self._copy(target)
                uri = relative_uri(self.app.builder.get_target_uri(self.env.docname), there)
                if target in PAGES and node["reftargetid"]:
                    uri += f"#{node['reftargetid']}"
                node.replace_self(nodes.reference("", "", *node.children, internal=False, refuri=uri))

    def _beside_docs(self, node: addnodes.pending_xref) -> Path | None:
        """Return the file or folder; MyST leaves out the suffix of a page."""
        named = Path(self.env.doc2path(self.env.docname)).parent / str(node["reftarget"]).partition("#")[0]
        for suffix in ("", ".md", ".ipynb"):
            target = Path(f"{named}{suffix}").resolve()
            if target.exists() and target.is_relative_to(ROOT) and not target.is_relative_to(ROOT / "docs"):
                return target
        return None

    def _copy(self, target: Path) -> str:
        """Write the text of a file, or the names in a folder, beside the pages; return where."""
        place = Path("repository", *target.relative_to(ROOT).parts[:-1], f"{target.name}.txt")
        text = target.read_text() if target.is_file() else "\n".join(sorted(each.name for each in target.iterdir()))
        copy = Path(self.app.outdir, place)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text(text)
        return place.as_posix()


def read_readme(app: Any, docname: str, source: list[str]) -> None:
    """Give the page of the README its text, with links from this folder."""
    if docname == "readme":
        links = re.sub(r"(?<=\]\()(?!https?:|#)", "../", (ROOT / "README.md").read_text())
        source[0] = links.replace("](../docs/", "](")


def setup(app: Any) -> None:
    """Register what is above."""
    app.connect("source-read", read_readme)
    app.add_post_transform(LinksOutOfTheDocs)

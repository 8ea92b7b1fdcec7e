# SPDX-License-Identifier: BSD-3-Clause
"""How Sphinx builds these pages: ``make docs``."""

from swarmevo import __version__

project = "swarmevo"
author = "The swarmevo developers"
release = __version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
html_theme = "furo"
myst_heading_anchors = 3  # so that pages can link to headings, as on GitHub
suppress_warnings = ["myst.xref_missing"]  # links that leave docs/ lead somewhere in the repository; a test follows all

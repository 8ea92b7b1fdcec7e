# SPDX-License-Identifier: BSD-3-Clause
"""Pages from templates: whatever is put into one is escaped, unless a function here has made it safe for its place.

A template's name is ``FOLDER/FILE``: of ``templates/`` in this package (``shared``), in ``report`` or in ``replay``.
Every template can call :mod:`swarmevo.views.text`.
"""

from __future__ import annotations

import importlib.resources
import re
from functools import cache
from typing import Any, Final

import jinja2
from markupsafe import Markup

from swarmevo.views import text

PACKAGES: Final = {
    "shared": "swarmevo.views",
    "compare": "swarmevo.views.compare",
    "sweep": "swarmevo.views.sweep",
    "dashboard": "swarmevo.views.dashboard",
    "report": "swarmevo.views.report",
    "replay": "swarmevo.views.replay",
}
"""Where the templates of a folder are."""

_END_TAG: Final = re.compile(r"<(?=/(?:script|style)\b)", re.IGNORECASE)


def render(template: str, **values: Any) -> str:
    """Return a template as a page.

    Args:
        template: ``FOLDER/FILE``.
        values: All that it names, at least.
    """
    return _environment().get_template(template).render(values)


@cache
def _environment() -> jinja2.Environment:
    folders = {folder: jinja2.FunctionLoader(_template(package)) for folder, package in PACKAGES.items()}
    environment = jinja2.Environment(
        loader=jinja2.PrefixLoader(folders),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.globals["text"] = text
    environment.policies["json.dumps_kwargs"] = {"separators": (",", ":"), "allow_nan": False}  # of ``tojson``
    return environment


def _template(package: str) -> Any:
    """Return a function that reads templates of a package, as its installation has them."""
    return lambda name: _read(package, "templates", name)


def _read(package: str, *path: str) -> str:
    return importlib.resources.files(package).joinpath(*path).read_text(encoding="utf-8")


# ---- what is not escaped ---------------------------------------------------------------------------------------------


def asset(package: str, name: str) -> Markup:
    """Return a script or a style sheet of ours, out of a package's ``assets/``."""
    return script(_read(package, "assets", name))


def script(source: str) -> Markup:
    """Return a script or a style sheet that we trust, for its element; no end tag in it can end that."""
    return Markup(_END_TAG.sub(r"<\\", source))


def comment(said: str) -> Markup:
    """Return text for a comment of a page, which nothing in it can end."""
    return Markup(re.sub("-(?=-)", "- ", said))


def drawing(svg: str) -> Markup:
    """Return SVG that matplotlib has drawn; it has escaped the text in it."""
    return Markup(svg)

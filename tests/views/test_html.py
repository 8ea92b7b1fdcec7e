# SPDX-License-Identifier: BSD-3-Clause
"""Templates: what is put into a page is escaped, and no markup is written in Python."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path

import jinja2
import pytest

import swarmevo
from swarmevo.views import html
from swarmevo.views.replay import page as replay_page

PACKAGE = Path(swarmevo.__file__).parent
EVIL = "</script><script>alert('&')</script>"


def test_text_and_data_are_escaped() -> None:
    page = html.render(
        "replay/page.html.jinja",
        title=EVIL,
        player=replay_page.player(),
        episodes=[{"title": EVIL}],
        live=False,
        script="",
    )
    assert EVIL not in page
    assert "<title>&lt;/script&gt;" in page
    (data,) = re.findall(r'<script type="application/json" id="episodes">(.*?)</script>', page)
    assert json.loads(data) == [{"title": EVIL}]


def test_what_a_template_misses_is_an_error() -> None:
    with pytest.raises(jinja2.UndefinedError):
        html.render("replay/page.html.jinja", player=replay_page.player())


@pytest.mark.parametrize("end", ["</script", "</SCRIPT", "</style"])
def test_a_script_cannot_end_its_element(end: str) -> None:
    assert html.script(f'a = "{end}>"; b = 1 < 2 / 3;') == f'a = "<\\{end[1:]}>"; b = 1 < 2 / 3;'


def test_a_comment_cannot_be_ended() -> None:
    assert "--" not in html.comment("a --> b --!> c <!-- d ---->")


def test_templates_trust_nothing() -> None:
    """What is not escaped was marked in html.py."""
    templates = sorted(PACKAGE.glob("views/**/*.jinja"))
    assert len(templates) >= 5
    for template in templates:
        assert not re.search(r"\|\s*safe|autoescape|Markup", template.read_text()), template


def test_no_markup_is_written_in_python() -> None:
    markup = re.compile(
        r"</|<(?:a|article|code|dd|div|dl|dt|figure|h\d|i|nav|p|pre|script|section|span|table|td|th|tr)[ >]"
    )
    for file in sorted(PACKAGE.rglob("*.py")):
        texts = [node.value for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.Constant)]
        found = [text for text in texts if isinstance(text, str) and markup.search(text)]
        assert not found, file

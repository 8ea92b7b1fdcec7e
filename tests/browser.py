# SPDX-License-Identifier: BSD-3-Clause
"""A real Chromium for tests of pages: Debian's, driven by playwright, without a network and without a GPU."""

from __future__ import annotations

import io
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

PATIENCE = 120e3
"""For how long a page may take [ms]: where other work has the cores, more than half a minute."""
# As root Chromium has no sandbox; without a GPU it draws WebGL by SwiftShader.
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


@contextmanager
def chromium() -> Iterator[Browser]:
    """Start Debian's Chromium; skip the test where there is none."""
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    if program is None:
        pytest.skip("needs Chromium: apt-get install chromium")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program, args=FLAGS)
        try:
            yield browser
        finally:
            browser.close()


class Watched:
    """A page, and what it said and asked for."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.errors: list[str] = []
        """Console errors and warnings, and uncaught exceptions."""
        self.requests: list[str] = []
        """Addresses other than the page's own and data within it."""
        page.on("console", lambda message: message.type == "error" and self.errors.append(message.text))
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("request", lambda request: self.requests.append(request.url))

    def open(self, file: Path) -> Page:
        """Open a file and wait until it is loaded."""
        self.page.goto(file.as_uri())
        self.requests = [
            url for url in self.requests if url != file.as_uri() and not url.startswith(("data:", "blob:"))
        ]
        return self.page


@contextmanager
def watch(
    browser: Browser, width: int = 1280, height: int = 760, dark: bool = False, has_touch: bool = False
) -> Iterator[Watched]:
    """Give a new page of an offline browser."""
    context = browser.new_context(
        viewport={"width": width, "height": height},
        color_scheme="dark" if dark else "light",
        offline=True,
        has_touch=has_touch,
        is_mobile=has_touch,
    )
    context.set_default_timeout(PATIENCE)
    try:
        yield Watched(context.new_page())
    finally:
        context.close()


def swipe(page: Page, start: tuple[float, float], way: tuple[float, float]) -> None:
    """Draw a finger over a page that has touch."""
    session = page.context.new_cdp_session(page)
    for step in range(11):
        point = {"x": start[0] + way[0] * step / 10, "y": start[1] + way[1] * step / 10}
        kind = "touchMove" if step else "touchStart"
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [point]})
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})


def keep(page: Page, name: str) -> None:
    """Keep a screenshot in the folder ``SWARMEVO_ARTEFACTS``, if that is set."""
    if folder := os.environ.get("SWARMEVO_ARTEFACTS"):
        Path(folder).mkdir(parents=True, exist_ok=True)
        page.screenshot(path=Path(folder) / f"{name}.png")


def pixels(screenshot: bytes) -> NDArray[np.uint8]:
    """Return a screenshot as ``(height, width, 3)``."""
    return np.asarray(Image.open(io.BytesIO(screenshot)).convert("RGB"))

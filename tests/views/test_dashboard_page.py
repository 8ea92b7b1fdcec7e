# SPDX-License-Identifier: BSD-3-Clause
"""The dashboard in a real Chromium, while a real run is evolved, killed and resumed."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page

import small_runs
from browser import PATIENCE, chromium, keep
from dashboards import serving
from swarmevo.runs.store import Store
from swarmevo.views.dashboard import server
from swarmevo.views.dashboard.watch import Watch

STORED = "+document.querySelector('[data-done]').textContent.split(' ')[0]"  # generations


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as browser:
        yield browser


class Seen:
    """A page of the dashboard, and what it said and asked for."""

    def __init__(
        self, browser: Browser, width: int, port: int, bypass_csp: bool = False, is_still: bool = False
    ) -> None:
        self.home = f"http://127.0.0.1:{port}/"
        size = {"width": width, "height": 900}
        motion: Literal["reduce", "no-preference"] = "reduce" if is_still else "no-preference"
        self.context = browser.new_context(viewport=size, reduced_motion=motion, bypass_csp=bypass_csp)
        self.context.set_default_timeout(PATIENCE)
        self.page = self.context.new_page()
        self.errors: list[str] = []
        self.foreign: list[str] = []
        self.page.on("console", lambda message: message.type == "error" and self.errors.append(message.text))
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda request: self._note(request.url))

    def _note(self, url: str) -> None:
        if not url.startswith((self.home, "data:", "blob:")):
            self.foreign.append(url)

    def __enter__(self) -> Page:
        self.page.goto(self.home)
        return self.page

    def __exit__(self, *error: object) -> None:
        self.context.close()
        if error[0] is None:
            assert (self.errors, self.foreign) == ([], [])


def evolving(folder: Path, verb: str, *arguments: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "swarmevo", verb, *arguments, "--workers", "1"]
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def test_a_run_is_watched_while_it_is_killed_and_resumed(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = [one for one in small_runs.SMALL if not one.startswith(("evolution.trials", "evolution.generations"))]
    settings += ["evolution.trials=1", "evolution.generations=100000"]
    with serving(Watch(tmp_path), monkeypatch) as port, Seen(browser, 1440, port) as page:
        page.wait_for_selector("text=There is no run in")
        process = evolving(tmp_path, "evolve", "quick", "--out", "live", "--set", *settings)
        try:
            page.wait_for_selector("[data-state].running")
            page.wait_for_function(f"{STORED} >= 3")
            page.locator(".point").last.focus()
            page.keyboard.press("Enter")
            page.wait_for_function("swarmevoDashboard.run().player?.playing")
            title, before = page.inner_text(".sw-title"), page.evaluate(STORED)
            assert title.startswith(page.inner_text("[data-title]"))
            assert not page.is_visible(".sw-warning")  # it is the stored episode to the last bit
            page.wait_for_function(f"{STORED} > {before} + 3")
            keep(page, "dashboard-running")
            page.evaluate("swarmevoDashboard.run().player.pause()")  # what is drawn without a GPU takes a core
        finally:
            process.send_signal(signal.SIGKILL)
            process.wait()
        page.wait_for_selector("[data-state].killed")
        assert "ended without a word; go on with: swarmevo resume " in page.inner_text("[data-said]")
        with Store.open(tmp_path / "live") as store:
            stored = store.generations(0)
        page.wait_for_function(f"{STORED} === {stored}")

        process = evolving(tmp_path, "resume", "live", "--generations", str(stored + 20))
        try:
            page.wait_for_selector("[data-state].finished")
        finally:
            process.kill()
            process.wait()
        assert page.evaluate(STORED) == stored + 20
        assert page.title().startswith("100% live")
        assert page.inner_text(".sw-title") == title  # what was chosen plays on
        with Store.open(tmp_path / "live") as store:
            genomes = {int(one) for one in store.individuals(0).genome}
        drawn = page.evaluate("swarmevoDashboard.run().run.points.map((point) => point.genome)")
        assert set(drawn) <= genomes


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dashboard")
    small_runs.make(folder / "a <b>run")
    (folder / "broken").mkdir()
    (folder / "broken" / "run.sqlite").write_text("no database")
    return folder


def test_a_phone_shows_the_list_then_the_run(browser: Browser, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with serving(Watch(place), monkeypatch) as port, Seen(browser, 390, port) as page:
        page.wait_for_selector(".runs .broken")
        assert page.inner_text(".runs .said:visible") == f"{place}/broken/run.sqlite: is damaged, or no run of swarmevo"
        assert not page.is_visible("main")
        page.keyboard.press("Tab")  # to the link that skips the list
        page.keyboard.press("Tab")
        page.keyboard.press("Enter")
        page.wait_for_selector("[data-name]:text-is('a <b>run')")
        page.wait_for_selector(".point")
        assert page.evaluate("document.documentElement.scrollWidth") == 390
        page.click("text=All runs")
        page.wait_for_selector("main", state="hidden")


def test_a_run_that_vanishes_and_a_server_that_ends_are_told(
    browser: Browser, place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(place / "a <b>run", tmp_path / "runs" / "run")
    monkeypatch.setattr(server, "PERIOD", 0.02)
    seen = None
    with serving(Watch(tmp_path / "runs"), monkeypatch) as port:
        seen = Seen(browser, 1024, port)
        seen.page.goto(seen.home)
        seen.page.wait_for_selector(".point")
        address = seen.page.get_attribute(".runs a", "href")
        seen.page.goto(f"{seen.home}{address}")
        shutil.rmtree(tmp_path / "runs" / "run")
        seen.page.wait_for_selector("text=This run is gone")
        assert not seen.page.is_visible("[data-run]")
        assert seen.page.locator(".runs a").count() == 0
    seen.page.wait_for_selector("[data-lost]:not([hidden])")
    assert "The dashboard's server has ended" in seen.page.inner_text("[data-lost]")
    seen.context.close()


def test_axe_finds_nothing_serious(browser: Browser, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with serving(Watch(place), monkeypatch) as port, Seen(browser, 1440, port, bypass_csp=True) as page:
        page.locator(".point").last.focus()
        page.keyboard.press("Enter")
        page.wait_for_function("swarmevoDashboard.run().player?.playing")
        page.evaluate("swarmevoDashboard.run().player.pause()")
        schemes: tuple[Literal["light", "dark"], ...] = ("light", "dark")
        for scheme in schemes:
            page.emulate_media(color_scheme=scheme)
            found = Axe().run(page).response["violations"]
            assert [(one["id"], one["nodes"]) for one in found if one["impact"] in ("serious", "critical")] == []


def test_who_comes_to_a_point_by_keyboard_does_not_lose_it(
    browser: Browser, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As with a pointer the chart stands still for a while; where the point has gone then, its neighbour is focused."""
    leave = """() => {
        const shown = swarmevoDashboard.run(), run = structuredClone(shown.run);
        run.points = run.points.slice(0, -1);
        shown.update(run);
        return document.querySelectorAll('.point').length;
    }"""
    with serving(Watch(place), monkeypatch) as port, Seen(browser, 1440, port) as page:
        points = page.locator(".point")
        points.first.wait_for()
        number = points.count()
        assert number > 1
        points.last.focus()
        assert page.evaluate(leave) == number
        page.wait_for_function(f"document.querySelectorAll('.point').length === {number - 1}")
        page.wait_for_function("document.activeElement.classList.contains('point')")


def test_the_line_is_explained_where_there_is_one_and_the_title_has_no_gap(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    small_runs.make(tmp_path / "two")
    small_runs.make(tmp_path / "one", "fitness=box_pushing")
    with serving(Watch(tmp_path), monkeypatch) as port, Seen(browser, 1440, port) as page:
        for name, lines in (("one", 0), ("two", 1)):
            page.click(f".runs a:has-text('{name}')")
            page.wait_for_selector(f"[data-name]:text-is('{name}')")
            page.wait_for_selector(".point")
            assert page.locator("path.front").count() == lines
            assert ("The line is the global front" in page.inner_text("section[aria-label='Pareto front']")) == bool(
                lines
            )
        page.locator(".point").last.focus()
        page.keyboard.press("Enter")
        page.wait_for_selector(".sw-title h2")
        assert page.locator(".sw-title h2").evaluate("(title) => getComputedStyle(title).marginTop") == "0px"


def test_another_repeat_is_played(browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    small_runs.make(tmp_path / "run", "evolution.repeats=3")
    with serving(Watch(tmp_path), monkeypatch) as port, Seen(browser, 1440, port) as page:
        page.locator(".point").last.focus()
        page.keyboard.press("Enter")
        page.wait_for_function("swarmevoDashboard.run().player?.playing")
        label = page.inner_text("[data-repeats] span")
        assert label.startswith("Episode of generation ")
        assert page.locator("[data-repeats] option").all_inner_texts() == [f"{k}, not pushed" for k in range(3)]
        page.get_by_label(label).select_option("2, not pushed")
        page.wait_for_function("document.querySelector('.sw-title p').textContent.endsWith('repeat 2')")
        assert not page.is_visible(".sw-warning")  # it is the stored episode to the last bit
        keep(page, "dashboard-repeats")


def test_who_wants_no_motion_has_none_unasked(browser: Browser, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with serving(Watch(place), monkeypatch) as port, Seen(browser, 1440, port, is_still=True) as page:
        page.locator(".point").last.focus()
        page.keyboard.press("Enter")
        page.wait_for_function("swarmevoDashboard.run().player")
        assert page.evaluate("swarmevoDashboard.run().player.playing") is False
        page.get_by_role("button", name="play").click()
        assert page.evaluate("swarmevoDashboard.run().player.playing") is True


def test_a_configuration_is_shown_as_text(browser: Browser, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with serving(Watch(place), monkeypatch) as port, Seen(browser, 1440, port) as page:
        page.click("[data-config] summary")
        page.wait_for_selector("[data-config] pre:has-text('evolution:')")
        assert page.inner_text("[data-config] pre") == (place / "a <b>run" / "config.yaml").read_text()

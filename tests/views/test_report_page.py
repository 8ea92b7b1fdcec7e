# SPDX-License-Identifier: BSD-3-Clause
"""How a report reads: its first screen, keys and wheel, two controllers at once, links, print, and for everybody."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, TimeoutError

import browser as browsers
import small_runs
from swarmevo.analysis import assessment, fronts
from swarmevo.analysis.following import Following
from swarmevo.runs.store import Store
from swarmevo.views.dashboard import facts as dashboard_facts
from swarmevo.views.report import page as report


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = small_runs.make(tmp_path_factory.mktemp("runs") / "run", "episode.horizon=4")
    with Store.open(folder) as store:
        assessment.assess(store, (1, 3), 2, robustness=True, workers=1)
    return folder


@pytest.fixture(scope="module")
def file(run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return report.write([run], tmp_path_factory.mktemp("report") / "report.html")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with browsers.chromium() as started:
        yield started


@pytest.fixture(scope="module")
def opened(browser: Browser, file: Path) -> Iterator[Page]:
    with browsers.watch(browser, 1280, 820) as watched:
        yield watched.open(file)
        assert watched.errors == []
        assert watched.requests == []


@pytest.fixture
def page(opened: Page) -> Page:
    opened.evaluate(
        "scrollTo(0, 0); document.activeElement.blur();"
        "swarmevoReport[0].choose(swarmevoReport[0].run.opened, false); swarmevoReport[0].player.seek(2)"
    )
    return opened


@pytest.mark.parametrize(("width", "height"), [(1440, 900), (1024, 768), (390, 844)])
def test_scene_and_controls_are_on_the_first_screen(browser: Browser, file: Path, width: int, height: int) -> None:
    with browsers.watch(browser, width, height) as watched:
        page = watched.open(file)
        opens = page.evaluate("swarmevoReport[0].run.points[swarmevoReport[0].run.opened].genome")
        assert page.locator(".sw-title h2").inner_text() == f"Individual {opens}"
        scene, play = page.locator(".sw-view").bounding_box(), page.locator(".sw-play").bounding_box()
        assert scene is not None
        assert play is not None
        assert scene["y"] >= 0
        assert scene["y"] + scene["height"] <= height
        assert scene["height"] >= 0.4 * height
        assert play["y"] + play["height"] <= height
        assert page.evaluate("document.documentElement.scrollWidth") == width
        browsers.keep(page, f"report-{width}")
        assert watched.errors == []


@pytest.fixture(scope="module")
def five(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the report of a team of five."""
    folder = small_runs.make(tmp_path_factory.mktemp("five") / "run", "team.robots=5")
    return report.write([folder], folder / "report.html")


@pytest.mark.parametrize(("width", "height"), [(1440, 900), (1024, 768), (390, 844)])
def test_all_rows_and_a_network_at_work_are_seen_and_no_panel_scrolls(
    browser: Browser, five: Path, width: int, height: int
) -> None:
    """On a phone the rows are further below, where the page scrolls to."""
    scrolls = "all => all.filter((one) => ['auto', 'scroll'].includes(getComputedStyle(one).overflowY)).length"
    with browsers.watch(browser, width, height) as watched:
        page = watched.open(five)
        controls = page.locator(".sw-transport").bounding_box()
        assert controls is not None
        page.evaluate("swarmevoReport[0].player.seek(1)")
        if width > 390:
            below = [row.bounding_box() for row in page.locator(".sw-robot").all()]
            assert len(below) == 5
            assert all(box is not None and box["y"] + box["height"] <= controls["y"] for box in below)
        page.get_by_text("show", exact=True).click()
        page.get_by_label("network at work").click()
        page.keyboard.press("Escape")
        network = page.locator(".sw-network svg").bounding_box()
        assert network is not None
        assert network["y"] + network["height"] <= controls["y"]
        assert page.locator(".sw-player, .sw-player *").evaluate_all(scrolls) == 0
        browsers.keep(page, f"report-network-{width}")
        assert watched.errors == []


@pytest.mark.parametrize("width", [1440, 1024, 390])
def test_a_network_can_be_read_and_has_something_beside_it(browser: Browser, file: Path, width: int) -> None:
    with browsers.watch(browser, width, 900) as watched:
        page = watched.open(file)
        wide, units = page.locator(".network svg").evaluate("(svg) => [svg.clientWidth, svg.viewBox.baseVal.width]")
        assert 8 * wide / units >= 9.5  # a letter's size, in pixels
        network, tiles = page.locator(".network").bounding_box(), page.locator(".tiles").bounding_box()
        assert network is not None
        assert tiles is not None
        assert (tiles["y"] == network["y"]) == (width > 390)


def test_it_opens_on_the_most_successful(run: Path, opened: Page) -> None:
    with Store.open(run) as store:
        summary = fronts.summarise(store)
    best = fronts.most_successful(summary.front, summary.measures)
    assert opened.evaluate("swarmevoReport[0].run.points[swarmevoReport[0].run.opened].genome") == best.genome
    tile = opened.locator(".tile").first.inner_text()
    assert f"individual {best.genome}, " in tile
    assert tile.startswith("box at the wall")
    assert f"Paths of individual {best.genome} " in opened.content()


def test_an_objective_has_one_name(run: Path, page: Page) -> None:
    """In the table, on the stage and its plot, in the tile, and in the dashboard's."""
    names = page.evaluate("swarmevoReport[0].run.objectives.map(({ name }) => name)")
    assert page.locator(".means tbody th").all_inner_texts()[: len(names)] == names
    assert page.locator(".sw-facts dt").all_inner_texts()[: len(names)] == names
    assert page.locator(".sw-plot-title").first.inner_text() == f"{names[0]} now"
    tile = f"best mean {names[0]}"
    assert tile in page.locator(".tile dt").all_inner_texts()
    following = Following(run)
    following.look()
    following.take(10**9)
    assert tile in [name for name, _, _ in dashboard_facts.detail("", "", following)["tiles"]]


def test_means_and_one_episode_s_values_have_their_names(page: Page) -> None:
    assert page.locator(".means caption").inner_text() == "Means over all its episodes"
    assert page.locator(".sw-heading").inner_text() == "in this episode"


def test_the_wheel_over_the_scene_scrolls_the_page(page: Page) -> None:
    box = page.locator(".sw-view").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 100, box["y"] + 200)
    page.mouse.wheel(0, 300)
    page.wait_for_function("scrollY > 100")


def test_a_finger_over_the_scene_scrolls_the_page_and_after_a_tap_turns_the_scene(browser: Browser, file: Path) -> None:
    camera = "swarmevoReport[0].player.stages[0].scene.camera"
    with browsers.watch(browser, 390, 700, has_touch=True) as watched:
        page = watched.open(file)
        box = page.locator(".sw-view").bounding_box()
        assert box is not None
        middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        browsers.swipe(page, middle, (20, -150))
        page.wait_for_function("scrollY > 60")
        assert page.evaluate(f"{camera}.turn") == 0
        assert page.locator(".sw-hint").text_content() == "Tap the scene to turn it and to zoom"
        browsers.keep(page, "report-touch")
        page = watched.open(file)  # a tap while a page still glides does nothing but stop it
        page.touchscreen.tap(*middle)
        page.wait_for_function(f"{camera}.isEntered")
        browsers.swipe(page, middle, (80, -100))
        page.wait_for_function(f"Math.abs({camera}.turn) > 0.1")
        assert page.evaluate("scrollY") == 0
        assert watched.errors == []


def test_space_plays_what_is_seen_and_else_scrolls(page: Page) -> None:
    playing = "swarmevoReport[0].player.playing"
    page.evaluate("document.activeElement.blur()")  # a player that has the focus takes Space wherever it is
    page.evaluate("addEventListener('keydown', (event) => (window.taken = event.defaultPrevented))")
    page.keyboard.press(" ")
    assert page.evaluate(playing)
    page.keyboard.press(" ")
    assert not page.evaluate(playing)
    assert page.evaluate("taken")
    page.evaluate("scrollTo(0, scrollY + document.querySelector('.columns').getBoundingClientRect().bottom + 10)")
    before = page.evaluate("scrollY")
    for _ in range(20):  # on a busy machine Chromium may scroll by none of the first ones after a script scrolled
        page.keyboard.press(" ")
        assert not page.evaluate(playing)
        assert not page.evaluate("taken")
        with contextlib.suppress(TimeoutError):
            page.wait_for_function(f"scrollY > {before}", timeout=5000)
            break
    assert page.evaluate("scrollY") > before


def test_space_on_the_chosen_point_plays_and_pauses(page: Page) -> None:
    point = page.locator(".point.chosen")
    for is_playing in (True, False):
        point.press(" ")
        assert page.evaluate("swarmevoReport[0].player.playing") is is_playing
    assert page.evaluate("swarmevoReport[0].player.time") >= 2  # it did not begin anew


def other(page: Page) -> int:
    """Return the number of a point that is not shown first."""
    opens = page.evaluate("swarmevoReport[0].run.opened")
    count = page.locator("[data-point]").count()
    return int(next(k for k in range(count) if k != opens))


@pytest.mark.parametrize("way", ["shift", "button"])
def test_two_controllers_stand_side_by_side(page: Page, way: str) -> None:
    second = other(page)
    if way == "button":
        page.locator(".together").click()
    page.locator(f"[data-point='{second}']").click(modifiers=["Shift"] if way == "shift" else [], force=True)
    shown = page.evaluate("swarmevoReport[0].shown.map((k) => `Individual ${swarmevoReport[0].run.points[k].genome}`)")
    assert len(set(shown)) == 2
    assert page.locator(".sw-title h2").all_inner_texts() == shown
    assert page.locator("[data-title]").all_inner_texts() == shown
    assert page.locator(".point.chosen").count() == 2
    browsers.keep(page, f"report-two-{way}")
    if way == "button":
        page.locator(".together").click()
        assert page.locator(".sw-title h2").count() == 1


def test_a_link_leads_to_who_was_shown_and_when(page: Page) -> None:
    first, second = page.evaluate("swarmevoReport[0].run.opened"), other(page)
    page.evaluate(f"swarmevoReport[0].choose({second}, false, true); swarmevoReport[0].player.seek(1.5)")
    page.get_by_role("button", name="copy a link").click()
    page.wait_for_function("location.hash.includes('t=1.5')")
    hash = page.evaluate("location.hash")
    page.evaluate(f"swarmevoReport[0].choose({second}, false); history.replaceState(null, '', '#')")
    page.evaluate(f"location.hash = {hash!r}")
    page.wait_for_function("swarmevoReport[0].player.time === 1.5")
    assert page.evaluate("swarmevoReport[0].shown") == [first, second]
    page.evaluate("history.replaceState(null, '', '#')")


def test_on_paper_all_is_open_and_the_scene_stands_still(page: Page) -> None:
    closed = page.locator("main details:not([open]):not(.sw-menu)").count()
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    still = page.locator(".still canvas")
    assert still.is_visible()
    assert browsers.pixels(still.screenshot()).std(axis=(0, 1)).min() > 10, "it is blank"
    assert "2.0 s" in page.locator(".still figcaption").inner_text()
    assert closed > 2
    assert page.locator("main details:not([open]):not(.sw-menu)").count() == 0
    assert page.locator(".stage").is_hidden()
    told = page.locator(".still .facts, .still p").all_inner_texts()
    episode = page.evaluate("swarmevoReport[0].player.stages[0].track.episode")
    for name, value in episode["facts"]:
        assert re.search(rf"{re.escape(name)}\s+{re.escape(value)}", told[0])
    came = sorted(time for time in episode["homing"] if time is not None)
    assert re.findall(r"robot \d at the source, (\S+) s", told[1]) == [f"{time:.1f}" for time in came]
    drawn, wide = page.locator("[data-chart] > svg").evaluate("(svg) => [svg.clientWidth, svg.viewBox.baseVal.width]")
    assert drawn <= wide  # its letters are no larger than on the screen
    bars = page.locator(".bar, .bar i")
    assert {bar.evaluate("(bar) => getComputedStyle(bar).printColorAdjust") for bar in bars.all()} == {"exact"}
    heads = page.locator("h2, h3, h2 + .note")
    assert {head.evaluate("(head) => getComputedStyle(head).breakAfter") for head in heads.all()} == {"avoid"}
    tables = page.locator(".scroll table")
    assert {table.evaluate("(t) => getComputedStyle(t).breakInside") for table in tables.all()} == {"avoid"}
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    page.emulate_media(media="screen")
    assert page.locator("main details:not([open]):not(.sw-menu)").count() == closed


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_serious(page: Page, scheme: str) -> None:
    page.emulate_media(color_scheme="dark" if scheme == "dark" else "light")
    page.evaluate("for (const details of document.querySelectorAll('details')) details.open = true")
    found = Axe().run(page).response["violations"]
    page.evaluate("for (const details of document.querySelectorAll('details')) details.open = false")
    page.emulate_media(color_scheme="light")
    serious = [(one["id"], one["nodes"][0]["html"]) for one in found if one["impact"] in ("serious", "critical")]
    assert serious == []


def test_axe_finds_nothing_in_a_page_of_several_runs(browser: Browser, run: Path, tmp_path: Path) -> None:
    with browsers.watch(browser) as watched:
        page = watched.open(report.write([run, run], tmp_path / "report.html"))
        page.evaluate("for (const details of document.querySelectorAll('details')) details.open = true")
        assert [(one["id"], one["nodes"]) for one in Axe().run(page).response["violations"]] == []


def test_axe_would_find_what_is_serious(browser: Browser) -> None:
    with browsers.watch(browser) as watched:
        watched.page.set_content("<main><button></button></main>")
        assert [one["id"] for one in Axe().run(watched.page).response["violations"] if one["impact"] == "critical"]


def test_every_figure_has_a_name(page: Page) -> None:
    nameless = page.evaluate(
        "[...document.querySelectorAll('svg, canvas')].filter((node) => !node.closest('[aria-label], [aria-hidden]')).map((node) => node.outerHTML.slice(0, 80))"  # noqa: E501
    )
    assert nameless == []


def test_wide_tables_scroll_by_keyboard(browser: Browser, file: Path) -> None:
    with browsers.watch(browser, 390, 844) as watched:
        page = watched.open(file)
        table = page.locator(".scroll").last
        page.evaluate("for (const details of document.querySelectorAll('details')) details.open = true")
        for table in page.locator(".scroll").all():
            assert table.get_attribute("aria-label")
        table = page.get_by_role("region", name="Tests by team size")
        table.focus()
        page.keyboard.press("ArrowRight")
        page.wait_for_function("document.activeElement.scrollLeft > 0")
        assert page.evaluate("swarmevoReport[0].player.time") == 0


def test_the_page_says_how_to_read_it(page: Page) -> None:
    guide = page.locator(".guide")
    page.get_by_role("link", name="How to read this page").click()
    page.wait_for_function("document.querySelector('.guide').open")
    assert "Evolution selects whoever had good luck" in guide.inner_text()
    guide.locator("summary").click()

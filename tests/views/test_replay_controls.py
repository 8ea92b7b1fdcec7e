# SPDX-License-Identifier: BSD-3-Clause
"""What a reader can do with a replay: keys, wheel, chips, toggles, pictures and links, in a real Chromium, offline."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

import browser as browsers
from swarmevo.analysis.recording import Recording, record
from swarmevo.config import Config
from swarmevo.plugins.team import Team
from swarmevo.simulation import EpisodeKey
from swarmevo.views.replay import data as replay_data
from swarmevo.views.replay import networks as replay_networks
from swarmevo.views.replay import page as replay_page

HOME = [3.0, None, 5.0]


def recorded(horizon: float, controller: dict[str, Any]) -> Recording:
    settings = Config.model_validate(
        {
            "team": {"robots": 3},
            "episode": {"horizon": horizon},
            "controller": controller,
            "fitness": {"box_pushing": {}},
        }
    )
    genes = np.random.default_rng(3).normal(0, 1.2, Team(settings).space.size)
    return record(settings, genes, [EpisodeKey(1, 0, 0, 0)])


@pytest.fixture(scope="module")
def film() -> Recording:
    return recorded(12.0, {"feedforward": {"hidden": 3}})


@pytest.fixture(scope="module")
def file(film: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a page; two robots home in and the box is pushed at times that are made up."""
    episode = {**replay_data.data(film, "controls"), "homing": HOME, "push": 9.0}
    file = tmp_path_factory.mktemp("pages") / "page.html"
    file.write_text(replay_page.render([episode], "controls"))
    return file


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with browsers.chromium() as started:
        yield started


@pytest.fixture(scope="module")
def opened(browser: Browser, file: Path) -> Iterator[Page]:
    with browsers.watch(browser, 820, 520) as watched:
        yield watched.open(file)
        assert watched.errors == []
        assert watched.requests == []


@pytest.fixture
def page(opened: Page) -> Page:
    opened.evaluate("swarmevo.pause(); swarmevo.seek(6); document.activeElement.blur()")
    return opened


def drawn(page: Page) -> None:
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def is_playing(page: Page) -> Any:
    return page.evaluate("swarmevo.player.playing")


@pytest.mark.parametrize("focus", ["body", ".sw-slider", ".sw-robot", ".sw-chip", ".sw-tool"])
def test_space_and_arrows_work_wherever_the_pointer_was(page: Page, focus: str) -> None:
    if focus != "body":
        page.locator(focus).first.click(force=True)
    page.evaluate("swarmevo.pause(); swarmevo.seek(6)")
    page.keyboard.press("ArrowRight")
    assert page.evaluate("swarmevo.player.time") == 7
    page.keyboard.press("ArrowLeft")
    assert page.evaluate("swarmevo.player.time") == 6
    page.keyboard.press(" ")
    assert is_playing(page)
    page.keyboard.press(" ")
    assert not is_playing(page)
    if focus in (".sw-robot", ".sw-tool"):
        page.locator(focus).first.click(force=True)  # as it was before


def test_space_on_what_has_the_keyboard_s_focus_presses_it(page: Page) -> None:
    page.locator(".sw-chip").first.focus()
    page.keyboard.press(" ")
    assert page.evaluate("swarmevo.player.time") == HOME[0]
    assert not is_playing(page)


DISTANCE = "swarmevo.player.stages[0].scene.viewer.controls.getDistance()"


def test_the_wheel_zooms_after_a_click_or_with_ctrl_alone(page: Page) -> None:
    box = page.locator(".sw-view").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 200, box["y"] + 200)

    def turned() -> bool:
        before = page.evaluate(DISTANCE)
        page.mouse.wheel(0, 240)
        drawn(page)
        return bool(abs(page.evaluate(DISTANCE) / before - 1) > 0.01)

    assert not turned()
    assert page.locator(".sw-hint").text_content() == "Click the scene, or hold Ctrl, to zoom with the wheel"
    page.evaluate("document.querySelector('.sw-hint').hidden = true")
    turn = "document.querySelector('.sw-view').dispatchEvent(new WheelEvent('wheel', { deltaY: 240 }))"
    assert page.evaluate(f"{turn}; !document.querySelector('.sw-hint').hidden")  # at once: it goes after three seconds
    page.keyboard.down("Control")
    assert turned()
    page.keyboard.up("Control")
    assert not turned()
    page.mouse.click(box["x"] + 200, box["y"] + 200)
    assert turned()
    page.locator(".sw-title").click()
    page.mouse.move(box["x"] + 200, box["y"] + 200)
    assert not turned()
    page.evaluate("swarmevo.player.stages[0].home.click()")


def test_chips_jump_to_what_happened_and_a_flag_tells_it(page: Page) -> None:
    chips = page.locator(".sw-chip")
    assert [chip.get_attribute("title") for chip in chips.all()] == [
        "robot 1 at the source, 3.0 s", "robot 3 at the source, 5.0 s", "box at the wall, 9.0 s",
    ]  # fmt: skip
    assert chips.last.inner_text() == "box at the wall 9.0 s"
    chips.last.click()
    assert page.evaluate("swarmevo.player.time") == 9
    assert page.locator(".sw-flag").inner_text().strip() == "box at the wall"
    page.evaluate("swarmevo.seek(8.9)")
    assert page.locator(".sw-flag").is_hidden()
    assert [("sw-over" in (chip.get_attribute("class") or "")) for chip in chips.all()] == [True, True, False]


def test_the_source_has_its_name_where_it_is(page: Page) -> None:
    label = page.locator(".sw-label")
    assert label.inner_text() == "source"
    drawn(page)
    place = page.evaluate("swarmevo.player.stages[0].scene.camera.project(0, 0.345, 0.1)")
    box, view = label.bounding_box(), page.locator(".sw-view").bounding_box()
    assert box is not None
    assert view is not None
    assert box["x"] + box["width"] / 2 - view["x"] == pytest.approx(place[0], abs=1.5)
    assert box["y"] + box["height"] - view["y"] == pytest.approx(place[1], abs=1.5)


def test_the_sources_name_covers_no_robot(page: Page) -> None:
    """Above it where nobody is there, else beside it."""
    scene = "swarmevo.player.stages[0].scene"
    drawn(page)
    places = []
    for north in (-0.4, 0.43):  # the second one is behind the source, where its name stands else
        page.evaluate(
            f"{scene}.robots.forEach(({{ body }}, i) => body.position.set(0.001 * i, {north}, 0)); {scene}._face()"
        )
        label, view = page.locator(".sw-label").bounding_box(), page.locator(".sw-view").bounding_box()
        assert label is not None
        assert view is not None
        x, y, radius = page.evaluate(f"{scene}._disc({scene}.robots[0].body.position)")
        across = max(label["x"] - view["x"] - x, x - label["x"] - label["width"] + view["x"])
        up = max(label["y"] - view["y"] - y, y - label["y"] - label["height"] + view["y"])
        assert max(across, up) >= radius - 0.1
        places.append(label["y"] - view["y"])
    assert places[1] > places[0] + 5
    page.evaluate("swarmevo.seek(6)")


def test_robots_numbers_stand_upright(page: Page) -> None:
    for turn in (0.0, 1.0):
        page.evaluate(f"swarmevo.seek({3 + turn})")
        drawn(page)
        found = page.evaluate(
            "swarmevo.player.stages[0].scene.robots.map(({ body, number }) => body.rotation.z + number.rotation.z)"
        )
        np.testing.assert_allclose(found, 0, atol=1e-6)  # seen from the south


@pytest.mark.parametrize(("most", "top"), [(0, "0 cm"), (0.4, "0.4 cm"), (123, "120 cm")])
def test_a_plot_says_its_highest_value(page: Page, most: float, top: str) -> None:
    series = f"[{{ name: '', colour: 'red', values: Float32Array.of(0, {most}), unit: ' cm', digits: 1 }}]"
    page.evaluate(f"swarmevo.player.stages[0].plots[1].draw('gap', {series}, 12, 12, false)")
    assert page.locator(".sw-top").last.inner_text() == top
    page.evaluate("swarmevo.player.stages[0]._plots()")


def test_toggles_show_and_hide(page: Page) -> None:
    page.locator(".sw-menu summary").click()
    scene = "swarmevo.player.stages[0].scene"
    for name, node in {"rays": f"{scene}.beams.mesh.visible", "signal": f"{scene}.emitters[0].range.visible"}.items():
        box = page.locator(".sw-panel label", has_text=name)
        assert page.evaluate(node) is True
        box.click()
        assert page.evaluate(node) is False
        box.click()
        assert page.evaluate(node) is True
    page.locator(".sw-trails").select_option("0")
    assert page.evaluate(f"{scene}.trails.map(({{ visible }}) => visible)") == [False] * 3
    page.locator(".sw-trails").select_option("5")
    assert page.evaluate(f"{scene}.trails.map(({{ material }}) => material.uniforms.fade.value)") == [5] * 3
    page.keyboard.press("Escape")


def test_beside_a_narrow_scene_a_network_leaves_the_plots_their_width(page: Page) -> None:
    page.evaluate("swarmevo.player.view.network = true; swarmevo.player._apply()")
    for drawing in page.locator(".sw-plot svg, .sw-network svg").all():
        assert drawing.evaluate("(svg) => svg.clientWidth") >= 200
    legend, view = page.locator(".sw-legend").bounding_box(), page.locator(".sw-view").bounding_box()
    assert legend is not None
    assert view is not None
    assert legend["y"] >= view["y"] + view["height"]  # not on the arena
    page.evaluate("swarmevo.player.view.network = false; swarmevo.player._apply()")


def test_the_network_shows_what_it_did(page: Page, film: Recording) -> None:
    page.locator(".sw-menu summary").click()
    page.locator(".sw-panel label", has_text="network").click()
    page.locator(".sw-title").click()
    network = page.locator(".sw-network")
    hidden = replay_networks.activations(film)
    for robot in (0, 2):
        page.evaluate(f"swarmevo.player.stages[0]._watch({robot}); swarmevo.seek(4.0)")
        assert network.locator("figcaption").inner_text() == f"network of robot {robot + 1} now"
        stage = "swarmevo.player.stages[0]"
        values = page.evaluate(f"{stage}.network._values({stage}.track.at(4), {robot})")
        np.testing.assert_allclose(values["hidden"], hidden[40, robot], atol=0.004)
        np.testing.assert_allclose(values["inputs"][:-1], film.telemetry.observation[0, 40, robot], atol=0.004)
        np.testing.assert_allclose(values["outputs"], film.telemetry.command[0, 40, robot], atol=0.004)
    assert network.locator("circle").count() == 14 + hidden.shape[-1] + 2
    browsers.keep(page, "replay-network")
    page.evaluate(
        "swarmevo.player.stages[0].home.click(); swarmevo.player.view.network = false; swarmevo.player._apply()"
    )
    assert network.is_hidden()


def remembered(film: Recording, memory: str) -> list[Any]:
    (network,) = replay_networks.drawn(film)
    return [link for link in network["links"] if link[0] == memory and link[2] == "hidden"]


def test_the_network_shows_what_it_remembers(browser: Browser, tmp_path: Path) -> None:
    """Its links are dashed, and as strong as what they lead from was a control step ago."""
    film = recorded(3.0, {"elman": {"hidden": 5}})
    (tmp_path / "page.html").write_text(replay_page.render([replay_data.data(film, "elman")], "elman"))
    links, hidden = remembered(film, "hidden"), replay_networks.activations(film)
    assert len(links) == hidden.shape[-1] ** 2 > 1
    with browsers.watch(browser, 820, 620) as watched:
        page = watched.open(tmp_path / "page.html")
        page.evaluate(
            "swarmevo.pause(); swarmevo.player.view.network = true; swarmevo.player._apply();"
            "swarmevo.player.stages[0]._watch(1); swarmevo.seek(2)"
        )
        drawn(page)
        dashed = page.locator(".sw-network path[stroke-dasharray]")
        looks = dashed.evaluate_all("all => all.map(({ style }) => [style.stroke, style.strokeOpacity])")
        browsers.keep(page, "replay-network-elman")
    most = max(abs(link[4]) for network in replay_networks.drawn(film) for link in network["links"])
    heard = [link[4] / most * hidden[19, 1, link[1]] for link in links]
    assert [colour for colour, _ in looks] == [f"var(--sw-{'excites' if one >= 0 else 'inhibits'})" for one in heard]
    np.testing.assert_allclose([float(opacity) for _, opacity in looks], 0.1 + 0.9 * np.abs(heard), atol=0.015)


def test_a_jordan_network_remembers_its_commands() -> None:
    film = recorded(1.0, {"jordan": {"hidden": 5}})
    assert len(remembered(film, "outputs")) == 2 * replay_networks.activations(film).shape[-1]
    assert not remembered(film, "hidden")


def test_from_above_the_arena_is_a_square(page: Page) -> None:
    page.get_by_role("button", name="from above").click()
    corners = np.array(
        page.evaluate(
            "[[-.5, -.5], [.5, -.5], [.5, .5]].map(([x, y]) => swarmevo.player.stages[0].scene.camera.project(x, y, 0))"
        )
    )
    across, up = corners[1] - corners[0], corners[2] - corners[1]
    assert across[1] == pytest.approx(0, abs=0.5)
    assert up[0] == pytest.approx(0, abs=0.5)
    assert across[0] == pytest.approx(-up[1], rel=0.01)
    page.get_by_role("button", name="from above").click()


def test_a_picture_is_saved(page: Page) -> None:
    with page.expect_download() as download:
        page.get_by_role("button", name="save a picture").click()
    assert download.value.suggested_filename == "controls-6.0s.png"
    assert browsers.pixels(download.value.path().read_bytes()).std(axis=(0, 1)).min() > 10, "it is blank"


def test_a_link_leads_to_the_moment(page: Page, browser: Browser, file: Path) -> None:
    page.evaluate("swarmevo.seek(7.3)")
    page.get_by_role("button", name="copy a link").click()
    page.wait_for_function("document.querySelector('.sw-said').textContent")
    assert page.evaluate("location.hash") == "#t=7.3"
    page.evaluate("location.hash = '#t=2.5'")
    page.wait_for_function("swarmevo.player.time === 2.5")


def test_who_wants_no_motion_has_none_unasked(browser: Browser, file: Path) -> None:
    context = browser.new_context(viewport={"width": 400, "height": 300}, reduced_motion="reduce", offline=True)
    context.set_default_timeout(browsers.PATIENCE)
    page = context.new_page()
    page.goto(file.as_uri())
    assert not is_playing(page)
    context.close()

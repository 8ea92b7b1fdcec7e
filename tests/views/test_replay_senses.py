# SPDX-License-Identifier: BSD-3-Clause
"""What robots sense is seen in a replay: each device that they have, and none that they have not."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

import browser as browsers
from swarmevo.analysis.recording import Recording, record
from swarmevo.config import Config, scene_info
from swarmevo.config.models import Device
from swarmevo.plugins.team import Team
from swarmevo.simulation import EpisodeKey
from swarmevo.views.replay import data as replay_data
from swarmevo.views.replay import page as replay_page
from swarmevo.views.replay import video as replay_video
from swarmevo.views.replay.senses import senses

RANGE, SECTORS, BITS = 0.5, 6, 2
WORLD: dict[str, Any] = {
    "scene": {
        "grey": 0.8,
        "patches": [{"grey": 0.0, "size": (0.5, 0.4), "pose": (0.2, -0.2, 0.4)}],
        "movables": [
            {"shape": "cylinder", "size": (0.1, 0.1, 0.03), "mass": 0.03, "pose": (x, 0.1, 0)} for x in (0, 0.2)
        ],
        "emitters": [
            {"position": (0, 0.1, 0.03), "reach": "arena"},
            {"channel": "light", "position": (0.3, 0.1, 0.03), "reach": "arena"},
        ],
    },
    "sensors": {
        "infrared_yaw_deg": [k * 22.5 for k in range(16)],
        "touch_yaw_deg": [90, 45, 0, -45, -90, 180],
        "touch_half_width_deg": 22.5,
        "range_and_bearing_range": RANGE,
        "range_and_bearing_sectors": SECTORS,
        "range_and_bearing_message": BITS,
        "ground_position": [(0.03, 0.01), (0.03, -0.01)],
    },
    "team": {"start": "random", "start_region": (-0.45, 0.45, -0.45, 0.0)},
    "episode": {"horizon": 6.0},
    "fitness": {"hidden_neurons": {}},
    "controller": {"feedforward": {}},
}
TIMES = (0.0, 2.5, 5.9)


def filmed(*devices: str) -> Recording:
    bits = BITS if "range_and_bearing" in devices else 0
    sensors = {**WORLD["sensors"], "range_and_bearing_message": bits}
    settings = Config.model_validate({**WORLD, "robot": {"sensors": devices}, "sensors": sensors})
    genes = np.random.default_rng(3).normal(0, 1.2, Team(settings).space.size)
    return record(settings, genes, [EpisodeKey(1, 0, 0, 0)])


@pytest.fixture(scope="module")
def everything() -> Recording:
    return filmed(*get_args(Device))


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with browsers.chromium() as started:
        yield started


@pytest.fixture(scope="module")
def page(browser: Browser, everything: Recording, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """Give a replay of robots that have every device."""
    with opened(browser, everything, tmp_path_factory.mktemp("pages")) as page:
        yield page


@contextmanager
def opened(browser: Browser, film: Recording, folder: Path) -> Iterator[Page]:
    """Give a page of an episode; nothing may go wrong in it."""
    (folder / "page.html").write_text(replay_page.render([replay_data.data(film, "")], ""))
    with browsers.watch(browser, 640, 420) as watched:
        yield watched.open(folder / "page.html")
        assert watched.errors == []


def seek(page: Page, t: float) -> int:
    page.evaluate(f"swarmevo.pause(); swarmevo.seek({t})")
    return round(t / 0.1)


@pytest.mark.parametrize("devices", [(), ("ground",), get_args(Device), ("light", "touch", "range_and_bearing")])
def test_each_device_finds_its_readings(devices: tuple[str, ...]) -> None:
    bits = BITS if "range_and_bearing" in devices else 0
    sensors = {**WORLD["sensors"], "range_and_bearing_message": bits}
    settings = Config.model_validate({**WORLD, "robot": {"sensors": devices}, "sensors": sensors})
    names = scene_info(settings).observation_names
    *found, message = [*senses(settings), None]
    if "range_and_bearing" in devices:
        found, message = found[:-1], found[-1]
        assert message is not None
        assert (message["device"], message["count"]) == ("message", BITS)
    assert [sense["device"] for sense in found] == list(devices)
    for sense in found:
        its_own = names[sense["first"] : sense["first"] + sense["count"]]
        assert all(name.startswith(sense["device"]) for name in its_own)
        assert len(sense.get("yaw", its_own)) * sense.get("stride", 1) == sense["count"]
    assert sum(sense["count"] for sense in found) == len(names)


def test_a_row_has_the_robots_devices_and_no_others(page: Page) -> None:
    heads = page.locator(".sw-heads .sw-devices > span").all_inner_texts()
    assert heads == [
        "infrared", "touch", "RF", "RF bearing", "range and bearing", "ground", "odometry", "movable motion", "light",
        "sends", "at the beacon",
    ]  # fmt: skip
    row = page.locator(".sw-robot").first
    assert row.locator(".sw-glyph").count() == len(heads) - 1
    assert row.locator(".sw-of-infrared path").count() == 16
    assert row.locator(".sw-of-touch path").count() == 6
    assert row.locator(".sw-of-ground i").count() == 2
    browsers.keep(page, "senses")


def test_a_blind_robot_has_only_its_number(browser: Browser, tmp_path: Path) -> None:
    empty = {"scene": {"movables": [], "emitters": []}, "robot": {"sensors": []}, "episode": {"horizon": 0.5}}
    empty["sensors"] = {"ground_position": [(0, 0)]}
    settings = Config.model_validate({**WORLD, **empty})
    film = record(settings, np.zeros(Team(settings).space.size), [EpisodeKey(1, 0, 0, 0)])
    with opened(browser, film, tmp_path) as page:
        assert page.locator(".sw-robot").all_inner_texts() == ["1", "2", "3", "4", "5"]
        assert page.locator(".sw-heads .sw-devices > span").count() == 0
        assert page.locator(".sw-legend li").all_inner_texts() == ["bumper"]


@pytest.mark.parametrize("t", TIMES)
def test_glyphs_show_what_was_observed(page: Page, everything: Recording, t: float) -> None:
    step = seek(page, t)
    observed = dict(
        zip(scene_info(everything.config).observation_names, everything.telemetry.observation[0, step].T, strict=True)
    )
    opacities = glyphs(page, "infrared path", "mark.style.fillOpacity")
    for k in range(16):
        value = observed[f"infrared_{k}"]
        wanted = np.where(np.rint(127 * value) > 0, 0.2 + 0.8 * np.sqrt(value), 0)
        np.testing.assert_allclose([float(of[k]) for of in opacities], wanted, atol=0.02)
    greys = [[re.findall(r"\d+", one)[0] for one in of] for of in glyphs(page, "ground i", "mark.style.background")]
    for k in (0, 1):
        np.testing.assert_allclose([float(of[k]) / 255 for of in greys], observed[f"ground_{k}"], atol=0.01)
    strength = 50 * observed["rf"]
    assert strength.max() > 2
    widths = [float(of[0].rstrip("%")) for of in glyphs(page, "rf i", "mark.style.width")]
    np.testing.assert_allclose(widths, 100 * (strength - 1) / 49, atol=1)
    ends = np.array(glyphs(page, "rf_bearing line", "[mark.getAttribute('x2'), mark.getAttribute('y2')]"), dtype=float)
    np.testing.assert_allclose(ends[:, 0, 0], -10.5 * observed["rf_bearing_sin"], atol=0.1)
    np.testing.assert_allclose(ends[:, 0, 1], -10.5 * observed["rf_bearing_cos"], atol=0.1)
    tops = glyphs(page, "odometry i", "mark.style.getPropertyValue('--to')")
    for k, side in enumerate(("left", "right")):
        wanted = 50 + 50 * np.maximum(observed[f"odometry_{side}"], 0)
        np.testing.assert_allclose([float(of[k].rstrip("%")) for of in tops], wanted, atol=0.3)
    bits = glyphs(page, "message i", "mark.classList.contains('sw-on')")
    assert bits == (everything.telemetry.message[0, step] > 0).tolist()


def glyphs(page: Page, of: str, value: str) -> list[list[Any]]:
    """Return for each robot what its marks of a device are like."""
    script = f"(rows) => rows.map((row) => [...row.querySelectorAll('.sw-of-{of}')].map((mark) => {value}))"
    return list(page.locator(".sw-robot").evaluate_all(script))


@pytest.mark.parametrize("t", TIMES)
def test_lines_lead_to_who_is_heard(page: Page, everything: Recording, t: float) -> None:
    """A reading tells of a distance: the robot that the line leads to is as far away; none without a reading."""
    step = seek(page, t)
    places = everything.telemetry.pose[0, step, :, :2]
    first = scene_info(everything.config).observation_names.index("range_and_bearing_0")
    readings = everything.telemetry.observation[0, step, :, first :: 1 + BITS][:, :SECTORS]
    heard = page.evaluate(
        f"(() => {{ const {{ beams, track }} = swarmevo.player.stages[0].scene; const {{ robots }} = track.poses({t}); "
        "return robots.map((_, i) => beams.hears(i, robots)); })()"
    )
    assert any(other is not None for others in heard for other in others)
    for me, others in enumerate(heard):
        for sector, other in enumerate(others):
            assert (other is None) == (readings[me, sector] == 0)
            if other is not None:
                distance = np.hypot(*(places[other] - places[me]))
                assert readings[me, sector] == pytest.approx(1 - distance / RANGE, abs=1e-6)


def test_a_ray_ends_where_something_is(page: Page) -> None:
    """It is as long as the curve says, by NumPy's interpolation."""
    curve = next(sense["curve"] for sense in senses(filmed("infrared").config))
    distances, values = np.array(curve).T
    for reading in (1.0, 0.9, 0.2, 0.03, 0.01):
        found = page.evaluate(f"swarmevo.player.stages[0].scene.beams.reach({reading})")
        assert found == pytest.approx(np.interp(-reading, -values, distances), abs=1e-9)


def test_wheels_turn_as_commanded_whatever_robots_send(page: Page, everything: Recording) -> None:
    command = everything.telemetry.command[0, :59, :, :2]
    turned = command.sum(axis=0) * everything.config.robot.top_speed * 0.1
    seek(page, 5.9)
    wheels = "swarmevo.player.stages[0].scene.robots.map((robot) => robot.wheels.map((wheel) => wheel.rotation.y))"
    np.testing.assert_allclose(page.evaluate(wheels), turned, atol=0.2)


def test_a_film_has_rows_where_there_is_room_for_all(page: Page) -> None:
    for height, has_room in ((420, False), (1200, True)):
        page.set_viewport_size({"width": 900, "height": height})
        page.evaluate(replay_video._PREPARE)
        assert page.locator(".sw-robot").last.is_visible() == has_room

# SPDX-License-Identifier: BSD-3-Clause
"""A replay is the stored episode, and its page shows it: in a real Chromium, offline."""

from __future__ import annotations

import base64
import dataclasses
import http.client
import math
import re
import shutil
import socket
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import umsgpack
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Browser, Page

import browser as browsers
from swarmevo import cli, config
from swarmevo.analysis import fronts
from swarmevo.analysis.measures import measures_of
from swarmevo.analysis.recording import Recording, record
from swarmevo.config import Config
from swarmevo.errors import ConfigError, ReplayError
from swarmevo.plugins.team import Team
from swarmevo.runs import driver, other_world
from swarmevo.runs.store import Store
from swarmevo.simulation import EpisodeKey, layout
from swarmevo.views import figures, html
from swarmevo.views.replay import data as replay_data
from swarmevo.views.replay import episode as replay_episode
from swarmevo.views.replay import epuck
from swarmevo.views.replay import page as replay_page
from swarmevo.views.replay import scene as replay_scene
from swarmevo.views.replay import server as replay_server
from swarmevo.views.replay import video as replay_video
from swarmevo.views.replay.episode import Chosen

SHORT = ["episode.horizon=30.0", "evolution.population=4", "evolution.generations=2", "evolution.repeats=2"]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a small run."""
    folder = tmp_path_factory.mktemp("runs") / "small"
    driver.begin(folder, config.load("quick", [*SHORT, "evolution.seed=1"]))
    with Store.open(folder, readonly=False) as store:
        driver.evolve(store, 1, lambda _: None)
    return folder


@pytest.fixture(scope="module")
def settings(run: Path) -> Config:
    return config.load(run / "config.yaml")


@pytest.fixture(scope="module")
def chosen(run: Path) -> Chosen:
    with Store.open(run) as store:
        return replay_episode.choose(store)


@pytest.fixture(scope="module")
def recording(settings: Config, chosen: Chosen) -> Recording:
    return record(settings, chosen.genes, [chosen.key])


@pytest.fixture(scope="module")
def episode(recording: Recording) -> dict[str, Any]:
    return replay_data.data(recording, "small, individual 1", "seed 1")


def unpacked(chunk: dict[str, Any], name: str, kind: type[np.generic]) -> NDArray[Any]:
    return np.frombuffer(base64.b64decode(chunk[name]), kind)


# ---- which episode ---------------------------------------------------------------------------------------------------


def test_the_fronts_most_successful_is_chosen(run: Path, chosen: Chosen) -> None:
    with Store.open(run) as store:
        best = fronts.most_successful(fronts.front(store), measures_of(store.config, store.objectives))
    assert (chosen.genome, chosen.key) == (best.genome, (1, best.trial, best.last_generation, 0))


def test_any_stored_episode_can_be_chosen(run: Path) -> None:
    with Store.open(run) as store:
        first = replay_episode.choose(store, genome=1, generation=0, repeat=1)
        stored = store.generation(0, 0)
    (place,) = np.flatnonzero((stored.genomes == first.genes).all(axis=1))
    assert first.hash == stored.episodes.grid("hash")[place, 1]
    assert first.key == (1, 0, 0, 1)


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ({"genome": 999}, "there is no individual 999; see: swarmevo show"),
        ({"repeat": 2}, "expected a repeat from 0 to 1, got 2"),
        ({"genome": 5, "generation": 0}, "individual 5 was not evaluated in generation 0, but in 1"),
    ],
)
def test_an_episode_that_is_not_stored_is_refused(run: Path, wanted: dict[str, int], message: str) -> None:
    with Store.open(run) as store, pytest.raises(ReplayError, match=message):
        replay_episode.choose(store, **wanted)


# ---- once more -------------------------------------------------------------------------------------------------------


def test_a_replay_is_the_stored_episode(run: Path, chosen: Chosen) -> None:
    with Store.open(run) as store:
        recording, warning = replay_episode.replay(store, chosen)
        stored = store.generation(chosen.key.trial, chosen.key.generation)
    assert not warning
    assert recording.episodes.hash.tolist() == [chosen.hash]
    place = np.flatnonzero((stored.genomes == chosen.genes).all(axis=1))[0]
    assert recording.values[0].tolist() == stored.episodes.grid("objective")[place, 0].tolist()


def test_another_trajectory_is_refused_unless_forced(run: Path, chosen: Chosen) -> None:
    other = dataclasses.replace(chosen, hash=chosen.hash ^ 1)
    with Store.open(run) as store:
        with pytest.raises(ReplayError, match=r"not the stored one \(hash .*the same; .*--force shows it"):
            replay_episode.replay(store, other)
        _, warning = replay_episode.replay(store, other, force=True)
    assert "not the stored one" in warning
    assert "--force" not in warning


def test_the_reason_is_looked_for_in_the_provenance(run: Path, chosen: Chosen, monkeypatch: pytest.MonkeyPatch) -> None:
    before = Store.session
    monkeypatch.setattr(Store, "session", lambda store, id: {**before(store, id), "cpu": "Z80"})
    with Store.open(run) as store, pytest.raises(ReplayError, match="cpu was Z80, is "):
        replay_episode.replay(store, dataclasses.replace(chosen, hash=0))


def test_the_terms_add_up_to_the_objective(recording: Recording) -> None:
    f1 = recording.values[0, 0]
    assert list(recording.terms) == ["homing", "pushing"]
    assert sum(term.mean() for term in recording.terms.values()) == pytest.approx(f1, rel=1e-12)


def test_a_team_of_another_size_keeps_its_places(settings: Config, chosen: Chosen) -> None:
    changes = {"start": "poses", "start_poses": tuple((0.1 * i, -0.4, 0.0) for i in range(5)), "start_jitter": (0, 0)}
    placed = settings.model_copy(update={"team": settings.team.model_copy(update=changes)})
    smaller, genes = other_world.team_of(placed, chosen.genes, 2)
    pose = record(smaller, genes, [chosen.key]).telemetry.pose
    assert pose is not None
    assert pose[0, 0, :, 0].tolist() == [0.0, 0.1]


def test_genomes_of_their_own_limit_the_team(settings: Config) -> None:
    own = settings.model_copy(update={"team": settings.team.model_copy(update={"genomes": "individual"})})
    _, genes = other_world.team_of(own, np.arange(10.0), 2)
    assert genes.tolist() == [0.0, 1.0, 2.0, 3.0]
    with pytest.raises(ConfigError, match="expected at most 5, for each has its own genome, got 6"):
        other_world.team_of(own, np.arange(10.0), 6)


# ---- as data ---------------------------------------------------------------------------------------------------------


def test_poses_are_kept_to_a_hair(recording: Recording, episode: dict[str, Any]) -> None:
    pose = recording.telemetry.pose
    assert pose is not None
    (chunk,) = episode["chunks"]
    kept = unpacked(chunk, "pose", np.int16).reshape(pose[0].shape)
    unit = np.array([episode["unit"]["position"]] * 2 + [episode["unit"]["heading"]])
    np.testing.assert_allclose(kept * unit, pose[0], atol=1e-4)
    assert chunk["steps"] == len(pose[0]) == 300


def test_the_gap_is_that_of_the_nearest_corner(settings: Config) -> None:
    for wall, (axis, sign) in {"north": (1, 1), "south": (1, -1), "east": (0, 1), "west": (0, -1)}.items():
        arena = settings.arena.model_copy(update={"target_wall": wall})
        turned = settings.model_copy(update={"arena": arena})
        box = np.array([[0.1, -0.2, 0.3], [0.0, 0.1, -2.0]])
        corners = [
            (x + a * np.cos(turn) - b * np.sin(turn), y + a * np.sin(turn) + b * np.cos(turn))
            for x, y, turn in box
            for a in (0.1375, -0.1375)
            for b in (0.09, -0.09)
        ]
        nearest = 0.5 - (sign * np.array(corners)[:, axis]).reshape(2, 4).max(axis=1)
        gap = layout.delivery_distance(turned, box[:, np.newaxis], np.zeros((2, 1)))
        np.testing.assert_allclose(gap, nearest, atol=1e-12)


def test_the_caption_tells_what_came_of_it(recording: Recording) -> None:
    told = dataclasses.replace(
        recording.telemetry,
        homing_time=np.array([[12.34, np.nan, 3.0, np.nan, np.nan]]),
        push_time=np.array([np.nan]),
    )
    facts = dict(
        replay_data.facts(
            dataclasses.replace(recording, episodes=dataclasses.replace(recording.episodes, telemetry=told))
        )
    )
    assert facts["robots at the source"].replace("\N{NO-BREAK SPACE}", " ") == "2 of 5, 3.0 to 12.3 s"
    assert facts["box at the wall"] == "never"
    assert list(facts)[:2] == ["box pushing", "hidden neurons"]  # as in tables


THIN = 5_000  # bytes: fewer than the 300 control steps take


def test_a_long_episode_is_thinned(recording: Recording, episode: dict[str, Any]) -> None:
    """Case 76: to a size that is given, and it says so."""
    thin = replay_data.data(recording, "", most_bytes=THIN)
    (chunk,), every = thin["chunks"], thin["thinned"]
    assert every > 3
    assert sum(map(len, replay_data._texts(chunk))) <= THIN * 1.1
    assert chunk["steps"] == math.ceil(300 / every)
    assert thin["period"] == pytest.approx(0.1 * every)
    assert dict(thin["facts"])["control steps shown"] == f"1 of {every}, {0.1 * every:.3g} s apart"
    assert episode["thinned"] == 1
    assert "control steps shown" not in dict(episode["facts"])


def test_a_thinned_episode_loses_no_touch_and_keeps_means(recording: Recording) -> None:
    """Case 76: what lasts a moment is seen; poses are those of their time."""
    before = recording.telemetry
    touched = np.array(before.observation)
    touched[0, :, :, 8:12] = 0.0
    touched[0, 7, 2, 9] = 1.0  # for one control step
    telemetry = dataclasses.replace(before, observation=touched)
    told = dataclasses.replace(recording, episodes=dataclasses.replace(recording.episodes, telemetry=telemetry))
    thin = replay_data.data(told, "", most_bytes=THIN)
    (chunk,), every = thin["chunks"], thin["thinned"]
    steps = range(0, 300, every)
    observed = unpacked(chunk, "observation", np.int8).reshape(len(steps), 5, 13)
    touch = observed[..., 8:12]
    command = unpacked(chunk, "command", np.int8).reshape(len(steps), 5, 2)
    homing = np.frombuffer(base64.b64decode(chunk["terms"][0]), "<f4")
    place = unpacked(chunk, "pose", np.int16).reshape(len(steps), 5, 3)[..., :2] * thin["unit"]["position"]
    np.testing.assert_allclose(place, telemetry.pose[0, ::every, :, :2], atol=1e-4)
    for i, step in enumerate(steps):
        window = slice(step, step + every)
        assert ((touch[i] > 0) == (touched[0, window, :, 8:12] > 0).any(axis=0)).all()
        np.testing.assert_allclose(observed[i, :, :8] / 127, touched[0, step, :, :8], atol=0.004)
        np.testing.assert_allclose(command[i] / 127, telemetry.command[0, window].mean(axis=0), atol=0.004)
        assert homing[i] == pytest.approx(recording.terms["homing"][0, window].mean(), rel=1e-6)


def test_a_stream_brings_the_same_episode(recording: Recording, episode: dict[str, Any], settings: Config) -> None:
    events = list(replay_episode.stream(settings, *(chosen_part(recording)), "small, individual 1", "seed 1"))
    assert [name for name, _ in events] == ["head", "chunk", "chunk", "chunk", "outcome"]
    chunks = [chunk for name, chunk in events if name == "chunk"]
    assert [chunk["steps"] for chunk in chunks] == [100, 100, 100]
    for name in ("pose", "movables", "command", "observation", "hidden", "message", "at_goal", "gap"):
        streamed = b"".join(base64.b64decode(chunk[name]) for chunk in chunks)
        assert streamed == base64.b64decode(episode["chunks"][0][name]), name
    assert events[-1][1] == replay_data.outcome(recording)
    assert {**events[0][1], **events[-1][1], "chunks": 0} == {**episode, "chunks": 0}


def chosen_part(recording: Recording) -> tuple[Any, Any]:
    return recording.genes, recording.keys[0]


def test_the_scene_has_every_node_that_the_player_moves(settings: Config) -> None:
    commands = [umsgpack.unpackb(base64.b64decode(text)) for text in replay_scene.packed(settings)]
    paths = {command["path"] for command in commands if command["type"] == "set_object"}
    for robot in range(5):
        for node in ("left/tyre", "right/tyre", "touch/0", "touch/3", "halo/rf", "nose", "number"):
            assert f"/robots/{robot}/{node}" in paths
    assert {"/movables/0/body", "/goals/0/wall", "/goals/0/stripe", "/emitters/0/range/disc"} < paths
    assert replay_scene.packed(settings) == replay_scene.packed(settings)


def geometries(settings: Config) -> dict[str, dict[str, Any]]:
    """Return the one geometry of each node."""
    commands = [command for command in replay_scene.commands(settings) if command["type"] == "set_object"]
    return {command["path"]: command["object"]["geometries"][0] for command in commands}


def test_an_emitter_that_is_heard_everywhere_and_is_no_home_has_no_range(settings: Config) -> None:
    emitters = "[{reach: arena}, {channel: prey, reach: arena, position: [0.3, 0, 0.03]}, {channel: light}]"
    shapes = geometries(config.changed(settings, [f"scene.emitters={emitters}"]))
    discs = [path for path in shapes if path.endswith(("range/disc", "range/edge"))]
    assert discs == [f"/emitters/{i}/range/{part}" for i in (0, 2) for part in ("disc", "edge")]


def test_a_sprung_bumper_is_the_rim_around_a_smaller_body(settings: Config) -> None:
    shapes = geometries(settings)
    for robot in range(5):
        profile = shapes[f"/robots/{robot}/bumper"]["points"]
        radii = sorted({point["x"] for point in profile})
        assert radii == pytest.approx([settings.robot.radius - settings.robot.bumper_travel, settings.robot.radius])
        heights = [point["y"] for point in profile]
        assert 0 < min(heights) < max(heights) < settings.box.size[2]
        assert (min(heights) + max(heights)) / 2 == pytest.approx(settings.box.size[2] / 2)
        assert shapes[f"/robots/{robot}/board"]["radiusTop"] == radii[0]


def test_a_rigid_bumper_is_the_body(settings: Config) -> None:
    robot = settings.robot.model_copy(update={"bumper": "rigid"})
    shapes = geometries(settings.model_copy(update={"robot": robot}))
    assert "/robots/0/bumper" not in shapes
    assert shapes["/robots/0/board"]["radiusTop"] == 0.035


def test_the_legend_has_the_bumpers_colour() -> None:
    assert f"--sw-bumper: {epuck.BUMPER};" in html.asset("swarmevo.views.replay", "player.css")


# ---- as a page -------------------------------------------------------------------------------------------------------


def test_three_minutes_fit_into_three_megabytes(settings: Config, chosen: Chosen) -> None:
    whole = settings.model_copy(update={"episode": settings.episode.model_copy(update={"horizon": 180.0})})
    page = replay_page.render([replay_data.data(record(whole, chosen.genes, [chosen.key]), "long")], "long")
    assert len(page.encode()) < 3_000_000


def test_text_cannot_become_markup(recording: Recording) -> None:
    evil = "</script><script>alert(1)</script>"
    page = replay_page.render([replay_data.data(recording, evil)], evil)
    assert evil not in page
    assert "<title>&lt;/script&gt;" in page


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with browsers.chromium() as started:
        yield started


@pytest.fixture(scope="module")
def file(episode: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("pages") / "replay.html"
    file.write_text(replay_page.render([episode], "small"))
    return file


def drawn(page: Page) -> None:
    """Wait until the scene is drawn."""
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


@pytest.mark.parametrize(
    ("width", "height", "dark"),
    [(900, 560, False), (900, 560, True), (360, 640, False)],
    ids=["light", "dark", "phone"],
)
def test_the_page_opens_offline(
    browser: Browser, file: Path, width: int, height: int, dark: bool, request: pytest.FixtureRequest
) -> None:
    with browsers.watch(browser, width, height, dark) as watched:
        page = watched.open(file)
        page.evaluate("swarmevo.pause(); swarmevo.seek(12)")
        drawn(page)
        scene = browsers.pixels(page.locator(".sw-view canvas").screenshot())
        assert scene.std(axis=(0, 1)).min() > 10, "the canvas is blank"
        assert (scene.mean() < 100) == dark
        browsers.keep(page, f"replay-{request.node.callspec.id}")
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert "small, individual 1" in page.inner_text(".sw-title")
        assert page.locator(".sw-legend li", has_text="bumper").is_visible()
        assert watched.errors == []
        assert watched.requests == []


def test_the_scene_shows_the_stored_poses(browser: Browser, file: Path, recording: Recording) -> None:
    pose, box = recording.telemetry.pose, recording.telemetry.box
    assert pose is not None
    assert box is not None
    with browsers.watch(browser, 640, 420) as watched:
        page = watched.open(file)
        page.evaluate("swarmevo.pause()")
        for t in (0.0, 7.3, 29.9):
            step = round(t / 0.1)
            page.evaluate(f"swarmevo.seek({t})")
            for what in (f"swarmevo.poses({t})", "swarmevo.shown()"):
                seen = page.evaluate(what)
                np.testing.assert_allclose(np.array(seen["robots"])[:, :2], pose[0, step, :, :2], atol=1e-4)
                turned = np.array(seen["robots"])[:, 2] - pose[0, step, :, 2]
                np.testing.assert_allclose(np.cos(turned), 1, atol=1e-6)
                np.testing.assert_allclose(seen["movables"][0][:2], box[0, step, :2], atol=1e-4)


def test_a_thinned_page_plays_to_its_end(browser: Browser, recording: Recording, tmp_path: Path) -> None:
    """Case 76."""
    thin = replay_data.data(recording, "thin", most_bytes=THIN)
    (tmp_path / "thin.html").write_text(replay_page.render([thin], "thin"))
    with browsers.watch(browser, 640, 420) as watched:
        page = watched.open(tmp_path / "thin.html")
        assert f"1 of {thin['thinned']}, " in page.inner_text(".sw-facts")
        for step in (0, thin["thinned"], 20 * thin["thinned"]):
            page.evaluate(f"swarmevo.pause(); swarmevo.seek({0.1 * step})")
            shown = np.array(page.evaluate("swarmevo.shown()")["robots"])[:, :2]
            np.testing.assert_allclose(shown, recording.telemetry.pose[0, step, :, :2], atol=1e-4)
        page.evaluate("swarmevo.seek(29.5); swarmevo.play()")
        page.wait_for_function("swarmevo.player.time === 30 && !swarmevo.player.playing")
        assert watched.errors == []


def test_the_legend_has_only_bumpers_that_are_there(browser: Browser, recording: Recording, tmp_path: Path) -> None:
    robot = recording.config.robot.model_copy(update={"bumper": "rigid"})
    rigid = dataclasses.replace(recording, config=recording.config.model_copy(update={"robot": robot}))
    (tmp_path / "rigid.html").write_text(replay_page.render([replay_data.data(rigid, "")], ""))
    with browsers.watch(browser, 640, 420) as watched:
        page = watched.open(tmp_path / "rigid.html")
        assert page.locator(".sw-legend li:visible").all_inner_texts() == [
            "RF signal",
            "infrared",
            "box sensor",
            "target wall",
        ]
        assert watched.errors == []


def test_robots_move_in_the_picture(browser: Browser, file: Path) -> None:
    with browsers.watch(browser, 700, 420) as watched:
        page = watched.open(file)
        pictures = []
        for t in (0, 0, 9):  # everybody leaves the start
            page.evaluate(f"swarmevo.pause(); swarmevo.seek({t})")
            drawn(page)
            pictures.append(browsers.pixels(page.locator(".sw-view canvas").screenshot()).astype(int))
        assert np.abs(pictures[1] - pictures[0]).max() <= 2
        assert (np.abs(pictures[2] - pictures[1]).max(axis=2) > 40).sum() > 200


def test_the_controls_move_the_time(browser: Browser, file: Path) -> None:
    with browsers.watch(browser, 640, 420) as watched:
        page = watched.open(file)
        page.evaluate("swarmevo.pause(); swarmevo.seek(0)")
        page.click(".sw-play")
        page.wait_for_function("swarmevo.player.time > 1")
        page.click(".sw-play")
        page.locator(".sw-slider").fill("12.5")
        assert page.evaluate("swarmevo.player.time") == 12.5
        assert page.inner_text(".sw-clock") == "0:12.5"
        plot = page.locator(".sw-plot svg").first
        width = plot.evaluate("(drawing) => drawing.getBoundingClientRect().width")
        plot.click(position={"x": width / 2, "y": 10})
        assert page.evaluate("swarmevo.player.time") == pytest.approx(15, abs=0.1)
        page.click(".sw-robot >> nth=1")
        assert page.evaluate("swarmevo.player.stages[0].scene.follow") == 1
        assert watched.errors == []


def test_an_address_can_name_a_time(browser: Browser, file: Path) -> None:
    with browsers.watch(browser, 640, 420) as watched:
        watched.page.goto(f"{file.as_uri()}#t=4.5")
        assert watched.page.evaluate("[swarmevo.player.time, swarmevo.player.playing]") == [4.5, False]


def test_teams_of_other_sizes_stand_side_by_side(browser: Browser, run: Path, chosen: Chosen, tmp_path: Path) -> None:
    with Store.open(run) as store:
        episodes, warning = replay_episode.episodes(store, chosen, [1, 3])
    assert not warning
    file = tmp_path / "sizes.html"
    file.write_text(replay_page.render(episodes, "sizes"))
    with browsers.watch(browser, 700, 500) as watched:
        page = watched.open(file)
        page.evaluate("swarmevo.pause(); swarmevo.seek(5)")
        assert page.locator(".sw-stage h2").all_inner_texts() == ["1 robot", "3 robots"]
        assert [len(page.evaluate(f"swarmevo.shown({k})")["robots"]) for k in (0, 1)] == [1, 3]
        assert watched.errors == []


# ---- other scenes than the paper's -----------------------------------------------------------------------------------

PUCKS = [
    {"shape": "cylinder", "size": (0.06, 0.06, 0.03), "mass": 0.02, "pose": (-0.36 + 0.08 * i, -0.3, 0.0)}
    for i in range(10)
]
SCENES: dict[str, dict[str, Any]] = {
    "nothing": {
        "arena": {"shape": "rectangle", "sides": (2.0, 1.0)},
        "scene": {"movables": [], "emitters": [], "goals": []},
        "fitness": {"coverage": {}, "hidden_neurons": {}},
    },
    "pucks": {"scene": {"movables": PUCKS, "goals": [{"region": (-0.5, 0.0, -0.5, 0.0)}, {"wall": "east"}]}},
    "round": {
        "arena": {"shape": "circle", "size": 1.6},
        "scene": {
            "obstacles": [
                {"pose": (-0.3, 0.2, 0.3)},
                {"shape": "cylinder", "pose": (0.3, -0.1, 0.0)},
                {"shape": "wall", "ends": ((-0.5, -0.1), (-0.2, -0.1))},
            ],
            "emitters": [
                {"position": (0.1, 0.0, 0.03), "rides_on": 0},
                {"channel": "light", "position": (0.5, 0.0, 0.0)},
            ],
            "goals": [{"region": (-0.2, 0.2, 0.6, 0.9)}],
        },
    },
    "polygon": {
        "arena": {"shape": "polygon", "corners": ((-0.6, -0.5), (0.6, -0.5), (0.8, 0.2), (0.0, 0.8), (-0.8, 0.2))},
        "scene": {"grey": 0.8, "patches": [{"grey": 0.0}, {"shape": "cylinder", "grey": 1.0}]},
    },
}
NODES = {
    "nothing": {"arena/walls/north", "arena/walls/east", "arena/floor"},
    "pucks": {*(f"movables/{i}/body" for i in range(10)), "goals/0/region", "goals/1/wall", "goals/1/stripe"},
    "round": {"arena/walls/round", "obstacles/0", "obstacles/1", "obstacles/2", "emitters/1/ball", "goals/0/region"},
    "polygon": {*(f"arena/walls/{i}" for i in range(5)), "arena/patches/0", "arena/patches/1", "movables/0/body"},
}


def filmed(name: str, horizon: float = 8.0) -> Recording:
    """Return an episode in which all robots drive north at top speed: all weights are 1."""
    team = {"start": "poses", "start_poses": tuple((0.12 * i - 0.24, -0.4, np.pi / 2) for i in range(5))}
    settings = Config.model_validate({**SCENES[name], "team": team, "episode": {"horizon": horizon}})
    return record(settings, np.ones(Team(settings).space.size), [EpisodeKey(1, 0, 0, 0)])


@pytest.fixture(scope="module")
def films() -> dict[str, Recording]:
    return {name: filmed(name) for name in SCENES}


@pytest.mark.parametrize("name", SCENES)
def test_each_kind_of_object_has_its_node(name: str, films: dict[str, Recording]) -> None:
    paths = {command["path"].lstrip("/") for command in replay_scene.commands(films[name].config)}
    assert NODES[name] <= paths
    kinds = {path.split("/")[0] for path in paths}
    assert ("emitters" in kinds, "movables" in kinds) == (name != "nothing", name != "nothing")


def test_walls_meet_at_the_corners_of_a_polygon(films: dict[str, Recording]) -> None:
    """Each is outside, along its edge, and as long as the edge and its mitres."""
    settings = films["polygon"].config
    corners = layout.outline(settings.arena)
    for i, (_, (length, thick), place) in enumerate(replay_scene._walls(settings, corners, 0.02)):
        along = corners[(i + 1) % 5] - corners[i]
        across = np.array([-along[1], along[0]])
        assert length > np.hypot(*along)
        inner = (place @ [0, thick / 2, 0, 1])[:2]
        assert across @ (inner - corners[i]) == pytest.approx(0, abs=1e-12)


def test_a_caption_tells_only_what_a_scene_has(films: dict[str, Recording]) -> None:
    told = {name: [label for label, _ in replay_data.facts(film)[2:]] for name, film in films.items()}
    assert told["nothing"] == []
    assert told["pucks"] == ["robots at the source", "all at a goal", "at a goal in the end"]
    assert told["round"] == ["robots at the beacon", "box at the goal"]
    assert told["polygon"] == ["robots at the source"]


def test_the_distance_is_of_the_nearest_that_is_not_delivered(films: dict[str, Recording]) -> None:
    settings = films["pucks"].config
    movables = np.tile([0.4, 0.4, 0.0], (10, 1))
    movables[0] = [-0.2, -0.2, 0.0]  # in the region
    movables[1] = [0.1, -0.2, 0.0]  # 0.1 m from it
    at_goal = np.arange(10) == 0
    assert layout.delivery_distance(settings, movables, at_goal) == pytest.approx(0.07)  # 0.4 + 0.03 from the east
    movables[2:] = [0.2, 0.4, 0.0]
    assert layout.delivery_distance(settings, movables, at_goal) == pytest.approx(0.1)
    assert layout.delivery_distance(films["nothing"].config, np.zeros((0, 3)), np.zeros(0)) is None


@pytest.mark.parametrize("name", SCENES)
def test_figures_are_of_the_scene(name: str, films: dict[str, Recording]) -> None:
    (axes,) = figures.paths(films[name]).axes
    west, east, south, north = films[name].config.arena.bounds
    assert axes.get_xlim()[0] < west < east < axes.get_xlim()[1]
    assert axes.get_ylim()[0] < south < north < axes.get_ylim()[1]
    assert np.isclose(figures.occupancy(films[name]).axes[0].images[0].get_array().sum(), 100)


DRAWN_TWICE = """(() => {
  const found = [];
  swarmevo.player.stages[0].scene.viewer.scene.traverse((node) => {
    if (node.material && node.material.transparent && node.material.side === 2) found.push(node.parent.name);
  });
  return found;
})()"""
"""What is clear and has two sides: each is drawn for itself, by programs that are looked up anew in each frame."""


@pytest.mark.parametrize("name", SCENES)
def test_the_page_shows_each_scene(name: str, browser: Browser, films: dict[str, Recording], tmp_path: Path) -> None:
    """Each movable is where it was, those that were pushed too; what a scene has not is not spoken of."""
    film = films[name]
    (tmp_path / "page.html").write_text(replay_page.render([replay_data.data(film, name)], name))
    with browsers.watch(browser, 900, 560) as watched:
        page = watched.open(tmp_path / "page.html")
        for t in (0.0, 7.9):
            page.evaluate(f"swarmevo.pause(); swarmevo.seek({t})")
            drawn(page)
            shown = np.array(page.evaluate("swarmevo.shown()")["movables"]).reshape(-1, 3)[:, :2]
            np.testing.assert_allclose(shown, film.telemetry.movables[0, round(10 * t), :, :2], atol=1e-4)
        browsers.keep(page, f"replay-{name}")
        assert page.locator(".sw-plot:visible").count() == (2 if name in ("pucks", "round") else 1)
        assert page.evaluate(DRAWN_TWICE) == []
        assert watched.errors == []


def test_a_puck_is_pushed_in_the_picture(films: dict[str, Recording]) -> None:
    """Else the page's test would see nothing move."""
    movables = films["pucks"].telemetry.movables[0]
    assert np.hypot(*(movables[-1] - movables[0])[:, :2].T).max() > 0.02


def test_an_emitter_rides_in_the_page(browser: Browser, films: dict[str, Recording], tmp_path: Path) -> None:
    film = films["round"]
    (tmp_path / "page.html").write_text(replay_page.render([replay_data.data(film, "")], ""))
    with browsers.watch(browser, 640, 420) as watched:
        page = watched.open(tmp_path / "page.html")
        page.evaluate("swarmevo.pause(); swarmevo.seek(0)")
        place = page.evaluate("swarmevo.player.stages[0].scene.emitters.map(({ node }) => node.position.toArray())")
        np.testing.assert_allclose(place, [[0.1, 0.345, 0.0], [0.5, 0.0, 0.0]], atol=1e-4)


# ---- served ----------------------------------------------------------------------------------------------------------


@contextmanager
def serving(page: str, episode: Callable[[int], replay_server.Events] | None = None) -> Iterator[int]:
    """Serve a page and give the port."""
    with replay_server.server(page, 0, episode) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        try:
            yield server.server_port
        finally:
            server.shutdown()
            thread.join()


@pytest.fixture
def live(run: Path) -> Iterator[str]:
    """Return the address of a server of live episodes."""
    page = replay_page.render([], "live", live=True)
    with serving(page, replay_server.live_episodes(run, None)) as port:
        yield f"http://127.0.0.1:{port}"


def test_the_server_is_of_this_machine_alone(live: str) -> None:
    with urllib.request.urlopen(f"{live}/") as answer:
        assert b"<title>live</title>" in answer.read()
    with pytest.raises(urllib.error.HTTPError, match="404") as refused:
        urllib.request.urlopen(f"{live}/config.yaml")
    refused.value.close()
    port = int(live.rpartition(":")[2])
    assert f"ssh -L {port}:127.0.0.1:{port} " in replay_server.hint(port)
    with pytest.raises(ReplayError, match=f"port {port}: Address already in use; choose another one with --port"):
        replay_server.server("", port)


def ask(address: str, path: str, **headers: str) -> int:
    connection = http.client.HTTPConnection(address.removeprefix("http://"), timeout=30)
    connection.request("GET", path, headers=headers)
    status = connection.getresponse().status
    connection.close()
    return status


@pytest.mark.parametrize("path", ["/", "/episode"])
def test_another_sites_page_gets_nothing(live: str, path: str) -> None:
    """Case 34: neither by a name that it had pointed at this machine, nor by a request of its own."""
    host = live.removeprefix("http://")
    port = host.partition(":")[2]
    foreign = [
        {"Host": f"evil.example:{port}"},
        {"Host": "127.0.0.1.evil.example"},
        {"Host": ""},
        {"Host": "["},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://localhost:1"},
    ]
    assert [ask(live, path, **headers) for headers in foreign] == [403] * len(foreign)
    ours = [{}, {"Host": f"localhost:{port}"}, {"Host": "localhost:9000"}, {"Host": "[::1]:80"}, {"Origin": live}]
    assert [ask(live, path, **headers) for headers in ours] == [200] * len(ours)


def test_idle_clients_are_few_and_are_sent_away(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 34: 150 connections that ask for nothing."""
    monkeypatch.setattr(replay_server, "IDLE_SECONDS", 3.0)
    with serving("page") as port, ExitStack() as clients:
        before = threading.active_count()
        idle = [clients.enter_context(socket.create_connection(("127.0.0.1", port), timeout=30)) for _ in range(150)]
        threads = [threading.active_count() for _ in range(50) if time.sleep(0.01) is None]
        assert before < max(threads) <= before + replay_server.MOST_CLIENTS
        answers = [client.recv(100) for client in idle]  # whichever way, the server ends each
        assert set(answers) == {b"HTTP/1.0 503 Too many connections\r\n\r\n", b""}
        while threading.active_count() > before:
            time.sleep(0.01)
        assert ask(f"http://127.0.0.1:{port}", "/") == 200


def test_a_page_is_served_however_slowly_it_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 34: the time limit is of a connection that takes nothing, not of a whole page."""
    monkeypatch.setattr(replay_server, "IDLE_SECONDS", 0.5)
    page = "x" * 20_000_000
    with serving(page) as port, socket.socket() as client:
        client.settimeout(30)
        client.connect(("127.0.0.1", port))
        client.sendall(b"GET / HTTP/1.0\r\nHost: 127.0.0.1\r\n\r\n")
        taken = 0
        while part := client.recv(1_000_000):
            taken += len(part)
            time.sleep(0.02)
        assert taken > len(page)


def test_the_live_page_plays_what_is_simulated(browser: Browser, live: str) -> None:
    context = browser.new_context(viewport={"width": 600, "height": 400})
    context.set_default_timeout(browsers.PATIENCE)
    page = context.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(live)
    page.wait_for_function("swarmevo.player.end === 30 && swarmevo.player.time > 0.5")
    assert "repeat 0" in page.inner_text(".sw-title")
    page.evaluate("swarmevo.pause(); swarmevo.seek(29.8); swarmevo.play()")
    page.wait_for_function("document.querySelector('.sw-title').innerText.includes('repeat 1')")
    context.close()
    assert errors == []


def test_a_live_failure_is_told_to_the_page() -> None:
    def broken(number: int) -> replay_server.Events:
        raise ReplayError("nothing there")
        yield

    with replay_server.server("", 0, broken) as server:
        thread = threading.Thread(target=server.handle_request)
        thread.start()
        with urllib.request.urlopen(f"http://127.0.0.1:{server.server_port}/episode") as answer:
            assert answer.read() == b'event: failed\ndata: "ReplayError: nothing there"\n\n'
        thread.join()


# ---- as a video ------------------------------------------------------------------------------------------------------


def test_a_film_is_made(file: Path, tmp_path: Path) -> None:
    if replay_video._chromium() is None:
        pytest.skip("needs Chromium: apt-get install chromium")
    film = replay_video.Film(start=2.0, end=6.0, speed=20.0, rate=10.0, size=(320, 180))
    seen: list[int] = []
    replay_video.write(tmp_path / "film.webp", file.read_text(), film, seen.append)
    with Image.open(tmp_path / "film.webp") as picture:
        assert getattr(picture, "n_frames", 1) == len(film.times()) == 3
        assert picture.size == (320, 180)
    assert seen == [1, 2, 3]


def test_what_a_film_needs_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ConfigError, match=r"expected a name that ends in \.webp or \.mp4"):
        replay_video.check(Path("film.gif"))
    monkeypatch.setattr(shutil, "which", lambda name: "/bin/true" if name == "chromium" else None)
    with pytest.raises(ReplayError, match="an mp4 needs ffmpeg: apt-get install ffmpeg"):
        replay_video.check(Path("film.mp4"))
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(ReplayError, match="needs Chromium, and there is none; install it"):
        replay_video.check(Path("film.webp"))


def test_a_browser_that_ends_is_an_error(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(replay_video, "_chromium", lambda: "/bin/true")
    with pytest.raises(ReplayError, match="Chromium ended unexpectedly"):
        replay_video.write(tmp_path / "film.webp", "", replay_video.Film(0, 1), lambda _: None)


# ---- the command -----------------------------------------------------------------------------------------------------


def command(*arguments: object) -> int:
    with pytest.raises(SystemExit) as exit:
        cli.main(["replay", *map(str, arguments)])
    return int(exit.value.code or 0)


def test_the_command_writes_a_page(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "page.html"
    assert command(f"{run}:1", "--html", file) == 0
    assert capsys.readouterr().out == f"{file}\n"
    assert "small, individual 1" in file.read_text()


def test_the_command_says_that_a_page_is_thinned(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 76."""
    monkeypatch.setattr(replay_episode, "data", partial(replay_data.data, most_bytes=THIN))
    assert command(run, "--html", tmp_path / "page.html") == 0
    assert re.fullmatch(r"long episode: 1 control step of \d+ is shown\n", capsys.readouterr().err)


def test_without_a_name_the_page_is_beside_the_run(run: Path, chosen: Chosen) -> None:
    assert command(run) == 0
    assert (run / f"replay-{chosen.genome}.html").exists()


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ([":999"], 1, "there is no individual 999"),
        (["", "--robots", "5-1"], 2, "--robots: expected a team size from 1 to 64"),
        (["", "--robots", "1-9"], 2, "or up to 8 sizes as in 1-5, got '1-9'"),
        (["", "--video", "x.webp", "--seconds", "9-3"], 2, "--seconds: expected a span such as 10-40"),
        (["", "--html", "/dev/null/page.html"], 1, "/dev/null: Not a directory"),
        (["x"], 1, "expected a run folder"),
    ],
)
def test_errors_are_one_line(
    run: Path, arguments: list[str], code: int, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command(f"{run}{arguments[0]}", *arguments[1:]) == code
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1

# SPDX-License-Identifier: BSD-3-Clause
"""The report: what is in the page, and in a real Chromium, without a network, what a reader can do with it."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import shutil
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page

import seals
import small_runs
from browser import Watched, chromium, pixels, watch
from swarmevo import cli
from swarmevo.analysis import assessment, fronts
from swarmevo.errors import StoreError
from swarmevo.runs.store import CONFIG_FILE, PROVENANCE_FILE, Store
from swarmevo.runs.tests_file import TESTS_FILE
from swarmevo.views import figures
from swarmevo.views.figures import writing
from swarmevo.views.report import page as report
from swarmevo.views.report import run as report_run

ARTEFACTS = os.environ.get("SWARMEVO_ARTEFACTS")
"""Folder that keeps screenshots, if it is set."""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = small_runs.make(tmp_path_factory.mktemp("runs") / "a <b>run", "episode.horizon=4")
    with Store.open(folder) as store:
        assessment.assess(store, (1, 3), 2, robustness=True, workers=1)
    return folder


@pytest.fixture(scope="module")
def page_file(run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return report.write([run], tmp_path_factory.mktemp("report") / "report.html")


def embedded(text: str) -> Any:
    (data,) = re.findall(r'<script type="application/json" id="report-data">(.*?)</script>', text, re.DOTALL)
    return json.loads(data)


# ---- the file --------------------------------------------------------------------------------------------------------


def test_the_page_knows_every_point_and_its_episode(run: Path, page_file: Path) -> None:
    (data,) = embedded(page_file.read_text())
    with Store.open(run) as store:
        points = [(trial, p.genome) for trial in store.trials() for p in fronts.front(store, trial)]
        best = {(p.trial, p.genome) for p in fronts.front(store)}
    assert [(point["trial"], point["genome"]) for point in data["points"]] == points
    assert {(point["trial"], point["genome"]) for point in data["points"] if point["front"]} == best
    assert sorted(point["episode"] for point in data["points"]) == list(range(len(points)))
    assert all(episode["warning"] == "" for episode in data["episodes"])  # each is the stored one, to the last bit
    assert all("scene" not in episode for episode in data["episodes"])


def test_the_note_of_the_tests_is_of_sentences(page_file: Path) -> None:
    (note,) = re.findall(r'<h2>Tests</h2>\s*<p class="note">(.*?)</p>', page_file.read_text(), re.DOTALL)
    assert "in small print the paper's Table II. Max: never within 4\N{NO-BREAK SPACE}s." in note


def test_a_third_objective_is_said_not_to_be_drawn(browser: Browser, tmp_path: Path) -> None:
    folder = small_runs.make(tmp_path / "run", "fitness={box_pushing: {}, hidden_neurons: {}, coverage: {}}")
    report.write([folder], tmp_path / "three.html")
    with watch(browser) as found:
        page = found.open(tmp_path / "three.html")
        assert page.inner_text(".beyond") == "not drawn: coverage, in which a point may be better"
        assert found.errors == []


@pytest.mark.parametrize(
    ("shares", "told"),
    [((0.04, 0.0), "none in 5% of the robots or more"), ((0.04, 0.3), "circling together 30%")],
)
def test_a_points_other_behaviours(run: Path, shares: tuple[float, float], told: str) -> None:
    with Store.open(run) as store:
        found = report_run.Run.of(store, 0, "run", lambda what: None)
        assert found.tests is not None
        behaviours = dict(zip(("static near a wall", "circling together"), shares, strict=True))
        controllers = [dataclasses.replace(one, behaviours=behaviours) for one in found.tests.controllers]
        found = dataclasses.replace(found, tests=dataclasses.replace(found.tests, controllers=controllers))
        assert dict(report_run._facts(store, found, found.opened))["other behaviours in fresh tests"] == told


@pytest.mark.parametrize(
    ("push", "home", "why"),
    [
        (0.1, 0.5, "the one shown first succeeds most often"),
        (0.0, 0.5, "nobody succeeds, and the one shown first is best in: robots at the source"),
        (0.0, 0.0, "nobody succeeds, and the one shown first is best in: box pushing"),
    ],
)
def test_it_says_why_who_is_shown_first(run: Path, push: float, home: float, why: str) -> None:
    with Store.open(run) as store:
        found = report_run.Run.of(store, 0, "run", lambda what: None)
    points = [dataclasses.replace(point, push_rate=push, homing_rate=home) for point in found.points]
    assert dataclasses.replace(found, points=points, opened=points[0], tests=None).first_shown == why


def test_only_so_many_replays_the_best_first(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(report_run, "MOST_REPLAYS", 1)
    (data,) = embedded(report.page([run]))
    assert len(data["episodes"]) == 1
    assert all(point["front"] for point in data["points"] if point["episode"] is not None)


def test_a_runs_text_cannot_become_markup(page_file: Path) -> None:
    text = page_file.read_text()
    assert "<b>run" not in text
    assert "a &lt;b&gt;run" in text


def test_text_of_a_strangers_run_cannot_become_markup(run: Path, tmp_path: Path) -> None:
    evil = "<img src=x onerror=alert(1)>"
    folder = shutil.copytree(run, tmp_path / evil)
    (folder / TESTS_FILE).unlink()  # of a run with another provenance
    config = folder / CONFIG_FILE
    config.write_text(f"{config.read_text()}# {evil}\n")
    origin = json.loads((folder / PROVENANCE_FILE).read_text()) | {"cpu": evil, evil: [evil]}
    seals.change(folder, "UPDATE session SET provenance = ?", json.dumps(origin))
    text = report.page([folder])
    assert "<img" not in text
    name, command, provenance, settings = 2, 1, 3, 1
    assert text.count("&lt;img src=x onerror=alert(1)&gt;") == name + command + provenance + settings
    assert [point["facts"] for point in embedded(text)[0]["points"]]


def test_the_page_tells_the_tests_and_the_papers(page_file: Path) -> None:
    text = page_file.read_text()
    assert "Table II" in text
    assert "<small>13%</small>" in text
    assert "Robustness" in text
    assert "static near a wall" in text


def test_a_run_without_tests_says_how_to_make_them(tmp_path: Path) -> None:
    folder = small_runs.make(tmp_path / "run", "evolution.trials=1")
    assert f"swarmevo test {folder}" in report.page([folder])


def test_the_page_tells_where_the_run_comes_from(run: Path, page_file: Path) -> None:
    text = page_file.read_text()
    origin = json.loads((run / PROVENANCE_FILE).read_text())
    assert origin["config_sha256"] in text
    assert f"<dd>{escape(', '.join(origin['plugins']))}</dd>" in text
    assert f"<dd>{escape(origin['library']['build'])}</dd>" in text
    assert f">{escape((run / CONFIG_FILE).read_text())}</pre>" in text


def test_the_same_run_gives_the_same_page(run: Path, page_file: Path) -> None:
    assert report.page([run]) == page_file.read_text()


def test_a_run_without_a_generation_is_refused(tmp_path: Path) -> None:
    from swarmevo import config
    from swarmevo.runs import driver

    driver.begin(tmp_path / "run", config.load("quick", small_runs.SMALL))
    with pytest.raises(StoreError, match="at least one generation to report"):
        report.page([tmp_path / "run"])


# ---- commands --------------------------------------------------------------------------------------------------------


def command(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as exit:
        cli.main([str(argument) for argument in arguments])
    return exit.value.code or 0, *capsys.readouterr()  # type: ignore[return-value]


def test_report_prints_its_path(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = command(capsys, "report", run, run, "--html", tmp_path / "both.html")
    assert (code, out) == (0, f"{tmp_path / 'both.html'}\n")
    text = (tmp_path / "both.html").read_text()
    assert text.count("<article") == 2
    assert "The global fronts of the runs." in text
    assert "Hypervolume over the generations: each run" in text


def test_runs_that_share_their_objectives_are_overlaid(run: Path, tmp_path: Path) -> None:
    """Who shares them with nobody is named; so are the others, for there is one who is left out."""
    other = small_runs.make(tmp_path / "other", "fitness=box_pushing")
    shutil.copytree(run, tmp_path / "same")
    text = report.page([run, other, tmp_path / "same"])
    assert "The global fronts of a &lt;b&gt;run, same." in text
    assert "Not in these charts, for no other run has their objectives: other." in text
    text = report.page([run, other])
    assert "The runs have different objectives" in text
    assert "The global fronts of" not in text


def test_several_runs_need_a_file(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = command(capsys, "report", run, run)
    assert (code, out) == (2, "")
    assert "--html" in err


def test_runs_of_one_name_are_told_apart(run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 58: the figures of the first run were overwritten, and both runs were called alike."""
    monkeypatch.setattr(writing, "every", lambda run, width: iter([("fronts", figures.fronts(run, width))]))
    folders = [tmp_path / name for name in ("x/a", "y/a", "y/a-2")]
    for folder in folders:
        shutil.copytree(run, folder)
    assert report.names(folders) == ["a", "a-3", "a-2"]
    found = re.findall(r"<h1[^>]*>([^<]*)</h1>", report.page(folders[:2]))
    assert [name.strip() for name in found] == ["a", "a-2"]
    files = report.write_figures(folders[:2], tmp_path / "figures")
    assert {file.parent.name for file in files} == {"a", "a-2"}
    assert len(set(files)) == len(files)


def test_figures_have_the_width_that_is_asked_for(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(writing, "every", lambda run, width: iter([("fronts", figures.fronts(run, width))]))
    monkeypatch.setattr(report, "write", lambda runs, file, observe: file)
    for options, inches in (([], 3.5), (["--width", "7"], 7.0)):
        assert command(capsys, "report", run, "--figures", tmp_path, *options)[0] == 0
        with Image.open(tmp_path / "fronts.png") as picture:
            assert picture.width == 300 * inches
    code, _, err = command(capsys, "report", run, "--width", "7")
    assert (code, err) == (2, "error: --width: has no effect without --figures; leave it out\n")


def test_a_file_that_cannot_be_written_is_named(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "taken").write_text("")
    code, _, err = command(capsys, "report", run, "--html", tmp_path / "taken" / "report.html")
    assert code == 1
    assert err.splitlines()[-1].startswith(f"error: {tmp_path / 'taken'}")


def test_test_prints_the_table_and_stores_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = small_runs.make(tmp_path / "run", "evolution.trials=1")
    code, out, err = command(capsys, "test", folder, "--robots", "3", "--repeats", "1", "--workers", "1")
    assert code == 0
    assert "(98%)" in out
    assert err.splitlines()[-1] == f"stored in {folder / TESTS_FILE}"
    code, out, _ = command(capsys, "test", folder, "--robots", "1-2", "--repeats", "1", "--workers", "1", "--json")
    assert [row["robots"] for row in json.loads(out)["rows"]] == [1, 2]


@pytest.mark.parametrize("robots", ["0", "5-1", "65", "many", "1-"])
def test_wrong_team_sizes(run: Path, robots: str, capsys: pytest.CaptureFixture[str]) -> None:
    code, _, err = command(capsys, "test", run, "--robots", robots)
    assert code == 2
    assert err.startswith("error: --robots: expected a team size")


# ---- in a browser ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as started:
        yield started


@pytest.fixture(scope="module")
def watched(browser: Browser, page_file: Path) -> Iterator[Watched]:
    with watch(browser, width=1280, height=860) as found:
        found.open(page_file)
        yield found
        assert found.errors == []
        assert found.requests == []


def keep(page: Page, name: str) -> None:
    if ARTEFACTS:
        Path(ARTEFACTS).mkdir(parents=True, exist_ok=True)
        page.screenshot(path=Path(ARTEFACTS) / f"report-{name}.png", full_page=True)


def test_the_page_opens_offline_without_errors(watched: Watched) -> None:
    assert watched.page.title() == "a <b>run · swarmevo"
    assert watched.page.locator("[data-point]").count() == len(watched.page.evaluate("swarmevoReport[0].run.points"))
    keep(watched.page, "light")


def test_the_best_controller_waits_on_the_stage(watched: Watched) -> None:
    canvas = watched.page.locator("[data-stage] canvas")
    assert np.unique(pixels(canvas.screenshot()).reshape(-1, 3), axis=0).shape[0] > 50  # it is not blank
    assert watched.page.evaluate("swarmevoReport[0].player.playing") is False


@pytest.mark.parametrize("key", [None, "Enter"])
def test_choosing_a_point_plays_its_replay(watched: Watched, key: str | None) -> None:
    page = watched.page
    last = page.locator("[data-point]").count() - 1
    point = page.locator(f"[data-point='{last}']")
    page.evaluate("swarmevoReport[0].choose(0, false)")
    point.press(key) if key else point.dispatch_event("click")
    genome = page.evaluate(f"swarmevoReport[0].run.points[{last}].genome")
    assert page.locator("[data-title]").inner_text() == f"Individual {genome}"
    assert f"Individual {genome}" in page.locator("[data-stage] .sw-title").inner_text()
    page.wait_for_function("swarmevoReport[0].player.time > 0.5")
    assert point.get_attribute("aria-pressed") == "true"
    page.evaluate("swarmevoReport[0].player.pause()")


def test_robots_move_between_two_seeks(watched: Watched) -> None:
    shown = [
        watched.page.evaluate(f"(swarmevoReport[0].choose(0, false), swarmevoReport[0].player.seek({t}),"
                              " [swarmevoReport[0].player.shown()[0], swarmevoReport[0].player.poses(%s)[0]])" % t)
        for t in (0.5, 3.5)
    ]  # fmt: skip
    for seen, stored in shown:
        assert np.allclose(seen["robots"], stored["robots"], atol=1e-6)
    assert not np.allclose(shown[0][0]["robots"], shown[1][0]["robots"], atol=1e-3)


def test_pointing_tells_the_numbers(watched: Watched) -> None:
    page = watched.page
    page.locator("[data-point='0']").dispatch_event("pointerenter")
    said = page.locator(".tip").inner_text()
    assert "box pushing" in said
    assert "robots at the source" in said
    page.locator("[data-point='0']").dispatch_event("pointerleave")
    assert page.locator(".tip").is_hidden()


def test_the_network_is_the_chosen_ones(watched: Watched) -> None:
    page = watched.page
    for k in range(page.locator("[data-point]").count()):
        page.evaluate(f"swarmevoReport[0].choose({k}, false)")
        hidden = page.evaluate(f"swarmevoReport[0].run.points[{k}].values[1]")
        assert f"{hidden} hidden neuron" in page.locator("[data-network-place] svg").inner_html()


@pytest.mark.parametrize(("name", "width", "dark"), [("dark", 1280, True), ("phone", 390, False)])
def test_other_screens(browser: Browser, page_file: Path, name: str, width: int, dark: bool) -> None:
    with watch(browser, width=width, height=844, dark=dark) as found:
        page = found.open(page_file)
        assert page.evaluate("document.documentElement.scrollWidth") == width  # nothing sticks out
        ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert (sum(map(int, re.findall(r"\d+", ground))) < 150) == dark
        keep(page, name)
        assert found.errors == []
        assert found.requests == []

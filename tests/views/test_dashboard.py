# SPDX-License-Identifier: BSD-3-Clause
"""The dashboard: which runs it finds, what it tells its page, and whom it answers. The page: test_dashboard_page.py."""

from __future__ import annotations

import hashlib
import http.client
import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import small_runs
from dashboards import serving
from swarmevo import cli
from swarmevo.analysis import fronts
from swarmevo.analysis.course import Standing
from swarmevo.analysis.following import Following
from swarmevo.errors import ReplayError, StoreError, SwarmevoError
from swarmevo.runs.store import Store
from swarmevo.views.dashboard import episode, facts, page, server, watch
from swarmevo.views.dashboard.watch import Watch


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a run, another one in a folder of it, what is left of a third, and other things."""
    folder = tmp_path_factory.mktemp("dashboard")
    small_runs.make(folder / "a <b>run")
    (folder / "study").mkdir()
    shutil.copytree(folder / "a <b>run", folder / "study" / "copy")
    (folder / "broken").mkdir()
    (folder / "broken" / "run.sqlite").write_text("no database")
    (folder / "notes" / "deep" / "deeper").mkdir(parents=True)
    (folder / ".hidden").mkdir()
    shutil.copytree(folder / "a <b>run", folder / ".hidden" / "run")
    (folder / "file").write_text("")
    (folder / "up").symlink_to("..", target_is_directory=True)
    return folder


def looked(watch: Watch, *opened: str, times: int = 2) -> list[dict[str, Any]]:
    for _ in range(times):
        snapshot, _ = watch.look(opened)
    runs: list[dict[str, Any]] = json.loads(snapshot.runs)["runs"]
    return runs


def files(folder: Path) -> dict[str, str]:
    return {
        str(file): hashlib.sha256(file.read_bytes()).hexdigest() for file in sorted(folder.rglob("*")) if file.is_file()
    }


# ---- which runs there are --------------------------------------------------------------------------------------------


def test_runs_are_found_and_nothing_else(place: Path) -> None:
    before = files(place)
    runs = looked(Watch(place))
    assert [(run["name"], run["state"]) for run in runs] == [
        ("a <b>run", "finished"),
        ("study/copy", "finished"),
        ("broken", "broken"),
    ]
    assert runs[2]["said"] == f"{place / 'broken' / 'run.sqlite'}: is damaged, or no run of swarmevo"
    assert files(place) == before


def test_a_run_alone_can_be_watched(place: Path) -> None:
    assert [run["name"] for run in looked(Watch(place / "study" / "copy"))] == ["copy"]


def test_runs_come_and_go(place: Path, tmp_path: Path) -> None:
    watch = Watch(tmp_path / "runs")
    assert looked(watch) == []
    shutil.copytree(place / "a <b>run", tmp_path / "runs" / "first")
    (first,) = looked(watch)
    shutil.copytree(place / "a <b>run", tmp_path / "runs" / "second")
    assert {run["name"] for run in looked(watch, first["id"])} == {"first", "second"}
    shutil.rmtree(tmp_path / "runs" / "first")
    snapshot, more = watch.look([first["id"]])
    assert ([run["name"] for run in json.loads(snapshot.runs)["runs"]], snapshot.details, more) == (
        ["second"],
        {},
        False,
    )
    shutil.rmtree(tmp_path / "runs")
    assert looked(watch) == []


def test_a_name_that_is_no_text_is_shown_and_has_an_id(place: Path, tmp_path: Path) -> None:
    os.symlink(place / "a <b>run", os.fsencode(tmp_path) + b"/\xff\n")
    (run,) = looked(Watch(tmp_path))
    assert (run["name"], len(run["id"])) == ("\\udcff\\n", 16)


def test_not_more_folders_than_can_be_looked_into(place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watch, "MOST_FOLDERS", 5)
    for number in range(9):
        (tmp_path / f"folder-{number}").mkdir()
    snapshot, _ = Watch(tmp_path).look()
    assert json.loads(snapshot.runs)["note"] == "There are more than 5 folders here; not all were looked into."


def test_of_many_runs_some_are_looked_at_first(place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watch, "FIRST_LOOKS_AT_ONCE", 2)
    for number in range(4):
        (tmp_path / f"run-{number}").symlink_to(place / "a <b>run", target_is_directory=True)
    watched, states = Watch(tmp_path), []
    for _ in range(2):
        snapshot, more = watched.look()
        states.append((sorted(run["state"] for run in json.loads(snapshot.runs)["runs"]), more))
    assert states == [(["finished", "finished", "opening", "opening"], True), (["finished"] * 4, False)]
    opened = Watch(tmp_path)
    monkeypatch.setattr(watch, "FIRST_LOOKS_AT_ONCE", 0)
    snapshot, _ = opened.look([watched.ids[3]])
    assert list(snapshot.details) == [watched.ids[3]]
    assert json.loads(snapshot.details[watched.ids[3]])["points"]


def test_one_run_that_makes_no_sense_leaves_the_others(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    look = Following.look

    def nonsense(run: Following) -> Any:
        return look(run) if run.folder.name == "copy" else 1 / 0

    monkeypatch.setattr(Following, "look", nonsense)
    states = {run["name"]: (run["state"], run["said"]) for run in looked(Watch(place))}
    assert states["study/copy"] == ("finished", "")
    assert states["a <b>run"] == ("broken", "ZeroDivisionError: division by zero")


# ---- what is told of a run -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def detail(place: Path) -> dict[str, Any]:
    watch = Watch(place)
    (run, *_) = looked(watch)
    snapshot, more = watch.look([run["id"]])
    assert more is False
    found: dict[str, Any] = json.loads(snapshot.details[run["id"]])
    return found


def test_a_runs_points_and_hypervolume_are_those_of_show(place: Path, detail: dict[str, Any]) -> None:
    with Store.open(place / "a <b>run") as store:
        summary = fronts.summarise(store)
    best = {(point.trial, point.genome) for point in summary.front}
    expected = {
        (point.trial, point.genome, point.last_generation, (point.trial, point.genome) in best)
        for trial in summary.trials
        for point in trial.front
    }
    assert {(p["trial"], p["genome"], p["generation"], p["front"]) for p in detail["points"]} == expected
    assert [course["hypervolumes"] for course in detail["courses"]] == [
        [step.hypervolume for step in trial.history] for trial in summary.trials
    ]
    assert (detail["share"], detail["faults"], detail["left"]) == (1.0, 0, "")
    assert detail["beyond"] == ""
    assert detail["done"] == "4 of 4 generations in 2 trials"


@pytest.mark.parametrize(("last", "lived"), [(87, "generation 87"), (90, "generations 87 to 90")])
def test_who_lived_in_one_generation_has_one(last: int, lived: str) -> None:
    one = Standing(5, 87, last, 3, [])
    assert ("lived in", f"trial 2, {lived}") in facts._point(Following(Path("none")), 2, one, is_best=True)["facts"]


def test_what_is_drawn_has_a_limit(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(facts, "MOST_POINTS", 1)
    monkeypatch.setattr(facts, "MOST_STEPS", 1)
    run = Following(place / "a <b>run")
    run.look()
    run.take(10**9)
    found = facts.detail("", "", run)
    (point,) = found["points"]
    assert point["front"]
    assert found["undrawn"] == sum(map(len, run.fronts)) - 1
    assert [len(course["generations"]) for course in found["courses"]] == [1, 1]


def test_a_long_course_is_thinned_and_keeps_its_end() -> None:
    run = Following(Path("none"))
    step = fronts.Step(0, 1, 0.5, 1, 1, False, {})
    steps = [fronts.Step(number, 1, float(number), 1, 1, False, {}) for number in range(100_000)]
    course = facts._course(3, steps)
    assert len(course["generations"]) == facts.MOST_STEPS
    assert (course["generations"][0], course["generations"][-1], course["hypervolumes"][-1]) == (0, 99_999, 99_999.0)
    assert facts._course(0, [step])["hypervolumes"] == [0.5]
    assert run.fronts == []


def test_an_individuals_stored_episode_is_replayed(place: Path, detail: dict[str, Any]) -> None:
    point = detail["points"][0]
    folder = place / "a <b>run"
    found = episode.replayed(folder, point["trial"], point["generation"], point["genome"])
    assert (found["title"], found["warning"]) == (f"Individual {point['genome']}", "")  # the stored bits
    assert sum(chunk["steps"] for chunk in found["chunks"]) == 20
    assert (found["repeat"], len(found["repeats"])) == (0, 1)
    with pytest.raises(ReplayError, match=r"individual 99 was not evaluated in generation 0$"):
        episode.replayed(folder, 0, 0, 99)
    with pytest.raises(StoreError):
        episode.replayed(folder, 0, 99, 1)


def test_any_repeat_is_replayed(tmp_path: Path) -> None:
    folder = small_runs.make(tmp_path / "run", "evolution.repeats=3", "episode.horizon=20", "team.robots=5")
    with Store.open(folder) as store:
        best, trial = store.genome_ids(0, 1)[0], 0
        episodes = store.lives(int(best), trial, 1).episodes
    for repeat in range(3):
        found = episode.replayed(folder, trial, 1, int(best), repeat)
        time = episodes["push_time"][repeat]
        said = "not pushed" if np.isnan(time) else f"box at the wall after {time:.1f} s"
        assert (found["repeat"], found["warning"]) == (repeat, "")
        assert found["repeats"][repeat] == f"{repeat}, {said}"
    with pytest.raises(ReplayError, match="expected a repeat from 0 to 2, got 3"):
        episode.replayed(folder, trial, 1, int(best), 3)


# ---- served ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def port(place: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    with serving(Watch(place), monkeypatch) as port:
        yield port


def ask(port: int, path: str, method: str = "GET", **headers: str) -> tuple[int, bytes]:
    with closing(http.client.HTTPConnection("127.0.0.1", port, timeout=30)) as connection:
        connection.request(method, path, headers=headers)
        answer = connection.getresponse()
        return answer.status, answer.read(2_000_000) if answer.getheader("Content-Length") else b""


def events(port: int, path: str) -> Iterator[tuple[str, Any]]:
    """Yield server-sent events as they come."""
    with closing(http.client.HTTPConnection("127.0.0.1", port, timeout=30)) as connection:
        connection.request("GET", path)
        answer = connection.getresponse()
        assert answer.getheader("Content-Type") == "text/event-stream; charset=utf-8"
        name = ""
        while line := answer.readline().decode().rstrip():
            name = line.removeprefix("event: ")
            yield name, json.loads(answer.readline().decode().removeprefix("data: "))
            assert answer.readline() == b"\n"


def test_the_page_is_told_what_there_is_and_what_is_new(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(place / "a <b>run", tmp_path / "first")
    with serving(Watch(tmp_path), monkeypatch) as port:
        (run,) = next(events(port, "/events"))[1]["runs"]
        told = events(port, f"/events?run={run['id']}")
        assert next(told)[0] == "runs"
        name, detail = next(told)
        assert (name, detail["name"], len(detail["courses"])) == ("run", "first", 2)
        shutil.copytree(place / "a <b>run", tmp_path / "second")
        name, second = next(told)
        assert {run["name"] for run in second["runs"]} >= {"first", "second"}
        point = detail["points"][0]
        query = f"run={run['id']}&trial={point['trial']}&generation={point['generation']}&genome={point['genome']}"
        status, found = ask(port, f"/episode?{query}")
        assert (status, json.loads(found)["title"]) == (200, f"Individual {point['genome']}")
        status, found = ask(port, f"/episode?{query}9")
        assert (status, list(json.loads(found))) == (409, ["error"])
        assert ask(port, f"/config?run={run['id']}") == (200, (tmp_path / "first" / "config.yaml").read_bytes())


def test_it_answers_its_own_page_alone(port: int) -> None:
    foreign = [
        {"Host": f"evil.example:{port}"},
        {"Host": "127.0.0.1.evil.example"},
        {"Host": ""},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
    ]
    for path in ("/", "/events", "/episode", "/config"):
        assert [ask(port, path, **headers)[0] for headers in foreign] == [403] * len(foreign)
    ours = [{}, {"Host": f"localhost:{port}"}, {"Origin": f"http://127.0.0.1:{port}"}]
    assert [ask(port, "/", **headers)[0] for headers in ours] == [200] * len(ours)


@pytest.mark.parametrize("path", ["/", "/events", "/episode", "/config"])
@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE"])
def test_nothing_can_be_changed(port: int, path: str, method: str) -> None:
    assert ask(port, path, method)[0] == 405


def test_no_path_leads_to_a_file(port: int, place: Path) -> None:
    paths = ["/config.yaml", "/../etc/passwd", "/%2e%2e/file", "//file", "/file", "/a%20%3Cb%3Erun/config.yaml"]
    assert [ask(port, path)[0] for path in paths] == [404] * len(paths)
    for run in ("..", "../..", "a <b>run", str(place / "a <b>run"), "%00", "x" * 3000, ""):
        query = f"?run={run}".replace(" ", "%20")
        assert [ask(port, f"/{what}{query}")[0] for what in ("config", "episode")] == [404, 404]
    (run, *_) = next(events(port, "/events"))[1]["runs"]
    for place_of in (
        "trial=-1&generation=0&genome=1",
        "trial=0&generation=0",
        "trial=0&generation=0&genome=" + "9" * 30,
    ):
        assert ask(port, f"/episode?run={run['id']}&{place_of}")[0] == 404


def test_a_taken_port_is_one_clear_line(port: int) -> None:
    with pytest.raises(SwarmevoError, match=f"^port {port}: Address already in use; choose another one with --port$"):
        server.listen(port)


def test_the_page_asks_nobody_else() -> None:
    text = page.render()
    assert "connect-src 'self'" in text
    assert not [word for word in ('src="http', 'href="http', "@import", "url(http") if word in text]


def test_without_the_extra_it_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    monkeypatch.delitem(sys.modules, "swarmevo.views.dashboard.server")
    monkeypatch.delattr("swarmevo.views.dashboard.server")
    with pytest.raises(SystemExit) as exit:
        cli.main(["dashboard", str(tmp_path)])
    assert exit.value.code == 1
    assert capsys.readouterr().err == (
        "error: uvicorn: expected it installed for the dashboard; pip install 'swarmevo[dashboard]'\n"
    )


def test_ctrl_c_ends_it_while_pages_listen(place: Path) -> None:
    command = [sys.executable, "-m", "swarmevo", "dashboard", str(place), "--port", "0"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr is not None
        hint = process.stderr.readline()
        port = int(hint.split("/")[2].partition(":")[2])
        assert f"ssh -L {port}:127.0.0.1:{port} " in hint
        told = events(port, "/events")
        assert next(told)[0] == "runs"
        other = subprocess.run([*command[:-1], str(port)], capture_output=True, text=True)
        assert (other.returncode, other.stderr.count("\n")) == (1, 1)
        process.send_signal(signal.SIGINT)
        list(told)  # ends
        assert (process.wait(30), process.stderr.read()) == (0, "")
    finally:
        process.kill()
        process.communicate()

# SPDX-License-Identifier: BSD-3-Clause
"""A zoo of plugins that misbehave in the middle of a run: the fault is named, and what was stored before is of use.

Each run misbehaves after its first generation, or, in what is asked only when plugins are made, when it goes on after
that: the command ends with one line, and not with the exit code 0. Then the plugin is repaired, and the run has to end
with the bits of one that never went wrong.
"""

from __future__ import annotations

import os
import re
import signal
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import zoo_deeds
import zoo_plugins
from conftest import installer
from swarmevo import cli
from swarmevo.cli.common import StopOnSignal
from swarmevo.cli.process import own_stdout
from swarmevo.errors import ReplayError, SwarmevoError
from swarmevo.evolution.loop import Progress
from swarmevo.printable import printable
from swarmevo.runs import driver, export, verification
from swarmevo.runs.store import Store
from swarmevo.views.replay import episode as replay_episode
from swarmevo.views.report import page as report
from zoo_deeds import HARMLESS, RAISED, RETURNED, Deed, raising

METHODS = {  # but for "terms", which evolution does not ask for
    "zoo_network": ["space", "policies", "complexity"],
    "zoo_linear": ["start", "act"],
    "zoo_travel": ["objectives", "channels", "evaluate"],
    "zoo_places": ["descriptors", "describe"],
    "zoo_search": ["factory", "ask", "tell", "state", "restore"],
    "zoo_answering": ["answer"],
}
EVERY_METHOD = [(plugin, method) for plugin in METHODS for method in METHODS[plugin]]
MAKING = {"space", "objectives", "channels", "descriptors", "factory", "restore"}
"""Asked only before the first generation of a session."""
IN_EPISODES = {"policies", "complexity", "start", "act", "evaluate", "describe"}


@pytest.fixture(autouse=True, scope="module")
def _plugins(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        zoo_plugins.install(installer(tmp_path_factory.mktemp("zoo"), patch))
        yield


@pytest.fixture(autouse=True)
def _calm() -> Iterator[None]:
    yield
    zoo_plugins.calm()


def go_on(folder: Path, observe: Callable[[Progress], None] = lambda now: None, workers: int = 2) -> None:
    """Continue a run as the command does: with handlers of signals, and stdout of its own."""
    with Store.open(folder, readonly=False) as store, StopOnSignal() as stop, own_stdout():
        driver.evolve(store, workers, observe, stop)


def begin(folder: Path, plugin: str, method: str, deed: Deed, **evolution: Any) -> None:
    """Run a generation; from then on the method misbehaves."""

    class Enough(Exception):  # noqa: N818 - no error
        pass

    def leave(now: Progress) -> None:
        raise Enough

    driver.begin(folder, zoo_plugins.config(plugin, **evolution))
    with pytest.raises(Enough):
        go_on(folder, leave)
    zoo_plugins.misbehave(plugin, method, deed)


def content(folder: Path) -> list[Any]:
    with Store.open(folder) as store:
        kept = [store.generation(0, number) for number in range(store.generations(0))]
        return [
            (one.genomes.tobytes(), one.episodes["objective"].tobytes(), one.episodes["hash"].tolist()) for one in kept
        ]


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Any]]:
    """What runs in which nothing goes wrong store."""
    found = {}
    for plugin in METHODS:
        folder = tmp_path_factory.mktemp("sound") / "run"
        driver.begin(folder, zoo_plugins.config(plugin))
        go_on(folder)
        found[plugin] = content(folder)
    return found


def assert_of_use(folder: Path, sound: list[Any]) -> None:
    """Assert that a run holds what it should, and that a repaired plugin brings it to its end."""
    zoo_plugins.calm()
    assert content(folder) == sound[: len(content(folder))]
    with Store.open(folder) as store:
        assert not store.damage()
        assert verification.verify(store, 1).is_sound
    go_on(folder)
    assert content(folder) == sound


def assert_fault(folder: Path, plugin: str, method: str, deed: Deed, told: str, sound: list[Any]) -> None:
    begin(folder, plugin, method, deed)
    line = refusal(folder)
    assert_named(line, plugin, method)
    assert told in line
    assert_of_use(folder, sound)


def refusal(folder: Path) -> str:
    """Return the one line with which the command fails to go on with a run."""
    return failure(1, "resume", str(folder), "--workers", "2")


def failure(code: int, *arguments: str) -> str:
    """Return the one line with which a command fails, as it is printed."""
    (line,) = [line for line in said(code, *arguments) if line.startswith("error: ")]
    assert line.isprintable()
    return line


def said(code: int, *arguments: str) -> list[str]:
    """Return what a command prints to stderr before it ends with this exit code."""
    with pytest.MonkeyPatch.context() as patch:
        lines: list[str] = []
        patch.setattr("swarmevo.cli.common.say", lambda line: lines.append(printable(line)))
        with pytest.raises(SystemExit) as end:
            cli.main(arguments)
    assert end.value.code == code
    return lines


def assert_named(line: str, plugin: str, method: str) -> None:
    """Assert that a line names the plugin, its distribution, the method and the episode."""
    assert plugin in line
    assert "zoo 1.0" in line
    assert method in line or method == "factory"
    if method in IN_EPISODES:
        assert re.search(r"trial 0, generation 1, individual \d, repeat 0", line)
    if method in ("ask", "tell", "state", "restore", "answer"):
        assert "trial 0, generation 1" in line


# ---- what raises -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("raised", RAISED)
@pytest.mark.parametrize(("plugin", "method"), EVERY_METHOD)
def test_what_a_plugin_raises_is_its_fault(
    tmp_path: Path, sound: dict[str, list[Any]], plugin: str, method: str, raised: str
) -> None:
    """Cases 1, 7, 9 and 29."""
    deed, told = RAISED[raised]
    assert_fault(tmp_path / "run", plugin, method, deed, told, sound[plugin])


def test_the_replay_of_a_failed_episode_is_its_stored_reason(tmp_path: Path) -> None:
    """Case 8."""
    calls: list[None] = []

    def every_other_time(sound: Any) -> Any:
        calls.append(None)
        return sound if len(calls) % 2 else raising(KeyError("nobody"))(sound)

    begin(tmp_path / "run", "zoo_travel", "evaluate", every_other_time, on_fault="worst")
    go_on(tmp_path / "run")
    with Store.open(tmp_path / "run") as store:
        faults = store.generation(0, 1).episodes.faults
        (failed,) = [int(id) for id, fault in zip(store.genome_ids(0, 1), faults, strict=True) if fault]
        chosen = replay_episode.choose(store, failed, 1)
        with pytest.raises(ReplayError, match=r"the stored episode failed: .*zoo_travel .*KeyError: 'nobody'; choose"):
            replay_episode.replay(store, chosen)


@pytest.mark.parametrize("plugin", ["zoo_network", "zoo_travel"])
def test_a_report_of_failed_episodes_tells_their_reasons(tmp_path: Path, plugin: str) -> None:
    """Case 8: the whole page was lost to a plugin that failed again."""
    method = {"zoo_network": "policies", "zoo_travel": "evaluate"}[plugin]
    begin(tmp_path / "run", plugin, method, lambda sound: sound)
    go_on(tmp_path / "run")
    zoo_plugins.misbehave(plugin, method, raising(KeyError("no<body>")))
    page = report.page([tmp_path / "run"])
    assert "no replay, the episode failed" in page
    assert "No figures: a fresh test failed: individual " in page
    assert "KeyError: &#39;no&lt;body&gt;&#39;" in page
    assert "no<body>" not in page


def test_the_export_of_a_failing_controller_is_one_line(tmp_path: Path) -> None:
    """Case 8."""
    begin(tmp_path / "run", "zoo_network", "policies", lambda sound: sound)
    go_on(tmp_path / "run")
    zoo_plugins.misbehave("zoo_network", "policies", raising(KeyError("nobody")))
    with Store.open(tmp_path / "run") as store:
        for make in (lambda: export.controller(store, 1), lambda: export.source(store, 1, "epuck")):
            with pytest.raises(SwarmevoError, match=r"zoo_network .*policies raised KeyError: 'nobody'"):
                make()


@pytest.fixture(scope="module")
def explained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run whose fitness explains itself."""
    folder = tmp_path_factory.mktemp("explained") / "run"
    driver.begin(folder, zoo_plugins.config("zoo_explained"))
    go_on(folder)
    return folder


def refused_replay(folder: Path) -> str:
    """Return the one line with which the command fails to replay, and writes no page."""
    return failure(1, "replay", str(folder), "--html", str(folder.parent / "replay.html"))


# Where nobody listens to signals, KeyboardInterrupt is taken for Ctrl-C.
@pytest.mark.parametrize("raised", sorted(set(RAISED) - {"KeyboardInterrupt"}))
def test_what_the_terms_of_an_objective_raise_is_their_plugin_s_fault(explained: Path, raised: str) -> None:
    deed, told = RAISED[raised]
    zoo_plugins.misbehave("zoo_explained", "terms", deed)
    line = refused_replay(explained)
    assert "fitness.zoo_explained (zoo 1.0): terms raised " in line
    assert told in line
    assert not list(explained.parent.glob("*.html"))


@pytest.mark.parametrize(
    ("deed", "told"),
    [
        (lambda sound: None, "terms raised TypeError"),
        (lambda sound: 5, "terms raised TypeError"),
        (lambda sound: {"way": None}, "terms: way: expected"),
        (lambda sound: {"way": sound["way"][:, :1]}, "terms: way: expected an array of shape"),
        (lambda sound: {"way": sound["way"] * np.nan}, "nan"),
        (lambda sound: {"\x1b[2J": sound["way"] * 1j}, "terms: "),
    ],
)
def test_what_the_terms_of_an_objective_must_not_be(explained: Path, deed: Deed, told: str) -> None:
    zoo_plugins.misbehave("zoo_explained", "terms", deed)
    line = refused_replay(explained)
    assert "fitness.zoo_explained (zoo 1.0): terms" in line
    assert told in line
    assert not list(explained.parent.glob("*.html"))


# ---- what is returned ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("plugin", "method", "deed", "told"),
    [case[1:] for case in RETURNED],
    ids=[f"{method}-{name}" for name, _, method, _, _ in RETURNED],
)
def test_what_a_plugin_must_not_return(
    tmp_path: Path, sound: dict[str, list[Any]], plugin: str, method: str, deed: Deed, told: str
) -> None:
    """Case 29."""
    assert_fault(tmp_path / "run", plugin, method, deed, told, sound[plugin])


# ---- what does no harm -----------------------------------------------------------------------------------------------


@pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")  # that it forks with threads
@pytest.mark.parametrize("deed", HARMLESS)
@pytest.mark.parametrize(
    ("plugin", "method"), [("zoo_network", "policies"), ("zoo_travel", "evaluate"), ("zoo_search", "tell")]
)
def test_what_does_no_harm(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    sound: dict[str, list[Any]],
    plugin: str,
    method: str,
    deed: Deed,
) -> None:
    """Cases 30 and 53, in a run that is named by a relative path."""
    monkeypatch.chdir(tmp_path)
    begin(Path("run"), plugin, method, deed)
    go_on(Path("run"))
    assert Path.cwd() == tmp_path
    assert content(Path("run")) == sound[plugin]
    said = capsys.readouterr()
    assert said.out == ""
    assert ("plugin says hello" in said.err) == (deed is zoo_deeds.prints)


# ---- what hangs ------------------------------------------------------------------------------------------------------

ANSWER_SECONDS = 1.0
TRIES = 5  # a machine that has more to do may be slow once


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(
    ("plugin", "method"),
    [("zoo_network", "policies"), ("zoo_linear", "act"), ("zoo_travel", "evaluate"), ("zoo_search", "ask")],
)
def test_a_signal_is_answered_within_a_second_while_a_plugin_hangs(
    tmp_path: Path, sound: dict[str, list[Any]], plugin: str, method: str, number: signal.Signals
) -> None:
    """Case 6, without a time limit: the best of a few tries, for what waits for the plugin does so each time."""
    over = threading.Event()
    asked: list[float] = []

    def hang(sound: Any) -> Any:
        if not asked:
            asked.append(time.monotonic())
            os.kill(os.getpid(), number)
        over.wait(60)
        return sound

    begin(tmp_path / "run", plugin, method, hang)
    before = {one: signal.signal(one, signal.default_int_handler) for one in (signal.SIGINT, signal.SIGTERM)}
    try:
        for _ in range(TRIES):
            asked.clear()
            lines = said(130, "resume", str(tmp_path / "run"), "--workers", "1")
            if time.monotonic() - asked[0] < ANSWER_SECONDS:
                break
        else:
            pytest.fail(f"no answer within {ANSWER_SECONDS} s")
    finally:
        over.set()
        for one, handler in before.items():
            signal.signal(one, handler)
    (left,) = {line for line in lines if line.startswith("left while it worked: ")}
    assert plugin in left
    assert left.endswith(f"(zoo 1.0): {method}")
    assert_of_use(tmp_path / "run", sound[plugin])


LOST = {
    "hangs": r"the episode took longer than its time limit of [0-9.]+ s",
    "os._exit(0)": r"the episode ended its process: exit code 0",
    "dies": r"the episode ended its process: signal SIGSEGV",
}
DEEDS = {
    "zoo_network": {"policies": ["hangs", "os._exit(0)"], "complexity": ["hangs"]},
    "zoo_linear": {"start": ["hangs"], "act": ["hangs"]},
    "zoo_travel": {"evaluate": ["hangs", "dies"]},
}


@pytest.mark.parametrize("plugin", DEEDS)
def test_what_hangs_or_ends_its_process_under_a_time_limit_is_named(
    tmp_path: Path, sound: dict[str, list[Any]], monkeypatch: pytest.MonkeyPatch, plugin: str
) -> None:
    """Case 6: the processes for episodes are told in their environment what to do."""
    begin(tmp_path / "run", plugin, "none", lambda sound: sound, episode_timeout=0.5)
    for method, deeds in DEEDS[plugin].items():
        for deed in deeds:
            monkeypatch.setenv(zoo_plugins.DEED, f"{plugin}.{method}={deed}")
            line = refusal(tmp_path / "run")
            assert_named(line, plugin, method)
            assert re.search(rf"{LOST[deed]}, in (controller|fitness)\.{plugin} \(zoo 1\.0\): {method} ", line)
    monkeypatch.delenv(zoo_plugins.DEED)
    assert_of_use(tmp_path / "run", sound[plugin])

# SPDX-License-Identifier: BSD-3-Clause
"""A zoo of plugins that misbehave in the middle of a run: the fault is named, and what was stored before is of use.

Each run misbehaves after its first generation, or, in what is asked only when plugins are made, when it goes on after
that. Then the plugin is repaired, and the run has to end with the bits of one that never went wrong.
"""

from __future__ import annotations

import multiprocessing
import os
import re
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest

import zoo_plugins
from conftest import installer
from swarmevo.cli.common import StopOnSignal
from swarmevo.cli.process import own_stdout
from swarmevo.errors import Interrupted, ReplayError, SwarmevoError
from swarmevo.evolution.loop import Progress
from swarmevo.protocols import GenomeSpace
from swarmevo.runs import driver, export, verification
from swarmevo.runs.store import Store
from swarmevo.views.replay import episode as replay_episode
from swarmevo.views.report import page as report
from zoo_plugins import Deed

METHODS = {
    "zoo_network": ["space", "policies"],
    "zoo_linear": ["start", "act"],
    "zoo_travel": ["objectives", "channels", "evaluate"],
    "zoo_search": ["factory", "ask", "tell", "state", "restore"],
}
MAKING = {"space", "objectives", "channels", "factory", "restore"}
"""Asked only before the first generation of a session."""
IN_EPISODES = {"policies", "start", "act", "evaluate"}


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
    with pytest.raises(SwarmevoError) as error:
        go_on(folder)
    line = str(error.value)
    assert "\n" not in line
    assert line.isprintable()
    assert plugin in line
    assert "zoo 1.0" in line
    assert method in line or method == "factory"
    assert told in line
    if method in IN_EPISODES:
        assert re.search(r", in trial 0, generation 1, individual \d, repeat 0$", line)
    if method in ("ask", "tell", "state", "restore"):
        assert "trial 0, generation 1" in line
    assert_of_use(folder, sound)


# ---- what raises -----------------------------------------------------------------------------------------------------


class Unspeakable(Exception):  # noqa: N818 - the plugin's
    def __str__(self) -> str:
        raise SystemExit(0)


def raising(error: BaseException) -> Deed:
    def deed(sound: Any) -> NoReturn:
        raise error

    return deed


def deep(sound: Any) -> Any:
    return deep(sound)


RAISED: dict[str, tuple[Deed, str]] = {
    "error": (raising(KeyError("nobody\nhome")), "KeyError: 'nobody\\nhome'"),
    "sys.exit(0)": (lambda sound: sys.exit(0), "SystemExit: 0"),
    "KeyboardInterrupt": (raising(KeyboardInterrupt()), "KeyboardInterrupt"),
    "GeneratorExit": (raising(GeneratorExit("late")), "GeneratorExit: late"),
    "StopIteration": (raising(StopIteration()), "StopIteration"),
    "BaseException": (raising(BaseException("base")), "BaseException: base"),
    "our own Interrupted": (raising(Interrupted("now")), "Interrupted: now"),
    "recursion": (deep, "RecursionError"),
    "undecodable": (raising(RuntimeError("\udcff\0")), "\\udcff\\x00"),
    "unspeakable": (raising(Unspeakable()), "Unspeakable"),
}


@pytest.mark.parametrize("raised", RAISED)
@pytest.mark.parametrize(("plugin", "method"), [(plugin, method) for plugin in METHODS for method in METHODS[plugin]])
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


# ---- what is returned ------------------------------------------------------------------------------------------------


def cyclic(sound: Any) -> Any:
    sound["self"] = [sound]
    return sound


def nested(sound: Any) -> Any:
    for _ in range(100_000):
        sound = {"in": sound}
    return sound


class Sulky(dict[str, Any]):
    def items(self) -> Any:
        raise SystemExit(0)


RETURNED: list[tuple[str, str, str, Deed, str]] = [
    ("nothing", "zoo_network", "space", lambda sound: None, "expected a GenomeSpace, got NoneType"),
    ("no genes", "zoo_network", "space", lambda sound: GenomeSpace(()), ""),
    ("nothing", "zoo_network", "policies", lambda sound: None, "expected FeedForward or Compiled, got NoneType"),
    ("text", "zoo_linear", "act", lambda sound: "left", "expected an array of numbers, got str"),
    ("too few", "zoo_linear", "act", lambda sound: sound[..., :1], "expected an array of shape"),
    ("nothing", "zoo_travel", "objectives", lambda sound: None, "TypeError"),
    ("none", "zoo_travel", "objectives", lambda sound: (), "expected at least one, got none"),
    ("a number", "zoo_travel", "channels", lambda sound: 5, "TypeError"),
    ("unknown", "zoo_travel", "channels", lambda sound: ("sonar",), "'sonar'"),
    ("nothing", "zoo_travel", "evaluate", lambda sound: None, "expected"),
    ("too few", "zoo_travel", "evaluate", lambda sound: sound[:, :1], "expected an array of shape (1, 2), got (1, 1)"),
    ("NaN", "zoo_travel", "evaluate", lambda sound: sound * np.nan, "nan"),
    ("nothing", "zoo_search", "ask", lambda sound: None, "expected a NumPy array, got NoneType"),
    ("masked", "zoo_search", "ask", np.ma.masked_array, "expected a NumPy array, got MaskedArray"),
    ("a vector", "zoo_search", "ask", lambda sound: sound[0], "expected the shape"),
    ("nobody", "zoo_search", "ask", lambda sound: sound[:0], "expected the shape"),
    ("complex", "zoo_search", "ask", lambda sound: sound + 1j, "expected dtype float64, got complex128"),
    ("infinite", "zoo_search", "ask", lambda sound: sound * np.inf, "expected finite numbers"),
    ("nothing", "zoo_search", "state", lambda sound: None, "expected a mapping, got NoneType"),
    ("cyclic", "zoo_search", "state", cyclic, "it is in itself"),
    ("deep", "zoo_search", "state", nested, "expected at most 100"),
    ("long", "zoo_search", "state", lambda sound: {"n": 10**5000}, "4300 digits"),
    ("object", "zoo_search", "state", lambda sound: {"n": object()}, "got object"),
    ("exits", "zoo_search", "state", lambda sound: Sulky(a=1), "SystemExit"),
]


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


def prints(sound: Any) -> Any:
    print("plugin says hello")
    return sound


def moves(sound: Any) -> Any:
    os.chdir("/")
    return sound


def starts_a_daemon(sound: Any) -> Any:
    threading.Thread(target=time.sleep, args=(5,), daemon=True).start()
    return sound


def forks_and_exits(sound: Any) -> Any:
    child = os.fork()
    if child == 0:
        os._exit(0)
    os.waitpid(child, 0)
    return sound


def forks_and_returns(sound: Any) -> Any:
    child = os.fork()
    if child != 0:
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 1
    return sound


def forks_and_raises(sound: Any) -> Any:
    child = os.fork()
    if child == 0:
        raise SystemExit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 1
    return sound


def is_killed(sound: Any) -> Any:
    """Case 53: a child ends when it is asked to."""
    child = os.fork()
    if child == 0:
        time.sleep(60)
        os._exit(9)
    os.kill(child, signal.SIGTERM)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGTERM
    return sound


def has_a_pool(sound: Any) -> Any:
    """Case 53: leaving the pool sends its processes SIGTERM, and waits for them."""
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert pool.map(abs, [-1, -2]) == [1, 2]
    return sound


HARMLESS = [prints, moves, starts_a_daemon, forks_and_exits, forks_and_returns, forks_and_raises, is_killed, has_a_pool]


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
    assert ("plugin says hello" in said.err) == (deed is prints)


# ---- what hangs ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(
    ("plugin", "method"), [("zoo_network", "policies"), ("zoo_travel", "evaluate"), ("zoo_search", "ask")]
)
def test_a_signal_is_answered_while_a_plugin_hangs(
    tmp_path: Path, sound: dict[str, list[Any]], plugin: str, method: str, number: signal.Signals
) -> None:
    """Case 6, without a time limit."""
    over = threading.Event()
    asked: list[float] = []

    def hang(sound: Any) -> Any:
        if not asked:
            asked.append(time.monotonic())
            os.kill(os.getpid(), number)
        over.wait(60)
        return sound

    before = {one: signal.signal(one, signal.default_int_handler) for one in (signal.SIGINT, signal.SIGTERM)}
    try:
        begin(tmp_path / "run", plugin, method, hang)
        with pytest.raises((Interrupted, KeyboardInterrupt)):
            go_on(tmp_path / "run")
        assert time.monotonic() - asked[0] < 30  # half a second, on a machine that does nothing else; 60 if unanswered
    finally:
        over.set()
        for one, handler in before.items():
            signal.signal(one, handler)
    assert_of_use(tmp_path / "run", sound[plugin])

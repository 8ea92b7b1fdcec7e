# SPDX-License-Identifier: BSD-3-Clause
"""A replay page as a film: frames from a headless Chromium, without a display, a GPU or a network.

Chromium is spoken to through a pipe (``--remote-debugging-pipe``: JSON, each message ended by a zero byte), so no port
is opened and no driver is needed.
"""

from __future__ import annotations

import base64
import contextlib
import fcntl
import io
import itertools
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from PIL import Image
from PIL.TiffImagePlugin import AppendingTiffWriter

from swarmevo.errors import ConfigError, ReplayError
from swarmevo.runs import files

PROGRAMS: Final = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_FLAGS: Final = (
    "--headless",
    "--use-angle=swiftshader",  # draws WebGL without a GPU
    "--enable-unsafe-swiftshader",
    "--hide-scrollbars",
    "--no-first-run",
    "--disable-background-networking",
    "--remote-debugging-pipe",
)
_LOAD_SECONDS: Final = 60.0
_LOADED: Final = "document.readyState === 'complete' && window.swarmevo !== undefined"
_PREPARE: Final = """
    swarmevo.pause();
    document.querySelector('.sw-player').classList.add('sw-film');
    for (const side of document.querySelectorAll('.sw-side'))
        side.querySelector('.sw-team').hidden = side.scrollHeight > side.clientHeight;
"""
"""Nobody can scroll in a film: where there is no room for the robots' rows, there are none."""
_DRAWN: Final = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


@dataclass(frozen=True)
class Film:
    """What of an episode is filmed, and how."""

    start: float
    """[s]"""
    end: float
    """[s]"""
    speed: float = 8.0
    """Times real time."""
    rate: float = 12.5
    """Frames per second of the film."""
    size: tuple[int, int] = (960, 540)
    """Width, height [pixels], even."""

    def times(self) -> list[float]:
        """Return the episode's time of each frame [s]."""
        step = self.speed / self.rate
        return [self.start + step * i for i in range(int((self.end - self.start) / step) + 1)]


def check(file: Path) -> None:
    """Refuse what cannot be made here, before any work is done.

    Raises:
        ConfigError: The file's ending is unknown.
        ReplayError: Chromium, or ffmpeg for an mp4, is not installed.
    """
    if file.suffix not in _WRITERS:
        raise ConfigError(f"--video {file}: expected a name that ends in {' or '.join(_WRITERS)}")
    if _chromium() is None:
        raise ReplayError("--video needs Chromium, and there is none; install it: apt-get install chromium")
    if file.suffix == ".mp4" and shutil.which("ffmpeg") is None:
        raise ReplayError(
            "--video: an mp4 needs ffmpeg: apt-get install ffmpeg; or name a .webp, which needs nothing more"
        )


def write(file: Path, page: str, film: Film, observe: Callable[[int], None]) -> None:
    """Film a replay page.

    Args:
        file: ``.webp`` or ``.mp4``.
        page: HTML of :func:`swarmevo.views.replay.page.render`.
        film: What of it.
        observe: Told after each frame how many there are.

    Raises:
        OutputError: The file, or a temporary one, cannot be written.
        ReplayError: Something that is needed is missing, or fails.
    """
    check(file)
    times = film.times()

    def frames() -> Generator[bytes, None, None]:
        with tempfile.TemporaryDirectory(prefix="swarmevo-", ignore_cleanup_errors=True) as folder:
            source = Path(folder) / "page.html"
            files.write(source, page)
            with _Chromium(Path(folder) / "profile", film.size) as browser:
                browser.open(source.as_uri())
                for number, t in enumerate(times, start=1):
                    browser.evaluate(f"swarmevo.seek({t!r}); {_DRAWN}")
                    yield browser.screenshot()
                    observe(number)

    with contextlib.closing(frames()) as pictures, files.written(file) as fresh:
        _WRITERS[file.suffix](fresh, pictures, film.rate)


def _chromium() -> str | None:
    return next(filter(None, map(shutil.which, PROGRAMS)), None)


# ---- files -----------------------------------------------------------------------------------------------------------


def _write_webp(file: Path, frames: Iterator[bytes], rate: float) -> None:
    with tempfile.TemporaryDirectory(prefix=".new-", dir=file.parent) as folder:  # as much room as for the film
        reel = Path(folder) / "reel.tiff"  # Pillow reads its frames one by one; a list of them would fill the memory
        with AppendingTiffWriter(reel, new=True) as pages:
            for frame in frames:
                Image.open(io.BytesIO(frame)).convert("RGB").save(
                    pages, format="TIFF", compression="tiff_adobe_deflate"
                )
                pages.newFrame()
        with Image.open(reel) as film:
            film.save(file, save_all=True, duration=round(1000 / rate), loop=0, quality=80, method=4)


def _write_mp4(file: Path, frames: Iterator[bytes], rate: float) -> None:
    command = ["ffmpeg", "-v", "error", "-y", "-f", "image2pipe", "-framerate", f"{rate}", "-i", "-"]
    command += ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart", str(file)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as ffmpeg:
        assert ffmpeg.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # it says why below
            for frame in frames:
                ffmpeg.stdin.write(frame)
        _, said = ffmpeg.communicate()
    if ffmpeg.returncode:
        raise ReplayError(f"--video: ffmpeg failed: {' '.join(said.decode(errors='replace').split())}")


_WRITERS: Final[dict[str, Callable[[Path, Iterator[bytes], float], None]]] = {".webp": _write_webp, ".mp4": _write_mp4}


# ---- the browser -----------------------------------------------------------------------------------------------------


class _Chromium:
    """A headless Chromium with one page. Use as a context manager."""

    def __init__(self, profile: Path, size: tuple[int, int]) -> None:
        program = _chromium()
        assert program is not None  # checked before
        flags = [*_FLAGS, f"--user-data-dir={profile}", f"--window-size={size[0]},{size[1]}"]
        if os.geteuid() == 0:
            flags.append("--no-sandbox")  # root has none
        self._process, self._commands, self._answers = _spawn([program, *flags, "about:blank"])
        self._numbers = itertools.count(1)
        self._session: str | None = None
        self._pending = b""
        self._size = size

    def __enter__(self) -> Self:
        try:
            target = self._call("Target.createTarget", url="about:blank")["targetId"]
            self._session = self._call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
            width, height = self._size
            self._call(
                "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
            )
        except BaseException:
            self._close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._close()

    def open(self, address: str) -> None:
        """Open a replay page and wait for its player."""
        self._call("Page.navigate", url=address)
        deadline = time.monotonic() + _LOAD_SECONDS
        while not self.evaluate(_LOADED):
            if time.monotonic() > deadline:
                raise ReplayError(f"Chromium did not load the page within {_LOAD_SECONDS:g} s")
        self.evaluate(f"{_PREPARE}; {_DRAWN}")

    def evaluate(self, script: str) -> Any:
        """Return what a script gives, when it is there."""
        answer = self._call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            raise ReplayError(f"the page failed: {answer['exceptionDetails'].get('text')}")
        return answer["result"].get("value")

    def screenshot(self) -> bytes:
        """Return the page as PNG."""
        return base64.b64decode(self._call("Page.captureScreenshot", format="png")["data"])

    def _call(self, method: str, **parameters: Any) -> dict[str, Any]:
        number = next(self._numbers)
        command = {"id": number, "method": method, "params": parameters}
        if self._session:
            command["sessionId"] = self._session
        try:
            self._commands.write(json.dumps(command).encode() + b"\0")
            self._commands.flush()
            while True:
                answer = json.loads(self._message())
                if answer.get("id") == number:
                    break
        except (BrokenPipeError, EOFError) as error:
            raise ReplayError(
                f"Chromium ended unexpectedly; does it start? {_chromium()} --headless --version"
            ) from error
        if "error" in answer:
            raise ReplayError(f"Chromium refused {method}: {answer['error'].get('message')}")
        result: dict[str, Any] = answer["result"]
        return result

    def _message(self) -> bytes:
        """Return the next message of Chromium: an answer, or news that nobody asked for."""
        while b"\0" not in self._pending:
            part = self._answers.read1(1 << 16)
            if not part:
                raise EOFError
            self._pending += part
        message, _, self._pending = self._pending.partition(b"\0")
        return message

    def _close(self) -> None:
        for pipe in (self._commands, self._answers):
            with contextlib.suppress(OSError):
                pipe.close()
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process, signal.SIGKILL)  # it and its helpers
        with contextlib.suppress(ChildProcessError):
            os.waitpid(self._process, 0)


def _spawn(command: list[str]) -> tuple[int, io.BufferedWriter, io.BufferedReader]:
    """Start a program that reads commands on descriptor 3 and answers on descriptor 4."""
    commands_out, commands_in = map(_high, os.pipe())
    answers_out, answers_in = map(_high, os.pipe())
    actions = [
        (os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0),
        (os.POSIX_SPAWN_OPEN, 2, os.devnull, os.O_WRONLY, 0),
        (os.POSIX_SPAWN_DUP2, commands_out, 3),
        (os.POSIX_SPAWN_DUP2, answers_in, 4),
    ]
    try:
        process = os.posix_spawn(command[0], command, os.environ, file_actions=actions, setpgroup=0)
    finally:
        os.close(commands_out)
        os.close(answers_in)
    return process, os.fdopen(commands_in, "wb"), os.fdopen(answers_out, "rb")


def _high(descriptor: int) -> int:
    """Return a copy of a descriptor out of the way of 3 and 4, closed in other programs; close the original."""
    high = fcntl.fcntl(descriptor, fcntl.F_DUPFD_CLOEXEC, 10)
    os.close(descriptor)
    return high

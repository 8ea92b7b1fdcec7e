# SPDX-License-Identifier: BSD-3-Clause
"""What one flipped bit does to a run: ``python -m benchmarks.bit_flips [FLIPS]``.

Bits are flipped one at a time in the files of a finished run, and of one that was killed. Each time every command that
reads a run is called; the killed run is also resumed. A flip is

- harmless, if all of them print what they print of the sound run, and the resumed run stores what a sound one does;
- refused, if any of them says so in one line, and all others print what they should;
- found, if nothing is refused but ``swarmevo verify`` names damage;
- silent, if anything else is printed, or a traceback: this must never be.

Three flips in five hit the database, the others any other file; every second one hits a byte that is not zero, since a
small database is mostly empty. The exit code is 1 if a flip was silent.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import multiprocessing
import os
import random
import shutil
import signal
import tempfile
import traceback
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from pathlib import Path
from types import FrameType
from typing import Final

from swarmevo import cli, config, plugins
from swarmevo.analysis import assessment, table_ii
from swarmevo.errors import StoreError
from swarmevo.evolution import threads
from swarmevo.evolution.results import Results
from swarmevo.protocols import FloatArray
from swarmevo.runs import driver
from swarmevo.runs.database import DATABASE_FILE
from swarmevo.runs.store import Store

SETTINGS: Final = (
    "episode.horizon=1",
    "evolution.population=6",
    "evolution.generations=3",
    "evolution.trials=2",
    "evolution.repeats=2",
    "evolution.seed=5",
)
KEPT: Final = 5
"""Episodes of the generation in which the killed run was killed, of 12."""
READING: Final[Mapping[str, tuple[str, ...]]] = {
    "show": ("show", "RUN"),
    "show --json": ("show", "RUN", "--json"),
    "export --csv": ("export", "RUN", "--csv"),
    "export --json": ("export", "RUN", "--json"),
    "export --controller": ("export", "RUN", "--controller", "2"),
    "export --as epuck": ("export", "RUN", "--controller", "2", "--as", "epuck"),
    "replay": ("replay", "RUN", "--html", "PAGE"),
    "test": ("test", "RUN", "--json", "--robots", "3", "--repeats", "1", "--workers", "1"),
}
REPORT: Final = ("report", "RUN", "--html", "PAGE")
VERIFY: Final = ("verify", "RUN", "--workers", "1")
RESUME: Final = ("resume", "RUN", "--workers", "1")
SECONDS: Final = 60
"""After which a command counts as hanging."""


@dataclass(frozen=True)
class Said:
    """What a command left."""

    code: int
    """Its exit code; -1: it ended with a traceback or not at all."""
    out: str
    error: str

    @property
    def is_refusal(self) -> bool:
        """Whether it failed with one line."""
        return self.code in (1, 2) and sum(line.startswith("error: ") for line in self.error.splitlines()) == 1


@dataclass(frozen=True)
class Flip:
    """A bit of a file."""

    file: str
    byte: int
    bit: int


Verdict = tuple[str, str]
"""``harmless``, ``refused``, ``found`` or ``silent``; which command said what."""


# ---- runs ------------------------------------------------------------------------------------------------------------


def finished_run(folder: Path) -> Path:
    """Make a run that is finished and tested."""
    driver.begin(folder, config.load("quick", SETTINGS, plugins.option_errors))
    with Store.open(folder, readonly=False) as store:
        driver.evolve(store, 1, lambda progress: None)
    said = call(("test", str(folder), "--robots", "3", "--repeats", "1", "--workers", "1"))
    assert said.code == 0, said.error
    return folder


class MortalStore(Store):
    """A run whose process is killed when so many episodes of a third generation are kept."""

    kept = 0

    def keep(self, trial: int, number: int, genomes: FloatArray, episodes: Results) -> None:
        """Keep episodes, or die."""
        super().keep(trial, number, genomes, episodes)
        self.kept += number == 2
        if self.kept == KEPT:
            os.kill(os.getpid(), signal.SIGKILL)


def killed_run(folder: Path) -> Path:
    """Make a run that was killed in its third generation."""

    def evolve_and_die() -> None:
        threads.JOB_SECONDS = 0.0  # type: ignore[misc]  # one episode a job
        with MortalStore.open(folder, readonly=False) as store:
            driver.evolve(store, 1, lambda progress: None)

    driver.begin(folder, config.load("quick", SETTINGS, plugins.option_errors))
    child = multiprocessing.get_context("fork").Process(target=evolve_and_die)
    child.start()
    child.join()
    assert child.exitcode == -signal.SIGKILL
    return folder


# ---- commands --------------------------------------------------------------------------------------------------------


def call(arguments: Sequence[str]) -> Said:
    """Call a command in this process."""
    out, error = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error), _time_limit():
        try:
            cli.main(arguments)
        except SystemExit as exit:
            code = exit.code if isinstance(exit.code, int) else 0
        except Exception:
            code = -1
            traceback.print_exc()
    return Said(code, out.getvalue(), error.getvalue())


@contextlib.contextmanager
def _time_limit() -> Iterator[None]:
    def give_up(number: int, frame: FrameType | None) -> None:
        raise TimeoutError(f"no answer in {SECONDS} s")

    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(SECONDS)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def ask(run: Path, arguments: Sequence[str]) -> Said:
    """Call a command for a run; what it writes into a page counts as said."""
    page = run.with_name("page.html")
    page.unlink(missing_ok=True)
    said = call([{"RUN": str(run), "PAGE": str(page)}.get(word, word) for word in arguments])
    return replace(said, out=said.out + page.read_text()) if page.exists() else said


def read_all(run: Path, with_report: bool) -> Iterator[tuple[str, Said]]:
    """Yield what each command that reads a run says of it."""
    yield "tests", _tests(run)
    for name, arguments in READING.items():
        yield name, ask(run, arguments)
    if with_report:
        yield "report", ask(run, REPORT)


def _tests(run: Path) -> Said:
    """Return what the report reads of the run's tests."""
    try:
        with Store.open(run) as store:
            found = assessment.stored(store)
    except StoreError as error:
        return Said(1, "", f"error: {error}")
    return Said(0, table_ii.as_json(found) if found else "", "")


def resumed(run: Path) -> Said:
    """Bring a run to its end; return what is stored then but for sessions, or how that failed."""
    said = ask(run, RESUME)
    if said.code:
        return said
    stored = ask(run, READING["export --csv"])
    cells = [line.split(",") for line in stored.out.splitlines()]
    return replace(stored, out="\n".join(",".join([*row[:-2], row[-1]]) for row in cells))


# ---- flips -----------------------------------------------------------------------------------------------------------


def draw(run: Path, rng: random.Random) -> Flip:
    """Return a bit of one of a run's files."""
    files = sorted(path.name for path in run.iterdir() if path.stat().st_size)
    others = [name for name in files if name != DATABASE_FILE]
    file = DATABASE_FILE if rng.random() < 0.6 else rng.choice(others)
    content = (run / file).read_bytes()
    used = [i for i, byte in enumerate(content) if byte]
    return Flip(file, rng.choice(used) if rng.random() < 0.5 else rng.randrange(len(content)), rng.randrange(8))


def apply(run: Path, flip: Flip) -> None:
    """Flip a bit of a run."""
    content = bytearray((run / flip.file).read_bytes())
    content[flip.byte] ^= 1 << flip.bit
    (run / flip.file).write_bytes(content)


class Trial:
    """A sound run, and what is said of it.

    Args:
        sound: Its folder, beside which copies are made.
        is_finished: Whether the run is; else it is resumed after each flip.
    """

    def __init__(self, sound: Path, is_finished: bool) -> None:
        self._sound, self._run = sound, sound.with_name("copy")
        self._is_finished = is_finished
        self._expected = dict(read_all(self._fresh(), with_report=True))
        self._resumed = None if is_finished else resumed(self._fresh())

    def _fresh(self) -> Path:
        shutil.rmtree(self._run, ignore_errors=True)
        return shutil.copytree(self._sound, self._run)

    def flip(self, flip: Flip, with_report: bool = False) -> Verdict:
        """Return what a flipped bit does."""
        apply(self._fresh(), flip)
        answers = [(name, said, self._expected[name]) for name, said in read_all(self._run, with_report)]
        if self._resumed:
            apply(self._fresh(), flip)
            answers.append(("resume", resumed(self._run), self._resumed))
        refusals = []
        for name, said, expected in answers:
            if said.is_refusal and expected.out.startswith(said.out):
                refusals.append(f"{name}: {said.error.strip()}")
            elif (said.code, said.out) != (expected.code, expected.out):
                return "silent", f"{name}: code {said.code}, {_difference(said, expected)}"
        if refusals:
            return "refused", refusals[0]
        return self._verified()

    def _verified(self) -> Verdict:
        said = ask(self._run, VERIFY)
        if said.code == 0:
            return "harmless", ""
        damaged = [line for line in said.out.splitlines() if line.startswith("damaged: ")]
        if damaged or said.is_refusal:
            return "found", damaged[0] if damaged else said.error.strip()
        return "silent", f"verify: {said.error or said.out}"


def _difference(said: Said, expected: Said) -> str:
    """Return the last line of an error, or the first line that is another one."""
    if said.error:
        return said.error.splitlines()[-1]
    pairs = zip_longest(said.out.splitlines(), expected.out.splitlines())
    return next((f"{line!r} instead of {sound!r}" for line, sound in pairs if line != sound), "")


def tally(trial: Trial, sound: Path, flips: int, rng: random.Random, reports: int = 0) -> Counter[tuple[str, str]]:
    """Return how many flips in each file had which verdict; say which were silent.

    Args:
        trial: Of the run.
        sound: The run.
        flips: How many.
        rng: Draws them.
        reports: With how many of them ``swarmevo report`` is called too, which takes seconds.
    """
    found: Counter[tuple[str, str]] = Counter()
    for number in range(flips):
        flip = draw(sound, rng)
        verdict, why = trial.flip(flip, with_report=number < reports)
        found[flip.file, verdict] += 1
        if verdict == "silent":
            print(f"silent: {flip}: {why}")
    return found


def main() -> None:
    """Flip bits and print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("flips", type=int, nargs="?", default=1000, help="of each run")
    parser.add_argument("--runs", nargs="+", default=["finished", "killed"], choices=["finished", "killed"])
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rng = random.Random(given.seed)
    is_silent = False
    with tempfile.TemporaryDirectory() as place:
        for name in given.runs:
            sound = {"finished": finished_run, "killed": killed_run}[name](Path(place, name, "run"))
            found = tally(Trial(sound, name == "finished"), sound, given.flips, rng, given.flips // 50)
            print(f"\n{name} run, {given.flips} flips")
            for (file, verdict), count in sorted(found.items()):
                print(f"  {file:18} {verdict:10} {count:6}")
                is_silent |= verdict == "silent"
    raise SystemExit(is_silent)


if __name__ == "__main__":
    main()

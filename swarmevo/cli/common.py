# SPDX-License-Identifier: BSD-3-Clause
"""What the verbs share: the application, exit codes, errors as single lines, types of arguments, signals.

Data goes to stdout, progress and errors to stderr. Exit codes: 0 done, 1 failed, 2 usage or configuration, 130
interrupted, 141 the reader of our pipe is gone.
"""

from __future__ import annotations

import os
import re
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final, NoReturn

import typer
from typer.main import get_command

from swarmevo._version import __version__
from swarmevo.cli import streams
from swarmevo.cli.process import own_exit, own_stdout, run
from swarmevo.cli.streams import FAILED as FAILED
from swarmevo.cli.usage import USAGE as USAGE
from swarmevo.cli.usage import Program
from swarmevo.cli.usage import examples as examples
from swarmevo.errors import ConfigError, Interrupted, PluginError, SwarmevoError
from swarmevo.printable import printable

if TYPE_CHECKING:
    from swarmevo.runs.store import Store

INTERRUPTED = 130

_LARGEST_TEAM = 64
_SETTING: Final = re.compile(r"\w[\w-]*(\.[\w-]+)*=")
_LISTS: Final = {"--set": _SETTING, "--grid": _SETTING, "--against": re.compile("[^-]")}
"""Options of which several values may follow, and how each of these begins."""

app = typer.Typer(
    cls=Program,
    no_args_is_help=True,
    rich_markup_mode=None,  # plain help needs no rich, whose import alone would take half of the time there is
    pretty_exceptions_enable=False,
    help="Evolve controllers for swarms of simulated robots, with several objectives at once.",
    epilog=examples(
        "swarmevo replay --best              robots that push the box, as a page to open",
        "swarmevo evolve quick --seed 1      a first evolution, of about a minute",
        "swarmevo show runs/quick-...-1      its front",
    ),
)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run ``swarmevo``; exits."""
    given = sys.argv[1:] if arguments is None else arguments
    with streams.guarded(), own_stdout(), own_exit():
        try:
            _command()(args=_repeat_lists(given), prog_name="swarmevo")
        except SwarmevoError as error:  # any other error is a fault of ours, and keeps its traceback
            exit_with(USAGE if isinstance(error, ConfigError) else FAILED, *error.errors)
    raise SystemExit(0)


@cache
def _command() -> Any:
    """Return what ``app`` makes of all verbs, which takes longer than many a verb itself."""
    return get_command(app)


def program() -> NoReturn:
    """Be the process ``swarmevo``."""
    run(main)


def _repeat_lists(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with ``--set a.b=1 c.d=2`` spelled as ``--set a.b=1 --set c.d=2``, and so on."""
    spelled: list[str] = []
    listing = ""
    for argument in arguments:
        follows = bool(listing) and bool(_LISTS[listing].match(argument))
        spelled += [listing, argument] if follows and spelled[-1] != listing else [argument]
        named = argument.partition("=")[0]
        listing = named if named in _LISTS else listing if follows else ""
    return spelled


def _show_version(wanted: bool) -> None:
    if wanted:
        print(f"swarmevo {__version__}")
        raise typer.Exit


@app.callback()
def _options_of_all(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    pass


# ---- errors ----------------------------------------------------------------------------------------------------------


def say(line: str) -> None:
    """Print a line to stderr; control characters in it, of a path or of a plugin's message, are shown and not sent."""
    print(printable(line), file=sys.stderr, flush=True)


def exit_with(code: int, *errors: str) -> NoReturn:
    """Print each error as a line of its own and exit."""
    for error in errors:
        say(f"error: {error}")
    raise SystemExit(code)


def say_how_it_was_left(store: Store) -> None:
    """Print a warning if the process that wrote a run last did not come to tell how it ended."""
    from swarmevo.runs import driver

    if left := driver.how_it_was_left(store):
        say(f"warning: {left}")


def say_changed_plugins(store: Store) -> None:
    """Print a warning if a run's controller or fitness is not what it was."""
    from swarmevo.runs import driver

    with suppress(PluginError):  # it is not installed: told by what asks for it
        if changed := driver.changed_plugins(store):
            say(f"warning: {changed}")


# ---- arguments -------------------------------------------------------------------------------------------------------

Run = Annotated[Path, typer.Argument(metavar="RUN", help="The folder of a run.", exists=True, file_okay=False)]
Workers = Annotated[
    str,
    typer.Option(
        metavar="auto|N",
        help="How many episodes run at once; auto: one for each core. The results do not depend on it.",
    ),
]
OtherWorld = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="SECTION.KEY=VALUE ...", help="Change the world from that of the run; values are YAML."
    ),
]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Check everything and forecast the cost; write nothing.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print everything there is, as JSON.")]


def run_and_individual(text: str) -> tuple[Path, int | None]:
    """Return the folder that ``RUN`` or ``RUN:ID`` names, and the individual's id; None: it names none."""
    folder, _, individual = text.rpartition(":")
    if not os.path.isdir(text) and re.fullmatch("[0-9]{1,100}", individual):
        return Path(folder), int(individual)
    return Path(text), None


def without_effect(context: typer.Context, reason: str, *parameters: str) -> None:
    """Exit if one of these parameters of a command was given, for it would change nothing."""
    for option in context.command.params:
        source = context.get_parameter_source(option.name or "")
        if option.name in parameters and source is not None and source.name == "COMMANDLINE":
            exit_with(USAGE, f"{option.opts[0]}: has no effect {reason}; leave it out")


def worker_count(text: str) -> int:
    """Return the number of threads that ``--workers`` asks for."""
    if text == "auto":
        return len(os.sched_getaffinity(0))
    if not re.fullmatch(r"[1-9][0-9]{0,3}", text):
        exit_with(USAGE, f"--workers: expected auto or a whole number from 1 to 9999, got {text!r}")
    return int(text)


def team_sizes(text: str, most: int = _LARGEST_TEAM) -> list[int]:
    """Return the sizes that ``--robots 3`` or ``--robots 1-5`` names; there may be at most ``most``."""
    match = re.fullmatch(r"([1-9]\d?)(?:-([1-9]\d?))?", text)
    sizes = list(range(int(match[1]), int(match[2] or match[1]) + 1)) if match else []
    if not sizes or sizes[-1] > _LARGEST_TEAM or len(sizes) > most:
        limit = f"up to {most} sizes" if most < _LARGEST_TEAM else "several"
        exit_with(
            USAGE, f"--robots: expected a team size from 1 to {_LARGEST_TEAM}, or {limit} as in 1-5, got {text!r}"
        )
    return sizes


# ---- signals ---------------------------------------------------------------------------------------------------------


class StopOnSignal:
    """Whether Ctrl-C or SIGTERM asked to stop. The second signal acts as if nobody listened.

    An optimiser works in the main thread and may hang there: it is left at once. Nothing is lost, for a generation's
    episodes are kept as they come. Processes that a plugin forks get back the handlers that were there before, or
    nobody could end them with SIGTERM.
    """

    _listening: ClassVar[StopOnSignal | None] = None

    def __init__(self) -> None:
        self._wanted = self._said = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> StopOnSignal:
        self._before = {
            number: signal.signal(number, self._note)
            for number in (signal.SIGINT, signal.SIGTERM)
            if signal.getsignal(number) is not signal.SIG_IGN  # as nohup and background jobs have it
        }
        StopOnSignal._listening = self
        return self

    def __exit__(self, *_: object) -> None:
        StopOnSignal._listening = None
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self._wanted = True
        self.__exit__()
        calls = sys.modules.get("swarmevo.plugins.calls")
        if calls and calls.in_plugin():
            self()
            raise calls.StopNow

    def __call__(self) -> bool:
        """Return whether to stop; the first time that it is so, say it."""
        if self._wanted and not self._said:
            self._said = True
            say("stopping; once more to stop at once")
        return self._wanted

    @classmethod
    def forked(cls) -> None:
        """Listen no more, in a process that was forked."""
        if cls._listening:
            cls._listening.__exit__()


_masks = threading.local()  # signals that a thread which forks had blocked before


def _before_fork() -> None:
    _masks.before = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGTERM))  # none may get lost


def _after_fork() -> None:
    signal.pthread_sigmask(signal.SIG_SETMASK, _masks.before)


def _after_fork_in_child() -> None:
    StopOnSignal.forked()
    _after_fork()


os.register_at_fork(before=_before_fork, after_in_parent=_after_fork, after_in_child=_after_fork_in_child)


@contextmanager
def interruptible(consequence: str = "") -> Iterator[StopOnSignal]:
    """Yield what says whether to stop; once it has stopped, say so and what follows, and exit.

    What did not stop is named: a plugin hangs, perhaps.
    """
    try:
        with StopOnSignal() as stop:
            yield stop
    except (Interrupted, KeyboardInterrupt) as end:
        for call in _left(end):
            say(f"left while it worked: {call}")
        say(f"interrupted; {consequence}" if consequence else "interrupted")
        raise SystemExit(INTERRUPTED) from None


def _left(end: BaseException) -> list[str]:
    """Return the plugin calls that a signal cut short, and those that threads are still in."""
    calls = sys.modules.get("swarmevo.plugins.calls")
    return sorted(
        {*(end.args if calls and isinstance(end, calls.StopNow) else ()), *(calls.in_work() if calls else ())}
    )

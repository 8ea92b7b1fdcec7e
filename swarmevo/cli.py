# SPDX-License-Identifier: BSD-3-Clause
"""The command line: arguments, and what is said and returned. Everything else is done elsewhere.

Data goes to stdout, progress and errors to stderr. Exit codes: 0 done, 1 failed, 2 usage or configuration, 130
interrupted. ``--help`` must answer at once, so each command imports what it needs when it runs.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from swarmevo import __version__

if TYPE_CHECKING:
    from swarmevo.config import Config

FAILED = 1
USAGE = 2
INTERRUPTED = 130

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,  # plain help needs no rich, whose import alone would take half of the time there is
    pretty_exceptions_enable=False,
    help="Evolve controllers for swarms of simulated robots, with several objectives at once.",
)
plugins_app = typer.Typer(rich_markup_mode=None)
app.add_typer(plugins_app, name="plugins")

Run = Annotated[Path, typer.Argument(metavar="RUN", help="A run folder.", exists=True, file_okay=False)]
Workers = Annotated[str, typer.Option(metavar="auto|N", help="Episodes at once; auto: one for each core.")]


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run ``swarmevo``; exits."""
    given = sys.argv[1:] if arguments is None else arguments
    try:
        app(args=_repeat_set(given), prog_name="swarmevo")
    except Exception as error:
        _fail(error)
    raise SystemExit(0)


def _repeat_set(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with ``--set a.b=1 c.d=2`` spelled as ``--set a.b=1 --set c.d=2``."""
    spelled: list[str] = []
    setting = False
    for argument in arguments:
        follows = setting and bool(re.match(r"\w+(\.\w+)+=", argument))
        spelled += ["--set", argument] if follows and spelled[-1] != "--set" else [argument]
        setting = argument == "--set" or follows
    return spelled


def _fail(error: Exception) -> NoReturn:
    """Say what is wrong, one line each, and exit; an error that nobody foresaw keeps its traceback."""
    from swarmevo.config import ConfigError
    from swarmevo.plugins import PluginError
    from swarmevo.store import StoreError

    if isinstance(error, ConfigError):
        _exit(USAGE, *error.errors)
    if isinstance(error, PluginError):
        _exit(FAILED, *error.errors)
    foreseen: list[type[Exception]] = [StoreError]
    if "swarmevo.simulator" in sys.modules:
        foreseen.append(sys.modules["swarmevo.simulator"].SimulatorError)
    if "swarmevo.evaluation" in sys.modules:
        foreseen.append(sys.modules["swarmevo.evaluation"].EvaluationError)
    if not isinstance(error, tuple(foreseen)):
        raise error
    _exit(FAILED, str(error))


def _exit(code: int, *errors: str) -> NoReturn:
    for error in errors:
        print(f"error: {error}", file=sys.stderr)
    raise SystemExit(code)


def _show_version(wanted: bool) -> None:
    if wanted:
        print(f"swarmevo {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    pass


# ---- evolving --------------------------------------------------------------------------------------------------------


@app.command()
def evolve(
    config: Annotated[
        str | None, typer.Argument(metavar="CONFIG", help="A YAML file, or quick (the default) or paper.")
    ] = None,
    plugin: Annotated[str | None, typer.Option(metavar="NAME", help="The optimiser.")] = None,
    seed: Annotated[int | None, typer.Option(metavar="N", help="Of everything random; drawn if not given.")] = None,
    trials: Annotated[int | None, typer.Option(metavar="N", help="Independent evolutions.")] = None,
    workers: Workers = "auto",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="SECTION.KEY=VALUE ...", help="Override the configuration; value in YAML."),
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="The run folder to make.", show_default=False)] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Check everything, forecast the cost, write nothing.")
    ] = False,
) -> None:
    """Evolve controllers and print the Pareto front."""
    count = _worker_count(workers)
    if out is not None and out.exists():
        _exit(USAGE, f"--out {out}: exists already and is never overwritten; choose another name")
    given = {"optimiser": plugin and json.dumps(plugin), "evolution.seed": seed, "evolution.trials": trials}
    overrides = [f"{key}={value}" for key, value in given.items() if value is not None] + (settings or [])
    chosen = _checked(config, overrides)
    if dry_run:
        _forecast(chosen, count)
        return

    from swarmevo import evolution

    folder = out or Path("runs") / _run_name(config, chosen)
    evolution.begin(folder, chosen)
    print(f"run {folder}, seed {chosen.evolution.seed}", file=sys.stderr)
    _go_on(folder, count)


@app.command()
def resume(run: Run, workers: Workers = "auto") -> None:
    """Go on with an interrupted run; the result is that of a run never interrupted."""
    _go_on(run, _worker_count(workers))


def _worker_count(text: str) -> int:
    if text == "auto":
        return len(os.sched_getaffinity(0))
    if not re.fullmatch(r"[1-9][0-9]{0,3}", text):
        _exit(USAGE, f"--workers: expected auto or a whole number from 1 to 9999, got {text!r}")
    return int(text)


def _checked(source: str | None, overrides: Sequence[str]) -> Config:
    """Return the configuration with a seed, after every check there is."""
    from swarmevo import config, plugins, simulator

    def errors(found: Config) -> list[str]:
        return simulator.scene_errors(found) + plugins.option_errors(found)

    return config.seeded(config.load(source, overrides, errors))


def _run_name(source: str | None, config: Config) -> str:
    from datetime import datetime

    return f"{Path(source or 'quick').stem}-{datetime.now():%Y%m%d-%H%M%S}-{config.evolution.seed}"


def _forecast(config: Config, workers: int) -> None:
    from swarmevo import analysis, console
    from swarmevo.evaluation import Evaluator

    with Evaluator(config, workers) as evaluator:
        console.show_forecast(analysis.forecast(config, evaluator, workers))


def _go_on(folder: Path, workers: int) -> None:
    """Bring a run to its end and show it; when that fails, say how to go on."""
    from swarmevo import analysis, console, evolution
    from swarmevo.evaluation import Interrupted
    from swarmevo.store import Store

    how = f"go on with: swarmevo resume {shlex.quote(str(folder))}"
    with Store.open(folder, readonly=False) as store:
        try:
            with _StopOnSignal() as stop, console.progress(*analysis.generations(store)) as observe:
                evolution.evolve(store, workers, observe, stop)
        except (Interrupted, KeyboardInterrupt):
            print(f"interrupted; {how}", file=sys.stderr)
            raise SystemExit(INTERRUPTED) from None
        except Exception:
            if store.trials():
                print(how, file=sys.stderr)
            raise
        console.show_run(analysis.summarise(store))


class _StopOnSignal:
    """Whether Ctrl-C or SIGTERM asked to stop. The second signal acts as if nobody listened."""

    def __init__(self) -> None:
        self._wanted = self._said = False

    def __enter__(self) -> _StopOnSignal:
        self._before = {
            number: signal.signal(number, self._note)
            for number in (signal.SIGINT, signal.SIGTERM)
            if signal.getsignal(number) is not signal.SIG_IGN  # as nohup and background jobs have it
        }
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self._wanted = True
        self.__exit__()

    def __call__(self) -> bool:
        if self._wanted and not self._said:
            self._said = True
            print("stopping; once more to stop at once", file=sys.stderr)
        return self._wanted


# ---- looking ---------------------------------------------------------------------------------------------------------


@app.command()
def show(run: Run, as_json: Annotated[bool, typer.Option("--json", help="Everything, as JSON.")] = False) -> None:
    """Print a run's fronts, its hypervolume and its cost so far."""
    from swarmevo import analysis, console
    from swarmevo.store import Store

    with Store.open(run) as store:
        summary = analysis.summarise(store)
    if as_json:
        console.show_json(summary)
    else:
        console.show_run(summary)


@plugins_app.callback(invoke_without_command=True)
def list_plugins(context: typer.Context) -> None:
    """List the installed plugins, without importing any."""
    if context.invoked_subcommand is None:
        from swarmevo import console, plugins

        console.show_plugins(plugins.discover())


@plugins_app.command("check")
def check_plugin(name: Annotated[str, typer.Argument(metavar="NAME")]) -> None:
    """Load a plugin, make it with its defaults and print its options."""
    from swarmevo import console, plugins

    try:
        reports = plugins.check(name)
    except plugins.PluginError as error:
        _exit(USAGE, str(error))
    console.show_reports(reports)
    if any(report.error for report in reports):
        raise SystemExit(FAILED)


@app.command()
def doctor() -> None:
    """Check the installation; say what to do about what is unsound."""
    from swarmevo import console
    from swarmevo.doctor import examine

    findings = examine()
    console.show_findings(findings)
    if any(finding.advice for finding in findings):
        raise SystemExit(FAILED)

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
from contextlib import nullcontext
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, NoReturn, TextIO

import typer

from swarmevo import __version__
from swarmevo.errors import ConfigError, ExportError, SwarmevoError

if TYPE_CHECKING:
    from swarmevo.config import Config
    from swarmevo.evolution.threads import MakeBackend
    from swarmevo.runs.store import Store

FAILED = 1
USAGE = 2
INTERRUPTED = 130

_LARGEST_TEAM = 64
_SIDE_BY_SIDE = 8  # replays in a page

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,  # plain help needs no rich, whose import alone would take half of the time there is
    pretty_exceptions_enable=False,
    help="Evolve controllers for swarms of simulated robots, with several objectives at once.",
)
plugins_app = typer.Typer(rich_markup_mode=None)
app.add_typer(plugins_app, name="plugins")

Run = Annotated[Path, typer.Argument(metavar="RUN", help="A run folder.", exists=True, file_okay=False)]
Scheduler = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Of a Dask cluster to run on, such as tcp://host:8786.", show_default=False),
]
OtherWorld = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="SECTION.KEY=VALUE ...", help="In another world than that of the run."),
]
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
    if not isinstance(error, SwarmevoError):
        raise error
    _exit(USAGE if isinstance(error, ConfigError) else FAILED, *error.errors)


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
    scheduler: Scheduler = None,
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

    from swarmevo.runs import driver

    folder = out or Path("runs") / _run_name(config, chosen)
    driver.begin(folder, chosen)
    print(f"run {folder}, seed {chosen.evolution.seed}", file=sys.stderr)
    _go_on(folder, count, scheduler)


@app.command()
def resume(
    run: Run,
    workers: Workers = "auto",
    generations: Annotated[
        str | None, typer.Option(metavar="+N|N", help="Make the run longer: so many generations more, or in all.")
    ] = None,
    scheduler: Scheduler = None,
) -> None:
    """Go on with an interrupted or finished run; the result is that of a run never interrupted."""
    count = _worker_count(workers)
    if generations is not None:
        _extend(run, generations)
    _go_on(run, count, scheduler)


def _extend(folder: Path, generations: str) -> None:
    from swarmevo.runs import driver
    from swarmevo.runs.store import Store

    with Store.open(folder, readonly=False) as store:
        total = driver.extend(store, generations)
    print(f"{folder}: {total} generations in each trial", file=sys.stderr)


def _worker_count(text: str) -> int:
    if text == "auto":
        return len(os.sched_getaffinity(0))
    if not re.fullmatch(r"[1-9][0-9]{0,3}", text):
        _exit(USAGE, f"--workers: expected auto or a whole number from 1 to 9999, got {text!r}")
    return int(text)


def _checked(source: str | None, overrides: Sequence[str]) -> Config:
    """Return the configuration with a seed, after every check there is."""
    from swarmevo import config, plugins, simulation

    def errors(found: Config) -> list[str]:
        return simulation.scene_errors(found) + plugins.option_errors(found)

    return config.seeded(config.load(source, overrides, errors))


def _run_name(source: str | None, config: Config) -> str:
    from datetime import datetime

    return f"{Path(source or 'quick').stem}-{datetime.now():%Y%m%d-%H%M%S}-{config.evolution.seed}"


def _forecast(config: Config, workers: int) -> None:
    from swarmevo.analysis import fronts
    from swarmevo.evolution import loop
    from swarmevo.evolution.evaluation import Evaluator
    from swarmevo.views import console

    loop.rehearse(config)
    with Evaluator(config, workers) as evaluator:
        console.show_forecast(fronts.forecast(config, evaluator, workers))


def _go_on(folder: Path, workers: int, scheduler: str | None) -> None:
    """Bring a run to its end and show it; when that fails, say how to go on."""
    from swarmevo.analysis import fronts
    from swarmevo.errors import Interrupted
    from swarmevo.runs import driver
    from swarmevo.runs.store import Store
    from swarmevo.views import console

    how = f"go on with: swarmevo resume {shlex.quote(str(folder))}"
    if scheduler:
        how += f" --scheduler {shlex.quote(scheduler)}"
    with Store.open(folder, readonly=False) as store:
        try:
            with _StopOnSignal() as stop, console.progress(*fronts.generations(store)) as observe:
                driver.evolve(store, workers, observe, stop, _backend(scheduler))
        except (Interrupted, KeyboardInterrupt):
            print(f"interrupted; {how}", file=sys.stderr)
            raise SystemExit(INTERRUPTED) from None
        except Exception:
            if store.trials() or scheduler:
                print(how, file=sys.stderr)
            raise
        console.show_run(fronts.summarise(store))


def _backend(scheduler: str | None) -> MakeBackend:
    """Return where episodes run: here, or on a cluster."""
    from swarmevo.evolution.threads import ThreadBackend

    if scheduler is None:
        return ThreadBackend
    from swarmevo.evolution import cluster

    return cluster.backend(scheduler, lambda line: print(line, file=sys.stderr, flush=True))


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
    from swarmevo.analysis import fronts
    from swarmevo.runs.store import Store
    from swarmevo.views import console

    with Store.open(run) as store:
        summary = fronts.summarise(store)
    if as_json:
        console.show_json(summary)
    else:
        console.show_run(summary)


@app.command()
def verify(
    run: Run,
    sample: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Only so many evaluations, drawn at random.")
    ] = None,
    workers: Workers = "auto",
    as_json: Annotated[bool, typer.Option("--json", help="Everything, as JSON.")] = False,
) -> None:
    """Simulate a run's evaluations anew; say what differs from what is stored, and why. Exit code 1: something does."""
    from swarmevo.errors import Interrupted
    from swarmevo.runs import verification
    from swarmevo.runs.store import Store
    from swarmevo.views import console

    count = _worker_count(workers)
    with Store.open(run) as store:
        try:
            with _StopOnSignal() as stop, console.evaluations() as observe:
                report = verification.verify(store, count, sample, observe, stop)
        except (Interrupted, KeyboardInterrupt):
            print("interrupted", file=sys.stderr)
            raise SystemExit(INTERRUPTED) from None
    console.show_verification(report, as_json)
    if not report.is_sound:
        raise SystemExit(FAILED)


@app.command()
def export(
    run: Run,
    as_csv: Annotated[bool, typer.Option("--csv", help="Every episode, one line each.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Configuration, provenance, genomes and episodes.")] = False,
    controller: Annotated[int | None, typer.Option(metavar="ID", help="The genome with this id.")] = None,
    form: Annotated[str, typer.Option("--as", metavar="json|epuck|webots", help="Of a controller; C99.")] = "json",
    robot: Annotated[int, typer.Option(metavar="N", help="Whose controller, if each robot has its own.")] = 0,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="To write to; else stdout.", show_default=False)
    ] = None,
) -> None:
    """Write a run, or one of its controllers, for other programs."""
    from swarmevo.runs.store import Store

    if as_csv + as_json + (controller is not None) != 1:
        _exit(USAGE, "export: expected one of --csv, --json and --controller ID")
    if form not in ("json", "epuck", "webots"):
        _exit(USAGE, f"--as: expected json, epuck or webots, got {form!r}")
    with Store.open(run) as store:
        text = "" if controller is None else _controller(store, controller, form, robot)
        try:
            with out.open("x", encoding="utf-8") if out else nullcontext(sys.stdout) as stream:
                _write_export(store, stream, text, as_csv)
        except OSError as error:
            _exit(FAILED, f"{error.filename or out}: {error.strerror or error}")


def _controller(store: Store, genome: int, form: str, robot: int) -> str:
    from swarmevo.runs import export

    if form == "json":
        return json.dumps(export.controller(store, genome), indent=1) + "\n"
    try:
        return export.source(store, genome, "epuck" if form == "epuck" else "webots", robot)
    except ExportError as error:
        _exit(FAILED, str(error))


def _write_export(store: Store, stream: TextIO, text: str, as_csv: bool) -> None:
    from swarmevo.runs import export

    if text:
        stream.write(text)
    elif as_csv:
        export.write_csv(store, stream)
    else:
        export.write_json(store, stream)


@app.command("test")
def assess(
    run: Run,
    robots: Annotated[str, typer.Option(metavar="N|N-M", help="Team sizes: rows of the table.")] = "1-5",
    repeats: Annotated[int, typer.Option(metavar="N", min=1, max=65535, help="Tests of each controller.")] = 5,
    robustness: Annotated[bool, typer.Option("--robustness", help="Also other noise, starts and bumpers.")] = False,
    settings: OtherWorld = None,
    workers: Workers = "auto",
    as_json: Annotated[bool, typer.Option("--json", help="Everything, as JSON.")] = False,
) -> None:
    """Test the fronts' controllers on fresh seeds, in teams of several sizes: the paper's Table II."""
    from swarmevo.analysis import assessment, table_ii
    from swarmevo.errors import Interrupted
    from swarmevo.runs.store import Store
    from swarmevo.views import console

    sizes, count = _team_sizes(robots), _worker_count(workers)
    with Store.open(run) as store:
        try:
            with _StopOnSignal() as stop, console.tests() as observe:
                found = assessment.assess(store, sizes, repeats, robustness, count, observe, stop, settings or [])
        except (Interrupted, KeyboardInterrupt):
            print("interrupted; nothing was stored", file=sys.stderr)
            raise SystemExit(INTERRUPTED) from None
    fate = "not stored, being of another world" if found.changes else f"stored in {table_ii.save(found, run)}"
    if as_json:
        print(table_ii.as_json(found))
    else:
        console.show_assessment(found)
    print(fate, file=sys.stderr)


def _team_sizes(text: str, most: int = _LARGEST_TEAM) -> list[int]:
    """Return the sizes that ``3`` or ``1-5`` names, at most so many."""
    match = re.fullmatch(r"([1-9]\d?)(?:-([1-9]\d?))?", text)
    sizes = list(range(int(match[1]), int(match[2] or match[1]) + 1)) if match else []
    if not sizes or sizes[-1] > _LARGEST_TEAM or len(sizes) > most:
        limit = f"up to {most} sizes" if most < _LARGEST_TEAM else "several"
        _exit(USAGE, f"--robots: expected a team size from 1 to {_LARGEST_TEAM}, or {limit} as in 1-5, got {text!r}")
    return sizes


@app.command()
def report(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Run folders.", exists=True, file_okay=False)],
    html: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Default: report.html in the run folder.", show_default=False)
    ] = None,
    figures: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Also write the figures as PDF and PNG.", show_default=False)
    ] = None,
) -> None:
    """Write one HTML page about runs, with replays to click on; it needs no network."""
    from swarmevo.views.report import page as report

    if html is None and len(runs) > 1:
        _exit(USAGE, "--html: expected a file for the report of several runs, got none")
    try:
        file = report.write(runs, html or runs[0] / report.FILE, lambda what: print(what, file=sys.stderr))
        written = [file, *(report.write_figures(runs, figures) if figures else [])]
    except OSError as error:
        _exit(FAILED, f"{error.filename or html}: {error.strerror or error}")
    for path in written:
        print(path)


@app.command()
def replay(
    run: Annotated[str, typer.Argument(metavar="RUN[:ID]", help="A run folder and an individual; else its best.")],
    html: Annotated[Path | None, typer.Option(metavar="FILE", help="Write a page that opens offline.")] = None,
    video: Annotated[Path | None, typer.Option(metavar="FILE", help="Write a .webp or .mp4; needs Chromium.")] = None,
    serve: Annotated[bool, typer.Option("--serve", help="Serve the page on this machine.")] = False,
    live: Annotated[bool, typer.Option("--live", help="Serve episodes that are simulated while they play.")] = False,
    generation: Annotated[int | None, typer.Option(metavar="N", help="Of the episode; else the last one.")] = None,
    repeat: Annotated[int, typer.Option(metavar="N", help="Of the episode.")] = 0,
    robots: Annotated[str | None, typer.Option(metavar="N|N-M", help="Teams of these sizes, side by side.")] = None,
    settings: OtherWorld = None,
    speed: Annotated[float, typer.Option(metavar="X", help="Of the video: times real time.", min=0.1, max=100)] = 8.0,
    seconds: Annotated[str | None, typer.Option(metavar="FROM-TO", help="Of the episode, in the video.")] = None,
    port: Annotated[int, typer.Option(metavar="N", help="To serve on; 0: any.", min=0, max=65535)] = 8000,
    force: Annotated[bool, typer.Option("--force", help="Show a trajectory other than the stored one too.")] = False,
) -> None:
    """Simulate an individual's stored episode once more and show it in 3-D."""
    from swarmevo.runs import other_world
    from swarmevo.runs.store import Store
    from swarmevo.views.replay import episode as replay_episode
    from swarmevo.views.replay import page as replay_page

    folder, genome = _run_and_individual(run)
    sizes = [] if robots is None else _team_sizes(robots, _SIDE_BY_SIDE)
    span = _seconds(seconds)
    if live:
        with Store.open(folder) as store:
            replay_episode.choose(store, genome)  # else the page alone would say that there is none
            other_world.load(store, settings or [])
        _serve(replay_page.render([], f"{folder.name}, live", live=True), port, folder, genome, settings or [])
        return
    if video:
        from swarmevo.views.replay import video as replay_video

        replay_video.check(video)
    with Store.open(folder) as store:
        chosen = replay_episode.choose(store, genome, generation, repeat)
        episodes, warning = replay_episode.episodes(store, chosen, sizes, force, settings or [])
    if warning:
        print(f"warning: {warning}", file=sys.stderr)
    page = replay_page.render(episodes, f"{folder.name}, individual {chosen.genome}")
    if html or not (video or serve):
        name = f"replay-{chosen.genome}{'-other-world' if settings else ''}.html"
        _write_page(html or folder / name, page)
    if video:
        _film(video, page, speed, span or (0.0, episodes[0]["horizon"]))
    if serve:
        _serve(page, port)


def _run_and_individual(text: str) -> tuple[Path, int | None]:
    folder, _, individual = text.rpartition(":")
    if not Path(text).is_dir() and re.fullmatch("[0-9]{1,18}", individual):
        return Path(folder), int(individual)
    return Path(text), None


def _seconds(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    match = re.fullmatch(r"(\d+(?:\.\d+)?)-(\d+(?:\.\d+)?)", text)
    if not match or float(match[1]) >= float(match[2]):
        _exit(USAGE, f"--seconds: expected a span such as 10-40, got {text!r}")
    return float(match[1]), float(match[2])


def _write_page(file: Path, page: str) -> None:
    try:
        file.write_text(page, encoding="utf-8")
    except OSError as error:
        _exit(FAILED, f"{file}: {error.strerror}")
    print(file)


def _film(file: Path, page: str, speed: float, span: tuple[float, float]) -> None:
    from swarmevo.views import console
    from swarmevo.views.replay import video as replay_video

    film = replay_video.Film(*span, speed=speed)
    with console.frames(len(film.times())) as observe:
        replay_video.write(file, page, film, observe)
    print(file)


def _serve(
    page: str, port: int, folder: Path | None = None, genome: int | None = None, settings: Sequence[str] = ()
) -> None:
    """Serve a page, and, of a run's folder, live episodes, until Ctrl-C."""
    import contextlib

    from swarmevo.views.replay import server as replay_server

    episode = replay_server.live_episodes(folder, genome, settings) if folder else None
    with replay_server.server(page, port, episode) as server:
        print(replay_server.hint(server.server_port), file=sys.stderr)
        with contextlib.suppress(KeyboardInterrupt):
            server.serve_forever()


@plugins_app.callback(invoke_without_command=True)
def list_plugins(context: typer.Context) -> None:
    """List the installed plugins, without importing any."""
    if context.invoked_subcommand is None:
        from swarmevo import plugins
        from swarmevo.views import console

        console.show_plugins(plugins.discover())


@plugins_app.command("check")
def check_plugin(name: Annotated[str, typer.Argument(metavar="NAME")]) -> None:
    """Load a plugin, make it with its defaults and print its options."""
    from swarmevo import plugins
    from swarmevo.views import console

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
    from swarmevo.views import console
    from swarmevo.views.doctor import examine

    findings = examine()
    console.show_findings(findings)
    if any(finding.advice and finding.is_fault for finding in findings):
        raise SystemExit(FAILED)

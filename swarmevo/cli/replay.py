# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo replay``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer

from swarmevo.cli.common import (
    USAGE,
    OtherWorld,
    app,
    examples,
    exit_with,
    run_and_individual,
    say,
    team_sizes,
    without_effect,
)

_SIDE_BY_SIDE = 8  # replays in a page


@app.command(
    epilog=examples(
        "swarmevo replay --best --robots 3-5",
        "swarmevo replay runs/first:31 --html 31.html",
        "swarmevo replay runs/first --video push.webp --seconds 0-60",
    )
)
def replay(
    context: typer.Context,
    run: Annotated[
        str | None,
        typer.Argument(
            metavar="RUN[:ID]", help="The folder of a run, and the id of an individual; default: its most successful."
        ),
    ] = None,
    best: Annotated[
        bool, typer.Option("--best", help="Show the controller that comes with swarmevo, which is of no run.")
    ] = False,
    html: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Write to this file, whose folder is made; default: in the run's. It opens offline."
        ),
    ] = None,
    video: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a film, .webp or .mp4, instead; it needs Chromium.")
    ] = None,
    serve: Annotated[bool, typer.Option("--serve", help="Serve the page on this machine.")] = False,
    live: Annotated[bool, typer.Option("--live", help="Serve episodes that are simulated while they play.")] = False,
    generation: Annotated[
        int | None,
        typer.Option(metavar="N", help="Show an episode of this generation; default: any, with --repeat the last."),
    ] = None,
    repeat: Annotated[
        int | None, typer.Option(metavar="N", help="Show this repeat of the episode; default: the most successful.")
    ] = None,
    robots: Annotated[
        str | None, typer.Option(metavar="N|N-M", help="Show teams of these sizes, side by side.")
    ] = None,
    settings: OtherWorld = None,
    speed: Annotated[
        float, typer.Option(metavar="X", help="Let the film run at so many times real time.", min=0.1, max=100)
    ] = 8.0,
    seconds: Annotated[
        str | None, typer.Option(metavar="FROM-TO", help="Show this part of the episode in the film.")
    ] = None,
    port: Annotated[
        int, typer.Option(metavar="N", help="Serve on this port; 0: any that is free.", min=0, max=65535)
    ] = 8000,
    force: Annotated[
        bool, typer.Option("--force", help="Show a trajectory though it differs from the stored one.")
    ] = False,
) -> None:
    """Show an episode of an individual in 3-D.

    It is the stored one, simulated once more and checked bit by bit, or one in another world, or one of the controller
    that comes with swarmevo.
    """
    from swarmevo.analysis import shipped
    from swarmevo.runs import other_world
    from swarmevo.runs.store import Store
    from swarmevo.views.replay import episode as replay_episode
    from swarmevo.views.replay import page as replay_page

    if live:
        stored = ("generation", "repeat", "robots", "force")  # what a live episode is not
        without_effect(context, "with --live", "html", "video", "serve", *stored)
    if not (live or serve):
        without_effect(context, "without --serve or --live", "port")
    if not video:
        without_effect(context, "without --video", "speed", "seconds")
    if best == (run is not None):
        exit_with(USAGE, f"replay: expected RUN or --best, got {'both' if best else 'neither'}")
    sizes = [] if robots is None else team_sizes(robots, _SIDE_BY_SIDE)
    span = _seconds(seconds)
    if video:
        from swarmevo.views.replay import video as replay_video

        replay_video.check(video)
    if run is None:
        without_effect(context, "with --best", "live", "generation", "force")
        episodes = replay_episode.shipped_episodes(repeat or 0, sizes, settings or [])
        page = replay_page.render(episodes, shipped.TITLE)
        html = html or (None if video or serve else Path("replay-best.html"))
        _put(page, html, video, speed, span, serve, port, episodes)
        return
    folder, genome = run_and_individual(run)
    if live:
        with Store.open(folder) as store:
            replay_episode.choose(store, genome, repeat=0)  # else the page alone would say that there is none
            other_world.load(store, settings or [])
        _serve(replay_page.render([], f"{folder.name}, live", live=True), port, folder, genome, settings or [])
        return
    with Store.open(folder) as store:
        chosen = replay_episode.choose(store, genome, generation, repeat)
        episodes, warning = replay_episode.episodes(store, chosen, sizes, force, settings or [])
    if warning:
        say(f"warning: {warning}")
    if (every := max(episode["thinned"] for episode in episodes)) > 1:
        say(f"long episode: 1 control step of {every} is shown")
    page = replay_page.render(episodes, f"{folder.name}, individual {chosen.genome}")
    name = f"replay-{chosen.genome}{'-other-world' if settings else ''}.html"
    _put(page, html or (None if video or serve else folder / name), video, speed, span, serve, port, episodes)


def _put(
    page: str,
    html: Path | None,
    video: Path | None,
    speed: float,
    span: tuple[float, float] | None,
    serve: bool,
    port: int,
    episodes: Sequence[Mapping[str, Any]],
) -> None:
    """Bring a page where it is wanted."""
    if html:
        _write_page(html, page)
    if video:
        _film(video, page, speed, span or (0.0, episodes[0]["horizon"]))
    if serve:
        _serve(page, port)


def _seconds(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    match = re.fullmatch(r"(\d+(?:\.\d+)?)-(\d+(?:\.\d+)?)", text)
    if not match or float(match[1]) >= float(match[2]):
        exit_with(USAGE, f"--seconds: expected a span such as 10-40, got {text!r}")
    return float(match[1]), float(match[2])


def _write_page(file: Path, page: str) -> None:
    from swarmevo.runs import files

    with files.folder_made(file.parent):
        files.write(file, page)
    print(file)


def _film(file: Path, page: str, speed: float, span: tuple[float, float]) -> None:
    from swarmevo.runs import files
    from swarmevo.views import console
    from swarmevo.views.replay import video as replay_video

    film = replay_video.Film(*span, speed=speed)
    with files.folder_made(file.parent), console.frames(len(film.times())) as observe:
        replay_video.write(file, page, film, observe)
    print(file)


def _serve(
    page: str, port: int, folder: Path | None = None, genome: int | None = None, settings: Sequence[str] = ()
) -> None:
    """Serve a page, and, of a run's folder, live episodes, until Ctrl-C."""
    from swarmevo.views.replay import server as replay_server

    episode = replay_server.live_episodes(folder, genome, settings) if folder else None
    with replay_server.server(page, port, episode) as server:
        say(replay_server.hint(server.server_port))
        with suppress(KeyboardInterrupt):
            server.serve_forever()

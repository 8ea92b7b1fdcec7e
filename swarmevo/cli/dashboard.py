# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo dashboard``."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from swarmevo.cli.common import FAILED, app, examples, exit_with, say


@app.command(epilog=examples("swarmevo dashboard runs", "swarmevo dashboard runs/first --port 8101"))
def dashboard(
    runs: Annotated[
        Path, typer.Argument(metavar="RUNS", help="A folder with runs in it, or a run.", exists=True, file_okay=False)
    ],
    port: Annotated[
        int,
        typer.Option(metavar="N", help="Serve on this port of this machine; 0: any that is free.", min=0, max=65535),
    ] = 8100,
) -> None:
    """Serve a live page of running and finished runs.

    It has their progress, fronts, hypervolume, failed episodes and replays. Evolution goes on meanwhile.
    """
    try:
        from swarmevo.views.dashboard import server
    except ModuleNotFoundError as error:
        exit_with(FAILED, f"{error.name}: expected it installed for the dashboard; pip install 'swarmevo[dashboard]'")
    from swarmevo.views.dashboard import page
    from swarmevo.views.dashboard.watch import Watch
    from swarmevo.views.replay.server import hint

    with server.listen(port) as listening:
        say(hint(listening.getsockname()[1]))
        with suppress(KeyboardInterrupt):
            server.serve(Watch(runs), page.render(), listening)

# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo show``."""

from __future__ import annotations

from swarmevo.cli.common import AsJson, Run, app, examples, say_how_it_was_left


@app.command(epilog=examples("swarmevo show runs/first", "swarmevo show runs/first --json"))
def show(run: Run, as_json: AsJson = False) -> None:
    """Print a run's fronts, its hypervolume and its cost so far."""
    from swarmevo.analysis import fronts
    from swarmevo.runs.store import Store
    from swarmevo.views import console

    with Store.open(run) as store:
        say_how_it_was_left(store)
        summary = fronts.summarise(store)
    if as_json:
        console.show_json(summary)
    else:
        console.show_run(summary)

# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo show``."""

from __future__ import annotations

from swarmevo.cli.common import AsJson, Run, app, examples, say_how_it_was_left


@app.command(epilog=examples("swarmevo show runs/first", "swarmevo show runs/first --json"))
def show(run: Run, as_json: AsJson = False) -> None:
    """Print a run's fronts, its hypervolume and its cost so far.

    Of a sweep, it is the table of its settings.
    """
    from swarmevo.analysis import fronts
    from swarmevo.runs.store import Store
    from swarmevo.sweeps import folder
    from swarmevo.views import console

    if folder.is_sweep(run):
        from swarmevo.cli.sweep import show_findings
        from swarmevo.sweeps import outcome

        show_findings(outcome.read(folder.Sweep.open(run)), as_json)
        return
    with Store.open(run) as store:
        say_how_it_was_left(store)
        summary = fronts.summarise(store)
    if as_json:
        console.show_json(summary)
    else:
        console.show_run(summary)

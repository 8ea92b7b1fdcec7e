# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo plugins`` and ``swarmevo plugins check``."""

from __future__ import annotations

from typing import Annotated

import typer

from swarmevo.cli.common import FAILED, USAGE, app, examples, exit_with
from swarmevo.cli.usage import Family, Verb

plugins_app = typer.Typer(
    cls=Family, rich_markup_mode=None, epilog=examples("swarmevo plugins", "swarmevo plugins check pde")
)
app.add_typer(plugins_app, name="plugins")


@plugins_app.callback(invoke_without_command=True)
def list_plugins(context: typer.Context) -> None:
    """List the installed plugins, without importing any."""
    if context.invoked_subcommand is None:
        from swarmevo import plugins
        from swarmevo.views import console

        console.show_plugins(plugins.discover())


@plugins_app.command("check", cls=Verb, epilog=examples("swarmevo plugins check pde"))
def check_plugin(name: Annotated[str, typer.Argument(metavar="NAME", help="The plugin's name.")]) -> None:
    """Load a plugin, make it with its defaults, in the default world, and print its options."""
    from swarmevo import plugins
    from swarmevo.views import console

    try:
        reports = plugins.check(name)
    except plugins.PluginError as error:
        exit_with(USAGE, str(error))
    console.show_reports(reports)
    if any(report.error for report in reports):
        raise SystemExit(FAILED)

# SPDX-License-Identifier: BSD-3-Clause
"""The command line: arguments, what is printed where, and exit codes. Everything else is done by other packages.

Each verb, or family of verbs, is a module of this package that registers its commands with ``common.app``. A new verb
is a new module and its name in ``VERBS``. ``--help`` must answer at once, so a module here imports nothing at its top
but the standard library, typer and ``common``; each command imports what it needs when it runs.
"""

from __future__ import annotations

from importlib import import_module

from swarmevo.cli.common import app, main, program
from swarmevo.cli.usage import Verb

__all__ = ["VERBS", "main", "program"]

# In the order of --help.
VERBS = (
    "evolve",
    "sweep",
    "show",
    "verify",
    "export",
    "test",
    "report",
    "compare",
    "replay",
    "dashboard",
    "plugins",
    "doctor",
)

for _verb in VERBS:
    import_module(f"{__name__}.{_verb}")

for _command in app.registered_commands:
    _command.cls = Verb

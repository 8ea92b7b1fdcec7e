# SPDX-License-Identifier: BSD-3-Clause
"""How things look on the console: tables and data on stdout, progress on stderr."""

from swarmevo.views.console.bars import evaluations, frames, progress, tests
from swarmevo.views.console.installation import show_findings, show_plugins, show_reports
from swarmevo.views.console.runs import show_forecast, show_json, show_run, show_verification, sparkline
from swarmevo.views.console.tables import show_assessment

__all__ = [
    "evaluations", "frames", "progress", "show_assessment", "show_findings", "show_forecast", "show_json",
    "show_plugins", "show_reports", "show_run", "show_verification", "sparkline", "tests",
]  # fmt: skip

# SPDX-License-Identifier: BSD-3-Clause
"""An installation on the console: its plugins, and what the doctor found."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from swarmevo.views.console import output

if TYPE_CHECKING:
    from swarmevo.plugins import PluginEntry, Report
    from swarmevo.views.doctor import Finding


def show_plugins(entries: Iterable[PluginEntry]) -> None:
    """Print a table of plugins."""
    table = output.table("kind", "name", "distribution", "target", "")
    for entry in entries:
        table.add_row(entry.kind, entry.name, entry.origin, entry.target, "name taken twice" if entry.clash else "")
    output.stdout().print(table)


def show_reports(reports: Iterable[Report]) -> None:
    """Print what came of loading plugins."""
    out = output.stdout()
    for report in reports:
        out.print(f"{report.entry}")
        for option in report.options:
            out.print(f"  {option}")
        out.print(f"  broken: {report.error}" if report.error else "  sound")
        if report.elsewhere:
            out.print(f"  but not for the default world: {report.elsewhere}")
            out.print("  try it in its own: swarmevo evolve CONFIG --dry-run")


def show_findings(findings: Iterable[Finding]) -> None:
    """Print what the doctor found."""
    out = output.stdout()
    for finding in findings:
        verdict = ("FAIL" if finding.is_fault else "warn") if finding.advice else "ok"
        out.print(f"{verdict:4}  {finding.subject}: {finding.text}")
        if finding.advice:
            out.print(f"      what to do: {finding.advice}")

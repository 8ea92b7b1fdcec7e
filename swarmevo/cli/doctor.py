# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo doctor``."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import TYPE_CHECKING

from swarmevo.cli.common import FAILED, app, examples

if TYPE_CHECKING:
    from swarmevo.views.doctor import Finding


@app.command(epilog=examples("swarmevo doctor"))
def doctor() -> None:
    """Check the installation; say what to do about what is unsound."""
    from swarmevo.views import console
    from swarmevo.views.doctor import examine

    findings = [*map(_excused, examine()), *_rivals()]
    console.show_findings(findings)
    if any(finding.advice and finding.is_fault for finding in findings):
        raise SystemExit(FAILED)


def _excused(finding: Finding) -> Finding:
    """Return the finding on a plugin that wants another library as no fault: its distribution can do without."""
    from swarmevo import plugins

    kind, _, name = finding.subject.partition(" ")
    if not finding.advice or kind not in plugins.GROUPS:
        return finding
    if not any(report.lacks_library for report in plugins.check(name) if report.entry.kind == kind):
        return finding
    return dataclasses.replace(finding, advice=f"if you want {name}, install what it needs", is_fault=False)


def _rivals() -> Iterator[Finding]:
    """Look for the configurations that come with swarmevo whose optimiser does not."""
    from swarmevo import plugins
    from swarmevo.config import load, packaged
    from swarmevo.views.doctor import Finding

    installed = {entry.name for entry in plugins.discover() if entry.kind == "optimiser"}
    for name in packaged():
        for lacking in sorted(plugins.RIVALS.intersection(load(name).optimiser) - installed):
            text = f"optimiser.{lacking} of swarmevo-rivals is not installed"
            yield Finding(f"configuration {name}", text, plugins.INSTALL_RIVALS, is_fault=False)

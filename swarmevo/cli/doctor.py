# SPDX-License-Identifier: BSD-3-Clause
"""``swarmevo doctor``."""

from __future__ import annotations

from swarmevo.cli.common import FAILED, app, examples


@app.command(epilog=examples("swarmevo doctor"))
def doctor() -> None:
    """Check the installation; say what to do about what is unsound."""
    from swarmevo.views import console
    from swarmevo.views.doctor import examine

    findings = examine()
    console.show_findings(findings)
    if any(finding.advice and finding.is_fault for finding in findings):
        raise SystemExit(FAILED)

# SPDX-License-Identifier: BSD-3-Clause
"""What a figure is drawn of: a run's folder, or a run that is open already."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TypeAlias

from swarmevo.runs.store import Store

Run: TypeAlias = Store | str | os.PathLike[str]
"""An open run, or its folder."""


@contextmanager
def opened(run: Run) -> Iterator[Store]:
    """Give a run's store; close it if it was opened for this."""
    if isinstance(run, Store):
        yield run
        return
    with Store.open(run) as store:
        yield store

# SPDX-License-Identifier: BSD-3-Clause
"""A dashboard that is served while a test looks at it."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from swarmevo.views.dashboard import page, server
from swarmevo.views.dashboard.watch import Watch


@contextmanager
def serving(watch: Watch, monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """Serve the page and give the port."""
    monkeypatch.setattr(server, "PERIOD", 0.02)
    with server.listen(0) as listening:
        made = server.make_server(watch, page.render())
        thread = threading.Thread(target=made.run, kwargs={"sockets": [listening]})
        thread.start()
        try:
            yield listening.getsockname()[1]
        finally:
            made.should_exit = True
            thread.join()

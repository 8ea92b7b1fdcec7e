# SPDX-License-Identifier: BSD-3-Clause
"""Replays in a browser on this machine: a page, and episodes that are simulated while it shows them."""

from __future__ import annotations

import getpass
import json
import socket
from collections.abc import Callable, Iterator, Sequence
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import count
from pathlib import Path
from typing import Any, Final

from swarmevo.errors import ReplayError
from swarmevo.runs import other_world
from swarmevo.runs.store import Store
from swarmevo.views.replay import episode as replay_episode

HOST: Final = "127.0.0.1"
"""Nobody else's machine can connect."""

Events = Iterator[tuple[str, Any]]


def server(page: str, port: int, episode: Callable[[int], Events] | None = None) -> ThreadingHTTPServer:
    """Return a server of one page, which listens already and serves in ``serve_forever``.

    Args:
        page: HTML.
        port: 0: any that is free.
        episode: Called with 0, 1, ... when the page asks for its next episode; yields the events of
            :func:`swarmevo.views.replay.episode.stream`.

    Raises:
        ReplayError: The port is not free.
    """
    numbers = count()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            if self.path == "/":
                _send_page(self, page)
            elif self.path == "/episode" and episode is not None:
                _send_events(self, episode(next(numbers)))
            else:
                self.send_error(HTTPStatus.NOT_FOUND)

        def log_message(self, format: str, *args: object) -> None:
            """Say nothing: there is one page."""

    class Server(ThreadingHTTPServer):
        daemon_threads = True  # a page that still listens does not keep the program alive

    try:
        return Server((HOST, port), Handler)
    except OSError as error:
        raise ReplayError(f"port {port}: {error.strerror}; choose another one with --port") from error


def hint(port: int) -> str:
    """Return how to see the page, here and from another machine."""
    return (
        f"http://{HOST}:{port}/ (Ctrl-C ends); from another machine first: "
        f"ssh -L {port}:{HOST}:{port} {getpass.getuser()}@{socket.gethostname()}"
    )


def live_episodes(folder: Path, genome: int | None, overrides: Sequence[str] = ()) -> Callable[[int], Events]:
    """Return a function whose n-th call streams an individual's n-th episode, the first one a stored one.

    Without a ``genome`` it is each time the best of the front as it is then: of a run that still evolves, the newest.
    With ``overrides`` the episodes are in another world (:func:`swarmevo.runs.other_world.load`).
    """

    def episode(number: int) -> Events:
        with Store.open(folder) as store:
            chosen = replay_episode.choose(store, genome)
            settings = other_world.load(store, overrides)
            changes = other_world.changes(store, settings)
        key = chosen.key._replace(repeat=number)
        place = f"live: seed {key.seed}, trial {key.trial}, generation {key.generation}, repeat {key.repeat}"
        place = ", ".join([place, *changes])
        title = f"{folder.resolve().name}, individual {chosen.genome}"
        yield from replay_episode.stream(settings, chosen.genes, key, title, place)

    return episode


def _send_page(handler: BaseHTTPRequestHandler, page: str) -> None:
    content = page.encode()
    handler.send_response(HTTPStatus.OK)
    handler.send_header("Content-Type", "text/html; charset=utf-8")
    handler.send_header("Content-Length", str(len(content)))
    handler.end_headers()
    handler.wfile.write(content)


def _send_events(handler: BaseHTTPRequestHandler, events: Events) -> None:
    """Send server-sent events until there are no more or nobody listens."""
    handler.send_response(HTTPStatus.OK)
    handler.send_header("Content-Type", "text/event-stream")
    handler.send_header("Cache-Control", "no-store")
    handler.end_headers()
    try:
        for name, content in _or_failure(events):
            handler.wfile.write(f"event: {name}\ndata: {json.dumps(content)}\n\n".encode())
            handler.wfile.flush()
    except ConnectionError:  # the page was closed
        pass


def _or_failure(events: Events) -> Events:
    """Yield ``events``; what goes wrong becomes the last one, for the page to show."""
    try:
        yield from events
    except Exception as error:
        yield "failed", f"{type(error).__name__}: {error}"

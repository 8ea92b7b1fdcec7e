# SPDX-License-Identifier: BSD-3-Clause
"""Replays in a browser on this machine: a page, and episodes that are simulated while it shows them."""

from __future__ import annotations

import getpass
import json
import socket
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import count
from pathlib import Path
from typing import Any, Final, Protocol
from urllib.parse import urlsplit

from swarmevo.errors import ReplayError
from swarmevo.runs import other_world
from swarmevo.runs.store import Store
from swarmevo.views.replay import episode as replay_episode

HOST: Final = "127.0.0.1"
"""Nobody else's machine can connect."""
MOST_CLIENTS: Final = 16
"""Connections at once, a thread for each; a browser keeps a few open without use."""
IDLE_SECONDS: Final = 5.0
"""A connection that sends or takes nothing for so long is closed."""

_PIECE: Final = 65536  # [bytes]
_OURS: Final = ("127.0.0.1", "localhost", "::1")  # names of this machine; another one may have been pointed here

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
        timeout = IDLE_SECONDS

        def do_GET(self) -> None:
            if not is_ours(self.headers):
                self.send_error(HTTPStatus.FORBIDDEN, "expected the address that swarmevo has printed")
            elif self.path == "/":
                _send_page(self, page)
            elif self.path == "/episode" and episode is not None:
                _send_events(self, episode(next(numbers)))
            else:
                self.send_error(HTTPStatus.NOT_FOUND)

        def log_message(self, format: str, *args: object) -> None:
            """Say nothing: there is one page."""

    try:
        return _Server((HOST, port), Handler)
    except OSError as error:
        raise ReplayError(f"port {port}: {error.strerror}; choose another one with --port") from error


class _Server(ThreadingHTTPServer):
    """A thread for each of a limited number of connections."""

    request_queue_size = 128  # of connections that come at once
    daemon_threads = True  # a page that still listens does not keep the program alive

    def __init__(self, *arguments: Any) -> None:
        self._free = threading.Semaphore(MOST_CLIENTS)
        super().__init__(*arguments)

    def process_request(self, request: Any, client_address: Any) -> None:
        if self._free.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            with suppress(OSError):
                request.sendall(b"HTTP/1.0 503 Too many connections\r\n\r\n")
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of clients that went away; any other error is a fault of ours."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


class _Headers(Protocol):
    def get(self, name: str, default: str, /) -> str: ...


def is_ours(headers: _Headers) -> bool:
    """Whether a request names this machine, and comes from no other page: else a web page could read what is here.

    That page's own name may lead to this machine (DNS rebinding); the browser sends the name all the same.
    """
    host = headers.get("Host", "")
    with suppress(ValueError):  # not even a name
        return urlsplit(f"//{host}").hostname in _OURS and headers.get("Origin", f"http://{host}") == f"http://{host}"
    return False


def hint(port: int) -> str:
    """Return how to see the page, here and from another machine."""
    return (
        f"http://{HOST}:{port}/ (Ctrl-C ends); from another machine first: "
        f"ssh -L {port}:{HOST}:{port} {_user()}{socket.gethostname()}"
    )


def _user() -> str:
    """Return who we are, for an address; nothing if the system has no name for us, as in a container."""
    try:
        return f"{getpass.getuser()}@"
    except (KeyError, OSError):
        return ""


def live_episodes(folder: Path, genome: int | None, overrides: Sequence[str] = ()) -> Callable[[int], Events]:
    """Return a function whose n-th call streams an individual's n-th episode, the first one a stored one.

    Without a ``genome`` it is each time the best of the front as it is then: of a run that still evolves, the newest.
    With ``overrides`` the episodes are in another world (:func:`swarmevo.runs.other_world.load`).
    """

    def episode(number: int) -> Events:
        with Store.open(folder) as store:
            chosen = replay_episode.choose(store, genome, repeat=0)
            key = chosen.key._replace(repeat=number)
            settings = other_world.load(store, overrides)
            changes = other_world.changes(store.config, settings)
            if not changes:
                settings = other_world.of_episode(store.config, key)
        place = f"live: seed {key.seed}, trial {key.trial}, generation {key.generation}, repeat {key.repeat}"
        place = ", ".join([place, *changes])
        title = f"{folder.resolve().name}, individual {chosen.genome}"
        yield from replay_episode.stream(settings, chosen.genes, key, title, place)

    return episode


def _send_page(handler: BaseHTTPRequestHandler, page: str) -> None:
    content = page.encode(errors="backslashreplace")  # of a path that is no UTF-8
    handler.send_response(HTTPStatus.OK)
    handler.send_header("Content-Type", "text/html; charset=utf-8")
    handler.send_header("Content-Length", str(len(content)))
    handler.end_headers()
    _send(handler, content)


def _send(handler: BaseHTTPRequestHandler, content: bytes) -> None:
    """Send piece by piece, each within the time limit: all of it may take longer."""
    for start in range(0, len(content), _PIECE):
        handler.wfile.write(content[start : start + _PIECE])


def _send_events(handler: BaseHTTPRequestHandler, events: Events) -> None:
    """Send server-sent events until there are no more or nobody listens."""
    handler.send_response(HTTPStatus.OK)
    handler.send_header("Content-Type", "text/event-stream")
    handler.send_header("Cache-Control", "no-store")
    handler.end_headers()
    try:
        for name, content in _or_failure(events):
            _send(handler, f"event: {name}\ndata: {json.dumps(content)}\n\n".encode())
    except OSError:  # the page was closed, or takes nothing
        pass


def _or_failure(events: Events) -> Events:
    """Yield ``events``; what goes wrong becomes the last one, for the page to show."""
    try:
        yield from events
    except Exception as error:
        yield "failed", f"{type(error).__name__}: {error}"

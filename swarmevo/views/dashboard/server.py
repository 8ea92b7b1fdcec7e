# SPDX-License-Identifier: BSD-3-Clause
"""The page, on this machine alone, and what it asks for: what is new, by server-sent events; episodes; configurations.

Needs ``pip install 'swarmevo[dashboard]'``. Nothing here writes, and a run is named by an id that is looked up, never
by a path.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from functools import partial
from typing import Any, Final

import uvicorn
from anyio import CapacityLimiter, to_thread
from starlette.applications import Starlette
from starlette.datastructures import Headers
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from swarmevo.errors import SwarmevoError
from swarmevo.plugins.calls import one_line
from swarmevo.runs.folder import CONFIG_FILE
from swarmevo.views.dashboard import episode
from swarmevo.views.dashboard.watch import Snapshot, Watch
from swarmevo.views.replay.server import HOST, is_ours

PERIOD: Final = 1.0
"""[s] between two looks at the runs, while somebody has the page open."""
MOST_CLIENTS: Final = 64
"""Connections at once."""
_SILENCE: Final = 15.0  # [s] after which a page that was told nothing is told so: it notices a server that has gone
_HEADERS: Final = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
}


def listen(port: int) -> socket.socket:
    """Return a socket of this machine that listens.

    Args:
        port: 0: any that is free.

    Raises:
        SwarmevoError: The port is not free.
    """
    found = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # of a dashboard that has just ended
        found.bind((HOST, port))
        found.listen(128)
    except OSError as error:
        found.close()
        raise SwarmevoError(f"port {port}: {error.strerror}; choose another one with --port") from error
    return found


def serve(watch: Watch, page: str, listening: socket.socket) -> None:
    """Serve the page until Ctrl-C."""
    make_server(watch, page).run(sockets=[listening])


def make_server(watch: Watch, page: str) -> uvicorn.Server:
    """Return the server, which says nothing of its own."""
    config = uvicorn.Config(
        application(watch, page),
        loop="asyncio",
        http="h11",
        ws="none",
        lifespan="on",
        log_config=None,
        log_level="critical",
        access_log=False,
        server_header=False,
        limit_concurrency=MOST_CLIENTS,
        timeout_graceful_shutdown=0,  # pages that listen would do so for ever
    )
    return uvicorn.Server(config)


def application(watch: Watch, page: str) -> Starlette:
    """Return what answers.

    Args:
        watch: The runs.
        page: HTML.
    """
    hub = Hub(watch)
    content = page.encode(errors="backslashreplace")

    async def index(request: Request) -> Response:
        return HTMLResponse(content)

    async def events(request: Request) -> Response:
        return StreamingResponse(hub.events(request.query_params.get("run", "")), media_type="text/event-stream")

    async def replay(request: Request) -> Response:
        return await hub.replay(
            *(request.query_params.get(name, "") for name in ("run", "trial", "generation", "genome")),
            *([request.query_params["repeat"]] if "repeat" in request.query_params else []),
        )

    async def configuration(request: Request) -> Response:
        return await hub.configuration(request.query_params.get("run", ""))

    routes = {"/": index, "/events": events, "/episode": replay, "/config": configuration}
    return Starlette(
        routes=[Route(path, answer, methods=["GET"]) for path, answer in routes.items()],
        middleware=[Middleware(OursAlone)],
        lifespan=hub.lifespan,
    )


class OursAlone:
    """Refuses requests that name another machine or come from another site's page, and adds the headers of all."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                added = [(name.lower().encode(), value.encode()) for name, value in _HEADERS.items()]
                message = {**message, "headers": [*message["headers"], *added]}
            await send(message)

        refused = PlainTextResponse("expected the address that swarmevo has printed", status_code=403)
        answer: Callable[[Scope, Receive, Send], Awaitable[None]] = (
            self._app if is_ours(Headers(scope=scope)) else refused
        )
        await answer(scope, receive, send_with_headers)


class Hub:
    """Looks at the runs while pages are open, and tells them what is new."""

    def __init__(self, watch: Watch) -> None:
        self._watch = watch
        self._snapshot = Snapshot()
        self._opened: dict[object, str] = {}  # which run each open page shows
        self._one_at_a_time: CapacityLimiter

    @asynccontextmanager
    async def lifespan(self, app: Starlette) -> AsyncIterator[None]:
        """Look at the runs for as long as the server is there."""
        self._one_at_a_time = CapacityLimiter(1)  # an episode takes a core
        self._asked, self._told = asyncio.Event(), asyncio.Event()
        looking = asyncio.create_task(self._look())
        try:
            yield
        finally:
            looking.cancel()
            with suppress(asyncio.CancelledError):
                await looking

    async def _look(self) -> None:
        while True:
            self._asked.clear()
            more = False
            if self._opened:
                opened = frozenset(self._opened.values())
                snapshot, more = await to_thread.run_sync(self._watch.look, opened, abandon_on_cancel=True)
                if snapshot != self._snapshot:
                    self._snapshot = snapshot
                    self._told.set()
                    self._told = asyncio.Event()
            with suppress(TimeoutError):
                await asyncio.wait_for(self._asked.wait(), 0 if more else PERIOD if self._opened else None)

    async def events(self, run: str) -> AsyncIterator[str]:
        """Yield server-sent events for a page that shows a run: ``runs`` and ``run``, each whenever it has changed."""
        page = object()
        self._opened[page] = run
        self._asked.set()
        sent = ("", "")
        try:
            while True:
                told, snapshot = self._told, self._snapshot
                now = snapshot.runs, snapshot.details.get(run, "")
                for name, content, before in zip(("runs", "run"), now, sent, strict=True):
                    if content and content != before:
                        yield f"event: {name}\ndata: {content}\n\n"
                sent = now
                try:
                    await asyncio.wait_for(told.wait(), _SILENCE)
                except TimeoutError:
                    yield ": nothing new\n\n"
        finally:
            del self._opened[page]

    async def replay(self, run: str, *place: str) -> Response:
        """Answer with a stored episode for the player, simulated once more; or why not."""
        folder = self._watch.folder(run)
        if folder is None or not all(text.isdecimal() and len(text) < 19 for text in place):
            return JSONResponse({"error": "there is no such episode"}, status_code=404)
        try:
            replayed = partial(episode.replayed, folder, *map(int, place))
            found: dict[str, Any] = await to_thread.run_sync(
                replayed, limiter=self._one_at_a_time, abandon_on_cancel=True
            )
        except SwarmevoError as error:
            return JSONResponse({"error": str(error)}, status_code=409)
        except Exception as error:  # of a plugin, which may raise anything
            return JSONResponse({"error": one_line(error)}, status_code=409)
        return JSONResponse(found)

    async def configuration(self, run: str) -> Response:
        """Answer with a run's configuration."""
        folder = self._watch.folder(run)
        try:
            content = (folder / CONFIG_FILE).read_bytes() if folder else b""
        except OSError as error:
            content = f"# {error.strerror}\n".encode()
        return Response(content, media_type="text/plain", status_code=200 if folder else 404)

"""The service on a socket: uvicorn, and how it ends."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Callable

import uvicorn
from fastapi import FastAPI

from service.app import create_app
from service.connection import connection_of, drop
from service.garbage import set_aside_what_stays
from service.settings import Settings
from service.stream_connection import stream_connection_of
from service.watch import Watch

GOODBYE_S = 4
"""How long requests in work may take to end when the service is told to stop [s]."""


def run(settings: Settings, listener: socket.socket, announce: Callable[[str], None], watch: Watch) -> None:
    """Serve until stopped (Ctrl-C or SIGTERM), in a process that does nothing else.

    Args:
        settings: limits and access.
        listener: where clients connect.
        announce: receives a line when the kernels begin to compile and one when frames can be rendered.
        watch: over its scenes.
    """
    app = create_app(settings, announce=announce, watch=watch, settled=set_aside_what_stays)
    server = Server(app, settings)
    with contextlib.suppress(KeyboardInterrupt):
        server.run(sockets=[listener])


class Server(uvicorn.Server):
    """uvicorn, but streams end before it closes connections: with a code that tells clients to come back."""

    def __init__(self, app: FastAPI, settings: Settings) -> None:
        super().__init__(server_config(app, settings))
        self._app = app
        app.state.connections = self.server_state.connections

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Say goodbye, then stop; who has not taken in by then what was sent is not waited for."""
        for server in self.servers:
            server.close()
        await self._app.state.desk.sessions.stop()
        await super().shutdown(sockets)
        for connection in list(self.server_state.connections):
            drop(connection.transport)


def server_config(app: FastAPI, settings: Settings) -> uvicorn.Config:
    """How uvicorn runs an application."""
    return uvicorn.Config(
        app,
        log_config=None,
        access_log=False,
        http=connection_of(settings, app),
        h11_max_incomplete_event_size=settings.max_header_bytes,
        ws=stream_connection_of(app),
        ws_max_size=settings.max_message_bytes,
        ws_ping_interval=settings.ping_s,
        ws_ping_timeout=settings.ping_s,
        ws_per_message_deflate=False,
        lifespan="on",
        proxy_headers=False,
        server_header=False,
        timeout_graceful_shutdown=GOODBYE_S,
        ssl_certfile=settings.certfile,
        ssl_keyfile=settings.keyfile,
    )

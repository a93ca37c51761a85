"""The service as a process: a socket, uvicorn, and a word on how to use it."""

from __future__ import annotations

import socket
from collections.abc import Callable

import uvicorn
from fastapi import FastAPI

from renderer.errors import SettingsError
from service.app import create_app
from service.connection import connection_of
from service.settings import Settings

GOODBYE_S = 5
"""How long requests in work may take to end when the service is told to stop [s]."""

PING_S = 20.0
"""How often a stream's client is asked whether it is still there, and how long it may take to answer [s]."""

BACKLOG = 128


def serve(settings: Settings, announce: Callable[[str], None]) -> None:
    """Serve until stopped (Ctrl-C or SIGTERM).

    Args:
        settings: address, limits and access.
        announce: receives lines for people: the address, how to ask for a frame, when it is ready.

    Raises:
        SettingsError: if the address cannot be listened on.
    """
    with listen(settings) as listener:
        address = address_of(settings, listener)
        announce(f"gazetrace serves on {address}")
        token = ' -H "Authorization: Bearer $GAZETRACE_TOKEN"' if settings.token is not None else ""
        announce(f"a page to look with: {address}/    the API: {address}/docs    a frame:")
        announce(f'curl{token} -o frame.png "{address}/v1/scenes/spheres/frame?gaze_x=0.5&gaze_y=0.5&unit=fraction"')
        server = Server(create_app(settings, announce=announce), settings)
        try:
            server.run(sockets=[listener])
        except KeyboardInterrupt:
            announce("stopped")


class Server(uvicorn.Server):
    """uvicorn, but streams end before it closes connections: with a code that tells clients to come back."""

    def __init__(self, app: FastAPI, settings: Settings) -> None:
        super().__init__(server_config(app, settings))
        self._app = app
        app.state.connections = self.server_state.connections

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Say goodbye, then stop."""
        for server in self.servers:
            server.close()
        await self._app.state.desk.sessions.stop()
        await super().shutdown(sockets)


def server_config(app: FastAPI, settings: Settings) -> uvicorn.Config:
    """How uvicorn runs an application."""
    return uvicorn.Config(
        app,
        log_config=None,
        access_log=False,
        http=connection_of(settings, app),
        h11_max_incomplete_event_size=settings.max_header_bytes,
        ws="websockets-sansio",
        ws_max_size=settings.max_message_bytes,
        ws_ping_interval=PING_S,
        ws_ping_timeout=PING_S,
        ws_per_message_deflate=False,
        lifespan="on",
        proxy_headers=False,
        server_header=False,
        timeout_graceful_shutdown=GOODBYE_S,
        ssl_certfile=settings.certfile,
        ssl_keyfile=settings.keyfile,
    )


def listen(settings: Settings) -> socket.socket:
    """A socket that listens on the settings' address.

    Raises:
        SettingsError: if it cannot.
    """
    try:
        family, _, _, _, address = socket.getaddrinfo(
            settings.host, settings.port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        return socket.create_server(address[:2], family=family, backlog=BACKLOG)
    except (OSError, UnicodeError) as error:
        found = f"{settings.host}:{settings.port} ({getattr(error, 'strerror', None) or error})"
        raise SettingsError("host and port", "an address to listen on", found) from None


def address_of(settings: Settings, listener: socket.socket) -> str:
    """The URL of the service, for people on this machine."""
    port = listener.getsockname()[1]
    host = {"0.0.0.0": "127.0.0.1", "::": "[::1]", "": "127.0.0.1"}.get(settings.host, settings.host)
    if ":" in host and not host.startswith("["):
        host = f"[{host}]"
    return f"{'http' if settings.certfile is None else 'https'}://{host}:{port}"

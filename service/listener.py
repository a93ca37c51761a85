"""The socket that a service listens on, and its address for people."""

from __future__ import annotations

import socket

from renderer.errors import SettingsError
from service.settings import Settings

BACKLOG = 128
"""Connections that may wait to be accepted, as they do while the service is started again."""


def listen(settings: Settings) -> socket.socket:
    """A socket that listens on the settings' address.

    Raises:
        SettingsError: if it cannot.
    """
    try:
        family, _, _, _, address = socket.getaddrinfo(
            settings.host, settings.port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        made = socket.create_server(address[:2], family=family, backlog=BACKLOG)
    except (OSError, UnicodeError) as error:
        found = f"{settings.host}:{settings.port} ({getattr(error, 'strerror', None) or error})"
        raise SettingsError("host and port", "an address to listen on", found) from None
    # Found out anew, the socket knows its protocol: only then asyncio sends small replies without delay (TCP_NODELAY).
    return socket.socket(fileno=made.detach())


def address_of(settings: Settings, listener: socket.socket) -> str:
    """The URL of the service, for people on this machine."""
    port = listener.getsockname()[1]
    host = {"0.0.0.0": "127.0.0.1", "::": "[::1]", "": "127.0.0.1"}.get(settings.host, settings.host)
    if ":" in host and not host.startswith("["):
        host = f"[{host}]"
    return f"{'http' if settings.certfile is None else 'https'}://{host}:{port}"

"""A connection to the service that is made again whenever it is lost."""

from __future__ import annotations

import asyncio
import math
import random
import time
from collections.abc import Awaitable, Callable
from typing import Final
from urllib.parse import urlsplit, urlunsplit

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus, WebSocketException
from websockets.typing import Subprotocol

from clients.backoff import Backoff
from service import protocol

MOST_FRAME_BYTES: Final = 1 << 30
"""Longest frame that is taken in: a raw 8K picture is 400 MB."""

PING_S: Final = 20.0
"""How often the service is asked whether it is there [s]."""

SILENCE_S: Final = 2 * PING_S
"""How long nothing may arrive, not a byte of anything, before the connection is given up [s]."""

OPEN_S: Final = 10.0
"""How long a service may take to answer a new connection."""

SCHEMES: Final = {"http": "ws", "https": "wss", "ws": "ws", "wss": "wss"}


class ServiceRefused(Exception):
    """The service said no.

    Attributes:
        code: the kind: `invalid-request`, `unknown-scene`, `token-needed`, ...
        message: one line fit to show.
        field: dotted path of the wrong field; None where it is about none.
    """

    def __init__(self, code: str, message: str, field: str | None = None) -> None:
        super().__init__(message)
        self.code = code
        self.message = message
        self.field = field


class ServiceGone(ConnectionError):
    """There has been no service for as long as one was to be patient."""


def stream_url(url: str, path: str) -> str:
    """Where a WebSocket of the service at `url` is.

    Raises:
        ValueError: for what is no address.
    """
    parts = urlsplit(url)
    if parts.scheme not in SCHEMES or not parts.hostname:
        raise ValueError(f"expected an address such as http://127.0.0.1:8321, found {url!r}")
    return urlunsplit((SCHEMES[parts.scheme], parts.netloc, parts.path.rstrip("/") + path, parts.query, ""))


class _Connection(ClientConnection):
    """A connection kept for as long as anything arrives: an answer may be stuck behind a frame on a slow line.

    Attributes:
        arrived_s: when anything did, by `time.monotonic` [s].
    """

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin to listen."""
        super().connection_made(transport)
        self.arrived_s = time.monotonic()
        self._timer = self.loop.call_later(SILENCE_S, self._listen)

    def data_received(self, data: bytes) -> None:
        """The service lives."""
        self.arrived_s = time.monotonic()
        super().data_received(data)

    def connection_lost(self, exc: Exception | None) -> None:
        """There is no more to hear."""
        self._timer.cancel()
        super().connection_lost(exc)

    def _listen(self) -> None:
        left_s = self.arrived_s + SILENCE_S - time.monotonic()
        if left_s > 0:
            self._timer = self.loop.call_later(left_s, self._listen)
        else:
            self.transport.abort()


async def stay_connected(
    url: str, talk: Callable[[ClientConnection], Awaitable[None]], heard_s: Callable[[], float], patience_s: float
) -> None:
    """Connect and talk, again and again, until cancelled.

    Args:
        url: a WebSocket.
        talk: uses a connection until it is closed, and raises ConnectionClosed then.
        heard_s: when something good was last heard, by `time.monotonic` [s].
        patience_s: how long after that, and after what else came with it, to go on trying [s].

    Raises:
        ServiceRefused: where the next attempt would fail like this one; also what `talk` raises.
        ServiceGone: after `patience_s`.
    """
    backoff = Backoff(random.random)
    connection: ClientConnection | None = None
    arrived_s = -math.inf
    while True:
        began_s = heard_s()
        try:
            async with connect(
                url,
                subprotocols=[Subprotocol(protocol.SUBPROTOCOL)],
                max_size=MOST_FRAME_BYTES,
                compression=None,
                open_timeout=OPEN_S,
                ping_interval=PING_S,
                ping_timeout=None,
                create_connection=_Connection,
                proxy=None,
            ) as connection:
                await talk(connection)
        except ConnectionClosed as closed:
            why = _closed_because(closed)
        except InvalidStatus as error:
            if error.response.status_code < 500:
                raise ServiceRefused("no-stream", f"{url}: expected a stream, found {error}") from None
            why = str(error)
        except (OSError, WebSocketException) as error:
            why = str(error) or type(error).__name__
        if heard_s() > began_s:
            backoff.restart()
            assert isinstance(connection, _Connection)
            arrived_s = connection.arrived_s
        if time.monotonic() - max(heard_s(), arrived_s) > patience_s:
            raise ServiceGone(f"{url}: no service for {patience_s:g} s: {why}")
        await asyncio.sleep(backoff.wait_s())


def _closed_because(closed: ConnectionClosed) -> str:
    """The reason of a close after which one may try again.

    Raises:
        ServiceRefused: for one after which one may not.
    """
    if closed.rcvd is None:
        return "the connection broke"
    if closed.rcvd.code in protocol.LASTING:
        kind = protocol.CloseCode(closed.rcvd.code).name.lower()
        raise ServiceRefused(f"{kind}-refused", closed.rcvd.reason or f"closed with {closed.rcvd.code}")
    return closed.rcvd.reason or f"closed with {closed.rcvd.code}"

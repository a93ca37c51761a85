"""The connection to the service: joins a session, sends gaze, keeps clocks, and comes back whenever it is lost."""

from __future__ import annotations

import asyncio
import socket
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from enum import StrEnum
from typing import Any, NamedTuple
from urllib.parse import urlencode, urlsplit, urlunsplit

import websockets
from websockets.asyncio.client import ClientConnection, connect

from clients.backoff import Backoff
from clients.bridge.errors import ConfigError
from clients.bridge.gaze import Gaze
from clients.bridge.slot import Slot
from clients.service_clock import ServiceClock
from service import protocol

OPEN_TIMEOUT_S = 5.0
CLOSE_TIMEOUT_S = 0.5
PING_S = 5.0
"""A connection whose other end is gone without a word is given up after two of these."""
CLOCK_S = 1.0
"""Time between two questions for the service's clock."""
FIRST_CLOCK_S = 0.1
FIRST_CLOCKS = 10
"""The first ones come quicker, so that the clocks are known after a second."""
SEND_BUFFER_BYTES = 4096
"""A small send buffer: what waits in the slot can still be replaced, what waits in the system cannot."""
LATENCIES = 4096
"""Latencies kept until somebody asks for them."""


class ServiceState(StrEnum):
    """What is known of the service."""

    CONNECTING = "connecting"
    ABSENT = "absent"
    """It cannot be reached, or has gone; it is tried again and again."""
    REFUSED = "refused"
    """It is there and does not let us in: the token or the session is wrong, or there are too many."""
    READY = "ready"
    """Gaze is sent."""
    STALLED = "stalled"
    """The connection takes no more: the other end does not read, or the network hangs."""
    STOPPED = "stopped"


class Listeners(NamedTuple):
    """Who is told what, all on the event loop.

    Attributes:
        state: each new state, and why.
        display: the session's display, whenever it is known or changes.
        message: errors of the service.
    """

    state: Callable[[ServiceState, str], None]
    display: Callable[[Mapping[str, Any]], None]
    message: Callable[[str], None]


STALL_S = 0.25
"""So long may sending take before the connection counts as stalled."""


class ServiceLink:
    """A gaze source of one session.

    Args:
        url: the service, `http://host:port`.
        session: the session's name.
        token: what the service wants; None for nothing.
        slot: where gaze waits.
        listeners: who is told.
        backoff: waits between tries.
        ping_s: time between signs of life; after two without an answer the other end is taken for gone.

    Attributes:
        viewers: how many the session has.
        latencies_ns: from a sample's last byte to the end of its sending, since somebody last emptied it.
    """

    def __init__(
        self,
        url: str,
        session: str,
        token: str | None,
        slot: Slot,
        listeners: Listeners,
        backoff: Backoff,
        ping_s: float = PING_S,
    ) -> None:
        self._url = gaze_url(url, session)
        self._headers = {} if token is None else {"Authorization": f"Bearer {token}"}
        self._slot = slot
        self._listeners = listeners
        self._backoff = backoff
        self._ping_s = ping_s
        self._ready = asyncio.Event()
        self._filled = asyncio.Event()
        self._outbox: deque[protocol.Margin | protocol.Target] = deque()
        self._margin: protocol.Margin | None = None
        self.clock = ServiceClock()
        self.state = ServiceState.STOPPED
        self.connections = 0
        self.sent = 0
        self.viewers = 0
        self.latencies_ns: deque[int] = deque(maxlen=LATENCIES)

    def filled(self) -> None:
        """Something waits in the slot. To be called on the event loop."""
        self._filled.set()

    def margin(self, margin_deg: float) -> None:
        """Tell the session, now and after each reconnect, how far off the gaze may be."""
        self._margin = protocol.Margin(margin_deg)
        self._post(self._margin)

    def target(self, target: protocol.Target) -> None:
        """Have the session's viewers show a target; forgotten if the service is away."""
        self._post(target)

    def _post(self, message: protocol.Margin | protocol.Target) -> None:
        if self._ready.is_set():
            self._outbox.append(message)
            self._filled.set()

    async def run(self) -> None:
        """Stay connected until cancelled."""
        try:
            while True:
                await self._visit()
                await asyncio.sleep(self._backoff.wait_s())
        finally:
            self._become(ServiceState.STOPPED, "as asked")

    async def _visit(self) -> None:
        """One connection, from its beginning to its end."""
        if self.state is not ServiceState.ABSENT:
            self._become(ServiceState.CONNECTING, self._url)
        try:
            async with connect(
                self._url,
                subprotocols=[websockets.Subprotocol(protocol.SUBPROTOCOL)],
                additional_headers=self._headers,
                compression=None,
                open_timeout=OPEN_TIMEOUT_S,
                close_timeout=CLOSE_TIMEOUT_S,
                ping_interval=self._ping_s,
                ping_timeout=self._ping_s,
                max_size=protocol.MAX_TEXT_BYTES,
                write_limit=(1, 0),
                proxy=None,
            ) as connection:
                await self._stay(connection)
        except websockets.InvalidStatus as error:
            status = error.response.status_code
            refused = status in (401, 403, 404)
            self._become(
                ServiceState.REFUSED if refused else ServiceState.ABSENT,
                f"the service answered {status}" + (": is the token right?" if status in (401, 403) else ""),
            )
        except websockets.ConnectionClosed as error:
            self._lost(error)
        except ConnectionRefusedError:
            self._become(ServiceState.ABSENT, f"{self._url}: nobody listens there: is the service running?")
        except (OSError, TimeoutError, websockets.WebSocketException) as error:
            self._become(ServiceState.ABSENT, f"{self._url}: {error or type(error).__name__}")
        finally:
            self._ready.clear()
            self.viewers = 0
            self._outbox.clear()
            self._slot.clear()

    def _lost(self, error: websockets.ConnectionClosed) -> None:
        close = error.rcvd
        if close is None:
            self._become(ServiceState.ABSENT, "the connection broke off")
            return
        lasting = close.code in protocol.LASTING or close.code == protocol.CloseCode.TOO_MANY
        why = f"the service closed the connection: {close.code} {close.reason}".rstrip()
        self._become(ServiceState.REFUSED if lasting else ServiceState.ABSENT, why)

    async def _stay(self, connection: ClientConnection) -> None:
        """Send and listen until the connection ends."""
        self.connections += 1
        self.clock.restart()
        with suppress(OSError):
            raw = connection.transport.get_extra_info("socket")
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)
        tasks = [asyncio.create_task(work) for work in (self._send(connection), self._ask_time(connection))]
        try:
            while True:
                self._heard(await connection.recv())
        except asyncio.CancelledError:
            await connection.close(websockets.CloseCode.GOING_AWAY, "the bridge stops")
            raise
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    def _heard(self, text: str | bytes) -> None:
        received_ns = time.monotonic_ns()
        try:
            message = protocol.decode_gaze_down(text if isinstance(text, str) else text.decode())
        except (protocol.ProtocolError, UnicodeDecodeError) as error:
            self._listeners.message(f"the service said what is not understood: {error}")
            return
        match message:
            case protocol.Ready(display=display):
                if not self._ready.is_set():
                    self._ready.set()
                    if self._margin is not None:
                        self._post(self._margin)
                    self._filled.set()
                    self._become(ServiceState.READY, f"session {message.session}")
                if display is not None:
                    self._listeners.display(display)
            case protocol.Pong(client_time_ns=sent_ns, service_time_ns=service_ns):
                self.clock.answered(sent_ns, service_ns, received_ns)
                self._backoff.good(received_ns)
            case protocol.Status(viewers=viewers):
                self.viewers = viewers
            case protocol.Error(message=said):
                self._listeners.message(said)

    async def _send(self, connection: ClientConnection) -> None:
        """Send whatever waits as soon as the connection takes it."""
        await self._ready.wait()
        while True:
            await self._filled.wait()
            self._filled.clear()
            while self._outbox:
                await connection.send(protocol.encode(self._outbox.popleft()))
            for gaze in self._slot.take(time.monotonic_ns()):
                await self._send_gaze(connection, gaze)

    async def _send_gaze(self, connection: ClientConnection, gaze: Gaze) -> None:
        """Send, for as long as the other end may be taken for alive."""
        loop = asyncio.get_running_loop()
        stalled = loop.call_later(STALL_S, self._become, ServiceState.STALLED, "the connection takes no more")
        try:
            async with asyncio.timeout(2 * self._ping_s):
                await connection.send(message_of(gaze))
        except TimeoutError:
            connection.transport.abort()  # a closing handshake would wait for the same line
            raise
        finally:
            stalled.cancel()
        if self.state is ServiceState.STALLED:
            self._become(ServiceState.READY, "the connection takes gaze again")
        self.sent += 1
        self.latencies_ns.append(time.monotonic_ns() - gaze.received_ns)

    async def _ask_time(self, connection: ClientConnection) -> None:
        await self._ready.wait()
        number = 0
        while True:
            await connection.send(protocol.encode(protocol.Ping(number, time.monotonic_ns())))
            number += 1
            await asyncio.sleep(FIRST_CLOCK_S if number < FIRST_CLOCKS else CLOCK_S)

    def _become(self, state: ServiceState, why: str) -> None:
        if state is not self.state:
            self.state = state
            self._listeners.state(state, why)


def message_of(gaze: Gaze) -> str:
    """A gaze as it is sent; a lost eye has no place."""
    return protocol.encode(
        protocol.Gaze(
            x=gaze.x,
            y=gaze.y,
            unit="fraction",
            valid=gaze.valid,
            seq=gaze.seq,
            tracker_time_ns=gaze.tracker_time_ns,
            captured_time_ns=gaze.captured_ns,
            phase=gaze.phase,
        )
    )


def gaze_url(service: str, session: str) -> str:
    """The WebSocket of a session's gaze sources.

    Raises:
        ConfigError: for an address that is none.
    """
    parts = urlsplit(service)
    schemes = {"http": "ws", "https": "wss", "ws": "ws", "wss": "wss"}
    if parts.scheme not in schemes or not parts.netloc:
        raise ConfigError("service", "an address such as http://127.0.0.1:8321", service)
    path = parts.path.rstrip("/") + "/v1/gaze"
    return urlunsplit((schemes[parts.scheme], parts.netloc, path, urlencode({"session": session}), ""))

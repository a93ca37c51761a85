"""A viewer and a gaze source for tests, on real sockets."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, TypeVar

import httpx
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from service import protocol
from tests.service.conftest import PATIENCE_S

Wanted = TypeVar("Wanted")

TINY = {"width_px": 64, "height_px": 36, "width_cm": 50.0, "distance_cm": 60.0}

COARSE = {"samples_per_cell": 1, "gaze_bucket_px": 8, "acuity": {"scale": 40.0}}
"""Cells of one pixel at the gaze and of several at the other end of a tiny screen."""


NS_PER_S = 1_000_000_000


class Clock:
    """A clock that a test turns."""

    def __init__(self) -> None:
        self.now_ns = 10**15

    def __call__(self) -> int:
        return self.now_ns

    def advance(self, seconds: float) -> None:
        self.now_ns += int(seconds * NS_PER_S)


class Peer:
    """One end of a connection; what it receives and nobody has asked for yet waits in order."""

    def __init__(self, connection: ClientConnection, decode: Callable[[str], Any]) -> None:
        self.connection = connection
        self._decode = decode

    def say(self, *messages: protocol.Message) -> None:
        for message in messages:
            self.connection.send(protocol.encode(message))

    def hear(self) -> Any:
        """The next message or frame."""
        received = self.connection.recv(PATIENCE_S)
        return self._decode(received) if isinstance(received, str) else protocol.unpack_frame(received)

    def next(self, kind: type[Wanted], which: Callable[[Wanted], bool] = lambda _: True) -> Wanted:
        """The next message of a kind, those before it forgotten; frames before it are acknowledged."""
        while True:
            heard = self.hear()
            if isinstance(heard, kind) and which(heard):
                return heard
            if isinstance(heard, protocol.Frame):
                self.say(protocol.Ack(heard.header.frame))

    def frame(self, which: Callable[[protocol.FrameHeader], bool] = lambda _: True) -> protocol.Frame:
        """The next frame like that, acknowledged."""
        frame = self.next(protocol.Frame, lambda frame: which(frame.header))
        self.say(protocol.Ack(frame.header.frame))
        return frame

    def final(self) -> protocol.Frame:
        """The next frame that is the last one for its gaze."""
        return self.frame(lambda header: header.phase == "final")

    def closed(self) -> tuple[int, str]:
        """Code and reason with which the service ends the connection; what comes before is forgotten."""
        with contextlib.suppress(ConnectionClosed):
            while True:
                self.connection.recv(PATIENCE_S)
        close = self.connection.protocol.close_rcvd
        assert close is not None
        return close.code, close.reason


@contextmanager
def peer(address: str, path: str, decode: Callable[[str], Any], **options: Any) -> Iterator[Peer]:
    options = {"subprotocols": [protocol.SUBPROTOCOL], **options}
    url = address.replace("http", "ws", 1) + path
    with connect(url, max_size=None, compression=None, proxy=None, close_timeout=PATIENCE_S, **options) as connection:
        yield Peer(connection, decode)


@contextmanager
def viewer(address: str, session: str | None = None, token: str | None = None, **options: Any) -> Iterator[Peer]:
    """A viewer that has joined a session; None: a new one."""
    with peer(address, "/v1/stream", protocol.decode_stream_down, **options) as found:
        found.say(protocol.Hello(token, session))
        yield found


@contextmanager
def source(address: str, session: str, **options: Any) -> Iterator[Peer]:
    """A gaze source of a session."""
    with peer(address, f"/v1/gaze?session={session}", protocol.decode_gaze_down, **options) as found:
        yield found


def configure(
    number: int = 1, scene: str = "matte", quality: Mapping[str, Any] | None = None, **changes: Any
) -> protocol.Configure:
    """A small configuration, with so much time that no frame needs coarser cells, however busy the machine is."""
    quality = {"samples_per_cell": 4, "deadline_ms": 1000.0 * PATIENCE_S} | (quality or {})
    fields = {"gaze": {"x": 32.0, "y": 18.0}, "display": TINY} | changes
    return protocol.Configure(number, scene, quality=quality, **fields)


def sessions(address: str) -> dict[str, Any]:
    """The service's sessions by name."""
    listed = httpx.get(f"{address}/v1/sessions", timeout=PATIENCE_S).json()["sessions"]
    return {session["session"]: session for session in listed}


def settle(peer: Peer, number: int) -> None:
    """Return when the service has read everything said so far."""
    peer.say(protocol.Ping(number, 0))
    peer.next(protocol.Pong, lambda pong: pong.id == number)

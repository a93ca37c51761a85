"""A bridge in a thread, everything it says, and peers for it: one that listens, one that hangs."""

from __future__ import annotations

import asyncio
import base64
import hashlib
import json
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

from clients.bridge.config import Config
from clients.bridge.daemon import Bridge
from clients.bridge.log import Log
from service import protocol
from tests.clients.bridge.terminal import PATIENCE_S

DISPLAY = {"width_px": 1920, "height_px": 1080, "width_cm": 50.0, "height_cm": 30.0, "distance_cm": 60.0}


class News:
    """Things that come in, to be waited for."""

    def __init__(self) -> None:
        self.items: list[Any] = []
        self._changed = threading.Condition()

    def add(self, item: Any) -> None:
        with self._changed:
            self.items.append(item)
            self._changed.notify_all()

    def until(self, condition: Callable[[list[Any]], Any]) -> Any:
        """What `condition` finds in the items, once it finds something."""
        with self._changed:
            assert self._changed.wait_for(lambda: condition(self.items), PATIENCE_S), self.items[-20:]
            return condition(self.items)


class Running:
    """A bridge at work."""

    def __init__(self, config: Config, *options: Any) -> None:
        self.log = News()
        self.bridge = Bridge(config, Log(lambda line: self.log.add(json.loads(line)), as_json=True), *options)
        self.result: Any = None
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        try:
            self.result = asyncio.run(self.bridge.run())
        except Exception as error:
            self.result = error

    def says(self, event: str, text: str, after: int = 0) -> int:
        """Wait until it says that; how much it has said by then."""

        def said(items: list[Any]) -> int:
            found = [
                i for i, item in enumerate(items) if item["event"] == event and text in item["text"] and i >= after
            ]
            return found[0] + 1 if found else 0

        return int(self.log.until(said))

    def ended(self) -> Any:
        self._thread.join(PATIENCE_S)
        assert not self._thread.is_alive()
        return self.result


@contextmanager
def running(config: Config, *options: Any) -> Iterator[Running]:
    found = Running(config, *options)
    try:
        yield found
    finally:
        found.bridge.stop()
        found.ended()


class Listener:
    """A service in little: it says ready, answers pings and keeps what it hears."""

    def __init__(self) -> None:
        self.heard = News()
        self.closes = News()
        self.port = 0
        self.display: dict[str, float] | None = DISPLAY
        self.viewers = 1
        self._stack = ExitStack()
        self._connections: list[ServerConnection] = []

    def start(self) -> None:
        server = serve(self._talk, "127.0.0.1", self.port, subprotocols=[protocol.SUBPROTOCOL])  # type: ignore[list-item]
        self.port = server.socket.getsockname()[1]
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        self._stack.callback(thread.join, PATIENCE_S)
        self._stack.callback(server.shutdown)

    def stop(self) -> None:
        for connection in self._connections:
            connection.close(1001, "the service stops")
        self._stack.close()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def gazes(self) -> list[protocol.Gaze]:
        return [item for item in self.heard.items if isinstance(item, protocol.Gaze)]

    def _talk(self, connection: ServerConnection) -> None:
        self._connections.append(connection)
        ready = protocol.Ready("main", 1, "matte", self.display, None, (), 0)
        connection.send(protocol.encode(ready))
        connection.send(protocol.encode(protocol.Status(0, 0, 0, 0, self.viewers, 1, "none")))
        self.heard.add(("path", connection.request.path if connection.request else ""))
        try:
            while True:
                message = protocol.decode_gaze_up(str(connection.recv()))
                if isinstance(message, protocol.Ping):
                    connection.send(protocol.encode(protocol.Pong(message.id, message.client_time_ns, 10**15)))
                else:
                    self.heard.add(message)
        except ConnectionClosed as closed:
            self.closes.add(closed.rcvd.code if closed.rcvd else 0)


@contextmanager
def listener() -> Iterator[Listener]:
    found = Listener()
    found.start()
    try:
        yield found
    finally:
        found.stop()


@contextmanager
def hanging() -> Iterator[str]:
    """The address of a service that says ready once and then neither reads nor answers."""
    with socket.socket() as server, ExitStack() as clients:
        server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        server.bind(("127.0.0.1", 0))
        server.listen()

        def accept() -> None:
            while True:
                try:
                    client, _ = server.accept()
                except OSError:
                    return
                clients.enter_context(client)
                request = client.recv(4096).decode()
                key = next(line.split(": ")[1] for line in request.splitlines() if line.startswith("Sec-WebSocket-Key"))
                digest = hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest()
                text = protocol.encode(protocol.Ready("main", 1, "matte", DISPLAY, None, (), 0)).encode()
                client.sendall(
                    b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                    b"Sec-WebSocket-Accept: " + base64.b64encode(digest) + b"\r\n"
                    b"Sec-WebSocket-Protocol: " + protocol.SUBPROTOCOL.encode() + b"\r\n\r\n"
                    b"\x81\x7e" + len(text).to_bytes(2, "big") + text
                )

        thread = threading.Thread(target=accept)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.getsockname()[1]}"
        finally:
            server.shutdown(socket.SHUT_RDWR)
            thread.join(PATIENCE_S)

"""A line between a client and a service over which little passes."""

from __future__ import annotations

import select
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cached_property

from tests.service.conftest import PATIENCE_S

BUFFER_BYTES = 4096
"""What the line holds of its own, so that the service feels how slow it is."""

GLANCE_S = 0.02
"""How often the line sees whether it is to end [s]."""


class SlowLine:
    """Carries one connection: what the client says at once, what the service says at `bytes_per_s`.

    Attributes:
        url: where clients may connect, one after the other.
        bytes_per_s: may be changed at any time; 0: nothing passes.
        passed: bytes that came down to the client.
    """

    def __init__(self, address: str, bytes_per_s: float) -> None:
        self.bytes_per_s = bytes_per_s
        self.passed = 0
        self._address = address
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(GLANCE_S)
        self.url = f"http://127.0.0.1:{self._listener.getsockname()[1]}"
        self._moved = threading.Condition()
        self._over = threading.Event()
        self._cut = threading.Event()
        self._thread = threading.Thread(target=self._work)
        self._thread.start()

    @cached_property
    def client(self) -> socket.socket:
        """The end of a client that is connected."""
        return socket.create_connection(self._listener.getsockname())

    def wait(self, passed: int) -> None:
        """Return when so many bytes have come down to the client."""
        with self._moved:
            assert self._moved.wait_for(lambda: self.passed >= passed, PATIENCE_S)

    def cut(self) -> None:
        """End the connection that there is."""
        self._cut.set()

    def close(self) -> None:
        """End both connections."""
        self._over.set()
        self._thread.join(PATIENCE_S)
        assert not self._thread.is_alive()
        if "client" in vars(self):
            self.client.close()

    def _connect(self) -> tuple[socket.socket, socket.socket] | None:
        """The client that connects, and the service behind; None if the line is to end before."""
        while not self._over.is_set():
            with suppress(TimeoutError):
                near, _ = self._listener.accept()
                far = socket.socket()
                far.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)  # before there is a window to tell
                near.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
                host, port = self._address.removeprefix("http://").split(":")
                far.connect((host, int(port)))
                return near, far
        return None

    def _work(self) -> None:
        with self._listener:
            while (ends := self._connect()) is not None:
                self._cut.clear()
                self._carry(*ends)

    def _carry(self, near: socket.socket, far: socket.socket) -> None:
        due = time.monotonic()
        with near, far:
            while not (self._over.is_set() or self._cut.is_set()):
                now, bytes_per_s = time.monotonic(), self.bytes_per_s
                may_pass = bytes_per_s > 0 and now >= due
                wait_s = GLANCE_S if may_pass or due <= now else min(GLANCE_S, due - now)
                readable, _, _ = select.select([near, *([far] if may_pass else [])], [], [], wait_s)
                for end, other in ((near, far), (far, near)):
                    if end not in readable:
                        continue
                    try:
                        data = end.recv(BUFFER_BYTES)
                        other.sendall(data)
                    except ConnectionError:
                        return
                    if not data:
                        return
                    if end is far:
                        with self._moved:
                            self.passed += len(data)
                            self._moved.notify_all()
                        due = max(due, now) + len(data) / bytes_per_s


@contextmanager
def slow_line(address: str, bytes_per_s: float) -> Iterator[SlowLine]:
    """A slow line to a service, closed with the block."""
    line = SlowLine(address, bytes_per_s)
    try:
        yield line
    finally:
        line.close()

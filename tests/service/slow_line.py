"""A line between a client and a service over which little passes."""

from __future__ import annotations

import select
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from tests.service.conftest import PATIENCE_S

BUFFER_BYTES = 4096
"""What the line holds of its own, so that the service feels how slow it is."""

GLANCE_S = 0.02
"""How often the line sees whether it is to end [s]."""


class SlowLine:
    """Carries one connection: what the client says at once, what the service says at `bytes_per_s`.

    Attributes:
        client: the client's end.
        bytes_per_s: may be changed at any time; 0: nothing passes.
        passed: bytes that came down to the client.
    """

    def __init__(self, address: str, bytes_per_s: float) -> None:
        self.bytes_per_s = bytes_per_s
        self.passed = 0
        with socket.create_server(("127.0.0.1", 0)) as listener:
            self.client = socket.create_connection(listener.getsockname())
            self._near, _ = listener.accept()
        self._far = socket.socket()
        self._far.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)  # before there is a window to tell
        self._near.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
        host, port = address.removeprefix("http://").split(":")
        self._far.connect((host, int(port)))
        self._moved = threading.Condition()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._carry)
        self._thread.start()

    def wait(self, passed: int) -> None:
        """Return when so many bytes have come down to the client."""
        with self._moved:
            assert self._moved.wait_for(lambda: self.passed >= passed, PATIENCE_S)

    def close(self) -> None:
        """End both connections."""
        self._over.set()
        self._thread.join(PATIENCE_S)
        assert not self._thread.is_alive()
        self.client.close()

    def _carry(self) -> None:
        due = time.monotonic()
        with self._near, self._far:
            while not self._over.is_set():
                now = time.monotonic()
                may_pass = self.bytes_per_s > 0 and now >= due
                wait_s = GLANCE_S if may_pass or due <= now else min(GLANCE_S, due - now)
                readable, _, _ = select.select([self._near, *([self._far] if may_pass else [])], [], [], wait_s)
                for end, other in ((self._near, self._far), (self._far, self._near)):
                    if end not in readable:
                        continue
                    try:
                        data = end.recv(BUFFER_BYTES)
                        other.sendall(data)
                    except ConnectionError:
                        return
                    if not data:
                        return
                    if end is self._far:
                        with self._moved:
                            self.passed += len(data)
                            self._moved.notify_all()
                        due = max(due, now) + len(data) / self.bytes_per_s


@contextmanager
def slow_line(address: str, bytes_per_s: float) -> Iterator[SlowLine]:
    """A slow line to a service, closed with the block."""
    line = SlowLine(address, bytes_per_s)
    try:
        yield line
    finally:
        line.close()

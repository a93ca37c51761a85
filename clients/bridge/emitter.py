"""Acts as a tracker: on a pseudo-terminal of its own, on a real port, or as a TCP server."""

from __future__ import annotations

import os
import select
import socket
import threading
import time
import tty
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from enum import Enum
from pathlib import Path
from typing import NamedTuple

from clients.bridge.codec import SECOND_NS
from clients.bridge.errors import ConfigError
from clients.bridge.played import Record
from clients.bridge.port import SerialPort

TCP = "tcp:"
SPAN_S = 0.05
"""Longest wait before it is looked whether to stop."""
PATIENCE_NS = 3 * SECOND_NS
"""A pseudo-terminal holds a few KiB, which is less than a reader may be held up on a busy machine: records wait so
long for it, then they are discarded and counted."""


class Taken(Enum):
    """What became of bytes."""

    SENT = "sent"
    NOT_YET = "not yet"
    """There is no room; none of them was sent."""
    BY_NOBODY = "by nobody"
    """Nobody reads, so they are gone."""


Write = Callable[[bytes], Taken]


class Emitted(NamedTuple):
    """What became of records.

    Attributes:
        sent: written whole.
        discarded: not written, because whoever reads was too slow.
        unread: not written, because nobody read.
        latest_ns: how long after its time a record was written at the latest [ns].
    """

    sent: int = 0
    discarded: int = 0
    unread: int = 0
    latest_ns: int = 0


def emit(source: Iterator[Record], write: Write, stop: threading.Event) -> Emitted:
    """Write records when they are due, until they end or `stop` is set."""
    begin_ns, waiting, told = time.monotonic_ns(), deque[Record](), Emitted()
    for record in source:
        while (wait_ns := begin_ns + record.due_ns - time.monotonic_ns()) > 0 and not stop.is_set():
            stop.wait(min(wait_ns / SECOND_NS, SPAN_S))
        if stop.is_set():
            break
        waiting.append(record)
        told = _write_waiting(waiting, write, begin_ns, told)
    while waiting and not stop.wait(SPAN_S):
        told = _write_waiting(waiting, write, begin_ns, told)
    return told._replace(discarded=told.discarded + len(waiting))


def _write_waiting(waiting: deque[Record], write: Write, begin_ns: int, told: Emitted) -> Emitted:
    """Write what there is room for, oldest first."""
    sent, discarded, unread, latest_ns = told
    while waiting:
        late_ns = time.monotonic_ns() - begin_ns - waiting[0].due_ns
        taken = write(waiting[0].data)
        if taken is Taken.SENT:
            sent, latest_ns = sent + 1, max(latest_ns, late_ns)
        elif taken is Taken.BY_NOBODY:
            unread += 1
        elif late_ns > PATIENCE_NS:
            discarded += 1
        else:
            break
        waiting.popleft()
    return Emitted(sent, discarded, unread, latest_ns)


def opened(target: str, baud: int, announce: Callable[[str], None]) -> AbstractContextManager[Write]:
    """What takes an emitter's bytes.

    Args:
        target: a device or URL of pyserial; `tcp:PORT` for a server on this machine; any other path for a new
            pseudo-terminal that goes by that name.
        baud: bits a second of a real port.
        announce: is told where to read.

    Raises:
        ConfigError: for a path that is in use by something else.
        PortError: for a port that cannot be opened.
    """
    if target.startswith(TCP):
        return _server(target.removeprefix(TCP), announce)
    if "://" in target or (Path(target).exists() and not Path(target).is_file()):
        return _serial(target, baud)
    return pseudo_terminal(Path(target), announce)


@contextmanager
def _serial(url: str, baud: int) -> Iterator[Write]:
    port = SerialPort(url, baud)

    def write(data: bytes) -> Taken:
        port.write(data)
        return Taken.SENT

    try:
        yield write
    finally:
        port.close()


@contextmanager
def pseudo_terminal(path: Path, announce: Callable[[str], None]) -> Iterator[Write]:
    """A terminal that goes by the name `path`."""
    if path.exists():
        raise ConfigError("emit", "a device, tcp:PORT, or a path that does not exist yet", str(path))
    master, slave = os.openpty()
    try:
        tty.setraw(master)
        tty.setraw(slave)
        os.set_blocking(master, False)
        path.unlink(missing_ok=True)
        path.symlink_to(os.ttyname(slave))
        os.close(slave)  # so that the system says whether somebody else has it open
        announce(f"a tracker at {path}")
        yield _Terminal(master).write
    finally:
        path.unlink(missing_ok=True)
        os.close(master)


class _Terminal:
    """The tracker's end of a pseudo-terminal."""

    def __init__(self, end: int) -> None:
        self._end = end
        self._poller = select.poll()
        self._poller.register(end, select.POLLIN)
        self._rest = b""

    def write(self, data: bytes) -> Taken:
        """Write, and throw commands away. What the system cuts off is written first next time."""
        events = dict(self._poller.poll(0)).get(self._end, 0)
        if events & select.POLLHUP:
            self._rest = b""
            return Taken.BY_NOBODY
        if events & select.POLLIN:
            with suppress(OSError):  # whoever sent it may have gone
                os.read(self._end, 4096)
        self._rest = self._rest[self._room_for(self._rest) :]
        if self._rest:
            return Taken.NOT_YET
        written = self._room_for(data)
        self._rest = data[written:] if written else b""
        return Taken.SENT if written else Taken.NOT_YET

    def _room_for(self, data: bytes) -> int:
        """Write; how many bytes there was room for."""
        try:
            return os.write(self._end, data) if data else 0
        except BlockingIOError:
            return 0


@contextmanager
def _server(port: str, announce: Callable[[str], None]) -> Iterator[Write]:
    """A server for one client after the other."""
    if not port.isdecimal() or int(port) > 65_535:
        raise ConfigError("emit", "tcp:PORT", TCP + port)
    with socket.create_server(("127.0.0.1", int(port))) as listener:
        listener.setblocking(False)
        announce(f"a tracker at socket://127.0.0.1:{listener.getsockname()[1]}")
        clients: list[socket.socket] = []
        try:
            yield lambda data: _write_clients(listener, clients, data)
        finally:
            for client in clients:
                client.close()


def _write_clients(listener: socket.socket, clients: list[socket.socket], data: bytes) -> Taken:
    """Send to whoever is there; who has gone or does not read is let go."""
    with suppress(BlockingIOError):
        client, _ = listener.accept()
        client.setblocking(False)
        clients.append(client)
    for client in list(clients):
        try:
            if client.send(data) < len(data):
                raise BlockingIOError
            with suppress(BlockingIOError):
                if not client.recv(4096):
                    raise ConnectionResetError
        except OSError:
            client.close()
            clients.remove(client)
    return Taken.SENT if clients else Taken.BY_NOBODY

"""Acts as a tracker: on a pseudo-terminal of its own, on a real port, or as a TCP server."""

from __future__ import annotations

import os
import select
import socket
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path

from clients.bridge.codec import SECOND_NS
from clients.bridge.errors import ConfigError
from clients.bridge.played import Record
from clients.bridge.port import SerialPort

TCP = "tcp:"
SPAN_S = 0.05
"""Longest wait before it is looked whether to stop."""

Write = Callable[[bytes], None]


def emit(source: Iterator[Record], write: Write, stop: threading.Event) -> int:
    """Write records when they are due, until they end or `stop` is set; how many there were."""
    begin_ns, written = time.monotonic_ns(), 0
    for record in source:
        while (wait_ns := begin_ns + record.due_ns - time.monotonic_ns()) > 0 and not stop.is_set():
            stop.wait(min(wait_ns / SECOND_NS, SPAN_S))
        if stop.is_set():
            break
        write(record.data)
        written += 1
    return written


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
    try:
        yield port.write
    finally:
        port.close()


@contextmanager
def pseudo_terminal(path: Path, announce: Callable[[str], None]) -> Iterator[Write]:
    """A terminal that goes by the name `path`; what nobody reads is thrown away."""
    if path.exists():
        raise ConfigError("emit", "a device, tcp:PORT, or a path that does not exist yet", str(path))
    master, slave = os.openpty()
    try:
        tty.setraw(master)
        tty.setraw(slave)
        os.set_blocking(master, False)
        path.unlink(missing_ok=True)
        path.symlink_to(os.ttyname(slave))
        announce(f"a tracker at {path}")
        yield lambda data: _write_terminal(master, data)
    finally:
        path.unlink(missing_ok=True)
        os.close(slave)
        os.close(master)


def _write_terminal(master: int, data: bytes) -> None:
    """Write what fits, and throw commands away: a record is whole or not there."""
    with suppress(BlockingIOError):
        while os.read(master, 4096):
            pass
    if select.select((), (master,), (), 0)[1]:
        with suppress(BlockingIOError):
            os.write(master, data)


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


def _write_clients(listener: socket.socket, clients: list[socket.socket], data: bytes) -> None:
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

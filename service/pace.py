"""Whether a client takes in what it is sent, and fast enough: who does not holds memory for nothing."""

from __future__ import annotations

import asyncio
import fcntl
import socket
import struct
import sys
import termios
from collections.abc import Callable
from typing import NamedTuple

from service.settings import Settings

GLANCES = 8
"""How often a client is looked at in the time that it has."""

COUNT_BYTES = 4
"""Size of the C `int` in which the kernel tells how much it holds."""

TCP_INFO_BYTES = 128
CONFIRMED = struct.Struct("@Q")
CONFIRMED_AT = 120
"""Place of `tcpi_bytes_acked` in Linux's `struct tcp_info`, and how much of that is read."""


class _Mark(NamedTuple):
    """What a client had taken in at a time [s], and what it had still to."""

    time_s: float
    confirmed: int
    unread: int


class Pace:
    """Looks at one connection until that is closed, whatever it is used for.

    Args:
        transport: of the connection.
        settings: how much a client must take in, over which time.
        too_slow: told why, when it takes in less.
    """

    def __init__(self, transport: asyncio.Transport, settings: Settings, too_slow: Callable[[str], None]) -> None:
        self._transport = transport
        self._socket: socket.socket = transport.get_extra_info("socket")
        self._period_s = settings.client_timeout_s
        self._least = settings.min_bytes_per_s * settings.client_timeout_s
        self._too_slow = too_slow
        self._mark: _Mark | None = None
        self._loop = asyncio.get_running_loop()
        self._wait()

    def _wait(self) -> None:
        self._loop.call_later(self._period_s / GLANCES, self._look)

    def _look(self) -> None:
        if self._socket.fileno() < 0:
            return
        mark, now = self._mark, _Mark(self._loop.time(), confirmed(self._socket), unread(self._transport))
        if mark is None or now.confirmed - mark.confirmed >= min(mark.unread, self._least):
            self._mark = now if now.unread else None
        elif now.time_s - mark.time_s >= self._period_s:
            taken = f"{now.confirmed - mark.confirmed:,} of {mark.unread:,}"
            self._too_slow(f"expected {self._least:,} bytes to be taken in within {self._period_s} s, found {taken}")
            return
        self._wait()


def confirmed(connection: socket.socket) -> int:
    """Bytes that the other end has confirmed since the connection was made."""
    info = connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, TCP_INFO_BYTES)
    (found,) = CONFIRMED.unpack_from(info, CONFIRMED_AT)
    return int(found)


def unread(transport: asyncio.Transport) -> int:
    """Bytes that wait here and in the kernel until the other end confirms them."""
    held = bytearray(COUNT_BYTES)
    fcntl.ioctl(transport.get_extra_info("socket").fileno(), termios.TIOCOUTQ, held)
    return transport.get_write_buffer_size() + int.from_bytes(held, sys.byteorder)

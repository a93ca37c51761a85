"""Where bytes come from: a serial line, or anything else that pyserial knows by URL."""

from __future__ import annotations

import errno
import re
import termios
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple, Protocol

import serial
from serial.tools import list_ports

from clients.bridge.codec import SECOND_NS
from clients.bridge.errors import ConfigError, PortError

WAIT_S = 0.05
"""Longest wait for a byte; nothing else holds the thread that reads."""
WRITE_TIMEOUT_S = 1.0
MOST_AT_ONCE = 4096
BITS_PER_BYTE = 10
"""8N1: a start bit, eight data bits, a stop bit."""

FAILURES = (serial.SerialException, OSError, termios.error, TypeError)
"""What calls raise when the device goes away: it depends on the call and on the moment. TypeError comes of a
descriptor that is already None."""

SHARED = "is another program reading it? (a second bridge, ModemManager, getty)"


class Chunk(NamedTuple):
    """Bytes that came together.

    Attributes:
        data: one byte or more.
        arrival_ns: when they were read, by our monotonic clock.
        begins: whether the port was opened just before, so that nothing joins them to what came earlier.
    """

    data: bytes
    arrival_ns: int
    begins: bool = False


class EndOfInput(Exception):
    """A recording has been played to its end."""


class Port(Protocol):
    """A source of bytes.

    Attributes:
        byte_ns: how long a byte takes on the line [ns]; 0 where there is no line.
        stale_when_silent: whether silence can mean that the other end is gone without a word.
    """

    byte_ns: float
    stale_when_silent: bool

    def read(self) -> Chunk | None:
        """What has come; None after a short wait without a byte.

        Raises:
            PortError: when the port is gone.
            EndOfInput: when there will be no more.
        """

    def write(self, data: bytes) -> None:
        """Send bytes. Raises PortError."""

    def close(self) -> None:
        """Give the port back; never fails."""


class SerialPort:
    """A port of pyserial, for this process alone.

    Args:
        url: a device such as `/dev/ttyUSB0`, `socket://host:port`, `rfc2217://host:port`, `hwgrep://REGEX`, `loop://`.
        baud: bits a second on a serial line.
        dtr: False to leave DTR and RTS low, so that boards which restart on DTR do not.

    Raises:
        ConfigError: for a URL of no known kind.
        PortError: if it cannot be opened now.
    """

    def __init__(self, url: str, baud: int, dtr: bool = True) -> None:
        self._url = url
        self._socket = url.startswith("socket://")
        self.stale_when_silent = self._socket or url.startswith("rfc2217://")
        on_a_line = not self._socket and not url.startswith("loop://")
        self.byte_ns = BITS_PER_BYTE * SECOND_NS / baud if on_a_line else 0.0
        try:
            self._port = serial.serial_for_url(
                url, do_not_open=True, baudrate=baud, timeout=WAIT_S, write_timeout=WRITE_TIMEOUT_S, exclusive=True
            )
            if not dtr:
                self._port.dtr = False
                self._port.rts = False
            self._port.open()
        except FAILURES as error:
            raise PortError(f"{url}: {reason(error)}") from None
        except ValueError as error:
            raise ConfigError("port", "a device or a URL that pyserial knows", f"{url} ({error})") from None
        self._ask_for_low_latency()

    def read(self) -> Chunk | None:
        """What has come; None after a short wait without a byte. Raises PortError."""
        try:
            data: bytes = self._port.read(1)
            if data:
                data += self._rest()
        except FAILURES as error:
            raise PortError(f"{self._url}: {reason(error)}") from None
        return Chunk(data, time.monotonic_ns()) if data else None

    def write(self, data: bytes) -> None:
        """Send bytes. Raises PortError."""
        try:
            self._port.write(data)
        except FAILURES as error:
            raise PortError(f"{self._url}: {reason(error)}") from None

    def close(self) -> None:
        """Give the port back; never fails."""
        try:
            self._port.close()
        except FAILURES:
            return

    def _rest(self) -> bytes:
        """What came with the first byte; if the port goes away now the next call fails, and nothing is lost."""
        rest = b""
        with suppress(*FAILURES):
            if not self._socket:
                rest = self._port.read(self._port.in_waiting)
            else:  # of a socket pyserial only says whether there is anything
                self._port.timeout = 0
                try:
                    rest = self._port.read(MOST_AT_ONCE)
                finally:
                    self._port.timeout = WAIT_S
        return rest

    def _ask_for_low_latency(self) -> None:
        """USB adapters hold bytes back for 16 ms unless asked not to; not every driver can."""
        try:
            self._port.set_low_latency_mode(True)
        except (AttributeError, NotImplementedError, ValueError, *FAILURES):
            return


def reason(error: BaseException) -> str:
    """Why a call failed, with a hint where there is one."""
    number = getattr(error, "errno", None)
    text = str(error)
    if number == errno.ENOENT:
        return "there is no such device (is it plugged in? --list-ports shows what is)"
    if number in (errno.EACCES, errno.EPERM):
        return "not permitted (is this user in the group dialout?)"
    if number == errno.EAGAIN:
        return f"in use: {SHARED}"
    if "returned no data" in text:
        return f"unplugged, or {SHARED}"
    return re.sub(r"^\[Errno \d+\] ", "", text) or type(error).__name__


class ListedPort(NamedTuple):
    """A serial port of this machine."""

    device: str
    description: str
    stable_name: str | None


def listed_ports() -> list[ListedPort]:
    """The serial ports of this machine, with the names that survive a replug where there are any."""
    by_id = {link.resolve(): str(link) for link in Path("/dev/serial/by-id").glob("*")}
    return [
        ListedPort(port.device, _described(port.description, port.hwid), by_id.get(Path(port.device).resolve()))
        for port in sorted(list_ports.comports())
    ]


def _described(description: str, hardware: str) -> str:
    """What is known of a port; pyserial writes n/a where that is nothing."""
    known = [text for text in (description, f"[{hardware}]") if "n/a" not in text]
    return " ".join(known) or "(no description)"

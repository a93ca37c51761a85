"""What the bridge knows about its device, as named states; time comes in as an argument."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum

from clients.bridge.codec import SECOND_NS

SILENT_NS = SECOND_NS
"""Without a byte for so long a device is silent; the slowest tracker sends 30 times a second."""
RESTART_NS = 2 * SECOND_NS
"""A silent device is told to start so often: it may have been switched on in between."""
STALE_NS = 10 * SECOND_NS
"""A silent network connection is opened anew after so long: nobody says when the other end is gone."""
UNREADABLE_NS = SECOND_NS
"""Bytes without a sample for so long are another protocol or another speed."""
UNREADABLE_BYTES = 64
RECENT_BYTES = 4096
"""How much is kept to find out which."""


class DeviceState(StrEnum):
    """What is known."""

    ABSENT = "absent"
    """The port cannot be opened; it is tried again and again."""
    OPEN = "open"
    """Opened; nothing has come yet."""
    STREAMING = "streaming"
    """Samples come."""
    SILENT = "silent"
    """Nothing has come for a second."""
    WRONG_PROTOCOL = "wrong protocol"
    """Text or records come, of another protocol."""
    WRONG_BAUD = "wrong baud rate"
    """Noise comes, as from a line at another speed."""
    LOST = "lost"
    """It was there and is gone: unplugged, switched off, disconnected."""
    STOPPED = "stopped"


class DeviceWatch:
    """Follows a device.

    Args:
        diagnose: what unreadable bytes are: a state and an explanation.
        tell: called with each new state, and why.
    """

    def __init__(
        self, diagnose: Callable[[bytes], tuple[DeviceState, str]], tell: Callable[[DeviceState, str], None]
    ) -> None:
        self._diagnose = diagnose
        self._tell = tell
        self.state = DeviceState.STOPPED
        self._recent = bytearray()
        self._last_byte_ns = 0
        self._last_sample_ns = 0
        self._last_start_ns = 0
        self._unread = 0

    def opened(self, now_ns: int) -> None:
        """The port was opened."""
        self._last_byte_ns = self._last_sample_ns = self._last_start_ns = now_ns
        self._recent.clear()
        self._unread = 0
        self._become(DeviceState.OPEN, "the port is open")

    def received(self, now_ns: int, data: bytes, samples: int) -> None:
        """Bytes came, and so many samples with them."""
        self._last_byte_ns = now_ns
        if samples:
            self._last_sample_ns = now_ns
            self._recent.clear()
            self._unread = 0
            self._become(DeviceState.STREAMING, "samples come")
            return
        self._recent += data
        self._unread += len(data)
        del self._recent[:-RECENT_BYTES]
        if now_ns - self._last_sample_ns >= UNREADABLE_NS and self._unread >= UNREADABLE_BYTES:
            self._last_sample_ns = now_ns
            self._become(*self._diagnose(bytes(self._recent)))

    def waited(self, now_ns: int) -> None:
        """Nothing came."""
        if now_ns - self._last_byte_ns >= SILENT_NS:
            self._become(DeviceState.SILENT, "nothing has come for a second: is it on, and tracking?")

    def failed(self, why: str) -> None:
        """The port could not be opened, or was lost."""
        was_open = self.state not in (DeviceState.ABSENT, DeviceState.LOST, DeviceState.STOPPED)
        if was_open:
            self._become(DeviceState.LOST, why)
        elif self.state is not DeviceState.LOST:
            self._become(DeviceState.ABSENT, why)

    def stopped(self, why: str) -> None:
        """Nothing will be read any more."""
        self._become(DeviceState.STOPPED, why)

    def start_again(self, now_ns: int) -> bool:
        """Whether it is time to tell a silent device to start."""
        if self.state is not DeviceState.SILENT or now_ns - self._last_start_ns < RESTART_NS:
            return False
        self._last_start_ns = now_ns
        return True

    def stale(self, now_ns: int) -> bool:
        """Whether it has been silent for so long that a network connection may be dead."""
        return now_ns - self._last_byte_ns >= STALE_NS

    def _become(self, state: DeviceState, why: str) -> None:
        if state is not self.state:
            self.state = state
            self._tell(state, why)

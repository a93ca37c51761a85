"""What waits to be sent to one client: a few messages in order, and of frames the newest alone."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from service import protocol
from service.metrics import Metrics
from service.protocol import CloseCode, ProtocolError
from service.shown import Shown

MOST_MESSAGES = 256
"""Messages that may wait for a client that does not read; then it is disconnected."""


@dataclass(frozen=True, slots=True)
class Close:
    """The end of a connection."""

    code: CloseCode
    reason: str


class Outbox:
    """What waits for one client. Belongs to the event loop.

    Messages are sent in order and never dropped; `status` only as it is when it is sent. A frame waits for
    its viewer to acknowledge the one before, and a newer one takes its place.

    Args:
        clock: monotonic [ns].
        status: what to send as the status.
        metrics: counts.
    """

    def __init__(self, clock: Callable[[], int], status: Callable[[], protocol.Status], metrics: Metrics) -> None:
        self.dropped = 0
        self._metrics = metrics
        self._clock = clock
        self._status = status
        self._messages: deque[str] = deque()
        self._status_due = False
        self._frame: Shown | None = None
        self._in_flight: int | None = None
        self._last_sent = 0
        self._close: Close | None = None
        self._wake = asyncio.Event()

    @property
    def wants_frame(self) -> bool:
        """Whether a frame begun now would be of use: one may be in flight, and one wait."""
        return self._in_flight is None or self._frame is None

    def tell(self, message: protocol.Message) -> None:
        """Send a message, after those before."""
        if len(self._messages) >= MOST_MESSAGES:
            self.close(CloseCode.TOO_MANY, "too many messages wait for this client to read them")
        else:
            self._messages.append(protocol.encode(message))
        self._wake.set()

    def tell_status(self) -> None:
        """Send the status, as it is by then."""
        self._status_due = True
        self._wake.set()

    def offer(self, frame: Shown) -> None:
        """Send a frame as soon as the one before is acknowledged, unless a newer one comes first."""
        self.withdraw()
        self._frame = frame
        self._wake.set()

    def withdraw(self) -> None:
        """Forget the frame that waits."""
        if self._frame is not None:
            self.dropped += 1
            self._metrics.dropped()
        self._frame = None

    def acknowledge(self, number: int) -> None:
        """The viewer has taken in a frame.

        Raises:
            ProtocolError: for a frame that it was never sent.
        """
        if number > self._last_sent:
            raise ProtocolError("frame", f"expected one of the frames sent, up to {self._last_sent}, found {number}")
        if number == self._in_flight:
            self._in_flight = None
            self._wake.set()

    def close(self, code: CloseCode, reason: str, error: protocol.Error | None = None) -> None:
        """End the connection, after the messages that wait and `error`; frames are forgotten."""
        if self._close is None:
            self.withdraw()
            if error is not None:
                self._messages.append(protocol.encode(error))
            self._close = Close(code, reason)
            self._wake.set()

    async def next(self) -> str | bytes | Close:
        """What to send next, once there is something: messages first, then status, then a frame."""
        while True:
            if (found := self._take()) is not None:
                return found
            self._wake.clear()
            await self._wake.wait()

    def _take(self) -> str | bytes | Close | None:
        if self._messages:
            return self._messages.popleft()
        if self._close is not None:
            return self._close
        if self._status_due:
            self._status_due = False
            return protocol.encode(self._status())
        if self._frame is not None and self._in_flight is None:
            frame, self._frame = self._frame, None
            self._in_flight = self._last_sent = frame.number
            self._metrics.sent("stream", len(frame.image))
            return frame.packed(self.dropped, self._clock())
        return None

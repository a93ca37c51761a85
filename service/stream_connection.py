"""A client's WebSocket connection, kept for as long as the client takes in anything, however slowly."""

from __future__ import annotations

import fcntl
import sys
import termios

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from service.connection import drop

COUNT_BYTES = 4
"""Size of the C `int` in which the kernel tells how much it holds."""


class StreamConnection(WebSocketsSansIOProtocol):
    """uvicorn's WebSocket, but time runs against a client only while nothing of what was sent reaches it.

    A ping waits behind the frame that is on its way, and on a slow line that frame alone can take longer than
    the client has for its answer.
    """

    _unread_before = 0

    def send_keepalive_ping(self) -> None:
        """Ask whether the client is there, and note how much it has to read before it can answer."""
        self._unread_before = self._unread()
        super().send_keepalive_ping()

    def keepalive_timeout(self) -> None:
        """There is no answer yet: wait on if the client went on reading, else end the connection."""
        unread = self._unread()
        if unread < self._unread_before and self.ping_timeout is not None:
            self._unread_before = unread
            self.pong_timer = self.loop.call_later(self.ping_timeout, self.keepalive_timeout)
        elif unread:
            drop(self.transport)
        else:
            super().keepalive_timeout()

    def _unread(self) -> int:
        """Bytes that wait here and in the kernel until the other end confirms them."""
        held = bytearray(COUNT_BYTES)
        fcntl.ioctl(self.transport.get_extra_info("socket").fileno(), termios.TIOCOUTQ, held)
        return self.transport.get_write_buffer_size() + int.from_bytes(held, sys.byteorder)

"""A client's WebSocket connection, kept for as long as the client takes in what it is sent (how fast: `pace`)."""

from __future__ import annotations

from http import HTTPStatus

from fastapi import FastAPI
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.http11 import Request

from service.connection import drop
from service.pace import unread
from service.request_log import connection_refused, stream_ended


class StreamConnection(WebSocketsSansIOProtocol):
    """uvicorn's WebSocket, but time runs against a client only while nothing of what was sent reaches it.

    A ping waits behind the frame that is on its way, and on a slow line that frame alone can take longer than
    the client has for its answer. What the server ends by itself is logged.

    Attributes:
        service: counts those that are refused.
    """

    service: FastAPI
    _unread_before = 0

    def data_received(self, data: bytes) -> None:
        """Take what came; a head that is fit for HTTP but too long for a WebSocket is refused, not forgotten."""
        super().data_received(data)
        if self.conn.handshake_exc is not None and not self.handshake_initiated:
            reply = b"".join(self.conn.data_to_send())
            self.transport.write(reply)
            self.close_sent = self.handshake_complete = True
            self.transport.close()
            status = int(reply.split()[1]) if reply else None
            connection_refused(self.service, status, "damaged-request", str(self.conn.handshake_exc))

    def handle_connect(self, event: Request) -> None:
        """Let a client in, unless it asks in a way that is none of WebSocket's."""
        super().handle_connect(event)
        if self.response.status_code != HTTPStatus.SWITCHING_PROTOCOLS:
            why = self.response.body.decode(errors="replace").partition("\n")[0]
            connection_refused(self.service, self.response.status_code, "damaged-request", why)

    def handle_parser_exception(self) -> None:
        """End a connection whose client sent what is no WebSocket frame, or too long a message."""
        end = self.conn.close_sent
        assert end is not None
        stream_ended(self.scope, end.code, "protocol", end.reason or str(self.conn.parser_exc))
        super().handle_parser_exception()

    def send_keepalive_ping(self) -> None:
        """Ask whether the client is there, and note how much it has to read before it can answer."""
        self._unread_before = unread(self.transport)
        super().send_keepalive_ping()

    def keepalive_timeout(self) -> None:
        """There is no answer yet: wait on if the client went on reading, else end the connection."""
        left = unread(self.transport)
        if left < self._unread_before and self.ping_timeout is not None:
            self._unread_before = left
            self.pong_timer = self.loop.call_later(self.ping_timeout, self.keepalive_timeout)
            return
        stream_ended(self.scope, None, "gone", f"expected an answer to a ping within {self.ping_timeout} s, found none")
        if left:
            drop(self.transport)
        else:
            super().keepalive_timeout()


def stream_connection_of(service: FastAPI) -> type[StreamConnection]:
    """The class of a service's WebSocket connections."""
    return type("StreamConnection", (StreamConnection,), {"service": service})

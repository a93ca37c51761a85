"""A client's HTTP connection, with an end to its time: whoever sends or reads too slowly makes room for others."""

from __future__ import annotations

import asyncio
import socket
import struct
from collections.abc import Mapping
from http import HTTPStatus

from fastapi import FastAPI
from uvicorn.protocols.http.h11_impl import H11Protocol

from service.headers import SECURITY_HEADERS
from service.pace import Pace
from service.problem import RETRY_AFTER_S, problem
from service.request_log import connection_refused
from service.settings import Settings


class Connection(H11Protocol):
    """uvicorn's connection, closed when a request is not whole, or a reply not taken, in time.

    Attributes:
        settings: how many connections there may be, and how long a client may take.
        service: counts those that are refused.
    """

    settings: Settings
    service: FastAPI

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Give the client its time, or send it away if there are too many."""
        self._request_timer: asyncio.TimerHandle | None = None
        super().connection_made(transport)
        Pace(transport, self.settings, self._give_up_reader)
        if len(self.connections) > self.settings.max_connections:
            detail = f"this service has its {self.settings.max_connections} connections already"
            self._refuse(HTTPStatus.SERVICE_UNAVAILABLE, "too-many", detail, {"Retry-After": str(RETRY_AFTER_S)})
        else:
            self._await_request()

    def data_received(self, data: bytes) -> None:
        """Take what came; the time runs until the request is whole."""
        super().data_received(data)
        if self.transport.get_protocol() is not self or not self._lacks_request():
            _cancel(self._request_timer)
            self._request_timer = None
        elif self._request_timer is None:
            self._await_request()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the client."""
        _cancel(self._request_timer)
        super().connection_lost(exc)

    def _await_request(self) -> None:
        self._request_timer = self.loop.call_later(self.settings.client_timeout_s, self._give_up)

    def _give_up_reader(self, why: str) -> None:
        """The client takes in too little of what it is sent, be it a stream by now."""
        connection_refused(self.service, None, "slow", why)
        drop(self.transport)

    def _lacks_request(self) -> bool:
        return self.cycle is None or self.cycle.response_complete or self.cycle.more_body

    def _give_up(self) -> None:
        """The request is not whole; an answer only makes sense where none has begun."""
        detail = f"expected a whole request within {self.settings.client_timeout_s} s"
        self._refuse(HTTPStatus.REQUEST_TIMEOUT, "request-timeout", detail)

    def send_400_response(self, msg: str) -> None:
        """Refuse what is no HTTP, or whose head is too long."""
        detail = f"expected HTTP/1.1, its head at most {self.settings.max_header_bytes:,} bytes long, found: {msg}"
        self._refuse(HTTPStatus.BAD_REQUEST, "damaged-request", detail)

    def _refuse(self, status: HTTPStatus, kind: str, detail: str, headers: Mapping[str, str] | None = None) -> None:
        """Say why, unless a reply has begun, and end the connection."""
        connection_refused(self.service, status, kind, detail)
        answered = self.cycle is not None and self.cycle.response_started and not self.cycle.response_complete
        if not answered and not self.transport.is_closing():
            reply = problem(status, detail, kind, headers=headers)
            lines = [b"HTTP/1.1 %d %s" % (status, status.phrase.encode()), b"connection: close"]
            lines += [b"%s: %s" % header for header in reply.raw_headers]
            lines += [f"{name}: {value}".encode() for name, value in SECURITY_HEADERS.items()]
            self.transport.write(b"\r\n".join([*lines, b"", bytes(reply.body)]))
        self.transport.close()


def connection_of(settings: Settings, service: FastAPI) -> type[Connection]:
    """The class of a service's connections."""
    return type("Connection", (Connection,), {"settings": settings, "service": service})


def drop(transport: asyncio.Transport) -> None:
    """End a connection and forget what the kernel has still to send: it would keep that for minutes."""
    at_once = struct.pack("ii", 1, 0)
    transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, at_once)
    transport.abort()


def _cancel(timer: asyncio.TimerHandle | None) -> None:
    if timer is not None:
        timer.cancel()

"""Clients that are slow, too many, too talkative or do not read: each is answered or dropped, the others are served."""

from __future__ import annotations

import json
import socket
import ssl
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
import trustme

from renderer.pipeline import Renderer
from service.settings import Settings
from tests.service.conftest import PATIENCE_S, serving
from tests.service.streaming import viewer

TCP_ESTABLISHED = 1
"""First byte of Linux's tcp_info."""

HEAD = b"POST /v1/render HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\n"


@contextmanager
def connected(address: str) -> Iterator[socket.socket]:
    host, port = address.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=PATIENCE_S) as connection:
        yield connection


def all_of(connection: socket.socket) -> bytes:
    """What comes until the service closes the connection."""
    received = b""
    while part := connection.recv(65536):
        received += part
    return received


def problem_of(reply: bytes) -> tuple[int, dict[str, str]]:
    head, _, body = reply.partition(b"\r\n\r\n")
    assert b"application/problem+json" in head
    assert b"nosniff" in head
    return int(head.split()[1]), json.loads(body)


@pytest.fixture(scope="module")
def impatient(renderer: Renderer) -> Iterator[str]:
    """A service that waits for a second only."""
    with serving(Settings(port=0, client_timeout_s=1, max_header_bytes=2048), renderer) as address:
        yield address


@pytest.mark.parametrize("sent", [b"", b"GET / HTTP/1.1\r\nHost: loc", HEAD, HEAD + b"{"])
def test_a_request_that_does_not_end_is_given_up(impatient: str, sent: bytes) -> None:
    with connected(impatient) as connection:
        connection.sendall(sent)
        status, problem = problem_of(all_of(connection))
        assert status == 408
        assert problem["type"] == "urn:gazetrace:problem:request-timeout"
    assert httpx.get(f"{impatient}/healthz").status_code == 200


def test_a_head_that_drips_is_given_up(impatient: str) -> None:
    """Each byte is in time, the head is not."""
    with connected(impatient) as connection:
        connection.settimeout(0.05)
        began = time.monotonic()
        received = b""
        while not received:
            assert time.monotonic() - began < PATIENCE_S
            connection.sendall(b"GET / HTTP/1.1\r\n" if not received and time.monotonic() - began < 0.05 else b"X")
            try:
                received = connection.recv(65536)
            except TimeoutError:
                continue
        assert problem_of(received)[0] == 408


def test_a_second_request_has_its_own_time(impatient: str) -> None:
    with connected(impatient) as connection:
        connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert connection.recv(65536).startswith(b"HTTP/1.1 200")
        connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: loc")
        assert problem_of(all_of(connection))[0] == 408


def test_a_stream_and_a_long_frame_have_all_the_time_they_need(impatient: str) -> None:
    with viewer(impatient) as found:
        query = {"gaze_x": 1, "gaze_y": 1, "width_px": 480, "height_px": 270, "map": "full", "samples_per_cell": 16}
        took_s = 0.0
        while took_s < 1.5:
            began = time.monotonic()
            reply = httpx.get(f"{impatient}/v1/scenes/spheres/frame", params=query, timeout=PATIENCE_S)
            took_s = time.monotonic() - began
            assert reply.status_code == 200
            query["samples_per_cell"] *= 2
        assert found.connection.ping().wait(PATIENCE_S)


def test_a_reply_that_nobody_reads_is_dropped(impatient: str) -> None:
    """8 MB of pixels do not fit into the buffers of a connection."""
    query = "gaze_x=1&gaze_y=1&width_px=960&height_px=720&format=raw"
    with connected(impatient) as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.sendall(f"GET /v1/scenes/matte/frame?{query} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        while True:
            state = connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 1)[0]
            if state != TCP_ESTABLISHED:
                break
    assert httpx.get(f"{impatient}/healthz").status_code == 200


def test_too_large_a_head_is_refused(impatient: str) -> None:
    with connected(impatient) as connection:
        connection.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + b"x" * 4096)
        status, problem = problem_of(all_of(connection))
        assert (status, problem["type"]) == (400, "urn:gazetrace:problem:damaged-request")
        assert "2,048 bytes" in problem["detail"]


def test_what_is_no_http_is_refused_with_a_reason(impatient: str) -> None:
    with connected(impatient) as connection:
        connection.sendall(b"\x16\x03\x01\x02\x00\x01 hello\r\n\r\n")
        assert problem_of(all_of(connection))[0] == 400


def test_connections_are_limited(renderer: Renderer) -> None:
    with serving(Settings(port=0, max_connections=2), renderer) as address:
        with connected(address) as first, viewer(address) as found:
            assert found.connection.ping().wait(PATIENCE_S)
            with connected(address) as third:
                reply = all_of(third)
                assert problem_of(reply)[0] == 503
                assert b"Retry-After: 1" in reply or b"retry-after: 1" in reply
            first.sendall(b"GET /metrics HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
            counted = all_of(first)
            assert b'gazetrace_refusals_total{kind="too-many",via="connection"} 1.0' in counted
            assert b"gazetrace_connections 2.0" in counted
        while httpx.get(f"{address}/healthz").status_code != 200:
            pass


def test_it_serves_https(renderer: Renderer, tmp_path: Path) -> None:
    authority = trustme.CA()
    certfile = tmp_path / "service.pem"
    authority.issue_cert("127.0.0.1").private_key_and_cert_chain_pem.write_to_path(str(certfile))
    trusting = ssl.create_default_context()
    authority.configure_trust(trusting)
    with serving(Settings(port=0, certfile=certfile), renderer) as address:
        assert address.startswith("https://")
        assert httpx.get(f"{address}/healthz", verify=trusting).status_code == 200
        with viewer(address, ssl=trusting) as found:
            assert found.connection.ping().wait(PATIENCE_S)
        with pytest.raises(httpx.ConnectError):
            httpx.get(f"{address}/healthz")

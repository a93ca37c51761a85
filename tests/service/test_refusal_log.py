"""Whoever is refused or sent away leaves a line that says why: on every path of a stream, and below it."""

from __future__ import annotations

import logging
import re
import socket
import time
from collections.abc import Callable, Iterator
from typing import Any

import httpx
import pytest

from renderer.pipeline import Renderer
from service import protocol, stream
from service.protocol import Error, Gaze, Hello, Ping, Ready
from service.settings import Settings
from tests.service.conftest import PATIENCE_S, serving
from tests.service.slow_line import slow_line
from tests.service.streaming import COARSE, configure, peer, source, viewer
from tests.service.test_connection import connected

TOKEN, VIEW_TOKEN, GAZE_TOKEN = "correct-horse-battery", "only-to-look-at", "only-to-be-a-gaze"
BEARER = {"Authorization": f"Bearer {TOKEN}"}

UPGRADE = (
    "Host: localhost",
    "Upgrade: websocket",
    "Connection: Upgrade",
    "Sec-WebSocket-Version: 13",
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
    f"Sec-WebSocket-Protocol: {protocol.SUBPROTOCOL}",
    f"Authorization: Bearer {TOKEN}",
)

LARGE: dict[str, Any] = {"quality": COARSE, "format": "raw", "display": {"width_px": 1280, "height_px": 720}}
"""Frames of 11 MB: more than the kernel takes off the service's hands."""

SLOW = 'gazetrace_refusals_total{kind="slow",via="connection"}'


@pytest.fixture(scope="module")
def strict(renderer: Renderer) -> Iterator[str]:
    """A service that grants little and waits for a second only."""
    tokens = {"token": TOKEN, "view_token": VIEW_TOKEN, "gaze_token": GAZE_TOKEN}
    limits = {"max_sessions": 2, "max_viewers": 1, "max_messages_per_s": 20, "max_message_bytes": 1024}
    times = {"client_timeout_s": 1, "ping_s": 1, "session_expiry_s": 0}
    with serving(Settings(port=0, max_camera_rays=100_000, **tokens, **limits, **times), renderer) as address:  # type: ignore[arg-type]
        yield address


@pytest.fixture
def free(strict: str) -> str:
    """The same when nobody is left of the case before."""
    while any(each["viewers"] or each["gaze_sources"] for each in sessions_of(strict)):
        pass
    return strict


def sessions_of(address: str) -> list[dict[str, Any]]:
    listed = httpx.get(f"{address}/v1/sessions", headers=BEARER, timeout=PATIENCE_S).json()["sessions"]
    assert isinstance(listed, list)
    return listed


def upgrade(address: str, path: str, *headers: str) -> None:
    """Ask for a WebSocket, byte by byte our own, and hear what is said until the end of the connection."""
    with connected(address) as connection:
        connection.sendall("\r\n".join([f"GET {path} HTTP/1.1", *headers, "", ""]).encode())
        while connection.recv(65536):
            pass


def say(
    *messages: protocol.Message | str | bytes, path: str = "/v1/stream", token: str = TOKEN
) -> Callable[[str], None]:
    """Connect, say this, and hear what comes until the end of the connection."""

    def said(address: str) -> None:
        headers = {"Authorization": f"Bearer {token}"}
        with peer(address, path, protocol.decode_stream_down, additional_headers=headers) as found:
            for message in messages:
                found.connection.send(message) if isinstance(message, (str, bytes)) else found.say(message)
            found.closed()

    return said


def damaged_frame(address: str) -> None:
    with viewer(address, token=TOKEN) as found:
        found.next(Ready)
        found.connection.socket.sendall(bytes([0xF3, 0x80]) + bytes(4))
        found.closed()


def other_origin(address: str) -> None:
    with peer(address, "/v1/stream", protocol.decode_stream_down, origin="http://evil.example") as found:
        found.closed()


def other_host(address: str) -> None:
    own = socket.create_connection(("127.0.0.1", int(address.rpartition(":")[2])))
    with peer("http://evil.example", "/v1/stream", protocol.decode_stream_down, sock=own) as found:
        found.closed()


def other_subprotocol(address: str) -> None:
    with peer(address, "/v1/stream", protocol.decode_stream_down, subprotocols=["gazetrace.v2"]) as found:
        found.closed()


def third_session(address: str) -> None:
    with viewer(address, "a", TOKEN) as first, viewer(address, "b", TOKEN) as second:
        first.next(Ready)
        second.next(Ready)
        with viewer(address, "c", TOKEN) as third:
            third.closed()


def second_viewer(address: str) -> None:
    with viewer(address, "a", TOKEN) as first:
        first.next(Ready)
        with viewer(address, "a", TOKEN) as second:
            second.closed()


def second_source(address: str) -> None:
    with source(address, "a", additional_headers=BEARER) as first:
        first.next(Ready)
        with source(address, "a", additional_headers=BEARER) as second:
            second.closed()


def asks(message: protocol.StreamUp) -> Callable[[str], None]:
    """A viewer that wants something, and hears no."""

    def asked(address: str) -> None:
        with viewer(address, token=TOKEN) as found:
            found.say(message)
            found.next(Error)

    return asked


def deaf(address: str) -> None:
    """A client that says who it is and answers no ping."""
    hello = protocol.encode(Hello(TOKEN)).encode()
    with connected(address) as connection:
        connection.sendall("\r\n".join(["GET /v1/stream HTTP/1.1", *UPGRADE, "", ""]).encode())
        connection.sendall(bytes([0x81, 0x80 | len(hello)]) + bytes(4) + hello)
        while connection.recv(65536):
            pass


def stuck_stream(address: str) -> None:
    """A viewer that is reached by less than it must take in."""
    with slow_line(address, 1e9) as line, viewer(address, token=TOKEN, sock=line.client) as found:
        line.bytes_per_s = 1000.0
        found.say(configure(**LARGE))
        sent_away(address)


def stuck_reply(address: str) -> None:
    """A reply that is taken in more slowly than it must be."""
    query = "gaze_x=1&gaze_y=1&width_px=1280&height_px=720&format=raw&acuity_scale=40&samples_per_cell=1"
    with slow_line(address, 1000.0) as line:
        head = "\r\n".join([f"GET /v1/scenes/matte/frame?{query} HTTP/1.1", UPGRADE[0], UPGRADE[-1], "", ""])
        line.client.sendall(head.encode())
        sent_away(address)


def sent_away(address: str) -> None:
    """Return when another client than before was too slow."""
    first: float | None = None
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        lines = httpx.get(f"{address}/metrics", headers=BEARER, timeout=PATIENCE_S).text.splitlines()
        slow = sum(float(line.split()[1]) for line in lines if line.startswith(SLOW))
        first = slow if first is None else first
        if slow > first:
            return
    pytest.fail("nobody was sent away")


CASES: dict[str, tuple[Callable[[str], None], str, str]] = {
    "no key": (lambda at: upgrade(at, "/v1/stream", *UPGRADE[:4]), "damaged-request", "missing Sec-WebSocket-Key"),
    "a version": (
        lambda at: upgrade(at, "/v1/stream", *UPGRADE[:3], "Sec-WebSocket-Version: 8", *UPGRADE[4:]),
        "damaged-request",
        "Sec-WebSocket-Version header: 8",
    ),
    "many headers": (
        lambda at: upgrade(at, "/v1/stream", *UPGRADE, *(f"X-{number}: x" for number in range(150))),
        "damaged-request",
        "128 headers",
    ),
    "a path": (lambda at: upgrade(at, "/v1/nothing", *UPGRADE), "not-found", "only /v1/stream and /v1/gaze"),
    "a subprotocol": (other_subprotocol, "protocol", r"expected gazetrace\.v1"),
    "an origin": (other_origin, "origin", r"evil\.example"),
    "a host": (other_host, "origin", r"does not go by the name 'evil\.example"),
    "no token": (say(Hello(), token="wrong-token"), "token", "the token is wrong"),
    "a viewer's right": (say(Hello(), token=GAZE_TOKEN), "token", "does not entitle to look"),
    "a source's right": (say(path="/v1/gaze?session=a", token=VIEW_TOKEN), "token", "does not entitle to be a gaze"),
    "a right to look alone": (say(Hello(), Gaze(1.0, 2.0), token=VIEW_TOKEN), "protocol", "no gaze, as the token"),
    "a hello": (say('{"type":"hello","session":"a/b"}'), "protocol", "session: expected what matches"),
    "a field": (say(Hello(), '{"type":"gaze","x":1,"y":1,"z":1}'), "protocol", "z: there is no"),
    "binary": (say(Hello(), b"\0"), "protocol", "expected text, found binary"),
    "a second hello": (say(Hello(), Hello()), "protocol", "hello first or not at all"),
    "an acknowledgement": (say(Hello(), protocol.Ack(7)), "protocol", "one of the frames sent"),
    "no session": (say(path="/v1/gaze"), "protocol", "session: is required"),
    "a long message": (say(Hello(), " " * 2000), "protocol", "2000 bytes"),
    "a damaged frame": (damaged_frame, "protocol", "invalid opcode"),
    "sessions": (third_session, "too-many", "2 sessions already"),
    "viewers": (second_viewer, "too-many", "1 viewers already"),
    "gaze sources": (second_source, "too-many", "1 gaze sources already"),
    "messages": (say(Hello(), *(Ping(number, 0) for number in range(30))), "too-many", "at most 20 messages a second"),
    "nothing said": (say(), "expired", "expected a first message"),
    "no answer": (deaf, "gone", "an answer to a ping within 1 s"),
    "a slow stream": (stuck_stream, "slow", "expected 4,096 bytes to be taken in within 1 s, found"),
    "a slow reply": (stuck_reply, "slow", "expected 4,096 bytes to be taken in within 1 s, found"),
    "a scene": (asks(configure(scene="none")), "", "configure refused: .*none"),
    "a change of nothing": (asks(protocol.Camera(1, None)), "", "camera refused: expected configure before"),
    "a frame": (asks(configure(display=LARGE["display"])), "", "frame refused: .*100,000 camera rays"),
}
"""What is done, the kind of the line (none: a message of its own), and what it says."""


@pytest.mark.parametrize("case", CASES)
def test_every_refusal_leaves_a_line_that_says_why(
    case: str, free: str, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stream, "HELLO_S", 0.05 if case == "nothing said" else PATIENCE_S)
    caplog.set_level(logging.INFO, "service")  # that of --debug
    do, kind, why = CASES[case]
    do(free)
    until = time.monotonic() + PATIENCE_S
    while not any(re.search(why, told) and kind == found for found, told in lines(caplog)):
        assert time.monotonic() < until, lines(caplog)
    assert TOKEN not in str(lines(caplog))
    assert "ERROR" not in {record.levelname for record in caplog.records}


def lines(caplog: pytest.LogCaptureFixture) -> list[tuple[str, str]]:
    """Kinds and reasons in the log so far."""
    told = [getattr(record, "said", {"kind": "", "why": record.getMessage()}) for record in list(caplog.records)]
    return [(str(each["kind"]), str(each["why"])) for each in told]

"""Who may hold a stream, how many, what they may say, and how the service ends it."""

from __future__ import annotations

import socket
from contextlib import ExitStack

import httpx
import pytest

from renderer.pipeline import Renderer
from service import protocol, stream
from service.protocol import CloseCode, Error, Hello, Ready
from service.settings import Settings
from tests.service.conftest import serving
from tests.service.streaming import Clock, Peer, configure, peer, sessions, source, viewer

TOKEN = "correct-horse-battery"
VIEW_TOKEN = "only-to-look-at"
GAZE_TOKEN = "only-to-be-a-gaze"
DECODE = protocol.decode_stream_down


def refused(found: Peer) -> tuple[int, Error]:
    """The error before the service ends the connection, and its close code."""
    error = found.next(Error)
    code, reason = found.closed()
    assert reason
    return code, error


@pytest.mark.parametrize(
    ("said", "field"),
    [
        ("no JSON", "message"),
        (b"\x00\x01", "message"),
        ('{"type":"gaze_batch","samples":[]}', "type"),
        ('{"type":"gaze","x":1}', "y"),
        ('{"type":"configure","id":1,"scene":"matte","colour":1}', "colour"),
        ('{"type":"ack","frame":1}', "frame"),
        ('{"type":"hello","session":"a/b"}', "session"),
        ('{"type":"hello","session":"\\ud800"}', "session"),
        ('{"type":"\\udfff"}', "type"),
        ('{"type":"hello","\\ud800":1}', "\ud800"),
    ],
)
def test_what_the_wire_does_not_allow_ends_the_stream(address: str, said: str | bytes, field: str) -> None:
    for first in (True, False):
        with peer(address, "/v1/stream", DECODE) as found:
            if not first:
                found.say(Hello())
                found.next(Ready)
            found.connection.send(said)
            code, error = refused(found)
            assert (code, error.code, error.field) == (CloseCode.PROTOCOL, "protocol", field)


@pytest.mark.parametrize("path", ["/v1/stream", "/v1/gaze?session=damaged"])
def test_a_damaged_frame_ends_the_stream_while_answers_are_due(
    address: str, path: str, caplog: pytest.LogCaptureFixture
) -> None:
    """The server ends such a connection by itself, and nobody calls it a mistake of ours."""
    said = [protocol.encode(protocol.Ping(1, 0)).encode()] * 3 + [b"no message"]
    whole = b"".join(bytes([0x81, 0x80 | len(text)]) + bytes(4) + text for text in said)
    damaged = bytes([0xF3, 0x80]) + bytes(4)
    for _ in range(20):
        with peer(address, path, DECODE) as found:
            found.connection.socket.sendall(whole)
            found.connection.socket.sendall(damaged)
            assert found.closed()[0] in (1002, CloseCode.PROTOCOL)
    while "damaged" in sessions(address) and sessions(address)["damaged"]["gaze_sources"]:
        pass
    assert [record.getMessage() for record in caplog.records if record.levelname == "ERROR"] == []


def test_hello_comes_first_or_not_at_all(address: str) -> None:
    with viewer(address) as found:
        found.say(Hello())
        assert refused(found)[1].field == "type"
    with peer(address, "/v1/stream", DECODE) as found:
        found.say(configure(5))
        assert found.next(Ready, lambda ready: ready.config is not None).config == 5


def test_a_message_that_is_too_long_ends_the_stream(address: str) -> None:
    with viewer(address) as found:
        found.connection.send(" " * (Settings().max_message_bytes + 1))
        assert found.closed()[0] == 1009


def test_a_gaze_source_names_its_session(address: str) -> None:
    for path in ("/v1/gaze", "/v1/gaze?session=", "/v1/gaze?session=a/b"):
        with peer(address, path, protocol.decode_gaze_down) as found:
            code, error = refused(found)
            assert (code, error.field) == (CloseCode.PROTOCOL, "session")
    with source(address, "fed") as found:
        found.connection.send('{"type":"ack","frame":1}')
        assert refused(found)[1].field == "type"


def test_another_subprotocol_is_refused(address: str) -> None:
    for options in ({"subprotocols": None}, {"subprotocols": ["gazetrace.v2"]}):
        with peer(address, "/v1/stream", DECODE, **options) as found:
            code, error = refused(found)
            assert (code, error.field) == (CloseCode.PROTOCOL, "subprotocol")
            assert protocol.SUBPROTOCOL in error.message


@pytest.mark.parametrize("path", ["/v1/stream", "/v1/gaze?session=elsewhere"])
def test_pages_and_names_of_others_are_refused(address: str, path: str) -> None:
    port = int(address.rpartition(":")[2])
    for url, options in (
        (address, {"origin": "http://evil.example"}),
        ("http://evil.example", {"sock": socket.create_connection(("127.0.0.1", port))}),
    ):
        with peer(url, path, DECODE, **options) as found:
            code, error = refused(found)
            assert (code, error.code) == (CloseCode.ORIGIN, "wrong-origin")
            assert "evil.example" in error.message


def test_the_page_of_the_service_may_stream(address: str) -> None:
    with viewer(address, origin=address) as found:
        assert found.next(Ready).config is None


def test_the_token_is_in_a_header_or_in_the_first_message(renderer: Renderer) -> None:
    right = {"additional_headers": {"Authorization": f"Bearer {TOKEN}"}}
    wrong = {"additional_headers": {"Authorization": "Bearer wrong-token"}}
    with serving(Settings(port=0, token=TOKEN), renderer) as address:
        with viewer(address, token=TOKEN) as found:
            assert found.next(Ready)
        with viewer(address, **right) as found:
            assert found.next(Ready)
        with source(address, "fed", **right) as found:
            assert found.next(Ready)
        with source(address, "fed") as found:
            found.say(Hello(TOKEN))
            assert found.next(Ready)
        for token, options in ((None, {}), ("wrong-token", {}), ("\ud800", {}), (TOKEN, wrong)):
            with viewer(address, token=token, **options) as found:
                code, error = refused(found)
                assert (code, error.code) == (CloseCode.TOKEN, "token-needed")
                assert TOKEN not in error.message
        with source(address, "fed") as found:
            found.say(protocol.Gaze(1.0, 2.0))
            assert refused(found)[0] == CloseCode.TOKEN
        with peer(address, "/v1/stream", DECODE) as found:
            found.say(configure())
            assert refused(found)[0] == CloseCode.TOKEN
        assert httpx.get(f"{address}/v1/sessions").status_code == 401
        listed = httpx.get(f"{address}/v1/sessions", headers=right["additional_headers"])
        assert [session["session"] for session in listed.json()["sessions"]][-1] == "fed"


def test_rights_to_look_and_to_be_a_gaze_are_apart(renderer: Renderer) -> None:
    settings = Settings(port=0, token=TOKEN, view_token=VIEW_TOKEN, gaze_token=GAZE_TOKEN)
    with serving(settings, renderer) as address:
        with viewer(address, "shared", token=GAZE_TOKEN) as found:
            assert refused(found)[0] == CloseCode.TOKEN
        with source(address, "shared") as found:
            found.say(Hello(VIEW_TOKEN))
            assert refused(found)[0] == CloseCode.TOKEN
        with viewer(address, "shared", token=VIEW_TOKEN) as found, source(address, "shared") as gaze:
            gaze.say(Hello(GAZE_TOKEN))
            gaze.next(Ready)
            found.say(configure())
            found.final()
            gaze.say(protocol.Gaze(1.0, 2.0))
            assert found.final().header.gaze.x == 1.0
            found.say(protocol.Gaze(3.0, 4.0))
            code, error = refused(found)
            assert (code, error.field) == (CloseCode.PROTOCOL, "type")
            assert "be a gaze" in error.message


@pytest.mark.parametrize("path", ["/v1/stream", "/v1/gaze?session=chatty"])
def test_who_says_too_much_is_sent_away(renderer: Renderer, path: str) -> None:
    clock = Clock()
    with (
        serving(Settings(port=0, max_messages_per_s=20), renderer, clock=clock) as address,
        peer(address, path, DECODE) as found,
    ):
        for _ in range(3):
            for number in range(19):
                found.say(protocol.Ping(number, 0))
            found.next(protocol.Pong, lambda pong: pong.id == 18)
            clock.advance(1)
        for number in range(21):
            found.say(protocol.Ping(number, 0))
        code, error = refused(found)
        assert (code, error.code) == (CloseCode.TOO_MANY, "too-many")
        assert "20 messages a second" in error.message


def test_who_says_nothing_is_sent_away(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stream, "HELLO_S", 0.05)
    with peer(address, "/v1/stream", DECODE) as found:
        code, error = refused(found)
        assert (code, error.code) == (CloseCode.EXPIRED, "idle")


def test_sessions_viewers_and_sources_are_limited(renderer: Renderer) -> None:
    with serving(Settings(port=0, max_sessions=2, max_viewers=1), renderer) as address, ExitStack() as stack:
        first = stack.enter_context(viewer(address, "first"))
        first.next(Ready)
        stack.enter_context(source(address, "first")).next(Ready)
        for another in (viewer(address, "first"), source(address, "first")):
            with another as found:
                assert refused(found)[0] == CloseCode.TOO_MANY
        with viewer(address, "second") as second:
            second.next(Ready)
            with viewer(address, "third") as third:
                code, error = refused(third)
                assert (code, error.code) == (CloseCode.TOO_MANY, "too-many")
        while sessions(address)["second"]["viewers"]:
            pass
        with viewer(address, "third") as third:
            assert third.next(Ready).session == "third"
            assert set(sessions(address)) == {"first", "third"}


def test_a_session_is_kept_for_a_while(renderer: Renderer) -> None:
    clock = Clock()
    with serving(Settings(port=0, session_expiry_s=10), renderer, clock=clock) as address:
        with viewer(address, "kept") as found:
            found.say(configure(3))
            assert found.frame()
            clock.advance(1000)
        clock.advance(9)
        with viewer(address, "kept") as found:
            assert found.next(Ready).config == 3
        while sessions(address)["kept"]["viewers"]:
            pass
        clock.advance(11)
        while sessions(address):
            pass
        with viewer(address, "kept") as found:
            assert found.next(Ready).config is None


@pytest.mark.parametrize("resting", [True, False])
def test_a_service_that_stops_tells_its_clients_to_come_back(renderer: Renderer, resting: bool) -> None:
    with ExitStack() as stack:
        with serving(Settings(port=0), renderer) as address:
            watcher = stack.enter_context(viewer(address, "going"))
            feeder = stack.enter_context(source(address, "going"))
            feeder.next(Ready)
            watcher.say(configure(quality={"samples_per_cell": 1 if resting else 256}))
            watcher.frame()
        assert watcher.closed()[0] == feeder.closed()[0] == CloseCode.STOPPING


def test_a_client_that_vanishes_is_forgotten(address: str) -> None:
    with viewer(address, "vanished") as found:
        found.say(configure(scene="spheres", quality={"samples_per_cell": 256}))
        found.frame()
        found.connection.socket.close()
        while sessions(address)["vanished"]["viewers"]:
            pass

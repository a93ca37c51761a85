"""The wire: what is written can be read, what is broken is one clear error."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_origin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service import protocol
from service.protocol import ProtocolError
from service.record import Between, Length, Matching, Record, fields_of

ROOT = Path(__file__).parents[2]

DECODERS = {
    protocol.decode_stream_up: protocol.StreamUp,
    protocol.decode_stream_down: protocol.StreamDown,
    protocol.decode_gaze_up: protocol.GazeUp,
    protocol.decode_gaze_down: protocol.GazeDown,
}

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


def values_of(hint: Any) -> st.SearchStrategy[Any]:
    """Values of a field's type."""
    origin, arguments = get_origin(hint), get_args(hint)
    if NoneType in arguments:
        return st.none() | st.one_of(values_of(kind) for kind in arguments if kind is not NoneType)
    if origin is Annotated:
        base, bound = arguments
        if isinstance(bound, Matching):
            return st.from_regex(bound.pattern, fullmatch=True)
        if isinstance(bound, Length):
            return st.text(max_size=9) if base is str else st.lists(values_of(get_args(base)[0]), max_size=3).map(tuple)
        assert isinstance(bound, Between)
        numbers = st.integers(int(bound.low), int(bound.high))
        return numbers if base is int else st.floats(bound.low, bound.high)
    if origin is Literal:
        return st.sampled_from(arguments)
    if origin is tuple:
        return st.lists(values_of(arguments[0]), max_size=3).map(tuple)
    if isinstance(hint, type) and issubclass(hint, Record):
        return messages_of(hint)
    if hint in (bool, int, float):
        return {
            bool: st.booleans(),
            int: st.integers(),
            float: st.floats(allow_nan=False, allow_infinity=False),
        }[hint]
    # names that no field of a frame header has, as a header's cost is
    return st.dictionaries(st.text().map(lambda name: f"-{name}"), JSON, max_size=3)


def messages_of(kind: Any) -> st.SearchStrategy[Any]:
    fields = {name: values_of(hint) for name, (hint, _) in fields_of(kind).items()}
    if kind is protocol.Gaze:
        coordinate = st.floats(-protocol.MAX_COORDINATE, protocol.MAX_COORDINATE)
        seen = st.builds(kind, **{**fields, "x": coordinate, "y": coordinate})
        return seen | st.builds(kind, **{**fields, "valid": st.just(False)})
    return st.builds(kind, **fields)


@given(st.data())
def test_what_is_encoded_is_decoded(data: st.DataObject) -> None:
    decode, kinds = data.draw(st.sampled_from(sorted(DECODERS.items(), key=lambda pair: pair[0].__name__)))
    message = data.draw(messages_of(data.draw(st.sampled_from(get_args(kinds)))))
    assert decode(protocol.encode(message)) == message


@given(messages_of(protocol.FrameHeader), st.binary(min_size=1, max_size=64))
def test_what_is_packed_is_unpacked(header: protocol.FrameHeader, image: bytes) -> None:
    header = header_like(header, image_bytes=len(image))
    frame = protocol.unpack_frame(protocol.pack_frame(header, image))
    assert frame == protocol.Frame(header, image)


def header_like(header: protocol.FrameHeader, **changes: Any) -> protocol.FrameHeader:
    return protocol.FrameHeader(**{name: getattr(header, name) for name in fields_of(type(header))} | changes)


GAZE = protocol.Gaze(0.5, 0.25, "fraction", seq=7, tracker_time_ns=100, captured_time_ns=-5, phase="saccade")
GAZE_TEXT = (
    '"x":0.5,"y":0.25,"unit":"fraction","valid":true,"seq":7,"tracker_time_ns":100,"captured_time_ns":-5,'
    '"phase":"saccade"}'
)
LOST_TEXT = (
    '"x":null,"y":null,"unit":"px","valid":false,"seq":null,"tracker_time_ns":null,"captured_time_ns":null,'
    '"phase":null}'
)
UP = [
    (protocol.Hello("secret", "lab-1"), '{"type":"hello","token":"secret","session":"lab-1"}'),
    (
        protocol.Configure(3, "atrium", gaze={"x": 1, "y": 2}, format="jpeg"),
        '{"type":"configure","id":3,"scene":"atrium","gaze":{"x":1,"y":2},"display":null,"camera":null,'
        '"quality":null,"format":"jpeg","image_quality":null}',
    ),
    (GAZE, '{"type":"gaze",' + GAZE_TEXT),
    (protocol.Gaze(valid=False), '{"type":"gaze",' + LOST_TEXT),
    (protocol.Camera(4, None), '{"type":"camera","id":4,"camera":null}'),
    (
        protocol.Quality(5, {"samples_per_cell": 8}),
        '{"type":"quality","id":5,"quality":{"samples_per_cell":8}}',
    ),
    (protocol.Ack(12), '{"type":"ack","frame":12}'),
    (protocol.Ping(1, 99), '{"type":"ping","id":1,"client_time_ns":99}'),
]
DOWN = [
    (
        protocol.Ready("lab-1", 3, "atrium", {"width_px": 64}, None, (protocol.Effect("shadows", "a light"),), 5),
        '{"type":"ready","session":"lab-1","config":3,"scene":"atrium","display":{"width_px":64},"camera":null,'
        '"effects":[{"name":"shadows","reason":"a light"}],"service_time_ns":5}',
    ),
    (
        protocol.Status(10, 4, 2, 0, 1, 1, "held"),
        '{"type":"status","frames":10,"superseded":4,"dropped":2,"rejected":0,"viewers":1,"gaze_sources":1,'
        '"gaze_state":"held"}',
    ),
    (
        protocol.Error("over-limit", "too many", "quality.max_depth", 3),
        '{"type":"error","code":"over-limit","message":"too many","field":"quality.max_depth","id":3}',
    ),
    (protocol.Pong(1, 99, 100), '{"type":"pong","id":1,"client_time_ns":99,"service_time_ns":100}'),
    (
        protocol.Target(0.1, 0.9, "fraction", 0, 5),
        '{"type":"target","x":0.1,"y":0.9,"unit":"fraction","index":0,"count":5}',
    ),
]
SOURCE_UP = [
    (
        protocol.GazeBatch((GAZE, protocol.Gaze(valid=False))),
        '{"type":"gaze_batch","samples":[{' + GAZE_TEXT + ",{" + LOST_TEXT + "]}",
    ),
    (protocol.Margin(0.5), '{"type":"margin","margin_deg":0.5}'),
]
HEADER = protocol.FrameHeader(
    frame=9,
    session="lab-1",
    config=3,
    scene="atrium",
    width=64,
    height=36,
    format="png",
    image_bytes=4,
    phase="final",
    gaze=protocol.FrameGaze(32.0, 18.0, 7, 100, None),
    gaze_state="live",
    samples=4.0,
    acuity_scale=1.0,
    superseded=2,
    dropped=1,
    timing_ms={"total": 1.5},
    service_time_ns=protocol.ServiceTimes(1, 2, 3, 4),
    cost={"effects": ["shadows"]},
)
FRAME_BYTES = (
    b'\x98\x01\x00\x00{"effects":["shadows"],"frame":9,"session":"lab-1","config":3,"scene":"atrium","width":64,'
    b'"height":36,"format":"png","image_bytes":4,"phase":"final","gaze":{"x":32.0,"y":18.0,"seq":7,'
    b'"tracker_time_ns":100,"captured_time_ns":null},"gaze_state":"live","samples":4.0,"acuity_scale":1.0,'
    b'"superseded":2,"dropped":1,"timing_ms":{"total":1.5},'
    b'"service_time_ns":{"gaze_received":1,"started":2,"finished":3,"sent":4}}\x89PNG'
)


@pytest.mark.parametrize(("message", "text"), [*UP, *DOWN, *SOURCE_UP])
def test_messages_are_these_bytes(message: protocol.Message, text: str) -> None:
    assert protocol.encode(message) == text


@pytest.mark.parametrize(
    ("decode", "samples"),
    [
        (protocol.decode_stream_up, UP),
        (protocol.decode_stream_down, DOWN),
        (protocol.decode_gaze_up, SOURCE_UP),
    ],
)
def test_these_bytes_are_messages_and_their_prefixes_are_not(decode: Any, samples: list[Any]) -> None:
    for message, text in samples:
        assert decode(text) == message
        for end in range(len(text)):
            with pytest.raises(ProtocolError, match=r"^message: expected JSON"):
                decode(text[:end])


def test_a_frame_is_these_bytes_and_its_prefixes_are_none() -> None:
    assert protocol.pack_frame(HEADER, b"\x89PNG") == FRAME_BYTES
    assert protocol.unpack_frame(FRAME_BYTES) == protocol.Frame(HEADER, b"\x89PNG")
    for end in range(len(FRAME_BYTES)):
        with pytest.raises(ProtocolError, match=r"^(frame|header|image_bytes): expected"):
            protocol.unpack_frame(FRAME_BYTES[:end])
    with pytest.raises(ProtocolError, match=r"^image_bytes: expected the image's 5 bytes, found 4"):
        protocol.unpack_frame(FRAME_BYTES + b"\0")
    with pytest.raises(ProtocolError, match=r"^image_bytes"):
        protocol.pack_frame(HEADER, b"")


def test_what_may_be_left_out() -> None:
    assert protocol.decode_stream_up('{"type":"hello"}') == protocol.Hello()
    assert protocol.decode_stream_up('{"type":"gaze","x":1,"y":2}') == protocol.Gaze(1.0, 2.0)
    assert protocol.decode_stream_up('{"type":"configure","id":1,"scene":"matte"}') == protocol.Configure(1, "matte")


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("", "message"),
        ("[]", "message"),
        ("null", "message"),
        ("{" * 20_000, "message"),
        ("[" * 60_000, "message"),
        ('{"type":"ping","id":1,"client_time_ns":NaN}', "message"),
        ('{"type":"ping","id":1,"id":2,"client_time_ns":1}', "message"),
        ('{"type":"ack","frame":' + "1" * 5000 + "}", "message"),
        (" " * 70_000, "message"),
        ("{}", "type"),
        ('{"type":"nothing"}', "type"),
        ('{"type":["ack"]}', "type"),
        ('{"type":"ready"}', "type"),
        ('{"type":"margin","margin_deg":1}', "type"),
        ('{"type":"ack"}', "frame"),
        ('{"type":"ack","frame":-1}', "frame"),
        ('{"type":"ack","frame":1.0}', "frame"),
        ('{"type":"ack","frame":true}', "frame"),
        ('{"type":"ack","frame":"1"}', "frame"),
        ('{"type":"ack","frame":null}', "frame"),
        ('{"type":"ack","frame":9223372036854775808}', "frame"),
        ('{"type":"ack","frame":1,"fram":1}', "fram"),
        ('{"type":"hello","session":""}', "session"),
        ('{"type":"hello","session":"a b"}', "session"),
        ('{"type":"hello","session":"a\\n"}', "session"),
        ('{"type":"hello","session":"' + "a" * 65 + '"}', "session"),
        ('{"type":"hello","token":1}', "token"),
        ('{"type":"hello","token":"' + "a" * 5000 + '"}', "token"),
        ('{"type":"configure","id":1,"scene":"matte","display":[]}', "display"),
        ('{"type":"configure","id":9007199254740992,"scene":"matte"}', "id"),
        ('{"type":"gaze"}', "x"),
        ('{"type":"gaze","x":1}', "y"),
        ('{"type":"gaze","x":1e10,"y":1}', "x"),
        ('{"type":"gaze","x":1e999,"y":1}', "x"),
        ('{"type":"gaze","x":' + "9" * 400 + ',"y":1}', "x"),
        ('{"type":"gaze","x":1,"y":2,"unit":"cm"}', "unit"),
        ('{"type":"gaze","x":1,"y":2,"unit":["px"]}', "unit"),
        ('{"type":"gaze","x":1,"y":2,"valid":1}', "valid"),
        ('{"type":"gaze","x":1,"y":2,"phase":"asleep"}', "phase"),
    ],
)
def test_what_a_viewer_may_not_send(text: str, field: str) -> None:
    with pytest.raises(ProtocolError) as caught:
        protocol.decode_stream_up(text)
    assert caught.value.field == field
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"type":"gaze_batch"}', "samples: is required"),
        ('{"type":"gaze_batch","samples":{}}', "samples: expected a list, found {}"),
        ('{"type":"gaze_batch","samples":[1]}', "samples[0]: expected an object, found 1"),
        (
            '{"type":"gaze_batch","samples":[{"x":1,"y":1},{"x":1}]}',
            "samples[1].y: expected a number where the gaze is valid, found null",
        ),
        ('{"type":"gaze_batch","samples":[{"valid":false,"eye":1}]}', "samples[0].eye: there is no such field"),
        (
            '{"type":"gaze_batch","samples":[' + ",".join(['{"valid":false}'] * 1025) + "]}",
            "samples: expected a length",
        ),
        ('{"type":"margin","margin_deg":-0.1}', "margin_deg: expected a number from 0 to 90, found -0.1"),
        ('{"type":"target","x":1,"y":1,"unit":"px","index":0}', "count: is required"),
        ('{"type":"configure","id":1,"scene":"matte"}', "type: expected one of hello, gaze, gaze_batch"),
    ],
)
def test_what_a_gaze_source_may_not_send(text: str, message: str) -> None:
    with pytest.raises(ProtocolError) as caught:
        protocol.decode_gaze_up(text)
    assert str(caught.value).startswith(message)


def test_a_client_ignores_what_a_newer_service_adds() -> None:
    assert protocol.decode_stream_down('{"type":"pong","id":1,"client_time_ns":2,"service_time_ns":3,"new":4}') == (
        protocol.Pong(1, 2, 3)
    )
    assert protocol.decode_gaze_down(protocol.encode(DOWN[0][0])) == DOWN[0][0]  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"format": "gif"}, "format"),
        ({"width": 0}, "width"),
        ({"phase": None}, "phase"),
        ({"gaze": {"x": 1.0}}, "gaze.y"),
        ({"service_time_ns": {"gaze_received": 1, "started": 2, "finished": 3, "sent": 0.5}}, "service_time_ns.sent"),
    ],
)
def test_a_wrong_frame_header_names_the_field(change: dict[str, object], field: str) -> None:
    length = int.from_bytes(FRAME_BYTES[:4], "little")
    header = json.dumps(json.loads(FRAME_BYTES[4 : 4 + length]) | change).encode()
    with pytest.raises(ProtocolError) as caught:
        protocol.unpack_frame(len(header).to_bytes(4, "little") + header + b"\x89PNG")
    assert caught.value.field == field


@given(st.binary(max_size=80))
def test_noise_is_a_protocol_error(noise: bytes) -> None:
    with pytest.raises(ProtocolError):
        protocol.unpack_frame(noise)
    with pytest.raises(ProtocolError):
        protocol.decode_stream_up(noise.decode("latin-1"))


def test_a_header_is_bounded() -> None:
    with pytest.raises(ProtocolError, match="header: expected at most 65536 bytes"):
        protocol.pack_frame(header_like(HEADER, cost={"long": "x" * 70_000}), b"\x89PNG")
    with pytest.raises(ProtocolError, match="header: expected at most 65536 bytes"):
        protocol.unpack_frame((70_000).to_bytes(4, "little") + bytes(80_000))


def test_what_cannot_be_read_cannot_be_made() -> None:
    with pytest.raises(ProtocolError, match=r"^session: expected what matches"):
        protocol.Hello(session="a b")
    with pytest.raises(ProtocolError, match=r"^x: expected a number"):
        protocol.Gaze()
    with pytest.raises(ProtocolError, match=r"^message: expected values of JSON"):
        protocol.encode(protocol.Quality(1, {"x": float("nan")}))


def test_the_wire_needs_the_standard_library_alone() -> None:
    code = (
        "import sys; import service.protocol; "
        "print({name.partition('.')[0] for name in sys.modules} - sys.stdlib_module_names - {'service', '__main__'})"
    )
    found = subprocess.run([sys.executable, "-S", "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert found.stdout.strip() == "set()"

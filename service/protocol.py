"""The wire of `/v1/stream` and `/v1/gaze`: every message, as JSON text, and a frame, as bytes.

Subprotocol `gazetrace.v1`. A text message is one JSON object whose `type` names the message; the rest are its
fields, of which those with a default may be left out. A frame is binary: the length of its header as a little-endian
uint32, the header as JSON, the image. What a client sends is read strictly, an unknown field is an error; what the
service sends may have fields that an older client does not know, and it ignores them.

| direction | messages |
|---|---|
| `/v1/stream` up | hello, configure, gaze, camera, quality, ack, ping |
| `/v1/stream` down | ready, status, error, pong, target; frames |
| `/v1/gaze?session=NAME` up | hello, gaze, gaze_batch, margin, target, ping |
| `/v1/gaze?session=NAME` down | ready, status, error, pong |
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from types import UnionType
from typing import Annotated, Any, ClassVar, Literal, get_args

from service.record import Between, Length, Matching, Record, build, dump, fields_of, load, plain, shown
from service.record import ProtocolError as ProtocolError

SUBPROTOCOL = "gazetrace.v1"

MAX_TEXT_BYTES = 64 << 10
"""Longest text message either side reads."""

MAX_HEADER_BYTES = 64 << 10
"""Longest header of a frame."""

MAX_BATCH = 1024
"""Most samples of one `gaze_batch`."""

MAX_COORDINATE = 1e9
"""Farthest gaze or target, in either unit; both may lie off the screen."""

MAX_INTEGER = 2**63 - 1
MAX_ID = 2**53 - 1
"""Largest id: integers up to here survive JavaScript."""

HEADER_LENGTH = struct.Struct("<I")


class CloseCode(IntEnum):
    """Why the service closes a connection. After `LASTING` ones the same attempt fails again."""

    STOPPING = 1001
    TRY_LATER = 1013
    PROTOCOL = 4400
    TOKEN = 4401
    ORIGIN = 4403
    EXPIRED = 4408
    TOO_MANY = 4429


LASTING = frozenset({CloseCode.PROTOCOL, CloseCode.TOKEN, CloseCode.ORIGIN})
"""Codes after which a client need not reconnect before somebody changed something."""


Id = Annotated[int, Between(0, MAX_ID)]
Count = Annotated[int, Between(0, MAX_INTEGER)]
TimeNs = Annotated[int, Between(-MAX_INTEGER, MAX_INTEGER)]
Coordinate = Annotated[float, Between(-MAX_COORDINATE, MAX_COORDINATE)]
LONGEST_TEXT = 4096
Text = Annotated[str, Length(LONGEST_TEXT)]
SessionName = Annotated[str, Matching(r"[A-Za-z0-9_-]{1,64}")]
Unit = Literal["px", "fraction"]
EyePhase = Literal["fixation", "saccade", "pursuit", "blink"]
GazeState = Literal["live", "held", "lost", "none"]
FramePhase = Literal["moving", "still", "final"]
Json = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Hello(Record):
    """Who connects: optional, but then the first message. Needed where the token is not in a header.

    Attributes:
        token: the service's token.
        session: on `/v1/stream`, the session to create, join or resume; None for a new one with a random name.
    """

    type: ClassVar = "hello"
    token: Text | None = None
    session: SessionName | None = None


@dataclass(frozen=True, slots=True)
class Configure(Record):
    """What to show, in the fields of a render request. Answered by `ready` or `error`; for all viewers.

    Attributes:
        id: the client's own number for it, repeated in `ready` and in every frame of it.
        scene: a scene's id.
        gaze: {x, y, unit}; None keeps the session's gaze.
        display, camera, quality: as in a render request; None for the defaults (camera: the scene's own).
        format: of the frames before the last: `jpeg` (default), `webp`, `png` or `raw`.
        image_quality: of JPEG and WebP at rest; lower while the gaze moves.
    """

    type: ClassVar = "configure"
    id: Id
    scene: Text
    gaze: Json | None = None
    display: Json | None = None
    camera: Json | None = None
    quality: Json | None = None
    format: Text | None = None
    image_quality: Count | None = None


@dataclass(frozen=True, slots=True)
class Gaze(Record):
    """Where the eye looks, or that it is lost (`valid` false; x and y are then ignored and may be None).

    Attributes:
        x, y: `px` of the display or, with `unit` "fraction", shares of its width and height.
        seq: the sender's running number.
        tracker_time_ns: the tracker's own clock.
        captured_time_ns: when the eye was there, by the sender's monotonic clock; comes back in the frame.
        phase: what the eye does, where the sender knows.
    """

    type: ClassVar = "gaze"
    x: Coordinate | None = None
    y: Coordinate | None = None
    unit: Unit = "px"
    valid: bool = True
    seq: Count | None = None
    tracker_time_ns: TimeNs | None = None
    captured_time_ns: TimeNs | None = None
    phase: EyePhase | None = None

    def __post_init__(self) -> None:
        Record.__post_init__(self)
        if self.valid:
            for name in ("x", "y"):
                if getattr(self, name) is None:
                    raise ProtocolError(name, "expected a number where the gaze is valid, found null")


@dataclass(frozen=True, slots=True)
class GazeBatch(Record):
    """Several samples, oldest first; the last one counts."""

    type: ClassVar = "gaze_batch"
    samples: Annotated[tuple[Gaze, ...], Length(MAX_BATCH)]


@dataclass(frozen=True, slots=True)
class Camera(Record):
    """Another view of the same scene: a configuration of its own, with a new `id`."""

    type: ClassVar = "camera"
    id: Id
    camera: Json | None


@dataclass(frozen=True, slots=True)
class Quality(Record):
    """Another quality of the same view: a configuration of its own, with a new `id`."""

    type: ClassVar = "quality"
    id: Id
    quality: Json


@dataclass(frozen=True, slots=True)
class Ack(Record):
    """The viewer has taken in a frame: the next one may be sent."""

    type: ClassVar = "ack"
    frame: Count


@dataclass(frozen=True, slots=True)
class Ping(Record):
    """Asks for the service's clock."""

    type: ClassVar = "ping"
    id: Id
    client_time_ns: TimeNs


@dataclass(frozen=True, slots=True)
class Margin(Record):
    """How far off the tracker's gaze may be [deg]: cells are small enough for any gaze this near."""

    type: ClassVar = "margin"
    margin_deg: Annotated[float, Between(0.0, 90.0)]


@dataclass(frozen=True, slots=True)
class Target(Record):
    """A calibration target to show, forwarded from a gaze source to every viewer; x and y None: no more.

    Attributes:
        index, count: which of how many, from 0.
    """

    type: ClassVar = "target"
    x: Coordinate | None
    y: Coordinate | None
    unit: Unit
    index: Count
    count: Count


@dataclass(frozen=True, slots=True)
class Effect(Record):
    """An effect that the scene calls for, and why."""

    name: Text
    reason: Text


@dataclass(frozen=True, slots=True)
class Ready(Record):
    """What is in force: after joining, and whenever it changes. All frames after it are of this configuration.

    Attributes:
        session: its name, to come back to.
        config: id of the configuration; None (as all below) where the session has none yet.
        display, camera: complete, in the fields of a render request.
        effects: the ones that run.
        service_time_ns: the service's monotonic clock.
    """

    type: ClassVar = "ready"
    session: SessionName
    config: Id | None
    scene: Text | None
    display: Json | None
    camera: Json | None
    effects: tuple[Effect, ...]
    service_time_ns: TimeNs


@dataclass(frozen=True, slots=True)
class Status(Record):
    """The session in numbers, counted since it began: when one of the last four changes, and each second of activity.

    Attributes:
        frames: frames rendered.
        superseded: gazes that a newer one replaced before they were rendered.
        dropped: frames that viewers missed because they had not acknowledged the one before.
        rejected: samples that were no light: not a number, negative or infinite; 0 unless something is broken.
        viewers, gaze_sources: connections.
        gaze_state: `live`; `held`: invalid for a short time; `lost`: the whole screen is rendered evenly; `none` yet.
    """

    type: ClassVar = "status"
    frames: Count
    superseded: Count
    dropped: Count
    rejected: Count
    viewers: Count
    gaze_sources: Count
    gaze_state: GazeState


@dataclass(frozen=True, slots=True)
class Error(Record):
    """A request that was refused; what was in force before still is. Before a close: why.

    Attributes:
        code: the kind, as in the HTTP problems: `invalid-request`, `over-limit`, `unknown-scene`, ...
        message: one line fit to show.
        field: dotted path of the wrong field.
        id: of the configuration that was refused.
    """

    type: ClassVar = "error"
    code: Text
    message: Text
    field: Text | None = None
    id: Id | None = None


@dataclass(frozen=True, slots=True)
class Pong(Record):
    """The answer to `ping`: its id and time, and the service's monotonic clock."""

    type: ClassVar = "pong"
    id: Id
    client_time_ns: TimeNs
    service_time_ns: TimeNs


@dataclass(frozen=True, slots=True)
class FrameGaze(Record):
    """The gaze a frame was made for [px], with what its sender said of it."""

    x: float
    y: float
    seq: Count | None = None
    tracker_time_ns: TimeNs | None = None
    captured_time_ns: TimeNs | None = None


@dataclass(frozen=True, slots=True)
class ServiceTimes(Record):
    """The service's monotonic clock when the gaze came in, rendering began and ended, and the frame was sent."""

    gaze_received: TimeNs
    started: TimeNs
    finished: TimeNs
    sent: TimeNs


@dataclass(frozen=True, slots=True)
class FrameHeader(Record):
    """What a frame shows and what it cost.

    Attributes:
        frame: its number in the session, for `ack`.
        config: the configuration it shows.
        format: `png` (lossless), `jpeg`, `webp` or `raw` (float32 little-endian linear Rec.709, row by row).
        image_bytes: length of the image.
        phase: `moving`; `still`: more samples will follow; `final`: all samples, and lossless unless raw.
        gaze: None before the first one.
        samples: mean number of samples a cell.
        acuity_scale: 1, or more where cells had to be coarser than the eye calls for.
        superseded: gazes replaced before they were rendered, since the session began.
        dropped: frames that this viewer missed.
        timing_ms: wait, map, trace, reconstruct, encode, total.
        cost: everything else, at the top level of the JSON: map, cells_traced, cells_reused, rays, effects, error
            {rms, foveal_rms, guessed} (standard error as a share of white), deadline_promised,
            deadline_met, error_met, ...
    """

    frame: Count
    session: SessionName
    config: Id
    scene: Text
    width: Annotated[int, Between(1, 1 << 20)]
    height: Annotated[int, Between(1, 1 << 20)]
    format: Literal["png", "jpeg", "webp", "raw"]
    image_bytes: Annotated[int, Between(1, 1 << 40)]
    phase: FramePhase
    gaze: FrameGaze | None
    gaze_state: GazeState
    samples: float
    acuity_scale: float
    superseded: Count
    dropped: Count
    timing_ms: Json
    service_time_ns: ServiceTimes
    cost: Json


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame, as it was received."""

    header: FrameHeader
    image: bytes


StreamUp = Hello | Configure | Gaze | Camera | Quality | Ack | Ping
StreamDown = Ready | Status | Error | Pong | Target
GazeUp = Hello | Gaze | GazeBatch | Margin | Target | Ping
GazeDown = Ready | Status | Error | Pong
Message = StreamUp | StreamDown | GazeUp | GazeDown


def encode(message: Message) -> str:
    """The message as JSON text.

    Raises:
        ProtocolError: for a value that JSON cannot hold.
    """
    return dump({"type": message.type, **plain(message)})


def decode_stream_up(text: str) -> StreamUp:
    """What a viewer sends. Raises ProtocolError."""
    message: StreamUp = _decode(text, StreamUp, strict=True)
    return message


def decode_stream_down(text: str) -> StreamDown:
    """What a viewer receives as text. Raises ProtocolError."""
    message: StreamDown = _decode(text, StreamDown, strict=False)
    return message


def decode_gaze_up(text: str) -> GazeUp:
    """What a gaze source sends. Raises ProtocolError."""
    message: GazeUp = _decode(text, GazeUp, strict=True)
    return message


def decode_gaze_down(text: str) -> GazeDown:
    """What a gaze source receives. Raises ProtocolError."""
    message: GazeDown = _decode(text, GazeDown, strict=False)
    return message


def pack_frame(header: FrameHeader, image: bytes) -> bytes:
    """A frame as one binary message.

    Raises:
        ProtocolError: if `image_bytes` is not the image's length, or the header is too long.
    """
    _check_image(header, image)
    values = plain(header)
    packed = dump({**values.pop("cost"), **values}).encode()
    if len(packed) > MAX_HEADER_BYTES:
        raise ProtocolError("header", f"expected at most {MAX_HEADER_BYTES} bytes, found {len(packed)}")
    return b"".join((HEADER_LENGTH.pack(len(packed)), packed, image))


def unpack_frame(data: bytes) -> Frame:
    """A binary message as a frame.

    Raises:
        ProtocolError: for anything that is not exactly one frame.
    """
    if len(data) < HEADER_LENGTH.size:
        raise ProtocolError("frame", f"expected {HEADER_LENGTH.size} bytes of header length, found {len(data)}")
    (length,) = HEADER_LENGTH.unpack_from(data)
    if length > MAX_HEADER_BYTES:
        raise ProtocolError("header", f"expected at most {MAX_HEADER_BYTES} bytes, found {length}")
    end = HEADER_LENGTH.size + length
    if len(data) < end:
        raise ProtocolError("header", f"expected {length} bytes, found {len(data) - HEADER_LENGTH.size}")
    try:
        text = data[HEADER_LENGTH.size : end].decode()
    except UnicodeDecodeError:
        raise ProtocolError("header", "expected UTF-8") from None
    values = load(text, "header")
    known = fields_of(FrameHeader).keys() - {"cost"}
    values = {
        **{name: value for name, value in values.items() if name in known},
        "cost": {name: value for name, value in values.items() if name not in known},
    }
    frame = Frame(build(FrameHeader, values, strict=False), bytes(data[end:]))
    _check_image(frame.header, frame.image)
    return frame


def _check_image(header: FrameHeader, image: bytes) -> None:
    if len(image) != header.image_bytes:
        raise ProtocolError("image_bytes", f"expected the image's {len(image)} bytes, found {header.image_bytes}")


def _decode(text: str, kinds: UnionType, *, strict: bool) -> Any:
    if len(text) > MAX_TEXT_BYTES:
        raise ProtocolError("message", f"expected at most {MAX_TEXT_BYTES} characters, found {len(text)}")
    values = load(text, "message")
    named = {kind.type: kind for kind in get_args(kinds)}
    kind = values.pop("type", None)
    if not isinstance(kind, str) or kind not in named:
        raise ProtocolError("type", f"expected one of {', '.join(named)}, found {shown(kind)}")
    return build(named[kind], values, strict=strict)

"""ASL EYE-TRAC 5000, 6, 7, 501, 504 and Mobile Eye: "Serial Out", streaming or on demand.

A record is status, (frame number,) pupil, spare, horizontal, vertical: 8 or 10 bytes, high byte first. Streaming packs
it into 7 bits: each group of up to seven bytes is sent with bit 7 clear and followed by a byte that holds those bits;
then bit 7 of the very first byte marks the start. On demand the plain bytes answer a request.
"""

from __future__ import annotations

import struct

from clients.bridge.codec import MILLISECOND_NS, SECOND_NS, Codec
from clients.bridge.errors import ConfigError
from clients.bridge.sample import MISSING, Point, Sample

START_BIT = 0x80
GROUP = 7
PLAIN = struct.Struct(">BHBhh")
COUNTED = struct.Struct(">BHHBhh")
FRAME_WRAP = 65_536
RATES_HZ = (50, 60, 120, 240, 360)

WIDTH, HEIGHT = 260, 240
"""The scene monitor: 0 is left and top."""
REACH = 4
"""A gaze further out than this many monitors is a damaged record, not a gaze."""
LARGEST_PUPIL = 4095

ANSWER_NS = 50 * MILLISECOND_NS
"""A request without an answer for this long is sent again; the slowest device sends a record every 20 ms."""


class Asl(Codec):
    """ASL "Serial Out".

    Args:
        counted: whether records hold the frame number (10 bytes instead of 8).
        request: the byte that asks for a record; None if the device streams.

    Raises:
        ConfigError: for a request that is no byte.
    """

    name = "asl"
    unit = "asl"
    wrap = FRAME_WRAP

    def __init__(self, counted: bool = False, request: int | None = None) -> None:
        super().__init__()
        if request is not None and not 0 <= request <= 255:
            raise ConfigError("poll_byte", "0 to 255", request)
        self._layout = COUNTED if counted else PLAIN
        self._counted = counted
        self._request = request
        self.ticks_ns = tuple(SECOND_NS / rate for rate in RATES_HZ) if counted else ()
        self._record_size = self._layout.size if request is not None else _packed_size(self._layout.size)
        self._pending = bytearray()
        self._position = 0
        self._asked_ns: int | None = None
        self._frame = 0

    def due(self, now_ns: int) -> bytes:
        """On demand: the next request, once the last was answered or will not be."""
        if self._request is None or (self._asked_ns is not None and now_ns - self._asked_ns < ANSWER_NS):
            return b""
        self._throw_away()
        self._asked_ns = now_ns
        return bytes((self._request,))

    def reset(self) -> None:
        """Forget a half record and an open request."""
        self._pending.clear()
        self._asked_ns = None

    def feed(self, data: bytes) -> list[Sample]:
        """The samples that `data` completes."""
        samples = []
        for byte in data:
            self._position += 1
            if self._begins(byte):
                self._throw_away()
            elif not self._pending and not self._expects_more():
                continue
            self._pending.append(byte)
            if len(self._pending) == self._record_size:
                sample = self._read(bytes(self._pending))
                self._pending.clear()
                if sample is None:
                    self.bad += 1  # on demand: bytes may be out of step, so the next request waits for silence
                else:
                    self._asked_ns = None
                    samples.append(sample)
        return samples

    def encode(self, time_ns: int, point: Point | None) -> bytes:  # noqa: ARG002 (the device has no clock)
        """A record with pupil 45, or pupil 0 for a lost eye."""
        pupil, x, y = (0, 0, 0) if point is None else (45, round(point.x), round(point.y))
        frame = (self._frame,) if self._counted else ()
        self._frame = (self._frame + 1) % FRAME_WRAP
        record = self._layout.pack(0, *frame, pupil, 0, x, y)
        return record if self._request is not None else pack(record)

    def _begins(self, byte: int) -> bool:
        return self._request is None and byte >= START_BIT

    def _expects_more(self) -> bool:
        """Whether a byte with nothing before it can be the first of a record."""
        return self._request is not None and self._asked_ns is not None

    def _throw_away(self) -> None:
        if self._pending:
            self.bad += 1
            self._pending.clear()

    def _read(self, record: bytes) -> Sample | None:
        """The sample of a whole record; None if no device sends such a one."""
        plain = unpack(record) if self._request is None else record
        if plain is None:
            return None
        status, *counter, pupil, _, x, y = self._layout.unpack(plain)
        lost = status > 0 or pupil == 0 or MISSING in (x, y)
        reached = abs(x) <= REACH * WIDTH and abs(y) <= REACH * HEIGHT
        if pupil > LARGEST_PUPIL or status >= START_BIT or not (lost or reached):
            return None
        return Sample(
            self._position - self._record_size,
            self._record_size,
            float(counter[0]) if counter else None,
            both=None if lost else Point(float(x), float(y)),
        )


def pack(record: bytes) -> bytes:
    """A record as it is streamed: 8 bytes become 10, 10 become 12."""
    packed = bytearray()
    for begin in range(0, len(record), GROUP):
        group = record[begin : begin + GROUP]
        packed += bytes(byte & ~START_BIT for byte in group)
        packed.append(sum((byte >> 7) << index for index, byte in enumerate(group)))
    packed[0] |= START_BIT
    return bytes(packed)


def unpack(packed: bytes) -> bytes | None:
    """The record that was streamed; None if a bit is set that no record sets."""
    record = bytearray()
    for begin in range(0, len(packed), GROUP + 1):
        *group, high_bits = packed[begin : begin + GROUP + 1]
        if high_bits >> len(group):
            return None
        record += bytes((byte & ~START_BIT) | ((high_bits >> index & 1) << 7) for index, byte in enumerate(group))
    return bytes(record)


def _packed_size(size: int) -> int:
    return size + (size - 1) // GROUP + 1

"""What every protocol is: bytes in, samples out, no port and no clock.

However a stream is cut into chunks, the samples are the same. After bytes were lost, added or changed on the line a
codec finds the next record by itself: at most two samples are lost, and there are never more samples than records.
None of the formats has a checksum, so a changed digit goes unseen; what has the wrong shape or range is thrown away.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import ClassVar, NamedTuple

from clients.bridge.sample import Point, Sample

LONGEST_RECORD = 64 << 10
"""Most bytes kept while waiting for the end of a record; a device sends a few hundred."""

SECOND_NS = 1_000_000_000
MILLISECOND_NS = 1_000_000
MICROSECOND_NS = 1_000

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?"
"""A decimal number as a device writes it; Python's float() would also take `1_0` and `infinity`."""

IS_NUMBER = re.compile(NUMBER)


class Codec(ABC):
    """A protocol: what to send, and what the answers mean.

    Attributes:
        name: as the command line calls it.
        unit: of the points: `px`, `fraction`, `deg`, `asl` (260x240) or `raw`.
        origin: where (0, 0) is: `top-left`, `bottom-left` or `center`.
        binocular: whether samples hold the two eyes apart.
        ticks_ns: how long a tick of the device's clock may be; several where only the rate of arrival can tell.
        wrap: ticks after which the device's clock starts from 0 again; None if it does not.
        bad: records thrown away so far.
        complaint: why nothing can be read, once that is clear.
    """

    name: ClassVar[str]
    unit: str = "px"
    origin: ClassVar[str] = "top-left"
    binocular: ClassVar[bool] = False
    ticks_ns: tuple[float, ...] = ()
    wrap: int | None = None

    def __init__(self) -> None:
        self.bad = 0
        self.complaint: str | None = None

    def start(self) -> tuple[bytes, ...]:
        """What makes the device send; between two of these the line is left to settle and what came is thrown away."""
        return ()

    def stop(self) -> bytes:
        """What makes the device stop."""
        return b""

    def due(self, now_ns: int) -> bytes:  # noqa: ARG002 (most devices want nothing)
        """What the device wants to be sent by now: a request, a sign of life.

        Args:
            now_ns: a monotonic clock [ns].
        """
        return b""

    @abstractmethod
    def feed(self, data: bytes) -> list[Sample]:
        """The samples that `data`, the next bytes of the stream, completes."""

    @abstractmethod
    def reset(self) -> None:
        """Forget a half record: the stream begins anew, perhaps in the middle of one."""

    @abstractmethod
    def encode(self, time_ns: int, point: Point | None) -> bytes:
        """The record that such a device sends for a point in its own unit, None for a lost eye."""


class Line(NamedTuple):
    """A line without its end.

    Attributes:
        first: index of its first byte in the stream.
        size: bytes, with the end.
        text: its characters; what is not ASCII becomes U+FFFD.
    """

    first: int
    size: int
    text: str


class LineBuffer:
    """Cuts a stream into lines at LF; a CR before it belongs to the end."""

    def __init__(self) -> None:
        self._pending = bytearray()
        self._position = 0
        self.overlong = 0

    def feed(self, data: bytes) -> Iterator[Line]:
        """The lines that `data` completes."""
        self._pending += data
        while (end := self._pending.find(b"\n")) >= 0:
            text = self._pending[:end].rstrip(b"\r").decode("ascii", "replace")
            yield Line(self._position, end + 1, text)
            self._drop(end + 1)
        if len(self._pending) > LONGEST_RECORD:
            self.overlong += 1
            self._drop(len(self._pending))

    def clear(self) -> None:
        """Forget the line that has begun."""
        self._drop(len(self._pending))

    def _drop(self, size: int) -> None:
        del self._pending[:size]
        self._position += size


class BadRecord(ValueError):
    """A record of the wrong shape."""


class LineCodec(Codec):
    """A protocol of one record a line."""

    starts_mid_line: ClassVar[bool] = False
    """Whether the tail of a line could pass for a whole one, so that the first line is never trusted."""

    def __init__(self) -> None:
        super().__init__()
        self._lines = LineBuffer()
        self._untrusted = self.starts_mid_line

    def feed(self, data: bytes) -> list[Sample]:
        """The samples of the lines that `data` completes."""
        samples: list[Sample] = []
        for line in self._lines.feed(data):
            if self._untrusted:
                self._untrusted = False
                continue
            try:
                samples += self.read(line)
            except BadRecord:
                self.bad += 1
        self.bad += self._lines.overlong
        self._lines.overlong = 0
        return samples

    def reset(self) -> None:
        """Forget the line that has begun."""
        self._lines.clear()
        self._untrusted = self.starts_mid_line

    @abstractmethod
    def read(self, line: Line) -> list[Sample]:
        """The samples of one line: none where it says something else.

        Raises:
            BadRecord: for a record of the wrong shape.
        """


def number(text: str) -> float:
    """The number that `text` is.

    Raises:
        BadRecord: if it is none.
    """
    if IS_NUMBER.fullmatch(text) is None:
        raise BadRecord(text)
    return float(text)

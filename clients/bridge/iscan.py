"""ISCAN ETL: the "Serial I/O" of DQW, raw binary or raw ASCII, one packet a sample.

Binary packets are little-endian words: the header 0x4444, then each parameter times ten. Parameters are camera units
or what the operator chose, so a calibration maps them to the screen.
"""

from __future__ import annotations

import re
import struct

from clients.bridge.codec import BadRecord, Codec, Line, LineCodec
from clients.bridge.errors import ConfigError
from clients.bridge.sample import Point, Sample, seen

HEADER = b"DD"
HEADER_BYTE = HEADER[0]
MOST_PARAMETERS = 12
"""Two banks of six."""
LARGEST_WORD = 0x4400
"""Below 1740.8 no word has the header's byte as its high byte: a packet with a larger word is misaligned."""
FIELD = re.compile(r" ( *-?\d+\.\d)\t")
FIELD_SIZE = 7


class _Iscan(Codec):
    """What both outputs share: commands, and which parameters are the gaze."""

    unit = "raw"

    def __init__(self, parameters: int = 2, columns: tuple[int, int] = (0, 1), start: int = 128, stop: int = 129):
        super().__init__()
        if not 2 <= parameters <= MOST_PARAMETERS:
            raise ConfigError("iscan_parameters", f"2 to {MOST_PARAMETERS}", parameters)
        if not all(0 <= column < parameters for column in columns) or columns[0] == columns[1]:
            raise ConfigError("iscan_columns", f"two different numbers from 0 to {parameters - 1}", columns)
        for name, command in (("iscan_start", start), ("iscan_stop", stop)):
            if not 128 <= command <= 255:
                raise ConfigError(name, "128 to 255", command)
        self._parameters, self._columns = parameters, columns
        self._start, self._stop = bytes((start,)), bytes((stop,))

    def start(self) -> tuple[bytes, ...]:
        """Stop what runs, then start."""
        return self._stop, self._start

    def stop(self) -> bytes:
        """Stop."""
        return self._stop

    def _point(self, values: list[float]) -> Point | None:
        return seen(values[self._columns[0]], values[self._columns[1]])

    def _values(self, point: Point | None) -> list[float]:
        values = [0.0] * self._parameters
        if point is not None:
            values[self._columns[0]], values[self._columns[1]] = point
        return values


class IscanBinary(_Iscan):
    """Raw binary output.

    Args:
        parameters: how many are sent.
        columns: which of them, from 0, are horizontal and vertical gaze.
        start: the command byte that starts the output.
        stop: the command byte that stops it.

    Raises:
        ConfigError: for one that is out of range.
    """

    name = "iscan"

    def __init__(self, parameters: int = 2, columns: tuple[int, int] = (0, 1), start: int = 128, stop: int = 129):
        super().__init__(parameters, columns, start, stop)
        self._words = struct.Struct(f"<{parameters}H")
        self._packet_size = len(HEADER) + self._words.size
        self._pending = bytearray()
        self._position = 0
        self._before = -1

    def reset(self) -> None:
        """Forget a half packet."""
        self._drop(len(self._pending))
        self._before = -1

    def feed(self, data: bytes) -> list[Sample]:
        """The samples that `data` completes."""
        self._pending += data
        samples = []
        while self._find_header() and len(self._pending) >= self._packet_size:
            words = self._words.unpack_from(self._pending, len(HEADER))
            if max(words) >= LARGEST_WORD:
                self.bad += 1
                self._drop(1)
                continue
            point = self._point([word / 10 for word in words])
            samples.append(Sample(self._position, self._packet_size, both=point))
            self._drop(self._packet_size)
        return samples

    def encode(self, time_ns: int, point: Point | None) -> bytes:  # noqa: ARG002 (the device sends no time)
        """A packet; a lost eye is 0.0, and so is a negative value, whose coding is not known."""
        words = [min(max(round(value * 10), 0), LARGEST_WORD - 1) for value in self._values(point)]
        return HEADER + self._words.pack(*words)

    def _find_header(self) -> bool:
        """Drop what stands before the next header, which is `44 44` after another byte; whether there is one."""
        at = 0
        while (at := self._pending.find(HEADER, at)) >= 0:
            before = self._pending[at - 1] if at > 0 else self._before
            if before != HEADER_BYTE:
                self._drop(at)
                return True
            at += 1
        keep = 1 if self._pending.endswith(HEADER[:1]) else 0
        self._drop(len(self._pending) - keep)
        return False

    def _drop(self, size: int) -> None:
        if size > 0:
            self._before = self._pending[size - 1]
            del self._pending[:size]
            self._position += size


class IscanAscii(_Iscan, LineCodec):
    """Raw ASCII output: each parameter is seven characters, ` xxx.x` and a tab. Arguments as for the binary one."""

    name = "iscan-ascii"

    def read(self, line: Line) -> list[Sample]:
        """The sample of a line, which has exactly the width of its parameters."""
        values = [float(field) for field in FIELD.findall(line.text)]
        if len(values) != self._parameters or len(line.text) != FIELD_SIZE * self._parameters:
            raise BadRecord(line.text)
        return [Sample(line.first, line.size, both=self._point(values))]

    def encode(self, time_ns: int, point: Point | None) -> bytes:  # noqa: ARG002 (the device sends no time)
        """A line; a lost eye is 0.0."""
        return "".join(f" {value:5.1f}\t" for value in self._values(point)).encode("ascii") + b"\r\n"

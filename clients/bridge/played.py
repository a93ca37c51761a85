"""A gaze trace as the bytes that a device would send: for those who have no tracker, and for tests."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import NamedTuple

from clients.bridge.codec import SECOND_NS, Codec
from clients.bridge.port import WAIT_S, Chunk, EndOfInput
from clients.bridge.sample import Point
from clients.bridge.screen import Place
from clients.gaze_trace import GazeTrace


class Record(NamedTuple):
    """Bytes of a device, and when it sends them [ns since the start]."""

    due_ns: int
    data: bytes


def records(
    trace: GazeTrace, codec: Codec, place: Place, rate_hz: float | None = None, loop: bool = False
) -> Iterator[Record]:
    """What a device of that protocol sends while the eye does what the trace says.

    Args:
        trace: pixels are those of `place.screen`.
        codec: the protocol.
        place: what the device's numbers mean.
        rate_hz: records a second; None for one for each sample of the trace.
        loop: whether to begin again at its end.
    """
    on_screen = trace.on_screen(1, 1, (round(place.screen.width_px), round(place.screen.height_px)))
    begin_ns = 0
    while True:
        end_ns = begin_ns
        for due_ns, index in _times(on_screen, rate_hz):
            sample = on_screen.sample(index)
            point = place.device(Point(sample.x, sample.y)) if sample.valid else None
            end_ns = begin_ns + due_ns
            yield Record(end_ns, codec.encode(end_ns, point))
        if not loop:
            return
        begin_ns = end_ns + (round(SECOND_NS / rate_hz) if rate_hz else _step_ns(on_screen))


def _times(trace: GazeTrace, rate_hz: float | None) -> Iterator[tuple[int, int]]:
    """When records are sent [ns], and which sample each shows."""
    if rate_hz is None:
        for index in range(len(trace)):
            yield round((trace.time_ms[index] - trace.time_ms[0]) * 1e6), index
        return
    tick = 0
    while (seconds := tick / rate_hz) <= trace.seconds:
        yield round(seconds * SECOND_NS), trace.newest(seconds)
        tick += 1


def _step_ns(trace: GazeTrace) -> int:
    return round(trace.seconds * SECOND_NS / max(1, len(trace) - 1))


class PlayedPort:
    """Such a device as a port.

    Args:
        source: its records.
        speed: 1 in real time, 0 as fast as possible.
    """

    byte_ns = 0.0
    stale_when_silent = False

    def __init__(self, source: Iterator[Record], speed: float = 1.0) -> None:
        self._source = source
        self._speed = speed
        self._next = next(source, None)
        self._begin_ns = time.monotonic_ns()
        self._closed = threading.Event()

    def read(self) -> Chunk | None:
        """The next record once its time has come; None until then. Raises EndOfInput."""
        if self._next is None:
            raise EndOfInput
        due_ns = self._begin_ns + round(self._next.due_ns / (self._speed or 1.0))
        if self._speed:
            wait_ns = due_ns - time.monotonic_ns()
            if wait_ns > 0:
                self._closed.wait(min(WAIT_S, wait_ns / SECOND_NS))
            if wait_ns > WAIT_S * SECOND_NS:
                return None
        chunk = Chunk(self._next.data, due_ns)
        self._next = next(self._source, None)
        return chunk

    def write(self, data: bytes) -> None:
        """A trace obeys nobody."""

    def close(self) -> None:
        """Stop waiting."""
        self._closed.set()

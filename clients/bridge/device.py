"""The device's thread: opens the port, reads it, and opens it again whenever it is lost."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from clients.backoff import Backoff
from clients.bridge.codec import SECOND_NS, Codec
from clients.bridge.detection import diagnose
from clients.bridge.device_state import DeviceState, DeviceWatch
from clients.bridge.errors import ConfigError, PortError
from clients.bridge.gaze import Gaze, GazePath
from clients.bridge.port import Chunk, EndOfInput, Port

SETTLE_NS = SECOND_NS // 10
"""Between two commands that start a device: what comes in between is of an earlier start."""
CHUNKS_KEPT = 4096
"""Chunks whose time is remembered: more than the longest record has bytes of."""


class Ears(NamedTuple):
    """Who is told what, all in the device's thread.

    Attributes:
        gaze: each gaze, and the sample's bytes on the line.
        chunk: each chunk before it is read.
        state: each new state, and why.
        complaint: why the codec cannot read what comes.
    """

    gaze: Callable[[Gaze], None]
    chunk: Callable[[Chunk], None]
    state: Callable[[DeviceState, str], None]
    complaint: Callable[[str], None]


class Device:
    """Reads a device until it is told to stop.

    Args:
        open_port: opens the port, by its name, anew at each try.
        codec: its protocol.
        path: from samples to gaze.
        ears: who is told.
        backoff: waits between tries.

    Attributes:
        error: why the thread has ended by itself: a setting that no retry will mend.
        beat_ns: when the thread was last seen alive.
    """

    def __init__(
        self, open_port: Callable[[], Port], codec: Codec, path: GazePath, ears: Ears, backoff: Backoff
    ) -> None:
        self._open_port = open_port
        self._codec = codec
        self._path = path
        self._ears = ears
        self._backoff = backoff
        self._watch = DeviceWatch(diagnose, ears.state)
        self._stop = threading.Event()
        self._arrivals: deque[tuple[int, int]] = deque(maxlen=CHUNKS_KEPT)
        self._position = 0
        self._complained: str | None = None
        self.error: ConfigError | None = None
        self.ended = threading.Event()
        self.opens = 0
        self.beat_ns = time.monotonic_ns()

    @property
    def state(self) -> DeviceState:
        """What is known of the device."""
        return self._watch.state

    def stop(self) -> None:
        """Have the thread end: it tells the device to stop and gives the port back."""
        self._stop.set()

    def run(self) -> None:
        """The thread's work."""
        why = "as asked"
        try:
            while not self._stop.is_set():
                self.beat_ns = time.monotonic_ns()
                try:
                    port = self._open_port()
                except PortError as error:
                    self._watch.failed(str(error))
                    self._wait(self._backoff.wait_s())
                    continue
                try:
                    self._serve(port)
                except PortError as error:
                    self._watch.failed(str(error))
                finally:
                    self._tell_missing(gone=True)
                    port.close()
                if not self._stop.is_set():
                    self._wait(self._backoff.wait_s())
        except EndOfInput:
            why = "played to the end"
        except ConfigError as error:
            self.error = error
        finally:
            self._watch.stopped(why)
            self.ended.set()

    def _wait(self, seconds: float) -> None:
        """Wait, but show that the thread lives."""
        end = time.monotonic() + seconds
        while not self._stop.is_set() and (left := end - time.monotonic()) > 0:
            self.beat_ns = time.monotonic_ns()
            self._stop.wait(min(left, 0.5))

    def _serve(self, port: Port) -> None:
        """Start the device and read it until it is lost or the thread has to end."""
        self.opens += 1
        self._watch.opened(time.monotonic_ns())
        self._codec.reset()
        self._path.restart()
        self._start(port)
        fresh = True
        while not self._stop.is_set():
            chunk = port.read()
            now_ns = self.beat_ns = time.monotonic_ns()
            if chunk is None:
                self._watch.waited(now_ns)
                self._tell_missing()
                if self._watch.start_again(now_ns):
                    self._codec.reset()
                    self._start(port)
                if port.stale_when_silent and self._watch.stale(now_ns):
                    raise PortError("nothing has come for 10 s: the connection may be dead")
            else:
                self._ears.chunk(chunk._replace(begins=True) if fresh else chunk)
                self._take(chunk, port, now_ns)
                fresh = False
            if due := self._codec.due(now_ns):
                port.write(due)
        if goodbye := self._codec.stop():
            port.write(goodbye)

    def _tell_missing(self, gone: bool = False) -> None:
        """No sample comes: after a while that is a lost eye, too."""
        gaze = self._path.missing(time.monotonic_ns(), gone)
        if gaze is not None:
            self._ears.gaze(gaze)

    def _start(self, port: Port) -> None:
        """Send what starts the device; throw away what comes between two commands."""
        for index, command in enumerate(self._codec.start()):
            if index > 0:
                end_ns = time.monotonic_ns() + SETTLE_NS
                while time.monotonic_ns() < end_ns and not self._stop.is_set():
                    port.read()
            port.write(command)

    def _take(self, chunk: Chunk, port: Port, now_ns: int) -> None:
        """Read a chunk."""
        if chunk.begins:
            self._codec.reset()
            self._path.restart()
        self._position += len(chunk.data)
        self._arrivals.append((self._position, chunk.arrival_ns))
        samples = self._codec.feed(chunk.data)
        self._watch.received(now_ns, chunk.data, len(samples))
        for sample in samples:
            first_ns = self._first_byte_ns(sample.first, port.byte_ns)
            self._ears.gaze(self._path.take(sample, first_ns, chunk.arrival_ns))
        if samples:
            self._backoff.good(now_ns)
        if self._codec.complaint != self._complained:
            self._complained = self._codec.complaint
            if self._complained is not None:
                self._ears.complaint(self._complained)

    def _first_byte_ns(self, first: int, byte_ns: float) -> int:
        """When the byte with that index began on the line: its chunk came when the chunk's last byte had ended."""
        arrivals = self._arrivals
        while len(arrivals) > 1 and arrivals[0][0] <= first:
            arrivals.popleft()
        end, arrival_ns = arrivals[0]
        return arrival_ns - round((end - first) * byte_ns)

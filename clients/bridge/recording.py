"""Recordings: every byte that a port gave, in the chunks in which it came, with the time of each.

A file is a line of JSON and then frames: length, arrival time [ns], kind, checksum of these and the bytes, the bytes.
A frame is whole or not there: after a crash the file is read up to the last whole one.
"""

from __future__ import annotations

import json
import os
import queue
import struct
import threading
import time
import zlib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from clients.bridge.codec import SECOND_NS
from clients.bridge.errors import ConfigError
from clients.bridge.port import WAIT_S, Chunk, EndOfInput

FORMAT = "gazetrace-recording-1"
LONGEST_HEADER = 64 << 10
HEAD = struct.Struct("<IqB")
CHECKSUM = struct.Struct("<I")
LONGEST_CHUNK = 1 << 20
GATHER_S = 0.1
"""Chunks are written so many seconds' worth at a time: a thread that woke for each would delay the one that reads."""
FLUSH_S = 1.0
"""A crash costs little more than the last second."""

DATA, BEGINS = 0, 1
"""Kinds: bytes that follow the ones before, and bytes of a port that was just opened."""


class Recorder:
    """Writes a recording in a thread of its own, so that a slow disk delays nobody.

    Args:
        path: a file that does not exist yet.
        about: what else to keep, such as the device's settings.

    Raises:
        ConfigError: if the file exists or cannot be made.
    """

    def __init__(self, path: Path, about: dict[str, Any]) -> None:
        try:
            self._file: BinaryIO = open(path, "xb")  # noqa: SIM115 (closed by close)
        except FileExistsError:
            raise ConfigError("record", "a file that does not exist yet", str(path)) from None
        except OSError as error:
            raise ConfigError("record", "a file that can be written", f"{path}: {error.strerror}") from None
        header = {"format": FORMAT, "monotonic_ns": time.monotonic_ns(), "unix_ns": time.time_ns(), **about}
        self._file.write(json.dumps(header).encode("ascii") + b"\n")
        self._file.flush()
        self._queue: queue.SimpleQueue[Chunk] = queue.SimpleQueue()
        self._closing = threading.Event()
        self.error: str | None = None
        self.bytes_written = 0
        self._thread = threading.Thread(target=self._write_all, name="recorder", daemon=True)
        self._thread.start()

    def keep(self, chunk: Chunk) -> None:
        """Have a chunk written, unless the recording has ended by an error; returns at once."""
        if self.error is None:
            self._queue.put(chunk)

    @property
    def waiting(self) -> int:
        """Chunks that are not written yet."""
        return self._queue.qsize()

    def close(self) -> None:
        """Write what waits, and close the file."""
        self._closing.set()
        self._thread.join()

    def _write_all(self) -> None:
        try:
            self._write_until_closed()
        except OSError as error:
            self.error = f"the recording has ended: {error.strerror}"
        finally:
            with suppress(OSError):
                self._file.close()

    def _write_until_closed(self) -> None:
        flushed, closing = time.monotonic(), False
        while not closing:
            closing = self._closing.wait(GATHER_S)
            self._write_waiting()
            if time.monotonic() - flushed >= FLUSH_S:
                self._file.flush()
                flushed = time.monotonic()
        self._file.flush()
        os.fsync(self._file.fileno())

    def _write_waiting(self) -> None:
        with suppress(queue.Empty):
            while True:
                chunk = self._queue.get_nowait()
                self._file.write(framed(chunk))
                self.bytes_written += len(chunk.data)


class Recording(NamedTuple):
    """What a file holds.

    Attributes:
        about: its first line.
        chunks: in order.
        torn: bytes after the last whole frame; above 0 after a crash.
    """

    about: dict[str, Any]
    chunks: list[Chunk]
    torn: int


def framed(chunk: Chunk) -> bytes:
    """A chunk as it is written."""
    head = HEAD.pack(len(chunk.data), chunk.arrival_ns, BEGINS if chunk.begins else DATA)
    return head + CHECKSUM.pack(zlib.crc32(chunk.data, zlib.crc32(head))) + chunk.data


def read_recording(path: Path) -> Recording:
    """The recording in a file.

    Raises:
        ConfigError: naming the file, if it cannot be read or is something else.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ConfigError("replay", "a file that can be read", f"{path}: {error.strerror}") from None
    line, _, _ = data[:LONGEST_HEADER].partition(b"\n")
    try:
        about = json.loads(line)
        if about["format"] != FORMAT:
            raise ValueError(about["format"])
    except (ValueError, KeyError, TypeError):
        raise ConfigError("replay", f"a recording that begins with {FORMAT}", str(path)) from None
    chunks = list(_chunks(data, len(line) + 1))
    whole = len(line) + 1 + sum(HEAD.size + CHECKSUM.size + len(chunk.data) for chunk in chunks)
    return Recording(about, chunks, max(0, len(data) - whole))


def _chunks(data: bytes, at: int) -> Iterator[Chunk]:
    while at + HEAD.size + CHECKSUM.size <= len(data):
        size, arrival_ns, kind = HEAD.unpack_from(data, at)
        begin = at + HEAD.size + CHECKSUM.size
        if size > LONGEST_CHUNK or begin + size > len(data):
            return
        (checksum,) = CHECKSUM.unpack_from(data, at + HEAD.size)
        body = data[begin : begin + size]
        if zlib.crc32(body, zlib.crc32(data[at : at + HEAD.size])) != checksum:
            return
        yield Chunk(body, arrival_ns, kind == BEGINS)
        at = begin + size


class ReplayPort:
    """A recording as a port: the same bytes in the same chunks.

    Args:
        recording: what to play.
        speed: 1 as it was, 2 twice as fast, 0 as fast as possible. Times between arrivals shrink in the same way;
            at 0 they stay as they were, counted from now.
        loop: whether to begin again at the end.
    """

    byte_ns = 0.0
    stale_when_silent = False

    def __init__(self, recording: Recording, speed: float = 1.0, loop: bool = False) -> None:
        self._chunks = recording.chunks
        self._speed = speed
        self._loop = loop
        self._next = 0
        self._begin_ns = time.monotonic_ns()
        self._closed = threading.Event()

    def read(self) -> Chunk | None:
        """The next chunk once its time has come; None until then. Raises EndOfInput."""
        if self._next == len(self._chunks):
            if not self._loop or not self._chunks:
                raise EndOfInput
            self._next, self._begin_ns = 0, time.monotonic_ns()
        chunk = self._chunks[self._next]
        due_ns = self._begin_ns + round((chunk.arrival_ns - self._chunks[0].arrival_ns) / (self._speed or 1.0))
        if self._speed:
            wait_ns = due_ns - time.monotonic_ns()
            if wait_ns > 0:
                self._closed.wait(min(WAIT_S, wait_ns / SECOND_NS))
            if wait_ns > WAIT_S * SECOND_NS:
                return None
        self._next += 1
        return Chunk(chunk.data, due_ns, chunk.begins or self._next == 1)

    def write(self, data: bytes) -> None:
        """Nobody is there to read it."""

    def close(self) -> None:
        """Stop waiting."""
        self._closed.set()

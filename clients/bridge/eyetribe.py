"""The Eye Tribe: JSON over TCP, port 6555, with a sign of life that the server waits for."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any, ClassVar

from clients.bridge.codec import LONGEST_RECORD, MILLISECOND_NS, Codec
from clients.bridge.sample import Point, Sample, seen

PUSH = b'{"category":"tracker","request":"set","values":{"push":true,"version":1}}\n'
ASK_INTERVAL = b'{"category":"tracker","request":"get","values":["heartbeatinterval"]}\n'
NO_PUSH = b'{"category":"tracker","request":"set","values":{"push":false,"version":1}}\n'
HEARTBEAT = b'{"category":"heartbeat"}\n'
BEGIN = re.compile(rb'\{\s*"category"')
FIRST_INTERVAL_NS = 250 * MILLISECOND_NS
"""Until the server has said its own."""
LOST_BITS = 0x8 | 0x10
"""State: tracking failed, tracking lost."""


class EyeTribe(Codec):
    """The Eye Tribe tracker. Points are `raw`; `avg` is smoothed and lags."""

    name = "eyetribe"
    unit = "px"
    binocular: ClassVar[bool] = True
    ticks_ns = (MILLISECOND_NS,)

    def __init__(self) -> None:
        super().__init__()
        self._pending = bytearray()
        self._position = 0
        self._interval_ns = FIRST_INTERVAL_NS
        self._beat_ns: int | None = None

    def start(self) -> tuple[bytes, ...]:
        """Have frames pushed, and ask how often the server wants a sign of life."""
        return (PUSH + ASK_INTERVAL,)

    def stop(self) -> bytes:
        """End the push."""
        return NO_PUSH

    def due(self, now_ns: int) -> bytes:
        """The sign of life."""
        if self._beat_ns is not None and now_ns - self._beat_ns < self._interval_ns:
            return b""
        self._beat_ns = now_ns
        return HEARTBEAT

    def reset(self) -> None:
        """Forget a half message."""
        self._drop(len(self._pending))
        self._beat_ns = None

    def feed(self, data: bytes) -> list[Sample]:
        """The samples of the messages that `data` completes."""
        self._pending += data
        samples = []
        while (begin := BEGIN.search(self._pending)) is not None:
            self._drop(begin.start())
            another = BEGIN.search(self._pending, 1)
            end = _end_of_object(self._pending, len(self._pending) if another is None else another.start())
            if end is None and another is None:
                break
            if end is None:
                self.bad += 1
                self._drop(another.start() if another is not None else 1)
                continue
            sample = self._read(bytes(self._pending[:end]))
            self._drop(end)
            if sample is not None:
                samples.append(sample)
        if len(self._pending) > LONGEST_RECORD:
            self.bad += 1
            self._drop(len(self._pending))
        return samples

    def encode(self, time_ns: int, point: Point | None) -> bytes:
        """A pushed frame with both eyes on one point."""
        x, y = point or (0.0, 0.0)
        at = {"x": round(x, 4), "y": round(y, 4)}
        eye = {"avg": at, "raw": at, "psize": 0.0, "pcenter": {"x": 0.0, "y": 0.0}}
        state = 0x10 if point is None else 0x1 | 0x2 | 0x4
        frame = {"time": time_ns // MILLISECOND_NS, "state": state, "fix": False, "avg": at, "raw": at}
        frame |= {"lefteye": eye, "righteye": eye}
        message = {"category": "tracker", "request": "get", "statuscode": 200, "values": {"frame": frame}}
        return json.dumps(message, separators=(",", ":")).encode("ascii") + b"\n"

    def _read(self, message: bytes) -> Sample | None:
        """The sample of a message; None where it holds none."""
        try:
            values = json.loads(message).get("values", {})
            frame = values.get("frame") if isinstance(values, dict) else None
            if frame is None:
                interval_ms = values.get("heartbeatinterval") if isinstance(values, dict) else None
                if isinstance(interval_ms, int) and interval_ms > 0:
                    self._interval_ns = interval_ms * MILLISECOND_NS // 2
                return None
            lost = bool(int(frame["state"]) & LOST_BITS)
            left, right, both = (
                None if lost else _point(eye["raw"]) for eye in (frame["lefteye"], frame["righteye"], frame)
            )
            ticks = float(frame["time"])
        except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
            self.bad += 1
            return None
        return Sample(self._position, len(message), ticks, left, right, both)

    def _drop(self, size: int) -> None:
        del self._pending[:size]
        self._position += size


def _point(at: Mapping[str, Any]) -> Point | None:
    return seen(float(at["x"]), float(at["y"]))


def _end_of_object(data: bytearray, limit: int) -> int | None:
    """Where the object at the beginning of `data` ends, if it does so before `limit`."""
    depth = 0
    for match in BRACE_OR_STRING.finditer(data, 0, limit):
        if match[0] == b"{":
            depth += 1
        elif match[0] == b"}":
            depth -= 1
            if depth == 0:
                return match.end()
    return None


BRACE_OR_STRING = re.compile(rb'"(?:[^"\\]|\\.)*"|[{}]')

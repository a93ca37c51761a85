"""How the bridge does, in numbers, over the last few seconds."""

from __future__ import annotations

import threading
from collections.abc import Sequence

from clients.bridge.codec import MILLISECOND_NS, SECOND_NS

BUSY_SHARE = 0.8
"""Above this share of what a line can carry, records begin to queue in the device."""


class Meter:
    """Counts samples and bytes.

    Args:
        now_ns: a monotonic clock [ns].
    """

    def __init__(self, now_ns: int) -> None:
        self._lock = threading.Lock()
        self._since_ns = now_ns
        self._samples = 0
        self._valid = 0
        self._bytes = 0
        self._intervals: list[int] = []
        self._last_captured_ns: int | None = None
        self._last_received_ns: int | None = None

    def sample(self, valid: bool, captured_ns: int, received_ns: int) -> None:
        """Count a sample."""
        with self._lock:
            self._samples += 1
            self._valid += valid
            if self._last_captured_ns is not None:
                self._intervals.append(captured_ns - self._last_captured_ns)
            self._last_captured_ns, self._last_received_ns = captured_ns, received_ns

    def received(self, size: int) -> None:
        """Count bytes."""
        with self._lock:
            self._bytes += size

    def report(self, now_ns: int, byte_ns: float) -> dict[str, float | None]:
        """What went through since the last report.

        Args:
            now_ns: the same clock.
            byte_ns: how long a byte takes on the line [ns]; 0 where there is no line.
        """
        with self._lock:
            seconds = max(now_ns - self._since_ns, 1) / SECOND_NS
            record: dict[str, float | None] = {
                "rate_hz": round(self._samples / seconds, 1),
                "interval_ms_p50": in_ms(percentile(self._intervals, 50)),
                "interval_ms_p99": in_ms(percentile(self._intervals, 99)),
                "valid_percent": round(100 * self._valid / self._samples, 1) if self._samples else None,
                "bytes_per_s": round(self._bytes / seconds),
                "line_load_percent": round(100 * self._bytes * byte_ns / (seconds * SECOND_NS), 1) if byte_ns else None,
                "age_ms": None if self._last_received_ns is None else in_ms(now_ns - self._last_received_ns),
            }
            self._since_ns, self._samples, self._valid, self._bytes = now_ns, 0, 0, 0
            self._intervals.clear()
            return record


def percentile(values: Sequence[int], percent: float) -> int | None:
    """The value that `percent` of the values do not exceed; None for none."""
    if not values:
        return None
    return sorted(values)[min(len(values) - 1, int(len(values) * percent / 100))]


def in_ms(nanoseconds: int | None) -> float | None:
    """The same in milliseconds, to a microsecond."""
    return None if nanoseconds is None else round(nanoseconds / MILLISECOND_NS, 3)

"""When the eye was where a record says: the device's clock mapped on ours, and ours on the service's.

A record reaches us late, never early, so of all delays seen the smallest ones tell how the clocks stand to each other:
the line below all points (device time, arrival minus device time) that lies closest to them, which is the edge of
their lower convex hull over the mean time (Moon, Skelly and Towsley 1999, "Estimation and removal of clock skew from
network delay measurements", INFOCOM).
"""

from __future__ import annotations

import math
from collections import deque
from itertools import pairwise
from statistics import median
from typing import NamedTuple

from clients.bridge.codec import MILLISECOND_NS, SECOND_NS

WINDOW_BUCKETS = 30
BUCKET_NS = SECOND_NS
"""Of each second the sample with the least delay is kept, for half a minute."""

LEAST_SPAN_NS = 10 * SECOND_NS
"""Over less time jitter would pass for drift, so none is assumed."""

MOST_DRIFT = 5e-4
"""Quartz clocks differ by less than 500 parts in a million."""

JUMP_NS = 5 * MILLISECOND_NS
"""A device time this much later than the clocks allow is a damaged record or a clock that was set."""
JUMPS_IN_A_ROW = 3
"""So many samples make it a clock that was set."""

TICK_SAMPLES = 16
TICK_SPAN_NS = SECOND_NS // 2
"""How much is looked at before the length of a tick is decided."""


class CaptureTime(NamedTuple):
    """Times of a sample.

    Attributes:
        tracker_time_ns: by the device's clock; None without one, or while the length of its ticks is not known.
        captured_ns: estimate by our monotonic clock.
    """

    tracker_time_ns: int | None
    captured_ns: int


class DeviceClock:
    """Maps a device's clock on ours.

    Args:
        ticks_ns: how long a tick may be [ns]: none for a device without a clock; of several, the rate decides.
        wrap: ticks after which the device starts from 0 again.
        latency_ns: what passes in the device between the eye's movement and its first byte.
    """

    def __init__(self, ticks_ns: tuple[float, ...], wrap: int | None = None, latency_ns: int = 0) -> None:
        self._candidates = ticks_ns
        self._wrap = wrap
        self._latency_ns = latency_ns
        self.restarts = 0
        self._minima: deque[tuple[int, int]] = deque(maxlen=WINDOW_BUCKETS)
        self._last_ns: int | None = None
        self._last_ticks: float | None = None
        self._jumps = 0
        self._wraps = 0
        self._seen: list[tuple[float, int]] = []
        self.restart()

    def restart(self) -> None:
        """Forget all: the device may have been switched on anew."""
        self._tick_ns = self._candidates[0] if len(self._candidates) == 1 else None
        self._seen.clear()
        self._wraps = 0
        self._last_ticks = None
        self._begin()

    def map(self, ticks: float | None, arrival_ns: int) -> CaptureTime:
        """The times of a sample.

        Args:
            ticks: the device's time; None if the record has none.
            arrival_ns: when its first byte began, by our monotonic clock.
        """
        tick_ns = None if ticks is None else self._tick_length(ticks, arrival_ns)
        if ticks is None or tick_ns is None:
            return CaptureTime(None, arrival_ns - self._latency_ns)
        device_ns = round(self._unwrapped(ticks) * tick_ns)
        if self._last_ns is not None and self._jumped(device_ns, arrival_ns):
            self._jumps += 1
            if self._jumps < JUMPS_IN_A_ROW:
                return CaptureTime(None, arrival_ns - self._latency_ns)
            self.restarts += 1
            self._begin()
        self._jumps = 0
        self._last_ns = device_ns
        self._learn(device_ns, arrival_ns - device_ns)
        captured = device_ns + self.offset_ns(device_ns)
        return CaptureTime(device_ns, min(captured, arrival_ns) - self._latency_ns)

    def offset_ns(self, device_ns: int) -> int:
        """Our clock minus the device's at that time of the device, without delay [ns]."""
        return round(self._offset + self.drift * (device_ns - self._origin))

    def _begin(self) -> None:
        """Start the fit anew."""
        self._minima.clear()
        self._last_ns = None
        self._jumps = 0
        self._origin = 0
        self._offset = math.inf
        self.drift = 0.0

    def _tick_length(self, ticks: float, arrival_ns: int) -> float | None:
        """How long a tick is: given, or the candidate nearest to what the arrivals say."""
        if self._tick_ns is not None or not self._candidates:
            return self._tick_ns
        self._seen.append((ticks, arrival_ns))
        span_ns = arrival_ns - self._seen[0][1]
        if len(self._seen) < TICK_SAMPLES or span_ns < TICK_SPAN_NS:
            return None
        step = median(after[0] - before[0] for before, after in pairwise(self._seen))
        if step > 0:
            measured = math.log(span_ns / (len(self._seen) - 1) / step)
            self._tick_ns = min(self._candidates, key=lambda tick_ns: abs(math.log(tick_ns) - measured))
        self._seen.clear()
        return self._tick_ns

    def _unwrapped(self, ticks: float) -> float:
        """Ticks since the counter's first turn."""
        if self._wrap is not None:
            if self._last_ticks is not None and ticks < self._last_ticks - self._wrap / 2:
                self._wraps += 1
            self._last_ticks = ticks
            ticks += self._wraps * self._wrap
        return ticks

    def _jumped(self, device_ns: int, arrival_ns: int) -> bool:
        assert self._last_ns is not None
        return device_ns < self._last_ns or arrival_ns - device_ns < self.offset_ns(device_ns) - JUMP_NS

    def _learn(self, device_ns: int, offset: int) -> None:
        """Take a delay into account: at once where it is the smallest, into the fit once a second."""
        minima = self._minima
        if not minima or device_ns - minima[-1][0] // BUCKET_NS * BUCKET_NS >= BUCKET_NS:
            if minima:
                self._fit()
            minima.append((device_ns, offset))
        elif offset < minima[-1][1]:
            minima[-1] = (device_ns, offset)
        if self._offset == math.inf:
            self._origin, self._offset = device_ns, offset
        below = self.offset_ns(device_ns) - offset
        if below > 0:
            self._offset -= below

    def _fit(self) -> None:
        """The line below the minima."""
        hull = lower_hull(list(self._minima))
        span_ns = hull[-1][0] - hull[0][0]
        middle = sum(at for at, _ in self._minima) / len(self._minima)
        if span_ns < LEAST_SPAN_NS:
            self.drift = 0.0
        else:
            (t0, o0), (t1, o1) = next(edge for edge in pairwise(hull) if edge[1][0] >= middle)
            self.drift = min(max((o1 - o0) / (t1 - t0), -MOST_DRIFT), MOST_DRIFT)
        self._origin = round(middle)
        self._offset = min(offset - self.drift * (at - middle) for at, offset in self._minima)


def lower_hull(points: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """The lower convex hull of points in order of their first coordinate, from the first to the last."""
    hull: list[tuple[int, int]] = []
    for x, y in points:
        while len(hull) > 1:
            (x0, y0), (x1, y1) = hull[-2:]
            if (x1 - x0) * (y - y0) > (y1 - y0) * (x - x0):
                break
            hull.pop()
        hull.append((x, y))
    return hull

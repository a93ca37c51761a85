"""A low-pass filter that lets fast movements through: the One-Euro filter (Casiez, Roussel and Vogel 2012, CHI)."""

from __future__ import annotations

import math

from clients.bridge.codec import SECOND_NS
from clients.bridge.sample import Point

CUTOFF_HZ = 1.0
BETA = 1.0
"""Cut-off gained for each degree a second; with 0 the eye would be 12 deg behind after a saccade."""
SPEED_CUTOFF_HZ = 1.0
LONGEST_GAP = 5
"""After a gap of more intervals than this the past says nothing."""


class OneEuro:
    """Smooths angles [deg]. Units matter: `beta` is in Hz for each deg/s."""

    def __init__(
        self, cutoff_hz: float = CUTOFF_HZ, beta: float = BETA, speed_cutoff_hz: float = SPEED_CUTOFF_HZ
    ) -> None:
        self._cutoff_hz, self._beta, self._speed_cutoff_hz = cutoff_hz, beta, speed_cutoff_hz
        self.reset()

    def reset(self) -> None:
        """Forget the past: the eye was lost, or jumped."""
        self._time_ns: int | None = None
        self._interval_ns: int | None = None
        self._at = Point(0.0, 0.0)
        self._raw = Point(0.0, 0.0)
        self._speed = Point(0.0, 0.0)

    def update(self, time_ns: int, at_deg: Point) -> Point:
        """The smoothed point.

        Args:
            time_ns: when the eye was there; not before the last one.
            at_deg: angles [deg].
        """
        if self._time_ns is None:
            return self._start(time_ns, at_deg)
        gap = time_ns - self._time_ns
        if gap <= 0:
            return self._at
        if self._interval_ns is not None and gap > LONGEST_GAP * self._interval_ns:
            return self._start(time_ns, at_deg)
        seconds = gap / SECOND_NS
        self._interval_ns = gap
        moved = (self._filter(axis, at_deg[axis], seconds) for axis in (0, 1))
        (x, dx), (y, dy) = moved
        self._time_ns, self._at, self._raw, self._speed = time_ns, Point(x, y), at_deg, Point(dx, dy)
        return self._at

    def _start(self, time_ns: int, at_deg: Point) -> Point:
        self.reset()
        self._time_ns, self._at, self._raw = time_ns, at_deg, at_deg
        return at_deg

    def _filter(self, axis: int, value: float, seconds: float) -> tuple[float, float]:
        """The smoothed value and speed along one axis."""
        speed = (value - self._at[axis]) / seconds
        speed = _blend(self._speed[axis], speed, self._speed_cutoff_hz, seconds)
        return _blend(self._at[axis], value, self._cutoff_hz + self._beta * abs(speed), seconds), speed


def _blend(before: float, now: float, cutoff_hz: float, seconds: float) -> float:
    """One step of an exponential filter with that cut-off."""
    time_constant_s = 1 / (2 * math.pi * cutoff_hz)
    return before + (now - before) / (1 + time_constant_s / seconds)

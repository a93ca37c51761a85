"""Saccades as they happen: the eye is faster than a threshold that suits the sampling rate.

Velocity-threshold identification (Salvucci and Goldberg 2000, "Identifying fixations and saccades in eye-tracking
protocols"), online: velocity is taken over at least 4 ms, so that noise is not amplified at high rates.
"""

from __future__ import annotations

import math
from collections import deque

from clients.bridge.codec import MILLISECOND_NS, SECOND_NS
from clients.bridge.sample import Point

BASELINE_NS = 4 * MILLISECOND_NS
"""Least time between the two samples that give a velocity."""

TOLERANCE_NS = MILLISECOND_NS // 2
"""Sampling times jitter: 3.9 ms are 4 ms."""

FAST_DEG_S, SLOW_DEG_S = 70.0, 30.0
"""Thresholds from 100 Hz up, and below, where a short saccade's velocity is averaged with rest."""
FAST_FROM_HZ = 100.0

CONFIRM_FROM_HZ = 400.0
"""From here up two samples in a row have to be fast: single ones are noise."""

END_SHARE = 0.5
"""A saccade has ended when the eye is slower than this share of the threshold."""

LONGEST_GAP_NS = 100 * MILLISECOND_NS
"""Across a longer gap there is no velocity."""

RATE_WEIGHT = 0.05
"""How much a new interval counts for the mean one."""


class SaccadeDetector:
    """Whether the eye is in a saccade.

    Args:
        threshold_deg_s: velocity above which it is [deg/s]; None for the one that suits the rate.
    """

    def __init__(self, threshold_deg_s: float | None = None) -> None:
        self._given = threshold_deg_s
        self._interval_ns: float | None = None
        self.reset()

    def reset(self) -> None:
        """Forget where the eye was: it was lost."""
        self._past: deque[tuple[int, Point]] = deque()
        self._fast = 0
        self.moving = False

    @property
    def threshold_deg_s(self) -> float:
        """The threshold now in force [deg/s]."""
        if self._given is not None:
            return self._given
        return FAST_DEG_S if self.rate_hz >= FAST_FROM_HZ else SLOW_DEG_S

    @property
    def rate_hz(self) -> float:
        """Samples a second, by their times; infinite before there were two."""
        return SECOND_NS / self._interval_ns if self._interval_ns else math.inf

    def update(self, time_ns: int, at_deg: Point) -> bool:
        """Whether the eye is in a saccade now.

        Args:
            time_ns: when the eye was there; not before the last one.
            at_deg: angles from the screen's middle [deg].
        """
        past = self._past
        if past:
            gap = time_ns - past[-1][0]
            if gap <= 0:
                return self.moving
            if gap > LONGEST_GAP_NS:
                self.reset()
                past = self._past
            else:
                mean = self._interval_ns if self._interval_ns is not None else float(gap)
                self._interval_ns = mean + RATE_WEIGHT * (gap - mean)
        past.append((time_ns, at_deg))
        while len(past) > 2 and time_ns - past[1][0] >= BASELINE_NS - TOLERANCE_NS:
            past.popleft()
        since, before = past[0]
        elapsed = time_ns - since
        if elapsed >= BASELINE_NS - TOLERANCE_NS:
            self._judge(math.dist(at_deg, before) / elapsed * SECOND_NS)
        return self.moving

    def _judge(self, velocity_deg_s: float) -> None:
        if velocity_deg_s > self.threshold_deg_s:
            self._fast += 1
            self.moving = self.moving or self._fast >= (2 if self.rate_hz >= CONFIRM_FROM_HZ else 1)
        elif self.moving and velocity_deg_s > END_SHARE * self.threshold_deg_s:
            self._fast = 0
        else:
            self._fast, self.moving = 0, False

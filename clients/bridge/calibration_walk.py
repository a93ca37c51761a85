"""Nine points, one after the other: show a target, wait for the eye, take what the tracker says of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum

import numpy as np

from clients.bridge.calibration import Pair
from clients.bridge.codec import MILLISECOND_NS, SECOND_NS
from clients.bridge.sample import Point

NINE_POINTS = tuple(Point(x, y) for y in (0.1, 0.5, 0.9) for x in (0.1, 0.5, 0.9))
"""Where targets are shown, in fractions of the screen."""

ARRIVE_NS = 800 * MILLISECOND_NS
"""The eye needs 200 ms to react and some more to find the target."""
LOOK_NS = 700 * MILLISECOND_NS
"""How long its gaze is collected."""
PATIENCE_NS = 10 * SECOND_NS
"""A target without enough gaze for so long ends the walk."""
LEAST_SAMPLES = 15
OUTLIER_SPREADS = 3.0
"""Samples further from the median than so many median deviations are blinks and glances elsewhere."""


class WalkState(StrEnum):
    """Where the walk is."""

    WALKING = "walking"
    DONE = "done"
    FAILED = "failed"


class CalibrationWalk:
    """Collects what is measured at each target.

    Args:
        targets: where they are shown, in fractions of the screen.
        arrive_ns: how long the eye may take to get there.
        look_ns: how long its gaze is collected then.

    Attributes:
        state: where it is.
        index: the target shown now.
        pairs: of the targets already done.
    """

    def __init__(
        self, targets: Sequence[Point] = NINE_POINTS, arrive_ns: int = ARRIVE_NS, look_ns: int = LOOK_NS
    ) -> None:
        self.targets = tuple(targets)
        self._arrive_ns, self._look_ns = arrive_ns, look_ns
        self.state = WalkState.WALKING
        self.index = 0
        self.pairs: list[Pair] = []
        self._shown_ns: int | None = None
        self._collect_from_ns = 0
        self._measured: list[Point] = []

    @property
    def target(self) -> Point:
        """The target shown now."""
        return self.targets[self.index]

    def step(self, now_ns: int, measured: Point | None) -> bool:
        """Take a sample into account; whether another target has to be shown, or none any more.

        Args:
            now_ns: a monotonic clock [ns].
            measured: what the tracker said, not calibrated; None where the eye is lost.
        """
        if self.state is not WalkState.WALKING:
            return False
        if self._shown_ns is None:
            self._show(now_ns)
            return True
        if measured is not None and now_ns >= self._collect_from_ns:
            self._measured.append(measured)
        if len(self._measured) >= LEAST_SAMPLES and now_ns >= self._collect_from_ns + self._look_ns:
            self.pairs.append(Pair(middle_of(self._measured), self.target))
            if self.index + 1 == len(self.targets):
                self.state = WalkState.DONE
            else:
                self.index += 1
                self._show(now_ns)
            return True
        if now_ns - self._shown_ns > PATIENCE_NS:
            self.state = WalkState.FAILED
            return True
        return False

    def _show(self, now_ns: int) -> None:
        self._shown_ns = now_ns
        self._collect_from_ns = now_ns + self._arrive_ns
        self._measured = []


def middle_of(points: Sequence[Point]) -> Point:
    """The mean of the points that lie near their median."""
    array = np.array(points, dtype=np.float64)
    distance = np.abs(array - np.median(array, axis=0)).max(axis=1)
    near = distance <= OUTLIER_SPREADS * max(float(np.median(distance)), math.ulp(1.0))
    x, y = array[near].mean(axis=0)
    return Point(float(x), float(y))

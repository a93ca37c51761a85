"""What a tracker said about one moment, in the tracker's own units."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import NamedTuple

MISSING = -32768.0
"""The code that EyeLink and 16-bit devices send where there is no value."""


class Point(NamedTuple):
    """A place in the device's own unit and origin."""

    x: float
    y: float


class Sample(NamedTuple):
    """One record of a tracker.

    Attributes:
        first: index of its first byte in the stream.
        size: its bytes on the line.
        ticks: the device's time, in ticks of the device's clock; None where it has none.
        left: where the left eye looks; None where it is lost or not measured.
        right: the same for the right eye.
        both: the point that the device itself makes of its eyes, or its only one; None where lost or not made.
    """

    first: int
    size: int
    ticks: float | None = None
    left: Point | None = None
    right: Point | None = None
    both: Point | None = None


class Eye(StrEnum):
    """Which eye's gaze counts."""

    BEST = "best"
    """The device's own point, else the mean of both eyes, else the one that is seen."""
    LEFT = "left"
    RIGHT = "right"
    AVERAGE = "average"
    """The mean, only while both eyes are seen."""


def seen(x: float, y: float) -> Point | None:
    """The point, or None where the numbers say that the eye is lost: not finite, a code, or exactly (0, 0)."""
    if not (math.isfinite(x) and math.isfinite(y)) or MISSING in (x, y) or x == y == 0:
        return None
    return Point(x, y)


def gaze_of(sample: Sample, eye: Eye) -> Point | None:
    """The point of the eye that counts, or None where it is lost."""
    if eye is Eye.LEFT:
        return sample.left
    if eye is Eye.RIGHT:
        return sample.right
    if eye is Eye.BEST and sample.both is not None:
        return sample.both
    left, right = sample.left, sample.right
    if left is not None and right is not None:
        return Point((left.x + right.x) / 2, (left.y + right.y) / 2)
    return (left or right) if eye is Eye.BEST else None

"""Hysteresis of the gaze: a bucket is kept until the gaze has left it for good, so that frames do not flicker.

Pure functions of the bucket that was rendered for and of the gaze.
"""

from __future__ import annotations

import math

from renderer.gaze import Gaze, GazeBucket, bucket_of

SLACK = 0.25
"""How far, in sides of a bucket, a gaze may leave its bucket before another takes over."""


def steady_bucket(before: GazeBucket | None, gaze: Gaze, side_px: int) -> GazeBucket:
    """The bucket to render for: the one before, until the gaze has left it by more than `slack_px`."""
    if before is not None and before.side_px == side_px > 0:
        reach = side_px / 2 + slack_px(side_px)
        if abs(gaze.x - before.x) <= reach and abs(gaze.y - before.y) <= reach:
            return before
    return bucket_of(gaze, side_px)


def slack_px(side_px: int) -> float:
    """How far a gaze may be from the bucket that is rendered for [px]."""
    return SLACK * side_px


def slack_deg(side_px: int, pitch_cm: float, distance_cm: float) -> float:
    """The largest angle that `slack_px` can be, with pixels of `pitch_cm` (the longer side) [deg].

    In both directions at once, in front of the eye, where it is largest. A map with this margin is fine
    enough for every gaze that `steady_bucket` keeps.
    """
    return math.degrees(math.atan(math.sqrt(2.0) * slack_px(side_px) * pitch_cm / distance_cm))


def within(bucket: GazeBucket, gaze: Gaze) -> Gaze:
    """The point of the bucket nearest to the gaze."""
    if bucket.side_px == 0:
        return gaze
    half = bucket.side_px / 2
    return Gaze(_clamped(gaze.x, bucket.x, half), _clamped(gaze.y, bucket.y, half))


def _clamped(value: float, centre: float, half: float) -> float:
    """`value` in the half-open interval of a bucket."""
    return min(max(value, centre - half), math.nextafter(centre + half, -math.inf))

"""From raw gaze to something worth rendering for: holds through blinks, knows saccades, does not flicker.

Pure functions of what was known, what came in, and the time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from renderer.gaze import Gaze, GazeBucket, bucket_of
from service import protocol
from service.protocol import GazeState

NS_PER_MS = 1_000_000

HOLD_NS = 600 * NS_PER_MS
"""How long an invalid gaze keeps the last good one: longer than any blink."""

LONGEST_SACCADE_NS = 150 * NS_PER_MS
"""A saccade whose landing nobody reported has landed by then: 2.2 ms/deg + 21 ms is 109 ms for 40 deg."""

SLACK = 0.25
"""How far, in sides of a bucket, a gaze may leave its bucket before another takes over."""


@dataclass(frozen=True, slots=True)
class Attention:
    """What is known of the eye.

    Attributes:
        state: `none` yet; `live`; `held`: invalid for up to `HOLD_NS`; `lost`: for longer.
        sample: the newest good gaze; None where there was none.
        received_ns: when it came in.
        since_ns: when the state began, where it is `held` or `lost`.
        saccade: whether the eye is on its way, and sees little.
    """

    state: GazeState = "none"
    sample: protocol.Gaze | None = None
    received_ns: int = 0
    since_ns: int = 0
    saccade: bool = False


def observe(before: Attention, sample: protocol.Gaze, received_ns: int) -> Attention:
    """What is known after one more sample."""
    if sample.valid and sample.phase != "blink":
        return Attention("live", sample, received_ns, received_ns, saccade=sample.phase == "saccade")
    if before.state == "live":
        return replace(before, state="held", since_ns=received_ns, saccade=False)
    return elapse(before, received_ns)


def elapse(before: Attention, now_ns: int) -> Attention:
    """What is known after some time without a sample."""
    if before.state == "held" and now_ns - before.since_ns >= HOLD_NS:
        return replace(before, state="lost")
    if before.saccade and now_ns - before.received_ns >= LONGEST_SACCADE_NS:
        return replace(before, saccade=False)
    return before


def next_change_ns(attention: Attention) -> int | None:
    """When time alone will change what is known; None for never."""
    if attention.state == "held":
        return attention.since_ns + HOLD_NS
    return attention.received_ns + LONGEST_SACCADE_NS if attention.saccade else None


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

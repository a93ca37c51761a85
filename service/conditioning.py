"""From raw gaze to something worth rendering for: holds through blinks, knows saccades.

Pure functions of what was known, what came in, and the time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from service import protocol
from service.protocol import GazeState

NS_PER_MS = 1_000_000

HOLD_NS = 600 * NS_PER_MS
"""How long an invalid gaze keeps the last good one: longer than any blink."""

LONGEST_SACCADE_NS = 150 * NS_PER_MS
"""A saccade whose landing nobody reported has landed by then: 2.2 ms/deg + 21 ms is 109 ms for 40 deg."""


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

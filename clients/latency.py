"""From gaze to frame: how long it takes until an eye that has moved sees a picture made for where it is, and why.

The loop is closed by the client: a frame names the gaze it was made for, the client knows when it sent that gaze, and
the moment a frame is decoded ends the wait. Times of the service are mapped on the client's clock, so that the stages
add up to the whole.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Sequence
from typing import Final

from clients.display import DisplayFrame
from service.protocol import FrameHeader

STAGES: Final = ("send", "wait", "map", "trace", "reconstruct", "encode", "other", "hold", "transfer", "decode")
"""Gaze on its way to the service; waiting for its turn; the four stages of a frame; what else rendering takes; waiting
for the frame before to be acknowledged; on its way back; decoding."""

PERCENTILES: Final = {"p50": 50.0, "p95": 95.0, "p99": 99.0, "max": 100.0}
NOTICED_MS: Final = (50, 70)
"""Latencies up to 50 to 70 ms are tolerated (Albert et al. 2017)."""

NS_PER_MS: Final = 1e6
NS_PER_S: Final = 1_000_000_000


def stage_times(frame: DisplayFrame, looked_ns: int, offset_ns: int) -> dict[str, float]:
    """Milliseconds of each of `STAGES` for a frame, which add up to the time from gaze to frame.

    Args:
        frame: made for a gaze.
        looked_ns: when that gaze was handed over to be sent, by our clock.
        offset_ns: the service's clock minus ours.
    """
    times, stages = frame.header.service_time_ns, frame.header.timing_ms
    inside = {name: float(stages.get(name, 0.0)) for name in ("map", "trace", "reconstruct", "encode")}
    moments = (looked_ns, times.gaze_received - offset_ns, times.started - offset_ns, times.finished - offset_ns)
    looked, received, started, finished = (moment / NS_PER_MS for moment in moments)
    sent = (times.sent - offset_ns) / NS_PER_MS
    arrived, decoded = frame.received_ns / NS_PER_MS, frame.decoded_ns / NS_PER_MS
    return {
        "send": received - looked,
        "wait": started - received,
        **inside,
        "other": finished - started - sum(inside.values()),
        "hold": sent - finished,
        "transfer": arrived - sent,
        "decode": decoded - arrived,
    }


class LatencyLog:
    """Gathers what a display sends and gets.

    Args:
        began_ns: when it began, by our clock.

    Attributes:
        stages: milliseconds by stage, of each frame that was the first to show a newer gaze.
        frames_ns: when each frame had come in, by our clock.
        image_bytes: length of all images.
    """

    def __init__(self, began_ns: int) -> None:
        self.began_ns = began_ns
        self.stages: list[dict[str, float]] = []
        self.frames_ns: list[int] = []
        self.image_bytes = 0
        self._looked_ns: dict[int, int] = {}
        self._newest = 0
        self._first: FrameHeader | None = None
        self._last: FrameHeader | None = None

    def looked(self, seq: int, at_ns: int) -> None:
        """The gaze with this number was handed over to be sent."""
        self._looked_ns[seq] = at_ns

    def shown(self, frame: DisplayFrame, offset_ns: int) -> None:
        """A frame was taken in. Refinements of what is shown already say nothing about latency."""
        header = frame.header
        self._first, self._last = self._first or header, header
        self.frames_ns.append(frame.received_ns)
        self.image_bytes += header.image_bytes
        seq = None if header.gaze is None else header.gaze.seq
        if seq is None or seq <= self._newest:
            return
        self._newest = seq
        looked_ns = self._looked_ns.get(seq)
        if looked_ns is not None and header.phase != "still":
            self.stages.append(stage_times(frame, looked_ns, offset_ns))

    @property
    def superseded(self) -> int:
        """Gazes that a newer one replaced at the service before they were rendered."""
        return self._counted("superseded")

    @property
    def dropped(self) -> int:
        """Frames that were rendered and not sent here."""
        return self._counted("dropped")

    def latencies_ms(self) -> list[float]:
        """From gaze to frame, of each frame that was the first to show a newer gaze [ms]."""
        return [sum(stages.values()) for stages in self.stages]

    def _counted(self, name: str) -> int:
        if self._first is None or self._last is None:
            return 0
        difference: int = getattr(self._last, name) - getattr(self._first, name)
        return difference


def percentiles(values: Sequence[float]) -> dict[str, float]:
    """Those of `PERCENTILES`, each a value that occurred: the least one that so many per cent do not exceed.

    Args:
        values: one or more.
    """
    ordered = sorted(values)
    ranks = {name: max(0, math.ceil(share / 100 * len(ordered)) - 1) for name, share in PERCENTILES.items()}
    return {name: round(ordered[rank], 3) for name, rank in ranks.items()}


def trailing_rates(frames_ns: Sequence[int], began_ns: int) -> list[int]:
    """At each frame, how many came in the second up to it; from one second after the beginning on."""
    return [
        index + 1 - bisect.bisect_right(frames_ns, at_ns - NS_PER_S)
        for index, at_ns in enumerate(frames_ns)
        if at_ns >= began_ns + NS_PER_S
    ]

"""Latency from gaze to frame: the stages add up, and only frames that show something newer count."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clients.display import DisplayFrame
from clients.latency import NS_PER_S, STAGES, LatencyLog, percentiles, stage_times, trailing_rates
from service.protocol import FrameGaze, FrameHeader, FramePhase, ServiceTimes

MS = 1_000_000


def seen(
    seq: int | None = 1,
    phase: FramePhase = "moving",
    moments_ms: tuple[float, ...] = (11, 15, 40, 42),
    stages: dict[str, float] | None = None,
    came_ms: tuple[float, float] = (45, 50),
    superseded: int = 0,
    dropped: int = 0,
    offset_ns: int = 0,
) -> DisplayFrame:
    """A frame whose moments are in milliseconds of the client's clock."""
    received, started, finished, sent = (round(moment * MS) + offset_ns for moment in moments_ms)
    gaze = None if seq is None else FrameGaze(1.0, 2.0, seq)
    counts: tuple[Any, ...] = (1.0, 1.0, superseded, dropped)
    times = ServiceTimes(received, started, finished, sent)
    header = FrameHeader(
        1, "s", 1, "matte", 8, 4, "jpeg", 7, phase, gaze, "live", *counts, stages or {"trace": 20.0}, times, {}
    )
    nothing = np.zeros((0, 0, 3), np.uint8)
    return DisplayFrame(header, b"picture", nothing, round(came_ms[0] * MS), round(came_ms[1] * MS))


def test_each_stage_is_what_it_says() -> None:
    stages = {"map": 2.0, "trace": 10.0, "reconstruct": 3.0, "encode": 4.0, "wait": 99.0, "total": 99.0}
    found = stage_times(seen(stages=stages, offset_ns=77), 10 * MS, 77)
    expected = {"send": 1.0, "wait": 4.0, "map": 2.0, "trace": 10.0, "reconstruct": 3.0, "encode": 4.0, "other": 6.0}
    assert found == pytest.approx({**expected, "hold": 2.0, "transfer": 3.0, "decode": 5.0}, abs=1e-6)
    assert tuple(found) == STAGES


@given(
    st.lists(st.integers(0, 10**6), min_size=7, max_size=7).map(sorted),
    st.integers(-(10**15), 10**15),
    st.floats(0, 100),
)
def test_the_stages_add_up_whatever_the_clocks(moments_us: list[int], offset_ns: int, trace_ms: float) -> None:
    looked, *inside, came, decoded = (moment / 1e3 for moment in moments_us)
    frame = seen(moments_ms=tuple(inside), stages={"trace": trace_ms}, came_ms=(came, decoded), offset_ns=offset_ns)
    assert sum(stage_times(frame, round(looked * MS), offset_ns).values()) == pytest.approx(decoded - looked, abs=1e-3)


def test_only_the_first_frame_for_a_newer_gaze_counts() -> None:
    log = LatencyLog(0)
    for seq in range(1, 8):
        log.looked(seq, 10 * seq * MS)
    log.shown(seen(None), 0)
    log.shown(seen(2), 0)
    log.shown(seen(2, "still"), 0)
    log.shown(seen(4, "still"), 0)  # the eye moved less than a cell's width: nothing new had to be shown
    log.shown(seen(4, "final"), 0)
    log.shown(seen(6, came_ms=(90, 95)), 0)
    log.shown(seen(3), 0)
    log.shown(seen(50), 0)  # somebody else's gaze
    assert log.latencies_ms() == pytest.approx([30.0, 35.0])
    assert len(log.frames_ns) == 8
    assert log.image_bytes == 8 * 7


def test_counts_are_those_since_the_first_frame() -> None:
    log = LatencyLog(0)
    assert (log.superseded, log.dropped) == (0, 0)
    log.shown(seen(1, superseded=40, dropped=3), 0)
    assert (log.superseded, log.dropped) == (0, 0)
    log.shown(seen(2, superseded=47, dropped=5), 0)
    assert (log.superseded, log.dropped) == (7, 2)


@given(st.lists(st.floats(0, 1e4), min_size=1, max_size=300))
def test_percentiles_are_values_that_so_many_do_not_exceed(values: list[float]) -> None:
    found = percentiles(values)
    for name, share in (("p50", 0.5), ("p95", 0.95), ("p99", 0.99), ("max", 1.0)):
        below = sum(round(value, 3) <= found[name] for value in values)
        assert below >= share * len(values) - 1e-9
        assert sum(round(value, 3) < found[name] for value in values) < share * len(values) + 1e-9


@given(st.lists(st.integers(0, 5 * NS_PER_S), max_size=60).map(sorted), st.integers(0, NS_PER_S))
def test_the_rate_counts_the_second_before_each_frame(frames_ns: list[int], began_ns: int) -> None:
    expected = [
        sum(at - NS_PER_S < other <= at for other in frames_ns[: index + 1])
        for index, at in enumerate(frames_ns)
        if at >= began_ns + NS_PER_S
    ]
    assert trailing_rates(frames_ns, began_ns) == expected

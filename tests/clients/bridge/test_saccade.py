"""Saccades as they happen, against what somebody saw in a real recording; and the filter that leaves them alone."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clients.bridge.codec import MILLISECOND_NS
from clients.bridge.one_euro import OneEuro
from clients.bridge.saccade import LONGEST_GAP_NS, SaccadeDetector
from clients.bridge.sample import Point
from clients.gaze_trace import GazeTrace
from tests.clients.bridge.recorded import Labelled, angles, labelled_saccades, recorded

__all__ = ["recorded"]

TOLERANCE_MS = 10
"""A label may begin so much later than the eye."""


def onsets(trace: GazeTrace, every: int, threshold_deg_s: float | None) -> tuple[list[float], list[bool]]:
    """Times at which a saccade is seen to begin [ms], and at which samples the eye is in one."""
    detector = SaccadeDetector(threshold_deg_s)
    found, moving, before = [], [], False
    for index, at in enumerate(angles(trace)):
        if index % every:
            continue
        now = False
        if at is None:
            detector.reset()
        else:
            now = detector.update(round(trace.time_ms[index] * MILLISECOND_NS), at)
        if now and not before:
            found.append(float(trace.time_ms[index]))
        moving.append(now)
        before = now
    return found, moving


def latencies(labelled: list[Labelled], found: list[float]) -> list[float]:
    """For each saccade that was seen, how long after its beginning [ms]."""
    late = []
    for saccade in labelled:
        seen = [at for at in found if saccade.begin_ms - TOLERANCE_MS <= at <= saccade.end_ms + TOLERANCE_MS]
        if seen:
            late.append(seen[0] - saccade.begin_ms)
    return late


def false_alarms(trace: GazeTrace, found: list[float]) -> tuple[int, float]:
    """Onsets in the midst of labelled fixations, and how many minutes of those there are."""
    step_ms = float(np.median(np.diff(trace.time_ms)))
    event = dict(zip(trace.time_ms.tolist(), trace.events, strict=True))
    near = [event.get(at + shift) for at in found for shift in (0.0,)]
    alarms = 0
    for at, here in zip(found, near, strict=True):
        around = {event.get(at + step * step_ms) for step in range(-5, 6)}
        alarms += here == "fixation" and around <= {"fixation", None}
    return alarms, sum(name == "fixation" for name in trace.events) * step_ms / 60_000


def test_at_250_hz_nearly_all_saccades_are_seen_within_10_ms(recorded: GazeTrace) -> None:
    labelled = labelled_saccades(recorded, 1.0)
    assert len(labelled) == 27
    found, _ = onsets(recorded, 2, 70.0)
    late = latencies(labelled, found)
    assert len(late) >= 0.99 * len(labelled)
    assert np.percentile(late, 90) <= 10
    alarms, minutes = false_alarms(recorded, found)
    assert minutes > 0.2
    assert alarms <= 15 * minutes


@pytest.mark.parametrize(("every", "least_share", "p90_ms"), [(1, 1.0, 10), (4, 1.0, 15), (8, 1.0, 24)])
def test_the_threshold_suits_the_rate(recorded: GazeTrace, every: int, least_share: float, p90_ms: float) -> None:
    labelled = labelled_saccades(recorded, 1.0)
    found, _ = onsets(recorded, every, None)
    late = latencies(labelled, found)
    assert len(late) >= least_share * len(labelled)
    assert np.percentile(late, 90) <= p90_ms
    alarms, minutes = false_alarms(recorded, found)
    assert alarms <= 15 * minutes


def feed(detector: SaccadeDetector, degrees: list[float], step_ms: float) -> list[bool]:
    return [detector.update(round(i * step_ms * MILLISECOND_NS), Point(x, 0.0)) for i, x in enumerate(degrees)]


def test_a_step_is_seen_at_once_and_ends_when_the_eye_rests() -> None:
    assert feed(SaccadeDetector(70), [0, 0, 0, 1, 2, 2, 2], 4) == [False, False, False, True, True, False, False]


def test_it_does_not_end_while_the_eye_only_slows_down() -> None:
    assert feed(SaccadeDetector(100), [0, 0, 1, 1.24, 1.25], 4) == [False, False, True, True, False]


def test_one_noisy_sample_at_1000_hz_is_no_saccade_but_two_are() -> None:
    noisy = [0.0] * 20 + [0.5] + [0.0] * 10
    assert not any(feed(SaccadeDetector(70), noisy, 1)[:21])
    assert feed(SaccadeDetector(70), [0.0] * 20 + [0.5, 1.0], 1)[-2:] == [False, True]


def test_thresholds_follow_the_rate() -> None:
    slow, fast = SaccadeDetector(), SaccadeDetector()
    feed(slow, [0.0] * 10, 1000 / 60)
    feed(fast, [0.0] * 10, 4)
    assert (slow.threshold_deg_s, fast.threshold_deg_s) == (30, 70)
    assert fast.rate_hz == pytest.approx(250)
    assert SaccadeDetector(55).threshold_deg_s == 55


def test_there_is_no_velocity_across_a_gap_or_backwards() -> None:
    detector = SaccadeDetector(70)
    assert feed(detector, [0.0, 0.0], 4) == [False, False]
    assert not detector.update(4 * MILLISECOND_NS + LONGEST_GAP_NS + 1, Point(30, 0))
    assert not detector.update(4 * MILLISECOND_NS, Point(0, 0))
    detector.reset()
    assert not detector.update(500 * MILLISECOND_NS, Point(0, 0))


# The filter


def smoothed(values: list[float], step_ms: float, **options: float) -> list[float]:
    euro = OneEuro(**options)
    return [euro.update(round(i * step_ms * MILLISECOND_NS), Point(x, -x)).x for i, x in enumerate(values)]


def test_the_filter_is_an_exponential_one_where_the_eye_rests() -> None:
    """With beta 0 a step is approached by 1/(1 + tau/T) a sample, tau = 1/(2 pi cutoff)."""
    out = smoothed([0.0] + [1.0] * 5, 4, beta=0.0, cutoff_hz=1.0)
    alpha = 1 / (1 + 1 / (2 * math.pi) / 0.004)
    np.testing.assert_allclose(out, [1 - (1 - alpha) ** i for i in range(6)], rtol=1e-9)


def test_the_filter_calms_a_resting_eye_and_follows_a_saccade() -> None:
    noise = np.random.default_rng(1).normal(0, 0.03, 500)
    rest = np.array(smoothed(noise.tolist(), 4))
    assert np.std(np.diff(rest[50:])) < np.std(np.diff(noise[50:])) / 3
    course = [0.0] * 50 + [10 * (10 * s**3 - 15 * s**4 + 6 * s**5) for s in np.linspace(0, 1, 11)] + [10.0] * 6
    assert smoothed(course, 4)[-1] == pytest.approx(10, abs=0.25)
    assert smoothed(course, 4, beta=0.0)[-1] < 5


def test_the_filter_begins_anew_after_a_gap_and_ignores_time_that_stands_still() -> None:
    euro = OneEuro()
    assert euro.update(0, Point(0, 0)) == (0, 0)
    euro.update(4 * MILLISECOND_NS, Point(0, 0))
    assert euro.update(4 * MILLISECOND_NS, Point(9, 9)) == (0, 0)
    assert euro.update(30 * MILLISECOND_NS, Point(20, 5)) == (20, 5)
    euro.reset()
    assert euro.update(34 * MILLISECOND_NS, Point(-3, 5)) == (-3, 5)


def test_the_filter_of_both_axes_is_the_same() -> None:
    euro = OneEuro()
    for i, x in enumerate([0.0, 1.0, 3.0, 2.0]):
        at = euro.update(i * 4 * MILLISECOND_NS, Point(x, -x))
        assert at.y == pytest.approx(-at.x)


def test_on_a_recording_the_filter_is_calmer_and_near(recorded: GazeTrace) -> None:
    euro, calm, raw, off = OneEuro(), [], [], []
    for index, at in enumerate(angles(recorded)):
        if at is None:
            euro.reset()
            continue
        out = euro.update(round(recorded.time_ms[index] * MILLISECOND_NS), at)
        if recorded.events[index] == "fixation":
            calm.append(out)
            raw.append(at)
            off.append(math.dist(out, at))
    assert rms_step(calm) < rms_step(raw) / 2
    assert np.percentile(off, 95) < 0.3


def rms_step(points: list[Point]) -> float:
    steps = np.linalg.norm(np.diff(np.array(points), axis=0), axis=1)
    return float(np.sqrt(np.mean(np.sort(steps)[: int(0.98 * len(steps))] ** 2)))

"""The device's clock on ours, and ours on the service's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clients.bridge.clock import JUMP_NS, LEAST_SPAN_NS, MOST_DRIFT, DeviceClock, lower_hull
from clients.bridge.codec import MICROSECOND_NS, MILLISECOND_NS, SECOND_NS

STEP_NS = 4 * MILLISECOND_NS
START = 7_000 * SECOND_NS


def delays(count: int, seed: int = 0) -> list[int]:
    """One-sided jitter: 0.2 ms at least, 2 ms on average, now and then 20."""
    generator = np.random.default_rng(seed)
    jitter = generator.exponential(2e6, count) + 20e6 * (generator.random(count) < 0.02)
    return (200_000 + jitter).astype(int).tolist()


def test_a_device_without_a_clock_is_dated_by_its_arrival() -> None:
    clock = DeviceClock((), latency_ns=12_500_000)
    assert clock.map(None, 1_000_000_000) == (None, 987_500_000)


def test_jitter_goes_and_the_least_delay_stays() -> None:
    clock = DeviceClock((MILLISECOND_NS,))
    errors = []
    for i, delay in enumerate(delays(5000)):
        mapped = clock.map(float(i * 4), START + i * STEP_NS + delay)
        assert mapped.tracker_time_ns == i * STEP_NS
        errors.append(mapped.captured_ns - (START + i * STEP_NS))
    assert max(errors[250:]) < MILLISECOND_NS
    assert min(errors) >= 200_000
    assert np.ptp(errors[250:]) < MILLISECOND_NS


def test_the_least_delay_counts_from_the_moment_it_is_seen() -> None:
    clock = DeviceClock((MILLISECOND_NS,))
    for i, delay in enumerate([MILLISECOND_NS] * 5 + [200_000, MILLISECOND_NS]):
        mapped = clock.map(float(i * 4), START + i * STEP_NS + delay)
    assert mapped.captured_ns == START + 6 * STEP_NS + 200_000


@pytest.mark.parametrize("ppm", [-100, 50, 300])
def test_drift_is_followed(ppm: float) -> None:
    clock = DeviceClock((MICROSECOND_NS,))
    errors = []
    for i, delay in enumerate(delays(250 * 60)):
        true_ns = i * STEP_NS
        mapped = clock.map(round(true_ns * (1 + ppm * 1e-6) / 1000), START + true_ns + delay)
        errors.append(mapped.captured_ns - START - true_ns)
    assert clock.drift == pytest.approx(-ppm * 1e-6, abs=2e-5)
    assert np.abs(errors[250 * 20 :]).max() < MILLISECOND_NS
    assert min(errors) > -abs(ppm) * 1e-6 * LEAST_SPAN_NS


def test_capture_never_comes_after_arrival_and_latency_is_taken_off() -> None:
    clock = DeviceClock((MILLISECOND_NS,), latency_ns=3 * MILLISECOND_NS)
    for i, delay in enumerate(delays(1000, 3)):
        arrival = START + i * STEP_NS + delay
        assert clock.map(float(i * 4), arrival).captured_ns <= arrival - 3 * MILLISECOND_NS


@pytest.mark.parametrize(("tick_ns", "steps"), [(MILLISECOND_NS, (8, 9)), (MICROSECOND_NS, (8000, 9000))])
def test_the_rate_tells_milliseconds_from_microseconds(tick_ns: int, steps: tuple[int, int]) -> None:
    """Values of the size of microseconds that are milliseconds: only the increments tell."""
    clock = DeviceClock((MILLISECOND_NS, MICROSECOND_NS))
    ticks, arrival = 100_527_788, START
    mapped = clock.map(float(ticks), arrival)
    assert mapped == (None, arrival)
    for i, delay in enumerate(delays(200)):
        ticks += steps[i % 2]
        arrival += steps[i % 2] * tick_ns
        mapped = clock.map(float(ticks), arrival + delay)
    assert mapped.tracker_time_ns == ticks * tick_ns
    assert mapped.captured_ns == pytest.approx(arrival, abs=MILLISECOND_NS)


@pytest.mark.parametrize("rate_hz", [50, 60, 120, 240, 360])
def test_the_rate_tells_how_long_a_frame_is_and_the_counter_may_wrap(rate_hz: int) -> None:
    candidates = tuple(SECOND_NS / rate for rate in (50, 60, 120, 240, 360))
    clock = DeviceClock(candidates, wrap=65_536)
    times = []
    for i, delay in enumerate(delays(rate_hz * 4)):
        frame = (65_536 - rate_hz * 2 + i) % 65_536
        mapped = clock.map(float(frame), START + round(i * SECOND_NS / rate_hz) + delay)
        if mapped.tracker_time_ns is not None:
            times.append(mapped.tracker_time_ns)
    assert len(times) > rate_hz * 2
    np.testing.assert_allclose(np.diff(times)[2:], SECOND_NS / rate_hz, atol=1)
    assert clock.restarts <= 1


def test_one_damaged_time_changes_nothing_but_a_set_clock_is_followed() -> None:
    clock = DeviceClock((MILLISECOND_NS,))
    for i in range(500):
        clock.map(float(i * 4), START + i * STEP_NS + 300_000)
    for damaged in (2000.0 + 9_000_000, 7.0):
        arrival = START + 500 * STEP_NS
        assert clock.map(damaged, arrival) == (None, arrival)
        assert clock.map(2000.0, arrival).captured_ns == pytest.approx(arrival, abs=400_000)
    assert clock.restarts == 0
    for i in range(10):
        arrival = START + (501 + i) * STEP_NS + 300_000
        mapped = clock.map(float(50 + i * 4), arrival)
    assert clock.restarts == 1
    assert mapped == ((50 + 36) * MILLISECOND_NS, arrival)


def test_the_first_samples_may_have_been_delayed() -> None:
    clock = DeviceClock((MILLISECOND_NS,))
    for i in range(10):
        clock.map(float(i * 4), START + 40 * MILLISECOND_NS + i * 1000)
    for i in range(10, 20):
        mapped = clock.map(float(i * 4), START + i * STEP_NS + 300_000)
    assert mapped.captured_ns == START + 19 * STEP_NS + 300_000
    assert JUMP_NS < 40 * MILLISECOND_NS


def test_a_repeated_time_is_no_jump() -> None:
    clock = DeviceClock((MILLISECOND_NS,))
    for i in range(100):
        mapped = clock.map(float(i // 2), START + i * MILLISECOND_NS // 2)
        assert mapped.tracker_time_ns == i // 2 * MILLISECOND_NS


def test_after_a_restart_nothing_of_the_past_counts() -> None:
    clock = DeviceClock((MILLISECOND_NS,))
    clock.map(10**6, START)
    clock.restart()
    assert clock.map(5.0, START + 1) == (5 * MILLISECOND_NS, START + 1)


@settings(max_examples=100)
@given(st.lists(st.integers(-(10**6), 10**6), min_size=1, max_size=30))
def test_the_lower_hull_lies_below_all_points_and_is_convex(heights: list[int]) -> None:
    points = [(3 * i, y) for i, y in enumerate(heights)]
    hull = lower_hull(points)
    assert (hull[0], hull[-1]) == (points[0], points[-1])
    below = np.interp([x for x, _ in points], [x for x, _ in hull], [y for _, y in hull])
    assert (below <= np.array(heights) + 1e-6).all()
    slopes = np.diff([y for _, y in hull]) / np.diff([x for x, _ in hull])
    assert (np.diff(slopes) > 0).all()
    assert 0 < MOST_DRIFT < 1e-3
